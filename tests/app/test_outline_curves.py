"""Curved outlines: against fine polygons through the exact arrangement, and closed forms."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from app import curve_arrangement, curves
from app.monotone_pieces import winding_number
from app.outline import area, boundary, contains, resolve, signed_area, triangulate
from app.polygon_arrangement import polygon_regions
from app.presets import disk, ellipse, heart, ring, rounded_rectangle
from app.scene import (
    FILL_RULES,
    BezierContour,
    Contour,
    FillRule,
    Outline,
    PolygonContour,
)

Chain = np.ndarray
Generator = np.random.Generator

FLAT = 5e-5
"""How far the polygons that areas are compared with may be from the curves, in extents."""


def bezier(chain: Chain) -> BezierContour:
    return BezierContour(tuple(tuple(map(tuple, curve)) for curve in chain.tolist()))


def outline(*chains: Chain, rule: FillRule = "evenodd") -> Outline:
    return Outline(tuple(bezier(chain) for chain in chains), rule)


def chains_of(shape: Outline) -> list[Chain]:
    return [np.array(c.curves) for c in shape.contours if isinstance(c, BezierContour)]


def lines(*points: tuple[float, float]) -> Chain:
    return curves.line_as_cubic(points, np.roll(points, -1, axis=0))


def moved(chain: Chain, s: float, t: float) -> Chain:
    return np.asarray(chain + np.array((s, t)))


def closed(points: np.ndarray) -> Chain:
    """Make a chain of anchors and two handles each, (3k, 2)."""
    everything = np.concatenate((points, points[:1]))
    return np.stack([everything[i : i + 4] for i in range(0, len(points), 3)])


DISK = chains_of(disk())[0]
DISK_AREA = area(disk())
SQUARE = lines((-1, -1), (1, -1), (1, 1), (-1, 1))
HALF_DISK = np.concatenate((DISK[:6], curves.line_as_cubic([(-1.0, 0.0)], [(1.0, 0.0)])))


# What every boundary has to be


def flattened(chains: list[Chain]) -> tuple[list[np.ndarray], float]:
    """Return fine polygons, and how much area they may lack or have too much."""
    tolerance = FLAT * float(np.ptp(np.concatenate(chains).reshape(-1, 2), axis=0).max())
    polygons = [curves.flatten(chain, tolerance) for chain in chains]
    length = sum(np.hypot(*(np.roll(p, -1, axis=0) - p).T).sum() for p in polygons)
    return [p if len(p) > 2 else np.concatenate((p, p, p)) for p in polygons], tolerance * length


def assert_is_boundary(shape: Outline, chains: list[Chain]) -> None:
    loops = boundary(shape)
    for loop in loops:
        assert np.all(np.isfinite(loop))
        assert np.array_equal(loop[:, 3], np.roll(loop[:, 0], -1, axis=0)), "not closed to the bit"
        assert not loop.flags.writeable
    polygons, allowed = flattened(chains)
    # The true boundary is within the tolerance of the polygons', once on each side.
    regions = polygon_regions(polygons, shape.fill_rule)
    wanted = sum(signed_area(loop) for region in regions for loop in region.loops)
    found = area(shape)
    assert found == pytest.approx(wanted, abs=3.0 * allowed + 1e-12)
    if not loops:
        return
    # Winding numbers of the boundary are 0 and 1, and 1 where the outline's rule says inside.
    every, result = np.concatenate(chains), np.concatenate(loops)
    low, high = curves.bounds(every)
    places = np.random.default_rng(len(every)).uniform(low.min(axis=0), high.max(axis=0), (30, 2))
    for place in places:
        before = winding_number(every, place)
        inside = before % 2 != 0 if shape.fill_rule == "evenodd" else before != 0
        assert winding_number(result, place) == int(inside)
        assert contains(shape, (float(place[0]), float(place[1]))) == inside


# Random outlines that cross, coincide and touch


def random_curves(rng: Generator) -> list[Chain]:
    return [closed(rng.normal(size=(3 * rng.integers(1, 7), 2))) for _ in range(rng.integers(1, 4))]


def on_a_grid(rng: Generator) -> list[Chain]:
    size = int(rng.integers(2, 6))
    return [
        closed(rng.integers(0, size + 1, (3 * rng.integers(1, 6), 2)).astype(np.float64))
        for _ in range(rng.integers(1, 4))
    ]


def altered_copies(rng: Generator) -> list[Chain]:
    """A shape and copies of it: backwards, mirrored, cut elsewhere, altered, moved a little."""
    first = closed(rng.normal(size=(3 * rng.integers(1, 6), 2)))
    result = [first]
    for _ in range(rng.integers(1, 3)):
        copy = first.copy()
        index = int(rng.integers(len(copy)))
        before, after = curves.split(copy[index], rng.uniform())
        match int(rng.integers(6)):
            case 0:
                copy = curves.reversed_curves(copy)
            case 1:
                copy = copy * (-1.0, 1.0)
            case 2:
                copy = np.concatenate((copy[:index], [before, after], copy[index + 1 :]))
            case 3:
                copy[index, 1:3] += rng.normal(size=(2, 2))
            case 4:
                back = np.stack((before[3], *rng.normal(size=(2, 2)), before[0]))
                copy = np.stack((before, back))
            case 5:
                copy = copy + 10.0 ** rng.integers(-13, 0)
        result.append(copy)
    return result


def round_shapes(rng: Generator) -> list[Chain]:
    """Disks and the like on a coarse grid: tangent, nested, coincident in part, mirrored."""
    shapes = (DISK, chains_of(ellipse(1.0, 0.5))[0], chains_of(rounded_rectangle(2, 1, 0.25))[0])
    result = []
    for _ in range(rng.integers(2, 7)):
        chain = shapes[rng.integers(3)] * rng.choice([0.5, 1.0, 2.0])
        chain = chain + rng.integers(-2, 3, 2) * rng.choice([0.5, 1.0])
        chain = chain[..., ::-1] if rng.uniform() < 0.3 else chain
        result.append(curves.reversed_curves(chain) if rng.uniform() < 0.3 else chain)
    return result


def lines_and_bends(rng: Generator) -> list[Chain]:
    """Straight pieces of all paces, back and forth too, beside curves of the same anchors."""
    result = []
    for _ in range(rng.integers(1, 4)):
        chain = lines(*rng.integers(0, 4, (rng.integers(3, 7), 2)).astype(np.float64))
        for curve in chain:
            step = curve[3] - curve[0]
            match int(rng.integers(4)):
                case 0:
                    curve[1:3] += rng.integers(-1, 2, (2, 2))
                case 1:
                    curve[1] = curve[0] + step * rng.choice([-1.0, 0.5, 2.0])
                    curve[2] = curve[3] + step * rng.choice([-1.0, 0.0, 0.5, 1.0])
                case 2:
                    curve[1], curve[2] = curve[0], curve[3]
        result.append(chain)
    return result


def turned(chains: list[Chain], rng: Generator) -> list[Chain]:
    """Turn, scale and move chains, so that what coincided does so but for rounding."""
    angle, scale = rng.uniform(0.0, math.tau), 10.0 ** rng.integers(-3, 4)
    cos, sin = math.cos(angle), math.sin(angle)
    moved = [scale * chain @ np.array(((cos, sin), (-sin, cos))) + scale for chain in chains]
    for chain in moved:
        chain[:, 0] = np.roll(chain[:, 3], 1, axis=0)
    return moved


@pytest.mark.parametrize("rule", FILL_RULES)
@pytest.mark.parametrize("is_turned", [False, True])
@pytest.mark.parametrize(
    "make", [random_curves, on_a_grid, altered_copies, round_shapes, lines_and_bends]
)
def test_random_outlines(
    make: Callable[[Generator], list[Chain]], is_turned: bool, rule: FillRule
) -> None:
    for seed in range(3):
        rng = np.random.default_rng((seed, is_turned, rule == "nonzero"))
        chains = turned(make(rng), rng) if is_turned else make(rng)
        assert_is_boundary(outline(*chains, rule=rule), chains)


def test_the_last_resort_is_right_as_well(monkeypatch: pytest.MonkeyPatch) -> None:
    chains = [DISK, moved(DISK, 0.7, 0.1), heart_chain()]
    expected = area(outline(*chains, rule="nonzero"))
    monkeypatch.setattr(curve_arrangement, "TOUCHES", ())
    loops = curve_arrangement.curve_boundary(chains, "nonzero")
    assert all(np.all(curves.is_straight(loop)) for loop in loops)
    found = sum(float(np.sum(curves.signed_areas(loop))) for loop in loops)
    assert found == pytest.approx(expected, abs=1e-4)


def heart_chain() -> Chain:
    return chains_of(heart())[0]


# Known shapes


@pytest.mark.parametrize(
    ("chains", "rule", "expected", "count"),
    [
        pytest.param([DISK], "evenodd", DISK_AREA, 1, id="disk"),
        pytest.param([curves.reversed_curves(DISK)], "nonzero", DISK_AREA, 1, id="clockwise"),
        pytest.param([DISK, DISK], "evenodd", 0.0, 0, id="coincident cancel"),
        pytest.param([DISK, DISK], "nonzero", DISK_AREA, 1, id="coincident fill"),
        pytest.param(
            [DISK, curves.reversed_curves(DISK)], "nonzero", 0.0, 0, id="opposite cancel"
        ),
        pytest.param([np.concatenate((DISK, DISK))], "nonzero", DISK_AREA, 1, id="twice around"),
        pytest.param([DISK, 0.5 * DISK], "evenodd", 0.75 * DISK_AREA, 2, id="hole"),
        pytest.param([DISK, 0.5 * DISK], "nonzero", DISK_AREA, 1, id="hole filled"),
        pytest.param(
            [DISK, 0.5 * DISK, 0.25 * DISK], "evenodd", 0.8125 * DISK_AREA, 3, id="island in a hole"
        ),
        pytest.param([DISK,moved(DISK, 2.0, 0.0)], "nonzero", 2 * DISK_AREA, 2, id="touch outside"),
        pytest.param([DISK,moved(DISK, 0.0, 2.0)], "evenodd", 2 * DISK_AREA, 2, id="touch above"),
        pytest.param(
            [DISK, moved(0.5 * DISK, 0.5, 0.0)], "evenodd", 0.75 * DISK_AREA, None, id="within"
        ),
        pytest.param(
            [DISK, moved(0.5 * DISK, 0.5, 0.0)], "nonzero", DISK_AREA, 1, id="touch inside, filled"
        ),
        pytest.param(
            [HALF_DISK, -HALF_DISK], "nonzero", DISK_AREA, 1, id="halves share an edge"
        ),
        pytest.param(
            [HALF_DISK, curves.reversed_curves(-HALF_DISK)],
            "nonzero", DISK_AREA, None, id="halves of opposite windings",
        ),
        pytest.param(
            [HALF_DISK, -0.5 * HALF_DISK], "evenodd", 0.625 * DISK_AREA, 1, id="part of an edge"
        ),
        pytest.param([DISK, SQUARE], "nonzero", 4.0, 1, id="disk in a square, touching its sides"),
        pytest.param([DISK, SQUARE], "evenodd", 4.0 - DISK_AREA, 4, id="corners of a square"),
        pytest.param(
            [DISK, curves.split(DISK, 0.3)[0][:0].reshape(-1, 4, 2)],
            "evenodd", DISK_AREA, 1, id="an empty chain",
        ),
    ],
)  # fmt: skip
def test_known_areas(
    chains: list[Chain], rule: FillRule, expected: float, count: int | None
) -> None:
    chains = [chain for chain in chains if len(chain)]
    shape = outline(*chains, rule=rule)
    assert area(shape) == pytest.approx(expected, abs=1e-9)
    if count is not None:
        assert len(boundary(shape)) == count
    assert_is_boundary(shape, chains)


def test_two_disks_cross_where_two_circles_do() -> None:
    shape = outline(DISK, moved(DISK, 1.0, 0.0), rule="nonzero")
    lens = 2.0 * math.pi / 3.0 - math.sqrt(3.0) / 2.0
    assert area(shape) == pytest.approx(2.0 * math.pi - lens, rel=1e-6)
    (loop,) = boundary(shape)
    ends = loop[:, 0]
    for sign in (1.0, -1.0):
        off = np.hypot(*(ends - (0.5, sign * math.sqrt(0.75))).T)
        assert off.min() < 1e-6  # the roundness of the disk
    # A third of each circle is gone; the crossings are anchors, as the arcs span 30 degrees.
    assert len(loop) == 16
    # Elsewhere a curve of each is cut at either crossing, and what is left stays one curve.
    (loop,) = boundary(outline(DISK, moved(DISK, 0.9, 0.0), rule="nonzero"))
    whole = {tuple(curve.ravel()) for curve in (*DISK, *moved(DISK, 0.9, 0.0))}
    assert sum(tuple(curve.ravel()) not in whole for curve in loop) == 4


def test_shared_curves_of_different_cuts_vanish() -> None:
    """Two shapes along one curve, each with its own anchors on it."""
    arc = np.array([(0.0, 0.0), (1.0, 0.7), (2.0, -0.9), (3.0, 0.0)])
    above = np.concatenate(
        (np.stack(curves.split(arc, 0.37)), curves.line_as_cubic([(3, 0), (3, 2), (0, 2)],
                                                                 [(3, 2), (0, 2), (0, 0)]))
    )  # fmt: skip
    parts = [curves.part(arc, a, b) for a, b in ((0.9, 0.5), (0.5, 0.2))]
    parts[1][0] = parts[0][3]
    low = parts[1][3]
    below = np.concatenate((parts, curves.line_as_cubic([low, (1, -2)], [(1, -2), parts[0][0]])))
    for rule in FILL_RULES:
        shape = outline(above, below, rule=rule)
        assert_is_boundary(shape, [above, below])
        assert len(boundary(shape)) == 1


# Stiff curves


def loop_area() -> float:
    """The curve (0,0) (4,3) (-3,3) (1,0) crosses itself: its loop, by Green's theorem on t."""
    curve = np.array([(0.0, 0.0), (4.0, 3.0), (-3.0, 3.0), (1.0, 0.0)])
    # By symmetry x(t) = x(1 − t) = ½ at the crossing.
    x = np.polynomial.polynomial.Polynomial((0.0, 12.0, -33.0, 22.0)) - 0.5
    t = min(root.real for root in x.roots() if 0.0 < root.real < 0.5)
    return abs(float(curves.signed_areas(curves.part(curve, t, 1.0 - t))))


def test_a_loop_in_a_single_curve() -> None:
    curve = np.array([(0.0, 0.0), (4.0, 3.0), (-3.0, 3.0), (1.0, 0.0)])
    chain = np.stack((curve, curves.line_as_cubic(curve[3], curve[0])))
    total = abs(float(np.sum(curves.signed_areas(chain))))
    # The loop turns against the rest, which signed areas take off; both rules fill both.
    for rule in FILL_RULES:
        shape = outline(chain, rule=rule)
        assert_is_boundary(shape, [chain])
        loops = boundary(shape)
        areas = sorted(float(np.sum(curves.signed_areas(loop))) for loop in loops)
        assert len(areas) == 2
        assert sum(areas) == pytest.approx(2.0 * loop_area() - total)


@pytest.mark.parametrize(
    "controls",
    [
        pytest.param([(0, 0), (1, 1), (0, 1), (1, 0)], id="cusp"),
        pytest.param([(0, 0), (2, 1), (-1, 1), (1, 0)], id="loop"),
        pytest.param([(0, 0), (1, 1), (1, -1), (2, 0)], id="inflection"),
        pytest.param([(0, 0), (0, 0), (1, 1), (1, 0)], id="handle on the first anchor"),
        pytest.param([(0, 0), (1, 1), (1, 0), (1, 0)], id="handle on the last anchor"),
        pytest.param([(0, 0), (0.5, 1), (0.5, 1), (1, 0)], id="handles coincide"),
        pytest.param([(0, 0), (2 / 3, 4 / 3), (4 / 3, 4 / 3), (2, 0)], id="raised quadratic"),
        pytest.param([(0, 0), (3, 3), (-2, 3), (0, 0)], id="closed"),
        pytest.param([(0, 0), (3, 0), (-2, 0), (1, 0)], id="back and forth on a line"),
        pytest.param([(0, 0), (0, 1), (0, 1), (0, 0)], id="out and back"),
        pytest.param([(0, 0), (1, 1e-14), (2, -1e-14), (3, 0)], id="straight but for rounding"),
        pytest.param([(0, 0), (1, 1e-9), (2, 1e-9), (3, 0)], id="nearly straight"),
    ],
)
@pytest.mark.parametrize("rule", FILL_RULES)
def test_stiff_curves_in_a_contour(controls: list[tuple[float, float]], rule: FillRule) -> None:
    curve = np.array(controls, dtype=np.float64)
    rest = curves.line_as_cubic([curve[3], (0.5, -2.0)], [(0.5, -2.0), curve[0]])
    chain = np.concatenate((curve[None], rest))
    assert_is_boundary(outline(chain, rule=rule), [chain])
    # And beside an overlapping shape, and a copy of itself.
    for other in (DISK, moved(chain, 0.25, 0.5), curves.reversed_curves(chain)):
        assert_is_boundary(outline(chain, other, rule=rule), [chain, other])


def test_zero_length_curves_are_left_out() -> None:
    points = np.repeat(DISK[:, None, 0], 4, axis=1)
    with_points = np.stack((points, DISK), axis=1).reshape(-1, 4, 2)
    (loop,) = boundary(outline(with_points))
    assert np.array_equal(loop, boundary(outline(DISK))[0])
    assert boundary(outline(points[:1])) == ()
    assert area(outline(points[:1])) == 0.0
    assert not contains(outline(points[:1]), (0.0, 0.0))


@pytest.mark.parametrize("pace", [(1 / 3, 2 / 3), (0.0, 1.0), (0.5, 0.5), (0.9, 0.1)])
def test_lines_as_cubics_of_any_pace_are_polygons(pace: tuple[float, float]) -> None:
    corners = [(0.0, 0.0), (4.0, 0.5), (3.0, 3.0), (1.0, -2.0), (0.5, 4.0)]
    chain = lines(*corners)
    step = chain[:, 3] - chain[:, 0]
    chain[:, 1], chain[:, 2] = chain[:, 0] + pace[0] * step, chain[:, 0] + pace[1] * step
    for rule in FILL_RULES:
        polygon = Outline((PolygonContour(tuple(corners)),), rule)
        assert area(outline(chain, rule=rule)) == pytest.approx(area(polygon), rel=1e-12)
        assert all(np.all(curves.is_straight(loop)) for loop in boundary(outline(chain, rule=rule)))


def test_a_spike_vanishes() -> None:
    spike = np.array([[(1.0, 0.0), (3.0, 0.0), (3.0, 0.0), (1.0, 0.0)]])
    (loop,) = boundary(outline(np.concatenate((DISK[:12], spike))))
    assert area(outline(np.concatenate((DISK, spike)))) == pytest.approx(DISK_AREA, abs=1e-12)
    assert len(loop) == 12


# Mixed, many, far, small


def test_polygons_and_curves_in_one_outline() -> None:
    corners = ((-2.0, -2.0), (2.0, -2.0), (2.0, 2.0), (-2.0, 2.0))
    contours: tuple[Contour, ...] = (PolygonContour(corners), bezier(DISK))
    shape = Outline(contours)
    assert area(shape) == pytest.approx(16.0 - DISK_AREA, rel=1e-12)
    square, hole = boundary(shape)
    assert np.all(curves.is_straight(square))
    assert {tuple(p) for p in square[:, 0]} == set(corners)
    assert np.array_equal(hole, curves.reversed_curves(DISK)) or len(hole) == 12
    assert not contains(shape, (0.0, 0.0))
    assert contains(shape, (1.5, 1.5))


def test_polygons_alone_have_the_boundary_that_resolve_says() -> None:
    star = tuple((math.cos(4 * math.pi * k / 5), math.sin(4 * math.pi * k / 5)) for k in range(5))
    shape = Outline((PolygonContour(star),))
    for loop, straight in zip(resolve(shape), boundary(shape), strict=True):
        assert np.array_equal(straight[:, 0], loop)
        assert np.array_equal(straight[:, 3], np.roll(loop, -1, axis=0))
        assert np.all(curves.is_straight(straight))


def test_nested_contours_like_letters_keep_their_very_curves() -> None:
    """A B, an i, an o with something in it, all drawn clockwise as TrueType does."""
    letters = [
        curves.reversed_curves(HALF_DISK) * 1.5,
        moved(0.3 * DISK, 0.0, 0.6),
        curves.reversed_curves(moved(DISK, 4.0, 0.0)),
        moved(0.6 * DISK, 4.0, 0.0),
        curves.reversed_curves(moved(0.2 * DISK, 4.0, 0.0)),
        curves.reversed_curves(moved(0.2 * DISK, 8.0, 0.0)),
        curves.reversed_curves(lines((7.8, -3.0), (8.2, -3.0), (8.2, -1.0), (7.8, -1.0))),
    ]  # fmt: skip
    shape = outline(*letters, rule="nonzero")
    loops = boundary(shape)
    assert len(loops) == len(letters)
    wanted = [1.5**2 / 2 - 0.09, 1 - 0.36 + 0.04, 0.04]
    assert area(shape) == pytest.approx(DISK_AREA * sum(wanted) + 0.8, rel=1e-12)
    theirs = {tuple(curve.ravel()) for letter in letters for curve in letter}
    theirs |= {tuple(curve[::-1].ravel()) for letter in letters for curve in letter}
    for loop in loops:
        bent = loop[~curves.is_straight(loop)]
        assert {tuple(curve.ravel()) for curve in bent} <= theirs
        low, high = curves.bounds(loop)
        centre = 0.5 * (low.min(axis=0) + high.max(axis=0))
        is_hole = centre[0] in (0.0, 4.0) and 0.5 < np.ptp(loop[..., 0]) < 1.5
        assert (float(np.sum(curves.signed_areas(loop))) < 0.0) == is_hole


def test_five_hundred_curves() -> None:
    rows = [moved(DISK, 1.3 * (k % 7), 1.4 * (k // 7)) for k in range(42)]
    shape = outline(*rows, rule="nonzero")
    assert_is_boundary(shape, rows)
    apart = [moved(DISK, 3.0 * (k % 7), 3.0 * (k // 7)) for k in range(42)]
    assert area(outline(*apart)) == pytest.approx(42 * DISK_AREA, rel=1e-12)


@pytest.mark.parametrize("scale", [1e-30, 1e-6, 1e6, 1e15])
def test_sizes_far_from_one(scale: float) -> None:
    shape = outline(scale * DISK, scale * (moved(DISK, 0.5, 0.0)), rule="evenodd")
    reference = area(outline(DISK, moved(DISK, 0.5, 0.0)))
    assert area(shape) == pytest.approx(reference * scale**2, rel=1e-9)


def test_places_far_from_the_middle() -> None:
    shape = outline(moved(DISK, 1e5, -1e5), moved(0.5 * DISK, 1e5, -1e5))
    # The coordinates are rounded to 1e-11 of the radius.
    assert area(shape) == pytest.approx(0.75 * DISK_AREA, rel=1e-9)


def test_a_thin_ring_keeps_its_area() -> None:
    assert area(outline(DISK, (1.0 - 1e-6) * DISK)) == pytest.approx(2e-6 * DISK_AREA, rel=1e-3)


# What is drawn and picked from it


def test_lines_and_triangles_cover_a_curved_outline() -> None:
    shape = ring(1.0, 0.5)
    loops = resolve(shape)
    assert [signed_area(loop) > 0.0 for loop in loops] == [True, False]
    for loop in loops:
        radius = np.hypot(*loop.T)
        assert np.max(np.abs(radius - np.round(2.0 * radius) / 2.0)) < 1e-6
    points, triangles = triangulate(shape)
    total = sum(signed_area(points[corners]) for corners in triangles)
    assert total == pytest.approx(area(shape), rel=1e-3)


def test_boundaries_are_cached() -> None:
    assert boundary(disk())[0] is boundary(disk())[0]
