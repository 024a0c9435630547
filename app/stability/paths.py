"""Points along a path, from places in [0, 1]: the series of a sweep.

Each runs one parameter through where something changes: an edge, a horizon, a seam.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from app.scene import Plane
from app.stability.clouds import STEEPEST, Placing
from app.stability.points import FloatArray, Points, across, unit

WALL = Plane((0.0, 1.0, -1.5), (1.0, 0.0, 0.0), (0.0, 0.5, 0.0))
"""Upright behind the origin, half as high as wide, its lower edge .5 m over the floor."""

UP = np.array([0.0, 1.0, 0.0])


def _mirrored(position: ArrayLike, normal: ArrayLike, target: ArrayLike) -> FloatArray:
    d = unit(np.asarray(target, float) - np.asarray(position, float))
    n = np.asarray(normal, dtype=np.float64)
    return np.asarray(2.0 * n * np.sum(n * d, axis=-1, keepdims=True) - d)


def sharpening(t: FloatArray) -> Points:
    """From alpha 1 to .0001, the lobe on the lower edge of a light on the wall."""
    view = _mirrored((0.0, 0.0, 0.0), UP, (0.1, 0.5, -1.5))
    return Points.of(np.zeros(3), UP, view, 10.0 ** (-4.0 * t))


def grazing(alpha: float) -> Placing:
    """View and light sink towards the surface together, from 0 to 89.9 degrees."""

    def place(t: FloatArray) -> Points:
        d = unit(np.array([0.2, 1.0, -1.5]))
        side = across(d[None], UP[None])
        angle = np.radians(STEEPEST * t)[:, None]
        n = unit(np.cos(angle) * d + np.sin(angle) * side)
        return Points.of(np.zeros(3), n, _mirrored((0.0, 0.0, 0.0), n, d), alpha)

    return place


def receding(alpha: float) -> Placing:
    """From .00001 to 100,000 sizes of a light at the origin."""

    def place(t: FloatArray) -> Points:
        toward = unit(np.array([0.5, 0.2, 1.0]))
        normal = unit(np.array([0.6, 0.1, 0.3]) - toward)
        position = 10.0 ** (-5.0 + 10.0 * t)[:, None] * toward + np.array([0.1, 0.05, 0.0])
        view = 2.0 * normal * (normal @ -toward) + toward
        return Points.of(position, normal, view, alpha)

    return place


def rising(t: FloatArray) -> Points:
    """A surface rises past a light that stands upright: it crosses the horizon."""
    position = np.stack([0.0 * t, 3.0 * t - 1.5, 0.5 + 0.0 * t], axis=-1)
    return Points.of(position, UP, (0.1, 0.6, 0.8), 0.2)


def through_plane(t: FloatArray) -> Points:
    """Through the plane of a light, from one side to the other, beside it."""
    position = np.stack([1.5 + 0.0 * t, 0.2 + 0.0 * t, 0.02 * t - 0.01], axis=-1)
    normal = unit(np.array([-1.0, 0.1, 0.05]))
    return Points.of(position, normal, _mirrored(position, normal, (0.5, 0.1, 0.0)), 0.1)


def passing(alpha: float, height: float = 1.2) -> Placing:
    """Over the floor under a light that hangs there."""

    def place(t: FloatArray) -> Points:
        position = np.stack([4.0 * t - 2.0, 0.0 * t - height, 0.15 + 0.0 * t], axis=-1)
        return Points.of(position, UP, (0.2, 0.9, 0.35), alpha)

    return place


def past_edge(t: FloatArray) -> Points:
    """Past the edge of a light, 1 mm in front of its plane."""
    position = np.stack([0.98 + 0.04 * t, 0.1 + 0.0 * t, 1e-3 + 0.0 * t], axis=-1)
    return Points.of(position, (0.3, 0.2, -1.0), (0.1, 0.3, -1.0), 0.1)


def turning(alpha: tuple[float, float]) -> Placing:
    """The viewer walks once around the point."""

    def place(t: FloatArray) -> Points:
        phi, theta = 2.0 * np.pi * t, math.radians(50.0)
        s, c = math.sin(theta), math.cos(theta)
        view = np.stack([s * np.sin(phi), c + 0.0 * phi, s * np.cos(phi)], axis=-1)
        a = np.broadcast_to(alpha, (len(t), 2))
        return Points.of(np.zeros(3), UP, view, a, (0.0, 0.0, 1.0))

    return place


def through_normal(alpha: tuple[float, float]) -> Placing:
    """The viewer passes over the point, from 5 degrees on one side to 5 on the other."""

    def place(t: FloatArray) -> Points:
        theta = np.radians(10.0 * t - 5.0)
        view = np.stack([0.3 * np.sin(theta), np.cos(theta), np.sin(theta)], axis=-1)
        a = np.broadcast_to(alpha, (len(t), 2))
        return Points.of(np.zeros(3), (0.0, 0.8, -0.6), view @ _TILT.T, a, (0.6, 0.0, 0.8))

    return place


_TILT = np.array([[1.0, 0.0, 0.0], [0.0, 0.8, 0.6], [0.0, -0.6, 0.8]])
"""Takes +y to the normal of `through_normal`."""


def through_equal(t: FloatArray) -> Points:
    """alpha_y from half of alpha_x to twice it."""
    a = np.stack([0.15 + 0.0 * t, 0.15 * 2.0 ** (2.0 * t - 1.0)], axis=-1)
    view = _mirrored((0.0, 0.0, 0.0), UP, (0.1, 0.5, -1.5))
    return Points.of(np.zeros(3), UP, view, a, (0.8, 0.0, 0.6))


def stretching(swap: bool) -> Placing:
    """From round to a hundred times as long as wide."""

    def place(t: FloatArray) -> Points:
        a = np.stack([0.4 + 0.0 * t, 0.4 * 10.0 ** (-2.0 * t)], axis=-1)
        view = _mirrored((0.0, 0.0, 0.0), UP, (0.1, 0.5, -1.5))
        return Points.of(np.zeros(3), UP, view, a[:, ::-1] if swap else a, (0.8, 0.0, 0.6))

    return place
