"""The sweeps and definitions that ``stability`` measures by, without a GPU."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from app.cli.stability_page import GENERATED, PREAMBLE, bound_lines
from app.presets import heart
from app.render.techniques import TECHNIQUES, parse_technique
from app.render.truth import exact_radiance
from app.scene import ALPHA_MIN, Plane
from app.stability.bounds import EXCEPTIONS, UNBOUNDED, bound_of
from app.stability.cases import Sampling, cases_of, compared_techniques
from app.stability.clouds import DIMENSIONS, Ranges, aimed
from app.stability.definitions import definition_of
from app.stability.lights import lamp, random_plane, random_polygon
from app.stability.points import ROUNDING, Points, Seen, certainly_dark, unit
from app.stability.sweeps import make_sweeps

ROOT = Path(__file__).resolve().parents[2]
SWEEPS = make_sweeps()
FEW = Sampling(points=1, steps=24)


def numbers(count: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).random((count, DIMENSIONS))


@pytest.mark.parametrize("name", SWEEPS)
def test_points_are_what_a_probe_takes(name):
    for case in cases_of(SWEEPS[name], FEW):
        points = case.points
        for array in points.inputs().values():
            assert np.all(np.isfinite(array)), case.name
        for way in (points.normal, points.tangent, points.view):
            np.testing.assert_allclose(np.linalg.norm(way, axis=1), 1.0, atol=1e-12)
        assert np.max(np.abs(np.sum(points.normal * points.tangent, axis=1))) <= 1e-12
        assert np.min(np.sum(points.normal * points.view, axis=1)) > 0.0, case.name
        assert np.all((points.alpha >= ALPHA_MIN) & (points.alpha <= 1.0))


def test_sweeps_go_as_far_as_they_say():
    def all_points(name):
        cases = cases_of(SWEEPS[name], Sampling(points=2000, steps=24))
        return [case.points for case in cases]

    alpha = np.concatenate([p.alpha for p in all_points("alpha")])
    assert alpha.min() <= 1.01 * ALPHA_MIN
    assert alpha.max() == 1.0
    cosine = np.concatenate([np.sum(p.normal * p.view, axis=1) for p in all_points("theta")])
    assert np.degrees(np.arccos(cosine.min())) >= 89.89
    ratio = np.concatenate([p.alpha[:, 0] / p.alpha[:, 1] for p in all_points("anisotropy")])
    assert ratio.min() <= 0.011
    assert ratio.max() >= 90.0


def test_the_same_seed_makes_the_same_points():
    first, again, other = (
        cases_of(make_sweeps(seed)["alpha"], Sampling(points=64, steps=8, seed=seed))
        for seed in (3, 3, 4)
    )
    for a, b in zip(first, again, strict=True):
        assert a.light == b.light
        np.testing.assert_array_equal(a.points.position, b.points.position)
    assert not np.array_equal(first[0].points.view, other[0].points.view)


@pytest.mark.parametrize("technique", ["ltc", "ggx"])
@pytest.mark.parametrize("curved", [False, True])
def test_definitions_are_the_truth_that_reports_measure_by(technique, curved):
    """`app.render.truth` goes another way about frames, and takes polygons as curves."""
    rng = np.random.default_rng(1)
    light = lamp(heart() if curved else random_polygon(rng), random_plane(rng))
    points = aimed(light, Ranges((0.05, 1.0)))(numbers(40)).rounded()
    seen = Seen.of(light, points)
    definition = definition_of(parse_technique(technique), seen)
    specular, diffuse = exact_radiance(
        (light,), points.position, points.normal, points.view, points.alpha[:, 0], technique
    )  # fmt: skip
    smooth = definition.smooth(seen)
    np.testing.assert_allclose(smooth.specular, specular[:, 0], rtol=0, atol=2e-6)
    np.testing.assert_allclose(smooth.diffuse, diffuse[:, 0], rtol=0, atol=1e-9)


def test_dark_is_dark_in_float64_too():
    dark = 0
    for sweep in SWEEPS.values():
        for case in cases_of(sweep, FEW):
            points = case.points.rounded()
            hidden = certainly_dark(case.light, points)
            if np.any(hidden):
                seen = Seen.of(case.light, points).pick(hidden)
                value = definition_of(parse_technique("ltc"), seen).own(seen)
                assert not np.any(value.specular)
                assert not np.any(value.diffuse)
                dark += len(seen)
    assert dark >= 100


def test_jitter_moves_by_roundings_and_keeps_outlines_closed_and_flat():
    rng = np.random.default_rng(2)
    light = lamp(heart(), Plane((0.3, 0.2, -1.0)))
    seen = Seen.of(light, aimed(light)(numbers(30, 3)))
    moved = seen.jittered(rng)
    (before,), (after,) = seen.contours, moved.contours
    reach = np.linalg.norm(before, axis=-1)
    off = np.linalg.norm(after - before, axis=-1)
    curve = np.linalg.norm(np.ptp(before, axis=2), axis=-1)[:, :, None]
    assert np.all(off <= 8.0 * ROUNDING * (reach + curve))
    assert np.median(off / reach) >= ROUNDING
    np.testing.assert_array_equal(after[:, :, 3], np.roll(after[:, :, 0], -1, axis=1))
    for p in after.reshape(30, -1, 3):
        spread = np.linalg.svd(p - p.mean(axis=0), compute_uv=False)
        assert spread[2] <= 1e-13 * spread[0]
    assert np.max(np.abs(moved.wo - seen.wo)) <= 8.0 * ROUNDING


def test_facing_the_view_changes_no_value():
    rng = np.random.default_rng(4)
    light = lamp(random_polygon(rng), random_plane(rng))
    points = aimed(light, Ranges((0.1, 0.5)))(numbers(20, 5))
    seen = Seen.of(light, points)
    facing = seen.facing_view()
    assert np.max(np.abs(facing.wo[:, 1])) == 0.0
    definition = definition_of(parse_technique("ggx"), seen)
    one, other = definition.smooth(seen), definition.smooth(facing)
    np.testing.assert_allclose(one.specular, other.specular, rtol=0, atol=2e-6)
    np.testing.assert_allclose(one.diffuse, other.diffuse, rtol=0, atol=1e-12)


def test_every_technique_has_a_bound_or_a_cause():
    for name in compared_techniques():
        choice = parse_technique(name)
        for curved in (False, True):
            assert bound_of(choice, curved, "specular") or choice.name in UNBOUNDED
    assert {parse_technique(name).name for name in compared_techniques()} == set(TECHNIQUES)
    assert set(UNBOUNDED) <= set(TECHNIQUES)


def test_points_of_one_row_broadcast():
    points = Points.of(np.zeros((5, 3)), (0.0, 2.0, 0.0), (1.0, 1.0, 0.0), 0.5)
    assert len(points) == 5
    np.testing.assert_allclose(points.view, np.tile(unit(np.array([1.0, 1.0, 0.0])), (5, 1)))
    np.testing.assert_allclose(points.tangent, np.tile([1.0, 0.0, 0.0], (5, 1)), atol=1e-15)


def test_the_page_of_the_docs_is_of_these_sweeps_and_bounds():
    """It is a copy of what the command writes; measured numbers may be older than the code."""
    text = (ROOT / "docs" / "stability.md").read_text("utf-8")
    for sweep in SWEEPS.values():
        assert f"| `{sweep.name}` | {sweep.about} |" in text
    for item in EXCEPTIONS:
        assert item.bound.reason in text, f"run '{GENERATED}' and copy its stability.md to docs/"
    for line in bound_lines():
        assert line[-1] in text
    assert PREAMBLE in text
