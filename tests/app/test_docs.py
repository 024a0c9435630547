"""What README and docs show works: commands, options, JSON, links and pictures."""

from __future__ import annotations

import json
import re
import shlex
import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest

from app.cli.main import run
from app.scene_io import demo_scenes, scene_from_json, scene_to_json
from ltc.__main__ import main as ltc_main
from ltc.anisotropic import AnisotropicTable, load_anisotropic
from ltc.table import IsotropicTable, load_isotropic

ROOT = Path(__file__).resolve().parents[2]
PAGES = [
    ROOT / "README.md",
    *sorted((ROOT / "docs").glob("*.md")),
    ROOT / "assets/models/README.md",
]
LARGEST_PICTURE = 400_000

pytestmark = pytest.mark.skipif(not PAGES[0].is_file(), reason="needs the source tree")


def _blocks(page: Path, language: str) -> list[str]:
    return re.findall(
        rf"^```{language}\n(.*?)^```", page.read_text("utf-8"), re.MULTILINE | re.DOTALL
    )


def _commands(page: Path) -> list[list[str]]:
    lines = [line for block in _blocks(page, "bash") for line in block.splitlines()]
    return [shlex.split(line, comments=True) for line in lines if line.strip()]


VIEWER = [words for page in PAGES for words in _commands(page) if words[0] == "ltc-viewer"]
JSON = [(page, text) for page in PAGES for text in _blocks(page, "json")]


def test_the_readme_shows_every_command() -> None:
    assert {words[1] for words in VIEWER} >= {"shot", "probe", "bench", "explain"}


@pytest.mark.parametrize("words", VIEWER, ids=" ".join)
def test_command_and_its_options_exist(
    words: list[str], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.setenv("NO_COLOR", "1")
    assert run([words[1], "--help"]) == 0
    shown = capsys.readouterr().out
    options = [word for word in words[2:] if re.fullmatch(r"--?[a-z][a-z-]*", word)]
    for option in options:
        assert option in shown, option
    assert "Example" in shown


def test_fit_command_exists(capsys: pytest.CaptureFixture[str]) -> None:
    words = next(
        words for words in _commands(ROOT / "README.md") if words[:3] == ["python", "-m", "ltc"]
    )
    with pytest.raises(SystemExit) as stop:
        ltc_main([*words[3:], "--help"])
    assert stop.value.code == 0
    assert "usage" in capsys.readouterr().out


def test_scenes_that_commands_name_exist() -> None:
    files = {path.as_posix() for path in (ROOT / "assets/scenes/bench").glob("*.json")}
    assert files
    for words in VIEWER:
        for word in words[2:]:
            if re.match(r"\d\d-", word):
                assert word in demo_scenes(), word
            if "/" in word and not re.fullmatch(r"\d+/\d+", word):
                assert list(ROOT.glob(word)), word


def test_explain_as_in_the_readme() -> None:
    """In a process of its own, because it opens an OpenGL context if it can."""
    words = next(words for words in VIEWER if words[1] == "explain")
    command = [sys.executable, "-m", "app", *words[1:]]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert "lighting" in done.stdout


@pytest.mark.parametrize(
    ("page", "text"), JSON, ids=[f"{page.name}-{i}" for i, (page, _) in enumerate(JSON)]
)
def test_json_loads(page: Path, text: str) -> None:
    scene_from_json(text, None, page.name)


def test_documented_defaults_are_the_real_ones() -> None:
    """Every row of docs/scene-file.md whose default is a JSON value."""
    lights = [{}, {"text": "A"}, {"svg": "a.svg", "outline": {}}, {"picture": "a.png"}]
    parts = {"camera": {}, "materials": {"m": {}}, "objects": [{}], "lights": lights, "display": {}}
    text = json.dumps({"format": "ltc-scene/1", **parts})
    written = json.loads(scene_to_json(scene_from_json(text, None, "text"), None))
    page = (ROOT / "docs" / "scene-file.md").read_text("utf-8")
    checked = 0
    for section in re.split(r"^## ", page, flags=re.MULTILINE)[1:]:
        name = section.split("`")[1]
        part = written[name]
        part = part[0] if isinstance(part, list) else part.get("m", part)
        for of, key, default in re.findall(
            r"^\| (?:key of `(\w+)`|`(\w+)`) \|(?: `([^`]+)` \|)?", section, re.MULTILINE
        ):
            if of:
                part = next(light[of] for light in written[name] if of in light)
            elif default:
                assert part[key] == json.loads(default), f"{name}.{key}"
                checked += 1
    assert checked >= 20


@pytest.mark.parametrize(
    ("kind", "load"), [("isotropic", load_isotropic), ("anisotropic", load_anisotropic)]
)
def test_accuracy_figures_are_those_of_the_shipped_table(
    kind: str, load: Callable[[], IsotropicTable | AnisotropicTable]
) -> None:
    figures = load().provenance["error"]["rectangles"]
    measured = [figures[key] for key in ("mean", "p95", "p99", "max")]
    measured += list(figures["theta"].values())
    text = (ROOT / "README.md").read_text("utf-8")
    rows = re.findall(rf"^\| (?:mean error, )?{kind} \| (.*) \|$", text, re.MULTILINE)
    shown = [cell.strip() for row in rows for cell in row.split("|")]
    assert len(shown) == len(measured)
    for cell, value in zip(shown, measured, strict=True):
        half_a_digit = 0.5 * 10.0 ** -len(cell.split(".")[1])
        assert abs(float(cell) - value) <= 1.001 * half_a_digit, cell


def test_make_targets_exist() -> None:
    makefile = (ROOT / "Makefile").read_text("utf-8")
    targets = set(re.findall(r"^([a-z]+):", makefile, re.MULTILINE))
    named = {words[1] for page in PAGES for words in _commands(page) if words[0] == "make"}
    inline = {
        target for page in PAGES for target in re.findall(r"`make (\w+)`", page.read_text("utf-8"))
    }
    assert named | inline <= targets
    assert {"run", "test", "check", "clean", "help"} <= targets


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)#]+)\)", page.read_text("utf-8")):
        if not target.startswith(("http://", "https://")):
            assert (page.parent / target).exists(), target


def test_pictures_are_small_and_all_are_shown() -> None:
    shown = {
        (page.parent / target).resolve()
        for page in PAGES
        for target in re.findall(r"!\[[^]]*\]\(([^)]+)\)", page.read_text("utf-8"))
    }
    pictures = set((ROOT / "docs" / "images").resolve().glob("*"))
    pictures |= set((ROOT / "docs" / "report").resolve().glob("*.png"))
    assert pictures == shown
    assert all(path.stat().st_size < LARGEST_PICTURE for path in pictures)
    assert {f"{name}.png" for name in demo_scenes()} <= {path.name for path in pictures}


def test_debian_line_is_the_same_everywhere() -> None:
    """README, set-up and the error for a missing library name the same packages."""
    line = "libegl1 libgl1 libgl1-mesa-dri libx11-6 libxext6"
    assert line in (ROOT / "README.md").read_text("utf-8")
    assert line in (ROOT / "app" / "context.py").read_text("utf-8")
    setup = (ROOT / ".ci" / "setup.py").read_text("utf-8")
    assert ", ".join(f'"{package}"' for package in line.split()) in setup


def test_python_version_is_the_same_everywhere() -> None:
    with (ROOT / "pyproject.toml").open("rb") as stream:
        wanted = tomllib.load(stream)["project"]["requires-python"]
    assert wanted == ">=3.11"
    assert "Python 3.11 or newer" in (ROOT / "README.md").read_text("utf-8")
    assert "OLDEST = (3, 11)" in (ROOT / ".ci" / "setup.py").read_text("utf-8")
