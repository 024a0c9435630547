"""The prefiltered pictures and the fetch of Heitz et al. 2016, sections 5.3 and 5.4.

What `ltc.prefilter` and `ltc.textured` are measured against, and nothing else uses. The
paper leaves open how far the margin reaches and what levels there are; its authors'
shader has a margin of 1/6 of the light (it samples at .125 + .75 uv) and levels three times as
wide as the one before. Here the levels are twice as wide, which favours it a little.

A level is the picture filtered with a Gaussian, cut at the light and divided by what of the
Gaussian is on the light. In the margin the standard deviation grows to half the distance from the
light, so that the filter always meets it; beyond the margin coordinates are clamped.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from ltc.ggx_boundary import dot
from ltc.picture_cells import bilinear

FloatArray: TypeAlias = npt.NDArray[np.float64]

MARGIN = 1.0 / 6.0
"""Of the light's size, on each side."""

_FIRST = (
    0.35  # texels: standard deviation of the first level, of which bilinear texels have as much
)


@dataclass(frozen=True, eq=False, slots=True)
class GaussianLevels:
    """Levels (rows, columns, C) on [-MARGIN, 1 + MARGIN]^2, and their standard deviations in uv."""

    levels: tuple[FloatArray, ...]
    sigma: FloatArray


def gaussian_levels(picture: npt.ArrayLike, cover: npt.ArrayLike | None = None) -> GaussianLevels:
    """Return the paper's levels of a picture.

    Parameters
    ----------
    picture : (rows, columns, C) float
        Linear radiance.
    cover : (rows, columns) float, optional
        The share of each texel that is light; 1 if it is left out.

    Returns
    -------
    GaussianLevels
        Of the picture's own resolution, every level: sums of Gaussians, without approximation,
        which takes seconds for 256 x 256.
    """
    L = np.asarray(picture, dtype=np.float64)
    rows, columns = L.shape[:2]
    c = np.ones((rows, columns)) if cover is None else np.asarray(cover, dtype=np.float64)
    both = np.concatenate([L * c[..., None], c[..., None]], axis=-1)
    sigma = [_FIRST / max(rows, columns)]
    while sigma[-1] < 4.0:
        sigma.append(2.0 * sigma[-1])
    x, y = ((np.arange(n) + 0.5) / n for n in (columns, rows))
    sides = []
    for n in (columns, rows):
        count = max(int(np.ceil(n * (1.0 + 2.0 * MARGIN))), 8)
        sides.append(-MARGIN + (1.0 + 2.0 * MARGIN) * (np.arange(count) + 0.5) / count)
    distance = _distance(sides[0], sides[1], x, y, c)
    levels = []
    for s in sigma:
        wide = np.maximum(s, 0.5 * distance)
        # The width differs by place: interpolated between powers of two, finely.
        steps = np.log2(wide / s) * 4.0
        most = int(np.ceil(np.max(steps)))
        level = np.zeros((*wide.shape, L.shape[2]))
        for k in range(most + 1):
            share = np.maximum(1.0 - np.abs(steps - k), 0.0)
            if not np.any(share > 0.0):
                continue
            width = s * 2.0 ** (k / 4.0)
            across, down = _gaussian(sides[0], x, width), _gaussian(sides[1], y, width)
            sums = np.einsum("ij,jkc->ikc", down, np.einsum("lk,jkc->jlc", across, both))
            weight = sums[..., -1:]
            known = weight > 1e-30
            mean = np.where(known, sums[..., :-1] / np.where(known, weight, 1.0), 0.0)
            level += share[..., None] * mean
        levels.append(level)
    return GaussianLevels(tuple(levels), np.array(sigma))


def _gaussian(at: FloatArray, x: FloatArray, width: float) -> FloatArray:
    d = (at[:, None] - x) / width
    nearest = np.min(np.abs(d), axis=1, keepdims=True)
    # Divided by its largest value, which the quotient does not feel.
    return np.asarray(np.exp(np.maximum(0.5 * (nearest**2 - d**2), -200.0)))


def _distance(
    across: FloatArray, down: FloatArray, x: FloatArray, y: FloatArray, cover: FloatArray
) -> FloatArray:
    """Return how far places are from the light, (rows, columns)."""
    if np.all(cover > 0.0):
        u, v = (np.maximum(np.maximum(-s, s - 1.0), 0.0) for s in (across, down))
        return np.hypot(u, v[:, None])
    j, i = np.nonzero(cover > 0.0)
    light = np.stack([x[i], y[j]], axis=-1)
    out = np.zeros((down.size, across.size))
    for row, v in enumerate(down):
        gap = np.hypot(across[:, None] - light[:, 0], v - light[:, 1])
        out[row] = np.min(gap, axis=1, initial=1.0)
    return np.maximum(out - 0.5 / max(x.size, y.size), 0.0)


def orthonormal_projection(
    frames: npt.ArrayLike, area: float = 1.0
) -> tuple[FloatArray, FloatArray]:
    """Return where the paper fetches, (..., 2), and its standard deviation sqrt(r^2/2A), (...).

    Parameters
    ----------
    frames : (..., 3, 3) float64
        Rows o, U, W in cosine space.
    area : float
        The outline's area in picture coordinates.
    """
    f = np.asarray(frames, dtype=np.float64)
    o, U, W = f[..., 0, :], f[..., 1, :], f[..., 2, :]
    N = np.cross(U, W)
    N2 = np.maximum(dot(N, N), 1e-60)
    height = dot(N, o) / N2
    away = N * height[..., None] - o
    place = np.stack([dot(np.cross(away, W), N) / N2, dot(np.cross(U, away), N) / N2], axis=-1)
    r2 = height**2 * N2
    return place, np.sqrt(r2 / (2.0 * area * np.sqrt(N2)))


def published_mean_radiance(
    levels: GaussianLevels, frames: npt.ArrayLike, area: float = 1.0
) -> FloatArray:
    """Return the mean radiance (..., C) as the paper fetches it; arguments as above."""
    place, sigma = orthonormal_projection(frames, area)
    at = (np.clip(place, -MARGIN, 1.0 + MARGIN) + MARGIN) / (1.0 + 2.0 * MARGIN)
    last = len(levels.levels) - 1
    level = np.clip(np.log2(np.maximum(sigma, 1e-30) / levels.sigma[0]), 0.0, last)
    first = np.minimum(level.astype(np.intp), last - 1)
    blend = level - first
    value = np.zeros((*sigma.shape, levels.levels[0].shape[2]))
    for k, image in enumerate(levels.levels):
        share = np.where(first == k, 1.0 - blend, np.where(first + 1 == k, blend, 0.0))
        used = share > 0.0
        value[used] += share[used][:, None] * bilinear(image, at[used])
    return value
