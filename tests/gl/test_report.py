"""``ltc-viewer report``: its files say the same, load nothing, and are made but once."""

from __future__ import annotations

import csv
import json
import re
import shutil
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from app.cli import report_run
from app.cli.main import run
from app.cli.report_plots import STYLES, kind_of
from app.cli.report_run import run_report
from app.measure.entries import PICTURES, entries_of, parse_entry
from app.measure.errors import choose_points, exact_truth, lit_evenly, sampled_truth
from app.scene import RenderSettings, Shot
from app.scene_io import load_scene

H = 0.5522847498
"""The handles of a quarter circle."""
DISK = [
    [[1, 0], [1, H], [H, 1], [0, 1]], [[0, 1], [-H, 1], [-1, H], [-1, 0]],
    [[-1, 0], [-1, -H], [-H, -1], [0, -1]], [[0, -1], [H, -1], [1, -H], [1, 0]],
]  # fmt: skip
SMALL = ("--size", "48x32", "--points", "40", "--repeats", "2", "--workers", "1")
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


WANTED = (
    "ltc", "ggx:4", "uniform:4", "reference:1", "reference:16", "ltc+residual:4",
    "representative-point",
)  # fmt: skip
"""In the order of help."""


def options(*techniques: str) -> list[str]:
    return [word for name in techniques for word in ("--technique", name)]


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a report of two scenes: a disk, and brushed metal under a square."""
    folder = tmp_path_factory.mktemp("report")
    square = {"polygon": [[-1, -1], [1, -1], [1, 1], [-1, 1]]}
    (folder / "disk.json").write_text(scene((0.2, 0.2), {"bezier": DISK}))
    (folder / "brushed.json").write_text(scene((0.1, 0.4), square))
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        command = ["report", "disk.json", "brushed.json", "-o", "out", *SMALL, *options(*WANTED)]
        assert run(command) == 0
    return folder


def figures(folder: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((folder / "out" / "results.json").read_text())
    return found


def rows_of(folder: Path) -> dict[tuple[str, str], dict[str, Any]]:
    return {(row["scene"], row["technique"]): row for row in figures(folder)["rows"]}


def test_figures(made: Path) -> None:
    assert set(figures(made)) == {"machine", "settings", "rows"}
    rows = rows_of(made)
    assert list(rows) == [(name, technique) for name in ("disk", "brushed") for technique in WANTED]
    for row in rows.values():
        assert row["points"] == 40
        assert row["repeats"] == 2
        assert row["bytes"] > 48 * 32 * (16 + 16 + 4)
        parts = [row[f"{part}_bytes"] for part in ("table", "buffer", "attachment")]
        assert row["bytes"] == sum(parts)
        looks_up = row["technique"] in ("ltc", "uniform:4", "ltc+residual:4")
        assert (row["table_bytes"] > 0) is looks_up
        assert row["evaluations"] > 0.0
        assert 0.0 < row["lighting_q1_ms"] <= row["lighting_ms"] <= row["lighting_q3_ms"]
        assert row["truth"] == "exact"
        assert 0.0 <= row["truth_uncertainty"] < 1e-6
        for name in ("specular_ggx", "diffuse"):
            assert 0.0 <= row[f"{name}_mean"] <= row[f"{name}_max"]
            assert row[f"{name}_p95"] <= row[f"{name}_max"]
    # ltc integrates its own lobe well, but that lobe is not GGX; ggx has no other.
    ltc, ggx = rows["disk", "ltc"], rows["disk", "ggx:4"]
    assert ltc["specular_own_mean"] < 1e-4 < ltc["specular_ggx_mean"]
    assert ggx["specular_own_mean"] == ggx["specular_ggx_mean"] < ltc["specular_ggx_mean"]
    assert ggx["picture_share"] == 0.0 < ltc["picture_share"] < 0.1
    # Four edges a quarter lose 2.6 % of a circle's area.
    assert rows["disk", "uniform:4"]["specular_own_mean"] > 10.0 * ltc["specular_own_mean"]
    # Nothing is more exact than ggx, so it is on the front whatever the times are.
    assert ggx["on_front_ggx"] == 1
    for name in ("disk", "brushed"):
        # Sixteen samples halve the noise twice, or better, and take sixteen times the time.
        one, many = rows[name, "reference:1"], rows[name, "reference:16"]
        assert many["specular_ggx_mean"] < 0.5 * one["specular_ggx_mean"]
        assert many["evaluations"] == 16.0 * one["evaluations"]
        assert many["samples"] == 16
        # What tables lack is noise, and less of it than of the whole.
        residual = rows[name, "ltc+residual:4"]
        assert residual["specular_own_mean"] == residual["specular_ggx_mean"]
        assert residual["specular_ggx_mean"] < 0.5 * one["specular_ggx_mean"]
        # A representative point has no integral that it approximates, and is far from GGX's.
        point = rows[name, "representative-point"]
        assert point["specular_own_mean"] is None
        assert point["specular_ggx_mean"] > 5.0 * rows[name, "ltc"]["specular_ggx_mean"]


def test_no_row_beats_the_front(made: Path) -> None:
    rows = figures(made)["rows"]
    for row in rows:
        others = [r for r in rows if r["scene"] == row["scene"] and r is not row]
        pair = row["lighting_ms"], row["specular_ggx_mean"]
        beaten = any(
            (o["lighting_ms"], o["specular_ggx_mean"]) != pair
            and o["lighting_ms"] <= pair[0]
            and o["specular_ggx_mean"] <= pair[1]
            for o in others
        )
        assert row["on_front_ggx"] == int(not beaten)


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
            assert re.match("data:image/webp;base64,", attributes["src"] or "")
    tags = [tag for tag, _ in page.seen]
    assert tags.count("img") == 2 * 2 * len(WANTED)
    plots = [a for tag, a in page.seen if tag == "svg" and (a.get("width") or "") > "2"]
    assert len(plots) == 7, "for the two scenes together one plot, for each of them three"
    values = [a.get("data-value") for tag, a in page.seen if tag == "td"]
    for row in figures(made)["rows"]:
        assert row["technique"] in page.words
        for key in ("lighting_ms", "specular_ggx_mean", "specular_ggx_max", "bytes", "evaluations"):
            assert repr(row[key]) in values


def test_every_technique_has_a_style(made: Path) -> None:
    entries = entries_of(load_scene(made / "disk.json"))
    kinds = {kind_of(str(entry)) for entry in entries}
    assert kinds | {kind_of(name) for name in PICTURES} == set(STYLES)
    marks = list(STYLES.values())
    assert len(set(marks)) == len(marks)


def test_plots_are_files_too(made: Path) -> None:
    for name in ("all-scenes", "disk", "brushed"):
        assert Image.open(made / "out" / f"{name}.png").size == (1120, 760)
        svg = (made / "out" / f"{name}.svg").read_text(encoding="utf-8")
        for technique in WANTED:
            assert f"<title>{technique}: " in svg


def test_a_rerun_measures_only_what_is_missing(
    made: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(shutil.copytree(made, tmp_path / "copy"))
    one = ["report", "disk.json", "-o", "out", *SMALL, *options("ggx:4")]
    command = [*one, *options("ltc", "uniform:4")]
    parts = {path: path.read_bytes() for path in Path("out/parts").glob("disk*")}
    broken, missing = Path("out/parts/disk--ltc.json"), Path("out/parts/disk--uniform-4.json")
    truth = Path("out/parts/disk--truth-ggx.npz")
    broken.write_text('{"format": "ltc-rep')
    truth.write_bytes(parts[truth][:100])
    missing.unlink()
    before = {path: path.stat().st_mtime_ns for path in parts if path != missing}
    assert run(command) == 0
    out, err = capfd.readouterr()
    assert out == "out/index.html\n"
    assert "1 of 3 parts are there already" in err
    after = {path for path in before if path.stat().st_mtime_ns != before[path]}
    assert after == {broken, truth}
    assert set(parts) == set(Path("out/parts").glob("disk*"))
    # Errors depend on no clock: what is measured again is the same.
    for path in (broken, missing):
        new, old = (json.loads(text)["figures"] for text in (path.read_bytes(), parts[path]))
        for key in ("specular_ggx_mean", "specular_own_max", "evaluations", "bytes"):
            assert new[key] == old[key]
    untouched = Path("out/parts/disk--ggx-4.json")
    for change in (["--again"], ["--points", "41"], ["--clock", "processor"]):
        stamp = untouched.stat().st_mtime_ns
        assert run([*one, *change]) == 0
        assert "are there already" not in capfd.readouterr().err
        assert untouched.stat().st_mtime_ns != stamp


class Counting(ThreadPoolExecutor):
    """Any executor will do; this one counts what it is given."""

    tasks = 0

    def submit(self, fn: Any, /, *args: Any, **keywords: Any) -> Future[Any]:
        self.tasks += 1
        return super().submit(fn, *args, **keywords)


def test_interrupted_with_an_executor(made: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C after some techniques: those stay, the truths too, and the rest follows."""
    monkeypatch.chdir(made)
    wanted = {"techniques": ("ltc", "ggx:1", "ggx:4"), "size": (48, 32), "points": 40, "repeats": 1}
    measure, seen = report_run.measure_passes, []

    def interrupted(*arguments: Any) -> Any:
        seen.append(arguments)
        if len(seen) == 3:
            raise KeyboardInterrupt
        return measure(*arguments)

    monkeypatch.setattr(report_run, "measure_passes", interrupted)
    with Counting(2) as executor:
        with pytest.raises(KeyboardInterrupt):
            run_report(["disk.json"], Path("stopped"), **wanted, executor=executor)
        assert executor.tasks == 2 * 3, "40 points in tasks of 16, for two lobes"
        assert not Path("stopped/index.html").exists()
        assert len(list(Path("stopped/parts").glob("*.json"))) == 2
        page = run_report(["disk.json"], Path("stopped"), **wanted, executor=executor)
        assert executor.tasks == 2 * 3
    assert page.is_file()
    assert len(seen) == 4
    # Who computes the truth makes no difference.
    rows = json.loads(Path("stopped/results.json").read_text())["rows"]
    for row in rows:
        if row["technique"] != "ggx:1":
            other = rows_of(made)["disk", row["technique"]]
            assert row["specular_ggx_mean"] == other["specular_ggx_mean"]


def test_workers_are_processes(made: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(made)
    words = [*SMALL[:-1], "2", *options("ggx:4")]
    assert run(["report", "disk.json", "-o", "shared", *words]) == 0
    (row,) = json.loads(Path("shared/results.json").read_text())["rows"]
    assert row["specular_ggx_mean"] == rows_of(made)["disk", "ggx:4"]["specular_ggx_mean"]


class Broken(Executor):
    """One whose workers die."""

    def submit(self, fn: Any, /, *args: Any, **keywords: Any) -> Future[Any]:
        future: Future[Any] = Future()
        future.set_exception(RuntimeError("a worker died"))
        return future


def test_a_worker_that_dies_is_told(made: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(made)
    with pytest.raises(RuntimeError, match="a worker died"):
        run_report(["disk.json"], Path("dead"), points=8, size=(32, 32), executor=Broken())


def test_two_truths_agree(made: Path, renderer) -> None:
    """The exact integrals and what the reference converges to, within its standard error."""
    for name in ("disk", "brushed"):
        one = load_scene(made / f"{name}.json")
        renderer.render(Shot(one, RenderSettings("ggx"), 48, 32))
        points = choose_points(renderer, lit_evenly(one), 60)
        assert points.anisotropic is (name == "brushed")
        exact = exact_truth(lit_evenly(one), points, "ggx")
        sampled = sampled_truth(renderer, lit_evenly(one), points, 2048)
        assert 0.0 < sampled.uncertainty < 0.02
        for lobe in ("specular", "diffuse"):
            apart = np.abs(getattr(exact, lobe) - getattr(sampled, lobe))
            # The largest standard error of all, four times, from eight estimates each.
            assert apart.max() < 4.0 * sampled.uncertainty
            assert apart.mean() < sampled.uncertainty


def test_without_exact_integrals_the_reference_is_the_truth(
    made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Errors then are those to its mean; the page says so, with its standard error."""
    monkeypatch.setattr(report_run, "has_exact_truth", lambda scene: False)
    monkeypatch.setattr(report_run, "TRUTH_SAMPLES", 4096)
    wanted = ("ltc", "ggx:4")
    page = run_report(
        [str(made / "disk.json")], tmp_path / "out", techniques=wanted, size=(48, 32), points=40,
        repeats=1,
    )  # fmt: skip
    for row in json.loads((tmp_path / "out/results.json").read_text())["rows"]:
        exact = rows_of(made)["disk", row["technique"]]
        assert row["truth"] == "reference"
        assert 0.0 < row["truth_uncertainty"] < 0.01
        assert row["specular_own_mean"] is None or row["technique"] == "ggx:4"
        apart = abs(row["specular_ggx_mean"] - exact["specular_ggx_mean"])
        assert apart < row["truth_uncertainty"]
    assert "converges to, with a standard error of" in page.read_text(encoding="utf-8")


def test_entries(made: Path) -> None:
    curved, plain = (load_scene(made / f"{name}.json") for name in ("disk", "brushed"))
    names = [str(entry) for entry in entries_of(curved)]
    assert names == sorted(names, key=lambda name: parse_entry(name).place())
    assert {"ltc:2", "uniform:96", "adaptive", "reference:256", "representative-point"} <= set(
        names
    )
    assert len(names) == len(set(names))
    # Where nothing is curved those are one program, and measured once.
    left = {str(entry) for entry in entries_of(plain)}
    curved_only = {name for name in names if name.startswith(("ltc:", "ad", "uni"))}
    # Brushed surfaces look up a table of one size.
    tables = {"ltc/no-table", "ltc/table-4", "ltc/table-8", "ltc/table-32"}
    assert set(names) - left == curved_only | tables
    assert [str(e) for e in entries_of(plain, ["reference", "auto", "ggx"])] == [
        "ggx",
        "reference:1",
    ]


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (
            ["--technique", "reference:0"],
            'number of samples is "0", expected a whole number from 1',
        ),
        (["--technique", "reference:x"], 'number of samples is "x"'),
        (["--technique", "refrence:4"], "did you mean 'reference'"),
        (["--technique", "ggx:9"], "expected a whole number from 1 to 4"),
        (["--workers", "0"], "--workers is 0, expected a whole number from 1"),
        (["--clock", "sun"], '--clock is "sun"'),
        (["--points", "0"], "--points is 0"),
    ],
)
def test_bad_input(
    words: list[str], told: str, made: Path, monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.chdir(made)
    assert run(["report", "disk.json", "-o", "none", *words]) == 2
    assert told in capfd.readouterr().err
    assert not Path("none").exists()
