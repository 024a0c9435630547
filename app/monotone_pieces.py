"""Parts of cubic curves that turn neither in x nor in y.

Their boxes are those of their ends, a level or upright ray meets each once at
most, and none crosses itself: on such pieces winding numbers are exact, and a
point's place on one is the root of a monotone function.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app import curves

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

ROOT_ROUNDS = 80
"""Of the search for where a ray meets a piece; Newton's method needs about six."""


@dataclass(frozen=True)
class Pieces:
    """Parts of curves that turn neither in x nor in y.

    ``controls`` (m, 4, 2), neighbours meeting in the same point to the bit;
    ``source`` (m,) the curve of each, ``begin`` and ``end`` (m,) its parameters there.
    """

    controls: FloatArray
    source: IntArray
    begin: FloatArray
    end: FloatArray


def monotone_pieces(every: FloatArray) -> Pieces:
    """Cut curves (n, 4, 2) where they turn in x or y."""
    t = np.sort(curves.extrema(every).reshape(len(every), 4), axis=1)  # NaN last
    t = np.concatenate((np.zeros((len(every), 1)), t, np.full((len(every), 1), np.nan)), axis=1)
    last = np.sum(np.isfinite(t), axis=1)
    t[np.arange(len(every)), last] = 1.0
    keep = np.isfinite(t)
    keep[:, 1:] &= t[:, 1:] > t[:, :-1]
    source, column = np.nonzero(keep)
    stops = t[source, column]
    inner = source[:-1] == source[1:]
    source, begin, end = source[:-1][inner], stops[:-1][inner], stops[1:][inner]
    whole = (begin == 0.0) & (end == 1.0)
    pieces = every[source].copy()
    cut = ~whole
    cut_source = pieces[cut]
    pieces[cut] = curves.part(cut_source, begin[cut], end[cut])
    pieces[cut, 0] = curves.evaluate(cut_source, begin[cut])
    pieces[cut, 3] = curves.evaluate(cut_source, end[cut])
    return Pieces(pieces, source, begin, end)


def parameter_at(p: FloatArray, value: FloatArray) -> FloatArray:
    """Return t (n,) where monotone cubics (n, 4) in one variable take values between their ends."""
    p0, p1, p2, p3 = (p[:, i] for i in range(4))
    a, b, c = p1 - p0, p2 - p1, p3 - p2
    rising = p3 > p0
    span = p3 - p0
    rounding = np.finfo(np.float64).eps * np.maximum(np.abs(p0), np.abs(p3))
    low, high = np.zeros(len(p)), np.ones(len(p))
    t = np.clip((value - p0) / np.where(span == 0.0, 1.0, span), 0.0, 1.0)
    for _ in range(ROOT_ROUNDS):
        u = 1.0 - t
        # From the start, so that values near it keep their digits.
        here = p0 + t * (3.0 * u * u * a + 3.0 * u * t * (a + b) + t * t * span)
        slope = 3.0 * (u * u * a + 2.0 * u * t * b + t * t * c)
        below = (here < value) == rising
        low, high = np.where(below, t, low), np.where(below, high, t)
        following = t + (value - here) / slope
        outside = ~((following > low) & (following < high))
        following = np.where(outside, 0.5 * (low + high), following)
        following = np.where(np.abs(here - value) <= rounding, t, following)
        if np.all(np.abs(following - t) <= 1e-15):
            break
        t = following
    return t


def parameter_along(pieces: FloatArray, points: FloatArray) -> FloatArray:
    """Return t (n,) of the points on monotone pieces (n, 4, 2) that are beside ``points`` (n, 2).

    Where the diagonal that falls across the piece's direction meets it: for a
    point on the piece its own parameter, for one beside it a point at most √2
    times as far as the closest one.
    """
    sign = np.sign(pieces[:, 3] - pieces[:, 0])
    along = np.sum(pieces * sign[:, None], axis=-1)
    value = np.sum(points * sign, axis=-1)
    return parameter_at(along, np.clip(value, along[:, 0], along[:, 3]))


def ray_crossings(
    points: FloatArray, pieces: FloatArray, near: float
) -> tuple[NDArray[np.int8], BoolArray]:
    """Count how rays from points (k, 2) along +x meet monotone pieces (m, 4, 2).

    Returns
    -------
    crossings : (k, m) int8
        1 where a piece crosses the ray upwards, -1 downwards, else 0.
    close : (k, m) bool
        Whether it does so within ``near`` of the point, on either side.
    """
    x, y = points[:, :1], points[:, 1:]
    y0, y1 = pieces[:, 0, 1], pieces[:, 3, 1]
    upward = (y0 <= y) & (y1 > y)
    spans = upward | ((y1 <= y) & (y0 > y))
    crossings = np.where(spans, np.where(upward, 1, -1), 0).astype(np.int8)
    left = np.minimum(pieces[:, 0, 0], pieces[:, 3, 0])
    right = np.maximum(pieces[:, 0, 0], pieces[:, 3, 0])
    crossings[right < x - near] = 0
    close = np.zeros(spans.shape, dtype=bool)
    which, piece = np.nonzero(spans & (left <= x + near) & (right >= x - near))
    if len(which):
        chosen = pieces[piece]
        t = parameter_at(chosen[..., 1], points[which, 1])
        beyond = curves.evaluate(chosen, t)[:, 0] - points[which, 0]
        crossings[which[beyond <= 0.0], piece[beyond <= 0.0]] = 0
        close[which, piece] = np.abs(beyond) <= near
    return crossings, close


def is_on(points: FloatArray, pieces: FloatArray, within: float) -> BoolArray:
    """Tell which points (n, 2) are within a distance of their monotone pieces (n, 4, 2)."""
    off = curves.evaluate(pieces, parameter_along(pieces, points)) - points
    return np.asarray(np.hypot(off[:, 0], off[:, 1]) <= within)


def winding_number(every: FloatArray, point: FloatArray) -> int:
    """Return how often closed chains of cubics (n, 4, 2) turn counter-clockwise about a point."""
    with np.errstate(all="ignore"):
        pieces = monotone_pieces(every).controls
        crossings, _ = ray_crossings(point[None], pieces, 0.0)
    return int(crossings.sum())
