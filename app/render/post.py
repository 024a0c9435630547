"""The display pass: from linear radiance to 8-bit sRGB, in the window or in a file."""

from __future__ import annotations

import moderngl
import numpy as np

from app.colour_maps import VIRIDIS, ColourMap
from app.render.cost import EMPTY, NONE, OCTAVES
from app.render.programs import Programs, ProgramSpec, set_uniform
from app.render.state import FullScreenTriangle, begin_pass
from app.scene import TONE_MAPS, Display, PixelView


def display_spec(display: Display, view: PixelView = "radiance") -> ProgramSpec:
    """Return the display program of a tone map, or of costs; exposure is a uniform."""
    shows_cost = view == "cost"
    features = {
        f"TONE_MAP_{name.upper()}": int(name == display.tone_map and not shows_cost)
        for name in TONE_MAPS
    }
    features["SHOWS_COST"] = int(shows_cost)
    features["MAP_COLORS"] = len(VIRIDIS) if shows_cost else 0
    return ProgramSpec.of("display", "passes/fullscreen.vert", "passes/display.frag", features)


def set_map(program: moderngl.Program, colours: ColourMap) -> None:
    """Set the colours of ``shaders/common/color_map.glsl``."""
    values = [tuple(float(c) for c in row) for row in np.array(colours) / 255.0]
    set_uniform(program, "map_colors", values)


class DisplayPass:
    """Draws the radiance, or the cost, as it should look."""

    def __init__(self, ctx: moderngl.Context, programs: Programs) -> None:
        self._programs = programs
        self._triangle = FullScreenTriangle(ctx)

    def draw(
        self,
        target: moderngl.Framebuffer,
        radiance: moderngl.Texture,
        display: Display,
        view: PixelView = "radiance",
    ) -> None:
        """Fill ``target`` from its lower left corner, pixel by pixel."""
        program = self._programs.get(display_spec(display, view))
        begin_pass(target, radiance.size)
        set_uniform(program, "radiance", 0)
        radiance.use(0)
        set_uniform(program, "exposure_scale", 2.0**display.exposure)
        if view == "cost":
            set_map(program, VIRIDIS)
            set_uniform(program, "cost_octaves", float(OCTAVES))
            set_uniform(program, "cost_none", tuple(c / 255.0 for c in NONE))
            set_uniform(program, "cost_empty", tuple(c / 255.0 for c in EMPTY))
        self._triangle.draw(program)

    def release(self) -> None:
        """Release every GPU object."""
        self._triangle.release()
