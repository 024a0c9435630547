"""GGX along curves against fine polygons, cubics that are polygons, and sampling."""

import numpy as np
import pytest

from ltc import bezier, brdf, curved_reference, reference
from tests.ltc.test_curved_outline import (
    RING,
    SHAPES,
    SQUARE,
    circle,
    lit,
    place,
    placed,
    random_outline,
)


def direction(theta: float, phi: float = 0.0) -> np.ndarray:
    return np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])


def ggx_case(
    shape: tuple[np.ndarray, ...], rng: np.random.Generator, isotropic: bool
) -> tuple[list[np.ndarray], np.ndarray, float, float]:
    """Return (contours, view, alphas), the light about the mirror direction."""
    ax, ay = 10.0 ** rng.uniform(-3.0, 0.0, 2)
    wo = direction(np.radians(rng.uniform(0.0, 89.0)), rng.uniform(0.0, 6.0))
    contours = lit(shape, wo[None] * [-1.0, -1.0, 1.0], rng)
    return [p[0] for p in contours], wo, ax, ax if isotropic else ay


@pytest.mark.parametrize("isotropic", [True, False])
def test_exact_ggx_of_a_fine_polygon(isotropic: bool, rng: np.random.Generator) -> None:
    """Along curves against polygons of 128 and 256 edges, extrapolated."""
    for k in range(7):
        shape = [*SHAPES.values(), (random_outline(rng, 3),)][k % 7]
        contours, wo, ax, ay = ggx_case(shape, rng, isotropic)
        got = curved_reference.curve_specular_integral(contours, wo, ax, ay)
        assert got.error < 1e-7
        fine = curved_reference.curve_specular_integral_batch(contours, wo, ax, ay, 24, 1e-12)
        assert abs(fine[0] - got.one) <= got.error
        batch = curved_reference.curve_specular_integral_batch(contours, wo, ax, ay)
        np.testing.assert_allclose(batch, [got.one, got.fresnel], atol=1e-7)
        count = sum(len(p) for p in shape)
        coarse, fine = (
            reference.specular_integral(
                [bezier.flatten(p, n // count) for p in contours], wo, ax, ay
            )
            for n in (128, 256)
        )
        change = abs(fine.one - coarse.one)
        assert got.one == pytest.approx(
            fine.one + (fine.one - coarse.one) / 3.0, abs=0.3 * change + 1e-8
        )
        assert got.fresnel == pytest.approx(fine.fresnel, abs=change + 1e-8)


def test_exact_ggx_of_polygons_as_cubics(rng: np.random.Generator) -> None:
    for _ in range(12):
        contours, wo, ax, ay = ggx_case((bezier.from_polygon(SQUARE),), rng, False)
        expected = reference.specular_integral([contours[0][:, 0]], wo, ax, ay)
        got = curved_reference.curve_specular_integral(contours, wo, ax, ay)
        assert got.one == pytest.approx(expected.one, abs=got.error + expected.error)
        assert got.fresnel == pytest.approx(expected.fresnel, abs=1e-8)


def test_exact_ggx_against_sampling(rng: np.random.Generator) -> None:
    z = []
    for k in range(18):
        shape = [*SHAPES.values(), (random_outline(rng, 3),)][k % 7]
        contours, wo, ax, ay = ggx_case(shape, rng, k % 2 == 0)
        exact = curved_reference.curve_specular_integral(contours, wo, ax, ay)
        sampled = curved_reference.curve_specular_monte_carlo(contours, wo, ax, ay, 3000, rng)
        if sampled.error > 1e-3:
            z.append((sampled.one - exact.one) / sampled.error)
        else:  # too few hits or misses for a normal distribution
            assert sampled.one == pytest.approx(exact.one, abs=5e-3)
    assert len(z) > 7
    assert np.max(np.abs(z)) < 4.0
    assert abs(np.mean(z)) < 3.5 / np.sqrt(len(z))


def test_exact_ggx_of_several_lights_at_once(rng: np.random.Generator) -> None:
    cases = [ggx_case(RING, rng, False) for _ in range(5)]
    stacked = [np.stack([case[0][j] for case in cases]) for j in range(3)]
    wo, ax, ay = (np.array([case[j] for case in cases]) for j in (1, 2, 3))
    together = curved_reference.curve_specular_integral_batch(stacked, wo, ax, ay, chunk=2)
    alone = [curved_reference.curve_specular_integral(*case) for case in cases]
    np.testing.assert_allclose(together[0], [a.one for a in alone], atol=1e-7)
    np.testing.assert_allclose(together[1], [a.fresnel for a in alone], atol=1e-7)
    sky = place(1e6 * circle(), [0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    full = curved_reference.curve_specular_integral([sky], wo[0], 0.3, 0.2).one
    assert full == pytest.approx(float(brdf.directional_albedo(wo[0], 0.3, 0.2)[0]), abs=1e-5)
    assert curved_reference.curve_specular_integral([sky], -wo[0], 0.3, 0.2).one == 0.0
    assert curved_reference.curve_specular_integral([], wo[0], 0.3, 0.2).one == 0.0


def test_winding_number_of_curves(rng: np.random.Generator) -> None:
    w = rng.normal(size=(2000, 3))
    for shape in (RING, (random_outline(rng, 4),), SHAPES["square"]):
        contours = [p[0] for p in placed(shape, rng, 1)]
        got = curved_reference.curve_winding_number(contours, w)
        expected = reference.winding_number([bezier.flatten(p, 400) for p in contours], w)
        # Directions between the curves and their chords, 1e-5 apart, may differ.
        assert np.mean(got != expected) < 1e-3
