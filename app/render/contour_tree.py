"""The outline of a curved light as the shader walks it: a tree of curves and their chords.

A loop of cubics is cut into *leaves* that turn by at most `LARGEST_TURN`. Few
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

LARGEST_TURN = np.pi / 4.0 * 1.01
"""By how much the control polygon of a leaf turns at most [rad]; an eighth of a circle passes."""

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
    skip: NDArray[np.int64]
    is_leaf: NDArray[np.bool_]


def contour_tree(loops: Sequence[FloatArray]) -> TreeNodes:
    """Return the tree of closed loops, each (k, 4, 2) float64 with k >= 1."""
    builder = _Builder()
    builder.loops([_leaves(loop) for loop in loops])
    count = len(builder.area)
    return TreeNodes(
        np.array(builder.curves).reshape(count, 4, 2),
        np.array(builder.disc).reshape(count, 3),
        np.array(builder.area),
        np.array(builder.signed_area),
        np.array(builder.skip, dtype=np.int64),
        np.array(builder.is_leaf, dtype=bool),
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


def _leaves(loop: FloatArray) -> FloatArray:
    """Return a loop cut into pieces that turn little, (n, 4, 2), in order."""
    pieces = np.array(loop, dtype=np.float64)
    for _ in range(MOST_SPLITS):
        bent = (turn(pieces) > LARGEST_TURN) & ~is_straight(pieces)
        if not bent.any():
            break
        halves = np.stack(split(pieces, 0.5), axis=1)
        counts = np.where(bent, 2, 1)
        first = np.cumsum(counts) - counts
        cut = np.empty((int(counts.sum()), 4, 2))
        cut[first] = np.where(bent[:, None, None], halves[:, 0], pieces)
        cut[first[bent] + 1] = halves[bent, 1]
        pieces = cut
    return pieces


def _unsigned_areas(curves: FloatArray) -> FloatArray:
    """Return at least the area between cubics (k, 4, 2) and their chords."""
    t = 0.5 + 0.5 * AREA_NODES
    points = evaluate(curves[:, None], t) - curves[:, None, 0]
    ways = derivative(curves[:, None], t)
    swept = np.abs(points[..., 0] * ways[..., 1] - points[..., 1] * ways[..., 0])
    return np.asarray(0.25 * AREA_MARGIN * (swept @ AREA_WEIGHTS))


class _Builder:
    """Collects nodes in depth-first order."""

    def __init__(self) -> None:
        self.curves: list[FloatArray] = []
        self.disc: list[FloatArray] = []
        self.area: list[float] = []
        self.signed_area: list[float] = []
        self.skip: list[int] = []
        self.is_leaf: list[bool] = []

    def loops(self, loops: Sequence[FloatArray]) -> float:
        """Add a group of loops; return its area bound. Its chord has no length."""
        if len(loops) == 1:
            loop = loops[0]
            straight = is_straight(loop)
            areas = np.where(straight, 0.0, _unsigned_areas(loop))
            return self._run(loop, areas)
        place = self._open(np.concatenate(loops), loops[0][0, 0], loops[0][0, 0])
        return self._close(place, sum(self.loops(loops[run]) for run in _runs(len(loops))))

    def _run(self, leaves: FloatArray, areas: FloatArray) -> float:
        """Add consecutive leaves; return a bound of the area between them and their chord."""
        if len(leaves) == 1:
            place = self._open(leaves, leaves[0, 0], leaves[0, 3])
            self.curves[place] = leaves[0]
            self.is_leaf[place] = True
            return self._close(place, float(areas[0]))
        start = leaves[0, 0]
        place = self._open(leaves, start, leaves[-1, 3])
        runs = _runs(len(leaves))
        ends = np.array([leaves[run][-1, 3] for run in runs]) - start
        inner = sum(self._run(leaves[run], areas[run]) for run in runs)
        # Between the node's chord and those of its children lie triangles.
        cross = ends[:-1, 0] * ends[1:, 1] - ends[:-1, 1] * ends[1:, 0]
        return self._close(place, inner + 0.5 * float(np.abs(cross).sum()))

    def _open(self, leaves: FloatArray, start: FloatArray, end: FloatArray) -> int:
        points = leaves.reshape(-1, 2)
        center = 0.5 * (points.min(axis=0) + points.max(axis=0))
        radius = np.sqrt(((points - center) ** 2).sum(axis=1).max())
        self.curves.append(np.array([start, (0.0, 0.0), (0.0, 0.0), end]))
        self.disc.append(np.array([*center, radius]))
        self.area.append(0.0)
        self.signed_area.append(float(np.sum(signed_areas(leaves - start))))
        self.skip.append(0)
        self.is_leaf.append(False)
        return len(self.area) - 1

    def _close(self, place: int, area: float) -> float:
        self.area[place] = area
        self.skip[place] = len(self.area)
        return area


def _runs(count: int) -> list[slice]:
    """Return up to `BRANCHES` runs of nearly equal length, none empty."""
    edges = np.linspace(0, count, min(BRANCHES, count) + 1).round().astype(int).tolist()
    return [slice(*ends) for ends in pairwise(edges)]
