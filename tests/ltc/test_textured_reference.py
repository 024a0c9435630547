"""The reference for lights with pictures: closed forms for constant ones, else Monte Carlo."""

import numpy as np
import pytest

from ltc import brdf, transform
from ltc.bezier import from_polygon
from ltc.curved_outline import form_factor
from ltc.curved_reference import curve_specular_integral_batch
from ltc.ggx_boundary import Views
from ltc.objective import Configurations, random_lights
from ltc.polygon import ltc_polygon_form_factor
from ltc.reference import specular_integral_batch
from ltc.table import load_isotropic
from ltc.textured_reference import (
    CosineLobe,
    GgxLobe,
    Lobe,
    lobe_samples,
    textured_integrals,
    textured_monte_carlo,
)

SQUARE = [from_polygon([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])]
K = 0.5522847498  # a quarter of a circle as a cubic, within 3e-4


def circle(radius: float, clockwise: bool = False) -> np.ndarray:
    """Return a contour (4, 4, 2) about the picture's middle."""
    c = np.array([[1.0, 0.0], [1.0, K], [K, 1.0], [0.0, 1.0]])
    turn = np.array([[0.0, 1.0], [-1.0, 0.0]])
    quarters = np.stack([c @ np.linalg.matrix_power(turn, k) for k in range(4)])
    contour = 0.5 + radius * quarters
    return contour[::-1, ::-1] if clockwise else contour


RING = [circle(0.5), circle(0.22, clockwise=True)]


def cases(rng: np.random.Generator, n: int) -> tuple[Configurations, np.ndarray, np.ndarray]:
    """Return lights, many of them cut by the horizon, their frames, and M^-1."""
    alpha = 10.0 ** rng.uniform(-2.0, 0.0, n)
    theta = np.radians(rng.uniform(0.0, 85.0, n))
    wo = np.stack([np.sin(theta), np.zeros(n), np.cos(theta)], axis=-1)
    lights = random_lights(rng, alpha, alpha, wo)
    p = lights.corners
    frames = np.stack([p[:, 0], p[:, 1] - p[:, 0], p[:, 3] - p[:, 0]], axis=1)
    M = load_isotropic().matrix(alpha, np.cos(theta))
    return lights, frames, transform.invert(M)


def test_constant_pictures_are_form_factors(rng: np.random.Generator) -> None:
    """Against contour integrals, polygons; at the tolerance of one panel, the default and less.

    The estimate, a sum over all panels, is never below the error.
    """
    lights, frames, inverse = cases(rng, 30)
    picture = np.full((9, 6, 1), 2.0)
    for lobe, exact in (
        (CosineLobe(inverse), ltc_polygon_form_factor(inverse, [lights.corners])),
        (CosineLobe.diffuse(30), ltc_polygon_form_factor(np.eye(3), [lights.corners])),
        (
            GgxLobe(Views(lights.wo, lights.alpha_x, lights.alpha_y)),
            specular_integral_batch(lights.corners, *views(lights), 12, 1e-10)[0],
        ),
    ):
        got = textured_integrals(picture, SQUARE, frames, lobe)
        assert np.max(np.abs(got.one - np.abs(exact))) < 1e-6
        finer = textured_integrals(picture, SQUARE, frames, lobe, 1e-9)
        off = np.abs(finer.one - np.abs(exact))
        assert np.max(off) < 2e-7  # GGX seen at 85 degrees; the estimate says as much
        assert np.median(off) < 1e-9
        assert np.all(2.0 * off <= finer.error + 1e-9)
        assert np.all(np.abs(got.value[:, 0] - 2.0 * np.abs(exact)) <= got.error + 1e-9)
        assert np.max(got.error) < 1e-3


def test_constant_pictures_with_curves_and_a_hole(rng: np.random.Generator) -> None:
    lights, frames, _ = cases(rng, 12)
    picture = np.ones((7, 5, 1))
    o, axes = frames[:, None, None, 0], frames[:, None, 1:]
    contours = [o + c @ axes for c in RING]
    got = textured_integrals(picture, RING, frames, GgxLobe(Views(*views(lights))))
    exact = curve_specular_integral_batch(contours, *views(lights))[0]
    assert got.one == pytest.approx(np.abs(exact), abs=1e-6)
    got = textured_integrals(picture, RING, frames, CosineLobe.diffuse(12))
    assert got.one == pytest.approx(np.abs(form_factor(contours)[0]), abs=1e-6)


def views(lights: Configurations) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return lights.wo, lights.alpha_x, lights.alpha_y


@pytest.mark.parametrize("outline", [SQUARE, RING], ids=["square", "ring"])
def test_pictures_against_monte_carlo(outline: list[np.ndarray], rng: np.random.Generator) -> None:
    """Two routes that share the BRDF only; of 48 deviates none beyond 4 is to be expected."""
    lights, frames, inverse = cases(rng, 8)
    picture = rng.random((5, 8, 2)) ** 3
    lobes: list[Lobe] = [CosineLobe(inverse), GgxLobe(Views(*views(lights)))]
    for lobe in lobes:
        got = textured_integrals(picture, outline, frames, lobe)
        for k in range(8):
            directions, weights = lobe_samples(lobe, k, 8000, rng)
            value, error = textured_monte_carlo(picture, outline, frames[k], directions, weights)
            assert np.all(np.abs(value - got.value[k]) < 4.0 * error + 2e-5)


def test_a_picture_is_the_sum_of_its_texels(rng: np.random.Generator) -> None:
    """Linearity, and a light far larger than its picture's rectangle goes on with the edge."""
    _, frames, inverse = cases(rng, 6)
    wide = [from_polygon([[-1.0, -2.0], [3.0, -1.0], [2.0, 2.0], [-1.5, 1.5]])]
    texels = np.eye(6).reshape(2, 3, 6)
    got = textured_integrals(texels, wide, frames, CosineLobe(inverse))
    assert np.sum(got.value, axis=1) == pytest.approx(got.one, abs=1e-12)
    picture = rng.random((2, 3, 1))
    again = textured_integrals(picture, wide, frames, CosineLobe(inverse))
    assert again.value[:, 0] == pytest.approx(got.value @ picture.ravel(), abs=1e-6)


def test_the_finer_picture_of_the_same_function(rng: np.random.Generator) -> None:
    """A picture that is linear in u and v between its outermost centres, cut to that part."""
    _, frames, inverse = cases(rng, 10)
    inner = [from_polygon([[0.25, 0.25], [0.75, 0.25], [0.75, 0.75], [0.25, 0.75]])]
    results = []
    for n in (2, 6):
        x = (np.arange(n) + 0.5) / n
        picture = (1.0 + x[:, None] + 2.0 * x)[..., None]
        results.append(textured_integrals(picture, inner, frames, CosineLobe(inverse)).value)
    assert results[0] == pytest.approx(results[1], abs=1e-6)


def test_bad_input_is_named() -> None:
    lobe = CosineLobe.diffuse(1)
    frame = np.eye(3)[None]
    with pytest.raises(ValueError, match=r"picture has shape \(2, 2\)"):
        textured_integrals(np.ones((2, 2)), SQUARE, frame, lobe)
    with pytest.raises(ValueError, match="2 frames"):
        textured_integrals(np.ones((2, 2, 1)), SQUARE, np.stack([np.eye(3)] * 2), lobe)
    with pytest.raises(ValueError, match=r"contour 0 has shape \(4, 2\)"):
        textured_integrals(np.ones((2, 2, 1)), [np.ones((4, 2))], frame, lobe)
    with pytest.raises(ValueError, match="contour 0 has a gap of 1"):
        textured_integrals(np.ones((2, 2, 1)), [SQUARE[0][:3]], frame, lobe)


def test_the_surface_sees_nothing_below() -> None:
    """A light under the horizon, one seen edge on, and a viewer below the surface."""
    below = np.array([[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    edge = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    frames = np.stack([below, edge, below * [1.0, 1.0, -1.0]])
    wo = np.array([[0.0, 0.0, 1.0]] * 2 + [[0.6, 0.0, -0.8]])
    lobe = GgxLobe(Views(wo, np.full(3, 0.3), np.full(3, 0.3)))
    assert np.all(textured_integrals(np.ones((3, 3, 1)), SQUARE, frames, lobe).value == 0.0)
    assert brdf.evaluate(wo[2], np.array([0.0, 0.0, 1.0]), 0.3, 0.3) == 0.0
