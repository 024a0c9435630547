"""What a driver's float32 arithmetic does, found by trying it."""

from __future__ import annotations

import moderngl
import numpy as np

from app.render.state import begin_pass, release_framebuffer

_VERTEX = """#version 410 core
void main()
{
    gl_Position = vec4(vec2((gl_VertexID << 1) & 2, gl_VertexID & 2) * 2.0 - 1.0, 0.0, 1.0);
}
"""
_FRAGMENT = """#version 410 core
uniform vec2 factors;
layout(location = 0) out float error;
void main()
{
    precise float product = factors.x * factors.y;
    precise float rest = fma(factors.x, factors.y, -product);
    error = rest;
}
"""


def has_exact_fma(ctx: moderngl.Context) -> bool:
    """Return whether GLSL's ``fma`` rounds once, as processors' do.

    GLSL 4.10 allows a product rounded on its own, and Mesa's llvmpipe makes use of
    it. ``shaders/ltc/polygon.glsl`` takes rounding errors of products from ``fma`` where
    this is true, in one instruction instead of seventeen.
    """
    factors = np.array([1.0 + 2.0**-12, 1.0 + 2.0**-13], dtype=np.float32)
    exact = float(np.float64(factors[0]) * np.float64(factors[1]) - factors[0] * factors[1])
    program = ctx.program(vertex_shader=_VERTEX, fragment_shader=_FRAGMENT)
    if "factors" not in program:  # the compiler took the difference to be zero
        program.release()
        return False
    target = ctx.texture((1, 1), 1, dtype="f4")
    framebuffer = ctx.framebuffer([target])
    vertices = ctx.vertex_array(program, [])
    try:
        begin_pass(framebuffer, (1, 1))
        program["factors"] = tuple(float(f) for f in factors)
        vertices.render(moderngl.TRIANGLES, vertices=3)
        return bool(np.frombuffer(target.read(), dtype=np.float32)[0] == np.float32(exact))
    finally:
        release_framebuffer(framebuffer)
        for item in (vertices, target, program):
            item.release()
