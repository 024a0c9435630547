"""An OpenGL context without a window, or one sentence that says what is missing.

The window has its own context (hello_imgui makes it); everything else, from
``shot`` to the tests, gets one here through moderngl-window's headless window.
"""

from __future__ import annotations

import sys

import moderngl
from moderngl_window.context.headless.window import Window

from app.errors import InputError

GL_VERSION = (4, 1)
"""The last version that macOS has."""

DEBIAN_PACKAGES = "libegl1 libgl1 libgl1-mesa-dri libx11-6 libxext6"

_INSTALL = f"install it, on Debian or Ubuntu with 'apt-get install {DEBIAN_PACKAGES}'"

_TOO_OLD = (
    f"the graphics driver refuses OpenGL {GL_VERSION[0]}.{GL_VERSION[1]}: update it, or set "
    "LIBGL_ALWAYS_SOFTWARE=1 to render on the CPU, and unset MESA_GL_VERSION_OVERRIDE if you set it"
)

# A part of the driver's or loader's message, and what it means to the user.
_FAILURES = (
    ("libEGL", f"the system library libEGL is missing: {_INSTALL}"),
    ("libGL", f"the system library libGL is missing: {_INSTALL}"),
    ("libX11", f"the system library libX11 is missing: {_INSTALL}"),
    (
        "requested device index",
        "EGL found no device to render on: install a graphics driver, Mesa's software rasteriser "
        f"at least, on Debian or Ubuntu with 'apt-get install {DEBIAN_PACKAGES}'",
    ),
    (
        "eglInitialize",
        "EGL could not start its driver: "
        f"install one, on Debian or Ubuntu with 'apt-get install {DEBIAN_PACKAGES}', "
        "and check LIBGL_ALWAYS_SOFTWARE and EGL_PLATFORM if you set them",
    ),
    (
        "XOpenDisplay",
        "the X display cannot be opened: set DISPLAY to a running X server, or render without "
        "a window ('ltc-viewer shot')",
    ),
    ("eglCreateContext", _TOO_OLD),
    ("Requested OpenGL version", _TOO_OLD),
    ("glXCreateContext", _TOO_OLD),
)


class ContextError(InputError):
    """No OpenGL context can be had. The message says what is missing and how to get it."""


def headless_context() -> moderngl.Context:
    """Return a new OpenGL context without a window.

    On Linux through EGL, which needs neither display nor X server; elsewhere
    through the system's own way. One process should make one and keep it.

    Raises
    ------
    ContextError
        With one sentence for the user.
    """
    backend = "egl" if sys.platform.startswith("linux") else None
    try:
        window = Window(gl_version=GL_VERSION, size=(1, 1), backend=backend, vsync=False)
    except Exception as error:
        raise ContextError(explain_failure(str(error))) from error
    ctx: moderngl.Context = window.ctx
    return ctx


def explain_failure(message: str) -> str:
    """Return the sentence for a message that creating a context failed with."""
    for part, sentence in _FAILURES:
        if part.casefold() in message.casefold():
            return f"no OpenGL: {sentence} ({' '.join(message.split())})"
    return (
        f"no OpenGL {GL_VERSION[0]}.{GL_VERSION[1]} context could be made: "
        f"{' '.join(message.split())}; on Debian or Ubuntu try 'apt-get install {DEBIAN_PACKAGES}'"
    )
