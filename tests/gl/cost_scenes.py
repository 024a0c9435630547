"""Floors under lights of many curves, to see what each more of them costs.

Shared by ``test_curve_cost.py`` and ``docs/figures/curve_cost.py``.
"""

from __future__ import annotations

from dataclasses import replace
from math import ceil, sqrt

import numpy as np
from numpy.typing import NDArray

from app.presets import heart, star
from app.render.renderer import Renderer
from app.scene import (
    AreaLight,
    BezierContour,
    Camera,
    CubicCurve,
    Material,
    Outline,
    Plane,
    RenderSettings,
    Scene,
    SceneObject,
    Shot,
    Transform,
)

CAMERA = Camera((0.0, 1.5, 3.0), (0.0, 0.0, 0.0))
"""Sees nothing but floor."""

GLOSSY = Material("floor", (0.2, 0.2, 0.2), (0.04, 0.04, 0.04), (0.1, 0.1))
SHARP = Material("floor", (0.0, 0.0, 0.0), (0.9, 0.9, 0.9), (0.01, 0.01))

NEAR = Plane((0.0, 1.2, -2.0))
"""The light stands upright above the floor's middle, and the floor mirrors it."""
FAR = Plane((0.0, 1.2, -100.0))
BEHIND = Plane((0.0, 1.2, 4.0), (-1.0, 0.0, 0.0))
"""Behind the camera, where no view is mirrored to."""


def waves(count: int) -> Outline:
    """Return one closed outline, 2 m across, with waves of ``count`` curves (even), as deep as
    they are for any count."""
    return star(count // 2, 1.0, 0.6, roundness=1.0)


def hearts(count: int) -> Outline:
    """Return hearts of ``count`` curves altogether (a multiple of 6), side by side in 2 m x 2 m."""
    (contour,) = heart(2.0).contours
    assert isinstance(contour, BezierContour)
    number = count // len(contour.curves)
    side = ceil(sqrt(number))
    size = 1.0 / side
    contours = []
    for i in range(number):
        s, t = (2 * (i % side) + 1) * size - 1.0, (2 * (i // side) + 1) * size - 1.0
        curves: list[CubicCurve] = []
        for curve in contour.curves:
            a, b, c, d = ((s + 0.95 * size * p, t + 0.95 * size * q) for p, q in curve)
            curves.append((a, b, c, d))
        contours.append(replace(contour, curves=tuple(curves)))
    return Outline(tuple(contours))


def lit_floor(outline: Outline, plane: Plane, material: Material = GLOSSY) -> Scene:
    """Return a floor that fills the picture, and one light on a plane."""
    floor = SceneObject("floor", "plane", material.name, Transform(scale=(50.0, 50.0, 50.0)))
    lamp = AreaLight("lamp", outline, plane, two_sided=True, visible=False)
    return Scene((material,), (floor,), (lamp,), CAMERA)


def evaluations(
    renderer: Renderer, scene: Scene, technique: str = "ltc", size: tuple[int, int] = (48, 32)
) -> NDArray[np.float32]:
    """Return how often each pixel evaluates the contour integral, (height, width)."""
    renderer.render(Shot(scene, RenderSettings(technique, 1, "cost"), *size))
    counts: NDArray[np.float32] = renderer.radiance()[..., 0]
    return counts
