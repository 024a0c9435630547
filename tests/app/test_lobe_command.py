"""``ltc-viewer lobe``: its figures, and what it says of bad input."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from app.cli.lobe import RATIOS, THETAS
from app.cli.main import run
from app.lobe_figure import lobe_figure
from ltc.lobe import Case, disk_from_direction, lobe_pair


def test_figure(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "lobe.png"
    command = ["lobe", "--alpha", "0.05", "0.4", "--phi", "-40", "--pixels", "64", "-o", str(file)]
    assert run(command) == 0
    assert capsys.readouterr().out.strip() == str(file)
    wide = np.asarray(Image.open(file))
    assert run([*command, "--alpha", "0.001", "0.002"]) == 0
    tall = np.asarray(Image.open(file))
    assert tall.shape[1] == wide.shape[1]
    assert tall.shape[0] > wide.shape[0] + 64, "small lobes are shown larger below"
    assert run([*command, "--linear"]) == 0
    assert not np.array_equal(np.asarray(Image.open(file)), wide)


def test_the_lobe_is_where_it_belongs() -> None:
    """In the first picture the brightest place is near the mirror direction."""
    pixels = 200
    case = Case(0.05, 0.06, 0.9, 0.4)
    page = lobe_figure(lobe_pair(case), pixels, logarithmic=False).astype(int)
    em = pixels / 22.0
    left, top = 2.0 * em, 6.6 * em
    x, y = disk_from_direction(case.mirror)
    place = left + 0.5 * pixels * (1.0 + x), top + 0.5 * pixels * (1.0 - y)
    first = page[round(top) : round(top) + pixels, round(left) : round(left) + pixels]
    warm = (first[..., 0] > 200) & (first[..., 2] < 190)
    rows, columns = np.nonzero(warm)
    assert abs(columns.mean() + left - place[0]) < 4.0
    assert abs(rows.mean() + top - place[1]) < 4.0


def test_sheet(tmp_path: Path) -> None:
    file = tmp_path / "sheet.png"
    assert run(["lobe", "--grid", "--alpha", "0.2", "0.2", "--pixels", "40", "-o", str(file)]) == 0
    width, height = Image.open(file).size
    assert width > 2 * 40 * len(THETAS)
    assert height > 40 * len(RATIOS)


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--theta", "95"], "--theta is 95, expected a number between 0 and 89.99"),
        (["--alpha", "0.1", "0"], "--alpha is 0, expected a number between 0.0001 and 1"),
        (["--phi", "1000"], "--phi is 1000, expected a number between -360 and 360"),
        (["--alpha", "0.1", "nan"], "--alpha is nan"),
        (["--pixels", "9"], "--pixels is 9, expected a whole number from 32 to 2048"),
        (["-o", "lobe.exr"], "expected"),
    ],
)
def test_bad_input(
    words: list[str],
    sentence: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["lobe", "-o", "lobe.png", *words]) == 2
    error = capsys.readouterr().err
    assert sentence in error
    assert len(error.strip().splitlines()) == 1
    assert not list(tmp_path.iterdir())
