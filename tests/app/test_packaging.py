"""The wheel carries shaders, tables and assets, and the program finds them there."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
FOLDERS = ("shaders", "luts", "assets")

pytestmark = pytest.mark.skipif(
    not (ROOT / "pyproject.toml").is_file(), reason="needs the source tree"
)


def _shipped() -> set[str]:
    """Return what git tracks below the three folders, or what lies there without git."""
    if shutil.which("git") and (ROOT / ".git").exists():
        listing = subprocess.run(
            ["git", "ls-files", "-z", *FOLDERS],
            cwd=ROOT,
            capture_output=True,
            text=True,
            check=True,
        )
        return {name for name in listing.stdout.split("\0") if name and (ROOT / name).is_file()}
    return {
        path.relative_to(ROOT).as_posix()
        for folder in FOLDERS
        for path in (ROOT / folder).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the wheel with pip, which fetches hatchling."""
    folder = tmp_path_factory.mktemp("wheel")
    subprocess.run(
        [
            sys.executable,
            "-m",
            "pip",
            "wheel",
            "--no-deps",
            "--quiet",
            "-w",
            str(folder),
            str(ROOT),
        ],
        check=True,
        timeout=300,
    )
    (path,) = folder.glob("*.whl")
    return path


def test_every_folder_is_named_in_the_build() -> None:
    """Runs without a network: what `resource_path` promises is what hatchling is told."""
    import tomllib

    with (ROOT / "pyproject.toml").open("rb") as stream:
        wheel_table = tomllib.load(stream)["tool"]["hatch"]["build"]["targets"]["wheel"]
    assert wheel_table["force-include"] == {name: f"ltc/_data/{name}" for name in FOLDERS}
    assert set(wheel_table["packages"]) == {"app", "ltc"}
    for name in FOLDERS:
        assert any((ROOT / name).rglob("*")), name


@pytest.mark.slow
def test_wheel_carries_the_data(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    shipped = _shipped()
    assert len(shipped) > 30
    assert {f"ltc/_data/{name}" for name in shipped} <= names
    assert "app/__main__.py" in names
    assert not [name for name in names if "__pycache__" in name or name.startswith("tests/")]


@pytest.mark.slow
def test_installed_program_renders_a_demo(wheel: Path, tmp_path: Path) -> None:
    """In a clean environment, from another folder, with nothing of the source tree in sight."""
    venv.create(tmp_path / "venv", with_pip=True)
    python = tmp_path / "venv" / "bin" / "python"
    environment = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}

    def run(*command: str) -> str:
        done = subprocess.run(
            command,
            cwd=tmp_path,
            env=environment,
            capture_output=True,
            text=True,
            check=True,
            timeout=600,
        )
        return done.stdout.strip()

    run(str(python), "-m", "pip", "install", "--quiet", str(wheel))
    code = "from app.scene_io import demo_scenes; print(next(iter(demo_scenes().values())))"
    scene = run(str(python), "-c", code)
    assert Path(scene).is_relative_to(tmp_path)
    picture = tmp_path / "picture.png"
    shot = [str(tmp_path / "venv" / "bin" / "ltc-viewer"), "shot", scene, "-o", str(picture)]
    run(*shot, "--size", "64x36")
    assert picture.stat().st_size > 500
