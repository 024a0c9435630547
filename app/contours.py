"""What can be done to one closed curve of an outline: pure functions from a contour to a new one.

A contour is a polygon or a chain of cubic Bézier curves; both are spoken of in
the same words. *Points* are a polygon's corners or a chain's anchors, counted
from 0. *Segment* i leads from point i to the next one, and a *handle* is named
by its segment and by 1 or 2, its place in the curve.

Three rules hold throughout, as in Inkscape:

- A straight segment stays straight until it is bent on purpose. Straight means
  handles at the thirds of the chord (`app.curves.is_straight`), so a line that
  was bent and pulled straight by hand stays a curve.
- An anchor's kind is kept by what moves handles. Beside a straight segment a
  smooth anchor keeps its handle in line with that segment.
- What changes the shape otherwise weakens a kind that no longer holds
  (symmetric to smooth to corner) and moves nothing to save it.

Lengths and angles of handles are measured by ``metric``, the (2, 2) matrix from
plane coordinates to metres (`app.planes.metric_from_plane`): only then does a
handle on a stretched plane keep the length that one sees.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from app import curves as cubic
from app.curves import is_straight, length, line_as_cubic, unit
from app.scene import (
    AnchorKind,
    BezierContour,
    Contour,
    CubicCurve,
    Outline,
    PolygonContour,
    SceneError,
    Vec2,
)
from app.vectors import mix

FloatArray = NDArray[np.float64]

UNIT: FloatArray = np.eye(2)
"""The metric of a plane whose axes are unit vectors at right angles."""

KINK = math.radians(1.0)
"""Handles that bend by less are in line: fonts, drawn in whole units, turn short ones so far."""

UNEQUAL = 1e-3
"""By how much of their length the handles of a symmetric anchor may differ."""

BENT = 0.25
"""Where on its chord a bent line gets its handles: off the thirds, so that it counts as a curve."""

MOST_PIECES = 1024
"""Into how many pieces the outlines that one sees and edits cut a curve at most."""


# Reading


def points_of(contour: Contour) -> tuple[Vec2, ...]:
    """Return a polygon's corners or a chain's anchors."""
    return contour.points if isinstance(contour, PolygonContour) else contour.anchors


def size_of(contour: Contour) -> int:
    """Return the number of points, which is also that of segments."""
    return len(contour.points if isinstance(contour, PolygonContour) else contour.curves)


def kinds_of(contour: Contour) -> tuple[AnchorKind, ...]:
    """Return the kind of every point; corners for a polygon."""
    if isinstance(contour, BezierContour) and contour.kinds:
        return contour.kinds
    corner: AnchorKind = "corner"
    return (corner,) * size_of(contour)


def curves_of(contour: Contour) -> FloatArray:
    """Return the segments as cubic curves, (n, 4, 2) float64."""
    if isinstance(contour, BezierContour):
        return np.array(contour.curves, dtype=np.float64)
    points = np.array(contour.points, dtype=np.float64)
    return line_as_cubic(points, np.roll(points, -1, axis=0))


@dataclass(frozen=True, eq=False, slots=True)
class Segments:
    """All segments of an outline, contour after contour, as read-only arrays.

    ``curves`` are (n, 4, 2) cubics, ``straight`` (n,) tells which are lines;
    contour i has those from ``starts[i]`` to ``starts[i + 1]``.
    """

    curves: FloatArray
    straight: NDArray[np.bool_]
    starts: tuple[int, ...]


@lru_cache(maxsize=64)
def segments_of(outline: Outline) -> Segments:
    """Return all segments of an outline; cached, since every frame asks for them."""
    each = [curves_of(contour) for contour in outline.contours]
    curves = np.concatenate(each)
    straight = np.concatenate([straight_segments(contour) for contour in outline.contours])
    curves.setflags(write=False)
    straight.setflags(write=False)
    return Segments(curves, straight, (0, *np.cumsum([len(part) for part in each]).tolist()))


def straight_segments(contour: Contour) -> NDArray[np.bool_]:
    """Return which segments are straight lines, (n,) bool."""
    if isinstance(contour, PolygonContour):
        return np.ones(size_of(contour), dtype=bool)
    return is_straight(curves_of(contour))


def handle_of(contour: BezierContour, segment: int, which: int) -> Vec2:
    """Return the place of a handle."""
    return contour.curves[segment][which]


def anchor_of(contour: BezierContour, segment: int, which: int) -> int:
    """Return the index of the anchor that a handle belongs to."""
    return segment if which == 1 else (segment + 1) % len(contour.curves)


def handle_to_pull(contour: Contour, index: int) -> tuple[int, int] | None:
    """Return the handle (segment, which) of an anchor that is not to be seen, None if both are.

    It lies on the anchor, or belongs to a straight segment. The one ahead comes first.
    """
    if isinstance(contour, PolygonContour):
        return None
    straight = straight_segments(contour)
    for segment, which in ((index, 1), ((index - 1) % len(contour.curves), 2)):
        if straight[segment] or handle_of(contour, segment, which) == contour.anchors[index]:
            return segment, which
    return None


def point_at(contour: Contour, segment: int, along: float) -> Vec2:
    """Return the place at the parameter ``along`` in [0, 1] of a segment."""
    if isinstance(contour, PolygonContour):
        points = contour.points
        return mix(points[segment], points[(segment + 1) % len(points)], along)
    s, t = cubic.evaluate(contour.curves[segment], along).tolist()
    return (s, t)


@lru_cache(maxsize=64)
def bounds(outline: Outline) -> tuple[Vec2, Vec2]:
    """Return the lower and upper corner of an outline's bounding box, handles left out."""
    low, high = cubic.bounds(segments_of(outline).curves)
    (s0, t0), (s1, t1) = low.min(0).tolist(), high.max(0).tolist()
    return (s0, t0), (s1, t1)


def flatten(contour: Contour, tolerance: float, metric: FloatArray = UNIT) -> FloatArray:
    """Return corners (n, 2) of a polygon within a distance of the contour.

    Parameters
    ----------
    tolerance : float
        The largest distance, measured by ``metric``, down to `MOST_PIECES` pieces a curve.
    """
    if isinstance(contour, PolygonContour):
        return np.array(contour.points, dtype=np.float64)
    curves = curves_of(contour)
    return cubic.subdivide(curves, cubic.pieces(curves @ metric.T, tolerance, MOST_PIECES))


def nearest(contour: Contour, at: Vec2, metric: FloatArray = UNIT) -> tuple[float, int, float]:
    """Return (distance, segment, parameter along it) of the boundary point nearest to ``at``.

    The distance is measured by ``metric``.

    Notes
    -----
    Straight segments exactly, curves by `app.curves.nearest`.
    """
    target = metric @ np.asarray(at, dtype=np.float64)
    curves = curves_of(contour) @ metric.T
    starts, ways = curves[:, 0], curves[:, 3] - curves[:, 0]
    squares = (ways**2).sum(-1)
    along = ((target - starts) * ways).sum(-1) / np.where(squares > 0.0, squares, 1.0)
    along = np.clip(along, 0.0, 1.0)
    bent = np.flatnonzero(~straight_segments(contour))
    if len(bent):
        along[bent] = cubic.nearest(curves[bent], target)
    on = cubic.evaluate(curves, along)
    distances = np.sqrt(((on - target) ** 2).sum(-1))
    best = int(distances.argmin())
    return float(distances[best]), best, float(along[best])


# Points and handles


def move_point(contour: Contour, index: int, to: Vec2, metric: FloatArray = UNIT) -> Contour:
    """Put a point at ``to``; its handles move along, straight segments beside it stay straight."""
    target = (float(to[0]), float(to[1]))
    if isinstance(contour, PolygonContour):
        points = list(contour.points)
        points[index] = target
        return PolygonContour(tuple(points))
    straight, curves = straight_segments(contour), curves_of(contour)
    count, before = len(curves), (index - 1) % len(curves)
    shift = np.array(target) - curves[index, 0]
    curves[index, :2] += shift
    curves[before, 2:] += shift
    curves[index, 0] = curves[before, 3] = target
    for segment in {index, before}:
        if straight[segment]:
            curves[segment] = line_as_cubic(curves[segment, 0], curves[segment, 3])
    near = {before, index, (index + 1) % count}
    kinds = _in_line_with_straight(curves, kinds_of(contour), straight, near, metric)
    return _chain(curves, kinds)


def move_handle(
    contour: BezierContour,
    segment: int,
    which: int,
    to: Vec2,
    *,
    free: bool = False,
    metric: FloatArray = UNIT,
) -> BezierContour:
    """Put a handle at ``to``; the one across its anchor follows as the anchor's kind says.

    Parameters
    ----------
    segment, which : int
        The handle.
    free : bool
        Make the anchor a corner and move this handle alone.

    Notes
    -----
    Across a straight segment nothing can follow. There the handle stays on the
    line's extension instead, as long as the pointer says.
    """
    curves, kinds = curves_of(contour), list(kinds_of(contour))
    count, owner = len(curves), anchor_of(contour, segment, which)
    other = ((segment - 1) % count, 2) if which == 1 else ((segment + 1) % count, 1)
    anchor = curves[segment, 0 if which == 1 else 3].copy()
    way = metric @ (np.asarray(to, dtype=np.float64) - anchor)
    to_plane = np.linalg.inv(metric)
    if free:
        kinds[owner] = "corner"
    if kinds[owner] != "corner" and other[0] != segment and is_straight(curves[other[0]]):
        far = curves[other[0], 0 if other[1] == 2 else 3]
        line = unit(metric @ (anchor - far))
        way = line * max(float(way @ line), 0.0)
        curves[segment, which] = anchor + to_plane @ way
        return _chain(curves, kinds)
    curves[segment, which] = to
    if kinds[owner] == "symmetric":
        curves[other] = 2.0 * anchor - np.asarray(to, dtype=np.float64)
    elif kinds[owner] == "smooth" and way.any():
        size = length(metric @ (curves[other] - anchor))
        curves[other] = anchor - to_plane @ (unit(way) * size)
    return _chain(curves, kinds)


def retract_handle(contour: BezierContour, segment: int, which: int) -> BezierContour:
    """Lay a handle on its anchor, which becomes a corner."""
    owner = anchor_of(contour, segment, which)
    return move_handle(contour, segment, which, contour.anchors[owner], free=True)


def set_kind(
    contour: Contour, index: int, kind: AnchorKind, metric: FloatArray = UNIT
) -> BezierContour:
    """Make a point a corner, smooth or symmetric, its handles put in line at once.

    The common direction is halfway between the handles', or along a straight
    segment beside the point; of two straight segments both are bent, parallel to
    the line between the neighbouring points. Lengths stay; for a symmetric point
    they become their mean; handles that lie on the point get a third of their
    chord. A polygon becomes a chain of curves.
    """
    chain = to_bezier(contour)
    curves, kinds = curves_of(chain), list(kinds_of(chain))
    kinds[index] = kind
    if kind == "corner":
        return _chain(curves, kinds)
    before = (index - 1) % len(curves)
    anchor = curves[index, 0].copy()
    into = metric @ (anchor - curves[before, 2])
    out = metric @ (curves[index, 1] - anchor)
    from_previous = metric @ (anchor - curves[before, 0])
    to_next = metric @ (curves[index, 3] - anchor)
    lengths = [
        length(into) or length(from_previous) / 3.0,
        length(out) or length(to_next) / 3.0,
    ]
    lines = is_straight(curves[[before, index]])
    if lines.all():
        direction = from_previous + to_next
    elif lines.any():
        direction = from_previous if lines[0] else to_next
    else:
        direction = unit(into) + unit(out)
        if length(direction) <= KINK:
            direction = from_previous + to_next
    if length(direction) <= KINK * sum(lengths):
        direction = np.array([-into[1], into[0]])  # a spike: across it
    direction = unit(direction)
    if kind == "symmetric":
        lengths = [sum(lengths) / 2.0] * 2
    to_plane = np.linalg.inv(metric)
    move_into, move_out = True, True
    if kind == "smooth" and lines.any() and not lines.all():
        move_into, move_out = not lines[0], not lines[1]
    if move_into:
        curves[before, 2] = anchor - to_plane @ (direction * lengths[0])
    if move_out:
        curves[index, 1] = anchor + to_plane @ (direction * lengths[1])
    return _chain(curves, kinds)


def insert(contour: Contour, segment: int, along: float = 0.5) -> Contour:
    """Add a point on a segment, at the parameter ``along``, without changing the shape.

    It gets the index segment + 1, and is smooth on a curve (de Casteljau's
    split leaves its handles in line), a corner on a line.
    """
    if isinstance(contour, PolygonContour):
        points = list(contour.points)
        points.insert(segment + 1, point_at(contour, segment, along))
        return PolygonContour(tuple(points))
    curves, kinds = curves_of(contour), list(kinds_of(contour))
    first, second = cubic.split(curves[segment], along)
    straight = bool(is_straight(curves[segment]))
    if straight:
        first = line_as_cubic(first[0], first[3])
        second = line_as_cubic(second[0], second[3])
    grown = np.concatenate([curves[:segment], first[None], second[None], curves[segment + 1 :]])
    kinds.insert(segment + 1, "corner" if straight else "smooth")
    ends = (segment, segment + 1, (segment + 2) % len(grown))
    return _chain(grown, _weakened(grown, kinds, ends))


def remove(contour: Contour, index: int) -> Contour | None:
    """Remove a point; a curve takes the place of the two that met in it.

    It keeps their directions at the far ends and comes as near to them as one
    cubic does; removing a point that `insert` added gives the curve back. Two
    lines give a line.

    Returns
    -------
    Contour, or None if nothing with an inside remains: fewer than two segments, or
    two that are straight.
    """
    if isinstance(contour, PolygonContour):
        rest = contour.points[:index] + contour.points[index + 1 :]
        return PolygonContour(rest) if len(rest) >= 3 else None
    straight, curves, kinds = straight_segments(contour), curves_of(contour), kinds_of(contour)
    count = len(curves)
    if count <= 2:
        return None
    before = (index - 1) % count
    if straight[before] and straight[index]:
        merged = line_as_cubic(curves[before, 0], curves[index, 3])
    else:
        merged = cubic.merged(curves[before], curves[index])
    curves[before] = merged
    kept = [i for i in range(count) if i != index]
    curves = curves[kept]
    if len(curves) < 3 and is_straight(curves).all():
        return None
    place = kept.index(before)
    ends = (place, (place + 1) % len(kept))
    return _chain(curves, _weakened(curves, [kinds[i] for i in kept], ends))


# Segments


def straighten(contour: Contour, segment: int) -> Contour:
    """Make a segment a straight line; the rest stays as it is."""
    if isinstance(contour, PolygonContour):
        return contour
    curves = curves_of(contour)
    curves[segment] = line_as_cubic(curves[segment, 0], curves[segment, 3])
    ends = (segment, (segment + 1) % len(curves))
    return _chain(curves, _weakened(curves, kinds_of(contour), ends))


def bend(contour: Contour, segment: int) -> BezierContour:
    """Give a straight segment handles to pull at; the shape stays. A curve stays as it is."""
    chain = to_bezier(contour)
    curves = curves_of(chain)
    start, end = curves[segment, 0].copy(), curves[segment, 3].copy()
    retracted = np.array_equal(curves[segment, 1], start) and np.array_equal(
        curves[segment, 2], end
    )
    if not (retracted or is_straight(curves[segment])):
        return chain
    curves[segment, 1] = start + BENT * (end - start)
    curves[segment, 2] = end - BENT * (end - start)
    return _chain(curves, kinds_of(chain))


# Whole contours


def reverse(contour: Contour) -> Contour:
    """Go around the other way; the first point stays the first."""
    if isinstance(contour, PolygonContour):
        return PolygonContour((contour.points[0], *contour.points[:0:-1]))
    kinds = kinds_of(contour)
    return _chain(curves_of(contour)[::-1, ::-1], (kinds[0], *kinds[:0:-1]))


def mirror(contour: Contour) -> Contour:
    """Change the sign of s, and go around the other way, which keeps the winding."""
    return transform(reverse(contour), np.diag((-1.0, 1.0)), np.zeros(2))


def transform(contour: Contour, matrix: FloatArray, shift: FloatArray) -> Contour:
    """Return the contour under the map x -> matrix (2, 2) x + shift (2,)."""
    if isinstance(contour, PolygonContour):
        points = (np.array(contour.points) @ matrix.T + shift).tolist()
        return PolygonContour(tuple((s, t) for s, t in points))
    return _chain(curves_of(contour) @ matrix.T + shift, kinds_of(contour))


def split(contour: Contour, first: int, second: int) -> tuple[Contour, Contour]:
    """Cut a contour in two along the straight line between two of its points.

    Outlines are always closed, so this is what breaking a path at two points and
    closing both parts comes to. The first part begins at the lower of the two.

    Raises
    ------
    SceneError
        If a part would have no inside: the points are one, or joined by a line.
    """
    low, high = sorted((first, second))
    count, straight = size_of(contour), straight_segments(contour)
    beside = (high - low == 1 and straight[low]) or (high - low == count - 1 and straight[high])
    if low == high or beside:
        raise SceneError(
            "an outline cannot be split between points that are one or joined by a straight "
            "line, expected two others"
        )
    if isinstance(contour, PolygonContour):
        inner = contour.points[low : high + 1]
        outer = contour.points[high:] + contour.points[: low + 1]
        return PolygonContour(inner), PolygonContour(outer)
    curves, kinds = curves_of(contour), kinds_of(contour)
    parts = []
    for chosen in ([*range(low, high)], [*range(high, count), *range(low)]):
        part = curves[chosen]
        closing = line_as_cubic(part[-1, 3], part[0, 0])
        inner_kinds = [kinds[i] for i in chosen[1:]]
        parts.append(
            _chain(np.concatenate([part, closing[None]]), ["corner", *inner_kinds, "corner"])
        )
    return parts[0], parts[1]


def to_bezier(contour: Contour) -> BezierContour:
    """Return the same shape as a chain of curves."""
    return contour if isinstance(contour, BezierContour) else _chain(curves_of(contour), ())


def to_polygon(contour: Contour, tolerance: float, metric: FloatArray = UNIT) -> PolygonContour:
    """Return a polygon within a distance of the contour, measured by ``metric``, see `flatten`."""
    if isinstance(contour, PolygonContour):
        return contour
    curves = curves_of(contour)
    counts = cubic.pieces(curves @ metric.T, tolerance, MOST_PIECES)
    if counts.sum() < 3:
        counts[:] = 3
    points = cubic.subdivide(curves, counts).tolist()
    return PolygonContour(tuple((s, t) for s, t in points))


# Inside


def _chain(curves: FloatArray, kinds: Iterable[AnchorKind]) -> BezierContour:
    """Return curves (n, 4, 2) as a contour; what begins where another ends does so exactly."""
    rows = curves.tolist()
    joined: list[CubicCurve] = []
    for row, following in zip(rows, rows[1:] + rows[:1], strict=True):
        a, b, c = ((p[0], p[1]) for p in row[:3])
        joined.append((a, b, c, (following[0][0], following[0][1])))
    kept = tuple(kinds)
    return BezierContour(tuple(joined), kept if any(kind != "corner" for kind in kept) else ())


def _weakened(
    curves: FloatArray, kinds: Iterable[AnchorKind], indices: Iterable[int]
) -> list[AnchorKind]:
    """Return the kinds with those at ``indices`` weakened to what their handles still keep."""
    result = list(kinds)
    for index in indices:
        into = curves[index, 0] - curves[index - 1, 2]
        out = curves[index, 1] - curves[index, 0]
        size = min(length(into), length(out))
        if result[index] == "symmetric" and length(into - out) > UNEQUAL * size:
            result[index] = "smooth"
        if result[index] == "smooth":
            gap = length(unit(into) - unit(out))
            if size == 0.0 or gap > KINK:
                result[index] = "corner"
    return result


def _in_line_with_straight(
    curves: FloatArray,
    kinds: Iterable[AnchorKind],
    straight: NDArray[np.bool_],
    indices: Iterable[int],
    metric: FloatArray,
) -> list[AnchorKind]:
    """Turn handles of smooth anchors, in place, into line with a straight segment beside them."""
    result, to_plane = list(kinds), np.linalg.inv(metric)
    for index in indices:
        before = (index - 1) % len(curves)
        if result[index] == "corner" or not (straight[before] or straight[index]):
            continue
        if straight[before] and straight[index]:
            result = _weakened(curves, result, [index])
            continue
        anchor = curves[index, 0]
        far = curves[before, 0] if straight[before] else curves[index, 3]
        away = unit(metric @ (anchor - far))
        handle = (index, 1) if straight[before] else (before, 2)
        size = length(metric @ (curves[handle] - anchor))
        curves[handle] = anchor + to_plane @ (away * size)
        result[index] = "smooth"
    return result
