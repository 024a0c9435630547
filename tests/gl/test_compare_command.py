"""``ltc-viewer compare`` as users run it: numbers, pictures, files."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import pytest
from PIL import Image

from app.cli.compare import read_pictures
from app.cli.main import run
from app.images import exr_bytes, png_bytes, read_image
from app.render.comparison import earlier_samples, estimated_error, shared_samples
from app.render.difference import Scale, colours_of, difference
from app.render.flip import flip
from tests.gl.test_command_line import LIT, read_exr

Said: TypeAlias = Callable[..., str]
SIZE = ("--size", "96x64", "--samples", "2")


@pytest.fixture
def said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: Any) -> Said:
    """Run the command in a folder with a scene, and return what it prints."""
    monkeypatch.chdir(tmp_path)
    Path("lit.json").write_text(json.dumps(LIT))

    def run_it(*arguments: str) -> str:
        assert run(arguments) == 0
        out: str = capfd.readouterr().out
        return out

    return run_it


def compared(said: Said, *arguments: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(said("compare", *arguments, "--json"))
    return found


def test_numbers_are_those_of_the_two_pictures(said: Said) -> None:
    """Against pictures that `shot` writes of both techniques."""
    found = compared(said, "lit.json", "--technique", "ltc", "--against", "ggx:4", *SIZE)
    for name in ("ltc", "ggx:4"):
        said("shot", "lit.json", "--technique", name, "-o", f"{name[:3]}.exr", *SIZE)
    a, b = (read_exr(Path(f"{name}.exr")).astype(np.float64) for name in ("ltc", "ggx"))
    apart = difference(a, b)
    assert (found["a"], found["b"], found["size"]) == ("ltc", "ggx:4", [96, 64])
    assert found["max"] == pytest.approx(np.abs(apart).max())
    assert found["mean"] == pytest.approx(np.abs(apart).mean())
    assert found["bias"] == pytest.approx(apart.mean())
    assert found["light"] == pytest.approx(2.0)
    assert found["bad"] == 0
    assert 0.0 < found["mean"] < 0.05
    assert 0.0 < found["flip"] < 0.3
    again = compared(said, "ltc.exr", "ggx.exr")
    assert again["light"] is None
    for key in ("mean", "rmse", "p95", "p99", "max", "bias", "mean_b", "flip"):
        assert again[key] == pytest.approx(found[key]), key


def test_a_table_and_a_picture_with_its_legend(said: Said) -> None:
    arguments = ("compare", "lit.json", "--technique", "ltc", "--against", "ggx:4")
    big = ("--size", "400x200", "--samples", "1")
    done = said(*arguments, *big, "-o", "d.png", "--view", "signed", "--range", "0.1")
    assert "ltc compared with ggx:4: luminance, 400x200 pixels" in done
    assert "of the brightest light" in done
    assert "d.png" in done
    said(*arguments, *big, "-o", "d.exr", "--view", "signed")
    values = read_exr(Path("d.exr"))
    assert values.min() < 0.0 < values.max()
    assert np.array_equal(values[..., 0], values[..., 2])
    colours = np.asarray(Image.open(Path("d.png"))).astype(int)
    wanted = colours_of(values[..., 0], Scale("signed", 0.1)).astype(int)
    # The legend stands at the lower left, nothing else is drawn over.
    differs = np.any(colours != wanted, axis=-1)
    rows, columns = np.nonzero(differs)
    assert rows.min() > 100
    assert columns.max() < 300
    assert differs[150:].mean() > 0.2


def test_split_has_a_left_and_b_right(said: Said) -> None:
    arguments = ("compare", "lit.json", "--technique", "ltc", "--against", "ggx:4", *SIZE)
    for view in ("a", "b", "split"):
        said(*arguments, "-o", f"{view}.exr", "--view", view)
        said(*arguments, "-o", f"{view}.png", "--view", view)
    a, b, split = (read_exr(Path(f"{view}.exr")) for view in ("a", "b", "split"))
    assert not np.array_equal(a, b)
    np.testing.assert_array_equal(split[:, :48], a[:, :48])
    np.testing.assert_array_equal(split[:, 48:], b[:, 48:])
    left, right, both = (
        np.asarray(Image.open(Path(f"{view}.png"))) for view in ("a", "b", "split")
    )
    np.testing.assert_array_equal(both[30:, :47], left[30:, :47])
    np.testing.assert_array_equal(both[30:, 50:], right[30:, 50:])


def test_a_random_estimate_gets_more_samples_at_the_same_places(said: Said) -> None:
    """More estimates of the reference come closer to a technique that is nearly exact."""
    few, many = (
        compared(said, "lit.json", "--technique", "ggx:4", *SIZE, "--estimates", str(count))
        for count in (4, 64)
    )
    assert many["rmse"] < 0.4 * few["rmse"]
    assert abs(many["bias"]) < 0.01
    # What the estimates say of themselves is all that there is, and rather too much.
    for found in (few, many):
        assert found["noise"][0] is None
        assert 0.8 * found["rmse"] < found["noise"][1] < 2.5 * found["rmse"]
    assert "reference's own noise" in said("compare", "lit.json", *SIZE, "--estimates", "4")


def test_samples_that_both_take() -> None:
    assert shared_samples(16, (False, True), 256) == (16, 256, 16)
    assert shared_samples(16, (False, True), 250) == (16, 256, 16)
    assert shared_samples(300, (True, False), 256) == (300, 300, 300)
    assert shared_samples(1, (False, False)) == (1, 1, 1)
    a, b, positions = shared_samples(60000, (True, True), 65536)
    assert a == b == positions == 60000


def test_standard_errors_from_two_means() -> None:
    """Of independent samples the estimate's mean square is the mean's variance."""
    rng = np.random.default_rng(8)
    draws = rng.normal(3.0, 2.0, (48, 20_000)).astype(np.float32)
    for fewer in (16, 24, 40):
        found = estimated_error(draws.mean(0), 48, draws[:fewer].mean(0), fewer)
        # Within three standard errors of a mean of 20,000 squares, 1 %, and float32.
        assert np.mean(found**2) == pytest.approx(4.0 / 48.0, rel=0.035)
    assert earlier_samples(256, 16) == 128
    assert earlier_samples(48, 16) == 16
    assert earlier_samples(16, 16) == 0


def test_files_that_are_no_number_everywhere(said: Said) -> None:
    a = np.full((40, 400, 3), 0.25, np.float32)
    b = a.copy()
    a[3, 4] = np.nan
    b[5, 6] = np.inf
    a[7, 8] += 0.5
    for name, pixels in (("a", a), ("b", b)):
        Path(f"{name}.exr").write_bytes(exr_bytes(pixels))
    found = compared(said, "a.exr", "b.exr", "-o", "out.png", "--view", "relative")
    assert (found["bad"], found["max"]) == (2, 0.5)
    colours = np.asarray(Image.open(Path("out.png")))
    assert tuple(colours[3, 4]) == tuple(colours[5, 6]) == (0, 255, 0)
    done = said("compare", "a.exr", "b.exr")
    assert "pixels not finite" in done


def test_display_colours_are_compared_as_light(said: Said) -> None:
    rng = np.random.default_rng(5)
    a = rng.integers(0, 256, (20, 30, 3), dtype=np.uint8)
    b = a.copy()
    b[:10] = 255
    for name, pixels in (("a", a), ("b", b)):
        Path(f"{name}.png").write_bytes(png_bytes(pixels))
    pictures = read_pictures(Path("a.png"), Path("b.png"))
    np.testing.assert_array_equal(pictures.shown_a, a)
    assert pictures.b[:10].min() == pictures.b.max() == 1.0
    assert pictures.numbers("luminance").max <= 1.0
    np.testing.assert_array_equal(pictures.flip(), flip(a, b))


def test_exr_of_other_programs(tmp_path: Path) -> None:
    """Channels apart, half floats, or with opacity."""
    import OpenEXR

    rng = np.random.default_rng(6)
    rgb = rng.random((5, 7, 3)).astype(np.float16)
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    for name, channels in {
        "apart": {letter: rgb[..., i].copy() for i, letter in enumerate("RGB")},
        "opacity": {"RGBA": np.dstack([rgb, np.ones((5, 7), np.float16)])},
    }.items():
        path = tmp_path / f"{name}.exr"
        with OpenEXR.File(header, channels) as file:
            file.write(str(path))
        np.testing.assert_array_equal(read_image(path), rgb.astype(np.float32))


def test_breakdown(said: Said) -> None:
    arguments = ("lit.json", "--technique", "ltc", "--against", "ggx:4", *SIZE)
    found = compared(said, *arguments, "--breakdown", "5")["breakdown"]
    assert found["points"] == 5
    parts = found["parts"]
    assert list(parts) == [
        "Fresnel", "lobe", "table", "textures", "outline", "float32", "all",
    ]  # fmt: skip
    whole = sum(part["bias"] for name, part in parts.items() if name != "all")
    assert whole == pytest.approx(parts["all"]["bias"], abs=1e-12)
    assert parts["float32"]["max"] < 1e-5
    assert "Whose ltc's error is" in said("compare", *arguments, "--breakdown", "1")
