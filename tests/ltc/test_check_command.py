"""``python -m ltc check``: exit codes, what is printed, pictures."""

from __future__ import annotations

import re
import shlex
import sys
from pathlib import Path

import numpy as np
import pytest

from ltc.__main__ import main
from ltc.resources import resource_path
from tests.ltc.published import sound, write_dds, write_npy

PAGE = Path(__file__).resolve().parents[2] / "docs" / "tables.md"
FEW = ["--rectangles", "50"]
SHIPPED = str(resource_path("luts", "ltc_isotropic.npz"))


def words(paths: list[Path]) -> list[str]:
    return [str(path) for path in paths]


def test_a_sound_table(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", SHIPPED, *FEW]) == 0
    printed = capsys.readouterr()
    assert printed.err == ""
    assert printed.out.rstrip().endswith("sound")
    for what in ("determinants", "between neighbours", "amplitude", "Fresnel", "half floats",
                 "mean error by theta", "largest errors", "p99"):  # fmt: skip
        assert what in printed.out


def test_a_broken_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table = sound("heitz", (12, 12))
    table.matrix[4, 4] = 0.0
    table.matrix[4, 4, 1, 1] = 1.0
    table.matrix[4, 4, 0, 0] = table.matrix[4, 4, 2, 2] = 1e-12
    assert main(["check", *words(write_dds(tmp_path, table)), *FEW]) == 1
    out = capsys.readouterr().out
    assert "FAULT" in out
    assert out.rstrip().splitlines()[-1].startswith("broken: ")
    assert "[4, 4]" in out  # brackets are no markup


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["none.npz"], "none.npz: no such file, expected a table"),
        ([SHIPPED, "--rectangles", "2"], "rectangles is 2, expected 10"),
        ([SHIPPED, "--seed", "-1"], "seed is -1"),
        ([SHIPPED, "--plots", SHIPPED], "is a file, expected a folder"),
    ],
)
def test_bad_input(arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", *arguments]) == 2
    printed = capsys.readouterr()
    assert message in printed.err
    assert printed.err.count("\n") == 1
    assert printed.out == ""


def test_no_table_at_all(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stop:
        main(["check"])
    assert stop.value.code == 2
    assert "TABLE" in capsys.readouterr().err


def test_plots(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("matplotlib")
    table = sound("kt", (5, 4, 5, 4))
    table.matrix[1, 1, 1, 1] = 0.0
    files = words(write_npy(tmp_path, table))
    with np.errstate(all="warn"):  # matplotlib's own arithmetic
        assert main(["check", *files, *FEW, "--plots", str(tmp_path / "new" / "plots")]) == 1
    written = sorted(path.name for path in (tmp_path / "new" / "plots").iterdir())
    assert written == ["determinant.png", "errors.png", "leak.png"]
    told = capsys.readouterr().err
    for name in written:
        assert (tmp_path / "new" / "plots" / name).read_bytes().startswith(b"\x89PNG")
        assert name in told


@pytest.mark.skipif(not PAGE.is_file(), reason="needs the source tree")
def test_commands_that_the_page_shows_exist(capsys: pytest.CaptureFixture[str]) -> None:
    lines = re.findall(r"^python -m ltc (.*)$", PAGE.read_text("utf-8"), re.MULTILINE)
    assert {line.split()[0] for line in lines} == {"check", "export"}
    for line in lines:
        words_ = shlex.split(line)
        with pytest.raises(SystemExit) as stop:
            main([words_[0], "--help"])
        assert stop.value.code == 0
        told = capsys.readouterr().out
        assert all(word in told for word in words_ if word.startswith("-"))


def test_plots_without_matplotlib(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert main(["check", SHIPPED, "--plots", "anywhere"]) == 2
    assert "needs matplotlib: pip install 'ltc-viewer[plots]'" in capsys.readouterr().err
