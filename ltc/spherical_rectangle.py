"""A rectangle as a point sees it: its solid angle, and places drawn evenly over that.

Ureña, Fajardo and King 2013, "An area-preserving parametrization for spherical rectangles".
The point is the origin, the rectangle lies in the plane z = depth with its sides along x
and y. Twin: ``shaders/reference/rectangle.glsl``, which draws evenly over the area instead
where the solid angle is below .02 sr or the plane nearer than .02 of the rectangle's size:
there float32 would leave relative errors above 1e-5 in the solid angle, and 1e-3 in places.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]


def _corner_angles(sides: FloatArray, depth: FloatArray) -> FloatArray:
    """Return the angles (..., 4) at (x0, y0), (x1, y0), (x1, y1), (x0, y1)."""
    x, y = sides[..., [0, 2, 2, 0]], sides[..., [1, 1, 3, 3]]
    z = depth[..., None]
    reach = np.sqrt(x * x + y * y + z * z)
    return np.asarray(np.arctan2(z * reach, x * y * np.array([-1.0, 1.0, -1.0, 1.0])))


def solid_angle(sides: npt.ArrayLike, depth: npt.ArrayLike) -> FloatArray:
    """Return the solid angle (...) [sr] of rectangles.

    Parameters
    ----------
    sides : (..., 4) float64
        Least x, least y, greatest x, greatest y.
    depth : (...) float64
        Distance of the plane, positive.
    """
    s, d = np.asarray(sides, dtype=np.float64), np.asarray(depth, dtype=np.float64)
    return np.asarray(_corner_angles(s, d).sum(axis=-1) - 2.0 * np.pi)


def place(sides: npt.ArrayLike, depth: npt.ArrayLike, u: npt.ArrayLike) -> FloatArray:
    """Return places (..., 2) that are spread evenly over the solid angle for u over (0, 1)^2.

    Parameters
    ----------
    sides, depth
        As for `solid_angle`.
    u : (..., 2) float64
        In (0, 1).
    """
    s, d = np.asarray(sides, dtype=np.float64), np.asarray(depth, dtype=np.float64)
    u = np.asarray(u, dtype=np.float64)
    angles = _corner_angles(s, d)
    angle = u[..., 0] * (angles.sum(axis=-1) - 2.0 * np.pi)
    angle = angle + 2.0 * np.pi - angles[..., 3] - angles[..., 0]
    b0 = -s[..., 1] / np.hypot(s[..., 1], d)
    b1 = s[..., 3] / np.hypot(s[..., 3], d)
    f = (np.cos(angle) * b0 - b1) / np.sin(angle)
    rest = np.maximum(f * f - d * d / (s[..., 1] ** 2 + d * d), 1e-300)
    x = np.clip(np.copysign(d / np.sqrt(rest), f), s[..., 0], s[..., 2])
    q = np.hypot(x, d)
    low, high = s[..., 1] / np.hypot(q, s[..., 1]), s[..., 3] / np.hypot(q, s[..., 3])
    height = low + u[..., 1] * (high - low)
    y = np.clip(height * q / np.sqrt(1.0 - height * height), s[..., 1], s[..., 3])
    return np.stack([x, y], axis=-1)
