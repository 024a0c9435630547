"""The boundary of what Bézier curves enclose."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from app import curves
from app.scene import FillRule

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

ROOT_ROUNDS = 80
"""Of the search for where a ray meets a curve; Newton's method needs about six."""


def curve_boundary(chains: Sequence[FloatArray], fill_rule: FillRule) -> list[FloatArray]:
    """Return the loops between inside and outside of closed chains of cubics (k, 4, 2)."""
    chains = [_normal_form(chain) for chain in chains]
    chains = [chain for chain in chains if len(chain)]
    if not chains:
        return []
    every = np.concatenate(chains)
    pieces = monotone_pieces(every)[0]
    loops = []
    for chain in chains:
        box = np.ptp(chain, axis=(1))
        longest = int(np.argmax(box.max(axis=1)))
        curve = chain[longest]
        middle, along = curves.evaluate(curve, 0.5), curves.derivative(curve, 0.5)
        normal = np.array((-along[1], along[0]))
        normal *= 1e-6 * box.max() / max(np.hypot(*normal), 1e-300)
        inside = []
        for sign in (1.0, -1.0):
            winding = int(np.sum(_crossings(middle + sign * normal, pieces)))
            inside.append(winding % 2 != 0 if fill_rule == "evenodd" else winding != 0)
        if inside[0] and not inside[1]:
            loops.append(chain)
        elif inside[1] and not inside[0]:
            loops.append(curves.reversed_curves(chain))
    return loops


def winding_number(every: FloatArray, point: FloatArray) -> int:
    """Return how often closed chains of cubics (n, 4, 2) turn counter-clockwise about a point."""
    return int(np.sum(_crossings(point, monotone_pieces(every)[0])))


def _normal_form(chain: FloatArray) -> FloatArray:
    """Drop curves of zero length and put the handles of straight ones at the thirds."""
    chain = chain[np.any(chain != chain[:, :1], axis=(1, 2))]
    straight = curves.is_straight(chain)
    lines = curves.line_as_cubic(chain[:, 0], chain[:, 3])
    return np.where(straight[:, None, None], lines, chain)


def monotone_pieces(every: FloatArray) -> tuple[FloatArray, IntArray, FloatArray, FloatArray]:
    """Cut curves (n, 4, 2) where they turn in x or y.

    Returns
    -------
    pieces : (m, 4, 2) float64
        Neighbours meet in the same point to the bit.
    source : (m,) int64
        The curve that each is a piece of, in order.
    begin, end : (m,) float64
        Its parameters on that curve.
    """
    t = np.sort(curves.extrema(every).reshape(len(every), 4), axis=1)  # NaN last
    t = np.concatenate((np.zeros((len(every), 1)), t, np.ones((len(every), 1))), axis=1)
    keep = np.isfinite(t)
    keep[:, 1:-1] &= (np.diff(t[:, :-1], axis=1) > 0.0) & (t[:, 1:-1] < 1.0)
    source, column = np.nonzero(keep)
    stops = t[source, column]
    inner = source[:-1] == source[1:]
    source, begin, end = source[:-1][inner], stops[:-1][inner], stops[1:][inner]
    pieces = curves.part(every[source], begin, end)
    pieces[:, 0] = curves.evaluate(every[source], begin)
    pieces[:, 3] = curves.evaluate(every[source], end)
    return pieces, source, begin, end


def _crossings(point: FloatArray, pieces: FloatArray) -> IntArray:
    """Return for monotone pieces how a ray from a point along +x meets them: 1 upward, -1, 0."""
    y0, y1 = pieces[:, 0, 1], pieces[:, 3, 1]
    x0, x1 = pieces[:, 0, 0], pieces[:, 3, 0]
    upward = (y0 <= point[1]) & (y1 > point[1])
    downward = (y1 <= point[1]) & (y0 > point[1])
    spans = upward | downward
    beyond = np.minimum(x0, x1) > point[0]
    unsure = np.flatnonzero(spans & ~beyond & (np.maximum(x0, x1) >= point[0]))
    if len(unsure):
        height = np.full(len(unsure), point[1])
        beyond[unsure] = _x_at(pieces[unsure], height) > point[0]
    return np.where(spans & beyond, np.where(upward, 1, -1), 0)


def _x_at(pieces: FloatArray, height: FloatArray) -> FloatArray:
    """Return x (n,) where monotone pieces (n, 4, 2) have the y coordinates ``height`` (n,)."""
    t = _parameter_at(pieces[..., 1], height)
    return np.asarray(curves.evaluate(pieces, t)[..., 0])


def _parameter_at(p: FloatArray, value: FloatArray) -> FloatArray:
    """Return t (n,) where monotone cubics (n, 4) in one variable take values between their ends."""
    low, high = np.zeros(len(p)), np.ones(len(p))
    rising = p[:, 3] > p[:, 0]
    span = p[:, 3] - p[:, 0]
    t = np.clip((value - p[:, 0]) / np.where(span == 0.0, 1.0, span), 0.0, 1.0)
    for _ in range(ROOT_ROUNDS):
        u = 1.0 - t
        a, b, c = p[:, 1] - p[:, 0], p[:, 2] - p[:, 1], p[:, 3] - p[:, 2]
        here = u * u * u * p[:, 0] + 3.0 * u * t * (u * p[:, 1] + t * p[:, 2]) + t * t * t * p[:, 3]
        slope = 3.0 * (u * u * a + 2.0 * u * t * b + t * t * c)
        below = (here < value) == rising
        low, high = np.where(below, t, low), np.where(below, high, t)
        step = (value - here) / np.where(slope == 0.0, 1.0, slope)
        following = t + step
        outside = (slope == 0.0) | (following <= low) | (following >= high)
        following = np.where(outside, 0.5 * (low + high), following)
        if np.all(np.abs(following - t) <= 1e-15):
            break
        t = following
    return t
