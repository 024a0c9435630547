"""Linearly transformed distributions against the supplement and quadrature."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy import stats

from ltc import polygon, transform

# The supplement's example (Heitz et al. 2016, supplement, sections 2.3 and 2.4).
M_SUPPLEMENT = np.array([[0.1, 0.5, 1.0], [0.2, 1.0, 1.0], [0.0, 2.0, 0.5]])
TRIANGLE = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 1.0, 1.0]])


def sphere_nodes(n: int, low: float = -1.0) -> tuple[np.ndarray, np.ndarray]:
    """Return directions (n, 2n, 3) with z in [low, 1], and weights: Gauss times trapezoid."""
    z, w = np.polynomial.legendre.leggauss(n)
    z, w = low + (z[:, None] + 1.0) * (1.0 - low) / 2.0, w[:, None] * (1.0 - low) / 2.0
    phi = np.arange(2 * n) * np.pi / n
    r = np.sqrt(1.0 - z * z)
    return np.stack([r * np.cos(phi), r * np.sin(phi), z + 0.0 * phi], axis=-1), w * np.pi / n


def random_matrices(rng: np.random.Generator, n: int) -> np.ndarray:
    m = rng.normal(size=(n, 3, 3))
    return m[np.abs(np.linalg.det(m)) > 0.3]


@pytest.mark.parametrize("original", transform.ORIGINALS, ids=lambda o: o.name)
def test_density_integrates_to_one(original: transform.Original, rng: np.random.Generator) -> None:
    w, weight = sphere_nodes(250)
    # The uniform hemisphere jumps across a great circle, where quadrature is of first order.
    tolerance = 2e-2 if original is transform.UNIFORM_HEMISPHERE else 2e-3
    for m in random_matrices(rng, 8):
        assert np.sum(weight * transform.evaluate(w, m, original)) == pytest.approx(
            1.0, abs=tolerance
        )


@pytest.mark.parametrize("original", transform.ORIGINALS, ids=lambda o: o.name)
def test_originals_have_their_moments(original: transform.Original) -> None:
    """Mean cosine by the density and by the sampler: 0, 1/2, 2/3, 3/4."""
    wanted = [0.0, 1.0 / 2.0, 2.0 / 3.0, 3.0 / 4.0][transform.ORIGINALS.index(original)]
    x, w = np.polynomial.legendre.leggauss(200)
    for half in (-0.5, 0.5):  # each half of [-1, 1] on its own: the densities have a kink at 0
        z = half + 0.5 * x
        assert np.all(original.density(z) >= 0.0)
    by_density = sum(
        np.sum(np.pi * w * (half + 0.5 * x) * original.density(half + 0.5 * x))
        for half in (-0.5, 0.5)
    )
    by_sampler = np.mean(original.cosine((np.arange(20_000) + 0.5) / 20_000))
    assert by_density == pytest.approx(wanted, abs=1e-12)
    assert by_sampler == pytest.approx(wanted, abs=1e-5)


@pytest.mark.parametrize("original", transform.ORIGINALS, ids=lambda o: o.name)
def test_samples_follow_the_density(original: transform.Original, rng: np.random.Generator) -> None:
    """Chi-square over equal-area cells of the sphere, with cells integrated by quadrature."""
    m = np.array([[0.9, 0.1, 0.5], [-0.2, 0.6, 0.2], [0.3, 0.1, 1.1]])
    n, n_z, n_phi, sub = 200_000, 10, 16, 24
    w = transform.sample(rng.random((n, 2)), m, original)
    z_cell = np.clip(((w[:, 2] + 1.0) / 2.0 * n_z).astype(int), 0, n_z - 1)
    phi = np.arctan2(w[:, 1], w[:, 0]) % (2.0 * np.pi)
    phi_cell = np.clip((phi / (2.0 * np.pi) * n_phi).astype(int), 0, n_phi - 1)
    counts = np.bincount(z_cell * n_phi + phi_cell, minlength=n_z * n_phi)
    z = (np.arange(n_z * sub) + 0.5) / (n_z * sub) * 2.0 - 1.0
    p = (np.arange(n_phi * sub) + 0.5) / (n_phi * sub) * 2.0 * np.pi
    r = np.sqrt(1.0 - z * z)[:, None]
    grid = np.stack([r * np.cos(p), r * np.sin(p), z[:, None] + 0.0 * p], axis=-1)
    density = transform.evaluate(grid, m, original) * 4.0 * np.pi / (z.size * p.size)
    expected = n * density.reshape(n_z, sub, n_phi, sub).sum(axis=(1, 3)).ravel()
    keep = expected > 10.0
    chi2 = np.sum((counts[keep] - expected[keep]) ** 2 / expected[keep])
    assert stats.chi2.sf(chi2, keep.sum() - 1) > 1e-3
    assert counts[~keep].sum() <= expected[~keep].sum() + 6.0 * np.sqrt(expected[~keep].sum() + 1)


def test_supplement_polygon_integral() -> None:
    """The printed 0.0059141, as the supplement's code computes it, and the exact value.

    That code sums a closed grid of 401 x 401 points with weight dx^2,
    dx = 0.0025, which is one row too many on each axis: 0.00591408, both over the transformed
    triangle and over the triangle itself. Exact, from the contour: 0.00589055.
    """

    def supplement_sum(p: np.ndarray, density: Callable[[np.ndarray], np.ndarray]) -> float:
        dx = 0.0025
        x, y = np.meshgrid(np.arange(401) * dx, np.arange(401) * dx, indexing="ij")
        hi, lo = np.maximum(x, y)[..., None], np.minimum(x, y)[..., None]
        points = (1.0 - hi) * p[0] + (hi - lo) * p[1] + lo * p[2]
        normal = np.cross(p[0] - p[1], p[0] - p[2])
        area = 0.5 * np.linalg.norm(normal)
        r = np.linalg.norm(points, axis=-1)
        w = points / r[..., None]
        cosine = np.abs(w @ (normal / np.linalg.norm(normal)))
        return float(np.sum(dx * dx * area * cosine / r**2 * density(w)))

    inverse = transform.invert(M_SUPPLEMENT)
    transformed = transform.apply(inverse, TRIANGLE)
    after = supplement_sum(transformed, lambda w: np.maximum(w[..., 2], 0.0) / np.pi)
    before = supplement_sum(TRIANGLE, lambda w: transform.evaluate(w, M_SUPPLEMENT))
    assert f"{after:.5g}" == f"{before:.5g}" == "0.0059141"

    exact = polygon.ltc_polygon_form_factor(inverse, [TRIANGLE])
    x, w = np.polynomial.legendre.leggauss(60)
    s, t = 0.5 * (x[:, None] + 1.0), 0.5 * (x + 1.0)
    points = (1.0 - s)[..., None] * TRIANGLE[0] + s[..., None] * (
        (1.0 - t)[..., None] * TRIANGLE[1] + t[..., None] * TRIANGLE[2]
    )
    r = np.linalg.norm(points, axis=-1)
    value = transform.evaluate(points / r[..., None], M_SUPPLEMENT) / r**3  # cosine 1/r, area s
    quadrature = np.sum(0.25 * w[:, None] * w * s * value)
    assert exact == pytest.approx(quadrature, rel=1e-9)
    assert f"{exact:.6g}" == "0.00589055"


def test_supplement_moments() -> None:
    """The printed moments 0.54400, 0.49160, 0.10410, and the exact ones.

    The supplement's code sums steps of 0.01 in both angles. Exactly the mean of
    the squared clamped cosine is 0.54381, 0.49160, 0.10461, by its density and by its samples.
    """
    original = transform.SQUARED_CLAMPED_COSINE
    theta, phi = np.meshgrid(np.arange(0.0, np.pi, 0.01), np.arange(0.0, 2.0 * np.pi, 0.01))
    w = np.stack([np.cos(phi) * np.sin(theta), np.sin(phi) * np.sin(theta), np.cos(theta)], axis=-1)
    density = 1e-4 * np.sin(theta) * transform.evaluate(w, M_SUPPLEMENT, original)
    printed = np.einsum("ij,ijk->k", density, w)
    assert [f"{m:.5f}" for m in printed] == ["0.54400", "0.49160", "0.10410"]

    # Before the transform the integrand is smooth: mean of M w/|M w| under the original.
    w, weight = sphere_nodes(200, low=0.0)
    mapped = transform.apply(M_SUPPLEMENT, w)
    mapped /= np.linalg.norm(mapped, axis=-1, keepdims=True)
    exact = np.einsum("ij,ijk->k", weight * original.density(w[..., 2]), mapped)
    assert [f"{m:.5f}" for m in exact] == ["0.54381", "0.49160", "0.10461"]

    n = 512  # the sampler, on a regular grid of its random numbers
    u = np.stack(np.meshgrid(*[(np.arange(n) + 0.5) / n] * 2), axis=-1)
    sampled = transform.sample(u, M_SUPPLEMENT, original).mean(axis=(0, 1))
    assert sampled == pytest.approx(exact, abs=2e-5)


def test_invert(rng: np.random.Generator) -> None:
    m = random_matrices(rng, 200) * np.array([1e-4, 1e-3, 1.0])
    product = transform.invert(m) @ m
    assert np.max(np.abs(product - np.eye(3))) < 1e-10
    sparse = np.array([[1e-4, 0.0, 0.9], [0.0, 2e-4, 0.0], [-1e-4, 0.0, 0.4]])
    assert np.all((transform.invert(sparse) == 0.0) == (sparse == 0.0))
    with pytest.raises(ValueError, match="singular"):
        transform.invert(np.zeros((3, 3)))


def test_scale_is_irrelevant(rng: np.random.Generator) -> None:
    w, _ = sphere_nodes(6)
    for m in random_matrices(rng, 5):
        for original in transform.ORIGINALS:
            assert transform.evaluate(w, 7.0 * m, original) == pytest.approx(
                transform.evaluate(w, m, original), rel=1e-12
            )


def test_leak(rng: np.random.Generator) -> None:
    """In closed form, by the polygon of a huge floor below, and by sampling."""
    m = random_matrices(rng, 60)
    m *= np.sign(np.linalg.det(m))[:, None, None]
    leak = transform.leak(m)
    assert np.all((leak >= 0.0) & (leak <= 1.0))
    floor = 1e7 * np.array([[-1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [1.0, -1.0, 0.0], [-1.0, -1.0, 0.0]])
    below = [transform.apply(inverse, floor - [0.0, 0.0, 1.0]) for inverse in transform.invert(m)]
    assert polygon.clipped_form_factor(np.array(below)) == pytest.approx(leak, abs=1e-5)
    u = rng.random((100_000, 2))
    for matrix, share in zip(m[:10], leak, strict=False):
        sampled = np.mean(transform.sample(u, matrix)[:, 2] < 0.0)
        assert abs(sampled - share) < 5.0 * np.sqrt(0.25 / len(u))


def test_bad_input() -> None:
    with pytest.raises(ValueError, match=r"shading_from_cosine has shape \(2, 3\)"):
        transform.leak(np.zeros((2, 3)))
    with pytest.raises(ValueError, match=r"w has shape \(2,\)"):
        transform.evaluate([1.0, 0.0], np.eye(3))
    with pytest.raises(ValueError, match=r"u has shape \(3,\)"):
        transform.sample([0.1, 0.2, 0.3], np.eye(3))
