"""How far a picture made of random samples is from what it converges to, told by itself.

Even and odd samples of a pixel run through two sequences that are scrambled apart
(`ltc.sequence`), so their means A and B are independent estimates with the same error, and
(A - B)^2 / 4 is an unbiased estimate of the variance of the picture (A + B) / 2. It counts
whatever low-discrepancy points gain, which the spread of single samples does not know of: that
would say seven times too much after 1,024 samples. Of one pixel it says little, of
thousands it says the picture's error to a few per cent.

What it measures is the noise of reflected light. Edges, which samples smooth at places that
are the same in every pixel, differ a little between even and odd samples too, and add to it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import moderngl
import numpy as np

from app.render.programs import Programs, ProgramSpec, set_uniform
from app.render.state import FullScreenTriangle, begin_pass, release_framebuffer

BLOCK = 16
"""Pixels a side that the shader sums: ``shaders/passes/noise.frag``."""

SPEC = ProgramSpec.of("noise", "passes/fullscreen.vert", "passes/noise.frag")


@dataclass(frozen=True, slots=True)
class Noise:
    """The estimated error of a picture, of the luminance that its surfaces reflect.

    Attributes
    ----------
    error : float
        Root of the mean square over all pixels that show a surface, of the standard error of
        a pixel [W m^-2 sr^-1].
    mean : float
        Mean of these pixels [W m^-2 sr^-1].
    samples : int
        After so many samples.
    """

    error: float
    mean: float
    samples: int

    @property
    def relative(self) -> float:
        """The error as a share of the mean; 0 where nothing is reflected."""
        return self.error / self.mean if self.mean > 0.0 else 0.0


class NoisePass:
    """Estimates a picture's noise on the GPU."""

    def __init__(self, ctx: moderngl.Context, programs: Programs) -> None:
        self._ctx = ctx
        self._programs = programs
        self._triangle = FullScreenTriangle(ctx)

    def measure(
        self,
        surfaces: moderngl.Texture,
        radiance: moderngl.Texture,
        noise: moderngl.Texture,
        samples: int,
    ) -> Noise:
        """Return the noise of a picture after an even number of samples."""
        width, height = radiance.size
        size = (-(-width // BLOCK), -(-height // BLOCK))
        texture = self._ctx.texture(size, 4, dtype="f4")
        target = self._ctx.framebuffer([texture])
        try:
            begin_pass(target, size)
            program = self._programs.get(SPEC)
            inputs = {"surfaces": surfaces, "radiance": radiance, "noise": noise}
            for unit, (name, given) in enumerate(inputs.items()):
                set_uniform(program, name, unit)
                given.use(unit)
            self._triangle.draw(program)
            sums = np.frombuffer(target.read(components=4, dtype="f4"), dtype=np.float32)
        finally:
            release_framebuffer(target)
            texture.release()
        total, squares, pixels, _ = sums.reshape(-1, 4).sum(axis=0, dtype=np.float64)
        count = max(pixels, 1.0)
        return Noise(math.sqrt(squares / count), float(total / count), samples)

    def release(self) -> None:
        """Release every GPU object."""
        self._triangle.release()
