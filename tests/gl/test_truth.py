"""Pictures against exact GGX: camera, G-buffer, technique and material at once.

Nothing here knows of linearly transformed cosines: rays are cast in float64 and the
light is integrated by `ltc.reference`.
"""

from __future__ import annotations

import numpy as np
import pytest

from app.scene import (
    AreaLight,
    Camera,
    Material,
    Outline,
    Plane,
    PolygonContour,
    RenderSettings,
    Scene,
    SceneObject,
    Shot,
    Transform,
)
from ltc.polygon import clipped_form_factor
from ltc.reference import specular_integral_batch

WIDTH, HEIGHT = 48, 27
RADIANCE = np.array([3.0, 2.0, 1.0])
DIFFUSE = np.array([0.2, 0.3, 0.4])
F0 = np.array([0.04, 0.5, 1.0])
CORNERS = np.array([(-1.0, -0.7), (1.0, -0.7), (1.2, 0.6), (-0.8, 0.9)])


def scene(alpha: tuple[float, float], height: float, rotation: float = 0.0) -> Scene:
    return Scene(
        materials=(Material("floor", tuple(DIFFUSE), tuple(F0), alpha, rotation),),
        objects=(SceneObject("floor", "plane", "floor", Transform(scale=(50.0, 1.0, 50.0))),),
        lights=(
            AreaLight(
                "key",
                Outline((PolygonContour(tuple(map(tuple, CORNERS))),)),
                Plane((0.3, height, -2.0), (0.9, 0.0, 0.3), (0.0, 1.0, 0.2)),
                tuple(RADIANCE),
                visible=False,
            ),
        ),
        camera=Camera((0.5, 1.2, 4.0), (0.0, 0.4, 0.0)),
    )


def exact(shot: Shot) -> tuple[np.ndarray, np.ndarray]:
    """Return (radiance (h, w, 3), which pixels see the floor)."""
    camera, (lamp,) = shot.scene.camera, shot.scene.lights
    eye = np.array(camera.eye)
    forward = np.array(camera.target) - eye
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, camera.up)
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    half = np.tan(camera.fov_y / 2)
    x = (np.arange(WIDTH) + 0.5) / WIDTH * 2 - 1
    y = 1 - (np.arange(HEIGHT) + 0.5) / HEIGHT * 2
    rays = (
        forward
        + (half * WIDTH / HEIGHT * x)[None, :, None] * right
        + (half * y)[:, None, None] * up
    )
    t = -eye[1] / rays[..., 1]
    points = eye + t[..., None] * rays
    seen = (t > 0) & (np.abs(points[..., [0, 2]]).max(axis=-1) < 49.0)

    p, wo = points[seen], -rays[seen]
    wo /= np.linalg.norm(wo, axis=-1, keepdims=True)
    n = np.array([0.0, 1.0, 0.0])
    material = shot.scene.materials[0]
    # The plane's tangent is +x, turned about the normal.
    turned = np.array([np.cos(material.rotation), 0.0, -np.sin(material.rotation)])
    tangent = np.broadcast_to(turned, p.shape)
    frame = np.stack([tangent, np.cross(n, tangent), np.broadcast_to(n, p.shape)], axis=-2)
    origin, u, v = (np.array(a) for a in (lamp.plane.origin, lamp.plane.u, lamp.plane.v))
    world = origin + CORNERS[:, :1] * u + CORNERS[:, 1:] * v
    corners = np.einsum("pij,pkj->pki", frame, world[None] - p[:, None])[:, ::-1]
    view = np.einsum("pij,pj->pi", frame, wo)
    alpha_x, alpha_y = (np.full(len(p), a) for a in material.alpha)
    one, fresnel = specular_integral_batch(corners, view, alpha_x, alpha_y)
    diffuse = clipped_form_factor(corners)
    facing = np.sum(np.cross(u, v) * (p - origin), axis=-1) > 0
    specular = F0 * (one - fresnel)[:, None] + fresnel[:, None]
    radiance = np.zeros((HEIGHT, WIDTH, 3))
    radiance[seen] = RADIANCE * (specular + DIFFUSE * diffuse[:, None]) * facing[:, None]
    return radiance, seen


@pytest.mark.parametrize("alpha", [0.03, 0.1, 0.3, 0.8])
@pytest.mark.parametrize("height", [1.5, 0.4], ids=["above", "crossing"])
# A table's lobe errs .002 on average over random configurations (ltc.fit), and Fresnel's
# split adds; the contour integral errs by its weight alone, .0003 (ltc.ggx), most where
# the light crosses the horizon, as it does behind this floor.
@pytest.mark.parametrize(
    ("technique", "mean", "p99"), [("ltc", 0.003, 0.025), ("ggx", 0.0005, 0.012)]
)
def test_floor_against_exact_integrals(renderer, technique, mean, p99, alpha, height):
    shot = Shot(scene((alpha, alpha), height), RenderSettings(technique, 1), WIDTH, HEIGHT)
    error, largest = errors(renderer, shot)
    assert error.mean() <= mean
    assert np.percentile(error, 99) <= p99
    assert largest > 0.15


@pytest.mark.parametrize("alpha", [(0.05, 0.4), (0.4, 0.05), (0.02, 0.1), (1.0, 0.2)])
@pytest.mark.parametrize("rotation", [0.0, 0.6, 2.5])
def test_brushed_floor_against_exact_integrals(renderer, alpha, rotation):
    shot = Shot(scene(alpha, 0.4, rotation), RenderSettings("ggx", 1), WIDTH, HEIGHT)
    error, largest = errors(renderer, shot)
    assert error.mean() <= 0.001
    assert np.percentile(error, 99) <= 0.015
    assert largest > 0.15


def errors(renderer, shot):
    """Return (errors relative to the light's radiance, largest exact radiance)."""
    renderer.render(shot)
    radiance, seen = exact(shot)
    return np.abs(renderer.radiance() - radiance)[seen] / RADIANCE, radiance[seen].max()
