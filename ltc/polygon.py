"""Polygons seen from the origin: clip to the horizon, form factor.

A light is one or more closed loops in a common plane, convex or not, holes
wound against the outer loops. Everything here is a sum over directed edges,
so loops need not be joined by bridges and their order does not matter.

In this module counter-clockwise about +z is positive. Light outlines run the
other way (see ``ltc/__init__.py``); `positive_winding` is the one place that
turns them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from ltc import transform

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


def polygon_form_factor(vertices: npt.ArrayLike) -> FloatArray:
    """Return the form factor of polygons seen from the origin.

    Parameters
    ----------
    vertices : (..., N, 3) float64, N >= 3
        Corners of a closed loop in the hemisphere z >= 0, as from
        `clip_to_horizon`. Planar unless it is far from the origin's plane;
        repeated and collinear corners are allowed. Lengths are irrelevant.

    Returns
    -------
    (...) float64
        In [0, 1] for counter-clockwise about +z, negative for the other
        winding, exactly 0 for a loop without area. Times pi and radiance it is
        irradiance [W m^-2].

    Raises
    ------
    ValueError
        If the shape is not (..., N >= 3, 3).

    Notes
    -----
    Lambert's contour sum, E = 1/(2 pi) sum (a x b)_z theta/|a x b|; Heitz et al. 2016,
    eq. 11, without its arccosine. Where the loop is small against its distance |c|
    the terms cancel, so 1/|c|^2 is taken out of theta/|a x b|; what it would
    have summed to is the area: sum a x b = sum q_a x q_b with q = r - c. The
    rest, (theta/sin theta)/(|a||b|) - 1/|c|^2, is computed without a
    difference of nearly equal numbers, and relative accuracy holds at any distance.
    A point in the light's plane is on neither side: it gets half the jump.
    """
    a = _polygon(vertices)
    b = np.roll(a, -1, axis=-2)
    d = b - a
    # The centre and |q|, |d| relative to it decide between the two forms.
    c = np.mean(a, axis=-2, keepdims=True)
    q = a - c
    c2 = np.sum(c * c, axis=-1)
    small = np.max(np.sum(q * q, axis=-1), axis=-1, keepdims=True) < 0.1 * c2
    cross = np.cross(a, d)
    sine = np.sqrt(np.sum(cross * cross, axis=-1))
    theta = np.arctan2(sine, np.sum(a * b, axis=-1))
    plain = np.zeros(sine.shape)
    np.divide(theta, sine, out=plain, where=sine > 0.0)

    c2 = np.where(small, c2, 1.0)
    q_next = np.roll(q, -1, axis=-2)
    sa = np.where(small, np.sum((2.0 * c + q) * q, axis=-1), 0.0) / c2  # |a|^2/|c|^2 - 1
    sb = np.roll(sa, -1, axis=-1)
    s = sa + sb + sa * sb
    excess = s / (1.0 + np.sqrt(1.0 + s))  # |a||b|/|c|^2 - 1
    pinned = (_angle_over_sine_minus_one(theta, small) - excess) / ((1.0 + excess) * c2)
    area = np.cross(q, q_next)[..., 2] / c2

    terms = np.where(small, cross[..., 2] * pinned + area, cross[..., 2] * plain)
    return np.asarray(np.sum(terms, axis=-1) / (2.0 * np.pi))


def _angle_over_sine_minus_one(theta: FloatArray, use: FloatArray) -> FloatArray:
    """Return theta/sin(theta) - 1 for theta < 1, without cancellation, where ``use``."""
    t = np.where(use, theta, 0.0)
    t2 = t * t
    series = t2 * (1 / 6 + t2 * (7 / 360 + t2 * (31 / 15120 + t2 * (127 / 604800))))
    sine = np.sin(np.where(t > 0.05, t, 1.0))
    return np.where(t > 0.05, t / sine - 1.0, series)


def clipped_form_factor(vertices: npt.ArrayLike) -> FloatArray:
    """Return the form factor of planar polygons anywhere about the horizon.

    Parameters
    ----------
    vertices : (..., N, 3) float64, N >= 3
        Corners of a planar loop, convex or not.

    Returns
    -------
    (...) float64
        As `polygon_form_factor` of the part above the horizon; exactly 0
        where nothing is.
    """
    return polygon_form_factor(clip_to_horizon(vertices))


def loops_form_factor(loops: Sequence[npt.ArrayLike]) -> FloatArray:
    """Return the form factor of a light with several loops.

    Parameters
    ----------
    loops : sequence of (..., N_k, 3) float64
        Planar loops anywhere about the horizon; holes wound against the outer loops.

    Returns
    -------
    (...) float64
        The sum of `clipped_form_factor` over the loops; 0 for none.
    """
    total: FloatArray = np.zeros(())
    for loop in loops:
        total = total + clipped_form_factor(loop)
    return total


def ltc_polygon_form_factor(
    cosine_from_shading: npt.ArrayLike, loops: Sequence[npt.ArrayLike]
) -> FloatArray:
    """Return the integral of a linearly transformed cosine over a light.

    Parameters
    ----------
    cosine_from_shading : (..., 3, 3) float64
        The paper's M^-1, of positive determinant.
    loops : sequence of (..., N_k, 3) float64
        The light's loops in the shading frame, planar, anywhere about the horizon.

    Returns
    -------
    (...) float64
        The lobe's share that falls on the light's part above the surface;
        positive for counter-clockwise about +z. At most 1 - `ltc.transform.leak`.

    Raises
    ------
    ValueError
        For other shapes.

    Notes
    -----
    Heitz et al. 2016, section 4.3, with the light first clipped at the surface's own
    horizon: lobes may reach below it, light must not. The definition of the
    technique ``ltc``; twin: ``shaders/ltc``.
    """
    matrix = np.asarray(cosine_from_shading, dtype=np.float64)
    lit = [clip_to_horizon(loop) for loop in loops]
    return loops_form_factor([transform.apply(matrix[..., None, :, :], loop) for loop in lit])


def ltc_specular(
    shading_from_cosine: npt.ArrayLike, loops: Sequence[npt.ArrayLike], albedo: npt.ArrayLike
) -> FloatArray:
    """Return the reflected radiance of a light of radiance 1 by the technique ``ltc``.

    Parameters
    ----------
    shading_from_cosine : (..., 3, 3) float64
        The paper's M, of positive determinant.
    loops : sequence of (..., N_k, 3) float64
        The light's loops in the shading frame, positive for counter-clockwise
        about +z.
    albedo : (...) float64
        Directional albedo, f0 (A - B) + B of `ltc.brdf.directional_albedo`.

    Returns
    -------
    (...) float64
        albedo E / (1 - leak): what the lobe puts below the surface is given
        back to the part above, so that a light that fills the sky returns
        the albedo exactly.

    Raises
    ------
    ValueError
        For other shapes or a singular matrix.
    """
    form_factor = ltc_polygon_form_factor(transform.invert(shading_from_cosine), loops)
    return np.asarray(
        np.asarray(albedo, dtype=np.float64)
        * form_factor
        / (1.0 - transform.leak(shading_from_cosine))
    )
