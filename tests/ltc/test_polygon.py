"""Form factors of polygons against other routes, limits and invariants."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ltc import polygon, transform

SQUARE = np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]])
UP = np.array([0.0, 0.0, 1.0])


def random_planes(rng: np.random.Generator, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return centres and orthonormal in-plane axes with u x v turned away from the origin."""
    c, u, v = rng.normal(size=(3, n, 3))
    u /= np.linalg.norm(u, axis=-1, keepdims=True)
    v -= u * np.sum(u * v, axis=-1, keepdims=True)
    v /= np.linalg.norm(v, axis=-1, keepdims=True)
    facing = np.sum(np.cross(u, v) * c, axis=-1) > 0.0
    return c, u, np.where(facing[:, None], v, -v)


def star(n: int, phase: float = 0.0) -> np.ndarray:
    """Return a star with n tips, (2n, 2), counter-clockwise."""
    r = np.where(np.arange(2 * n) % 2 == 0, 1.0, 0.4)
    t = phase + np.arange(2 * n) * np.pi / n
    return np.stack([r * np.cos(t), r * np.sin(t)], axis=-1)


def place(outline: np.ndarray, c: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Return (..., k, 3) corners of a plane outline (k, 2)."""
    s, t = outline[:, 0, None], outline[:, 1, None]
    return c[..., None, :] + s * u[..., None, :] + t * v[..., None, :]


def extended(p: np.ndarray) -> np.ndarray:
    """Return the contour sum of (N, 3) corners above the horizon in extended precision."""
    a = p.astype(np.longdouble)
    b = np.roll(a, -1, axis=0)
    cross = np.cross(a, b - a)
    sine = np.sqrt(np.sum(cross * cross, axis=-1))
    theta = np.arctan2(sine, np.sum(a * b, axis=-1))
    terms = cross[:, 2] / np.where(sine > 0.0, sine, 1.0) * theta
    return np.sum(terms) / (2.0 * np.pi)


def by_area(p: np.ndarray, cells: int) -> float:
    """Return the form factor of a parallelogram by midpoints over its area, horizon included."""
    s = (np.arange(cells) + 0.5) / cells
    points = p[0] + s[:, None, None] * (p[1] - p[0]) + s[:, None] * (p[3] - p[0])
    r = np.linalg.norm(points, axis=-1)
    area = np.cross(p[1] - p[0], p[3] - p[0])
    integrand = np.maximum(points[..., 2], 0.0) * (points @ area) / r**4 / np.pi
    return float(np.mean(integrand))


def test_closed_form_of_a_corner_rectangle() -> None:
    """The textbook's parallel rectangle over its corner (Howell's catalogue, configuration B-4)."""
    a, b = 0.7, 1.9
    p = np.array([[0.0, 0.0, 1.0], [a, 0.0, 1.0], [a, b, 1.0], [0.0, b, 1.0]])
    x, y = np.sqrt(1.0 + a * a), np.sqrt(1.0 + b * b)
    expected = (a / x * np.arctan(b / x) + b / y * np.arctan(a / y)) / (2.0 * np.pi)
    assert polygon.polygon_form_factor(p) == pytest.approx(expected, rel=1e-14)


def test_disc_limit() -> None:
    """A polygon of many corners tends to the disc, r^2/(1 + r^2)."""
    t = np.arange(4000) * np.pi / 2000.0
    p = np.stack([2.0 * np.cos(t), 2.0 * np.sin(t), np.ones(4000)], axis=-1)
    assert polygon.polygon_form_factor(p) == pytest.approx(0.8, abs=2e-6)


def test_against_the_area(rng: np.random.Generator) -> None:
    """Random parallelograms, most of them through the horizon."""
    for c, u, v in zip(*random_planes(rng, 40), strict=True):
        p = place(SQUARE[:, :2] * rng.uniform(0.2, 1.5, 2), 1.5 * c, u, v)
        if np.abs(np.cross(u, v) @ c) < 0.1:
            continue  # so near the light's plane midpoints are too coarse
        assert polygon.clipped_form_factor(p) == pytest.approx(by_area(p, 800), abs=2e-5)


@pytest.mark.parametrize("distance", [1.0, 1e1, 1e2, 1e4, 1e6, 1e8])
def test_relative_accuracy_of_small_far_lights(distance: float, rng: np.random.Generator) -> None:
    """Against the same sum in 80 bits, and at the largest distances against the flat limit."""
    c, u, v = random_planes(rng, 100)
    c[:, 2] = np.abs(c[:, 2]) + 0.2
    c /= np.linalg.norm(c, axis=-1, keepdims=True)
    p = place(0.1 * star(5), c * distance, u, v)
    above = np.min(p[..., 2], axis=-1) > 0.0
    e = polygon.polygon_form_factor(p[above])
    if distance < 1e5:
        if np.finfo(np.longdouble).nmant < 63:
            pytest.skip("long double is no wider than double here")
        # The reference itself loses distance digits of its 19.
        wanted = np.array([extended(q) for q in p[above]])
        assert np.max(np.abs(e / wanted - 1.0).astype(float)) < 1e-10
    else:
        # The exact corners have a slightly different area: rounding moves them 1e-16 distance.
        area = 0.01 * 5.0 * 0.4 * np.sin(np.pi / 5.0)  # ten triangles with sides 1 and 0.4
        cosine = np.sum(np.cross(u, v) * c, axis=-1)
        wanted = area * cosine * c[:, 2] / (np.pi * distance**2)
        bright = cosine[above] > 0.05
        assert np.max(np.abs(e / wanted[above] - 1.0)[bright]) < 2e-14 * distance / 0.1


def test_edges_that_subtend_nearly_half_a_turn() -> None:
    """A ceiling seen from within 1e-9 of its plane; the opposite edges are nearly opposite."""
    for h in (1e-1, 1e-3, 1e-6, 1e-9):
        e = polygon.polygon_form_factor(SQUARE + h * UP)
        # 1 - E = 4 times the strip outside one edge, (sqrt(2)/pi) h in all to first order.
        x = 1.0 / np.hypot(1.0, h)
        expected = 4.0 * x * np.arctan(x) / np.pi
        assert e == pytest.approx(expected, abs=1e-14)
        assert e <= 1.0


def test_winding_rotation_and_cyclic_order(rng: np.random.Generator) -> None:
    c, u, v = random_planes(rng, 200)
    p = place(star(4), c, u, v)
    e = polygon.clipped_form_factor(p)
    assert np.all(e >= -1e-15) and np.any(e > 0.0)
    assert polygon.clipped_form_factor(p[:, ::-1]) == pytest.approx(-e, abs=1e-14)
    assert polygon.clipped_form_factor(np.roll(p, 3, axis=1)) == pytest.approx(e, abs=1e-14)
    angle = rng.uniform(0.0, 6.0)
    turn = np.array(
        [[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], UP.tolist()]
    )
    assert polygon.clipped_form_factor(p @ turn.T) == pytest.approx(e, abs=1e-13)
    assert polygon.clipped_form_factor(1e-3 * p) == pytest.approx(e, abs=1e-14)


def test_positive_winding_is_the_one_place_that_flips() -> None:
    """A ceiling that emits downwards runs counter-clockwise seen from below."""
    ceiling = np.array([[-1.0, 1.0, 2.0], [1.0, 1.0, 2.0], [1.0, -1.0, 2.0], [-1.0, -1.0, 2.0]])
    normal = np.cross(ceiling[1] - ceiling[0], ceiling[2] - ceiling[1])
    assert normal[2] < 0.0  # counter-clockwise about the emitting normal, clockwise about +z
    seen = polygon.polygon_form_factor(polygon.positive_winding(ceiling))
    assert seen == pytest.approx(-polygon.polygon_form_factor(ceiling))
    assert seen > 0.2


def test_subdivision_and_splitting(rng: np.random.Generator) -> None:
    """Points added on edges change nothing; two halves sum to the whole."""
    c, u, v = random_planes(rng, 100)
    p = place(1.5 * SQUARE[:, :2], c, u, v)
    whole = polygon.clipped_form_factor(p)
    middles = np.stack([p, 0.7 * p + 0.3 * np.roll(p, -1, axis=1)], axis=2).reshape(100, 8, 3)
    assert polygon.clipped_form_factor(middles) == pytest.approx(whole, abs=1e-13)
    halves = [p[:, [0, 1, 2]], p[:, [0, 2, 3]]]
    assert polygon.loops_form_factor(halves) == pytest.approx(whole, abs=1e-13)


def test_holes_and_islands(rng: np.random.Generator) -> None:
    """A frame is the square less its hole, whether by loops or by a bridge."""
    c, u, v = random_planes(rng, 100)
    outer, hole = place(1.5 * SQUARE[:, :2], c, u, v), place(0.5 * SQUARE[:, :2], c, u, v)
    frame = polygon.loops_form_factor([outer, hole[:, ::-1]])
    difference = polygon.clipped_form_factor(outer) - polygon.clipped_form_factor(hole)
    assert frame == pytest.approx(difference, abs=1e-14)
    bridged = np.concatenate(
        [outer, outer[:, :1], hole[:, :1], hole[:, :0:-1], hole[:, :1]], axis=1
    )
    assert polygon.clipped_form_factor(bridged) == pytest.approx(frame, abs=1e-13)
    assert polygon.loops_form_factor([]) == 0.0


def test_non_convex_equals_its_triangles(rng: np.random.Generator) -> None:
    """A star as tips and core, with several crossings of the horizon."""
    c, u, v = random_planes(rng, 200)
    p = place(2.0 * star(7, 0.3), c, u, v)
    n = 14
    tips = [p[:, [(k - 1) % n, k, (k + 1) % n]] for k in range(0, n, 2)]
    pieces = [*tips, p[:, 1::2]]
    sum_of_pieces = polygon.loops_form_factor(pieces)
    assert polygon.clipped_form_factor(p) == pytest.approx(sum_of_pieces, abs=1e-13)


def test_clip_is_closed_and_above(rng: np.random.Generator) -> None:
    c, u, v = random_planes(rng, 300)
    p = place(2.0 * star(5), c, u, v)
    q = polygon.clip_to_horizon(p)
    assert q.shape == (300, 20, 3)
    assert np.all(q[..., 2] >= 0.0)
    untouched = np.min(p[..., 2], axis=1) > 0.0
    assert np.all(q[untouched, ::2] == p[untouched])
    below = np.max(p[..., 2], axis=1) <= 0.0
    assert np.any(below) and np.all(q[below] == UP)
    # Corners on the horizon stay in the light's plane.
    normal = np.cross(u, v)
    height = np.sum(normal * c, axis=-1)[:, None]
    off = np.einsum("nki,ni->nk", q, normal) - height
    assert np.max(np.abs(off[~below])) < 1e-12


def test_exactly_zero_where_nothing_is_seen(rng: np.random.Generator) -> None:
    c, u, v = random_planes(rng, 300)
    p = place(star(5), c, u, v)
    p[..., 2] -= np.max(p[..., 2], axis=1, keepdims=True)  # touching the horizon from below
    assert np.all(polygon.clipped_form_factor(p) == 0.0)
    matrix = np.array([[0.3, 0.0, 0.8], [0.0, 0.2, 0.0], [-0.2, 0.0, 0.5]])
    assert np.all(polygon.ltc_specular(matrix, [p], 1.0) == 0.0)


def test_point_in_the_plane_of_the_light() -> None:
    """Outside the outline nothing is seen; within it, half the jump through the light."""
    wall = SQUARE[:, [0, 2, 1]]  # in the plane y = 0
    assert polygon.clipped_form_factor(wall + np.array([3.0, 0.0, 0.5])) == pytest.approx(
        0.0, abs=1e-16
    )
    lying = SQUARE * [1.0, 1.0, 0.0]
    assert polygon.clipped_form_factor(lying) == 0.0
    assert polygon.clipped_form_factor(lying + np.array([5.0, 0.0, 0.0])) == 0.0
    inside = polygon.clipped_form_factor(wall)  # the origin is the centre
    assert np.abs(inside) <= 0.5
    near = [polygon.clipped_form_factor(wall + np.array([0.0, d, 0.0])) for d in (1e-9, -1e-9)]
    assert np.abs(near[0] - near[1]) == pytest.approx(1.0, abs=1e-8)


def test_needles_repeats_and_collinear_corners() -> None:
    c = np.array([0.2, -0.1, 1.0])
    needle = c + np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1e-9, 0.0]])
    assert polygon.polygon_form_factor(needle) == pytest.approx(3.5e-10, rel=0.5)
    assert polygon.polygon_form_factor(needle[[0, 1, 1]]) == 0.0
    assert polygon.polygon_form_factor(np.tile(c, (5, 1))) == 0.0
    collinear = c + np.array([[-1.0, 0.0, 0.0], [0.3, 0.0, 0.0], [1.0, 0.0, 0.0]])
    assert polygon.polygon_form_factor(collinear) == pytest.approx(0.0, abs=1e-16)
    square = SQUARE + c
    repeated = square[[0, 0, 1, 2, 2, 2, 3]]
    assert polygon.polygon_form_factor(repeated) == pytest.approx(
        polygon.polygon_form_factor(square), rel=1e-14
    )


def test_corner_at_the_point_is_finite() -> None:
    p = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.5], [0.0, 1.0, 0.5]])
    assert np.abs(polygon.clipped_form_factor(p)) <= 1.0


coordinates = st.floats(-2.0, 2.0).map(lambda x: round(x, 3))
points2 = st.lists(st.tuples(coordinates, coordinates), min_size=3, max_size=8)
exponents = st.floats(-4.0, 4.0)


@given(points2, st.tuples(coordinates, coordinates, coordinates), exponents, st.integers(0, 2**31))
def test_any_polygon_is_bounded_and_signed(
    outline: list[tuple[float, float]], centre: tuple[float, ...], log_size: float, seed: int
) -> None:
    """Any loop, self-crossing too, of 1e-4 to 1e4 times the distance, in any plane."""
    _, u, v = random_planes(np.random.default_rng(seed), 1)
    p = place(np.array(outline) * 10.0**log_size, np.array(centre), u[0], v[0])
    e = polygon.clipped_form_factor(p)
    assert np.isfinite(e)
    assert np.abs(e) <= len(outline)  # a self-crossing loop may run around more than once
    assert polygon.clipped_form_factor(p[::-1]) == pytest.approx(-e, abs=1e-9)


@given(
    st.tuples(coordinates, coordinates, coordinates), exponents, exponents, st.integers(0, 2**31)
)
def test_rectangles_stay_in_the_unit_interval(
    centre: tuple[float, ...], log_width: float, log_height: float, seed: int
) -> None:
    _, u, v = random_planes(np.random.default_rng(seed), 1)
    size = np.array([10.0**log_width, 10.0**log_height])
    p = place(SQUARE[:, :2] * size, np.array(centre), u[0], v[0])
    assert np.abs(polygon.clipped_form_factor(p)) <= 1.0 + 1e-12


def test_transformed_cosine_over_a_light(rng: np.random.Generator) -> None:
    """Contour sum of ltc_specular against its definition: sample the lobe, ask for the light."""
    matrix = np.array([[0.35, 0.02, 0.6], [0.0, 0.25, 0.1], [-0.25, 0.0, 0.7]])
    w = transform.sample(rng.random((400_000, 2)), matrix)
    above = w[:, 2] > 0.0
    assert np.mean(above) == pytest.approx(1.0 - float(transform.leak(matrix)), abs=3e-3)
    tested = 0
    for c, u, v in zip(*random_planes(rng, 12), strict=True):
        normal = np.cross(u, v)
        if np.abs(normal @ c) < 0.05:
            continue
        outer, hole = place(1.2 * SQUARE[:, :2], c, u, v), place(0.6 * SQUARE[:, :2], c, u, v)
        t = (normal @ c) / np.where(np.abs(w @ normal) > 1e-9, w @ normal, np.inf)
        hit = t[:, None] * w - c
        extent = np.maximum(np.abs(hit @ u), np.abs(hit @ v))
        inside = above & (t > 0.0) & (extent < 1.2) & (extent > 0.6)
        expected = np.mean(inside) / np.mean(above)
        got = polygon.ltc_specular(matrix, [outer, hole[::-1]], 0.9)
        assert got == pytest.approx(0.9 * expected, abs=4e-3)
        tested += 1
    assert tested >= 6


def test_full_sky_returns_the_albedo() -> None:
    """Neither more nor less, though the lobe reaches below the surface."""
    sky = 1e8 * SQUARE + UP
    matrices = np.array(
        [
            [[0.35, 0.0, 0.6], [0.0, 0.25, 0.0], [-0.25, 0.0, 0.7]],
            [[0.5, 0.0, 0.3], [0.0, 0.4, 0.0], [-0.9, 0.0, 0.4]],
        ]
    )
    assert polygon.ltc_specular(matrices, [sky], [0.9, 0.4]) == pytest.approx([0.9, 0.4], abs=1e-7)


def test_bad_input() -> None:
    for function in (polygon.clip_to_horizon, polygon.polygon_form_factor):
        with pytest.raises(ValueError, match=r"shape \(2, 3\), expected \(..., N >= 3, 3\)"):
            function(np.zeros((2, 3)))
