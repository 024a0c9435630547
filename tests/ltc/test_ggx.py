"""The technique ``ggx``: its closed forms against quadrature, its weight against the truth."""

import numpy as np
import pytest
from scipy.integrate import quad_vec

from ltc import brdf, ggx, reference
from ltc.polygon import loops_form_factor

SQUARE = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


def unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def views(rng: np.random.Generator, n: int, limit: float = 89.0) -> np.ndarray:
    t, p = np.radians(rng.uniform(0.0, limit, n)), rng.uniform(0.0, 2.0 * np.pi, n)
    return np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], axis=-1)


def alphas(rng: np.random.Generator, n: int, least: float, isotropic: bool) -> list[np.ndarray]:
    ax, ay = np.exp(rng.uniform(np.log(least), 0.0, (2, n)))
    return [ax, ax if isotropic else ay]


def placed(rng: np.random.Generator, outline: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """Return (n, k, 3): the outline scaled and turned, most near the mirror direction,
    about half through the horizon, counter-clockwise about +z."""
    n = len(wo)
    c = -wo * [1.0, 1.0, -1.0] + rng.normal(size=(n, 3)) * rng.uniform(0.0, 0.5, (n, 1))
    elsewhere = rng.normal(size=(n, 3))
    elsewhere[:, 2] = np.abs(elsewhere[:, 2]) - 0.1
    c = unit(np.where(rng.uniform(size=(n, 1)) < 0.6, c, elsewhere))
    u = unit(rng.normal(size=(n, 3)))
    v = unit(np.cross(u, rng.normal(size=(n, 3))))
    v *= np.where(np.sum(np.cross(u, v) * c, axis=-1) < 0.0, -1.0, 1.0)[:, None]
    size = np.exp(rng.uniform(np.log(0.1), np.log(2.0), (n, 2, 1, 1)))
    s, t = outline[:, :1], outline[:, 1:]
    return c[:, None] + s * size[:, 0] * u[:, None] + t * size[:, 1] * v[:, None]


def star(n: int) -> np.ndarray:
    r = np.where(np.arange(2 * n) % 2 == 0, 1.0, 0.4)
    t = np.arange(2 * n) * np.pi / n
    return np.stack([r * np.cos(t), r * np.sin(t)], axis=-1)


def by_quadrature(
    p: np.ndarray, q: np.ndarray, v: np.ndarray, ax: float, ay: float
) -> tuple[np.ndarray, float]:
    """Return an edge's integral by adaptive quadrature over its angle, and an estimate of error."""
    p, S = unit(p), np.array([1.0 / ax, 1.0 / ay, 1.0])
    normal = np.cross(p, q)
    across = np.cross(unit(normal), p)
    angle = np.arctan2(np.linalg.norm(normal), p @ q)

    def integrand(t: float) -> np.ndarray:
        h = S * (v + p * np.cos(t) + across * np.sin(t))
        dh = S * (across * np.cos(t) - p * np.sin(t))
        return np.cross(h, dh) / (h @ h)

    # Peaks are where the edge passes the mirror direction and where v + o is short.
    special = [np.arctan2(across @ w, p @ w) for w in (-v * [1.0, 1.0, -1.0], -v)]
    points = [t for t in special if 0.0 < t < angle]
    value, error = quad_vec(integrand, 0.0, angle, epsabs=1e-11, epsrel=0.0, points=points)
    return value, float(error)


@pytest.mark.parametrize("least, bound", [(0.05, 1e-10), (1e-4, 1e-9)])
def test_edge_against_quadrature(rng: np.random.Generator, least: float, bound: float) -> None:
    n = 60
    wo, (ax, ay) = views(rng, n, 89.9), alphas(rng, n, least, isotropic=False)
    ax[::3] = ay[::3]
    p, q = rng.normal(size=(2, n, 3))
    p[:, 2], q[:, 2] = np.abs(p[:, 2]), np.abs(q[:, 2])
    q[::5] = -p[::5] * [1.0, 1.0, -0.01] + 0.05 * rng.normal(size=(12, 3))  # nearly a half circle
    q[:, 2] = np.abs(q[:, 2])
    got = ggx.edge_integral(p, q, wo, ax, ay)
    for i in range(n):
        value, error = by_quadrature(p[i], q[i], wo[i], ax[i], ay[i])
        if error < 0.1 * bound:
            np.testing.assert_allclose(got[i], value, rtol=0.0, atol=bound)


def test_edges_that_degenerate(rng: np.random.Generator) -> None:
    """b1 = b2, k = 0, alpha = 1, a view along the normal, an edge in the horizon, no edge."""
    z = np.array([0.0, 0.0, 1.0])
    v = unit(np.array([0.3, -0.2, 0.8]))
    a, b, c = np.array([1.0, 0.2, 0.4]), np.array([-0.3, 1.0, 0.7]), np.array([0.2, 0.1, 0.9])
    cases = [
        (a, b, z, 1.0, 1.0),
        (a, b, z, 1e-3, 1e-3),
        (a, b, v, 1.0, 1.0),
        (np.array([0.4, 0.0, 1.0]), np.array([0.0, 0.4, 1.0]), z, 0.1, 0.1),
        (a, 0.5 * a + v, v, 0.2, 0.7),  # in a plane with the view: k = 0 up to rounding
        (np.array([1.0, 0.0, 0.5]), np.array([-1.0, 0.0, 0.2]), z, 0.3, 0.3),  # exactly 0
        (np.array([1.0, 0.0, 0.5]), np.array([0.2, 0.0, 0.2]), z, 0.01, 1.0),
        (np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]), v, 0.3, 0.05),  # n = z
        (np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]), z, 0.3, 0.3),  # n = v = z
        (a, a + 1e-9 * c, v, 0.3, 0.1),
    ]
    for p, q, view, ax, ay in cases:
        value, error = by_quadrature(p, q, view, ax, ay)
        assert error < 1e-10
        got = ggx.edge_integral(p, q, view, ax, ay)
        np.testing.assert_allclose(got, value, rtol=1e-7, atol=2e-10)
        back = ggx.edge_integral(q, p, view, ax, ay)
        np.testing.assert_allclose(back, -got, rtol=1e-6, atol=1e-12)
    assert not ggx.edge_integral(a, a, v, 0.3, 0.1).any()
    assert not ggx.edge_integral(a, 2.0 * a, v, 0.3, 0.1).any()


def test_edges_add_up(rng: np.random.Generator) -> None:
    n = 2000
    wo, (ax, ay) = views(rng, n, 89.9), alphas(rng, n, 1e-4, isotropic=False)
    p, q = rng.normal(size=(2, n, 3))
    p[:, 2], q[:, 2] = np.abs(p[:, 2]), np.abs(q[:, 2])
    middle = p + rng.uniform(0.0, 1.0, (n, 1)) * (q - p)
    whole = ggx.edge_integral(p, q, wo, ax, ay)
    parts = ggx.edge_integral(p, middle, wo, ax, ay) + ggx.edge_integral(middle, q, wo, ax, ay)
    np.testing.assert_allclose(parts, whole, rtol=0.0, atol=1e-9)
    scaled = ggx.edge_integral(7.0 * p, 0.01 * q, wo, ax, ay)
    np.testing.assert_allclose(scaled, whole, rtol=0.0, atol=1e-9)
    # Tangent and bitangent change places.
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    turned = ggx.edge_integral(p @ turn.T, q @ turn.T, wo @ turn.T, ay, ax)
    np.testing.assert_allclose(turned, whole @ turn.T, rtol=0.0, atol=1e-9)


def test_share_against_the_area(rng: np.random.Generator) -> None:
    """The visible-normal density summed over the light's own area: another space, no contour."""
    n, cells = 40, 64
    wo, (ax, ay) = views(rng, n, 80.0), np.exp(rng.uniform(np.log(0.2), 0.0, (2, n)))
    p = placed(rng, SQUARE, wo)
    got = ggx.visible_normal_share([p], wo, ax, ay)
    x, w = np.polynomial.legendre.leggauss(cells)
    s, w = 0.5 * (x + 1.0), 0.5 * w
    compared = 0
    for i in range(n):
        if p[i, :, 2].min() < 0.0:
            continue  # a kink at the horizon, too much for these nodes
        u, v = p[i, 1] - p[i, 0], p[i, 3] - p[i, 0]
        r = p[i, 0] + s[:, None, None] * u + s[:, None] * v
        distance = np.linalg.norm(r, axis=-1)
        element = r @ np.cross(u, v) / distance**3
        density = brdf.pdf(wo[i], r / distance[..., None], ax[i], ay[i])
        want = float(np.sum(density * element * w * w[:, None]))
        if distance.min() > 0.3:
            assert got[i] == pytest.approx(want, abs=2e-6)
            compared += 1
    assert compared > 10


def test_share_against_samples(rng: np.random.Generator) -> None:
    """The share of sampled visible normals that reflect the viewer into the light; a z-test."""
    count = 40_000
    scores = []
    for index in range(60):
        wo, (ax, ay) = views(rng, 1), alphas(rng, 1, 1e-3, isotropic=index % 2 == 0)
        loop = placed(rng, star(5), wo)[0]
        F = float(ggx.visible_normal_share([loop], wo[0], ax[0], ay[0]))
        h = brdf.sample_visible_normals(wo, rng.uniform(size=(count, 2)), ax, ay)
        wi = brdf.reflect(wo, h)
        hits = reference.winding_number([loop], wi) * (wi[:, 2] > 0.0)
        deviation = np.sqrt(max(F * (1.0 - F), 1.0 / count) / count)
        scores.append((float(np.mean(hits)) - F) / deviation)
    assert np.max(np.abs(scores)) < 4.5
    assert abs(np.mean(scores)) * np.sqrt(60) < 4.0


def test_share_of_the_whole_sky(rng: np.random.Generator) -> None:
    """A ceiling 1e8 times as wide as high: what is left falls below the surface."""
    wo, (ax, ay) = views(rng, 20), alphas(rng, 20, 0.05, isotropic=False)
    ceiling = np.column_stack([1e8 * SQUARE, np.ones(4)])
    got = ggx.visible_normal_share([ceiling], wo, ax, ay)
    axes, b = brdf.horizon_cone(wo, ax, ay)
    rim = np.linspace(0.0, 2.0 * np.pi, 40_001)[:-1]
    for i in range(20):
        A, B = np.sqrt(b[i, 2] / b[i, 0]), np.sqrt(b[i, 2] / b[i, 1])
        u = unit(np.stack([A * np.cos(rim), B * np.sin(rim), np.ones(rim.shape)], axis=-1))
        u = u @ axes[i].T
        vector = np.sum(np.cross(u, np.roll(u, -1, axis=0)), axis=0)
        v = unit(wo[i] * [ax[i], ay[i], 1.0])
        want = vector @ v / (np.pi * (1.0 + v[2]))
        assert got[i] == pytest.approx(want, abs=5e-5)


def test_loops_rotate_divide_and_wind(rng: np.random.Generator) -> None:
    n = 200
    wo, (ax, ay) = views(rng, n), alphas(rng, n, 1e-3, isotropic=False)
    p = placed(rng, star(5), wo)
    whole = ggx.visible_normal_share([p], wo, ax, ay)
    assert np.all(whole >= -1e-12)
    assert np.all(whole <= 1.0)
    assert np.count_nonzero(whole > 1e-3) > 50
    np.testing.assert_allclose(
        ggx.visible_normal_share([p[:, ::-1]], wo, ax, ay), -whole, rtol=0.0, atol=1e-11
    )
    divided = np.stack([p, 0.5 * (p + np.roll(p, -1, axis=1))], axis=2).reshape(n, -1, 3)
    np.testing.assert_allclose(
        ggx.visible_normal_share([divided], wo, ax, ay), whole, rtol=0.0, atol=1e-11
    )
    # A hole and the light that fits into it; tips apart from the middle.
    inner = p.mean(axis=1, keepdims=True) + 0.3 * (p - p.mean(axis=1, keepdims=True))
    ring = ggx.visible_normal_share([p, inner[:, ::-1]], wo, ax, ay)
    plug = ggx.visible_normal_share([inner], wo, ax, ay)
    np.testing.assert_allclose(ring + plug, whole, rtol=0.0, atol=1e-11)
    for nodes in (1, 2, 3, 4):
        one, fresnel = ggx.ggx_specular([p], wo, ax, ay, nodes)
        assert np.all(np.abs(one) <= np.abs(whole) + 1e-15)
        assert np.all(np.abs(fresnel) <= np.abs(one) + 1e-3)
        other = ggx.ggx_specular([p[:, ::-1]], wo, ax, ay, nodes)
        # Panels start at an edge's start: reversed, the nodes lie a little elsewhere.
        np.testing.assert_allclose(other[0], -one, rtol=0.0, atol=1e-3)
    scalar = ggx.ggx_specular([p[3]], wo[3], ax[3], ay[3])
    batch = ggx.ggx_specular([p], wo, ax, ay)
    assert scalar[0] == pytest.approx(batch[0][3], rel=1e-12)
    assert scalar[1] == pytest.approx(batch[1][3], rel=1e-12)


def test_nothing_from_below(rng: np.random.Generator) -> None:
    n = 100
    wo, (ax, ay) = views(rng, n, 89.9), alphas(rng, n, 1e-3, isotropic=False)
    p = placed(rng, SQUARE, wo)
    p[..., 2] -= p[..., 2].max(axis=-1)[:, None]
    for result in (ggx.visible_normal_share([p], wo, ax, ay), *ggx.ggx_specular([p], wo, ax, ay)):
        assert not result.any()
    up = np.array([0.0, 0.0, 1.0])
    below = unit(np.array([0.5, 0.0, -0.1]))
    light = np.column_stack([SQUARE, np.ones(4)])
    assert ggx.ggx_specular([light], below, 0.3, 0.3) == (0.0, 0.0)
    assert ggx.ggx_specular([], up, 0.3, 0.3) == (0.0, 0.0)
    # Alpha 1: GGX's visible normals along the normal; in the limit of alpha 0 a mirror.
    assert ggx.visible_normal_share([light], up, 1e-4, 1e-4) == pytest.approx(1.0, abs=1e-6)


def test_a_light_moves_through_the_horizon_smoothly() -> None:
    wo = unit(np.array([0.8, 0.1, 0.4]))
    height = np.linspace(-1.2, 1.2, 2401)
    p = np.stack([np.full(4, -2.0), SQUARE[:, 0], SQUARE[:, 1]], axis=-1)
    p = p + height[:, None, None] * [0.0, 0.0, 1.0]
    p = p if loops_form_factor([p])[-1] > 0 else p[:, ::-1]
    for nodes in (2, 3):
        one, _ = ggx.ggx_specular([p], wo, 0.3, 0.1, nodes)
        assert np.all(one[height < -1.0] == 0.0)
        assert np.max(np.abs(np.diff(one))) < 2e-3
        assert one[-1] > 0.3


def test_continuity_over_degenerate_frames() -> None:
    """Views through the normal and alphas through equality, where the axes spin."""
    light = np.column_stack([star(5) * 0.7 + [0.2, 0.1], np.ones(10)])
    t = np.linspace(-1e-3, 1e-3, 401)
    wo = unit(np.stack([t, 0.3 * t, np.ones(t.shape)], axis=-1))
    one, _ = ggx.ggx_specular([light], wo, 0.2, 0.2)
    assert np.max(np.abs(np.diff(one, 2))) < 1e-9
    up = np.array([0.0, 0.0, 1.0])
    one, _ = ggx.ggx_specular([light], up, 0.2 * (1.0 + t), 0.2)
    assert np.max(np.abs(np.diff(one, 2))) < 1e-9


# Mean, 99th percentile, largest.
LIMITS = {2: (0.0006, 0.009, 0.02), 4: (0.0003, 0.004, 0.01)}


@pytest.mark.parametrize("isotropic", [True, False])
@pytest.mark.parametrize("nodes", [2, 4])
@pytest.mark.parametrize("outline", [SQUARE, star(5)], ids=["rectangle", "star"])
def test_specular_against_the_truth(
    rng: np.random.Generator, outline: np.ndarray, nodes: int, isotropic: bool
) -> None:
    n = 600
    wo, (ax, ay) = views(rng, n), alphas(rng, n, 1e-3, isotropic)
    p = placed(rng, outline, wo)
    crossing = (p[..., 2].min(axis=1) < 0.0) & (p[..., 2].max(axis=1) > 0.0)
    assert np.mean(crossing) > 0.3
    truth = reference.specular_integral_batch(p, wo, ax, ay)
    got = ggx.ggx_specular([p], wo, ax, ay, nodes)
    mean, p99, largest = LIMITS[nodes]
    f04 = [0.04 * (one - fresnel) + fresnel for one, fresnel in (got, truth)]
    for a, b in ((got[0], truth[0]), f04):
        error = np.abs(a - b)
        assert np.mean(error) <= mean
        assert np.quantile(error, 0.99) <= p99
        assert error.max() <= largest
    bright = truth[0] > 0.05 * truth[0].max()
    assert np.median(np.abs(got[0][bright] / truth[0][bright] - 1.0)) <= 0.003


@pytest.mark.parametrize("nodes", [2, 4])
def test_holes_and_concave_outlines_against_the_truth(rng: np.random.Generator, nodes: int) -> None:
    """A ring, whose fan has its centre in the hole, and an L."""
    t = np.arange(16) * np.pi / 8.0
    circle = np.stack([np.cos(t), np.sin(t)], axis=-1)
    angle = np.array([[-1, -1], [1, -1], [1, -0.5], [-0.4, -0.5], [-0.4, 1], [-1, 1]], dtype=float)
    n = 300
    wo, (ax, ay) = views(rng, n), alphas(rng, n, 1e-3, isotropic=False)
    for outline in ([circle, 0.6 * circle[::-1]], [angle]):
        state = rng.bit_generator.state
        loops = []
        for loop in outline:
            rng.bit_generator.state = state  # both in one plane
            loops.append(placed(rng, loop, wo))
        parts = [reference.specular_integral_batch(loop, wo, ax, ay)[0] for loop in loops]
        got, _ = ggx.ggx_specular(loops, wo, ax, ay, nodes)
        error = np.abs(got - sum(parts))
        mean, p99, largest = LIMITS[nodes]
        assert np.mean(error) <= mean
        assert np.quantile(error, 0.99) <= p99
        assert error.max() <= largest


def test_mirror_like_lobes_are_exact(rng: np.random.Generator) -> None:
    n = 100
    wo = views(rng, n, 80.0)
    p = placed(rng, SQUARE, wo)
    alpha = np.full(n, 1e-3)
    truth, _ = reference.specular_integral_batch(p, wo, alpha, alpha)
    got, _ = ggx.ggx_specular([p], wo, alpha, alpha)
    assert np.mean(np.abs(got - truth)) < 1e-5


def test_bad_input() -> None:
    p, up = np.column_stack([SQUARE, np.ones(4)]), np.array([0.0, 0.0, 1.0])
    with pytest.raises(ValueError, match="expected positive"):
        ggx.visible_normal_share([p], up, 0.0, 0.5)
    with pytest.raises(ValueError, match=r"expected \(\.\.\., 3\)"):
        ggx.edge_integral(p[0], p[1], np.zeros(2), 0.5, 0.5)
    with pytest.raises(ValueError, match="nodes is 5"):
        ggx.ggx_specular([p], up, 0.5, 0.5, nodes=5)
