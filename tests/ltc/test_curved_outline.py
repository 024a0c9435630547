"""Curved outlines: four routes to one form factor, stiff cases, invariances, transforms.

The routes: quadrature and the closed form, which share the horizon; the form with max(z, 0),
which has no crossings; a polygon of some thousand corners.
"""

import numpy as np
import pytest

from ltc import bezier, curved_outline, polygon, transform
from ltc.table import load_isotropic

EXACT = 1e-12
"""Quadrature against the form without crossings: rounding of some thousand terms."""


def circle(curves: int = 4, radius: float = 1.0) -> np.ndarray:
    """Return (k, 4, 2): the usual arcs, off a true circle by 3e-4 for four."""
    k = 4.0 / 3.0 * np.tan(np.pi / (2 * curves))
    a = np.linspace(0.0, 2.0 * np.pi, curves + 1)
    p = np.stack([np.cos(a), np.sin(a)], axis=-1)
    p[-1] = p[0]
    t = k * np.stack([-p[:, 1], p[:, 0]], axis=-1)
    return radius * np.stack([p[:-1], (p + t)[:-1], (p - t)[1:], p[1:]], axis=1)


def backwards(contour: np.ndarray) -> np.ndarray:
    return contour[..., ::-1, ::-1, :]


HEART = np.array(
    [
        [[0.0, -1.0], [0.5, -0.5], [1.0, 0.0], [1.0, 0.4]],
        [[1.0, 0.4], [1.0, 0.9], [0.2, 1.0], [0.0, 0.4]],
        [[0.0, 0.4], [-0.2, 1.0], [-1.0, 0.9], [-1.0, 0.4]],
        [[-1.0, 0.4], [-1.0, 0.0], [-0.5, -0.5], [0.0, -1.0]],
    ]
)
RING = (
    circle(8),
    backwards(circle(4, 0.3)) + np.array([0.5, 0.0]),
    backwards(circle(4, 0.25)) - np.array([0.45, 0.1]),
)
SQUARE = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
LEAF = bezier.from_quadratic(
    np.array([[[-1.0, 0.0], [0.0, -1.2], [1.0, 0.0]], [[1.0, 0.0], [0.0, 0.7], [-1.0, 0.0]]])
)
GLYPH = np.concatenate(
    [
        bezier.from_quadratic(np.array([[[-0.5, -1.0], [0.7, -1.0], [0.6, 0.1]]])),
        bezier.from_line([[0.6, 0.1], [0.9, 0.9]], [[0.9, 0.9], [-0.7, 0.8]]),
        np.array([[[-0.7, 0.8], [0.4, 0.2], [-1.2, -0.3], [-0.5, -1.0]]]),
    ]
)
SHAPES = {
    "circle": (circle(),),
    "heart": (HEART,),
    "ring with two holes": RING,
    "square": (bezier.from_polygon(SQUARE),),
    "quadratics": (LEAF,),
    "lines, a quadratic and a cubic": (GLYPH,),
}


def random_outline(rng: np.random.Generator, curves: int) -> np.ndarray:
    """Return a closed contour (k, 4, 2), most often with crossings and loops."""
    start, handles = rng.normal(size=(curves, 2)), rng.normal(size=(curves, 2, 2))
    end = np.roll(start, -1, axis=0)
    return np.stack([start, handles[:, 0], handles[:, 1], end], axis=1)


def place(outline: np.ndarray, c: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Return outlines (..., k, 4, 3) at centres and axes (..., 3)."""
    c, u, v = (np.asarray(a)[..., None, None, :] for a in (c, u, v))
    return c + outline[..., :1] * u + outline[..., 1:] * v


def placed(
    shape: tuple[np.ndarray, ...], rng: np.random.Generator, count: int, distance: float = 1.0
) -> list[np.ndarray]:
    """Return the contours of a shape in ``count`` random planes; half cross the horizon."""
    c, u, v = rng.normal(size=(3, count, 3))
    c *= distance * 10.0 ** rng.uniform(-0.5, 0.5, (count, 1))
    return [place(contour, c, u, v) for contour in shape]


def polygonal(contours: list[np.ndarray], edges: int = 4096) -> np.ndarray:
    steps = edges // sum(contour.shape[-3] for contour in contours)
    return polygon.loops_form_factor([bezier.flatten(contour, steps) for contour in contours])


def check(contours: list[np.ndarray], edges: int = 4096) -> np.ndarray:
    """Hold all routes to each other, and return the form factors."""
    got = curved_outline.form_factor(contours)
    closed = curved_outline.closed_form_factor(contours)
    whole = curved_outline.azimuth_form_factor(contours)
    assert np.all(np.isfinite(got.value))
    assert np.max(got.error) < EXACT
    off = np.abs(got.value - whole.value)
    # Panels that touch the horizon without crossing it are where that form is less sure.
    assert np.all(off <= EXACT + whole.error), np.max(off)
    assert np.max(whole.error) < 1e-8
    off = np.abs(got.value - closed.value)
    assert np.all(off <= got.error + closed.error), (np.max(off), np.max(closed.error))
    # A chord leaves out an area that falls with the square of its length.
    coarse, fine = polygonal(contours, edges // 2), polygonal(contours, edges)
    off = np.abs(got.value - fine)
    assert np.all(off <= 0.5 * np.abs(fine - coarse) + 1e-9), np.max(off)
    return got.value


# --- The routes against each other --------------------------------------------------------


@pytest.mark.parametrize("name", SHAPES)
def test_shapes_by_all_routes(name: str, rng: np.random.Generator) -> None:
    """Anywhere about the horizon, near and far."""
    value = check(placed(SHAPES[name], rng, 25))
    assert np.max(np.abs(value)) > 0.1


@pytest.mark.parametrize("curves", [1, 2, 3, 7])
def test_random_outlines_by_all_routes(curves: int, rng: np.random.Generator) -> None:
    """Cubics at random: self-crossing, with loops, cusps nearly, several crossings each."""
    for _ in range(6):
        check(placed((random_outline(rng, curves), random_outline(rng, 2)), rng, 5))


def test_above_the_horizon_nothing_is_clipped(rng: np.random.Generator) -> None:
    c, u, v = rng.normal(size=(3, 30, 3))
    c[:, 2] = 4.0 + np.abs(c[:, 2])
    contours = [place(contour, c, 0.5 * u, 0.5 * v) for contour in RING]
    high = np.min([np.min(p[..., 2], axis=(-2, -1)) for p in contours], axis=0) > 0.0
    contours = [p[high] for p in contours]
    check(contours)
    clipped, light, shape = curved_outline.clip_to_horizon(contours)
    assert clipped.shape[0] == 16 * shape[0]
    np.testing.assert_array_equal(np.bincount(light), 16)


def test_disk_in_closed_form() -> None:
    """Overhead a disk has the form factor R^2/(R^2 + h^2); 64 arcs are round to 1e-9."""
    for height in (1e-3, 0.1, 1.0, 30.0):
        disk = place(circle(64, 0.7), [0.0, 0.0, height], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
        exact = 0.49 / (0.49 + height * height)
        for form in (
            curved_outline.form_factor,
            curved_outline.closed_form_factor,
            curved_outline.azimuth_form_factor,
        ):
            assert form([disk]).value == pytest.approx(exact, rel=1e-8)


def test_polygons_as_cubics(rng: np.random.Generator) -> None:
    """Exactly `ltc.polygon`, horizon and all."""
    for corners in (3, 4, 9):
        outline = rng.normal(size=(corners, 1, 2))
        contour = placed((outline,), rng, 100)[0][:, :, 0]
        expected = polygon.clipped_form_factor(contour)
        got = curved_outline.form_factor([bezier.from_polygon(contour)])
        np.testing.assert_allclose(got.value, expected, atol=1e-13)
        closed = curved_outline.closed_form_factor([bezier.from_polygon(contour)])
        np.testing.assert_allclose(closed.value, expected, atol=1e-12)


# --- The horizon --------------------------------------------------------------------------


def standing(outline: np.ndarray, height: float = 0.0, away: float = 1.0) -> np.ndarray:
    """Return an outline in the plane y = away, its x along x and its y up."""
    return place(outline, [0.0, away, height], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0])


@pytest.mark.parametrize("height", [0.0, -0.4, 1.0, -1.0, 1e-12, -1e-12])
def test_endpoints_on_the_horizon(height: float) -> None:
    """The circle's ends are at heights 0, 1 and -1 of its own."""
    value = check([standing(circle(), height)])
    if height == -1.0:
        assert value == 0.0
    upper = np.concatenate([circle()[:2], bezier.from_line([[-1.0, 0.0]], [[1.0, 0.0]])])
    if height == 0.0:
        assert value == pytest.approx(
            curved_outline.form_factor([standing(upper)]).value, abs=1e-15
        )
        assert value == pytest.approx(check([standing(backwards(circle()))]) * -1.0, abs=1e-15)


def test_curves_along_the_horizon() -> None:
    """An edge, and a whole outline, at z = 0 exactly."""
    upper = np.concatenate([circle()[:2], bezier.from_line([[-1.0, 0.0]], [[1.0, 0.0]])])
    lower = np.concatenate([circle()[2:], bezier.from_line([[1.0, 0.0]], [[-1.0, 0.0]])])
    assert abs(check([standing(upper)])) > 0.05
    assert check([standing(lower)]) == 0.0
    lying = place(HEART, [3.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    around = place(HEART, [0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    assert curved_outline.form_factor([lying]).value == 0.0
    assert curved_outline.form_factor([around]).value == 0.0


@pytest.mark.parametrize("turned", [False, True])
def test_unbridged_contours_about_the_horizon(turned: bool) -> None:
    """One starts above, one below, both cross: each contour by itself is the sum."""
    above = circle(4, 0.5)
    above = np.roll(above, -1, axis=0) + np.array([-0.7, 0.1])  # starts at its top
    below = np.roll(circle(4, 0.5), -3, axis=0) + np.array([0.7, -0.1])  # starts at its bottom
    pair = [standing(above), standing(below)]
    if turned:
        pair = [standing(backwards(p)) for p in (above, below)]
    assert pair[0][0, 0, 2] > 0.0 > pair[1][0, 0, 2] or turned
    both = check(pair)
    alone = [curved_outline.form_factor([p]).value for p in pair]
    assert both == pytest.approx(sum(alone), abs=1e-15)
    assert all(abs(a) > 1e-3 for a in alone)
    hole = [standing(circle(), -0.1), standing(backwards(above * 0.5), -0.1)]
    check(hole)


def test_wholly_below_is_exactly_nothing(rng: np.random.Generator) -> None:
    c, u, v = rng.normal(size=(3, 40, 3))
    c[:, 2] = -10.0
    u[:, 2] *= 0.5
    for shape in SHAPES.values():
        contours = [place(p, c, u, v) for p in shape]
        assert not np.any(curved_outline.form_factor(contours).value)
        assert not np.any(curved_outline.closed_form_factor(contours).value)


def test_around_zenith_and_nadir() -> None:
    """Tilted sheets that cover the zenith, the nadir or, standing, neither."""
    for tilt in (-0.8, -0.2, 0.2, 0.8):
        for height in (-1.0, -0.05, 0.05, 1.0):
            sheet = place(3.0 * HEART, [0.1, 0.0, height], [1.0, 0.0, tilt], [0.0, 1.0, 0.3])
            value = check([sheet])
            assert (value > 0.0) == (height - 0.1 * tilt > 0.0)


def test_plane_through_the_point() -> None:
    """Edge-on a light is not seen, wherever it lies about the point in its own plane."""
    u, v = np.array([1.0, 0.3, 0.2]), np.array([-0.2, 0.8, 0.6])
    for shift in ([3.0, 0.0], [0.0, -4.0], [2.0, 2.0]):
        for shape in SHAPES.values():
            contours = [place(p + shift, np.zeros(3), u, v) for p in shape]
            for form in (curved_outline.form_factor, curved_outline.closed_form_factor):
                assert form(contours).value == pytest.approx(0.0, abs=1e-14)
    # In the hole of a ring, and in the mouth of a C, the horizon passes on both sides.
    ring = [place(p, np.zeros(3), u, v) for p in (circle(8), backwards(circle(4, 0.6)))]
    assert curved_outline.form_factor(ring).value == pytest.approx(0.0, abs=1e-14)
    inside = curved_outline.form_factor([place(HEART, np.zeros(3), u, v)]).value
    assert abs(inside) <= 1.0


@pytest.mark.parametrize("distance", [1e-3, 1e-6, 1e-9])
def test_close_to_the_plane(distance: float, rng: np.random.Generator) -> None:
    """On either side of a light that surrounds the point: one side less the other is 1."""
    u, v = np.array([1.0, 0.3, 0.2]), np.array([-0.2, 0.8, 0.6])
    n = np.cross(u, v) / np.linalg.norm(np.cross(u, v))
    front, back = (
        curved_outline.form_factor([place(circle(), side * distance * n, u, v)]).value
        for side in (1.0, -1.0)
    )
    assert front > 0.0 > back
    # The far side of the light is missing by its distance, squared where it is above.
    assert front - back == pytest.approx(1.0, abs=4.0 * distance)


# --- Stiff outlines -----------------------------------------------------------------------


STIFF = {
    "cusp": np.array([[[0.0, 0.0], [1.0, 1.0], [0.0, 1.0], [1.0, 0.0]]]),
    "loop": np.array([[[-0.5, 0.0], [1.5, 1.0], [-1.5, 1.0], [0.5, 0.0]]]),
    "inflection": np.array([[[-1.0, 0.0], [0.0, 1.5], [0.0, -1.5], [1.0, 0.0]]]),
    "first two coincide": np.array([[[0.0, 0.0], [0.0, 0.0], [1.0, 1.0], [1.0, 0.0]]]),
    "last three coincide": np.array([[[0.0, 0.0], [1.0, 1.0], [1.0, 1.0], [1.0, 1.0]]]),
    "collinear": np.array([[[0.0, 0.0], [0.9, 0.9], [0.1, 0.1], [1.0, 1.0]]]),
    "beyond its ends": np.array([[[0.0, 0.0], [2.0, 2.0], [-1.0, -1.0], [1.0, 1.0]]]),
    "handles at the ends": np.array([[[0.0, 0.0], [0.0, 0.0], [1.0, 1.0], [1.0, 1.0]]]),
    "closed by itself": np.array([[[0.0, 0.0], [1.0, 0.2], [0.3, 1.0], [0.0, 0.0]]]),
    "huge handles": np.array([[[0.0, 0.0], [40.0, 3.0], [-35.0, 8.0], [1.0, 0.0]]]),
}


@pytest.mark.parametrize("name", STIFF)
def test_stiff_curves(name: str, rng: np.random.Generator) -> None:
    """Closed by a quarter circle and lines, and with curves of no length between."""
    curve = STIFF[name]
    start, end = curve[0, 0], curve[-1, 3]
    far = np.array([0.4, -1.5])
    nothing = np.broadcast_to(end, (1, 4, 2))
    closing = bezier.from_line(np.stack([end, far]), np.stack([far, start]))
    outline = np.concatenate([curve, nothing, nothing, closing])
    contours = placed((outline,), rng, 20)
    with_gaps = check(contours)
    without = curved_outline.form_factor([np.delete(contours[0], [1, 2], axis=1)]).value
    np.testing.assert_allclose(with_gaps, without, atol=1e-14)
    check([standing(outline, -0.2)])


def test_outlines_without_area(rng: np.random.Generator) -> None:
    """There and back, on a line or a curve, and single points: no light at all."""
    curve = random_outline(rng, 1)
    curve[:, 3] = [2.0, 0.0]
    back = np.concatenate([curve, backwards(curve)])
    point = np.ones((3, 4, 2))
    for outline in (back, bezier.from_polygon(np.array([[0.0, 0.0], [1.0, 1.0]])), point):
        contours = placed((outline,), rng, 60)
        for form in (curved_outline.form_factor, curved_outline.closed_form_factor):
            assert np.max(np.abs(form(contours).value)) < 1e-12
        assert np.max(np.abs(curved_outline.guided_form_factor(contours)[0])) < 1e-12


def test_point_on_the_outline_is_finite() -> None:
    for t in (0.0, 0.3, 0.5, 1.0):
        at = bezier.evaluate(HEART[1], t)
        contour = place(HEART - at, np.zeros(3), [1.0, 0.3, 0.2], [-0.2, 0.8, 0.6])
        for form in (
            curved_outline.form_factor,
            curved_outline.closed_form_factor,
            curved_outline.azimuth_form_factor,
        ):
            assert abs(form([contour]).value) <= 1.0 + 1e-9
        assert np.isfinite(curved_outline.guided_form_factor([contour])[0])


@pytest.mark.parametrize("distance", [1e-2, 1e-4, 1e-7])
def test_close_to_the_outline(distance: float, rng: np.random.Generator) -> None:
    u, v = np.array([1.0, 0.3, 0.2]), np.array([-0.2, 0.8, 0.6])
    for _ in range(20):
        at = bezier.evaluate(HEART[rng.integers(4)], rng.random())
        offset = rng.normal(size=3)
        offset *= distance / np.linalg.norm(offset)
        contour = [place(HEART - at, offset, u, v)]
        got = curved_outline.form_factor(contour)
        assert got.error < EXACT
        # Points of the outline are known to rounding, and angles to that over the distance.
        whole = curved_outline.azimuth_form_factor(contour)
        off = abs(got.value - whole.value)
        assert off <= 1e-13 + 1e-15 / distance + whole.error
        closed = curved_outline.closed_form_factor(contour)
        # Two roots that nearly meet at the point lose digits, and say so.
        assert abs(closed.value - got.value) <= closed.error + got.error


def test_hundreds_of_curves(rng: np.random.Generator) -> None:
    """A gear of 500 curves equals its parts."""
    t = np.linspace(0.0, 2.0 * np.pi, 501)
    t[-1] = 0.0
    p = np.stack([np.cos(t), np.sin(t)], axis=-1) * (1.0 + 0.1 * (np.arange(501) % 2))[:, None]
    p[-1] = p[0]
    outline = np.stack([p[:-1], 1.1 * p[:-1], 0.9 * p[1:], p[1:]], axis=1)
    contour = placed((outline,), rng, 6)[0]
    got = check([contour])
    chord = bezier.from_line(contour[:, 250, 0], contour[:, 0, 0])[:, None]
    first = np.concatenate([contour[:, :250], chord], axis=1)
    second = np.concatenate([contour[:, 250:], backwards(chord)], axis=1)
    halves = curved_outline.form_factor([first]).value + curved_outline.form_factor([second]).value
    np.testing.assert_allclose(got, halves, atol=1e-13)


# --- Invariances --------------------------------------------------------------------------


def test_rotation_winding_scale_and_subdivision(rng: np.random.Generator) -> None:
    for shape in (RING, (random_outline(rng, 5),)):
        contours = placed(shape, rng, 60)
        value = curved_outline.form_factor(contours).value
        turn = np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
        split = [
            np.stack(bezier.split(p, rng.random(p.shape[:-2])), axis=-3).reshape(
                *p.shape[:-3], -1, 4, 3
            )
            for p in contours
        ]
        others = {
            "rotated": [p @ turn.T for p in contours],
            "scaled": [1e3 * p for p in contours],
            "subdivided": split,
            "started elsewhere": [np.roll(p, 1, axis=-3) for p in contours],
            "other order": contours[::-1],
        }
        for name, other in others.items():
            np.testing.assert_allclose(
                curved_outline.form_factor(other).value, value, atol=1e-12, err_msg=name
            )
        mirrored = [p * [1.0, -1.0, 1.0] for p in contours]
        for other in ([backwards(p) for p in contours], mirrored):
            np.testing.assert_allclose(curved_outline.form_factor(other).value, -value, atol=1e-12)
        np.testing.assert_array_equal(
            curved_outline.positive_winding(contours[0]), backwards(contours[0])
        )


def test_far_lights_keep_their_relative_accuracy(rng: np.random.Generator) -> None:
    """At 1e4 times its size a light has its area's share; the terms lose four digits."""
    for _ in range(20):
        u, v = rng.normal(size=(2, 3))
        c = rng.normal(size=3)
        c[2] = abs(c[2]) + 0.1
        n = np.cross(u, v)
        heart = 1e-4 * HEART
        area = 0.0
        for curve in heart:  # Green's theorem by enough nodes for a polynomial of degree 5
            t, w = (x[:, None] for x in polygon_nodes(3))
            p, d = bezier.evaluate(curve, t[:, 0]), bezier.derivative(curve, t[:, 0])
            area += 0.5 * np.sum(w[:, 0] * (p[:, 0] * d[:, 1] - p[:, 1] * d[:, 0]))
        exact = area * (n @ c) * c[2] / np.pi / (c @ c) ** 2
        light = [place(heart, c, u, v)]
        got = curved_outline.form_factor(light).value
        assert got == pytest.approx(exact, rel=5e-3, abs=1e-12)
        assert got == pytest.approx(curved_outline.azimuth_form_factor(light).value, rel=1e-9)


def polygon_nodes(n: int) -> tuple[np.ndarray, np.ndarray]:
    x, w = np.polynomial.legendre.leggauss(n)
    return 0.5 * (x + 1.0), 0.5 * w


def test_broadcasting_and_bad_input(rng: np.random.Generator) -> None:
    contours = placed(RING, rng, 6)
    one = curved_outline.form_factor([contours[0].reshape(2, 3, -1, 4, 3), contours[1][0]])
    assert one.value.shape == (2, 3)
    again = curved_outline.form_factor([contours[0][5], contours[1][0]]).value
    assert one.value[1, 2] == pytest.approx(again, abs=1e-15)
    assert curved_outline.form_factor([]).value == 0.0
    with pytest.raises(ValueError, match="contour 1 has shape"):
        curved_outline.form_factor([contours[0], np.zeros((4, 3))])
    with pytest.raises(ValueError, match="contour 0 has a gap of"):
        curved_outline.form_factor([contours[0][:, 1:]])
    with pytest.raises(ValueError, match="expected"):
        bezier.sign_changes(np.zeros(3))
    with pytest.raises(ValueError, match="expected"):
        bezier.from_quadratic(np.zeros((4, 3)))
    with pytest.raises(ValueError, match="cosine_from_shading"):
        curved_outline.ltc_form_factor(np.eye(2), contours)


# --- Linearly transformed cosines ---------------------------------------------------------


def lobes(rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return M (n, 3, 3) of the fitted table from alpha .001 to 1, and mirror directions."""
    alpha = 10.0 ** rng.uniform(-3.0, 0.0, count)
    theta = np.radians(rng.uniform(0.0, 89.0, count))
    mirror = np.stack([-np.sin(theta), np.zeros(count), np.cos(theta)], axis=-1)
    return load_isotropic().matrix(alpha, np.cos(theta)), mirror


def lit(
    shape: tuple[np.ndarray, ...], mirror: np.ndarray, rng: np.random.Generator
) -> list[np.ndarray]:
    """Return a shape's contours about the mirror directions (n, 3); many cross the horizon."""
    c = mirror + 0.3 * rng.normal(size=mirror.shape)
    u, v = rng.normal(size=(2, *mirror.shape))
    v[np.sum(np.cross(u, v) * c, axis=-1) < 0.0] *= -1.0
    return [place(p, c, 0.5 * u, 0.5 * v) for p in shape]


@pytest.mark.parametrize("name", SHAPES)
def test_transformed_cosine_of_a_fine_polygon(name: str, rng: np.random.Generator) -> None:
    M, mirror = lobes(rng, 30)
    contours = lit(SHAPES[name], mirror, rng)
    crossing = np.zeros(30, dtype=bool)
    for p in contours:
        crossing |= (p[..., 2].min(axis=(1, 2)) < 0.0) & (p[..., 2].max(axis=(1, 2)) > 0.0)
    assert np.sum(crossing) > 5
    albedo = rng.random(30)
    got = curved_outline.ltc_specular(M, contours, albedo)
    fine, coarse = (
        polygon.ltc_specular(
            M, [bezier.flatten(p, n // sum(len(q) for q in SHAPES[name])) for p in contours], albedo
        )
        for n in (2048, 1024)
    )
    assert np.all(np.abs(got - fine) <= 0.5 * np.abs(fine - coarse) + 1e-9)
    assert np.all((got >= -1e-12) & (got <= albedo + 1e-12))
    assert np.max(got) > 0.3


def test_transformed_cosine_of_polygons(rng: np.random.Generator) -> None:
    M, mirror = lobes(rng, 200)
    contours = lit(
        (bezier.from_polygon(SQUARE), bezier.from_polygon(0.4 * SQUARE[::-1])), mirror, rng
    )
    albedo = rng.random(200)
    expected = polygon.ltc_specular(M, [p[..., 0, :] for p in contours], albedo)
    np.testing.assert_allclose(
        curved_outline.ltc_specular(M, contours, albedo), expected, atol=1e-12
    )
    one = curved_outline.ltc_specular(M[3], [p[3] for p in contours], albedo[3])
    assert one == pytest.approx(expected[3], abs=1e-12)


def test_identity_and_full_sky(rng: np.random.Generator) -> None:
    contours = placed(RING, rng, 40)
    plain = curved_outline.form_factor(contours).value
    np.testing.assert_allclose(
        curved_outline.ltc_form_factor(np.eye(3), contours).value, plain, atol=1e-14
    )
    M, _ = lobes(rng, 40)
    sky = place(1e9 * circle(), [0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    np.testing.assert_allclose(curved_outline.ltc_specular(M, [sky], 0.7), 0.7, atol=1e-6)
    below = place(circle(), [0.3, 0.1, -1.0], [1.0, 0.0, 0.3], [0.0, 1.0, 0.2])
    assert not np.any(curved_outline.ltc_specular(M, [below], 1.0))
    ring = [place(p, np.zeros(3), [1.0, 0.3, 0.2], [-0.2, 0.8, 0.6]) for p in RING]
    shifted = [p + np.array([0.5, 0.15, 0.1]) * -1.0 for p in ring]  # the point in a hole
    assert np.max(np.abs(curved_outline.ltc_specular(M, shifted, 1.0))) < 1e-9


# --- What guidance costs and errs ---------------------------------------------------------


def test_guided_quadrature(rng: np.random.Generator) -> None:
    """Lights about the mirror direction under the table's lobes; `pytest -s` prints the figures."""
    for alpha, most in ((0.001, 130.0), (0.01, 120.0), (0.1, 100.0), (0.5, 80.0)):
        errors, evaluations = [], []
        for shape in ((circle(),), (HEART,), (GLYPH,), RING):
            theta = np.radians(rng.uniform(0.0, 85.0, 50))
            mirror = np.stack([-np.sin(theta), 0.0 * theta, np.cos(theta)], axis=-1)
            inverse = transform.invert(load_isotropic().matrix(alpha, np.cos(theta)))
            contours = [transform.apply(inverse[:, None, None], p) for p in lit(shape, mirror, rng)]
            got, count = curved_outline.guided_form_factor(contours)
            errors.append(np.abs(got - curved_outline.form_factor(contours).value))
            evaluations.append(count)
        error, nodes = np.concatenate(errors), np.concatenate(evaluations)
        p95 = np.percentile(error, 95)
        print(f"alpha {alpha}: p95 {p95:.1e}, max {error.max():.1e}, {nodes.mean():.0f} nodes")
        # Geometric convergence with rho >= 2 leaves about 2^-16 of a panel.
        assert p95 < 1e-5
        assert np.max(error) < 5e-5
        assert np.mean(nodes) < most


def test_guided_quadrature_converges(rng: np.random.Generator) -> None:
    contours = placed(RING, rng, 100)
    exact = curved_outline.form_factor(contours).value
    worst = [
        np.max(np.abs(curved_outline.guided_form_factor(contours, nodes)[0] - exact))
        for nodes in (4, 8, 12, 20)
    ]
    assert worst[0] < 5e-3
    assert worst[1] < 1e-4
    assert worst[2] < 1e-6
    assert worst[3] < 1e-10
    below = [p - np.array([0.0, 0.0, 100.0]) for p in contours]
    value, count = curved_outline.guided_form_factor(below)
    assert not np.any(value)
    assert not np.any(count)
