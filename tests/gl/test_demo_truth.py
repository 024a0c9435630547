"""Demo scenes as the renderer sees them, their lights integrated exactly.

Positions, normals and tangents come from the renderer's own G-buffer, which has tests
of its own; from there on nothing of a technique is used. `pytest -s` prints the figures
that docs/ggx.md quotes.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from app.outline import boundary, resolve
from app.render.camera import CameraFrame
from app.render.renderer import Renderer
from app.scene import AreaLight, BezierContour, RenderSettings, Shot
from app.scene_io import demo_scenes, load_scene
from ltc.curved_outline import form_factor
from ltc.curved_reference import curve_specular_integral_batch
from ltc.polygon import clipped_form_factor
from ltc.reference import specular_integral_batch

WIDTH, HEIGHT = 64, 36

CURVED_PIXELS = 200
"""Pixels of a scene with curved lights, which are integrated exactly at a few hundred a second."""

FloatArray = NDArray[np.float64]


def unit(v: FloatArray) -> FloatArray:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def from_octahedral(e: FloatArray) -> FloatArray:
    z = 1.0 - np.abs(e).sum(axis=-1)
    fold = np.maximum(-z, 0.0)[..., None]
    return unit(np.concatenate([e - np.where(e >= 0, fold, -fold), z[..., None]], axis=-1))


def texels(renderer: Renderer, name: str) -> FloatArray:
    texture = renderer._targets.texture(name)
    data = np.frombuffer(texture.read(), dtype=np.float32).reshape(HEIGHT, WIDTH, -1)
    return data[::-1].astype(np.float64)


def is_curved(light: AreaLight) -> bool:
    return any(isinstance(contour, BezierContour) for contour in light.outline.contours)


def integrals(
    light: AreaLight,
    position: FloatArray,
    axes: FloatArray,
    front: NDArray[np.bool_],
    view: FloatArray,
    alpha: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return (F = 1, its Fresnel part, form factor), each (n,), of a light of radiance 1.

    ``axes`` (n, 3, 3) are the frames of the points, ``front`` (n,) is where they see
    the light's emitting side.
    """
    origin, u, v = (np.array(a) for a in (light.plane.origin, light.plane.u, light.plane.v))

    def seen(loop: FloatArray) -> FloatArray:
        """Points (k, m, 2) of the outline from every surface point, (n, k, m, 3)."""
        world = origin + loop[..., :1] * u + loop[..., 1:] * v
        away = np.einsum("pij,pkmj->pkmi", axes, world - position[:, None, None])
        return np.where(front[:, None, None, None], away[:, ::-1, ::-1], away)

    if is_curved(light):
        contours = [seen(loop) for loop in boundary(light.outline)]
        one, fresnel = curve_specular_integral_batch(
            contours, view, *alpha.T, nodes=6, tolerance=1e-5
        )
        return one, fresnel, form_factor(contours).value
    total = np.zeros((3, len(position)))
    for loop in resolve(light.outline):
        corners = seen(loop[:, None])[:, :, 0]
        total[:2] += specular_integral_batch(corners, view, *alpha.T, nodes=6, tolerance=1e-5)
        total[2] += clipped_form_factor(corners)
    return total[0], total[1], total[2]


def exact(renderer: Renderer, shot: Shot) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Return (radiance (n, 3) of pixels that show a surface, which those are).

    They are all of them, or `CURVED_PIXELS` at random if a light is curved.
    """
    scene = shot.scene
    surface = texels(renderer, "gbuffer")
    frame = CameraFrame.of(scene.camera, WIDTH / HEIGHT)
    size = (WIDTH, HEIGHT)
    rays = np.array(
        [[frame.ray(x + 0.5, y + 0.5, size) for x in range(WIDTH)] for y in range(HEIGHT)]
    )
    seen = (surface[..., 2] > 0.0) & (surface[..., 3] >= 0.0)
    position = (frame.eye + surface[..., 2:3] * rays)[seen]
    wo, normal = -unit(rays[seen]), from_octahedral(surface[..., :2])[seen]
    # Normals that turn away from the viewer are bent by the renderer: leave those out.
    facing = np.sum(normal * wo, axis=-1) > 1e-3
    if any(is_curved(light) for light in scene.lights):
        rng = np.random.default_rng(1)
        chosen = rng.choice(np.flatnonzero(facing), CURVED_PIXELS, replace=False)
        facing = np.isin(np.arange(len(facing)), chosen)
    seen[seen] = facing
    position, wo, normal = position[facing], wo[facing], normal[facing]

    materials = scene.object_materials()
    index = surface[..., 3][seen].astype(int)
    alpha, f0, diffuse = (
        np.array([getattr(m, name) for m in materials])[index]
        for name in ("alpha", "f0", "diffuse")
    )
    rotation = np.array([m.rotation for m in materials])[index][:, None]
    if "tangents" in renderer.allocated():
        tangent = from_octahedral(texels(renderer, "tangents"))[seen]
    else:
        tangent = wo
    tangent = unit(tangent - normal * np.sum(normal * tangent, axis=-1, keepdims=True))
    tangent = np.cos(rotation) * tangent + np.sin(rotation) * np.cross(normal, tangent)
    axes = np.stack([tangent, np.cross(normal, tangent), normal], axis=-2)
    view = np.einsum("pij,pj->pi", axes, wo)

    radiance = np.zeros((len(position), 3))
    glossy = f0.max(axis=-1, keepdims=True) > 0.0
    for light in scene.lights:
        origin, u, v = (np.array(a) for a in (light.plane.origin, light.plane.u, light.plane.v))
        front = np.sum(np.cross(u, v) * (position - origin), axis=-1) > 0.0
        on = np.flatnonzero(front | light.two_sided)
        one, fresnel, form = integrals(
            light, position[on], axes[on], front[on], view[on], alpha[on]
        )
        specular = glossy[on] * (f0[on] * (one - fresnel)[:, None] + fresnel[:, None])
        radiance[on] += np.array(light.radiance) * (specular + diffuse[on] * form[:, None])
    return radiance, seen


@pytest.mark.parametrize(
    ("name", "technique", "largest"),
    [
        # Mean error over the picture, as a share of its mean. The table is at its worst
        # at grazing views.
        ("02-quad", "ltc", 0.08),
        ("02-quad", "ggx", 0.004),
        ("06-grazing", "ltc", 0.25),
        ("06-grazing", "ggx", 0.004),
        ("07-mirror-to-rough", "ltc", 0.08),
        ("07-mirror-to-rough", "ggx", 0.008),
        ("09-brushed", "ggx", 0.002),
        ("10-alpha-grid", "ggx", 0.004),
        ("11-curvy", "ltc", 0.025),
        ("12-letter", "ltc", 0.02),
        ("12-letter", "ggx", 0.002),
        ("13-word", "ltc", 0.06),
        ("13-word", "ggx", 0.002),
        ("14-logo", "ltc", 0.02),
        ("15-disk", "ggx", 0.002),
    ],
)
def test_demo_scene(renderer, name, technique, largest):
    shot = Shot(load_scene(demo_scenes()[name]), RenderSettings(technique, 1), WIDTH, HEIGHT)
    renderer.render(shot)
    want, seen = exact(renderer, shot)
    error = np.abs(renderer.radiance()[seen] - want)
    share = error.mean() / want.mean()
    print(f"\n{name} {technique}: {100 * share:.2f} % of the picture's mean")
    assert share <= largest
