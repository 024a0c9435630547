"""The outline of a curved light as the shader walks it: a tree of curves and their chords.

A loop of cubics is cut into *leaves* that turn by at most `LARGEST_TURN` and are run
through about evenly. Few
quadrature nodes suffice for such a piece, and its nearest pole is found from its
middle (MATHS: errors of four nodes fall from 1e-3 to 1e-5 when pieces turn by 45
instead of 90 degrees). Runs of consecutive leaves, and runs of loops, are the
inner nodes of a tree of `BRANCHES` each.

Every node knows its chord and a bound of the area between itself and the chord. As
a contour integral a node equals its chord but for the integral over that area, so
wherever the lobe is so thin over it that the area cannot matter, the shader takes
the chord and skips what lies under the node: far leaves, far letters and nearly
straight pieces cost one edge or none. Nodes are stored in depth-first order, each
with the place where its subtree ends, so that a walk needs no stack.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from app.curves import derivative, evaluate, is_straight, signed_areas, split

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

LARGEST_TURN = np.pi / 4.0 * 1.01
"""By how much the control polygon of a leaf turns at most [rad]; an eighth of a circle passes."""

SLOWEST = 0.25
"""How much shorter than another a step of a leaf's control polygon may be. Where the
velocity all but vanishes, a node sees its pole too far away, and four of them err by 1e-3."""

MOST_SPLITS = 6
"""Halvings of a curve. At a cusp all of the turn stays in one piece, 2^-6 of the curve."""

BRANCHES = 4

AREA_NODES, AREA_WEIGHTS = (part for part in np.polynomial.legendre.leggauss(16))
AREA_MARGIN = 1.02
"""For the kinks of |(p - a) x p'|, which 16 nodes resolve to 1 %."""


@dataclass(frozen=True, eq=False)
class TreeNodes:
    """Nodes in depth-first order.

    Attributes
    ----------
    curves : (n, 4, 2) float64
        Leaves: the cubic. Inner nodes: their chord, handles zero.
    disc : (n, 3) float64
        Center and radius of a disc around node and chord.
    area : (n,) float64
        At least the area between node and chord, overlaps counted as often as
        they are wound around; 0 for straight leaves.
    signed_area : (n,) float64
        The same where areas to the right of the chord count positive and those to
        the left negative.
    skip : (n,) int64
        Index of the first node after the subtree.
    is_leaf : (n,) bool
    """

    curves: FloatArray
    disc: FloatArray
    area: FloatArray
    signed_area: FloatArray
    skip: IntArray
    is_leaf: BoolArray


def contour_tree(loops: Sequence[FloatArray]) -> TreeNodes:
    """Return the tree of closed loops, each (k, 4, 2) float64 with k >= 1."""
    leaves, counts = _leaves(loops)
    shape = _Shape.over(counts)
    first, end = np.array(shape.first), np.array(shape.end)
    start, stop = leaves[first, 0], leaves[end - 1, 3]
    # A group of loops has no chord: it ends where it starts.
    stop[shape.is_group] = start[shape.is_group]
    is_leaf = end - first == 1
    curves = np.stack([start, np.zeros_like(start), np.zeros_like(start), stop], axis=1)
    curves[is_leaf] = leaves[first[is_leaf]]
    before = np.concatenate([[0.0], np.cumsum(signed_areas(leaves))])
    return TreeNodes(
        curves,
        _discs(leaves, first, end, np.array(shape.depth)),
        _area_bounds(leaves, shape, stop - start),
        before[end] - before[first] + 0.5 * _cross(stop, start),
        np.array(shape.skip),
        is_leaf,
    )


def curve_list(loops: Sequence[FloatArray]) -> TreeNodes:
    """Return the curves of closed loops uncut and without inner nodes.

    For the published methods of integration, which take every curve whole.
    """
    curves = np.concatenate([np.zeros((0, 4, 2)), *loops])
    center = 0.5 * (curves.min(axis=1) + curves.max(axis=1))
    radius = np.sqrt(((curves - center[:, None]) ** 2).sum(axis=-1).max(axis=1, initial=0.0))
    return TreeNodes(
        curves,
        np.column_stack([center, radius]),
        np.where(is_straight(curves), 0.0, _unsigned_areas(curves)),
        signed_areas(curves - curves[:, :1]),
        np.arange(1, len(curves) + 1),
        np.ones(len(curves), dtype=bool),
    )


def turn(curves: FloatArray) -> FloatArray:
    """Return by how much the control polygons of cubics (k, 4, 2) turn, (k,), [rad]."""
    steps = np.diff(curves, axis=1)
    lengths = np.hypot(steps[..., 0], steps[..., 1])
    real = lengths > 1e-9 * lengths.sum(axis=1, keepdims=True)
    # A step of no length has no direction: it takes the one before, or the one after.
    steps[:, 1] = np.where(
        real[:, 1:2], steps[:, 1], np.where(real[:, :1], steps[:, 0], steps[:, 2])
    )
    steps[:, 0] = np.where(real[:, :1], steps[:, 0], steps[:, 1])
    steps[:, 2] = np.where(real[:, 2:], steps[:, 2], steps[:, 1])
    a, b = steps[:, :-1], steps[:, 1:]
    cross = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    total: FloatArray = np.abs(np.arctan2(cross, (a * b).sum(axis=-1))).sum(axis=1)
    return total


def is_uneven(curves: FloatArray) -> BoolArray:
    """Return whether the velocity along cubics (k, 4, 2) all but vanishes somewhere, (k,)."""
    steps = np.diff(curves, axis=1)
    lengths = np.hypot(steps[..., 0], steps[..., 1])
    return np.asarray(lengths.min(axis=1) < SLOWEST * lengths.max(axis=1))


def _leaves(loops: Sequence[FloatArray]) -> tuple[FloatArray, list[int]]:
    """Return loops cut into pieces that turn little: (n, 4, 2) in order, and each loop's number."""
    pieces = np.concatenate(loops)
    owner = np.repeat(np.arange(len(loops)), [len(loop) for loop in loops])
    for _ in range(MOST_SPLITS):
        bent = ((turn(pieces) > LARGEST_TURN) | is_uneven(pieces)) & ~is_straight(pieces)
        if not bent.any():
            break
        halves = split(pieces[bent], 0.5)
        counts = np.where(bent, 2, 1)
        place = (np.cumsum(counts) - counts)[bent]
        pieces, owner = np.repeat(pieces, counts, axis=0), np.repeat(owner, counts)
        pieces[place], pieces[place + 1] = halves
    return pieces, np.bincount(owner, minlength=len(loops)).tolist()


def _unsigned_areas(curves: FloatArray) -> FloatArray:
    """Return at least the area between cubics (k, 4, 2) and their chords."""
    t = 0.5 + 0.5 * AREA_NODES
    points = evaluate(curves[:, None], t) - curves[:, None, 0]
    ways = derivative(curves[:, None], t)
    swept = np.abs(points[..., 0] * ways[..., 1] - points[..., 1] * ways[..., 0])
    return np.asarray(0.25 * AREA_MARGIN * (swept @ AREA_WEIGHTS))


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


@dataclass
class _Shape:
    """Which leaves each node of the tree spans, ``first`` to ``end``, in depth-first order."""

    first: list[int]
    end: list[int]
    depth: list[int]
    skip: list[int]
    is_group: list[bool]

    @classmethod
    def over(cls, counts: Sequence[int]) -> _Shape:
        """Return the tree over loops of so many leaves each."""
        shape = cls([], [], [], [], [])
        bounds = np.concatenate([[0], np.cumsum(counts)]).tolist()
        shape._add_loops(bounds, 0)
        return shape

    def _add_loops(self, bounds: Sequence[int], depth: int) -> None:
        if len(bounds) == 2:
            self._add_run(bounds[0], bounds[1], depth)
            return
        place = self._open(bounds[0], bounds[-1], depth, is_group=True)
        for run in _runs(len(bounds) - 1):
            self._add_loops(bounds[run.start : run.stop + 1], depth + 1)
        self.skip[place] = len(self.first)

    def _add_run(self, first: int, end: int, depth: int) -> None:
        place = self._open(first, end, depth, is_group=False)
        if end - first > 1:
            for run in _runs(end - first):
                self._add_run(first + run.start, first + run.stop, depth + 1)
        self.skip[place] = len(self.first)

    def _open(self, first: int, end: int, depth: int, *, is_group: bool) -> int:
        self.first.append(first)
        self.end.append(end)
        self.depth.append(depth)
        self.skip.append(0)
        self.is_group.append(is_group)
        return len(self.first) - 1

    def children(self, node: int) -> list[int]:
        """Return the nodes right below a node."""
        found, child = [], node + 1
        while child < self.skip[node]:
            found.append(child)
            child = self.skip[child]
        return found


def _discs(leaves: FloatArray, first: IntArray, end: IntArray, depth: IntArray) -> FloatArray:
    """Return discs (m, 3) around the control points of nodes that span leaves."""
    low, high = leaves.min(axis=1), leaves.max(axis=1)
    discs = np.zeros((len(first), 3))
    for level in range(int(depth.max()) + 1):
        # Nodes of one level span leaves side by side, but not all leaves.
        nodes = np.flatnonzero(depth == level)
        counts = (end - first)[nodes]
        starts = np.cumsum(counts) - counts
        spanned = np.arange(counts.sum()) + np.repeat(first[nodes] - starts, counts)
        center = 0.5 * np.minimum.reduceat(low[spanned], starts, axis=0)
        center += 0.5 * np.maximum.reduceat(high[spanned], starts, axis=0)
        away = leaves[spanned] - np.repeat(center, counts, axis=0)[:, None]
        reach = np.maximum.reduceat((away**2).sum(axis=-1).max(axis=1), starts)
        discs[nodes] = np.column_stack([center, np.sqrt(reach)])
    return discs


def _area_bounds(leaves: FloatArray, shape: _Shape, chords: FloatArray) -> FloatArray:
    """Return at least the area between each node and its chord, (m,)."""
    areas = np.where(is_straight(leaves), 0.0, _unsigned_areas(leaves))
    bounds = np.zeros(len(shape.first))
    for node in reversed(range(len(bounds))):
        below = shape.children(node)
        if not below:
            bounds[node] = areas[shape.first[node]]
            continue
        bounds[node] = bounds[below].sum()
        if not shape.is_group[node]:
            # Between the node's chord and those of its children lie triangles.
            ends = np.cumsum(chords[below], axis=0)
            bounds[node] += 0.5 * np.abs(_cross(ends[:-1], ends[1:])).sum()
    return bounds


def _runs(count: int) -> list[slice]:
    """Return up to `BRANCHES` runs of nearly equal length, none empty."""
    edges = np.linspace(0, count, min(BRANCHES, count) + 1).round().astype(int).tolist()
    return [slice(*ends) for ends in pairwise(edges)]
