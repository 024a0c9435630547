"""``ltc-viewer report``: its files say the same, load nothing, and are made but once."""

from __future__ import annotations

import csv
import json
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest

from app.cli.main import run

H = 0.5522847498
"""The handles of a quarter circle."""
DISK = [
    [[1, 0], [1, H], [H, 1], [0, 1]], [[0, 1], [-H, 1], [-1, H], [-1, 0]],
    [[-1, 0], [-1, -H], [-H, -1], [0, -1]], [[0, -1], [H, -1], [1, -H], [1, 0]],
]  # fmt: skip
SMALL = ("--size", "48x32", "--points", "40", "--repeats", "2")
VOID = {"meta", "img"}


def scene(alpha: tuple[float, float], outline: dict[str, object]) -> str:
    return json.dumps({
        "format": "ltc-scene/1",
        "materials": {"m": {"alpha": alpha, "f0": [0.5, 0.5, 0.5]}},
        "objects": [{"mesh": "plane", "material": "m", "transform": {"scale": [4, 4, 4]}}],
        "lights": [{"plane": {"origin": [0, 1, -1]}, "outline": {"contours": [outline]}}],
    })  # fmt: skip


class Page(HTMLParser):
    """Checks that every tag is closed, and gathers attributes and words."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.seen: list[tuple[str, dict[str, str | None]]] = []
        self.words: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.seen.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.seen.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.words.append(data)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a report of two scenes: a disk, and brushed metal under a square."""
    folder = tmp_path_factory.mktemp("report")
    square = {"polygon": [[-1, -1], [1, -1], [1, 1], [-1, 1]]}
    (folder / "disk.json").write_text(scene((0.2, 0.2), {"bezier": DISK}))
    (folder / "brushed.json").write_text(scene((0.1, 0.4), square))
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        wanted = ("--technique", "ltc", "--technique", "ggx:4", "--technique", "uniform:4")
        assert run(["report", "disk.json", "brushed.json", "-o", "out", *SMALL, *wanted]) == 0
    return folder


def figures(folder: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((folder / "out" / "results.json").read_text())
    return found


def test_figures(made: Path) -> None:
    found = figures(made)
    assert set(found) == {"machine", "settings", "rows"}
    rows = {(row["scene"], row["technique"]): row for row in found["rows"]}
    techniques = ("ltc", "ggx:4", "uniform:4")
    assert list(rows) == [(name, t) for name in ("disk", "brushed") for t in techniques]
    for row in rows.values():
        assert row["points"] == 40
        assert row["repeats"] == 2
        assert row["bytes"] > 48 * 32 * (16 + 16 + 4)
        assert row["evaluations"] > 0.0
        assert 0.0 < row["lighting_q1_ms"] <= row["lighting_ms"] <= row["lighting_q3_ms"]
        for name in ("specular_ggx", "specular_own", "diffuse"):
            assert 0.0 <= row[f"{name}_mean"] <= row[f"{name}_max"]
            assert row[f"{name}_p95"] <= row[f"{name}_max"]
    # ltc integrates its own lobe well, but that lobe is not GGX; ggx has no other.
    ltc, ggx = rows["disk", "ltc"], rows["disk", "ggx:4"]
    assert ltc["specular_own_mean"] < 1e-4 < ltc["specular_ggx_mean"]
    assert ggx["specular_own_mean"] == ggx["specular_ggx_mean"] < ltc["specular_ggx_mean"]
    # Four edges a quarter lose 2.6 % of a circle's area.
    assert rows["disk", "uniform:4"]["specular_own_mean"] > 10.0 * ltc["specular_own_mean"]
    # Nothing is more exact than ggx, so it is on the front whatever the times are.
    assert ggx["on_front_ggx"] == 1


def test_csv_has_the_numbers_of_json(made: Path) -> None:
    rows = figures(made)["rows"]
    with (made / "out" / "results.csv").open(newline="") as file:
        lines = list(csv.DictReader(file))
    assert len(lines) == len(rows)
    for line, row in zip(lines, rows, strict=True):
        assert list(line) == list(row)
        for key, value in row.items():
            read = line[key] if isinstance(value, str) else json.loads(line[key] or "null")
            assert read == value, key


def test_page_is_whole_and_loads_nothing(made: Path) -> None:
    text = (made / "out" / "index.html").read_text(encoding="utf-8")
    page = Page()
    page.feed(text)
    page.close()
    assert page.open == []
    assert "://" not in text
    for tag, attributes in page.seen:
        assert tag not in ("link", "iframe", "object", "embed")
        assert "href" not in attributes
        if tag == "script":
            assert "src" not in attributes
        if tag == "img":
            assert re.match("data:image/(png|jpeg);base64,", attributes["src"] or "")
    tags = [tag for tag, _ in page.seen]
    # For the two scenes together one plot, for each of them three; two pictures a technique.
    assert (tags.count("svg"), tags.count("img")) == (7, 12)
    for row in figures(made)["rows"]:
        assert row["technique"] in page.words
        values = [a.get("data-value") for tag, a in page.seen if tag == "td"]
        assert repr(row["specular_ggx_mean"]) in values


def test_a_rerun_measures_only_what_is_missing(
    made: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(made)
    one = ["report", "disk.json", "-o", "out", *SMALL, "--technique", "ggx:4"]
    command = [*one, "--technique", "ltc", "--technique", "uniform:4"]
    parts = {path: path.read_bytes() for path in Path("out/parts").iterdir()}
    broken, missing = Path("out/parts/disk--ltc.json"), Path("out/parts/disk--uniform-4.json")
    broken.write_text('{"format": "ltc-rep')
    missing.unlink()
    before = {path: path.stat().st_mtime_ns for path in parts if path != missing}
    assert run(command) == 0
    out, err = capfd.readouterr()
    assert out == "out/index.html\n"
    assert "1 of 3 parts are there already" in err
    after = {path for path in before if path.stat().st_mtime_ns != before[path]}
    assert after == {broken}
    assert set(parts) == set(Path("out/parts").iterdir())
    # Errors depend on no clock: what is measured again is the same.
    for path in (broken, missing):
        new, old = (json.loads(text)["figures"] for text in (path.read_bytes(), parts[path]))
        for key in ("specular_ggx_mean", "specular_own_max", "evaluations", "bytes"):
            assert new[key] == old[key]
    untouched = Path("out/parts/disk--ggx-4.json")
    for change in (["--again"], ["--points", "41"]):
        stamp = untouched.stat().st_mtime_ns
        assert run([*one, *change]) == 0
        assert "are there already" not in capfd.readouterr().err
        assert untouched.stat().st_mtime_ns != stamp
