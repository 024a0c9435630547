"""Polygons seen from the origin: clip to the horizon, form factor.

A light is one or more closed loops in a common plane, convex or not, holes
wound against the outer loops. Everything here is a sum over directed edges,
so loops need not be joined by bridges and their order does not matter.

In this module counter-clockwise about +z is positive. Light outlines run the
other way (see ``ltc/__init__.py``); `positive_winding` is the one place that
turns them.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

FloatArray: TypeAlias = npt.NDArray[np.float64]


def _polygon(vertices: npt.ArrayLike) -> FloatArray:
    p = np.asarray(vertices, dtype=np.float64)
    if p.ndim < 2 or p.shape[-1] != 3 or p.shape[-2] < 3:
        raise ValueError(f"vertices have shape {p.shape}, expected (..., N >= 3, 3)")
    return p


def positive_winding(vertices: npt.ArrayLike) -> FloatArray:
    """Return a light's outline in the order that `ltc.polygon` counts positive.

    Parameters
    ----------
    vertices : (..., N, 3) float64
        A loop that runs counter-clockwise seen from the light's emitting side,
        as scenes store it.

    Returns
    -------
    (..., N, 3) float64
        The same corners reversed: a point that the light faces sees them
        counter-clockwise about +z and gets a positive form factor; a point
        behind the light a negative one.
    """
    return _polygon(vertices)[..., ::-1, :]


def clip_to_horizon(vertices: npt.ArrayLike) -> FloatArray:
    """Return the part of planar polygons above the plane z = 0.

    Parameters
    ----------
    vertices : (..., N, 3) float64, N >= 3
        Corners of a planar loop, in any position, convex or not.

    Returns
    -------
    (..., 2N, 3) float64
        A closed loop with z >= 0: each edge's part above the horizon, edge by
        edge, with repeated corners where nothing is left. The loop is closed
        along the horizon, where crossings are exactly z = 0. Where all is
        below, all corners are (0, 0, 1).

    Raises
    ------
    ValueError
        If the shape is not (..., N >= 3, 3).

    Notes
    -----
    All crossings of a planar loop lie on one line, and closing edges on that
    line that run to and fro cancel in every contour integral. So crossings need not
    be linked to each other: whatever runs below is replaced by one fixed point
    of the line, the loop's first crossing. A corner with z = 0 counts as below.
    """
    p = _polygon(vertices)
    q = np.roll(p, -1, axis=-2)
    zp, zq = p[..., 2:], q[..., 2:]
    above_p, above_q = zp > 0.0, zq > 0.0
    crosses = above_p != above_q
    # A convex combination of p and q: exact at z = 0 and never outside the edge.
    wp, wq = np.abs(zq), np.abs(zp)
    total = np.where(crosses, wp + wq, 1.0)
    crossing = np.where(crosses, (wp / total) * p + (wq / total) * q, 0.0)
    crossing[..., 2] = 0.0
    first = np.argmax(crosses, axis=-2, keepdims=True)
    anchor = np.take_along_axis(crossing, first, axis=-2)
    none = ~np.any(crosses, axis=-2, keepdims=True)
    anchor = np.where(none, np.array([0.0, 0.0, 1.0]), anchor)
    below = ~above_p & ~above_q
    start = np.where(above_p, p, np.where(below, anchor, crossing))
    end = np.where(above_q, q, np.where(below, anchor, crossing))
    both = np.stack([start, end], axis=-2)
    return both.reshape(*p.shape[:-2], 2 * p.shape[-2], 3)
