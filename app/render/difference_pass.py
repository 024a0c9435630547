"""The pass that shows two pictures' difference in false colours."""

from __future__ import annotations

import moderngl
import numpy as np
from numpy.typing import NDArray

from app.render.difference import NOT_A_NUMBER, Scale
from app.render.post import set_map
from app.render.programs import Programs, ProgramSpec, set_uniform
from app.render.state import FullScreenTriangle, begin_pass, release_framebuffer


def difference_spec(scale: Scale) -> ProgramSpec:
    """Return the program of a scale; the values at its ends are uniforms."""
    features = {
        "SHOWS_VALUES": int(scale.view == "flip"),
        "IS_RELATIVE": int(scale.view == "relative"),
        "IS_ABSOLUTE": int(scale.view == "absolute"),
        "LARGEST_CHANNEL": int(scale.measure == "largest channel"),
        "MAP_COLORS": len(scale.colours),
    }
    return ProgramSpec.of(
        "difference", "passes/fullscreen.vert", "passes/difference.frag", features
    )


class DifferencePass:
    """Owner of the picture of differences, and of values that were computed elsewhere."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._programs = Programs(ctx)
        self._triangle = FullScreenTriangle(ctx)
        self._target: moderngl.Framebuffer | None = None
        self._values: moderngl.Texture | None = None

    def draw(
        self,
        a: moderngl.Texture,
        b: moderngl.Texture,
        scale: Scale,
        floor: float,
        size: tuple[int, int],
    ) -> moderngl.Texture:
        """Return the colours of a difference as an RGBA8 texture, row 0 at the bottom.

        Parameters
        ----------
        a, b : texture
            Radiance; a smaller picture is stretched to ``size``, pixel by pixel.
        scale : Scale
            Of a view other than FLIP.
        floor : float
            Least radiance that relative differences divide by.
        size : (width, height)
        """
        inputs = {"radiance_a": a, "radiance_b": b}
        return self._draw(inputs, scale, size, least_divisor=floor)

    def draw_values(self, scale: Scale, size: tuple[int, int]) -> moderngl.Texture:
        """Return the colours of what `set_values` was given.

        Raises
        ------
        RuntimeError
            If it was given nothing yet.
        """
        if self._values is None:
            raise RuntimeError("there are no values to show yet")
        return self._draw({"values": self._values}, scale, size)

    def set_values(self, values: NDArray[np.floating]) -> None:
        """Hold values (h, w), row 0 at the top."""
        height, width = values.shape
        texels = np.ascontiguousarray(values[::-1], dtype=np.float32)
        if self._values is not None and self._values.size != (width, height):
            self._values.release()
            self._values = None
        if self._values is None:
            self._values = self._ctx.texture((width, height), 1, dtype="f4")
            self._values.filter = (moderngl.NEAREST, moderngl.NEAREST)
        self._values.write(texels.tobytes())

    def _draw(
        self,
        inputs: dict[str, moderngl.Texture],
        scale: Scale,
        size: tuple[int, int],
        **uniforms: float,
    ) -> moderngl.Texture:
        target = self._framebuffer(size)
        program = self._programs.get(difference_spec(scale))
        begin_pass(target, size)
        for unit, (name, texture) in enumerate(inputs.items()):
            texture.use(unit)
            set_uniform(program, name, unit)
        for name, value in {**uniforms, "low": scale.low, "high": scale.high}.items():
            set_uniform(program, name, value)
        set_uniform(program, "picture_size", size)
        set_uniform(program, "bad_color", tuple(c / 255.0 for c in NOT_A_NUMBER))
        set_map(program, scale.colours)
        self._triangle.draw(program)
        colours = target.color_attachments[0]
        assert isinstance(colours, moderngl.Texture)
        return colours

    def _framebuffer(self, size: tuple[int, int]) -> moderngl.Framebuffer:
        if self._target is not None and self._target.size != size:
            self._release_target()
        if self._target is None:
            texture = self._ctx.texture(size, 4)
            texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
            self._target = self._ctx.framebuffer(color_attachments=[texture])
        return self._target

    def _release_target(self) -> None:
        if self._target is not None:
            texture = self._target.color_attachments[0]
            release_framebuffer(self._target)
            texture.release()
            self._target = None

    def release(self) -> None:
        """Release every GPU object."""
        self._release_target()
        if self._values is not None:
            self._values.release()
            self._values = None
        self._triangle.release()
        self._programs.release()
