"""Bounds of form factors are never exceeded, and how far they are from what they bound."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from ltc import transform
from ltc.bounds import (
    Extent,
    extent_bound,
    form_factor_bound,
    half_vector_bound,
    rectangle_extent,
    sector_bound,
)
from ltc.ggx import ggx_specular, visible_normal_share
from ltc.polygon import clipped_form_factor
from ltc.table import load_isotropic

FloatArray = NDArray[np.float64]
COUNT = 34_000
"""Of each of 3, 4 and 6 corners: more than 100,000 lights in all."""
ROUNDING = 1e-12
"""What float64 adds to form factors near 0: 1e4 units of the last place."""


def unit(v: FloatArray) -> FloatArray:
    return np.asarray(v / np.linalg.norm(v, axis=-1, keepdims=True))


def random_lights(
    rng: np.random.Generator, count: int, corners: int
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return polygons (n, corners, 3) and the rectangles around them: middle and half axes.

    Anywhere, from .05 to 30 away, .02 to 5 wide, thin or not, also around the origin's plane.
    """
    center = unit(rng.normal(size=(count, 3)))
    center *= np.exp(rng.uniform(np.log(0.05), np.log(30.0), count))[:, None]
    normal = unit(rng.normal(size=(count, 3)))
    u = unit(np.cross(normal, rng.normal(size=(count, 3))))
    v = np.cross(normal, u)
    # One corner in each of as many equal angles: no outline crosses itself.
    angle = (np.arange(corners) + rng.random((count, corners))) * 2.0 * np.pi / corners
    radius = np.sqrt(rng.uniform(0.05, 1.0, (count, corners)))
    size = np.exp(rng.uniform(np.log(0.02), np.log(5.0), (count, 2)))
    st = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1) * size[:, None]
    low, high = st.min(axis=1), st.max(axis=1)
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    polygon = center[:, None] + st[..., :1] * u[:, None] + st[..., 1:] * v[:, None]
    middle_3d = center + middle[:, :1] * u + middle[:, 1:] * v
    return polygon, middle_3d, u * half[:, :1], v * half[:, 1:]


def random_transforms(rng: np.random.Generator, count: int) -> FloatArray:
    """Return cosine_from_shading of the shipped table's lobes, alpha 1e-4 to 1; some identities."""
    alpha = np.exp(rng.uniform(np.log(1e-4), 0.0, count))
    theta = np.radians(rng.uniform(0.0, 89.9, count))
    matrix = transform.invert(load_isotropic().matrix(alpha, np.cos(theta)))
    matrix[rng.random(count) < 0.3] = np.eye(3)
    return matrix


def test_a_sector_attains_its_bound() -> None:
    """Its form factor by quadrature over (R, phi), to the quadrature's error."""
    nodes, weights = np.polynomial.legendre.leggauss(200)
    for radius, span in ((0.0, 2.0 * np.pi), (0.3, 1.0), (2.0, 0.1), (20.0, 3.0)):
        # R = radius + t/(1-t), t in [0, 1].
        t = 0.5 + 0.5 * nodes
        r = radius + t / (1.0 - t)
        integrand = span / np.pi * r / (1.0 + r * r) ** 2 / (1.0 - t) ** 2
        assert sector_bound(radius, span) == pytest.approx(0.5 * weights @ integrand, rel=1e-9)


def test_sector_of_the_light_itself() -> None:
    """With its own smallest radius and span of azimuth, of 100,000 triangles above the horizon."""
    rng = np.random.default_rng(2)
    count = 100_000
    middle = rng.uniform(-6.0, 6.0, (count, 1, 2))
    flat = middle + rng.normal(size=(count, 3, 2)) * rng.uniform(0.02, 2.0, (count, 1, 1))
    edge = np.roll(flat, -1, axis=1) - flat
    side = flat[..., 0] * edge[..., 1] - flat[..., 1] * edge[..., 0]
    inside = np.all(side > 0.0, axis=1) | np.all(side < 0.0, axis=1)
    along = np.clip(-np.sum(flat * edge, axis=-1) / np.sum(edge**2, axis=-1), 0.0, 1.0)
    radius = np.linalg.norm(flat + along[..., None] * edge, axis=-1).min(axis=1)
    azimuth = np.arctan2(flat[..., 1], flat[..., 0])
    # Outside they span less than half a turn: measured from the first corner.
    turn = (azimuth - azimuth[:, :1] + np.pi) % (2.0 * np.pi) - np.pi
    span = np.where(inside, 2.0 * np.pi, turn.max(axis=1) - turn.min(axis=1))
    height = rng.uniform(0.1, 10.0, (count, 3, 1))
    corners = np.concatenate([flat, np.ones((count, 3, 1))], axis=-1) * height
    found = np.abs(clipped_form_factor(corners))
    bound = sector_bound(np.where(inside, 0.0, radius), span)
    assert np.all(found <= bound + ROUNDING)
    slack = bound[found > 1e-9] / found[found > 1e-9]
    # 9.2: small lights are far from filling a sector to the horizon, which is what the density
    # is for; of those as wide as they are far off it is 2.
    assert np.median(slack) < 10.0


@pytest.mark.parametrize("corners", [3, 4, 6])
def test_no_light_exceeds_its_bound(corners: int) -> None:
    rng = np.random.default_rng(corners)
    polygon, middle, u, v = random_lights(rng, COUNT, corners)
    matrix = random_transforms(rng, COUNT)
    found = np.abs(clipped_form_factor(np.einsum("nij,nkj->nki", matrix, polygon)))
    bound = form_factor_bound(*(np.einsum("nij,nj->ni", matrix, w) for w in (middle, u, v)))
    assert np.all(bound >= 0.0)
    assert np.all(bound <= 1.0)
    assert np.all(found <= bound * (1.0 + 1e-9) + ROUNDING)
    assert found.max() > 0.99
    # What it is good for: of the lights below a threshold, how many it finds.
    for threshold in (1e-2, 1e-3, 1e-4):
        assert np.mean(bound < threshold) > 0.73 * np.mean(found < threshold)


def test_slack_of_lights_that_are_in_sight() -> None:
    """Rectangles away from the lobe's horizon and axis by more than their size."""
    rng = np.random.default_rng(7)
    polygon, middle, u, v = random_lights(rng, COUNT, 4)
    extent = rectangle_extent(middle, u, v)
    found = np.abs(clipped_form_factor(polygon))
    bound = form_factor_bound(middle, u, v)
    clear = (extent.bottom > 0.0) & (extent.near > 0.0) & (found > 1e-9)
    assert clear.sum() > 5000
    slack = np.quantile(bound[clear] / found[clear], (0.5, 0.9))
    assert slack[0] < 3.0  # 2.7: of this 1.7 is what the outline is smaller than its rectangle
    assert slack[1] < 10.0  # 9.2


def test_ggx_does_not_exceed_its_bound() -> None:
    rng = np.random.default_rng(11)
    count = 12_000
    polygon, middle, u, v = random_lights(rng, count, 4)
    theta = np.radians(rng.uniform(0.0, 89.9, count))
    phi = rng.uniform(0.0, 2.0 * np.pi, count)
    wo = np.stack(
        [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1
    )
    alpha_x = np.exp(rng.uniform(np.log(1e-3), 0.0, count))
    alpha_y = np.where(
        rng.random(count) < 0.5, alpha_x, np.exp(rng.uniform(np.log(1e-3), 0.0, count))
    )
    corners = np.stack([middle - u - v, middle + u - v, middle + u + v, middle - u + v], axis=1)
    bound = half_vector_bound(corners, wo, alpha_x, alpha_y)
    share = np.abs(visible_normal_share([polygon], wo, alpha_x, alpha_y))
    assert np.all(share <= bound.one * (1.0 + 1e-9) + 1e-10)
    one, fresnel = (np.abs(x) for x in ggx_specular([polygon], wo, alpha_x, alpha_y))
    assert np.all(one <= bound.one * (1.0 + 1e-6) + 1e-10)
    assert np.all(fresnel <= bound.one * bound.fresnel * (1.0 + 1e-6) + 1e-10)
    assert np.mean(bound.one < 1e-3) > 0.5 * np.mean(share < 1e-3)


def test_degenerate_extents() -> None:
    zero, one = np.zeros(1), np.ones(1)
    assert extent_bound(Extent(zero, zero, one, one)) == 0.0  # below the horizon
    assert extent_bound(Extent(zero, one, zero, one)) == 1.0  # around the axis
    # Half a turn from 45 degrees on.
    assert extent_bound(Extent(zero, one, one, 1e9 * one)) == pytest.approx(0.25)
    nowhere = np.zeros((1, 3))
    assert form_factor_bound(nowhere, nowhere, nowhere) in (0.0, 1.0)
    up = np.array([[0.0, 0.0, 1.0]])
    bound = half_vector_bound(np.zeros((1, 4, 3)), up, 0.1, 0.1)
    assert (bound.one, bound.fresnel) == (1.0, 1.0)
