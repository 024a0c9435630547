"""Points, distances and motions of a plane, as a light's outline lies on one.

A plane's coordinates (s, t) belong to the point origin + s u + t v, where u
and v may be of any length and not at right angles.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from app.scene import Plane, Vec2, Vec3
from app.vectors import add, cross, dot, normalize, scale, subtract

FloatArray = NDArray[np.float64]


def normal_of(plane: Plane) -> Vec3:
    """Return the unit normal u x v / |u x v| of the emitting side."""
    return normalize(cross(plane.u, plane.v))


def point_on(plane: Plane, st: Vec2) -> Vec3:
    """Return the world position of plane coordinates (s, t)."""
    return add(plane.origin, add(scale(plane.u, st[0]), scale(plane.v, st[1])))


def coordinates_on(plane: Plane, point: Vec3) -> Vec2:
    """Return (s, t) of the point of the plane nearest to ``point``."""
    offset = subtract(point, plane.origin)
    normal = cross(plane.u, plane.v)
    area = dot(normal, normal)
    s = dot(cross(offset, plane.v), normal) / area
    t = dot(cross(plane.u, offset), normal) / area
    return (s, t)


def metric_from_plane(plane: Plane) -> FloatArray:
    """Return the (2, 2) matrix from (s, t) to metres in an orthonormal basis of the plane.

    Its first axis points along u. Distances and angles on the light are those
    of the image of this map.
    """
    first = normalize(plane.u)
    second = cross(normal_of(plane), first)
    return np.array(
        [
            [dot(plane.u, first), dot(plane.v, first)],
            [dot(plane.u, second), dot(plane.v, second)],
        ]
    )


def transform_plane(plane: Plane, rigid: FloatArray) -> Plane:
    """Return the plane moved by a (4, 4) world matrix of rotation, scale and translation."""

    def turned(vector: Vec3, w: float) -> Vec3:
        x, y, z = (rigid[:3, :3] @ vector + rigid[:3, 3] * w).tolist()
        return (x, y, z)

    return Plane(turned(plane.origin, 1.0), turned(plane.u, 0.0), turned(plane.v, 0.0))
