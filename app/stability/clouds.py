"""Points about a light, from numbers in [0, 1): where clouds of a sweep lie."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from scipy.special import ndtri

from app.curves import evaluate
from app.outline import boundary
from app.scene import ALPHA_MIN, AreaLight
from app.stability.lights import control_points
from app.stability.points import FloatArray, Points, across, unit

DIMENSIONS = 12
"""Numbers that a point of a cloud is made from."""

STEEPEST = 89.9
"""Of the views' angles from the normal [degrees]."""

Placing: TypeAlias = Callable[[FloatArray], Points]


@dataclass(frozen=True, slots=True)
class Ranges:
    """From where to where clouds go.

    ``alpha`` logarithmic, ``theta`` of the view [degrees], ``distance`` from the light in its
    sizes, logarithmic; ``edge`` is the share of lobes that point at the outline itself, ``ratio``
    the smallest of the two alphas, the larger being in ``alpha``.
    """

    alpha: tuple[float, float] = (1e-3, 1.0)
    theta: tuple[float, float] = (0.0, 80.0)
    distance: tuple[float, float] = (0.03, 10.0)
    edge: float = 0.5
    ratio: float = 1.0


def _log(u: FloatArray, limits: tuple[float, float]) -> FloatArray:
    return np.asarray(np.exp(np.log(limits[0]) + u * np.log(limits[1] / limits[0])))


def _linear(u: FloatArray, limits: tuple[float, float]) -> FloatArray:
    return np.asarray(limits[0] + u * (limits[1] - limits[0]))


def _world(light: AreaLight, st: FloatArray) -> FloatArray:
    origin, u, v = (np.array(a) for a in (light.plane.origin, light.plane.u, light.plane.v))
    return np.asarray(origin + st[:, :1] * u + st[:, 1:] * v)


def _size(light: AreaLight) -> float:
    corners = control_points(light)
    return float(np.max(np.linalg.norm(corners - corners.mean(axis=0), axis=1)))


def _on_outline(light: AreaLight, u: FloatArray, edge: float = 1.0) -> FloatArray:
    """Return places (n, 3) on a light's outline, a share ``edge`` of them; others about it."""
    loops = boundary(light.outline)
    if not loops:  # it encloses nothing
        corners = control_points(light)
        return np.asarray(corners[(u[:, 0] * len(corners)).astype(np.intp)])
    curves = np.concatenate(loops)
    st = evaluate(curves[(u[:, 0] * len(curves)).astype(np.intp)], u[:, 1])
    middle = curves[:, 0].mean(axis=0)
    off = np.clip((u[:, 2] - edge) / max(1.0 - edge, 1e-9), 0.0, 1.0)[:, None]
    away = (u[:, 2] >= edge)[:, None]
    return _world(light, np.where(away, middle + 1.5 * off * (st - middle), st))


def _direction(u: FloatArray) -> FloatArray:
    z, phi = 1.0 - 2.0 * u[:, 0], 2.0 * np.pi * u[:, 1]
    r = np.sqrt(np.maximum(1.0 - z * z, 0.0))
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=-1)


def _about(normal: FloatArray, first: FloatArray, angle: FloatArray) -> FloatArray:
    """Return ``first`` turned about unit normals by angles (n), perpendicular ones assumed."""
    return np.asarray(
        np.cos(angle)[:, None] * first + np.sin(angle)[:, None] * np.cross(normal, first)
    )


def _alphas(u: FloatArray, ranges: Ranges) -> FloatArray:
    """Return alphas (n, 2) from two numbers each."""
    a = _log(u[:, 0], ranges.alpha)
    swap = u[:, 1] < 0.5
    share = np.where(swap, 2.0 * u[:, 1], 2.0 * u[:, 1] - 1.0)
    b = np.maximum(a * _log(share, (ranges.ratio, 1.0)), ALPHA_MIN)
    return np.stack([np.where(swap, b, a), np.where(swap, a, b)], axis=-1)


def aimed_from(target: FloatArray, position: FloatArray, u: FloatArray, ranges: Ranges) -> Points:
    """Return points whose lobes point at targets (n, 3), give or take their width.

    That is where errors show. Of ``u`` the last seven numbers are used.
    """
    theta, alpha, roll, tangent = u[:, 6], _alphas(u[:, [7, 10]], ranges), u[:, 8], u[:, 11]
    d = unit(target - position)
    side = _about(d, across(d, np.zeros(d.shape)), 2.0 * np.pi * roll)
    t = np.radians(_linear(theta, ranges.theta))
    n = unit(np.cos(t)[:, None] * d + np.sin(t)[:, None] * side)
    back = -across(n, np.where(t[:, None] > 1e-6, d, side))
    off = alpha.max(axis=1) * ndtri(np.clip(u[:, 9], 1e-3, 1.0 - 1e-3))
    t = np.clip(t + off, 0.0, math.radians(STEEPEST))
    view = np.cos(t)[:, None] * n + np.sin(t)[:, None] * back
    return Points.of(position, n, view, alpha, _about(n, back, 2.0 * np.pi * tangent))


def aimed(light: AreaLight, ranges: Ranges = Ranges()) -> Placing:
    """Return points about a light, with lobes that point at it and its outline."""

    def place(u: FloatArray) -> Points:
        target = _on_outline(light, u, ranges.edge)
        reach = _size(light) * _log(u[:, 5], ranges.distance)
        return aimed_from(target, target + _direction(u[:, 3:5]) * reach[:, None], u, ranges)

    return place


def beside(light: AreaLight, distance: float, ranges: Ranges = Ranges()) -> Placing:
    """Return points ``distance`` [m] from the outline in any direction, normals and views any."""

    def place(u: FloatArray) -> Points:
        position = _on_outline(light, u) + distance * _direction(u[:, 3:5])
        aim = position + _direction(np.stack([u[:, 5], u[:, 2]], axis=-1))
        return aimed_from(aim, position, u, ranges)

    return place


def on_vertex(light: AreaLight) -> Placing:
    """Return points on a light's corners and handles."""

    def place(u: FloatArray) -> Points:
        corners = control_points(light)
        position = corners[(u[:, 0] * len(corners)).astype(np.intp)]
        aim = position + _direction(u[:, 3:5])
        return aimed_from(aim, position, u, Ranges())

    return place


def in_plane(light: AreaLight) -> Placing:
    """Return points in a light's plane, outside its outline: they see it from the edge."""

    def place(u: FloatArray) -> Points:
        phi = 2.0 * np.pi * u[:, 0]
        radius = _linear(u[:, 1], (1.5, 5.0))
        st = radius[:, None] * np.stack([np.cos(phi), np.sin(phi)], axis=-1)
        return aimed_from(_on_outline(light, u[:, 2:5]), _world(light, st), u, Ranges())

    return place


def behind(light: AreaLight) -> Placing:
    """Return points behind a light, with lobes that point at it."""

    def place(u: FloatArray) -> Points:
        target = _on_outline(light, u, 0.5)
        away = unit(np.cross(light.plane.u, light.plane.v))
        reach = _log(u[:, 5], (1e-3, 3.0))
        return aimed_from(target, target - reach[:, None] * away, u, Ranges())

    return place


def on_floor(u: FloatArray) -> Points:
    """Return points of the floor y = 0 within 3 m, with views anywhere above it."""
    position = np.stack([6.0 * u[:, 0] - 3.0, np.zeros(len(u)), 6.0 * u[:, 1] - 3.0], axis=-1)
    theta, phi = np.radians(_linear(u[:, 6], (0.0, STEEPEST))), 2.0 * np.pi * u[:, 8]
    sin = np.sin(theta)
    view = np.stack([sin * np.cos(phi), np.cos(theta), sin * np.sin(phi)], axis=-1)
    side = np.stack([np.cos(phi), np.zeros(len(u)), np.sin(phi)], axis=-1)
    return Points.of(position, (0.0, 1.0, 0.0), view, _log(u[:, 7], (1e-3, 1.0)), side)


def along_normal(light: AreaLight, alpha: tuple[float, float]) -> Placing:
    """Return points whose viewers stand exactly over them."""

    def place(u: FloatArray) -> Points:
        points = aimed(light, Ranges(alpha, (0.0, 1e-3), ratio=0.1))(u)
        return replace(points, view=points.normal)

    return place


def at_quadrants(light: AreaLight) -> Placing:
    """Return anisotropic points whose views lie in a plane of symmetry of the lobe, exactly."""

    def place(u: FloatArray) -> Points:
        points = aimed(light, Ranges((0.01, 1.0), (5.0, 80.0), ratio=0.05))(u)
        side = across(points.normal, points.view)
        quarter = np.floor(4.0 * u[:, 11])
        return replace(points, tangent=_about(points.normal, side, 0.5 * np.pi * quarter))

    return place
