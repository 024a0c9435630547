"""Cubic Bézier curves as arrays (..., 4, 2): the arithmetic, free of outlines and scenes.

A curve is its four control points, p(t) = Σ B_i(t) p_i with t from 0 to 1. A
straight piece is a cubic too, its handles at the thirds of its chord, so that
p(t) moves evenly; `is_straight` recognises exactly these.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

STRAIGHT = 1e-12
"""How far a straight piece's handles may be from the thirds, in lengths of its chord."""

MAX_SEGMENTS = 4096
"""Line segments that `flatten` makes of one curve at most."""


def evaluate(curves: ArrayLike, t: ArrayLike) -> FloatArray:
    """Return points on curves.

    Parameters
    ----------
    curves : (..., 4, 2) float64
    t : (...) float64
        Parameters, broadcast against the curves' leading axes.

    Returns
    -------
    (..., 2) float64
        Exactly the first and last control point at t = 0 and 1.
    """
    p = _as_curves(curves)
    t = np.asarray(t, dtype=np.float64)[..., None]
    u = 1.0 - t
    return np.asarray(
        u * u * u * p[..., 0, :]
        + 3.0 * u * t * (u * p[..., 1, :] + t * p[..., 2, :])
        + t * t * t * p[..., 3, :]
    )


def derivative(curves: ArrayLike, t: ArrayLike) -> FloatArray:
    """Return dp/dt (..., 2); arguments as in `evaluate`."""
    p = _as_curves(curves)
    t = np.asarray(t, dtype=np.float64)[..., None]
    u = 1.0 - t
    d = np.diff(p, axis=-2)
    return np.asarray(
        3.0 * (u * u * d[..., 0, :] + 2.0 * u * t * d[..., 1, :] + t * t * d[..., 2, :])
    )


def split(curves: ArrayLike, t: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Cut curves at t: the parts before and after, (..., 4, 2) each.

    Their common point is the same to the bit. De Casteljau's construction.
    """
    p = _as_curves(curves)
    t = np.asarray(t, dtype=np.float64)[..., None]
    p0, p1, p2, p3 = (p[..., i, :] for i in range(4))
    p01, p12, p23 = (a + t * (b - a) for a, b in ((p0, p1), (p1, p2), (p2, p3)))
    p012, p123 = p01 + t * (p12 - p01), p12 + t * (p23 - p12)
    middle = p012 + t * (p123 - p012)
    before = np.broadcast_arrays(p0, p01, p012, middle)
    after = np.broadcast_arrays(middle, p123, p23, p3)
    return np.stack(before, axis=-2), np.stack(after, axis=-2)


def part(curves: ArrayLike, t0: ArrayLike, t1: ArrayLike) -> FloatArray:
    """Return the parts (..., 4, 2) from t0 to t1, which may lie outside [0, 1] or be reversed.

    The control points are the blossom's values at (t0, t0, t0), (t0, t0, t1), ...
    """
    p = _as_curves(curves)
    a = np.asarray(t0, dtype=np.float64)[..., None]
    b = np.asarray(t1, dtype=np.float64)[..., None]
    controls = [_blossom(p, *arguments) for arguments in ((a, a, a), (a, a, b), (a, b, b))]
    controls.append(_blossom(p, b, b, b))
    return np.stack(np.broadcast_arrays(*controls), axis=-2)


def _blossom(p: FloatArray, a: FloatArray, b: FloatArray, c: FloatArray) -> FloatArray:
    q = [(1.0 - a) * p[..., i, :] + a * p[..., i + 1, :] for i in range(3)]
    r = [(1.0 - b) * q[i] + b * q[i + 1] for i in range(2)]
    return np.asarray((1.0 - c) * r[0] + c * r[1])


def reversed_curves(curves: ArrayLike) -> FloatArray:
    """Return a chain (k, 4, 2) travelled backwards, the last curve first."""
    return np.ascontiguousarray(_as_curves(curves)[::-1, ::-1])


def extrema(curves: ArrayLike) -> FloatArray:
    """Return where dx/dt and dy/dt vanish within (0, 1): (..., 2, 2), axis then root.

    A root that does not exist is NaN; of a double root both are the same.
    """
    p = _as_curves(curves)
    scale = np.max(np.abs(p - p[..., :1, :]), axis=(-2, -1), keepdims=True)
    d = np.diff(p, axis=-2) / np.where(scale > 0.0, scale, 1.0)
    a, b, c = (d[..., i, :] for i in range(3))
    # (a - 2b + c) t² + 2 (b - a) t + a = 0, without the cancelling formula.
    with np.errstate(divide="ignore", invalid="ignore", over="ignore", under="ignore"):
        half = b - a
        root = np.sqrt(b * b - a * c)
        q = -(half + np.where(half < 0.0, -root, root))
        roots = np.stack((q / (a - 2.0 * b + c), a / q), axis=-1)
        inside = (roots > 0.0) & (roots < 1.0)
    return np.where(inside, roots, np.nan)


def bounds(curves: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return the corners (..., 2) of the tight axis-aligned boxes around curves."""
    p = _as_curves(curves)
    low = np.minimum(p[..., 0, :], p[..., 3, :])
    high = np.maximum(p[..., 0, :], p[..., 3, :])
    t = extrema(p)
    exists = np.isfinite(t)
    for axis in range(2):
        for root in range(2):
            points = evaluate(p, np.where(exists, t, 0.0)[..., axis, root])
            low, high = np.minimum(low, points), np.maximum(high, points)
    return low, high


def line_as_cubic(start: ArrayLike, end: ArrayLike) -> FloatArray:
    """Return straight pieces (..., 4, 2) from ``start`` to ``end`` (..., 2)."""
    a, b = np.broadcast_arrays(
        np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
    )
    third = (b - a) / 3.0
    return np.stack((a, a + third, b - third, b), axis=-2)


def quadratic_as_cubic(curves: ArrayLike) -> FloatArray:
    """Return the cubics (..., 4, 2) that are the same curves as quadratics (..., 3, 2)."""
    q = np.asarray(curves, dtype=np.float64)
    a, b, c = (q[..., i, :] for i in range(3))
    return np.stack((a, a + (b - a) * (2.0 / 3.0), c + (b - c) * (2.0 / 3.0), c), axis=-2)


def is_straight(curves: ArrayLike) -> BoolArray:
    """Tell (...) whether curves are straight pieces: handles at the thirds of the chord.

    To `STRAIGHT` of the chord, or to what rounding the coordinates can do. A
    curve of zero length is straight.
    """
    p = _as_curves(curves)
    wanted = line_as_cubic(p[..., 0, :], p[..., 3, :])
    off = np.max(np.abs(p - wanted), axis=(-2, -1))
    chord = np.max(np.abs(p[..., 3, :] - p[..., 0, :]), axis=-1)
    # Three roundings of a coordinate, in the caller's sum and in ours.
    rounding = 8.0 * np.finfo(np.float64).eps * np.max(np.abs(p), axis=(-2, -1))
    return np.asarray(off <= STRAIGHT * chord + rounding)


def signed_areas(curves: ArrayLike) -> FloatArray:
    """Return ½∫(x dy − y dx) (...) along curves: summed over a loop, its signed area."""
    p = _as_curves(curves)

    def cross(i: int, j: int) -> FloatArray:
        a, b = p[..., i, :], p[..., j, :]
        return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])

    return np.asarray(
        (
            6.0 * (cross(0, 1) + cross(2, 3))
            + 3.0 * (cross(0, 2) + cross(1, 2) + cross(1, 3))
            + cross(0, 3)
        )
        / 20.0
    )


def flatten(loop: ArrayLike, tolerance: float) -> FloatArray:
    """Return points (m, 2) along a chain of curves (k, 4, 2), its last end left out.

    Lines between them are nowhere farther than ``tolerance`` from the curves (up
    to `MAX_SEGMENTS` lines a curve): a cubic's distance from n equal steps' chords
    is at most 3/4 of the largest second difference of its points, divided by n².
    """
    p = _as_curves(loop)
    second = np.diff(p, n=2, axis=-2)
    bend = np.max(np.hypot(second[..., 0], second[..., 1]), axis=-1, initial=0.0)
    steps = np.sqrt(0.75 * bend / tolerance)
    counts = np.ceil(np.clip(steps, 1.0, MAX_SEGMENTS)).astype(np.int64)
    which = np.repeat(np.arange(len(p)), counts)
    step = np.arange(len(which)) - np.repeat(np.cumsum(counts) - counts, counts)
    return evaluate(p[which], step / counts[which])


def _as_curves(curves: ArrayLike) -> FloatArray:
    p = np.asarray(curves, dtype=np.float64)
    if p.shape[-2:] != (4, 2):
        raise ValueError(f"curves have the shape {p.shape}, expected (..., 4, 2)")
    return p
