"""Make ``.venv`` ready: ``python3 .ci/setup.py``, called by the Makefile.

Needs nothing but a Python. Creates the virtual environment (with uv where
that is installed, else with venv and pip), installs the program and its test
tools into it, and tries whether OpenGL works. Where Linux lacks the libraries
for that, they are installed if we may (root, apt-get), else the line to type
is printed. Every failure ends with one sentence on stderr and exit code 1.
"""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
VENV = ROOT / ".venv"
VENV_PYTHON = VENV / "bin" / "python"
OLDEST = (3, 11)

DEBIAN_GL = ["libegl1", "libgl1", "libgl1-mesa-dri", "libx11-6", "libxext6"]
GL_LINES = {
    "apt-get": "apt-get install " + " ".join(DEBIAN_GL),
    "dnf": "dnf install mesa-libEGL mesa-libGL mesa-dri-drivers libX11 libXext",
    "pacman": "pacman -S mesa libglvnd libx11 libxext",
    "zypper": "zypper install Mesa-libEGL1 Mesa-libGL1 Mesa-dri libX11-6 libXext6",
    "apk": "apk add mesa-egl mesa-gl mesa-dri-gallium libx11 libxext",
}

GL_PROBE = """
import sys
import glfw, imgui_bundle, moderngl
backend = {"backend": "egl"} if sys.platform.startswith("linux") else {}
context = moderngl.create_context(standalone=True, require=410, **backend)
print("OpenGL:", context.info["GL_RENDERER"])
"""


def fail(sentence: str) -> None:
    """Print one sentence and leave."""
    print(f"setup: {sentence}", file=sys.stderr)
    raise SystemExit(1)


def say(line: str) -> None:
    print(f"setup: {line}", flush=True)


def run(command: list[str]) -> bool:
    """Run a command with its output shown; tell whether it succeeded."""
    return subprocess.run(command, cwd=str(ROOT), check=False).returncode == 0


def root_may_apt() -> bool:
    return os.geteuid() == 0 and shutil.which("apt-get") is not None


def apt_install(packages: list[str]) -> bool:
    """Install Debian packages, refreshing the package lists if that is needed."""
    os.environ["DEBIAN_FRONTEND"] = "noninteractive"
    install = ["apt-get", "install", "-y", "-qq", "--no-install-recommends", *packages]
    say("installing " + " ".join(packages))
    quiet = subprocess.run(install, capture_output=True, check=False)
    return quiet.returncode == 0 or (run(["apt-get", "update", "-qq"]) and run(install))


def check_python() -> None:
    """The Makefile looks for a new enough Python; this is for those who name one."""
    if sys.version_info < OLDEST:
        fail(
            "this is Python {}.{}, but ltc-viewer needs Python 3.11 or newer.".format(
                *sys.version_info[:2]
            )
        )


def requirements() -> list[str]:
    """Return the development tools that pyproject.toml names."""
    import tomllib

    with (ROOT / "pyproject.toml").open("rb") as stream:
        return list(tomllib.load(stream)["dependency-groups"]["dev"])


def install_with_uv() -> bool:
    uv = shutil.which("uv")
    if uv is None:
        return False
    if not VENV_PYTHON.exists() and not run([uv, "venv", "--python", sys.executable, str(VENV)]):
        return False
    target = ["--python", str(VENV_PYTHON)]
    return run([uv, "pip", "install", "--quiet", *target, "-e", ".", *requirements()])


def install_with_pip() -> bool:
    if importlib.util.find_spec("ensurepip") is None:
        package = "python{}.{}-venv".format(*sys.version_info[:2])
        if not (root_may_apt() and apt_install([package])):
            fail(f"this Python cannot make virtual environments; type: apt-get install {package}")
    has_pip = VENV_PYTHON.exists() and (VENV / "bin" / "pip").exists()
    if not has_pip and not run([sys.executable, "-m", "venv", "--clear", str(VENV)]):
        return False
    pip = [str(VENV_PYTHON), "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    return run([*pip, "-e", ".", *requirements()])


def gl_error() -> str:
    """Return the last line of what OpenGL complains about, or nothing if it works."""
    probe = subprocess.run(
        [str(VENV_PYTHON), "-c", GL_PROBE], capture_output=True, text=True, check=False
    )
    if probe.returncode == 0:
        say(probe.stdout.strip())
        return ""
    lines = probe.stderr.strip().splitlines() or [f"exit code {probe.returncode}"]
    return lines[-1]


def ensure_gl() -> None:
    error = gl_error()
    if error and sys.platform.startswith("linux") and root_may_apt():
        apt_install(DEBIAN_GL)
        error = gl_error()
    if not error:
        return
    for manager, line in GL_LINES.items():
        if sys.platform.startswith("linux") and shutil.which(manager):
            sudo = "" if os.geteuid() == 0 else "sudo "
            fail(f"OpenGL does not work here ({error}); type: {sudo}{line}")
    fail(f"OpenGL 4.1 does not work here ({error}); install or update the graphics driver.")


def main() -> None:
    check_python()
    say("installing ltc-viewer and its tools into .venv (a minute or two the first time)")
    if not install_with_uv() and not install_with_pip():
        fail("the installation above failed; correct what it complains about and run make again.")
    ensure_gl()


if __name__ == "__main__":
    main()
