"""Outlines: areas by an exact scanline of rationals, insides by winding numbers."""

from __future__ import annotations

import math
from fractions import Fraction
from itertools import combinations, pairwise

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import app.outline
from app.outline import area, contains, resolve, signed_area, triangulate
from app.scene import FILL_RULES, FillRule, Outline, PolygonContour

Point = tuple[float, float]
Polygon = list[Point]

SQUARE: Polygon = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
BOW_TIE: Polygon = [(0, 0), (1, 1), (1, 0), (0, 1)]
PENTAGRAM: Polygon = [
    (math.cos(4 * math.pi * k / 5), math.sin(4 * math.pi * k / 5)) for k in range(5)
]


def outline(*contours: Polygon, rule: FillRule = "evenodd") -> Outline:
    return Outline(tuple(PolygonContour(tuple(points)) for points in contours), rule)


def scaled(polygon: Polygon, factor: float, offset: Point = (0.0, 0.0)) -> Polygon:
    return [(offset[0] + factor * s, offset[1] + factor * t) for s, t in polygon]


# The independent route: vertical slabs between all vertices and crossings, in rationals.


def scanline_area(contours: list[list[tuple[int, int]]], rule: str) -> Fraction:
    edges = []
    for points in contours:
        for (ax, ay), (bx, by) in zip(points, points[1:] + points[:1], strict=True):
            if ax != bx:
                direction = 1 if ax < bx else -1
                low, high = sorted(((ax, ay), (bx, by)))
                slope = Fraction(high[1] - low[1], high[0] - low[0])
                edges.append((Fraction(low[0]), Fraction(high[0]), low[1], slope, direction))
    stops = {x for edge in edges for x in edge[:2]}
    for a, b in combinations(edges, 2):
        if a[3] != b[3]:
            x = (b[2] - a[2] + a[3] * a[0] - b[3] * b[0]) / (a[3] - b[3])
            if max(a[0], b[0]) < x < min(a[1], b[1]):
                stops.add(x)
    total = Fraction(0)
    for left, right in pairwise(sorted(stops)):
        middle = (left + right) / 2
        heights = sorted(
            (y + slope * (middle - start), direction)
            for start, end, y, slope, direction in edges
            if start < middle < end
        )
        winding = 0
        for (y, direction), (following, _) in pairwise(heights):
            winding += direction
            inside = winding % 2 == 1 if rule == "evenodd" else winding != 0
            if inside:
                total += (following - y) * (right - left)
    return total


def winding_inside(contours: list[Polygon], point: Point, rule: str) -> bool:
    """Add up signed angles about the point: slow, and unlike any crossing count."""
    turns = 0.0
    for polygon in contours:
        for a, b in zip(polygon, polygon[1:] + polygon[:1], strict=True):
            ax, ay, bx, by = a[0] - point[0], a[1] - point[1], b[0] - point[0], b[1] - point[1]
            turns += math.atan2(ax * by - ay * bx, ax * bx + ay * by)
    winding = round(turns / math.tau)
    return winding % 2 == 1 if rule == "evenodd" else winding != 0


grid_points = st.tuples(st.integers(0, 6), st.integers(0, 6))
grid_polygons = st.lists(grid_points, min_size=3, max_size=9)
grid_contours = st.lists(grid_polygons, min_size=1, max_size=3)


@settings(max_examples=250)
@given(grid_contours, st.sampled_from(FILL_RULES))
def test_area_equals_exact_scanline(contours: list[list[tuple[int, int]]], rule: FillRule) -> None:
    found = area(outline(*contours, rule=rule))
    assert found == pytest.approx(float(scanline_area(contours, rule)), abs=1e-9)


@settings(max_examples=100)
@given(
    grid_contours, st.sampled_from(FILL_RULES), st.tuples(st.integers(0, 98), st.integers(0, 98))
)
def test_contains_equals_winding_number(
    contours: list[list[tuple[int, int]]], rule: FillRule, cell: tuple[int, int]
) -> None:
    # Off the grid's lines by amounts that no line through grid points meets.
    point = ((cell[0] + 0.5077) / 16.5, (cell[1] + 0.4931) / 16.5)
    assert contains(outline(*contours, rule=rule), point) == winding_inside(contours, point, rule)


def crossings(loops: tuple[np.ndarray, ...]) -> int:
    """Count pairs of edges that cross in their interiors."""
    a = np.concatenate(loops)
    b = np.concatenate([np.roll(loop, -1, axis=0) for loop in loops])
    extent = float(np.ptp(a))

    def side(p: np.ndarray, q: np.ndarray, r: np.ndarray) -> np.ndarray:
        u, v = q - p, r - p
        distance = u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]
        distance = distance / np.hypot(u[..., 0], u[..., 1])
        return np.where(np.abs(distance) < 1e-9 * extent, 0.0, np.sign(distance))

    a1, b1, a2, b2 = a[:, None], b[:, None], a[None], b[None]
    one = side(a1, b1, a2) * side(a1, b1, b2) < 0
    two = side(a2, b2, a1) * side(a2, b2, b1) < 0
    return int(np.count_nonzero(one & two))


@settings(max_examples=150)
@given(grid_contours, st.sampled_from(FILL_RULES))
def test_loops_are_simple_and_triangles_cover_them_once(
    contours: list[list[tuple[int, int]]], rule: FillRule
) -> None:
    shape = outline(*contours, rule=rule)
    loops = resolve(shape)
    points, triangles = triangulate(shape)
    assert len(points) == sum(len(loop) for loop in loops)
    if loops:
        assert crossings(loops) == 0
        assert signed_area(loops[0]) > 0.0
        for loop in loops:
            assert len(loop) >= 3
            assert len(np.unique(loop, axis=0)) == len(loop)
    areas = [signed_area(points[corners]) for corners in triangles]
    assert all(value >= 0.0 for value in areas)
    assert sum(areas) == pytest.approx(area(shape), abs=1e-9)


@settings(max_examples=60)
@given(
    grid_contours,
    st.sampled_from(FILL_RULES),
    st.sampled_from((1e-6, 1e-3, 1e3, 1e6)),
    st.booleans(),
)
def test_area_scales(
    contours: list[list[tuple[int, int]]], rule: FillRule, factor: float, offset: bool
) -> None:
    # An offset of a thousand sizes costs three digits of the coordinates themselves.
    place = (6e3 * factor, -6e3 * factor) if offset else (0.0, 0.0)
    shape = outline(*(scaled(points, factor, place) for points in contours), rule=rule)
    expected = float(scanline_area(contours, rule)) * factor**2
    assert area(shape) == pytest.approx(expected, abs=1e-8 * factor**2)


@settings(max_examples=60)
@given(
    st.lists(st.tuples(st.floats(-1, 1), st.floats(-1, 1)), min_size=3, max_size=12, unique=True),
    st.sampled_from(FILL_RULES),
)
def test_winding_and_start_do_not_matter(points: Polygon, rule: FillRule) -> None:
    there = area(outline(points, rule=rule))
    assert area(outline(points[::-1], rule=rule)) == pytest.approx(there, abs=1e-11)
    assert area(outline(points[2:] + points[:2], rule=rule)) == pytest.approx(there, abs=1e-11)


@settings(max_examples=40)
@given(st.lists(st.floats(0.01, 1.0), min_size=3, max_size=24))
def test_a_simple_polygon_keeps_its_very_vertices(radii: list[float]) -> None:
    # Star-shaped about the origin, hence simple.
    count = len(radii)
    assume(count > 3)
    points = [
        (r * math.cos(math.tau * k / count) + 0.1, r * math.sin(math.tau * k / count) - 0.7)
        for k, r in enumerate(radii)
    ]
    (loop,) = resolve(outline(points))
    assert {tuple(vertex) for vertex in loop} <= set(points)
    assert signed_area(loop) > 0.0


@pytest.mark.parametrize(
    ("contours", "rule", "expected", "count"),
    [
        pytest.param([SQUARE], "evenodd", 4.0, 1, id="square"),
        pytest.param([SQUARE[::-1]], "nonzero", 4.0, 1, id="clockwise"),
        pytest.param([SQUARE, scaled(SQUARE, 0.5)], "evenodd", 3.0, 2, id="hole, same winding"),
        pytest.param([SQUARE, scaled(SQUARE, 0.5)], "nonzero", 4.0, 1, id="hole filled"),
        pytest.param([SQUARE, scaled(SQUARE, 0.5)[::-1]], "nonzero", 3.0, 2, id="hole, opposite"),
        pytest.param(
            [SQUARE, scaled(SQUARE, 0.5), scaled(SQUARE, 0.25)],
            "evenodd", 3.25, 3, id="island in a hole",
        ),
        pytest.param(
            [scaled(SQUARE, 2.0**-k) for k in range(8)],
            "evenodd", sum((-1) ** k * 4.0 * 4.0**-k for k in range(8)), 8, id="eight nested",
        ),
        pytest.param([BOW_TIE], "evenodd", 0.5, 2, id="bow tie"),
        pytest.param([BOW_TIE], "nonzero", 0.5, 2, id="bow tie nonzero"),
        pytest.param([PENTAGRAM], "evenodd", 0.77567675, 5, id="pentagram: five tips"),
        pytest.param([PENTAGRAM], "nonzero", 1.12256994, 1, id="pentagram filled"),
        pytest.param([SQUARE + SQUARE], "evenodd", 0.0, 0, id="twice around cancels"),
        pytest.param([SQUARE + SQUARE], "nonzero", 4.0, 1, id="twice around fills"),
        pytest.param([SQUARE, SQUARE], "evenodd", 0.0, 0, id="coincident cancel"),
        pytest.param(
            [[(0, 0), (2, 0), (2, 2), (1, 0), (0, 2)]], "evenodd", 2.0, 2, id="touches itself"
        ),
        pytest.param(
            [SQUARE, scaled(SQUARE, 1.0, (2.0, 0.0))], "evenodd", 8.0, 1, id="shared edge merges"
        ),
        pytest.param(
            [SQUARE, scaled(SQUARE, 1.0, (2.0, 2.0))], "evenodd", 8.0, 2, id="shared corner"
        ),
        pytest.param([[(0, 0), (1, 0), (2, 0)]], "nonzero", 0.0, 0, id="collinear"),
        pytest.param([[(3, 3)] * 3], "nonzero", 0.0, 0, id="one point"),
        pytest.param([[(0, 0), (1, 1), (0, 0), (1, 1)]], "nonzero", 0.0, 0, id="back and forth"),
        pytest.param(
            [[(0, 0), (1, 0), (1, 1), (1, 3), (1, 1), (0, 1)]], "nonzero", 1.0, 1, id="spike"
        ),
    ],
)  # fmt: skip
def test_known_areas(contours: list[Polygon], rule: FillRule, expected: float, count: int) -> None:
    shape = outline(*contours, rule=rule)
    assert area(shape) == pytest.approx(expected, abs=1e-8)
    assert len(resolve(shape)) == count


def test_repeated_and_collinear_vertices_go() -> None:
    many = [(-1, -1), (0, -1), (0, -1), (1, -1), (1, 0.5), (1, 1), (-1, 1), (-1, 1), (-1, 0)]
    (loop,) = resolve(outline(many))
    assert {tuple(vertex) for vertex in loop} == {tuple(map(float, p)) for p in SQUARE}


def test_loops_are_read_only_and_cached() -> None:
    loops = resolve(outline(SQUARE))
    with pytest.raises(ValueError, match="read-only"):
        loops[0][0, 0] = 5.0
    assert resolve(outline(SQUARE))[0] is loops[0]


def test_the_cache_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    cache = app.outline._Cache()
    monkeypatch.setattr(app.outline, "CACHED_VERTICES", 40)
    monkeypatch.setattr(app.outline, "_kept", cache)
    first = outline(SQUARE)
    kept = cache(first)
    for k in range(1, 30):
        resolve(outline(scaled(SQUARE, 1.0 + k)))
        assert cache(first) is kept, "what is in use stays"
    assert len(cache._kept) == 10


@pytest.mark.parametrize("thickness", [1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize("angle", [0.0, 0.3, math.pi / 2])
def test_needles_keep_their_area(thickness: float, angle: float) -> None:
    cos, sin = math.cos(angle), math.sin(angle)
    corners = [(0.0, 0.0), (1.0, 0.0), (1.0, thickness), (0.0, thickness)]
    turned = [(cos * s - sin * t, sin * s + cos * t) for s, t in corners]
    # The coordinates are rounded to 1e-16 of the length, and so is the thickness.
    assert area(outline(turned)) == pytest.approx(thickness, rel=1e-3, abs=1e-15)


@pytest.mark.parametrize("extent", [1e-30, 1e-6, 1e6, 1e15])
def test_sizes_far_from_one(extent: float) -> None:
    shape = outline(scaled(SQUARE, extent), scaled(SQUARE, 0.5 * extent))
    assert area(shape) == pytest.approx(3.0 * extent**2, rel=1e-12)
    _, triangles = triangulate(shape)
    assert len(triangles) == 8


def test_extents_of_very_different_size() -> None:
    shape = outline([(0, 0), (1e6, 0), (1e6, 1e-6), (0, 1e-6)])
    assert area(shape) == pytest.approx(1.0, rel=1e-12)


def test_empty_outline_has_no_triangles() -> None:
    points, triangles = triangulate(outline([(0, 0), (1, 0), (2, 0)]))
    assert points.shape == (0, 2)
    assert triangles.shape == (0, 3)
    assert not contains(outline([(0, 0), (1, 0), (2, 0)]), (1.0, 0.0))


def test_ten_thousand_vertices() -> None:
    count = 10_000
    angles = np.linspace(0.0, math.tau, count, endpoint=False)
    points = [(math.cos(a), math.sin(a)) for a in angles]
    expected = 0.5 * count * math.sin(math.tau / count)
    assert area(outline(points)) == pytest.approx(expected, rel=1e-12)
