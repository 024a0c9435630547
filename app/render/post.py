"""The display pass: from linear radiance to 8-bit sRGB, in the window or in a file."""

from __future__ import annotations

import moderngl

from app.render.programs import Programs, ProgramSpec, set_uniform
from app.render.state import FullScreenTriangle, begin_pass
from app.scene import TONE_MAPS, Display


def display_spec(display: Display) -> ProgramSpec:
    """Return the display program of a tone map; exposure is a uniform."""
    features = {f"TONE_MAP_{name.upper()}": int(name == display.tone_map) for name in TONE_MAPS}
    return ProgramSpec.of("display", "passes/fullscreen.vert", "passes/display.frag", features)


class DisplayPass:
    """Draws the radiance as it should look."""

    def __init__(self, ctx: moderngl.Context, programs: Programs) -> None:
        self._programs = programs
        self._triangle = FullScreenTriangle(ctx)

    def draw(
        self, target: moderngl.Framebuffer, radiance: moderngl.Texture, display: Display
    ) -> None:
        """Fill ``target`` from its lower left corner, pixel by pixel."""
        program = self._programs.get(display_spec(display))
        begin_pass(target, radiance.size)
        set_uniform(program, "radiance", 0)
        radiance.use(0)
        set_uniform(program, "exposure_scale", 2.0**display.exposure)
        self._triangle.draw(program)

    def release(self) -> None:
        """Release every GPU object."""
        self._triangle.release()
