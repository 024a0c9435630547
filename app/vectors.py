"""Arithmetic on the scene's tuples: a few operations on vectors and quaternions in float64.

Scenes hold tuples, edits touch a handful of them at a time, and a tuple in,
tuple out function reads better there than arrays and conversions.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from app.scene import Quaternion, Vec2, Vec3

FloatArray = NDArray[np.float64]


def add(a: Vec3, b: Vec3) -> Vec3:
    """Return a + b."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def subtract(a: Vec3, b: Vec3) -> Vec3:
    """Return a - b."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def scale(a: Vec3, factor: float) -> Vec3:
    """Return the vector times a number."""
    return (a[0] * factor, a[1] * factor, a[2] * factor)


def dot(a: Vec3, b: Vec3) -> float:
    """Return the scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vec3, b: Vec3) -> Vec3:
    """Return the right-handed vector product a x b."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


def length(a: Vec3) -> float:
    """Return the Euclidean length."""
    return math.hypot(*a)


def normalize(a: Vec3) -> Vec3:
    """Return the vector scaled to length 1.

    Raises
    ------
    ValueError
        If it is zero.
    """
    norm = math.hypot(*a)
    if norm == 0.0:
        raise ValueError("the zero vector has no direction")
    return (a[0] / norm, a[1] / norm, a[2] / norm)


def rotate(a: Vec3, axis: Vec3, angle: float) -> Vec3:
    """Return ``a`` turned about a unit ``axis`` by ``angle`` [rad], counter-clockwise.

    Notes
    -----
    Rodrigues' formula.
    """
    c, s = math.cos(angle), math.sin(angle)
    along = scale(axis, dot(axis, a) * (1.0 - c))
    return add(add(scale(a, c), scale(cross(axis, a), s)), along)


def perpendicular(a: Vec3) -> Vec3:
    """Return some unit vector at right angles to a non-zero ``a``."""
    smallest = min(range(3), key=lambda i: abs(a[i]))
    other = (float(smallest == 0), float(smallest == 1), float(smallest == 2))
    return normalize(cross(a, other))


def mix(a: Vec2, b: Vec2, weight: float) -> Vec2:
    """Return the point a + weight (b - a) of the plane."""
    return (a[0] + weight * (b[0] - a[0]), a[1] + weight * (b[1] - a[1]))


def quaternion_of(rotation: FloatArray) -> Quaternion:
    """Return the unit quaternion (w, x, y, z) of a (3, 3) rotation matrix (Shepperd 1978)."""
    m = rotation
    squares = np.array(
        [
            1.0 + m[0, 0] + m[1, 1] + m[2, 2],
            1.0 + m[0, 0] - m[1, 1] - m[2, 2],
            1.0 - m[0, 0] + m[1, 1] - m[2, 2],
            1.0 - m[0, 0] - m[1, 1] + m[2, 2],
        ]
    )
    products = np.array(
        [
            [0.0, m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]],
            [0.0, 0.0, m[1, 0] + m[0, 1], m[0, 2] + m[2, 0]],
            [0.0, 0.0, 0.0, m[2, 1] + m[1, 2]],
            [0.0, 0.0, 0.0, 0.0],
        ]
    )
    products += products.T + np.diag(squares)
    row = products[int(squares.argmax())]
    w, x, y, z = (row / np.linalg.norm(row)).tolist()
    return (w, x, y, z)


def multiply_quaternions(a: Quaternion, b: Quaternion) -> Quaternion:
    """Return the Hamilton product a b: the turn b, then a."""
    return (
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    )
