"""The same context and renderer as in tests/gl."""

from tests.gl.conftest import ctx, renderer, session_context

__all__ = ["ctx", "renderer", "session_context"]
