"""Closed chains of cubics on their way from a font or a drawing to an outline.

Both are read as loops of pieces, each a line, a quadratic or a cubic with its
points as the file has them. They become arrays (k, 4, 2) of cubics, are moved
and scaled as a whole, and last become contours with kinds of anchors.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from app.curves import bounds, is_straight, line_as_cubic, quadratic_as_cubic
from app.scene import AnchorKind, BezierContour, Contour, FillRule, Outline

FloatArray = NDArray[np.float64]
Piece = tuple[tuple[float, float], ...]
"""The points of a line (2), a quadratic (3) or a cubic (4)."""

SMOOTH = math.radians(1.0)
"""Anchors whose handles bend by less are smooth: whole font units turn short handles so far."""

STRAIGHT_TURN = 1e-9
"""A bend by less, in radians, is a rounding."""

SNAP = 1e-9
"""A loop whose ends are closer than this share of its reach is closed: a file's rounding."""


def closed_loop(pieces: Sequence[Piece]) -> FloatArray | None:
    """Return a chain of pieces as cubics, closed by a straight one where it is open.

    Parameters
    ----------
    pieces : sequence of 2, 3 or 4 points
        Each begins exactly where the one before it ends.

    Returns
    -------
    (k, 4, 2) float64 or None
        Lines with their handles at the thirds, quadratics raised exactly,
        pieces of no extent left out; None for a loop that lies on one line,
        which encloses nothing.
    """
    kept = [piece for piece in pieces if any(point != piece[0] for point in piece)]
    if not kept:
        return None
    start, end = kept[0][0], kept[-1][-1]
    if math.dist(start, end) <= SNAP * max(math.dist(start, piece[-1]) for piece in kept):
        kept[-1] = (*kept[-1][:-1], start)
    else:
        kept.append((end, start))
    curves = np.empty((len(kept), 4, 2))
    for count, raised in ((2, _line), (3, quadratic_as_cubic), (4, np.asarray)):
        which = [i for i, piece in enumerate(kept) if len(piece) == count]
        if which:
            curves[which] = raised(np.array([kept[i] for i in which], dtype=np.float64))
    return None if _is_flat(curves) else curves


def _is_flat(curves: FloatArray) -> bool:
    """Tell whether all points are on one line, to what rounding can do."""
    steps = curves.reshape(-1, 2) - curves[0, 0]
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    x, y = steps[np.argmax(lengths)] / np.max(lengths)
    rounding = 8.0 * np.finfo(np.float64).eps * np.max(np.abs(curves))
    return bool(np.max(np.abs(steps[:, 0] * y - steps[:, 1] * x)) <= rounding)


def _line(pieces: FloatArray) -> FloatArray:
    return line_as_cubic(pieces[:, 0], pieces[:, 1])


def convex_turn(loop: FloatArray) -> int:
    """Return 1 for a loop (k, 4, 2) around a convex inside, counter-clockwise, −1 if clockwise.

    0 if the polygon of its control points is not convex.
    """
    steps = np.diff(loop[:, :, :], axis=1).reshape(-1, 2)
    steps = steps[np.any(steps != 0.0, axis=1)]
    following = np.roll(steps, -1, axis=0)
    across = steps[:, 0] * following[:, 1] - steps[:, 1] * following[:, 0]
    turns = np.arctan2(across, np.sum(steps * following, axis=1))
    total = float(np.sum(turns))
    sign = 1 if total > 0.0 else -1
    # Once around, and never back by more than the roundings of a straight stretch.
    once = abs(abs(total) - 2.0 * math.pi) < 1e-6
    return sign if once and bool(np.all(sign * turns > -STRAIGHT_TURN)) else 0


def extent(loops: Iterable[FloatArray]) -> tuple[FloatArray, FloatArray]:
    """Return the corners (2,) of the tight box around loops, of which there is one or more."""
    lows, highs = bounds(np.concatenate(list(loops)))
    return lows.min(axis=0), highs.max(axis=0)


def outline_of(loops: Iterable[FloatArray], fill_rule: FillRule) -> Outline:
    """Return loops (k, 4, 2) as an outline."""
    contours: list[Contour] = [
        BezierContour(
            tuple((tuple(p), tuple(q), tuple(r), tuple(s)) for p, q, r, s in loop.tolist()),
            _kinds(loop),
        )
        for loop in loops
    ]
    return Outline(tuple(contours), fill_rule)


def _kinds(loop: FloatArray) -> tuple[AnchorKind, ...]:
    """Call an anchor smooth where two bent curves meet in one direction."""
    leaving = _direction(loop)
    arriving = -np.roll(_direction(loop[:, ::-1]), 1, axis=0)
    along = np.sum(arriving * leaving, axis=1)
    across = arriving[:, 0] * leaving[:, 1] - arriving[:, 1] * leaving[:, 0]
    bent = ~is_straight(loop)
    smooth = (np.abs(np.arctan2(across, along)) < SMOOTH) & bent & np.roll(bent, 1)
    if not smooth.any():
        return ()
    return tuple("smooth" if one else "corner" for one in smooth.tolist())


def _direction(curves: FloatArray) -> FloatArray:
    """Return where curves (k, 4, 2) head at their start: to the first point that is elsewhere."""
    steps = curves[:, 1:] - curves[:, :1]
    first = np.argmax(np.any(steps != 0.0, axis=2), axis=1)
    found = steps[np.arange(len(curves)), first]
    lengths = np.hypot(found[:, 0], found[:, 1])
    return np.asarray(found / np.where(lengths > 0.0, lengths, 1.0)[:, None])
