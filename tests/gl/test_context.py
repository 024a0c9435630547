"""Every way in which a machine can lack OpenGL is one sentence with the fix."""

from __future__ import annotations

import os
import subprocess
import sys

import moderngl
import pytest

from app import context
from app.context import DEBIAN_PACKAGES, ContextError, headless_context
from app.errors import InputError


@pytest.mark.parametrize(
    ("message", "says"),
    [
        ("libEGL.so.1 not loaded", "the system library libEGL is missing"),
        ("libGL.so.1 not loaded", "the system library libGL is missing"),
        ("libX11.so.6 not loaded", "the system library libX11 is missing"),
        ("requested device index 0, but found 0 devices", "no device to render on"),
        ("eglInitialize failed (0x3001)", "could not start its driver"),
        ("eglCreateContext failed (0x3009)", "refuses OpenGL 4.1"),
        ("Requested OpenGL version 410, got version 330", "refuses OpenGL 4.1"),
        ("(standalone) XOpenDisplay: cannot open display", "set DISPLAY"),
        ("something nobody foresaw", "something nobody foresaw"),
    ],
)
def test_failures_are_sentences(monkeypatch: pytest.MonkeyPatch, message: str, says: str) -> None:
    def refuse(**_: object) -> None:
        raise Exception(message)

    monkeypatch.setattr(context, "Window", refuse)
    with pytest.raises(ContextError) as caught:
        headless_context()
    text = str(caught.value)
    assert says in text
    assert message in text, "the driver's own words help whoever is asked"
    assert "\n" not in text
    assert isinstance(caught.value, InputError), "the command line knows what to do with it"


@pytest.mark.parametrize("library", ["libEGL.so.1", "libGL.so.1", "something else"])
def test_missing_libraries_name_the_packages(library: str) -> None:
    assert DEBIAN_PACKAGES in context.explain_failure(f"{library} not loaded")


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="EGL is Linux's way")
def test_a_machine_without_a_driver() -> None:
    script = "from app.context import headless_context; headless_context()"
    environment = {**os.environ, "__EGL_VENDOR_LIBRARY_FILENAMES": "/nonexistent"}
    done = subprocess.run(
        [sys.executable, "-c", script], env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 1
    last = done.stderr.strip().splitlines()[-1]
    assert last.startswith("app.context.ContextError: no OpenGL: ")


def test_version(ctx: moderngl.Context) -> None:
    assert ctx.version_code >= 410
