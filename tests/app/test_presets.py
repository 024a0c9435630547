"""Presets: round ones against their circles, all against what a menu and the editor expect."""

from __future__ import annotations

import math

import numpy as np
import pytest

from app import curves
from app.outline import area, boundary, contains
from app.presets import (
    PRESETS,
    disk,
    ellipse,
    heart,
    ring,
    rounded_rectangle,
    star,
)
from app.scene import BezierContour, Outline, SceneError


def drawn(outline: Outline) -> np.ndarray:
    return np.concatenate(
        [np.array(c.curves) for c in outline.contours if isinstance(c, BezierContour)]
    )


@pytest.mark.parametrize("radius", [1e-3, 1.0, 250.0])
def test_the_disk_is_round_to_a_millionth(radius: float) -> None:
    points = curves.evaluate(drawn(disk(radius))[:, None], np.linspace(0.0, 1.0, 1001))
    distance = np.hypot(points[..., 0], points[..., 1]) / radius
    assert np.max(np.abs(distance - 1.0)) < 4e-7  # 3.7e-7, from the module's formula
    assert area(disk(radius)) == pytest.approx(math.pi * radius**2, rel=1e-6)


def test_the_ellipse_is_a_stretched_disk() -> None:
    stretched = drawn(disk(1.0)) * (2.0, 0.5)
    assert drawn(ellipse(2.0, 0.5)) == pytest.approx(stretched, abs=1e-15)


def test_the_ring_has_a_hole() -> None:
    shape = ring(2.0, 1.0)
    assert area(shape) == pytest.approx(3.0 * math.pi, rel=1e-6)
    assert not contains(shape, (0.0, 0.0))
    assert contains(shape, (1.5, 0.0))
    outer, hole = (float(np.sum(curves.signed_areas(loop))) for loop in boundary(shape))
    assert outer > 0.0 > hole


@pytest.mark.parametrize(("width", "height", "radius"), [(2.0, 1.0, 0.1), (2, 1, 0.5), (2, 2, 1)])
def test_the_rounded_rectangle_lacks_its_corners(
    width: float, height: float, radius: float
) -> None:
    shape = rounded_rectangle(width, height, radius)
    wanted = width * height - (4.0 - math.pi) * radius**2
    assert area(shape) == pytest.approx(wanted, rel=1e-6)
    low, high = curves.bounds(drawn(shape))
    assert np.array_equal(low.min(axis=0), (-width / 2, -height / 2))
    assert np.array_equal(high.max(axis=0), (width / 2, height / 2))


def test_the_heart_is_its_own_mirror_image() -> None:
    shape = heart(1.5)
    for s, t in np.random.default_rng(3).uniform(-1.0, 1.0, (200, 2)):
        assert contains(shape, (s, t)) == contains(shape, (-s, t))
    low, high = curves.bounds(drawn(shape))
    assert 1.4 < high[:, 1].max() - low[:, 1].min() < 1.5
    assert high[:, 0].max() - low[:, 0].min() == pytest.approx(1.5)


@pytest.mark.parametrize("points", [2, 3, 5, 12])
def test_the_sharp_star_is_made_of_triangles(points: int) -> None:
    wanted = points * math.sin(math.pi / points) * 1.5 * 0.5
    assert area(star(points, 1.5, 0.5)) == pytest.approx(wanted)
    assert contains(star(points, 1.5, 0.5), (0.0, 1.49))


def test_a_round_star_turns_into_itself() -> None:
    shape = star(6, 1.0, 0.5, roundness=1.0)
    turn = 2.0 * math.pi / 6.0
    cos, sin = math.cos(turn), math.sin(turn)
    for s, t in np.random.default_rng(4).uniform(-1.2, 1.2, (200, 2)):
        assert contains(shape, (s, t)) == contains(shape, (cos * s - sin * t, sin * s + cos * t))


@pytest.mark.parametrize("name", PRESETS)
def test_anchors_are_what_their_kinds_say(name: str) -> None:
    shape = PRESETS[name]()
    assert area(shape) > 0.5
    for contour in shape.contours:
        if not isinstance(contour, BezierContour):
            continue
        assert len(contour.kinds) == len(contour.curves)
        for i, kind in enumerate(contour.kinds):
            before, after = np.array(contour.curves[i - 1]), np.array(contour.curves[i])
            behind, ahead = before[3] - before[2], after[1] - after[0]
            lengths = np.hypot(*behind), np.hypot(*ahead)
            turn = behind[0] * ahead[1] - behind[1] * ahead[0]
            if kind == "corner":
                assert abs(turn) > 0.1 * lengths[0] * lengths[1]
            else:
                assert abs(turn) < 1e-12 * lengths[0] * lengths[1]
                assert np.dot(behind, ahead) > 0.0
            if kind == "symmetric":
                assert lengths[0] == pytest.approx(lengths[1], rel=1e-12)


@pytest.mark.parametrize("name", PRESETS)
def test_presets_cross_nothing_and_keep_their_curves(name: str) -> None:
    shape = PRESETS[name]()
    theirs = {tuple(map(tuple, curve.tolist())) for loop in boundary(shape) for curve in loop}
    for contour in shape.contours:
        if isinstance(contour, BezierContour):
            for curve in contour.curves:
                if not curves.is_straight(curve):
                    assert curve in theirs or curve[::-1] in theirs


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: disk(0.0), "radius is 0, expected a number above 0"),
        (lambda: ring(1.0, 1.0), "ring: outer is 1, expected more than inner, 1"),
        (lambda: rounded_rectangle(2.0, 1.0, 0.6), "expected at most half the shorter side, 0.5"),
        (lambda: star(1), "star: points is 1, expected 2 or more"),
        (lambda: star(roundness=2.0), "star: roundness is 2, expected between 0 and 1"),
        (lambda: heart(-1.0), "size is -1, expected a number above 0"),
    ],
)
def test_impossible_sizes_are_refused(make, message: str) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(SceneError, match=message):
        make()
