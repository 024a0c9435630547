"""What `make` does on a machine where something is missing; nothing is installed here."""

from __future__ import annotations

import ast
import importlib.util
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = ROOT / ".ci" / "setup.py"

pytestmark = pytest.mark.skipif(not SCRIPT.is_file(), reason="needs the source tree")


@pytest.fixture
def setup() -> ModuleType:
    spec = importlib.util.spec_from_file_location("ci_setup", SCRIPT)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_old_pythons_can_read_the_script() -> None:
    """They must get as far as the sentence that says they are too old."""
    ast.parse(SCRIPT.read_text("utf-8"), feature_version=(3, 7))


def test_old_python(
    setup: ModuleType, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "version_info", (3, 9, 2))
    with pytest.raises(SystemExit) as stop:
        setup.check_python()
    assert stop.value.code == 1
    assert capsys.readouterr().err == (
        "setup: this is Python 3.9, but ltc-viewer needs Python 3.11 or newer.\n"
    )


def test_requirements_are_those_of_pyproject(setup: ModuleType) -> None:
    assert any(line.startswith("pytest>=") for line in setup.requirements())


class Machine:
    """A pretended machine: which commands exist, who we are, whether OpenGL works."""

    def __init__(
        self, setup: ModuleType, patch: pytest.MonkeyPatch, user: int, commands: tuple[str, ...]
    ) -> None:
        self.installed: list[list[str]] = []
        self.gl_errors = ["libEGL.so.1 not loaded"]
        patch.setattr(sys, "platform", "linux")
        patch.setattr(setup.os, "geteuid", lambda: user)
        patch.setattr(
            setup.shutil, "which", lambda name: f"/bin/{name}" if name in commands else None
        )
        patch.setattr(setup, "gl_error", lambda: self.gl_errors[0])
        patch.setattr(setup, "apt_install", self.install)

    def install(self, packages: list[str]) -> bool:
        self.installed.append(packages)
        self.gl_errors[0] = ""
        return True


def test_root_on_debian_installs_what_opengl_needs(
    setup: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    machine = Machine(setup, monkeypatch, user=0, commands=("apt-get",))
    setup.ensure_gl()
    assert machine.installed == [setup.DEBIAN_GL]


@pytest.mark.parametrize("manager", ["apt-get", "dnf", "pacman", "zypper", "apk"])
def test_others_get_the_line_to_type(
    setup: ModuleType,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    manager: str,
) -> None:
    machine = Machine(setup, monkeypatch, user=1000, commands=(manager,))
    with pytest.raises(SystemExit) as stop:
        setup.ensure_gl()
    assert stop.value.code == 1
    assert machine.installed == []
    message = capsys.readouterr().err
    assert message.startswith("setup: OpenGL does not work here (libEGL.so.1 not loaded); type: ")
    assert f"sudo {manager} " in message
    assert message.count("\n") == 1


def test_working_opengl_needs_nothing(setup: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    machine = Machine(setup, monkeypatch, user=0, commands=("apt-get",))
    machine.gl_errors[0] = ""
    setup.ensure_gl()
    assert machine.installed == []


def test_make_without_a_new_enough_python_says_so(tmp_path: Path) -> None:
    (tmp_path / "Makefile").write_text((ROOT / "Makefile").read_text("utf-8"), "utf-8")
    (tmp_path / "pyproject.toml").touch()
    (tmp_path / ".ci").mkdir()
    (tmp_path / ".ci" / "setup.py").touch()
    done = subprocess.run(
        ["make", "--no-print-directory", "test", "PYTHON="],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode != 0
    assert "needs Python 3.11 or newer" in done.stderr
    assert not (tmp_path / ".venv").exists()


def test_make_alone_lists_the_targets() -> None:
    done = subprocess.run(
        ["make"], cwd=ROOT, capture_output=True, text=True, timeout=60, check=True
    )
    for target in ("run", "test", "check", "clean"):
        assert f"make {target} " in done.stdout
