"""The commands that render, as users run them: a process each."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from app.scene_io import demo_scenes

ROOT = Path(__file__).resolve().parents[2]
DEMO = next(iter(demo_scenes()))

LIT = {
    "format": "ltc-scene/1",
    "materials": {"m": {"alpha": [0.2, 0.2], "f0": [0.5, 0.5, 0.5]}},
    "objects": [{"mesh": "plane", "material": "m", "transform": {"scale": [4, 4, 4]}}],
    "lights": [{"plane": {"origin": [0, 1, -1]}, "radiance": [2, 2, 2]}],
}


def command(folder: Path, *arguments: str, code: int = 0) -> subprocess.CompletedProcess[str]:
    done = subprocess.run(
        [sys.executable, "-m", "app", *arguments],
        capture_output=True,
        text=True,
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        timeout=300,
    )
    assert done.returncode == code, done.stderr
    return done


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "lit.json").write_text(json.dumps(LIT))
    return tmp_path


def read_exr(path: Path) -> np.ndarray:
    with OpenEXR.File(str(path)) as file:
        pixels: np.ndarray = file.channels()["RGB"].pixels
        return pixels.copy()


def test_shot_writes_png_and_exr(folder: Path) -> None:
    size = ("--size", "96x64", "--samples", "3")
    done = command(folder, "shot", "lit.json", "-o", "a.png", *size)
    assert (done.stdout, done.stderr) == ("a.png\n", "")
    command(folder, "shot", "lit.json", "-o", "a.exr", *size)
    with Image.open(folder / "a.png") as image:
        assert (image.size, image.mode) == ((96, 64), "RGB")
        colours = np.asarray(image).astype(np.int64)
    radiance = read_exr(folder / "a.exr")
    assert radiance.shape == (64, 96, 3)
    assert radiance.dtype == np.float32
    assert np.isfinite(radiance).all()
    # The light itself is the brightest thing, in both, and stands in the upper half.
    assert radiance.max() == pytest.approx(2.0, rel=1e-5)
    assert (radiance[:32] == radiance.max()).any()
    assert not (radiance[48:] == radiance.max()).any()
    bright = radiance[..., 1] > 1.99
    assert colours[bright].min() > colours[~bright].mean()
    assert sorted(path.name for path in folder.iterdir()) == ["a.exr", "a.png", "lit.json"]


def test_shot_tells_the_noise_of_random_samples(folder: Path) -> None:
    shot = ("shot", "lit.json", "-o", "a.png", "--size", "48x32", "--technique")
    said = r"(\d+) samples in \d+\.\d s, estimated error ([\d.]+) % of the mean\n"
    found = re.fullmatch(said, command(folder, *shot, "reference", "--samples", "9").stderr)
    assert found is not None
    assert found[1] == "9"
    coarse = float(found[2])
    found = re.fullmatch(said, command(folder, *shot, "reference", "--until-error", "2%").stderr)
    assert found is not None
    assert int(found[1]) > 16
    assert float(found[2]) <= 2.0 < coarse
    done = command(folder, *shot, "ltc", "--until-error", "2%", code=2)
    assert "technique ltc has no noise that would fall, expected --technique" in done.stderr


def test_shot_shows_a_moment_and_tells_what_it_changed(folder: Path) -> None:
    frames = [Image.new("RGB", (4, 4), colour) for colour in ("red", "lime")]
    frames[0].save(folder / "film.gif", save_all=True, append_images=frames[1:], duration=100)
    light = {**LIT["lights"][0], "picture": "film.gif"}
    (folder / "film.json").write_text(json.dumps({**LIT, "lights": [light]}))
    shot = ("shot", "film.json", "-o", "a.exr", "--size", "32x18", "--samples", "1")
    for time, shown, dark in (("0", 0, 1), ("0.15", 1, 0), ("0.25", 0, 1)):
        assert command(folder, *shot, "--time", time).stderr == ""
        radiance = read_exr(folder / "a.exr")
        assert radiance[..., shown].max() == pytest.approx(2.0, rel=1e-3)
        assert radiance[..., dark].max() == 0.0
    (folder / "film.gif").write_bytes((folder / "film.gif").read_bytes()[:30])
    assert "lights[0].picture: " in command(folder, *shot, code=2).stderr
    light["picture"] = "nan.exr"
    (folder / "film.json").write_text(json.dumps({**LIT, "lights": [light]}))
    pixels = np.ones((4, 4, 3), dtype=np.float32)
    pixels[1, 2] = np.nan
    with OpenEXR.File({"type": OpenEXR.scanlineimage}, {"RGB": pixels}) as file:
        file.write(str(folder / "nan.exr"))
    told = command(folder, *shot).stderr
    assert told == f"{folder / 'nan.exr'}: 1 texel with NaN or infinite numbers became black\n"
    assert np.isfinite(read_exr(folder / "a.exr")).all()


def test_shots_are_reproducible(folder: Path) -> None:
    for name in ("a.png", "b.png"):
        command(folder, "shot", DEMO, "-o", name, "--size", "64x48", "--samples", "2")
    assert (folder / "a.png").read_bytes() == (folder / "b.png").read_bytes()


def test_a_failed_shot_leaves_no_file(folder: Path) -> None:
    (folder / "lit.json").write_text('{"format": "ltc-scene/1", "objects": [{"mesh": "a.obj"}]}')
    done = command(folder, "shot", "lit.json", "-o", "a.png", code=2)
    assert done.stderr.startswith("ltc-viewer: lit.json: objects[0].mesh: ")
    assert not (folder / "a.png").exists()


def test_probe(folder: Path) -> None:
    count = 7
    normal = np.tile([0.0, 1.0, 0.0], (count, 1))
    view = np.tile([0.0, 0.6, 0.8], (count, 1))
    position = np.zeros((count, 3))
    position[:, 2] = np.linspace(-3.0, 3.0, count)
    np.savez(
        folder / "points.npz",
        position=position,
        normal=normal * 1.0005,
        tangent=np.tile([1.0, 0.2, 0.0] / np.hypot(1.0, 0.2), (count, 1)),
        view=view,
        alpha=np.array([[0.2, 0.2]] * (count - 1) + [[0.2, 0.3]]),
    )
    done = command(folder, "probe", "lit.json", "points.npz", "-o", "out.npz")
    assert done.stderr == ""
    with np.load(folder / "out.npz") as found:
        assert str(found["technique"]) == "ggx"  # for the one anisotropic point
    done = command(folder, "probe", "lit.json", "points.npz", "-o", "out.npz", "--technique", "ltc")
    assert done.stdout == "out.npz\n"
    assert done.stderr == ""
    with np.load(folder / "out.npz") as found:
        assert sorted(found.files) == ["diffuse", "specular", "technique"]
        assert str(found["technique"]) == "ltc"
        for name in ("specular", "diffuse"):
            assert found[name].shape == (count, 3)
            assert found[name].dtype == np.float32
            assert np.isfinite(found[name]).all()
        # The light faces +z: behind its plane there is nothing, in front there is.
        assert (found["diffuse"][position[:, 2] < -1.0] == 0.0).all()
        assert (found["diffuse"][position[:, 2] > -1.0] > 0.0).all()


def test_probe_of_no_points(folder: Path) -> None:
    empty = {name: np.zeros((0, 3)) for name in ("position", "normal", "tangent", "view")}
    np.savez(folder / "points.npz", alpha=np.zeros((0, 2)), **empty)
    command(folder, "probe", "lit.json", "points.npz", "-o", "out.npz")
    with np.load(folder / "out.npz") as found:
        assert found["specular"].shape == (0, 3)


def test_bench(folder: Path) -> None:
    done = command(
        folder, "bench", "lit.json", DEMO, "--size", "64x48", "--repeats", "3", "--warm-up", "1",
        "--json", "times.json",
    )  # fmt: skip
    figures = json.loads((folder / "times.json").read_text())
    assert figures["size"] == [64, 48]
    assert figures["renderer"] in done.stdout
    assert figures["timing"] in ("timer queries", "wall clock")
    assert ("not to be trusted" in done.stderr) == (figures["timing"] == "wall clock")
    assert [(row["scene"], row["technique"]) for row in figures["rows"]] == [
        ("lit.json", "no shading"), ("lit.json", "ltc"), (DEMO, "no shading"), (DEMO, "ltc"),
    ]  # fmt: skip
    for row in figures["rows"]:
        assert "lighting" in row["passes"]
        for times in (*row["passes"].values(), row["wall"]):
            assert times["repeats"] == 3
            assert 0.0 <= times["q1"] <= times["median"] <= times["q3"]


def test_everything_costs_more(folder: Path) -> None:
    command(
        folder, "bench", "lit.json", "--size", "32x24", "--repeats", "1", "--warm-up", "0",
        "--everything", "--json", "times.json",
    )  # fmt: skip
    rows = json.loads((folder / "times.json").read_text())["rows"]
    assert [row["everything"] for row in rows] == [False, True, False, True]
    assert all(a["bytes"] < b["bytes"] for a, b in zip(rows[::2], rows[1::2], strict=True))
    text = command(folder, "explain", "lit.json", "--samples", "1", "--everything").stdout
    for part in ("needed", "everything", "radiance 2", "characters", "Allocated"):
        assert part in text
    plan = json.loads(command(folder, "explain", "lit.json", "--everything", "--json").stdout)
    assert plan["bytes"] < plan["everything"]["bytes"]


def test_bench_compares_with_the_exact_integral(folder: Path) -> None:
    """Per alpha and technique: the fitted lobe's for all but ggx, which has GGX itself."""
    curved = json.loads((folder / "lit.json").read_text())
    h = 0.5522847498
    curved["lights"][0]["outline"] = {"contours": [{"bezier": [
        [[1, 0], [1, h], [h, 1], [0, 1]], [[0, 1], [-h, 1], [-1, h], [-1, 0]],
        [[-1, 0], [-1, -h], [-h, -1], [0, -1]], [[0, -1], [h, -1], [1, -h], [1, 0]],
    ]}]}  # fmt: skip
    (folder / "disk.json").write_text(json.dumps(curved))
    techniques = ("ltc", "uniform:4", "uniform:128", "ggx:3")
    options = [word for name in techniques for word in ("--technique", name)]
    done = command(
        folder, "bench", "disk.json", "--size", "64x48", "--repeats", "1", "--warm-up", "0",
        "--json", "times.json", "--error", "200", "--alpha", "0.1", "--alpha", "0.3", *options,
    )  # fmt: skip
    for word in ("specular error: mean, p95, max", "uniform:128", "alpha"):
        assert word in done.stdout
    rows = json.loads((folder / "times.json").read_text())["rows"]
    assert [(row["technique"], row["alpha"]) for row in rows] == [
        ("no shading", None), *((name, alpha) for alpha in (0.1, 0.3) for name in techniques),
    ]  # fmt: skip
    for row in rows:
        if row["technique"].startswith("uniform"):
            # A light in front of the floor: four curves for each of two lobes.
            edges = int(row["technique"].split(":")[1])
            assert 0.0 < row["evaluations"] <= 8.0 * edges
        if row["technique"] == "no shading":
            assert row["evaluations"] is None
            assert row["errors"] == {}
            continue
        for lobe in ("specular", "diffuse"):
            errors = row["errors"][lobe]
            assert errors["points"] == 200
            assert 0.0 <= errors["mean"] <= errors["max"]
            assert errors["p95"] <= errors["max"]
        if row["technique"] == "ggx:3":
            # Its weights' error on rough floors is 2e-4 on average and 7e-3 at most (docs/ggx.md).
            assert row["errors"]["specular"]["mean"] < 2e-3
            continue
        # Four edges a quarter lose 2.6 % of a circle's area, 128 lose 3e-5.
        specular = row["errors"]["specular"]["max"]
        assert specular > 2e-3 if row["technique"] == "uniform:4" else specular < 5e-4


def test_explain(folder: Path) -> None:
    text = command(folder, "explain", "lit.json", "--size", "640x480").stdout
    for part in ("640x480", "technique ltc", "Programs", "Attachments", "Left out"):
        assert part in text
    plan = json.loads(command(folder, "explain", "lit.json", "--json").stdout)
    assert plan["bytes"] > 0
    assert plan["left_out"]
