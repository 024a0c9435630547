"""From an outline as drawn to loops that can be integrated, filled and picked.

A scene's outline may cross itself, touch itself, repeat vertices and wind as
it likes; ``fill_rule`` says what is inside. `boundary` turns it into simple
loops of cubics with the interior on the left, which is all that the integrals
need; `resolve` into simple polygons. `app.curve_arrangement` and
`app.polygon_arrangement` say how.
"""

from __future__ import annotations

import math
from collections import OrderedDict
from functools import cached_property
from itertools import pairwise
from typing import TypeVar

import mapbox_earcut
import numpy as np
from numpy.typing import NDArray

from app import curves
from app.curve_arrangement import curve_boundary
from app.monotone_pieces import winding_number
from app.polygon_arrangement import (
    Region,
    cross,
    frame,
    polygon_regions,
    ray_crossings,
    signed_area,
)
from app.scene import BezierContour, Contour, Outline, PolygonContour

__all__ = ["area", "boundary", "contains", "resolve", "signed_area", "triangulate"]

FloatArray = NDArray[np.float64]
Triangles = NDArray[np.int32]
Array = TypeVar("Array", FloatArray, Triangles)

FLATNESS = 1e-4
"""How far `resolve` may be from a curve, in extents of the outline: a tenth of a pixel of a
light as high as the window."""

SHRINKS = (0.0, 1e-6, 1e-4, 1e-2)
"""How far holes are drawn together for triangulation, in lengths of their edges, tried in turn."""

CACHED_VERTICES = 1_000_000
"""Of the outlines whose results are kept; beyond it the longest unused ones go."""

CURVE_SIZE = 16
"""Vertices that a curve counts for: its controls, its boundary and its lines."""


def boundary(outline: Outline) -> tuple[FloatArray, ...]:
    """Return the boundary of an outline's inside as loops of cubic Bézier curves.

    Parameters
    ----------
    outline : Outline
        Any contours; coordinates in its plane's (s, t).

    Returns
    -------
    tuple of (k, 4, 2) float64, read-only
        Closed loops that do not cross, with the interior on the left: outer
        loops counter-clockwise, holes clockwise. Each curve ends in the very
        float64 point in which the next one begins, the last one in the first's.
        Straight pieces have their handles at the thirds
        (`app.curves.is_straight`). Curves of zero length are left out. Empty if
        nothing is inside. Of contours that cross nothing the curves are the
        caller's own, at most travelled backwards.
    """
    return _kept(outline).boundary


def resolve(outline: Outline) -> tuple[FloatArray, ...]:
    """Return the boundary of an outline's inside as simple polygons.

    Parameters
    ----------
    outline : Outline
        Any contours; coordinates in its plane's (s, t).

    Returns
    -------
    tuple of (k, 2) float64, read-only
        Closed loops (the last vertex joins the first) that do not cross, with
        the interior on the left: outer loops counter-clockwise, each followed
        by its holes, clockwise. No repeated or collinear vertices, no loops
        without area; empty if nothing is inside.

    Notes
    -----
    Exact for polygons. Curves are drawn as lines within `FLATNESS` of the
    extent: for picking and for overlays, not for light.
    """
    return tuple(loop for region in _kept(outline).regions for loop in region.loops)


def area(outline: Outline) -> float:
    """Return the area inside an outline in its plane's units, never negative."""
    if not _has_curves(outline):
        return float(sum(signed_area(loop) for loop in resolve(outline)))
    # About a point of the loop, lest a far place costs digits.
    return float(sum(np.sum(curves.signed_areas(loop - loop[0, 0])) for loop in boundary(outline)))


def triangulate(outline: Outline) -> tuple[FloatArray, Triangles]:
    """Return triangles that cover an outline's inside once.

    Returns
    -------
    points : (n, 2) float64, read-only
        The vertices of `resolve`, in its order.
    triangles : (m, 3) int32, read-only
        Indices into ``points``, counter-clockwise.

    Notes
    -----
    Ear clipping, for drawing only: of a thousand random polygons that overlap
    and touch themselves it missed a sliver or covered one twice in fewer than
    one. `boundary`, which the light is computed from, has no such exceptions.
    """
    return _kept(outline).triangulation


def contains(outline: Outline, point: tuple[float, float]) -> bool:
    """Return whether a point (s, t) is inside an outline; on the boundary, either."""
    place = np.array(point, dtype=np.float64)
    if not _has_curves(outline):
        return sum(ray_crossings(loop, place) for loop in resolve(outline)) % 2 == 1
    chains = [_as_chain(contour) for contour in outline.contours]
    winding = winding_number(np.concatenate(chains), place)
    return winding % 2 != 0 if outline.fill_rule == "evenodd" else winding != 0


def _triangulated(regions: tuple[Region, ...]) -> tuple[FloatArray, Triangles]:
    points: list[FloatArray] = []
    triangles: list[Triangles] = []
    start = 0
    for region in regions:
        loops = region.loops
        vertices = np.concatenate(loops)
        ends = np.cumsum([len(loop) for loop in loops]).astype(np.uint32)
        low, high = vertices.min(axis=0), vertices.max(axis=0)
        unit = (vertices - low) / (high - low)
        indices = _covering_triangles(unit, ends)
        points.append(vertices)
        triangles.append(indices + start)
        start += len(vertices)
    if not points:
        return _frozen(np.zeros((0, 2))), _frozen(np.zeros((0, 3), np.int32))
    return _frozen(np.concatenate(points)), _frozen(np.concatenate(triangles).astype(np.int32))


def _covering_triangles(vertices: FloatArray, ends: NDArray[np.uint32]) -> Triangles:
    """Triangulate an outer loop and its holes, given one after another in the unit square.

    Earcut goes wrong where a hole touches another loop. The areas tell; then
    the holes are drawn together a little, and the triangles, as indices, serve
    the unmoved vertices just as well.
    """
    loops = list(pairwise([0, *ends.tolist()]))
    wanted = sum(signed_area(vertices[first:end]) for first, end in loops)
    best, least = np.zeros((0, 3), dtype=np.int32), math.inf
    for apart in SHRINKS:
        moved = vertices.copy()
        for first, end in loops[1:]:
            moved[first:end] += apart * _into_the_hole(vertices[first:end])
        triangles = mapbox_earcut.triangulate_float64(moved, ends).astype(np.int32).reshape(-1, 3)
        a, b, c = (vertices[triangles[:, i]] for i in range(3))
        doubled = cross(b - a, c - a)
        triangles[doubled < 0.0] = triangles[doubled < 0.0][:, ::-1]
        wrong = abs(0.5 * float(np.sum(np.abs(doubled))) - wanted)
        if wrong < least:
            best, least = triangles, wrong
        if least <= 1e-9 * wanted:
            break
    return best


def _into_the_hole(loop: FloatArray) -> FloatArray:
    """Return a step off each vertex of a clockwise loop into it, as long as its shorter edge."""
    before, after = np.roll(loop, 1, axis=0) - loop, np.roll(loop, -1, axis=0) - loop
    lengths = np.hypot(*before.T), np.hypot(*after.T)
    along = after / lengths[1][:, None] - before / lengths[0][:, None]
    right = np.stack((along[:, 1], -along[:, 0]), axis=1)
    right /= np.maximum(np.hypot(*right.T), 1e-3)[:, None]
    return np.asarray(np.minimum(*lengths)[:, None] * right)


def _frozen(array: Array) -> Array:
    array.setflags(write=False)
    return array


def _has_curves(outline: Outline) -> bool:
    return any(isinstance(contour, BezierContour) for contour in outline.contours)


def _as_points(contour: PolygonContour) -> FloatArray:
    return np.asarray(contour.points, dtype=np.float64)


def _as_chain(contour: Contour) -> FloatArray:
    """Return a contour as a closed chain of cubics (k, 4, 2)."""
    if isinstance(contour, BezierContour):
        return np.asarray(contour.curves, dtype=np.float64)
    points = _as_points(contour)
    return curves.line_as_cubic(points, np.roll(points, -1, axis=0))


class _Kept:
    """What is known of an outline, each part computed when it was first asked for."""

    def __init__(self, outline: Outline) -> None:
        self._outline = outline

    @cached_property
    def boundary(self) -> tuple[FloatArray, ...]:
        if _has_curves(self._outline):
            chains = [_as_chain(contour) for contour in self._outline.contours]
            loops = curve_boundary(chains, self._outline.fill_rule)
        else:
            corners = (loop for region in self.regions for loop in region.loops)
            loops = [curves.line_as_cubic(loop, np.roll(loop, -1, axis=0)) for loop in corners]
        return tuple(_frozen(loop) for loop in loops)

    @cached_property
    def regions(self) -> tuple[Region, ...]:
        polygons = [
            _as_points(contour)
            for contour in self._outline.contours
            if isinstance(contour, PolygonContour)
        ]
        if len(polygons) == len(self._outline.contours):
            return polygon_regions(polygons, self._outline.fill_rule)
        if not self.boundary:
            return ()
        extent = frame(np.concatenate(self.boundary).reshape(-1, 2))
        if extent is None:
            return ()
        tolerance = FLATNESS * 2.0 * float(np.max(extent[1]))
        lines = [curves.flatten(loop, tolerance) for loop in self.boundary]
        # Lines of curves that nearly touch may cross, so they are resolved in their turn.
        return polygon_regions(lines, "nonzero")

    @cached_property
    def triangulation(self) -> tuple[FloatArray, Triangles]:
        return _triangulated(self.regions)


class _Cache:
    """Keeps what was used last, by number of vertices: a drag makes many outlines."""

    def __init__(self) -> None:
        self._kept: OrderedDict[Outline, _Kept] = OrderedDict()
        self._vertices = 0

    def __call__(self, outline: Outline) -> _Kept:
        """Look an outline up, or begin to resolve it."""
        kept = self._kept.get(outline)
        if kept is None:
            kept = self._kept[outline] = _Kept(outline)
            self._vertices += _size(outline)
            while self._vertices > CACHED_VERTICES and len(self._kept) > 1:
                oldest, _ = self._kept.popitem(last=False)
                self._vertices -= _size(oldest)
        self._kept.move_to_end(outline)
        return kept


_kept = _Cache()


def _size(outline: Outline) -> int:
    return sum(
        len(contour.points)
        if isinstance(contour, PolygonContour)
        else CURVE_SIZE * len(contour.curves)
        for contour in outline.contours
    )
