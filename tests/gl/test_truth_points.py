"""The surface points that `bench` compares at, and the exact integral there."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from app.outline import boundary
from app.presets import disk, ring, star
from app.render.picking import direction_from_octahedral, facing_normal
from app.render.tables import isotropic_textures
from app.render.truth import exact_radiance, shading_frames
from app.scene import (
    AreaLight,
    Camera,
    Material,
    Plane,
    RenderSettings,
    Scene,
    SceneObject,
    Shot,
    Transform,
)
from ltc.bezier import flatten
from ltc.polygon import loops_form_factor, ltc_specular, positive_winding
from ltc.reference import specular_integral_batch
from ltc.table import sample_textures

LAMP = AreaLight("l", ring(), Plane((0.0, 1.0, -1.0)), (3.0, 2.0, 1.0), visible=False)
SCENE = Scene(
    (Material("m"), Material("n", alpha=(0.1, 0.1))),
    (
        SceneObject("floor", "plane", "m", Transform(scale=(4.0, 4.0, 4.0))),
        SceneObject("ball", "sphere", "n", Transform((0.5, 0.4, 1.0), scale=(0.4, 0.4, 0.4))),
    ),
    (LAMP,),
)


def test_surfaces_are_where_picks_hit(renderer):
    width, height = 48, 32
    renderer.render(Shot(SCENE, RenderSettings(), width, height))
    seen = renderer.surfaces()
    assert set(seen.index) == {0, 1}
    picked = [
        hit
        for y in range(height)
        for x in range(width)
        if (hit := renderer.pick(x + 0.5, y + 0.5)) is not None
    ]
    np.testing.assert_array_equal(seen.index, [hit.index for hit in picked])
    np.testing.assert_allclose(seen.position, [hit.position_ws for hit in picked], atol=1e-5)
    floor = seen.index == 0
    np.testing.assert_allclose(seen.normal[floor], np.tile([0.0, 1.0, 0.0], (floor.sum(), 1)))
    centre = np.array([0.5, 0.4, 1.0])
    radial = (seen.position[~floor] - centre) / 0.4
    assert np.min(np.sum(radial * seen.normal[~floor], axis=1)) > 0.99
    np.testing.assert_allclose(np.linalg.norm(seen.view, axis=1), 1.0)
    away = np.array(SCENE.camera.eye) - seen.position
    along = np.sum(away * seen.view, axis=1)
    np.testing.assert_allclose(along, np.linalg.norm(away, axis=1), rtol=1e-9)


def test_nothing_lit_has_no_surfaces(renderer):
    renderer.render(Shot(Scene(SCENE.materials, SCENE.objects), RenderSettings(), 8, 8))
    assert len(renderer.surfaces().index) == 0


def test_octahedral_directions_and_facing_normals():
    rng = np.random.default_rng(2)
    v = rng.normal(size=(500, 3))
    v /= np.linalg.norm(v, axis=1, keepdims=True)
    p = v[:, :2] / np.abs(v).sum(axis=1, keepdims=True)
    low = v[:, 2] < 0.0
    p[low] = (1.0 - np.abs(p[low][:, ::-1])) * np.where(p[low] < 0.0, -1.0, 1.0)
    np.testing.assert_allclose(direction_from_octahedral(p), v, atol=1e-12)
    wo = rng.normal(size=(500, 3))
    wo /= np.linalg.norm(wo, axis=1, keepdims=True)
    bent = facing_normal(v, wo)
    assert np.min(np.sum(bent * wo, axis=1)) > 0.99e-4
    facing = np.sum(v * wo, axis=1) >= 1e-4
    np.testing.assert_allclose(bent[facing], v[facing], atol=1e-15)


def test_exact_radiance_is_that_of_polygons_with_very_many_edges():
    """The curves' own integral against `ltc.polygon` over the flattened outline."""
    rng = np.random.default_rng(7)
    lamp = AreaLight("l", disk(), Plane((0.2, 1.0, -1.0), (1.0, 0.1, 0.0), (0.0, 0.9, 0.3)))
    n = 40
    position = rng.uniform(-2.0, 2.0, (n, 3))
    normal, view = (
        a / np.linalg.norm(a, axis=1, keepdims=True) for a in rng.normal(size=(2, n, 3))
    )
    view = np.where(np.sum(normal * view, axis=1, keepdims=True) > 0.0, view, -view)
    alpha = rng.uniform(0.05, 1.0, n)
    specular, diffuse = exact_radiance([lamp], position, normal, view, alpha)
    frames = shading_frames(normal, view)
    origin, u, v = (np.array(a) for a in (lamp.plane.origin, lamp.plane.u, lamp.plane.v))
    loops = []
    for curves in boundary(lamp.outline):
        loop = flatten(curves, 200)
        world = positive_winding(origin + loop[:, :1] * u + loop[:, 1:] * v)
        loops.append(np.einsum("nij,nkj->nki", frames, world - position[:, None]))
    matrix, albedo, _ = sample_textures(isotropic_textures(), alpha, np.sum(normal * view, axis=1))
    front = (position - origin) @ np.cross(u, v) > 0.0
    # 2,400 edges around a circle lose 1e-6 of its area.
    for got, want in (
        (specular[:, 0], ltc_specular(matrix, loops, albedo)),
        (diffuse[:, 0], loops_form_factor(loops)),
    ):
        np.testing.assert_allclose(got, np.where(front, np.maximum(want, 0.0), 0.0), atol=2e-6)


def test_ggx_itself_is_that_of_fine_polygons():
    rng = np.random.default_rng(8)
    n = 6
    position = np.column_stack([rng.uniform(-1.0, 1.0, n), np.zeros(n), rng.uniform(-0.5, 1.0, n)])
    normal = np.tile([0.0, 1.0, 0.0], (n, 1))
    view = rng.normal(size=(n, 3)) + np.array([0.0, 2.0, 1.0])
    view /= np.linalg.norm(view, axis=1, keepdims=True)
    alpha = rng.uniform(0.1, 0.6, n)
    lamp = AreaLight("l", disk(0.5), Plane((0.0, 1.0, -1.0)))
    specular, _ = exact_radiance([lamp], position, normal, view, alpha, "ggx")
    frames = shading_frames(normal, view)
    (curves,) = boundary(lamp.outline)
    loop = flatten(curves, 20)
    world = positive_winding(np.column_stack([loop, np.zeros(len(loop))]) + lamp.plane.origin)
    local = np.einsum("nij,nkj->nki", frames, world - position[:, None])
    wo = np.einsum("nij,nj->ni", frames, view)
    want, _ = specular_integral_batch(local, wo, alpha, alpha)
    # 240 edges around a circle lose 1e-4 of its area.
    np.testing.assert_allclose(specular[:, 0], want, rtol=3e-4, atol=1e-6)


def test_brushed_surfaces_have_the_tangents_that_were_shaded(renderer):
    """What a pixel shows is what the probe finds at its point, along its tangent."""
    brushed = Material("m", (0.0,) * 3, (1.0,) * 3, (0.4, 0.1), math.radians(25.0))
    ball = SceneObject("ball", "sphere", "m", Transform((0.5, 0.4, 1.0), scale=(0.4, 0.4, 0.4)))
    lamp = replace(LAMP, outline=star())  # no curves, whose rules differ
    above = Camera((0.5, 2.0, 1.6), (0.5, 0.0, 0.6))  # every pixel shows a surface
    scene = Scene((brushed,), (replace(SCENE.objects[0], material="m"), ball), (lamp,), above)
    renderer.render(Shot(scene, RenderSettings("ltc"), 48, 32))
    seen, picture = renderer.surfaces(), renderer.radiance()
    assert seen.tangent is not None
    alphas = np.tile([0.4, 0.1], (len(seen.index), 1))
    found = renderer.probe(
        scene, RenderSettings("ltc"), seen.position, seen.normal, seen.tangent, seen.view, alphas
    )["specular"]
    np.testing.assert_allclose(found, picture.reshape(-1, 3), rtol=1e-4, atol=1e-5)
    renderer.render(Shot(SCENE, RenderSettings("ltc"), 48, 32))
    assert renderer.surfaces().tangent is None
