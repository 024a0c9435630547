"""The fixed-function state that a pass runs in, all of it, whatever was set before."""

from __future__ import annotations

import moderngl

# Capabilities that a window's toolkit may leave on, or that GL starts with, and that
# moderngl does not track.
_GL_DITHER = 0x0BD0
_GL_STENCIL_TEST = 0x0B90
_GL_COLOR_LOGIC_OP = 0x0BF2
_GL_POLYGON_OFFSET_FILL = 0x8037
_GL_MULTISAMPLE = 0x809D
_GL_SAMPLE_ALPHA_TO_COVERAGE = 0x809E
_GL_SAMPLE_COVERAGE = 0x80A0
_GL_FRAMEBUFFER_SRGB = 0x8DB9
_GL_DEPTH_CLAMP = 0x864F
_GL_PRIMITIVE_RESTART = 0x8F9D
_FOREIGN = (
    _GL_DITHER,
    _GL_STENCIL_TEST,
    _GL_COLOR_LOGIC_OP,
    _GL_POLYGON_OFFSET_FILL,
    _GL_MULTISAMPLE,
    _GL_SAMPLE_ALPHA_TO_COVERAGE,
    _GL_SAMPLE_COVERAGE,
    _GL_FRAMEBUFFER_SRGB,
    _GL_DEPTH_CLAMP,
    _GL_PRIMITIVE_RESTART,
)


def begin_pass(
    target: moderngl.Framebuffer, size: tuple[int, int], *, depth: bool = False
) -> moderngl.Context:
    """Bind ``target`` with a viewport of ``size`` and a known state; return its context.

    Nothing is blended, culled, scissored or masked; depth is tested and written
    only if ``depth``.
    """
    ctx: moderngl.Context = target.ctx
    target.viewport = (0, 0, *size)
    target.scissor = None  # type: ignore[assignment]  # the stub forgets that None disables
    if len(target.color_attachments) <= 1:
        target.color_mask = (True, True, True, True)
    target.depth_mask = True
    target.use()
    ctx.enable_only(moderngl.DEPTH_TEST if depth else moderngl.NOTHING)
    for capability in _FOREIGN:
        ctx.disable_direct(capability)
    ctx.depth_func = "<"
    ctx.front_face = "ccw"
    ctx.cull_face = "back"
    ctx.wireframe = False
    ctx.clear_samplers()
    return ctx


def release_framebuffer(framebuffer: moderngl.Framebuffer) -> None:
    """Release a framebuffer that may be bound.

    moderngl binds the last used one again after making another, which is a GL
    error if it is gone; so the default framebuffer becomes the last used.
    """
    ctx: moderngl.Context = framebuffer.ctx
    # Contexts without a window have no `screen`.
    (ctx.screen or ctx.detect_framebuffer(0)).use()
    framebuffer.release()


class FullScreenTriangle:
    """Three vertices and no buffer: runs a fragment shader over a whole target, as a rule."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._array: moderngl.VertexArray | None = None
        self._program: moderngl.Program | None = None

    def draw(self, program: moderngl.Program) -> None:
        """Draw with ``program``, whose vertex shader places the corners by gl_VertexID."""
        if self._array is None or self._program is not program:
            self.release()
            self._array = self._ctx.vertex_array(program, [])
            self._program = program
        self._array.render(vertices=3)

    def release(self) -> None:
        """Release the vertex array."""
        if self._array is not None:
            self._array.release()
        self._array = self._program = None
