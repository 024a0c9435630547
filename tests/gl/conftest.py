"""One OpenGL context for all tests here; each test must leave it without an error."""

from __future__ import annotations

from collections.abc import Iterator

import moderngl
import numpy as np
import pytest

from app.context import headless_context
from app.render.renderer import Renderer


@pytest.fixture(scope="session")
def session_context() -> Iterator[moderngl.Context]:
    context = headless_context()
    yield context
    context.release()


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
