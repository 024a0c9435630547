"""Area lights as one representative point: a baseline to compare with, not a good answer.

The technique ``representative-point``, what engines did before linearly transformed cosines. Frame:
+z the normal, +x the tangent along which ``alpha_x`` acts. Lights are flat, of radiance 1.

*Specular*, after Karis 2013, "Real Shading in Unreal Engine 4": the light is replaced by that point
of it which is closest to the mirrored view, and the lobe there is scaled down as if it were as wide
as lobe and light together. Karis gives spheres and tubes; for flat lights of any outline

- the point is the one at the smallest *angle* from the mirrored direction, exactly (he takes the
  smallest distance to the ray as an approximation of that): the mirrored direction itself where its
  ray meets the light, else the closest of its outline, edge by edge on great circles;
- alpha' = min(alpha + r / (3 d), 1), where r / d is the radius over the distance of a small disc
  with the light's solid angle, sqrt(omega / pi), and the scale is (alpha_x alpha_y) /
  (alpha_x' alpha_y'); the lobe is GGX's own, with its height-correlated masking at the point.

As published it is too bright for smooth surfaces: a mirror at normal incidence shows a disc at
9/4 of its radiance, since 1 / (pi alpha'^2) there is 9 over the solid angle and the denominator
of the BRDF 4. And no point stands for the part of a light that is below the horizon.

*Diffuse*, as Lagarde and de Rousiers do for rectangles (2014, "Moving Frostbite to Physically
Based Rendering", 4.7): solid angle times the mean of the clamped cosine at a few points. They
take four corners and the centre; here each triangle between an edge and the centroid has its own
solid angle and the mean of its three corners, so that outlines can be any, with holes too.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from ltc import brdf

FloatArray: TypeAlias = npt.NDArray[np.float64]

UP = np.array([0.0, 0.0, 1.0])


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(np.sum(a * b, axis=-1))


def _unit(a: FloatArray) -> FloatArray:
    return np.asarray(a / np.linalg.norm(a, axis=-1, keepdims=True))


def triangle_solid_angle(a: npt.ArrayLike, b: npt.ArrayLike, c: npt.ArrayLike) -> FloatArray:
    """Return the signed solid angles of triangles seen from the origin [sr].

    Parameters
    ----------
    a, b, c : (..., 3) float64
        Corners at any distance but 0; counter-clockwise seen from the origin's opposite side, that
        is about the direction from the origin to them, for positive.

    Notes
    -----
    Van Oosterom and Strackee 1983.
    """
    a, b, c = (np.asarray(x, dtype=np.float64) for x in (a, b, c))
    la, lb, lc = (np.sqrt(_dot(x, x)) for x in (a, b, c))
    triple = _dot(a, np.cross(b, c))
    under = la * lb * lc + _dot(a, b) * lc + _dot(b, c) * la + _dot(c, a) * lb
    return np.asarray(2.0 * np.arctan2(triple, under))


def nearest_on_arc(a: npt.ArrayLike, b: npt.ArrayLike, way: npt.ArrayLike) -> FloatArray:
    """Return the unit directions to those points of edges that are at the smallest angle from ways.

    Parameters
    ----------
    a, b : (..., 3) float64
        Ends of edges, not the origin.
    way : (..., 3) float64
        Unit directions.
    """
    a, b, way = (np.asarray(x, dtype=np.float64) for x in (a, b, way))
    n = np.cross(a, b)
    length2 = _dot(n, n)
    level = way - n * (_dot(n, way) / np.maximum(length2, np.finfo(float).tiny))[..., None]
    within = (_dot(np.cross(a, level), n) > 0.0) & (_dot(np.cross(level, b), n) > 0.0)
    ua, ub = _unit(a), _unit(b)
    end = np.where((_dot(ua, way) >= _dot(ub, way))[..., None], ua, ub)
    length = np.sqrt(_dot(level, level))[..., None]
    return np.where(within[..., None], level / np.where(length > 0.0, length, 1.0), end)


def representative_direction(loops: Sequence[npt.ArrayLike], way: npt.ArrayLike) -> FloatArray:
    """Return the unit directions to those points of flat lights at the smallest angle from ways.

    Parameters
    ----------
    loops : sequence of (..., N_k, 3) float64
        Corners of each light's outline, in one plane that misses the origin; what an odd number of
        them run around is light.
    way : (..., 3) float64
        Unit directions; leading axes are the loops'.

    Raises
    ------
    ValueError
        If a loop's shape is not (..., N >= 3, 3).
    """
    arrays = _loops(loops)
    way = np.asarray(way, dtype=np.float64)
    axis = np.where(np.abs(way[..., :1]) < 0.5, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    e1 = _unit(np.cross(way, axis))
    e2 = np.cross(way, e1)
    odd = np.zeros(way.shape[:-1], dtype=bool)
    area = np.zeros(way.shape)
    best, most = way, np.full(way.shape[:-1], -np.inf)
    for p in arrays:
        q = np.roll(p, -1, axis=-2)
        area = area + np.sum(np.cross(p, q), axis=-2)
        # Along the way the light's plane is seen as a plane: does the outline run around 0?
        px, py = _dot(p, e1[..., None, :]), _dot(p, e2[..., None, :])
        qx, qy = np.roll(px, -1, axis=-1), np.roll(py, -1, axis=-1)
        crosses = (py > 0.0) != (qy > 0.0)
        right = (px * qy - py * qx > 0.0) == (qy > py)
        odd ^= np.sum(crosses & right, axis=-1) % 2 == 1
        found = nearest_on_arc(p, q, np.broadcast_to(way[..., None, :], p.shape))
        cosine = _dot(found, way[..., None, :])
        first = np.argmax(cosine, axis=-1)[..., None]
        here = np.take_along_axis(cosine, first, axis=-1)[..., 0]
        point = np.take_along_axis(found, first[..., None], axis=-2)[..., 0, :]
        best = np.where((here > most)[..., None], point, best)
        most = np.maximum(most, here)
    ahead = _dot(arrays[0][..., 0, :], area) * _dot(way, area) > 0.0
    return np.where((odd & ahead)[..., None], way, best)


def representative_point(
    loops: Sequence[npt.ArrayLike],
    centre: npt.ArrayLike,
    wo: npt.ArrayLike,
    alpha_x: npt.ArrayLike,
    alpha_y: npt.ArrayLike,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return what the baseline takes for the light of flat lights of radiance 1.

    Parameters
    ----------
    loops : sequence of (..., N_k, 3) float64
        As for `representative_direction`, in the tangent frame; holes wound against the outer
        loops.
    centre : (..., 3) float64
        A point of each light's plane that its triangles share: the centroid of its area.
    wo : (..., 3) float64
        Unit directions to the viewer.
    alpha_x, alpha_y : (...) float64
        GGX parameters.

    Returns
    -------
    one, fresnel : (...) float64
        Specular radiance for F = 1, and with the weight (1 - wo.h)^5: for f0 it is
        f0 (one - fresnel) + fresnel. 0 where the point or the viewer is below the surface.
    diffuse : (...) float64
        Form factors.

    Raises
    ------
    ValueError
        If a shape is wrong or an alpha not positive.

    Notes
    -----
    Twin: ``shaders/representative_point/shade.glsl``.
    """
    arrays = _loops(loops)
    c, wo = np.asarray(centre, dtype=np.float64), np.asarray(wo, dtype=np.float64)
    ax, ay = np.asarray(alpha_x, dtype=np.float64), np.asarray(alpha_y, dtype=np.float64)
    cosine = np.maximum(_unit(c)[..., 2], 0.0)
    omega, lambert = np.zeros(c.shape[:-1]), np.zeros(c.shape[:-1])
    for p in arrays:
        q = np.roll(p, -1, axis=-2)
        each = triangle_solid_angle(np.broadcast_to(c[..., None, :], p.shape), p, q)
        at = np.maximum(_unit(p)[..., 2], 0.0)
        mean = (at + np.roll(at, -1, axis=-1) + cosine[..., None]) / 3.0
        omega = omega + np.sum(each, axis=-1)
        lambert = lambert + np.sum(each * mean, axis=-1)
    omega, lambert = np.abs(omega), np.abs(lambert)
    mirrored = wo * [-1.0, -1.0, 1.0]
    wi = representative_direction(arrays, mirrored)
    wider = np.sqrt(omega / np.pi) / 3.0
    scale = ax * ay / (np.minimum(ax + wider, 1.0) * np.minimum(ay + wider, 1.0))
    one = brdf.evaluate(wo, wi, ax, ay) * scale * omega
    fresnel = brdf.evaluate(wo, wi, ax, ay, 0.0) * scale * omega
    return one, fresnel, np.minimum(lambert / np.pi, 1.0)


def _loops(loops: Sequence[npt.ArrayLike]) -> list[FloatArray]:
    arrays = [np.asarray(loop, dtype=np.float64) for loop in loops]
    for p in arrays:
        if p.ndim < 2 or p.shape[-1] != 3 or p.shape[-2] < 3:
            raise ValueError(f"a loop has shape {p.shape}, expected (..., N >= 3, 3)")
    if not arrays:
        raise ValueError("there are no loops, expected one or more")
    return arrays
