"""Bézier arithmetic: against de Casteljau's construction, dense sampling and differences."""

from __future__ import annotations

import numpy as np
import pytest

from app import curves

RNG = np.random.default_rng(20240611)
RANDOM = RNG.normal(size=(200, 4, 2))


def de_casteljau(points: np.ndarray, t: float) -> np.ndarray:
    while len(points) > 1:
        points = (1.0 - t) * points[:-1] + t * points[1:]
    return points[0]


def test_points_are_de_casteljaus() -> None:
    for curve in RANDOM[:20]:
        for t in (0.0, 0.1, 0.5, 0.9, 1.0):
            assert curves.evaluate(curve, t) == pytest.approx(de_casteljau(curve, t), abs=1e-14)


def test_ends_are_the_very_control_points() -> None:
    assert np.array_equal(curves.evaluate(RANDOM, 0.0), RANDOM[:, 0])
    assert np.array_equal(curves.evaluate(RANDOM, 1.0), RANDOM[:, 3])


def test_parameters_broadcast_against_curves() -> None:
    t = np.linspace(0.0, 1.0, 7)
    points = curves.evaluate(RANDOM[:, None], t)
    assert points.shape == (200, 7, 2)
    assert np.array_equal(points[3, 2], curves.evaluate(RANDOM[3], t[2]))


def test_derivative_is_the_difference_quotient() -> None:
    t, h = 0.3, 1e-6
    quotient = (curves.evaluate(RANDOM, t + h) - curves.evaluate(RANDOM, t - h)) / (2.0 * h)
    assert curves.derivative(RANDOM, t) == pytest.approx(quotient, abs=1e-8)


def test_split_parts_are_the_curve_and_meet_to_the_bit() -> None:
    cut = RNG.uniform(size=200)
    before, after = curves.split(RANDOM, cut)
    assert np.array_equal(before[:, 3], after[:, 0])
    assert np.array_equal(before[:, 0], RANDOM[:, 0])
    assert np.array_equal(after[:, 3], RANDOM[:, 3])
    for u in (0.2, 0.7):
        assert curves.evaluate(before, u) == pytest.approx(curves.evaluate(RANDOM, cut * u))
        there = curves.evaluate(RANDOM, cut + (1.0 - cut) * u)
        assert curves.evaluate(after, u) == pytest.approx(there)


def test_part_and_reversal() -> None:
    part = curves.part(RANDOM, 0.8, 0.3)
    for u in (0.0, 0.4, 1.0):
        there = curves.evaluate(RANDOM, 0.8 - 0.5 * u)
        assert curves.evaluate(part, u) == pytest.approx(there, abs=1e-13)
    backwards = curves.reversed_curves(RANDOM)
    assert np.array_equal(backwards[0, 0], RANDOM[-1, 3])
    assert np.array_equal(curves.reversed_curves(backwards), RANDOM)


def test_bounds_hold_the_curve_tightly() -> None:
    low, high = curves.bounds(RANDOM)
    points = curves.evaluate(RANDOM[:, None], np.linspace(0.0, 1.0, 4001))
    # Between samples a curve passes its turning point by about its bend times (1/8000)².
    assert np.all(points >= low[:, None] - 1e-14)
    assert np.all(points <= high[:, None] + 1e-14)
    assert low == pytest.approx(points.min(axis=1), abs=1e-6)
    assert high == pytest.approx(points.max(axis=1), abs=1e-6)


@pytest.mark.parametrize(
    "controls",
    [
        pytest.param([(0, 0), (1, 0), (0, 1), (1, 1)], id="vertical tangent twice at once"),
        pytest.param([(0, 0), (0, 0), (0, 0), (0, 0)], id="a point"),
        pytest.param([(0, 0), (1, 0), (2, 0), (3, 0)], id="a line"),
        pytest.param([(0, 0), (2, 1), (-1, 1), (1, 0)], id="a loop"),
        pytest.param([(0, 0), (1, 1), (0, 1), (1, 0)], id="a cusp"),
        pytest.param([(0, 0), (0, 0), (1, 1), (1, 1)], id="handles on the anchors"),
        pytest.param([(0, 0), (2, 4), (4, 4), (6, 0)], id="a raised quadratic"),
    ],
)
def test_bounds_of_special_curves(controls: list[tuple[float, float]]) -> None:
    curve = np.array(controls, dtype=np.float64)
    points = curves.evaluate(curve, np.linspace(0.0, 1.0, 100_001))
    low, high = curves.bounds(curve)
    assert low == pytest.approx(points.min(axis=0), abs=1e-9)
    assert high == pytest.approx(points.max(axis=0), abs=1e-9)


def test_lines_are_straight_wherever_they_are() -> None:
    for offset in (0.0, 1.0, 1e3, 1e6):
        for length in (1e-6, 1.0, 1e6):
            start = offset + RNG.normal(size=(50, 2))
            end = start + length * RNG.normal(size=(50, 2))
            lines = curves.line_as_cubic(start, end)
            assert np.all(curves.is_straight(lines))
            assert np.all(curves.is_straight(lines[:, ::-1]))
            assert np.array_equal(lines[:, 0], start)
            assert np.array_equal(lines[:, 3], end)


def test_what_bends_or_runs_unevenly_is_not_straight() -> None:
    assert not np.any(curves.is_straight(RANDOM))
    line = curves.line_as_cubic((0.0, 0.0), (3.0, 1.0))
    for change in ((0.0, 1e-9), (1e-9, 0.0)):
        bent = line.copy()
        bent[1] += change
        assert not curves.is_straight(bent)
    assert curves.is_straight(np.full((4, 2), 2.5))


def test_raised_quadratics_are_the_same_curves() -> None:
    quadratics = RNG.normal(size=(50, 3, 2))
    cubics = curves.quadratic_as_cubic(quadratics)
    for t in (0.25, 0.6):
        a, b, c = (quadratics[:, i] for i in range(3))
        there = (1 - t) ** 2 * a + 2 * t * (1 - t) * b + t**2 * c
        assert curves.evaluate(cubics, t) == pytest.approx(there, abs=1e-14)


def test_signed_areas_are_those_of_many_lines() -> None:
    points = curves.evaluate(RANDOM[:, None], np.linspace(0.0, 1.0, 4001))
    a, b = points[:, :-1], points[:, 1:]
    lines = 0.5 * np.sum(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0], axis=1)
    # Lines lose a part that falls with the square of their number.
    assert curves.signed_areas(RANDOM) == pytest.approx(lines, abs=1e-5)


@pytest.mark.parametrize("tolerance", [1e-1, 1e-3, 1e-5])
def test_flat_lines_stay_within_the_tolerance(tolerance: float) -> None:
    for curve in RANDOM[:30]:
        points = curves.flatten(curve[None], tolerance)
        corners = np.concatenate((points, curve[3:]))
        t = np.linspace(0.0, 1.0, len(corners))
        middle = curves.evaluate(curve, 0.5 * (t[1:] + t[:-1]))
        a, b = corners[:-1], corners[1:]
        along = np.clip(
            np.sum((middle - a) * (b - a), axis=1) / np.sum((b - a) ** 2, axis=1), 0.0, 1.0
        )
        off = np.hypot(*(middle - a - along[:, None] * (b - a)).T)
        assert off.max() <= tolerance


def test_straight_pieces_stay_one_line() -> None:
    corners = RNG.normal(size=(6, 2))
    loop = curves.line_as_cubic(corners, np.roll(corners, -1, axis=0))
    assert np.array_equal(curves.flatten(loop, 1e-6), corners)


def test_other_shapes_are_refused() -> None:
    with pytest.raises(ValueError, match=r"expected \(\.\.\., 4, 2\)"):
        curves.evaluate(np.zeros((3, 2)), 0.5)
