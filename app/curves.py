"""Cubic Bézier curves as arrays (..., 4, 2): the arithmetic, free of outlines and scenes.

A curve is its four control points, p(t) = Σ B_i(t) p_i with t from 0 to 1. A
straight piece is a cubic too, its handles at the thirds of its chord, so that
p(t) moves evenly; `is_straight` recognises exactly these.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

STRAIGHT = 1e-12
"""How far a straight piece's handles may be from the thirds, in lengths of its chord."""

MAX_SEGMENTS = 4096
"""Pieces that a curve is cut into at most, unless asked otherwise."""


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
    to `MAX_SEGMENTS` lines a curve).
    """
    p = _as_curves(loop)
    return subdivide(p, pieces(p, tolerance))


def pieces(
    curves: FloatArray, tolerance: FloatArray | float, most: int = MAX_SEGMENTS
) -> NDArray[np.int64]:
    """Return into how many pieces to cut curves (n, 4, 2) whose chords shall be near, (n,) from 1.

    ``tolerance`` is the distance allowed, in the curves' unit, of shape () or (n,).

    Notes
    -----
    Wang's bound: k equal pieces of a cubic miss it by at most
    (6 / 8) m / k², m the larger second difference of its control points.
    """
    second = np.diff(curves, n=2, axis=1)
    largest = np.max(np.hypot(second[..., 0], second[..., 1]), axis=-1)
    wanted = np.clip(np.sqrt(0.75 * largest / tolerance), 1.0, most)
    wanted[is_straight(curves)] = 1.0
    return np.asarray(np.ceil(wanted), dtype=np.int64)


def subdivide(curves: FloatArray, counts: NDArray[np.int64]) -> FloatArray:
    """Return the points where curves (n, 4, 2) begin and are cut, (sum of counts, 2)."""
    which = np.repeat(np.arange(len(curves)), counts)
    first = np.cumsum(counts) - counts
    along = (np.arange(len(which)) - first[which]) / counts[which]
    return evaluate(curves[which], along)


def nearest(curves: FloatArray, target: FloatArray) -> FloatArray:
    """Return the parameters (n,) where curves (n, 4, 2) come nearest to a point (2,).

    Notes
    -----
    The best of 33 places, then Newton on the squared distance, kept within the two
    neighbouring places.
    """
    places = np.linspace(0.0, 1.0, 33)
    sampled = evaluate(curves[:, None], places)
    first = ((sampled - target) ** 2).sum(-1).argmin(-1)
    low, high = places[np.maximum(first - 1, 0)], places[np.minimum(first + 1, 32)]
    at = places[first]
    second = 6.0 * np.diff(curves, n=2, axis=1)
    for _ in range(12):
        away = evaluate(curves, at) - target
        speed = derivative(curves, at)
        turn = second[:, 0] + at[:, None] * (second[:, 1] - second[:, 0])
        slope = (away * speed).sum(-1)
        rise = (speed**2).sum(-1) + (away * turn).sum(-1)
        # Uphill (rise <= 0) Newton would run to a maximum; bisect towards lower distance there.
        low, high = np.where(slope < 0.0, at, low), np.where(slope > 0.0, at, high)
        step = at - slope / np.where(rise > 0.0, rise, 1.0)
        inside = (rise > 0.0) & (step >= low) & (step <= high)
        at = np.where(inside, step, 0.5 * (low + high))
    return np.asarray(at)


def length(vector: FloatArray) -> float:
    """Return the length of a vector (2,)."""
    return math.hypot(*vector.tolist())


def unit(vector: FloatArray) -> FloatArray:
    """Return the direction of a vector, zero for the zero vector."""
    size = length(vector)
    return vector / size if size > 0.0 else vector


def _tangents(curves: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return unit directions (2,) from both ends of a chain of control points (n, 2) inwards."""
    ends = []
    for points in (curves, curves[::-1]):
        ways = points[1:] - points[0]
        sizes = np.sqrt((ways**2).sum(-1))
        found = np.flatnonzero(sizes > 1e-12 * max(float(sizes.max()), 1e-300))
        ends.append(unit(ways[found[0]]) if len(found) else np.zeros(2))
    return ends[0], ends[1]


def merged(before: FloatArray, after: FloatArray) -> FloatArray:
    """Return the cubic (4, 2) that comes nearest to two that meet.

    Notes
    -----
    Its ends and directions there are theirs; the lengths of its handles are the
    least-squares solution over 32 samples a curve, whose parameters are put at
    the nearest points between rounds: Schneider, An Algorithm for Automatically
    Fitting Digitized Curves, Graphics Gems (1990). The first parameters are
    those of a split, so that a curve that was split is found at once.
    """
    start, end = before[0], after[3]
    head, tail = _tangents(np.concatenate([before, after[1:]]))
    left, right = length(before[3] - before[2]), length(after[1] - after[0])
    if not left + right > 0.0:
        left, right = length(before[3] - before[0]), length(after[3] - after[0])
    share = left / (left + right) if left + right > 0.0 else 0.5
    share = min(max(share, 0.02), 0.98)
    along = np.linspace(0.0, 1.0, 33)
    samples = np.concatenate([evaluate(before, along), evaluate(after, along[1:])])
    places = np.concatenate([share * along, share + (1.0 - share) * along[1:]])
    span = length(end - start) or length(before[3] - start)
    best, least = line_as_cubic(start, end), math.inf
    for _ in range(8):
        rest = 1.0 - places
        fixed = evaluate(np.stack([start, start, end, end]), places)
        inner = 3.0 * np.stack([places * rest**2, places**2 * rest], axis=-1)
        system = inner[:, None, :] * np.stack([head, tail], axis=-1)
        missing = (samples - fixed).reshape(-1)
        sizes = np.linalg.lstsq(system.reshape(-1, 2), missing, rcond=1e-12)[0]
        sizes = np.where(sizes > 1e-3 * span, sizes, span / 3.0)
        curve = np.stack([start, start + sizes[0] * head, end + sizes[1] * tail, end])
        miss = evaluate(curve, places) - samples
        error = float((miss**2).sum())
        if error < least:
            best, least = curve, error
        if error <= 1e-24 * span**2:
            break
        speed = derivative(curve, places)
        squares = (speed**2).sum(-1)
        shift = (miss * speed).sum(-1) / np.where(squares > 0.0, squares, 1.0)
        places = np.clip(places - shift, 0.0, 1.0)
    return best


def _as_curves(curves: ArrayLike) -> FloatArray:
    p = np.asarray(curves, dtype=np.float64)
    if p.shape[-2:] != (4, 2):
        raise ValueError(f"curves have the shape {p.shape}, expected (..., 4, 2)")
    return p
