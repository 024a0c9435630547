"""What `app.stability` says must hold, held: by hypothesis, and by the command ``stability``."""

from __future__ import annotations

import json
import shlex
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.cli.main import run
from app.render.renderer import Renderer
from app.render.techniques import TECHNIQUES
from app.stability.cases import Case, Sampling, applies, cases_of
from app.stability.clouds import DIMENSIONS
from app.stability.compare import Truth, compare, lasting_jump
from app.stability.measure import Row, measure_case
from app.stability.sweeps import make_sweeps
from tests.gl.conftest import process_context

SWEEPS = make_sweeps()
SAMPLING = Sampling(points=1, steps=24, compared=1, samples=256)
EXAMPLES = settings(derandomize=True, max_examples=5, deadline=None, database=None)


@pytest.fixture(scope="module")
def renderer():
    with process_context():
        renderer = Renderer(process_context())
        # Lights in textures, whatever their size: else every size would be a program.
        renderer.limits = replace(renderer.limits, uniform_block_bytes=0)
        with np.errstate(all="raise", under="ignore"):
            yield renderer
        renderer.release()


@st.composite
def clouds(draw: st.DrawFn, sweep: str) -> Case:
    """Draw points of a sweep: the numbers in [0, 1) that ``stability`` fills evenly."""
    cloud = draw(st.sampled_from(SWEEPS[sweep].clouds))
    share = st.floats(0.0, 1.0, exclude_max=True, width=32)
    rows = draw(st.lists(st.tuples(*[share] * DIMENSIONS), min_size=1, max_size=6))
    return Case(sweep, cloud.name, cloud.light, cloud.place(np.array(rows)), cloud.defined)


def held(renderer: Renderer, case: Case, technique: str) -> tuple[Row, Row]:
    """Return the rows of one case, having checked that nothing is violated."""
    rows = (Row(case.sweep, technique, "specular"), Row(case.sweep, technique, "diffuse"))
    truth = Truth(case)
    measure_case(renderer, truth, technique, rows, SAMPLING)
    for row in rows:
        assert not row.violated, (case.name, technique, row.figures(), row.worst)
    return rows


@pytest.mark.parametrize("sweep", SWEEPS)
def test_what_must_hold_holds_for_any_numbers(renderer, sweep):
    @EXAMPLES
    @given(case=clouds(sweep), technique=st.sampled_from(list(TECHNIQUES)))
    def check(case: Case, technique: str) -> None:
        if applies(technique, case):
            held(renderer, case, technique)

    check()


def test_series_have_no_jumps(renderer):
    for name, index in (("horizon", 0), ("seams", 0), ("near", 0)):
        series = SWEEPS[name].series[index]
        t = np.linspace(0.0, 1.0, 40)
        case = Case(name, series.name, series.light, series.place(t), True, series.place, t)
        for technique in ("ltc", "ggx"):
            held(renderer, case, technique)


class Broken:
    """A renderer whose results are changed: what must hold must then be seen not to."""

    def __init__(self, renderer: Renderer, change) -> None:
        self._renderer, self._change = renderer, change

    def probe(self, *arguments, **inputs):
        found = self._renderer.probe(*arguments, **inputs)
        return {name: self._change(values.copy(), inputs) for name, values in found.items()}


def with_nan(values, inputs):
    values[0] = np.nan
    return values


def lit_everywhere(values, inputs):
    return values + np.float32(1e-7)


def gone_out(values, inputs):
    return values * np.float32(0.0)


def too_bright(values, inputs):
    return values * np.float32(1.01)


def negative(values, inputs):
    return -values


def stepping(values, inputs):
    """Jump where points pass x = 0."""
    return values + np.float32(2e-4) * (inputs["position"][:, :1] > 0.011)


BROKEN = {
    "non_finite": (with_nan, "polygons", "hole"),
    "false_light": (lit_everywhere, "horizon", "below"),
    "lost_light": (gone_out, "alpha", "polygon 0"),
    "beyond": (too_bright, "alpha", "polygon 0"),
    "impossible": (negative, "alpha", "polygon 0"),
}


@pytest.mark.parametrize("check", BROKEN)
def test_what_is_broken_is_seen(renderer, check):
    change, sweep, name = BROKEN[check]
    sampling = Sampling(points=1000, steps=8)
    (case,) = (c for c in cases_of(SWEEPS[sweep], sampling) if c.name == name)
    rows = (Row(sweep, "ltc", "specular"), Row(sweep, "ltc", "diffuse"))
    measure_case(Broken(renderer, change), Truth(case), "ltc", rows, sampling)  # type: ignore[arg-type]
    for row in rows:
        assert getattr(row, check) > 0
        assert row.verdict == "violated"


def test_a_jump_is_seen_and_a_kink_is_none(renderer):
    """What remains however finely one looks is a jump; a slope is not."""
    (series,) = (s for s in SWEEPS["polygons"].series if s.name == "passing, bow tie")
    t = np.linspace(0.0, 1.0, 60)
    case = Case("polygons", series.name, series.light, series.place(t), True, series.place, t)
    broken = Broken(renderer, stepping)
    found = compare(broken, Truth(case), "ltc")  # type: ignore[arg-type]
    index = int(np.argmax(found.jump_excess[0]))
    assert found.jump_excess[0, index] > 0.0
    fine, where, at = lasting_jump(broken, case, "ltc", index, 0)  # type: ignore[arg-type]
    assert fine.jump[0, at] == pytest.approx(2e-4, rel=0.05)
    assert abs(where.points.position[at, 0] - 0.011) <= 1e-4
    honest = compare(renderer, Truth(case), "ltc")
    assert np.max(honest.jump_excess) <= 0.0


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("stability")
    code = run(
        ["stability", "-o", str(folder), "--points", "16", "--sweep", "thin", "--sweep", "theta",
         "--technique", "ltc", "--technique", "ggx", "--technique", "reference"]
    )  # fmt: skip
    assert code == 0
    return folder


def test_the_command_writes_the_same_numbers_everywhere(written):
    document = json.loads((written / "results.json").read_text("utf-8"))
    rows = document["rows"]
    assert {row["technique"] for row in rows} == {"ltc", "ggx", "reference"}
    assert {row["sweep"] for row in rows} == {"thin", "theta"}
    assert all(row["verdict"] == "holds" for row in rows)
    assert all(row["samples"] >= 16 for row in rows)
    table = (written / "results.csv").read_text("utf-8").splitlines()
    assert len(table) == 1 + len(rows)
    assert table[0].split(",")[:3] == ["sweep", "technique", "quantity"]
    page = (written / "index.html").read_text("utf-8")
    assert "<script>" in page
    assert "http" not in page.replace("http-equiv", "")
    text = (written / "stability.md").read_text("utf-8")
    assert "| `ltc` |" in text


def test_worst_cases_reproduce(written, tmp_path, monkeypatch):
    """The printed commands run and give the very error that is reported."""
    monkeypatch.chdir(tmp_path)
    document = json.loads((written / "results.json").read_text("utf-8"))
    for row in document["rows"]:
        if row["technique"] == "reference" or row["quantity"] == "diffuse":
            continue
        words = shlex.split(row["worst"]["probe"])
        assert words[:2] == ["ltc-viewer", "probe"]
        assert run(words[1:]) == 0
        found = np.load("probed.npz")["specular"][0, 0]
        assert found == pytest.approx(row["worst"]["found"][0], abs=0.0)
        error = abs(row["worst"]["found"][0] - row["worst"]["expected"][0])
        assert error <= row["error_max"]
    words = shlex.split(document["rows"][0]["worst"]["shot"])
    assert run([*words[1:], "--size", "32x18"]) == 0


def test_wrong_arguments_are_told(capsys, tmp_path):
    for arguments, parts in (
        (["--sweep", "alfa"], ("'alfa'", "did you mean 'alpha'")),
        (["--technique", "auto"], ("'auto'", "depends on a scene")),
        (["--points", "0"], ("--points", "from 1")),
    ):
        assert run(["stability", "-o", str(tmp_path / "out"), *arguments]) == 2
        said = capsys.readouterr().err
        assert all(part in said for part in parts), said
    assert run(["stability", "-o", str(tmp_path / "no" / "out")]) == 2
