"""The reference integrators against each other, closed forms and invariants."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ltc import brdf, polygon, reference

SQUARE = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


def direction(theta: float, phi: float = 0.0) -> np.ndarray:
    """Return the unit direction at polar angle theta and azimuth phi, radians."""
    return np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])


def place(outline: np.ndarray, c: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Return (k, 3) corners of a plane outline (k, 2)."""
    return c + outline[:, :1] * u + outline[:, 1:] * v


def configurations(
    rng: np.random.Generator, n: int, log_alpha: float, degrees: float, isotropic: bool
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return rectangles (n, 4, 3), views and alphas; most lie near the mirror direction.

    Centres are 0.3 to 3 away, half sides 0.1 to 5, any orientation, so that many cross the
    horizon and some surround the point; each is wound to be positive.
    """
    ax, ay = 10.0 ** rng.uniform(log_alpha, 0.0, (2, n))
    if isotropic:
        ay = ax
    theta, phi = np.radians(rng.uniform(0.0, degrees, n)), rng.uniform(0.0, 2.0 * np.pi, n)
    wo = np.stack([direction(t, p) for t, p in zip(theta, phi, strict=True)])
    c, u, v = rng.normal(size=(3, n, 3))
    near = rng.random(n) < 0.7
    c = np.where(near[:, None], wo * [-1.0, -1.0, 1.0] + 0.3 * c, c)
    c *= 10.0 ** rng.uniform(-0.5, 0.5, (n, 1)) / np.linalg.norm(c, axis=-1, keepdims=True)
    u /= np.linalg.norm(u, axis=-1, keepdims=True)
    v -= u * np.sum(u * v, axis=-1, keepdims=True)
    v /= np.linalg.norm(v, axis=-1, keepdims=True)
    v[np.sum(np.cross(u, v) * c, axis=-1) < 0.0] *= -1.0
    size = 10.0 ** rng.uniform(-1.0, 0.7, (n, 2, 1))
    corners = [place(SQUARE * size[i].T, c[i], u[i], v[i]) for i in range(n)]
    return np.stack(corners), wo, ax, ay


@pytest.mark.parametrize("isotropic", [True, False])
def test_boundary_against_area(isotropic: bool, rng: np.random.Generator) -> None:
    """Half vectors along the outline against points of the light, rough surfaces."""
    p, wo, ax, ay = configurations(rng, 25, -1.0, 89.0, isotropic)
    for i in range(len(p)):
        a = reference.specular_integral([p[i]], wo[i], ax[i], ay[i])
        b = reference.specular_area_integral([p[i]], wo[i], ax[i], ay[i])
        assert a.one == pytest.approx(b.one, abs=1e-8 + a.error + b.error)
        assert a.fresnel == pytest.approx(b.fresnel, abs=1e-8 + a.error + b.error)
        if min(ax[i], ay[i]) > 0.2:
            assert b.error < 1e-6


@pytest.mark.parametrize("alpha", [(1e-4, 1e-4), (1e-3, 1e-3), (1e-2, 1e-2), (1e-3, 0.03)])
@pytest.mark.parametrize("degrees", [0.0, 40.0, 80.0, 89.5])
def test_boundary_against_area_in_a_highlight(alpha: tuple[float, float], degrees: float) -> None:
    """Smooth surfaces too: lights so small that a grid over them resolves the highlight."""
    wo = direction(np.radians(degrees), 0.5)
    mirror = wo * [-1.0, -1.0, 1.0]
    u = np.array([np.sin(0.5), -np.cos(0.5), 0.0])
    v = np.cross(mirror, u)
    for shift, size in ((0.0, 1.0), (1.5, 2.0), (-2.0, 0.3)):
        # Along u, across the plane of incidence, a highlight is narrower by the cosine.
        outline = alpha[0] * (size * SQUARE + [shift, 0.5 * shift]) * [wo[2], 1.0]
        light = place(outline, mirror, u, v)
        a = reference.specular_integral([light], wo, *alpha)
        b = reference.specular_area_integral([light], wo, *alpha)
        assert a.one == pytest.approx(b.one, abs=1e-8 + a.error + b.error)
        assert a.fresnel == pytest.approx(b.fresnel, abs=1e-8 + a.error + b.error)
        assert b.error < 1e-6


@pytest.mark.parametrize(("log_alpha", "degrees"), [(-3.0, 89.5), (-4.0, 89.99)])
def test_boundary_against_sampling(
    log_alpha: float, degrees: float, rng: np.random.Generator
) -> None:
    """A z-test over many lights at once: no bias, and errors of the size that they claim."""
    p, wo, ax, ay = configurations(rng, 60, log_alpha, degrees, isotropic=False)
    z = []
    for i in range(len(p)):
        exact = reference.specular_integral([p[i]], wo[i], ax[i], ay[i])
        sampled = reference.specular_monte_carlo([p[i]], wo[i], ax[i], ay[i], 20_000, rng)
        if sampled.error > 1e-4:
            z.append((sampled.one - exact.one) / sampled.error)
        else:  # too few hits for a normal distribution
            assert sampled.one == pytest.approx(exact.one, abs=1e-3)
        assert exact.fresnel == pytest.approx(sampled.fresnel, abs=6.0 * sampled.error + 1e-3)
    assert len(z) > 15
    assert np.max(np.abs(z)) < 4.5
    assert abs(np.mean(z)) < 4.0 / np.sqrt(len(z))


@pytest.mark.parametrize("isotropic", [True, False])
@pytest.mark.parametrize(("log_alpha", "degrees"), [(-3.0, 89.5), (-4.0, 89.99)])
def test_error_estimate_holds(
    log_alpha: float, degrees: float, isotropic: bool, rng: np.random.Generator
) -> None:
    """Against 28 nodes and a tolerance that no panel of the test meets by chance."""
    p, wo, ax, ay = configurations(rng, 40, log_alpha, degrees, isotropic)
    fine = reference.specular_integral_batch(p, wo, ax, ay, nodes=28, tolerance=1e-12)
    fast = reference.specular_integral_batch(p, wo, ax, ay)
    assert np.max(np.abs(np.array(fast) - fine)) < 1e-6
    for i in range(len(p)):
        got = reference.specular_integral([p[i]], wo[i], ax[i], ay[i])
        assert abs(got.one - fine[0][i]) <= got.error < 1e-7
        assert abs(got.fresnel - fine[1][i]) <= 1e-9


@pytest.mark.parametrize(
    "alpha", [(1e-4, 1e-4), (1e-3, 1e-3), (0.05, 0.4), (1.0, 1.0), (0.3, 1e-3)]
)
@pytest.mark.parametrize("degrees", [0.0, 45.0, 89.5, 89.99])
def test_full_sky_is_the_albedo(alpha: tuple[float, float], degrees: float) -> None:
    """Two quadratures over the same visible normals, on different grids, and energy <= 1."""
    wo = direction(np.radians(degrees), 0.6)
    sky = np.column_stack([1e9 * SQUARE, np.ones(4)])
    got = reference.specular_integral([sky], wo, *alpha)
    a, b = brdf.directional_albedo(wo, *alpha)
    assert got.one == pytest.approx(float(a), abs=2e-8)
    assert got.fresnel == pytest.approx(float(b), abs=2e-8)
    assert got.one <= 1.0 + 1e-9


def test_mirror_limit() -> None:
    """At alpha = 1e-4 the whole lobe lies on a light around the mirror direction, or off it."""
    for degrees in (0.0, 30.0, 60.0, 80.0):
        wo = direction(np.radians(degrees))
        mirror = wo * [-1.0, 1.0, 1.0]
        u = np.array([0.0, 1.0, 0.0])
        v = np.cross(mirror, u)
        around = reference.specular_integral([place(0.3 * SQUARE, mirror, u, v)], wo, 1e-4, 1e-4)
        beside = reference.specular_integral(
            [place(0.1 * SQUARE, mirror + 0.3 * u, u, v)], wo, 1e-4, 1e-4
        )
        assert around.one == pytest.approx(1.0, abs=1e-4)
        assert beside.one == pytest.approx(0.0, abs=1e-5)


def test_winding_rotation_and_subdivision(rng: np.random.Generator) -> None:
    p, wo, ax, ay = configurations(rng, 60, -3.0, 89.5, isotropic=True)

    def batch(q: np.ndarray, w: np.ndarray) -> np.ndarray:
        return reference.specular_integral_batch(q, w, ax, ay, nodes=12, tolerance=1e-9)[0]

    one = batch(p, wo)
    assert np.all((one > -1e-9) & (one < 1.0))
    assert batch(p[:, ::-1], wo) == pytest.approx(-one, abs=1e-8)
    assert batch(1e3 * p, wo) == pytest.approx(one, abs=1e-8)
    turn = np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
    assert batch(p @ turn.T, wo @ turn.T) == pytest.approx(one, abs=1e-8)
    middles = np.stack([p, 0.7 * p + 0.3 * np.roll(p, -1, axis=1)], axis=2).reshape(-1, 8, 3)
    assert batch(middles, wo) == pytest.approx(one, abs=1e-8)
    halves = batch(p[:, [0, 1, 2]], wo) + batch(p[:, [0, 2, 3]], wo)
    assert halves == pytest.approx(one, abs=1e-8)
    mirrored = batch((p * [1.0, -1.0, 1.0])[:, ::-1], wo * [1.0, -1.0, 1.0])
    assert mirrored == pytest.approx(one, abs=1e-8)


def test_swapping_the_tangents_swaps_the_alphas(rng: np.random.Generator) -> None:
    p, wo, ax, ay = configurations(rng, 30, -2.0, 89.0, isotropic=False)
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    one, fresnel = reference.specular_integral_batch(p, wo, ax, ay, 12, 1e-9)
    turned = reference.specular_integral_batch(p @ turn.T, wo @ turn.T, ay, ax, 12, 1e-9)
    assert turned[0] == pytest.approx(one, abs=1e-8)
    assert turned[1] == pytest.approx(fresnel, abs=1e-8)


def test_stars_and_holes(rng: np.random.Generator) -> None:
    """A star with a hole: by its loops, by its triangles, by sampling and by area."""
    t = np.arange(10) * np.pi / 5.0
    r = np.where(np.arange(10) % 2 == 0, 1.0, 0.4)
    star = np.stack([r * np.cos(t), r * np.sin(t)], axis=-1)
    wo = direction(np.radians(60.0), 0.3)
    c = np.array([-0.9, -0.2, 0.6])
    u, v = np.array([0.0, 1.0, 0.2]), np.array([0.5, 0.0, 0.9])
    u = u if np.cross(u, v) @ c > 0.0 else -u
    outer, hole = place(star, c, u, v), place(0.3 * star, c, u, v)[::-1]
    middle = c
    for ax, ay in ((0.3, 0.3), (0.4, 0.1), (0.01, 0.01)):
        got = reference.specular_integral([outer, hole], wo, ax, ay)
        parts = 0.0
        for loop in (outer, hole):
            for a, b in zip(loop, np.roll(loop, -1, axis=0), strict=True):
                parts += reference.specular_integral([[middle, a, b]], wo, ax, ay).one
        assert got.one == pytest.approx(parts, abs=1e-8)
        sampled = reference.specular_monte_carlo([outer, hole], wo, ax, ay, 100_000, rng)
        assert abs(got.one - sampled.one) < 4.5 * sampled.error
        if ax > 0.1:
            area = reference.specular_area_integral([outer, hole], wo, ax, ay)
            assert got.one == pytest.approx(area.one, abs=1e-8 + area.error)


def test_random_stars_with_holes_equal_their_triangles(rng: np.random.Generator) -> None:
    """Several crossings of the horizon, of outer loop and hole, from smooth to rough."""
    t = np.arange(12) * np.pi / 6.0
    r = np.where(np.arange(12) % 2 == 0, 1.0, 0.5)
    star = np.stack([r * np.cos(t), r * np.sin(t)], axis=-1)
    _, wo, ax, ay = configurations(rng, 12, -3.0, 89.0, isotropic=False)
    crossing = 0
    for i in range(len(wo)):
        c = wo[i] * [-1.0, -1.0, 1.0] + 0.3 * rng.normal(size=3)
        u, v = rng.normal(size=(2, 3))
        outer, hole = place(star, c, u, v), place(0.4 * star, c, u, v)[::-1]
        crossing += int(np.min(hole[:, 2]) < 0.0 < np.max(hole[:, 2]))
        got = reference.specular_integral([outer, hole], wo[i], ax[i], ay[i])
        corners = np.concatenate([outer, hole])
        after = np.concatenate([np.roll(outer, -1, axis=0), np.roll(hole, -1, axis=0)])
        triangles = np.stack([np.broadcast_to(c, corners.shape), corners, after], axis=1)
        parts = reference.specular_integral_batch(triangles, wo[i], ax[i], ay[i], 12, 1e-9)
        assert got.one == pytest.approx(np.sum(parts[0]), abs=1e-8)
        assert got.fresnel == pytest.approx(np.sum(parts[1]), abs=1e-8)
    assert crossing >= 3


def test_tiny_lights_keep_their_relative_accuracy(rng: np.random.Generator) -> None:
    """A light of 1e-4 of its distance: f cos times its solid angle."""
    wo = direction(0.9, 0.4)
    for _ in range(20):
        ax, ay = 10.0 ** rng.uniform(-1.0, 0.0, 2)
        wi = direction(rng.uniform(0.0, 1.4), rng.uniform(0.0, 6.0))
        u = np.cross(wi, [0.6, 0.0, 0.8])
        u /= np.linalg.norm(u)
        p = place(1e-4 * SQUARE, wi, u, np.cross(wi, u))
        got = reference.specular_integral([p], wo, ax, ay).one
        assert got == pytest.approx(4e-8 * float(brdf.evaluate(wo, wi, ax, ay)), rel=1e-5)


def test_horizon_and_degenerate_lights() -> None:
    wo = direction(1.0)
    below = np.column_stack([SQUARE, -np.ones(4)])
    assert reference.specular_integral([below], wo, 0.1, 0.1).one == 0.0
    above = np.column_stack([SQUARE, np.ones(4)])
    assert reference.specular_integral([above], -wo, 0.1, 0.1).one == 0.0
    assert reference.specular_integral([], wo, 0.1, 0.1).one == 0.0
    assert reference.specular_integral([above[[0, 0, 1]]], wo, 0.1, 0.1).one == pytest.approx(0.0)
    needle = np.array([[-1.0, 0.2, 1.0], [1.0, 0.2, 1.0], [1.0, 0.2 + 1e-7, 1.0]])
    thick = np.array([[-1.0, 0.2, 1.0], [1.0, 0.2, 1.0], [1.0, 0.2 + 1e-3, 1.0]])
    thin = reference.specular_integral([needle], wo, 0.1, 0.1).one
    wide = reference.specular_integral([thick], wo, 0.1, 0.1).one
    assert thin == pytest.approx(1e-4 * wide, rel=1e-2)
    lying = np.column_stack([SQUARE + np.array([3.0, 0.0]), np.zeros(4)])
    assert reference.specular_integral([lying], wo, 0.1, 0.1).one == 0.0
    wall = np.array(
        [[1.0, 0.0, 0.2], [2.0, 0.0, 0.2], [2.0, 0.0, 1.0]]
    )  # its plane holds the point
    assert reference.specular_integral([wall], wo, 0.1, 0.1).one == pytest.approx(0.0, abs=1e-9)
    flush = np.column_stack([SQUARE, np.full(4, 1e-6)])  # a ceiling just above: the full sky
    albedo, _ = brdf.directional_albedo(wo, 0.1, 0.1)
    got = reference.specular_integral([flush], wo, 0.1, 0.1)
    assert got.one == pytest.approx(float(albedo), abs=1e-4)


numbers = st.floats(-1.5, 1.5).map(lambda x: round(x, 3))
logs = st.floats(-4.0, 4.0)


@given(
    st.tuples(numbers, numbers, numbers),
    logs,
    logs,
    st.integers(0, 2**31),
    st.floats(-4.0, 0.0),
    st.floats(-4.0, 0.0),
    st.floats(0.0, 89.99).map(lambda x: round(x, 6)),
)
def test_any_rectangle_is_bounded_by_the_albedo(
    centre: tuple[float, ...],
    log_width: float,
    log_height: float,
    seed: int,
    log_x: float,
    log_y: float,
    degrees: float,
) -> None:
    """Sizes of 1e-4 to 1e4, needles, any plane: finite, and within [0, A] up to the sign."""
    rng = np.random.default_rng(seed)
    u, v = rng.normal(size=(2, 3))
    u /= np.linalg.norm(u)
    v -= u * (u @ v)
    v /= np.linalg.norm(v)
    wo, ax, ay = direction(np.radians(degrees), rng.uniform(0.0, 6.0)), 10.0**log_x, 10.0**log_y
    p = place(SQUARE * [10.0**log_width, 10.0**log_height], np.array(centre), u, v)
    got = reference.specular_integral([p], wo, ax, ay)
    albedo, fresnel = brdf.directional_albedo(wo, ax, ay)
    facing = np.sign(np.cross(u, v) @ np.array(centre))
    assert got.error < 1e-6
    assert -1e-7 <= facing * got.one <= albedo + 1e-7 or facing == 0.0
    assert -1e-7 <= facing * got.fresnel <= fresnel + 1e-7 or facing == 0.0


def test_winding_number() -> None:
    ceiling = np.column_stack([SQUARE, np.ones(4)])
    hole = np.column_stack([0.5 * SQUARE, np.ones(4)])[::-1]
    w = np.array([[0.0, 0.0, 1.0], [0.7, 0.0, 1.0], [1.2, 0.0, 1.0], [0.0, 0.0, -1.0]])
    assert reference.winding_number([ceiling], w).tolist() == [1.0, 1.0, 0.0, 0.0]
    assert reference.winding_number([ceiling, hole], w).tolist() == [0.0, 1.0, 0.0, 0.0]
    flipped = polygon.positive_winding(ceiling)
    assert reference.winding_number([flipped], w).tolist() == [-1.0, -1.0, 0.0, 0.0]
    assert reference.winding_number([ceiling[[0, 0, 1]]], w).tolist() == [0.0] * 4


def test_shapes_and_bad_input() -> None:
    p = np.tile(np.column_stack([SQUARE, np.ones(4)]), (2, 1, 1, 1))
    up = np.array([0.0, 0.0, 1.0])
    one, fresnel = reference.specular_integral_batch(p, up, np.full(3, 0.5), 0.5)
    assert one.shape == fresnel.shape == (2, 3)
    assert reference.specular_integral_batch(p[:0], up, 0.5, 0.5)[0].shape == (0, 1)
    with pytest.raises(ValueError, match="expected positive numbers"):
        reference.specular_integral([p[0, 0]], up, 0.0, 0.1)
    with pytest.raises(ValueError, match=r"loop 1 has shape \(2, 3\)"):
        reference.specular_integral([p[0, 0], p[0, 0, :2]], up, 0.1, 0.1)
    with pytest.raises(ValueError, match=r"wo has shape \(2,\)"):
        reference.specular_monte_carlo([p[0, 0]], up[:2], 0.1, 0.1, 10, np.random.default_rng(0))
    with pytest.raises(ValueError, match="vertices have shape"):
        reference.specular_integral_batch(p[..., :2], up, 0.1, 0.1)
