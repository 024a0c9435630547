"""One OpenGL context for all tests here; each test must leave it without an error."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

import moderngl
import numpy as np
import pytest

from app.context import headless_context
from app.render.renderer import Renderer


@cache
def process_context() -> moderngl.Context:
    """Return the one context of this process; it lives as long."""
    return headless_context()


@pytest.fixture(scope="session")
def session_context() -> moderngl.Context:
    return process_context()


@pytest.fixture
def ctx(session_context: moderngl.Context) -> Iterator[moderngl.Context]:
    with session_context, np.errstate(all="raise", under="ignore"):
        assert session_context.error == "GL_NO_ERROR", "a GL error was pending before the test"
        yield session_context
        assert session_context.error == "GL_NO_ERROR", "the test left a GL error"


@pytest.fixture
def renderer(ctx: moderngl.Context) -> Iterator[Renderer]:
    renderer = Renderer(ctx)
    yield renderer
    renderer.release()
