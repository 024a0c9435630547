"""From an outline as drawn to loops that can be integrated, filled and picked.

A scene's outline may cross itself, touch itself, repeat vertices and wind as
it likes; ``fill_rule`` says what is inside. `resolve` turns it into simple
loops with the interior on the left, which is all that the integrals need.

The boolean work is Clipper's (Vatti's sweep on integers, through pyclipper).
Each axis is mapped to integers of its own scale: insideness does not change
under affine maps, and an axis-aligned needle keeps its thickness. Vertices
that survive unchanged are replaced by the caller's float64 coordinates, so
only true crossings carry the grid's rounding of 2^-44 of the extent.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import TypeVar

import mapbox_earcut
import numpy as np
import pyclipper
from numpy.typing import NDArray

from app.scene import Outline

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int32]
Array = TypeVar("Array", FloatArray, IntArray)

GRID = 2.0**44
"""Integer coordinates run from -GRID to GRID; Clipper's double slopes stay exact to 2^-9 units."""

CACHED_OUTLINES = 4096

_FILL = {"evenodd": pyclipper.PFT_EVENODD, "nonzero": pyclipper.PFT_NONZERO}


@dataclass(frozen=True)
class _Region:
    """A connected piece: an outer loop, counter-clockwise, and its holes, clockwise."""

    outer: FloatArray
    holes: tuple[FloatArray, ...]


def resolve(outline: Outline) -> tuple[FloatArray, ...]:
    """Return the boundary of an outline's inside as simple loops.

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
    """
    return tuple(loop for region in _regions(outline) for loop in (region.outer, *region.holes))


def area(outline: Outline) -> float:
    """Return the area inside an outline in its plane's units, never negative."""
    return float(sum(signed_area(loop) for loop in resolve(outline)))


def signed_area(loop: FloatArray) -> float:
    """Return the area of a closed loop (k, 2), positive if counter-clockwise."""
    local = loop - loop[0]
    following = np.roll(local, -1, axis=0)
    return 0.5 * float(np.sum(local[:, 0] * following[:, 1] - local[:, 1] * following[:, 0]))


@lru_cache(maxsize=CACHED_OUTLINES)
def triangulate(outline: Outline) -> tuple[FloatArray, IntArray]:
    """Return triangles that cover an outline's inside once.

    Returns
    -------
    points : (n, 2) float64, read-only
        The vertices of `resolve`, in its order.
    triangles : (m, 3) int32, read-only
        Indices into ``points``, counter-clockwise.
    """
    points: list[FloatArray] = []
    triangles: list[IntArray] = []
    start = 0
    for region in _regions(outline):
        loops = (region.outer, *region.holes)
        vertices = np.concatenate(loops)
        ends = np.cumsum([len(loop) for loop in loops]).astype(np.uint32)
        low, high = vertices.min(axis=0), vertices.max(axis=0)
        unit = (vertices - low) / (high - low)
        indices = mapbox_earcut.triangulate_float64(unit, ends).astype(np.int32).reshape(-1, 3)
        a, b, c = (unit[indices[:, i]] for i in range(3))
        clockwise = _cross(b - a, c - a) < 0.0
        indices[clockwise] = indices[clockwise][:, ::-1]
        points.append(vertices)
        triangles.append(indices + start)
        start += len(vertices)
    if not points:
        return _frozen(np.zeros((0, 2))), _frozen(np.zeros((0, 3), np.int32))
    return _frozen(np.concatenate(points)), _frozen(np.concatenate(triangles).astype(np.int32))


def contains(outline: Outline, point: tuple[float, float]) -> bool:
    """Return whether a point (s, t) is inside an outline; on the boundary, either."""
    s, t = point
    crossings = 0
    for loop in resolve(outline):
        a, b = loop, np.roll(loop, -1, axis=0)
        spans = (a[:, 1] <= t) != (b[:, 1] <= t)
        a, b = a[spans], b[spans]
        side = (b[:, 0] - a[:, 0]) * (t - a[:, 1]) - (s - a[:, 0]) * (b[:, 1] - a[:, 1])
        crossings += int(np.count_nonzero((side > 0.0) == (b[:, 1] > a[:, 1])))
    return crossings % 2 == 1


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def _frozen(array: Array) -> Array:
    array.setflags(write=False)
    return array


@lru_cache(maxsize=CACHED_OUTLINES)
def _regions(outline: Outline) -> tuple[_Region, ...]:
    contours = [np.asarray(contour.points, dtype=np.float64) for contour in outline.contours]
    everything = np.concatenate(contours)
    low, high = everything.min(axis=0), everything.max(axis=0)
    centre = 0.5 * low + 0.5 * high
    half = np.maximum(high - centre, centre - low)
    # Below the normal range the division would lose all digits; such an extent is nothing.
    if not np.all(half > np.finfo(np.float64).tiny * 2.0**60):
        return ()

    clipper = pyclipper.Pyclipper()
    clipper.StrictlySimple = True
    original: dict[tuple[int, int], FloatArray] = {}
    added = False
    for contour in contours:
        grid = np.rint((contour - centre) / half * GRID).astype(np.int64)
        path = [(int(x), int(y)) for x, y in grid]
        for key, vertex in zip(path, contour, strict=True):
            original.setdefault(key, vertex)
        try:
            clipper.AddPath(path, pyclipper.PT_SUBJECT, True)
            added = True
        except pyclipper.ClipperException:
            continue  # Clipper's word for a contour without area
    if not added:
        return ()
    fill = _FILL[outline.fill_rule]
    tree = clipper.Execute2(pyclipper.CT_UNION, fill, fill)

    def loop_of(path: list[list[int]]) -> FloatArray | None:
        grid = _without_collinear(np.asarray(path, dtype=np.float64))
        if len(grid) < 3 or not _is_wider_than_grid(grid):
            return None
        rounded = grid / GRID * half + centre
        for i, (x, y) in enumerate(grid):
            exact = original.get((int(x), int(y)))
            if exact is not None:
                rounded[i] = exact
        loop: FloatArray = _frozen(rounded)
        return loop

    regions: list[_Region] = []
    for outer_node in _outer_nodes(tree):
        outer = loop_of(outer_node.Contour)
        if outer is None:
            continue
        holes = (loop_of(child.Contour) for child in outer_node.Childs)
        regions.append(_Region(outer, tuple(hole for hole in holes if hole is not None)))
    return tuple(regions)


def _outer_nodes(tree: pyclipper.PyPolyNode) -> Iterable[pyclipper.PyPolyNode]:
    """Yield the outer loops of a Clipper tree, islands within holes included."""
    waiting = list(reversed(tree.Childs))
    while waiting:
        node = waiting.pop()
        if node.IsHole:
            waiting.extend(reversed(node.Childs))
            continue
        yield node
        waiting.extend(reversed(node.Childs))


def _without_collinear(grid: FloatArray) -> FloatArray:
    """Drop repeated and exactly collinear vertices of a loop, spikes included."""
    while len(grid) >= 3:
        before = grid - np.roll(grid, 1, axis=0)
        after = np.roll(grid, -1, axis=0) - grid
        # Differences of these integers are exact in float64, their products are not:
        # Python's integers decide the few vertices in doubt.
        turn = _cross(before, after)
        doubt = np.abs(turn) <= 2.0**-50 * (
            np.abs(before[:, 0] * after[:, 1]) + np.abs(before[:, 1] * after[:, 0])
        )
        drop = np.zeros(len(grid), dtype=bool)
        for i in np.flatnonzero(doubt):
            bx, by, ax, ay = (int(x) for x in (*before[i], *after[i]))
            # Not two neighbours in one round: the second may turn once the first is gone.
            drop[i] = (
                bx * ay == by * ax and not drop[i - 1] and not (i == len(grid) - 1 and drop[0])
            )
        if not drop.any():
            break
        grid = grid[~drop]
    return grid


def _is_wider_than_grid(grid: FloatArray) -> bool:
    """Tell a loop with area from a sliver that rounding left: wider than two grid steps."""
    perimeter = float(np.sum(np.hypot(*(np.roll(grid, -1, axis=0) - grid).T)))
    return abs(signed_area(grid)) > perimeter
