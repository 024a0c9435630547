"""The published methods for curved lights, against the curves' own integral.

That is quadrature of the one-form (`ltc.curved_outline`), which has neither edges nor triangles.
"""

import numpy as np
import pytest

from ltc import adaptive, transform
from ltc.adaptive import is_straight, specular_epsilon, uniform
from ltc.curved_outline import ltc_form_factor
from ltc.table import load_isotropic
from tests.ltc.test_polygon import place, random_planes

EYE = np.eye(3)


def path(start, *segments) -> np.ndarray:
    """Return cubics (k, 4, 2) through ``segments``: points, or (handle, handle, point)."""
    curves, a = [], np.array(start, dtype=np.float64)
    for segment in segments:
        s = np.array(segment, dtype=np.float64)
        curve = [a, a + (s - a) / 3.0, a + 2.0 * (s - a) / 3.0, s] if s.ndim == 1 else [a, *s]
        curves.append(curve)
        a = curve[3]
    return np.array(curves)


def circle(radius: float = 1.0) -> np.ndarray:
    """Return four cubics within 3e-4 of a circle, counter-clockwise."""
    h = 4.0 / 3.0 * (np.sqrt(2.0) - 1.0)
    return radius * path(
        (1, 0),
        ((1, h), (h, 1), (0, 1)),
        ((-h, 1), (-1, h), (-1, 0)),
        ((-1, -h), (-h, -1), (0, -1)),
        ((h, -1), (1, -h), (1, 0)),
    )


def hole(chain: np.ndarray) -> np.ndarray:
    return chain[::-1, ::-1]


HEART = path(
    (0, -1),
    ((0.5, -0.6), (1.2, 0), (1, 0.5)),
    ((0.85, 0.95), (0.2, 0.95), (0, 0.5)),
    ((-0.2, 0.95), (-0.85, 0.95), (-1, 0.5)),
    ((-1.2, 0), (-0.5, -0.6), (0, -1)),
)
LETTER_P = [
    path(
        (-0.6, -1), (-0.25, -1), (-0.25, -0.2), (0.1, -0.2),
        ((0.5, -0.2), (0.8, 0), (0.8, 0.4)), ((0.8, 0.8), (0.5, 1), (0.1, 1)),
        (-0.6, 1), (-0.6, -1),
    ),
    path(
        (-0.25, 0.1), (-0.25, 0.7), (0.1, 0.7),
        ((0.3, 0.7), (0.45, 0.6), (0.45, 0.4)), ((0.45, 0.2), (0.3, 0.1), (0.1, 0.1)),
        (-0.25, 0.1),
    ),
]  # fmt: skip
OUTLINES = {
    "circle": [circle()],
    "heart": [HEART],
    "letter": LETTER_P,
    "ring": [circle(), hole(circle(0.55))],
}


def in_mirror_direction(rng: np.random.Generator, n: int):
    """Return (cosines of the view, function that places outlines where their mirror image is)."""
    cosine = rng.uniform(0.1, 1.0, n)
    mirror = np.stack([-np.sqrt(1.0 - cosine**2), np.zeros(n), cosine], axis=-1)
    normal = rng.normal(size=(n, 3))
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    facing = np.sum(normal * mirror, axis=-1, keepdims=True) > 0.0
    normal = np.where(facing, normal, -normal) + mirror
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    u = np.cross(normal, rng.normal(size=(n, 3)))
    u /= np.linalg.norm(u, axis=-1, keepdims=True)
    v = np.cross(normal, u)
    hit = rng.uniform(-0.8, 0.8, (n, 2, 1))
    centre = rng.uniform(1.0, 6.0, (n, 1)) * mirror - hit[:, 0] * u - hit[:, 1] * v
    return cosine, lambda chain: place_curves(chain, centre, u, v)


def place_curves(chain, c, u, v) -> np.ndarray:
    """Return (..., k, 4, 3) control points of plane cubics (k, 4, 2)."""
    points = place(chain.reshape(-1, 2), c, u, v)
    return points.reshape(*points.shape[:-2], *chain.shape[:-1], 3)


def limit(matrix, loops) -> np.ndarray:
    return ltc_form_factor(matrix, loops).value


@pytest.mark.parametrize(
    ("alpha", "published", "extrapolated", "least", "most"),
    [(0.01, 1e-3, 2e-5, 100, 200), (0.1, 8e-3, 3e-4, 55, 100), (0.5, 1.2e-2, 3e-4, 50, 75)],
)
def test_figures_of_the_published_method(rng, alpha, published, extrapolated, least, most):
    """What curves cost and err, p95 relative, lit from the mirror direction.

    Measured: 5.1e-4, 5.1e-3 and 8.3e-3 with 143, 70 and 61 edges; extrapolated
    9.7e-6, 1.0e-4 and 9.6e-5. The bounds leave the sample of 4 x 40 room of two.
    """
    table = load_isotropic()
    cosine, placed = in_mirror_direction(rng, 40)
    matrix = transform.invert(table.matrix(alpha, cosine))
    errors, edges = {False: [], True: []}, []
    for outline in OUTLINES.values():
        loops = [placed(chain) for chain in outline]
        truth = limit(matrix, loops)
        for leaf in errors:
            found = adaptive.adaptive(matrix, loops, specular_epsilon(alpha), extrapolated=leaf)
            bright = truth > 0.01
            errors[leaf].append((np.abs(found.value - truth) / np.maximum(truth, 0.01))[bright])
            edges.append(found.evaluations)
    p95 = {leaf: np.quantile(np.concatenate(e), 0.95) for leaf, e in errors.items()}
    assert p95[False] <= published
    assert p95[True] <= extrapolated
    assert p95[True] <= p95[False] / 20.0
    assert least <= np.mean(edges) <= most


@pytest.mark.parametrize("extrapolated", [False, True])
@pytest.mark.parametrize("name", OUTLINES)
def test_through_the_horizons(rng, name, extrapolated):
    """Lights in any position about the surface, under lobes that bend them through another."""
    c, u, v = random_planes(rng, 60)
    cosine = rng.uniform(0.05, 1.0, 60)
    matrix = transform.invert(load_isotropic().matrix(rng.uniform(0.05, 1.0, 60), cosine))
    loops = [place_curves(chain, c, u, v) for chain in OUTLINES[name]]
    found = adaptive.adaptive(matrix, loops, 1e-7, extrapolated=extrapolated)
    np.testing.assert_allclose(found.value, limit(matrix, loops), rtol=0.0, atol=2e-5)
    assert np.all(found.value > -1e-6)


def test_error_falls_with_epsilon(rng):
    """Triangles shrink like h^3 and their sum like h^2, so errors go like epsilon^(2/3)."""
    c, u, v = random_planes(rng, 40)
    loops = [place_curves(HEART, c, u, v)]
    truth = limit(EYE, loops)
    errors = [
        np.mean(np.abs(adaptive.adaptive(EYE, loops, 10.0**-k).value - truth)) for k in (4, 5, 6)
    ]
    assert np.all(np.diff(np.log10(errors)) < -0.55)


def test_two_contours_of_which_one_begins_below():
    """The published shader keeps one exit for all contours, and loses an edge here."""
    upright = np.array([0.0, 3.0, 0.1]), np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.6, 0.8])
    left = place_curves(circle(0.4) - np.array([0.6, 0.0]), *upright)
    right = place_curves(circle(0.4) + np.array([0.6, 0.0]), *upright)
    loops = [np.roll(left, 1, axis=0), np.roll(right, 3, axis=0)]
    assert loops[0][0, 0, 2] < 0.0 < loops[1][0, 0, 2]
    apart = sum(float(adaptive.adaptive(EYE, [loop], 1e-8).value) for loop in loops)
    together = float(adaptive.adaptive(EYE, loops, 1e-8).value)
    assert together == pytest.approx(apart, abs=1e-15)
    assert together == pytest.approx(float(limit(EYE, loops)), abs=1e-6)


def test_edges_of_a_curve_that_is_never_halved():
    """Diffuse light, as published: 4 intervals of 3 edges a curve, whatever it looks like."""
    chain = place_curves(circle(), np.array([0.0, 0.0, 2.0]), *np.eye(3)[:2])
    found = adaptive.adaptive(EYE, [chain], adaptive.DIFFUSE_EPSILON)
    assert found.evaluations == 4 * 4 * 3
    assert found.value == pytest.approx(float(uniform(EYE, [chain], 8).value), abs=1e-14)


def test_polygons_are_exact_and_one_edge_each(rng):
    c, u, v = random_planes(rng, 30)
    square = path((-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1))
    loops = [place_curves(square, c, u, v)]
    found = adaptive.adaptive(EYE, loops, 1e-3)
    np.testing.assert_allclose(found.value, uniform(EYE, loops, 1).value, rtol=0.0, atol=1e-13)
    assert np.max(found.evaluations) <= 6
    assert np.all(uniform(EYE, loops, 7).evaluations == 4)


STIFF = {
    "cusp": path((-1, 0), ((1, 1), (-1, 1), (1, 0)), (-1, 0)),
    "loop": path((-1, 0), ((2, 1.5), (-2, 1.5), (1, 0)), (-1, 0)),
    "inflection": path((-1, 0), ((0, 1.5), (0, -0.5), (1, 0)), (0, -1), (-1, 0)),
    "handles at the ends": path((-1, 0), ((-1, 0), (1, 0), (1, 0)), (0, 1), (-1, 0)),
    "handles beyond the ends": path((-1, 0), ((3, 0), (-3, 0), (1, 0)), (0, 1), (-1, 0)),
    "one handle at its anchor": path((-1, 0), ((-1, 0), (0.5, -1), (1, 0)), (0, 1), (-1, 0)),
    "nothing": path((0.2, 0.1), (0.2, 0.1)),
    "a point among curves": path((-1, 0), (-1, 0), ((-0.5, -1), (0.5, -1), (1, 0)), (-1, 0)),
    "raised quadratic": path((-1, 0), ((-1 / 3, 1), (1 / 3, 1), (1, 0)), (-1, 0)),
    "closed by one curve": path((0, 0), ((2, 1), (-2, 1), (0, 0))),
}


@pytest.mark.parametrize("name", STIFF)
def test_stiff_curves(rng, name):
    c, u, v = random_planes(rng, 40)
    loops = [place_curves(STIFF[name], c, u, v)]
    truth = limit(EYE, loops)
    for leaf in (False, True):
        found = adaptive.adaptive(EYE, loops, 1e-7, extrapolated=leaf)
        np.testing.assert_allclose(found.value, truth, rtol=0.0, atol=3e-5)


def test_ends_exactly_on_the_horizon():
    """A light that stands on the surface: its lowest anchor is at z = 0, the rest above."""
    chain = place_curves(circle() + np.array([0.0, 1.0]), np.array([0.0, 2.0, 0.0]), *EYE[[0, 2]])
    chain = np.roll(chain, 1, axis=0)
    assert np.count_nonzero(chain[..., 2] == 0.0) >= 2
    for shift in range(4):
        turned = [np.roll(chain, shift, axis=0)]
        found = adaptive.adaptive(EYE, turned, 1e-7, extrapolated=True)
        assert found.value == pytest.approx(float(limit(EYE, turned)), abs=1e-6)


def test_no_light_where_none_is():
    below = place_curves(circle(), np.array([0.0, 0.0, -1.0]), *EYE[:2])
    found = adaptive.adaptive(EYE, [below], 1e-6)
    assert found.value == 0.0
    assert found.evaluations == 0
    edge_on = place_curves(circle(), np.array([3.0, 0.0, 0.5]), *EYE[[0, 2]])
    assert adaptive.adaptive(EYE, [edge_on], 1e-6).value == pytest.approx(0.0, abs=1e-15)
    assert adaptive.adaptive(EYE, [], 1e-6).value == 0.0


def test_a_point_on_the_outline_ends():
    """No triangle becomes small there: the last level ends it, with half a light at most."""
    chain = place_curves(circle(), np.array([0.0, 0.0, 1.0]), *EYE[[0, 2]])
    found = adaptive.adaptive(EYE, [chain], 1e-9)
    assert np.isfinite(found.value)
    assert abs(float(found.value)) <= 0.5 + 1e-9


def test_uniform_converges_to_the_curves(rng):
    """Like 1/n^2: extrapolated from 64 and 128 edges it is the curves' own integral."""
    c, u, v = random_planes(rng, 40)
    matrix = transform.invert(load_isotropic().matrix(0.2, rng.uniform(0.1, 1.0, 40)))
    loops = [place_curves(chain, c, u, v) for chain in OUTLINES["ring"]]
    coarse, fine = (uniform(matrix, loops, edges).value for edges in (64, 128))
    truth = limit(matrix, loops)
    assert np.max(np.abs(fine - truth)) > 1e-6
    np.testing.assert_allclose(fine + (fine - coarse) / 3.0, truth, rtol=0.0, atol=2e-7)


def test_straight_curves_are_told(rng):
    line = path((0.3, -2.0), (1.7, 0.4))
    assert is_straight(line[0])
    assert is_straight(STIFF["handles beyond the ends"][0])
    assert is_straight(STIFF["nothing"][0])
    assert not is_straight(HEART[0])
    # Parallel to the chord is not on it: a test by dot products would say so.
    assert not is_straight(path((0, 0), ((0.3, 0.1), (0.6, 0.1), (1, 0)))[0])
    a, b = rng.normal(size=(2, 50, 3))
    t = rng.uniform(size=(50, 4, 1))
    assert np.all(is_straight(a[:, None] + t * b[:, None]))


@pytest.mark.parametrize(
    ("matrix", "contour", "epsilon", "divisions", "words"),
    [
        (np.eye(2), HEART, 1.0, 4, "cosine_from_shading has shape"),
        (EYE, HEART, 1.0, 4, "contour 0 has shape"),
        (EYE, np.zeros((0, 4, 3)), 1.0, 4, "contour 0 has shape"),
        (EYE, np.zeros((2, 4, 3)), 0.0, 4, "epsilon is 0"),
        (EYE, np.zeros((2, 4, 3)), 1.0, 0, "divisions is 0"),
    ],
)
def test_bad_input(matrix, contour, epsilon, divisions, words):
    with pytest.raises(ValueError, match=words):
        adaptive.adaptive(matrix, [contour], epsilon, divisions)


def test_uniform_needs_an_edge():
    with pytest.raises(ValueError, match="edges is 0"):
        uniform(EYE, [np.zeros((2, 4, 3))], 0)
