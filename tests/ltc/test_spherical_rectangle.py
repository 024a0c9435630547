"""Rectangles as a point sees them: solid angles by another route, places by chi-square."""

from __future__ import annotations

import numpy as np
from scipy.stats import chi2

from ltc.spherical_rectangle import place, solid_angle


def rectangles(rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return sides and depths, the foot inside, beside and far from the rectangle."""
    low = rng.normal(0.0, 2.0, (count, 2))
    high = low + 10 ** rng.uniform(-1.0, 1.0, (count, 2))
    return np.concatenate([low, high], axis=1), 10 ** rng.uniform(-1.5, 1.0, count)


def triangle_angle(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Van Oosterom and Strackee 1983."""
    la, lb, lc = (np.linalg.norm(v, axis=-1) for v in (a, b, c))
    volume = np.sum(a * np.cross(b, c), axis=-1)
    rest = la * lb * lc + np.sum(a * b, -1) * lc + np.sum(b * c, -1) * la + np.sum(c * a, -1) * lb
    return np.abs(2.0 * np.arctan2(volume, rest))


def test_solid_angle_is_that_of_two_triangles():
    sides, depth = rectangles(np.random.default_rng(0), 2000)
    corners = [np.stack([sides[:, i], sides[:, j], depth], axis=-1)
               for i, j in ((0, 1), (2, 1), (2, 3), (0, 3))]  # fmt: skip
    want = triangle_angle(*corners[:3]) + triangle_angle(corners[0], *corners[2:])
    np.testing.assert_allclose(solid_angle(sides, depth), want, rtol=1e-9, atol=1e-13)


def test_places_are_even_over_the_solid_angle():
    """Of 8 x 8 parts of a rectangle each gets its own solid angle's share."""
    rng = np.random.default_rng(1)
    for sides, depth in zip(*rectangles(rng, 40), strict=True):
        at = place(sides, depth, rng.random((20_000, 2)))
        low, high = sides[:2], sides[2:]
        assert np.all((at >= low) & (at <= high))
        cell = np.minimum((8.0 * (at - low) / (high - low)).astype(int), 7)
        count = np.bincount(cell @ (1, 8), minlength=64)
        x, y = (low[i] + (high - low)[i] * np.arange(9) / 8.0 for i in range(2))
        y0, x0 = np.meshgrid(y[:-1], x[:-1], indexing="ij")
        y1, x1 = np.meshgrid(y[1:], x[1:], indexing="ij")
        parts = solid_angle(np.stack([x0, y0, x1, y1], axis=-1), np.full((8, 8), depth)).ravel()
        expected = len(at) * parts / parts.sum()
        likely = expected > 5.0
        found = np.append(count[likely], count[~likely].sum())
        wanted = np.append(expected[likely], max(expected[~likely].sum(), 1e-9))
        if found[-1] == 0 and wanted[-1] < 1e-6:
            found, wanted = found[:-1], wanted[:-1]
        # 40 rectangles: one in 25,000 fails by chance.
        assert np.sum((found - wanted) ** 2 / wanted) < chi2.isf(1e-6, len(found) - 1)
