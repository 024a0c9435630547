"""GGX against quadrature, sampling and closed forms."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import integrate, stats

from ltc import brdf

ALPHAS = [(0.1, 0.1), (0.5, 0.5), (1.0, 1.0), (0.05, 0.4), (0.7, 0.2)]


def direction(theta: float, phi: float = 0.0) -> np.ndarray:
    """Return the unit direction at polar angle theta and azimuth phi, radians."""
    return np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])


def hemisphere(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Return directions (n, 2n, 3) and weights (n, 1): Gauss in z, trapezoid in azimuth."""
    z, w = np.polynomial.legendre.leggauss(n)
    z, w = 0.5 * (z + 1.0)[:, None], 0.5 * w[:, None]
    phi = (np.arange(2 * n) + 0.5) * np.pi / n
    r = np.sqrt(1.0 - z * z)
    return np.stack([r * np.cos(phi), r * np.sin(phi), z + 0.0 * phi], axis=-1), w * np.pi / n


# Rounded: squares of components such as 1e-200 underflow, harmlessly but audibly.
angles = st.floats(0.0, np.radians(89.99)).map(lambda x: round(x, 9))
azimuths = st.floats(-np.pi, np.pi).map(lambda x: round(x, 9))
log_alphas = st.floats(-4.0, 0.0)
uniforms = st.floats(0.0, 1.0 - 1e-9).map(lambda x: round(x, 9))


@pytest.mark.parametrize(("ax", "ay"), ALPHAS)
def test_ndf_projects_to_one(ax: float, ay: float) -> None:
    h, w = hemisphere(400)
    assert np.sum(w * brdf.ndf(h, ax, ay) * h[..., 2]) == pytest.approx(1.0, abs=2e-4)


def test_ndf_peak_and_back() -> None:
    up = np.array([0.0, 0.0, 1.0])
    assert brdf.ndf(up, 1e-4, 1e-4) == pytest.approx(1e8 / np.pi, rel=1e-14)
    assert brdf.ndf(-up, 0.3, 0.3) == 0.0


@pytest.mark.parametrize(("ax", "ay"), ALPHAS)
@pytest.mark.parametrize("theta", [0.0, 0.6, 1.3])
def test_visible_normals_fill_the_projected_area(ax: float, ay: float, theta: float) -> None:
    """What defines G1 (Heitz 2014, eq. 14): the visible normals' area is wo_z."""
    wo = direction(theta, 0.7)
    h, w = hemisphere(400)
    area = np.sum(w * brdf.ndf(h, ax, ay) * np.maximum(h @ wo, 0.0))
    assert brdf.smith_g1(wo, ax, ay) * area == pytest.approx(wo[2], abs=3e-4)


def test_lambda_keeps_its_digits_at_small_alpha() -> None:
    """Lambda -> alpha^2 tan^2 / 4; the textbook form returns 0 there."""
    wo = direction(0.5)
    expected = 1e-8 * np.tan(0.5) ** 2 / 4.0
    assert brdf.smith_lambda(wo, 1e-4, 1e-4) == pytest.approx(expected, rel=1e-7)
    assert brdf.smith_lambda(-wo, 0.1, 0.1) == np.inf
    assert brdf.smith_g1(-wo, 0.1, 0.1) == 0.0


@given(angles, azimuths, angles, azimuths, log_alphas, log_alphas)
def test_reciprocity_and_smith(
    to: float, po: float, ti: float, pi: float, log_x: float, log_y: float
) -> None:
    wo, wi, ax, ay = direction(to, po), direction(ti, pi), 10.0**log_x, 10.0**log_y
    f, back = brdf.evaluate(wo, wi, ax, ay), brdf.evaluate(wi, wo, ax, ay)
    assert f >= 0.0
    assert f * wo[2] == pytest.approx(back * wi[2], rel=1e-9)
    # Against the textbook form, D G2 / (4 wo_z).
    g2 = brdf.smith_g2(wo, wi, ax, ay)
    sum_of_lambdas = brdf.smith_lambda(wo, ax, ay) + brdf.smith_lambda(wi, ax, ay)
    assert g2 == pytest.approx(1.0 / (1.0 + sum_of_lambdas), rel=1e-12)
    d = brdf.ndf(brdf.half_vector(wo, wi), ax, ay)
    assert f == pytest.approx(d * g2 / (4.0 * wo[2]), rel=1e-11)
    ratio = g2 / brdf.smith_g1(wo, ax, ay)
    assert f == pytest.approx(brdf.pdf(wo, wi, ax, ay) * ratio, rel=1e-11)
    assert ratio <= 1.0 + 1e-15


def test_nothing_below_the_surface(rng: np.random.Generator) -> None:
    w = rng.normal(size=(500, 3))
    w /= np.linalg.norm(w, axis=-1, keepdims=True)
    wo = w[:, None]
    below = (wo[..., 2] <= 0.0) | (w[:, 2] <= 0.0)
    f = brdf.evaluate(wo, w, 0.3, 0.1)
    p = brdf.pdf(wo, w, 0.3, 0.1)
    assert np.all(f[below] == 0.0) and np.all(f[~below] > 0.0)
    assert np.all(p[below] == 0.0) and np.all(p[~below] > 0.0)


def test_schlick() -> None:
    c = np.array([0.0, 0.5, 1.0])
    assert brdf.schlick_fresnel(c, 0.04) == pytest.approx([1.0, 0.04 + 0.96 / 32.0, 0.04])
    assert np.all(brdf.schlick_fresnel(c, 1.0) == 1.0)


@pytest.mark.parametrize(("ax", "ay", "theta"), [(0.3, 0.3, 0.5), (0.1, 0.6, 1.2), (1.0, 0.4, 1.5)])
def test_samples_follow_the_pdf(
    ax: float, ay: float, theta: float, rng: np.random.Generator
) -> None:
    """Chi-square over equal-area cells of the hemisphere of reflected directions."""
    wo, n, n_z, n_phi, sub = direction(theta, 0.4), 200_000, 8, 12, 60
    wi = brdf.reflect(wo, brdf.sample_visible_normals(wo, rng.random((n, 2)), ax, ay))
    above = wi[wi[:, 2] > 0.0]
    phi = np.arctan2(above[:, 1], above[:, 0]) % (2.0 * np.pi)
    cell = np.minimum((above[:, 2] * n_z).astype(int), n_z - 1) * n_phi
    cell += np.minimum((phi / (2.0 * np.pi) * n_phi).astype(int), n_phi - 1)
    counts = np.append(np.bincount(cell, minlength=n_z * n_phi), n - len(above))
    x, w = np.polynomial.legendre.leggauss(sub)
    z = ((np.arange(n_z)[:, None] + 0.5 * (x + 1.0)) / n_z).ravel()
    p = ((np.arange(n_phi)[:, None] + 0.5 * (x + 1.0)) / n_phi).ravel() * 2.0 * np.pi
    r = np.sqrt(1.0 - z * z)[:, None]
    grid = np.stack([r * np.cos(p), r * np.sin(p), z[:, None] + 0.0 * p], axis=-1)
    density = brdf.pdf(wo, grid, ax, ay) * np.tile(w, n_z)[:, None] * np.tile(w, n_phi)
    share = density.reshape(n_z, sub, n_phi, sub).sum(axis=(1, 3)).ravel()
    share *= 2.0 * np.pi / (4.0 * n_z * n_phi)
    expected = n * np.append(share, 1.0 - share.sum())
    keep = expected > 10.0
    chi2 = np.sum((counts[keep] - expected[keep]) ** 2 / expected[keep])
    assert stats.chi2.sf(chi2, keep.sum() - 1) > 1e-3


@given(angles, azimuths, log_alphas, log_alphas, uniforms, uniforms)
def test_sampled_normals_are_visible(
    theta: float, phi: float, log_x: float, log_y: float, u0: float, u1: float
) -> None:
    wo = direction(theta, phi)
    h = brdf.sample_visible_normals(wo, [u0, u1], 10.0**log_x, 10.0**log_y)
    assert np.linalg.norm(h) == pytest.approx(1.0, abs=1e-12)
    assert h[2] >= 0.0
    assert h @ wo >= -1e-12


def test_albedo_closed_form() -> None:
    """At alpha = 1 and normal incidence the albedo is 1 - log 2."""
    a, _ = brdf.directional_albedo([0.0, 0.0, 1.0], 1.0, 1.0)
    assert a == pytest.approx(1.0 - np.log(2.0), abs=1e-13)


@pytest.mark.parametrize(("ax", "ay"), [(0.2, 0.2), (0.5, 0.5), (1.0, 1.0), (0.3, 0.8)])
@pytest.mark.parametrize("theta", [0.0, 0.8, 1.4])
def test_albedo_against_the_hemisphere(ax: float, ay: float, theta: float) -> None:
    """Adaptive quadrature of the BRDF itself over directions, another space altogether."""
    wo = direction(theta, 0.3)

    def ring(z: float, f0: float) -> float:
        phi = (np.arange(600) + 0.5) * np.pi / 300.0
        r = np.sqrt(1.0 - z * z)
        wi = np.stack([r * np.cos(phi), r * np.sin(phi), np.full(600, z)], axis=-1)
        return float(np.mean(brdf.evaluate(wo, wi, ax, ay, f0)) * 2.0 * np.pi)

    a, b = brdf.directional_albedo(wo, ax, ay)
    for f0, wanted in ((1.0, a), (0.0, b)):
        got, _ = integrate.quad(ring, 0.0, 1.0, args=(f0,), epsabs=1e-8, epsrel=0.0, limit=200)
        assert got == pytest.approx(float(wanted), abs=3e-8)


@pytest.mark.parametrize(
    ("ax", "ay", "degrees"),
    [(1e-4, 1e-4, 89.99), (1e-3, 1e-3, 89.0), (0.05, 0.4, 80.0), (0.4, 1e-3, 89.9)],
)
def test_albedo_against_sampling(
    ax: float, ay: float, degrees: float, rng: np.random.Generator
) -> None:
    """The mean of G2/G1 over sampled visible normals, within 5 standard errors."""
    wo, n = direction(np.radians(degrees), 0.9), 300_000
    h = brdf.sample_visible_normals(wo, rng.random((n, 2)), ax, ay)
    wi = brdf.reflect(wo, h)
    weight = brdf.smith_g2(wo, wi, ax, ay) / brdf.smith_g1(wo, ax, ay)
    fresnel = weight * brdf.schlick_fresnel(h @ wo, 0.0)
    for sample, exact in zip((weight, fresnel), brdf.directional_albedo(wo, ax, ay), strict=True):
        assert abs(np.mean(sample) - exact) < 5.0 * np.std(sample) / np.sqrt(n)


def test_albedo_converges_everywhere(rng: np.random.Generator) -> None:
    """The default step against a third of it, from alpha 1e-4 and to 89.99 degrees."""
    n = 60
    ax, ay = 10.0 ** rng.uniform(-4.0, 0.0, (2, n))
    ax[: n // 2] = ay[: n // 2]
    theta = np.radians(90.0 - 10.0 ** rng.uniform(-2.0, np.log10(90.0), n))
    wo = np.stack([direction(t, p) for t, p in zip(theta, rng.uniform(0, 6, n), strict=True)])
    coarse = np.array(brdf.directional_albedo(wo, ax, ay))
    fine = np.array(brdf.directional_albedo(wo, ax, ay, step=0.035))
    assert np.max(np.abs(coarse - fine)) < 2e-8
    a, b = fine
    assert np.all((b >= 0.0) & (b <= a) & (a <= 1.0 + 1e-12))


def test_albedo_ignores_the_azimuth_of_isotropic_views() -> None:
    views = np.stack([direction(1.3, p) for p in (0.0, 0.5, 1.5, 3.0)])
    a, b = brdf.directional_albedo(views, 0.15, 0.15)
    assert np.ptp(a) < 1e-9 and np.ptp(b) < 1e-9


def test_shapes() -> None:
    wo = np.tile([0.0, 0.0, 1.0], (4, 1, 1))
    a, b = brdf.directional_albedo(wo, np.full(3, 0.5), 0.5)
    assert a.shape == b.shape == (4, 3)
    assert brdf.evaluate(wo, wo, np.full(3, 0.5), 0.5).shape == (4, 3)
    assert brdf.directional_albedo(np.zeros((0, 3)), 0.5, 0.5)[0].shape == (0,)


def test_bad_input() -> None:
    up = [0.0, 0.0, 1.0]
    with pytest.raises(ValueError, match=r"wo has shape \(2,\)"):
        brdf.evaluate([0.0, 1.0], up, 0.1, 0.1)
    with pytest.raises(ValueError, match="alpha_y is 0"):
        brdf.ndf(up, 0.1, 0.0)
    with pytest.raises(ValueError, match=r"u has shape \(3,\)"):
        brdf.sample_visible_normals(up, up, 0.1, 0.1)
    with pytest.raises(ValueError, match="in or below the surface"):
        brdf.directional_albedo([1.0, 0.0, 0.0], 0.1, 0.1)
