"""The real window, driven without a display; see `tests.gui.driver` for the scenarios.

One process runs them all: a second application in a process crashes.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
PATIENCE = 600
"""Seconds after which the application counts as hanging."""

SCENARIOS = (
    "drag_a_corner",
    "press_a_corner_without_moving_it",
    "escape_cancels_a_drag",
    "change_roughness_by_its_slider",
    "add_and_remove_a_corner",
    "split_an_edge_by_double_click",
    "cut_a_hole",
    "add_copy_and_remove_lights",
    "select_by_clicking",
    "look_around",
    "move_and_turn_with_the_gizmo",
    "aim_and_look_by_the_context_menu",
    "every_panel_edits_the_scene",
    "see_the_cost",
    "watch_the_noise_fall",
    "skip_faint_lights",
    "save_reload_compare",
    "save_and_open_by_the_dialog",
    "same_picture_as_headless",
    "idle_when_nothing_changes",
    "fewer_samples_than_there_are",
    "read_the_plan",
    "export_pictures",
    "failures_become_messages",
    "meshes_can_be_dropped",
    "unsaved_edits_are_asked_about",
    "names_and_visibility",
    "menus_open",
    "drag_an_anchor",
    "drag_handles_of_each_kind",
    "insert_and_remove_on_a_curve",
    "lines_kinds_and_splits_by_menu",
    "convert_and_mix",
    "presets_from_the_menu",
    "type_a_text",
    "drop_a_drawing_and_a_font",
    "flip_between_two_techniques",
    "drag_the_divider",
    "differences_in_false_colours",
    "numbers_of_the_view",
    "comparing_costs_nothing_at_rest",
    "inspect_a_pixel",
    "parts_of_the_error",
    "lobe_under_the_pointer",
    "pinned_lobe",
    "lobe_by_hand",
    "measure_the_techniques",
    "stop_measuring",
    "drop_pictures",
    "place_a_picture",
    "play_a_picture",
    "pictures_change_and_go_missing",
    "a_scene_without_its_picture",
)

pytestmark = pytest.mark.skipif(
    not sys.platform.startswith("linux"),
    reason="GLFW's null platform with EGL, which stands in for a screen, is used on Linux only",
)


def _run(*arguments: str) -> subprocess.CompletedProcess[str]:
    environment = {key: value for key, value in os.environ.items() if key != "DISPLAY"}
    return subprocess.run(
        [sys.executable, "-m", *arguments],
        cwd=ROOT,
        env=environment,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Run every scenario and return the folder of what they left."""
    out = tmp_path_factory.mktemp("gui")
    done = _run("tests.gui.driver", str(out))
    if "Failed to create temporary window" in done.stderr or "null platform" in done.stderr:
        pytest.skip(f"no window can be made here: {done.stderr.strip().splitlines()[0]}")
    if not (out / "results.json").exists() or done.returncode:
        pytest.fail(f"the application ended with {done.returncode}:\n{done.stderr[-4000:]}")
    return out


@pytest.fixture(scope="module")
def headless(folder: Path) -> Path:
    """Render the scenarios' shots without a window."""
    shots = [str(folder / name) for name in ("shot", "export")]
    done = _run(
        "tests.gui.headless", *[f"{shot}.{end}" for shot in shots for end in ("pickle", "npz")]
    )
    assert done.returncode == 0, done.stderr
    return folder


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_scenario(folder: Path, scenario: str) -> None:
    result = json.loads((folder / "results.json").read_text())[scenario]
    assert not result["failure"], result["failure"]


def test_no_scenario_is_forgotten(folder: Path) -> None:
    assert set(json.loads((folder / "results.json").read_text())) == set(SCENARIOS)


def test_the_window_shows_the_headless_picture_bit_for_bit(headless: Path) -> None:
    window = np.load(headless / "picture.npy")
    alone = np.load(headless / "shot.npz")["display"]
    assert window.shape == alone.shape
    assert np.array_equal(window, alone)
    assert window.std() > 10.0


def test_exported_files_hold_the_headless_picture(headless: Path) -> None:
    import OpenEXR
    from PIL import Image

    alone = np.load(headless / "export.npz")
    assert np.array_equal(np.asarray(Image.open(headless / "picture.png")), alone["display"])
    with OpenEXR.File(str(headless / "picture.exr")) as file:
        assert np.array_equal(file.channels()["RGB"].pixels, alone["radiance"])


def test_without_a_display_the_program_says_what_to_do(tmp_path: Path) -> None:
    script = "import sys; from app.window import run; sys.exit(run(None))"
    environment = {
        key: value
        for key, value in os.environ.items()
        if key not in {"DISPLAY", "WAYLAND_DISPLAY", "XDG_RUNTIME_DIR"}
    }
    done = subprocess.run(
        [sys.executable, "-c", script],
        cwd=ROOT,
        env=environment,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 1
    assert "ltc-viewer shot" in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
