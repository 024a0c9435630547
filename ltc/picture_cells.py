"""A light's outline and its picture's texels, cut into patches on which both are smooth.

A picture is interpolated bilinearly, so it is one polynomial on each *cell* between four
texel centres and none across. What integrates over a light with a picture exactly
(`ltc.textured_reference`) needs its region as patches that lie in one cell each.

Patches by Green's theorem. For any outline, with holes or without,

    area integral of F du dv = contour integral of (int from c to u(t) of F(u, v(t)) du) dv(t)

with any constant c. The outline is cut where it passes from cell to cell, and the inner
integral where it does: each piece of outline carries one patch for each cell of its row
between c and itself, whose sides are straight but for the piece. Patches
beside the light cancel, since the left and the right part of the outline run against each other.

What is integrated must be smooth there too. c is left of everything or right of
everything, as the caller says: towards the side where the surface's horizon is farther away.
"""

from __future__ import annotations

from typing import Any, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from ltc import bezier
from ltc.quadrature import gauss_legendre

FloatArray: TypeAlias = npt.NDArray[np.float64]
IntArray: TypeAlias = npt.NDArray[np.intp]
BoolArray: TypeAlias = npt.NDArray[np.bool_]


class Patches(NamedTuple):
    """Patches (t, s) in [0, 1]^2: v from the curve at t, u between two sides at s."""

    item: IntArray
    """(m): the light each belongs to, ascending."""
    curve: FloatArray
    """(m, 4, 2): the piece of outline."""
    side: FloatArray
    """(m, 2): u of the left and of the right side; NaN where it is the curve."""
    cell: IntArray
    """(m, 2): column and row of the cell, from -1: its lower corner is that texel's centre."""

    def points(
        self, k: IntArray, t: FloatArray, s: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return (points (p, a, b, 2), their d/dt and d/ds) of patches k (p).

        At each pair of ``t`` (p, a) and ``s`` (p, b).
        """
        c = self.curve[k]
        at = bezier.evaluate(c[:, None], t)
        slope = bezier.derivative(c[:, None], t)
        u, du = [], []
        for j in range(2):
            side = self.side[k, j, None]
            free = np.isnan(side)
            u.append(np.where(free, at[..., 0], side)[..., None])
            du.append(np.where(free, slope[..., 0], 0.0)[..., None])
        s = s[:, None, :]
        shape = np.broadcast_shapes(u[0].shape, s.shape)
        point, along, across = (np.zeros((*shape, 2)) for _ in range(3))
        point[..., 0] = u[0] + s * (u[1] - u[0])
        point[..., 1] = at[..., 1, None]
        along[..., 0] = du[0] + s * (du[1] - du[0])
        along[..., 1] = slope[..., 1, None]
        across[..., 0] = u[1] - u[0]
        return point, along, across


def patches(
    curves: FloatArray, item: IntArray, rightwards: BoolArray, columns: int, rows: int
) -> Patches:
    """Return the patches of several lights.

    Parameters
    ----------
    curves : (m, 4, 2) float64
        Closed outlines in picture coordinates, counter-clockwise about u x v, holes the other way.
        Beyond the picture's rectangle [0, 1]^2 its edge goes on.
    item : (m) intp
        The light each curve belongs to.
    rightwards : (items) bool
        Whether a light's patches lie to the right of its outline.
    columns, rows : int
        Texels of the picture.

    Returns
    -------
    Patches
        The integral of F over a light is the sum over its patches of the integral of
        F (dv/dt) (du/ds) dt ds.
    """
    curve, lo, hi = _cuts(curves, (columns, rows), 0.5)
    pieces = bezier.part(curves[curve], lo, hi)
    item = item[curve]
    rising = np.any(np.diff(pieces[..., 1], axis=-1) != 0.0, axis=-1)
    pieces, item = pieces[rising], item[rising]
    middle = bezier.evaluate(pieces, np.full(len(pieces), 0.5))
    size = np.array([columns, rows])
    cell = np.clip(np.floor(middle * size - 0.5), -1, size - 1).astype(np.intp)

    ends = np.zeros((rightwards.size, 2))
    ends[:, 0], ends[:, 1] = np.inf, -np.inf
    np.minimum.at(ends[:, 0], item, np.min(pieces[..., 0], axis=-1))
    np.maximum.at(ends[:, 1], item, np.max(pieces[..., 0], axis=-1))
    used = np.isfinite(ends[:, 0])
    last = np.zeros(ends.shape, dtype=np.intp)
    last[used] = np.clip(np.floor(ends[used] * columns - 0.5), -1, columns - 1).astype(np.intp)
    right = rightwards[item]
    first = np.where(right, cell[:, 0], last[item, 0])
    stop = np.where(right, last[item, 1], cell[:, 0])
    count = np.maximum(stop - first + 1, 1)
    piece = np.repeat(np.arange(len(pieces)), count)
    column = first[piece] + np.arange(piece.size) - np.repeat(np.cumsum(count) - count, count)

    owner, right = item[piece], right[piece]
    own = column == cell[piece, 0]
    left_side = np.maximum((column + 0.5) / columns, ends[owner, 0])
    right_side = np.minimum((column + 1.5) / columns, ends[owner, 1])
    left_side = np.where(column == -1, ends[owner, 0], left_side)
    right_side = np.where(column == columns - 1, ends[owner, 1], right_side)
    side = np.stack(
        [np.where(own & right, np.nan, left_side), np.where(own & ~right, np.nan, right_side)],
        axis=-1,
    )
    # To the right of the outline the inner integral runs backwards: so does the curve.
    shape = np.where(right[:, None, None], pieces[piece][:, ::-1], pieces[piece])
    cells = np.stack([column, cell[piece, 1]], axis=-1)
    order = np.argsort(owner, kind="stable")
    flat = np.all(shape[:, :, 0] == np.where(right, side[:, 1], side[:, 0])[:, None], axis=1)
    order = order[~(own & flat)[order]]  # those without width
    return Patches(owner[order], shape[order], side[order], cells[order])


def _cuts(
    curves: FloatArray, size: tuple[int, int], offset: float
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return (curve, from, to) of the parts of curves (m, 4, 2) between the lines of a grid.

    The lines are at (k + offset)/n, from k = 0 while they are at 1 or less.
    """
    m = curves.shape[0]
    found = [(np.arange(m), np.zeros(m)), (np.arange(m), np.ones(m))]
    for axis, n in enumerate(size):
        x = curves[..., axis]
        most = n - int(np.ceil(offset))
        first = np.clip(np.ceil(np.min(x, axis=-1) * n - offset), 0, most + 1).astype(np.intp)
        last = np.clip(np.floor(np.max(x, axis=-1) * n - offset), -1, most).astype(np.intp)
        count = np.maximum(last - first + 1, 0)
        which = np.repeat(np.arange(m), count)
        line = first[which] + np.arange(which.size) - np.repeat(np.cumsum(count) - count, count)
        places, changes = bezier.sign_changes(x[which] - ((line + offset) / n)[:, None])
        row, j = np.nonzero(np.arange(3) < changes[:, None])
        found.append((which[row], places[row, j]))
    curve = np.concatenate([c for c, _ in found])
    t = np.concatenate([t for _, t in found])
    order = np.lexsort((t, curve))
    curve, t = curve[order], t[order]
    inside = (curve[:-1] == curve[1:]) & (t[1:] - t[:-1] > 1e-13)
    return curve[:-1][inside], t[:-1][inside], t[1:][inside]


def coverage(curves: FloatArray, columns: int, rows: int) -> FloatArray:
    """Return which share of each texel an outline covers.

    Parameters
    ----------
    curves : (m, 4, 2) float64
        Closed outlines in picture coordinates, counter-clockwise about u x v, holes the other
        way; simple, so that no point is covered twice.
    columns, rows : int
        Texels of the rectangle [0, 1]^2.

    Returns
    -------
    (rows, columns) float64
        Exact areas over the texel's, in [0, 1].

    Notes
    -----
    Green's theorem again: a piece of outline within a texel adds the area between itself and
    the texel's right side, and its rise to all texels further right. The area is a
    polynomial of degree 5 in the curve's parameter, which three nodes integrate exactly.
    """
    curve, lo, hi = _cuts(curves, (columns, rows), 0.0)
    pieces = bezier.part(curves[curve], lo, hi)
    middle = bezier.evaluate(pieces, np.full(len(pieces), 0.5)) * [columns, rows]
    # What is left of the rectangle covers as much of a row as its left side would.
    column = np.maximum(np.floor(middle[:, 0]), -1.0).astype(np.intp)
    row = np.floor(middle[:, 1]).astype(np.intp)
    within = (row >= 0) & (row < rows) & (column < columns)
    pieces, column, row = pieces[within], column[within], row[within]
    x, w = gauss_legendre(3)
    at = bezier.evaluate(pieces[:, None], x)[..., 0] * columns
    rise = bezier.derivative(pieces[:, None], x)[..., 1] * rows * w
    # Outwards to the right the outline rises: it ends the cover, so all signs are turned.
    area, step = np.zeros((rows, columns + 1)), np.zeros((rows, columns + 1))
    own = np.sum(rise * (column[:, None] + 1.0 - at), axis=1)
    np.add.at(area, (row, column), np.where(column >= 0, own, 0.0))
    np.add.at(step, (row, column + 1), np.sum(rise, axis=1))
    covered = -(area + np.cumsum(step, axis=1))[:, :columns]
    return np.asarray(np.clip(covered, 0.0, 1.0) + 0.0)  # no -0


def bilinear(picture: npt.NDArray[Any], uv: FloatArray) -> FloatArray:
    """Return a picture's values at points.

    Parameters
    ----------
    picture : (rows, columns, C) float
        Texels; the centre of [j, i] is at u = (i + 1/2)/columns, v = (j + 1/2)/rows.
    uv : (..., 2) float64
        Points; beyond the outermost centres the edge goes on.

    Returns
    -------
    (..., C) float64
    """
    rows, columns = picture.shape[:2]
    x = np.clip(uv[..., 0] * columns - 0.5, 0.0, columns - 1.0)
    y = np.clip(uv[..., 1] * rows - 0.5, 0.0, rows - 1.0)
    i = np.minimum(x.astype(np.intp), max(columns - 2, 0))
    j = np.minimum(y.astype(np.intp), max(rows - 2, 0))
    i1, j1 = np.minimum(i + 1, columns - 1), np.minimum(j + 1, rows - 1)
    fx, fy = (x - i)[..., None], (y - j)[..., None]
    return np.asarray(
        (1.0 - fy) * ((1.0 - fx) * picture[j, i] + fx * picture[j, i1])
        + fy * ((1.0 - fx) * picture[j1, i] + fx * picture[j1, i1])
    )
