"""The baseline of one representative point: by brute force, in its limits, and its known flaws."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ltc.polygon import loops_form_factor
from ltc.reference import specular_integral, winding_number
from ltc.representative_point import (
    nearest_on_arc,
    representative_direction,
    representative_point,
    triangle_solid_angle,
)


def unit(v):
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def random_loops(rng, hole):
    """A star-shaped polygon in a skew plane, half of them with a hole; and its centroid."""
    angle = np.sort(rng.uniform(0.0, 2.0 * np.pi, int(rng.integers(3, 9))))
    radius = rng.uniform(0.3, 1.0, len(angle))
    outer = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)
    u = unit(rng.normal(size=3))
    v = unit(np.cross(u, rng.normal(size=3)))
    origin = rng.normal(size=3)
    loops = [outer, 0.3 * outer[::-1]] if hole else [outer]
    return [origin + loop[:, :1] * u + loop[:, 1:] * v for loop in loops], origin


def test_solid_angles():
    octant = np.eye(3)
    assert triangle_solid_angle(*octant) == pytest.approx(np.pi / 2.0)
    assert triangle_solid_angle(*octant[::-1]) == pytest.approx(-np.pi / 2.0)
    # Lengths of corners say where the triangle is, not how large it looks.
    assert triangle_solid_angle(*(octant * [[1e-3], [7.0], [1e4]])) == pytest.approx(np.pi / 2.0)
    # Against the area over the distance squared, far away.
    far = np.array([[0.0, 0.0, 1e3], [1.0, 0.0, 1e3], [0.0, 1.0, 1e3]])
    assert triangle_solid_angle(*far) == pytest.approx(0.5e-6, rel=1e-5)


def test_nearest_on_an_arc_is_nearest():
    rng = np.random.default_rng(1)
    a, b = rng.normal(size=(2, 500, 3))
    way = unit(rng.normal(size=(500, 3)))
    found = np.sum(nearest_on_arc(a, b, way) * way, axis=-1)
    t = np.linspace(0.0, 1.0, 2001)[:, None, None]
    tried = np.sum(unit(a + t * (b - a)) * way, axis=-1).max(axis=0)
    assert (found >= tried - 1e-12).all()
    # Steps of 1/2000 miss the best by half a step; nearly opposite ends make steps long.
    assert np.quantile(found - tried, 0.98) <= 1e-5
    assert nearest_on_arc([1, 0, 0], [0, 1, 0], [0, 0, 1.0]).tolist() in ([1, 0, 0], [0, 1, 0])


def test_the_point_is_on_the_light_and_nearest():
    rng = np.random.default_rng(2)
    hits = 0
    for index in range(60):
        loops, origin = random_loops(rng, index % 2 == 1)
        ways = unit(
            np.concatenate([rng.normal(size=(8, 3)), origin + 0.3 * rng.normal(size=(8, 3))])
        )
        batch = [np.broadcast_to(loop, (len(ways), *loop.shape)) for loop in loops]
        found = representative_direction(batch, ways)
        np.testing.assert_allclose(np.linalg.norm(found, axis=-1), 1.0, atol=1e-12)
        # Everything on the light: inside by random directions, the outline by steps.
        some = unit(origin + rng.normal(size=(4000, 3)))
        inside = some[winding_number(loops, some) != 0.0]
        steps = np.linspace(0.0, 1.0, 400)[:, None, None]
        outline = [unit(p + steps * (np.roll(p, -1, axis=0) - p)).reshape(-1, 3) for p in loops]
        light = np.concatenate([inside, *outline])
        most = (light @ ways.T).max(axis=0)
        cosine = np.sum(found * ways, axis=-1)
        assert (cosine >= most - 1e-12).all()
        assert (cosine <= most + 2e-3).all()
        is_hit = winding_number(loops, ways) != 0.0
        np.testing.assert_array_equal(found[is_hit], ways[is_hit])
        assert (cosine[~is_hit] < 1.0).all()
        hits += int(is_hit.sum())
    assert 50 < hits < 60 * 16 - 50


@pytest.mark.parametrize("alpha", [(0.5, 0.5), (0.3, 0.8)])
def test_far_lights_are_exact(alpha):
    """As a light grows small against the lobe every point of it is as good as another."""
    rng = np.random.default_rng(3)
    for size in (0.1, 0.01):
        worst = 0.0
        for _ in range(20):
            loops, origin = random_loops(rng, hole=False)
            centre = unit(origin * [1.0, 1.0, 0.0] + [0.0, 0.0, 1.5])
            loops = [centre + size * (loop - origin) for loop in loops]
            wo = unit(np.array([*rng.normal(size=2), 1.5]))
            one, fresnel, diffuse = representative_point(loops, centre, wo, *alpha)
            assert 0.0 <= fresnel <= one
            exact = abs(specular_integral(loops, wo, *alpha)[0])
            worst = max(worst, abs(float(one) / exact - 1.0))
            lambert = abs(float(loops_form_factor(loops)))
            assert float(diffuse) == pytest.approx(lambert, rel=2.0 * size)
        # Of first order in the light's size over the lobe's width.
        assert worst <= size / min(alpha)


def test_a_mirror_shows_a_disc_too_bright():
    angle = np.linspace(0.0, 2.0 * np.pi, 200, endpoint=False)
    disc = np.stack([0.1 * np.cos(angle), 0.1 * np.sin(angle), np.ones(200)], axis=-1)
    up = np.array([0.0, 0.0, 1.0])
    one, _, _ = representative_point([disc], up, up, 1e-4, 1e-4)
    assert float(one) == pytest.approx(9.0 / 4.0, rel=0.02)


def test_below_the_horizon_is_dark():
    low = np.array([[1.0, -1.0, -0.1], [1.0, 1.0, -0.1], [1.0, 0.0, -2.0]])
    wo = unit(np.array([-1.0, 0.0, 1.0]))
    assert [float(x) for x in representative_point([low], low.mean(axis=0), wo, 0.2, 0.2)] == [
        0.0
    ] * 3


def test_wrong_shapes_are_told():
    up = np.array([0.0, 0.0, 1.0])
    with pytest.raises(ValueError, match=r"\(2, 3\), expected \(..., N >= 3, 3\)"):
        representative_point([np.ones((2, 3))], up, up, 0.1, 0.1)
    with pytest.raises(ValueError, match="no loops"):
        representative_point([], up, up, 0.1, 0.1)
    with pytest.raises(ValueError, match="alpha"):
        representative_point([np.eye(3)], up, up, 0.0, 0.1)
    assert math.isfinite(float(representative_point([np.eye(3)], np.ones(3) / 3, up, 0.1, 0.1)[0]))
