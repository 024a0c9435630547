"""What a driver's float32 arithmetic does, found by trying it."""

from __future__ import annotations

import moderngl
import numpy as np

from app.render.programs import Programs, ProgramSpec
from app.render.state import FullScreenTriangle, begin_pass, release_framebuffer

SPEC = ProgramSpec.of("exact fma", "passes/fullscreen.vert", "passes/exact_fma.frag")


def has_exact_fma(ctx: moderngl.Context) -> bool:
    """Return whether GLSL's ``fma`` rounds once, as processors' do.

    GLSL 4.10 allows a product rounded on its own, and Mesa's llvmpipe makes use of
    it. ``shaders/ltc/polygon.glsl`` takes rounding errors of products from ``fma`` where
    this is true, in one instruction instead of seventeen.
    """
    factors = np.array([1.0 + 2.0**-12, 1.0 + 2.0**-13], dtype=np.float32)
    exact = float(np.float64(factors[0]) * np.float64(factors[1]) - factors[0] * factors[1])
    programs = Programs(ctx)
    program = programs.get(SPEC)
    if "factors" not in program:  # the compiler took the difference to be zero
        programs.release()
        return False
    triangle = FullScreenTriangle(ctx)
    target = ctx.texture((1, 1), 1, dtype="f4")
    framebuffer = ctx.framebuffer([target])
    try:
        begin_pass(framebuffer, (1, 1))
        program["factors"] = tuple(float(f) for f in factors)
        triangle.draw(program)
        return bool(np.frombuffer(target.read(), dtype=np.float32)[0] == np.float32(exact))
    finally:
        release_framebuffer(framebuffer)
        for item in (triangle, target, programs):
            item.release()
