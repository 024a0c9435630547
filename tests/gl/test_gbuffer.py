"""The G-buffer against ray casting in float64, and what a pixel is said to show."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import moderngl
import numpy as np
import pytest
from numpy.typing import NDArray

from app.meshes import load_mesh
from app.render.camera import FAR, NEAR, CameraFrame, world_from_object
from app.render.picking import Hit
from app.render.renderer import Renderer
from app.scene import (
    AreaLight,
    Camera,
    Plane,
    RenderSettings,
    Scene,
    SceneObject,
    Shot,
    Transform,
)
from tests.gl.evaluate import evaluate
from tests.gl.scenes import FRAME, GLOSSY, KEY, SQUARE, ball, floor, one_light

SIZE = (160, 90)

FloatArray = NDArray[np.float64]


def surfaces(renderer: Renderer, scene: Scene) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the decoded G-buffer of sample 0: normal (h, w, 3), depth and id (h, w)."""
    renderer.render(Shot(scene, RenderSettings(), *SIZE))
    texture = renderer._targets.texture("gbuffer")
    raw = np.frombuffer(texture.read(), dtype=np.float32).reshape(SIZE[1], SIZE[0], 4)
    surface = raw[::-1].astype(np.float64)
    p = surface[..., :2]
    z = 1.0 - np.abs(p).sum(axis=-1, keepdims=True)
    sign = np.where(p < 0.0, -1.0, 1.0)
    xy = np.where(z < 0.0, (1.0 - np.abs(p[..., ::-1])) * sign, p)
    normal = np.concatenate([xy, z], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return normal, surface[..., 2], surface[..., 3]


def rays(camera: Camera) -> tuple[CameraFrame, FloatArray]:
    frame = CameraFrame.of(camera, SIZE[0] / SIZE[1])
    y, x = np.mgrid[0 : SIZE[1], 0 : SIZE[0]] + 0.5
    return frame, frame.ray(x, y, SIZE)


@pytest.mark.parametrize(
    ("scale", "eye", "target", "tolerance"),
    [
        (10.0, (0.0, 1.2, 4.0), (0.0, 0.8, 0.0), 1e-6),
        (1e-3, (0.0, 0.0012, 0.004), (0.0, 0.0008, 0.0), 1e-6),
        (100.0, (30.0, 5.0, -40.0), (0.0, 0.0, 0.0), 2e-6),
        # A triangle 10 km wide that passes under the camera is clipped at the near
        # plane, and the rasteriser's float32 loses some of its slope: measured 4.2e-5.
        (1e4, (0.0, 1.2, 4.0), (0.0, 0.8, 0.0), 1e-4),
    ],
)
def test_depth_of_a_plane(
    renderer: Renderer,
    scale: float,
    eye: tuple[float, float, float],
    target: tuple[float, float, float],
    tolerance: float,
) -> None:
    plane = SceneObject("floor", "plane", "glossy", Transform(scale=(scale,) * 3))
    hidden = replace(KEY, visible=False)
    scene = Scene((GLOSSY,), (plane,), (hidden,), Camera(eye, target))
    normal, depth, _ = surfaces(renderer, scene)
    frame, ray = rays(scene.camera)
    expected = -frame.eye[1] / ray[..., 1]
    hit = frame.eye + expected[..., None] * ray
    inside = (expected > 0.0) & (np.abs(hit[..., 0]) < scale) & (np.abs(hit[..., 2]) < scale)
    assert inside.sum() > 500
    assert np.mean((depth > 0.0) != inside) < 2e-3, "only pixels on the plane's edge may differ"
    both = inside & (depth > 0.0)
    error = np.abs(depth - expected)[both] / expected[both]
    assert error.max() < tolerance
    np.testing.assert_allclose(normal[both], [[0.0, 1.0, 0.0]] * both.sum(), atol=1e-6)


def test_a_turned_and_mirrored_box(renderer: Renderer) -> None:
    half = math.sqrt(0.5)
    transforms = [
        Transform((0.3, 0.7, 0.1), (half, 0.0, half, 0.0), (0.5, 0.25, 1.5)),
        Transform((0.3, 0.7, 0.1), (0.8, 0.0, 0.36, 0.48), (-0.5, 0.4, 0.3)),
    ]
    for transform in transforms:
        box = SceneObject("box", "box", "glossy", transform)
        scene = Scene((GLOSSY,), (box,), (replace(KEY, visible=False),))
        normal, depth, _ = surfaces(renderer, scene)
        frame, ray = rays(scene.camera)
        world_from = world_from_object(transform)
        object_from = np.linalg.inv(world_from)
        eye = object_from[:3, :3] @ frame.eye + object_from[:3, 3]
        direction = ray @ object_from[:3, :3].T
        low, high = load_mesh("box").bounds.astype(np.float64)
        with np.errstate(divide="ignore"):
            a, b = (low - eye) / direction, (high - eye) / direction
        near, far = np.minimum(a, b).max(axis=-1), np.maximum(a, b).min(axis=-1)
        hits = (near < far) & (near > 0.0)
        assert np.mean((depth > 0.0) != hits) < 2e-3
        both = hits & (depth > 0.0)
        # A pixel whose centre lies on an edge may show either face.
        error = np.abs(depth - near)[both] / near[both]
        assert np.quantile(error, 0.99) < 1e-6
        axis = np.argmax(np.minimum(a, b), axis=-1)
        face = np.zeros_like(ray)
        np.put_along_axis(face, axis[..., None], -1.0, axis=-1)
        face *= np.sign(direction)
        expected = face @ object_from[:3, :3]
        expected /= np.linalg.norm(expected, axis=-1, keepdims=True)
        cosine = (normal * expected).sum(axis=-1)[both]
        assert np.quantile(cosine, 0.01) > 1.0 - 1e-6


def test_a_smooth_mesh(renderer: Renderer) -> None:
    """Depth and interpolated normals against every triangle (Moeller and Trumbore 1997)."""
    transform = Transform((0.2, 0.9, 0.1), (0.6, 0.0, 0.8, 0.0), (0.9, -0.5, 0.7))
    item = SceneObject("egg", "sphere", "glossy", transform)
    scene = Scene((GLOSSY,), (item,), (replace(KEY, visible=False),))
    normal, depth, _ = surfaces(renderer, scene)
    frame, ray = rays(scene.camera)
    mesh = load_mesh("sphere")
    matrix = world_from_object(transform)
    corners = mesh.positions.astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
    normals = mesh.normals.astype(np.float64) @ np.linalg.inv(matrix[:3, :3])
    a, b, c = (corners[mesh.indices[:, i]] for i in range(3))
    e1, e2, to_eye = b - a, c - a, frame.eye - a
    rows, columns = np.nonzero(depth > 0.0)
    assert len(rows) > 500
    pick = np.random.default_rng(2).choice(len(rows), 64, replace=False)
    misses = 0
    for row, column in zip(rows[pick], columns[pick], strict=True):
        p = np.cross(ray[row, column], e2)
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse = 1.0 / (e1 * p).sum(axis=1)
            u = (to_eye * p).sum(axis=1) * inverse
            q = np.cross(to_eye, e1)
            v = q @ ray[row, column] * inverse
            t = (e2 * q).sum(axis=1) * inverse
            hit = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (t > 0.0)
        if not hit.any():
            misses += 1  # the silhouette, decided by the rasteriser's own rounding
            continue
        first = int(np.argmin(np.where(hit, t, np.inf)))
        assert depth[row, column] == pytest.approx(t[first], rel=2e-5)
        weights = np.array([1.0 - u[first] - v[first], u[first], v[first]])
        expected = weights @ (
            normals[mesh.indices[first]]
            / np.linalg.norm(normals[mesh.indices[first]], axis=1, keepdims=True)
        )
        expected /= np.linalg.norm(expected)
        assert normal[row, column] @ expected > 1.0 - 1e-4
    assert misses <= 2


def test_the_inside_of_a_surface_faces_the_viewer(renderer: Renderer) -> None:
    sphere = SceneObject("room", "sphere", "glossy", Transform(scale=(9.0, 9.0, 9.0)))
    scene = Scene((GLOSSY,), (sphere,), (replace(KEY, visible=False),))
    normal, depth, _ = surfaces(renderer, scene)
    _, ray = rays(scene.camera)
    assert (depth > 0.0).all()
    assert ((normal * ray).sum(axis=-1) < 0.0).all()


def test_depth_resolves_neighbours_at_any_distance(renderer: Renderer) -> None:
    for distance in (1e-3, 1.0, 1e3, 1e5):
        gap = 1e-5 * distance
        camera = Camera((0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
        facing = (math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0)
        objects = tuple(
            SceneObject(name, "plane", "glossy", Transform((0.0, 0.0, z), facing, (distance,) * 3))
            for name, z in (("near", -distance), ("far", -distance - gap))
        )
        for order, expected in ((objects, 0.0), (objects[::-1], 1.0)):
            scene = Scene((GLOSSY,), order, (replace(KEY, visible=False),), camera)
            _, _, identity = surfaces(renderer, scene)
            assert (identity == expected).all(), f"at {distance} m"


def test_light_shapes_have_holes_and_a_dark_back(renderer: Renderer) -> None:
    camera = Camera((0.0, 0.0, 4.0), (0.0, 0.0, 0.0))
    light = AreaLight("frame", FRAME, Plane((0.0, 0.0, 0.0)))
    behind = SceneObject("wall", "box", "glossy", Transform((0.0, 0.0, -3.0), scale=(9, 9, 1)))
    scene = Scene((GLOSSY,), (behind,), (light,), camera)
    frame, ray = rays(camera)
    point = frame.eye + 4.0 * ray
    size = np.abs(point[..., :2]).max(axis=-1)
    lit = (size < 1.0) & (size > 0.5)

    _, _, identity = surfaces(renderer, scene)
    assert ((identity == -1.0) == lit).mean() > 0.999
    assert (identity[~lit & (identity != -1.0)] == 0.0).all()

    back = replace(scene, lights=(replace(light, plane=Plane((0.0, 0.0, 0.0), (-1.0, 0.0, 0.0))),))
    _, _, identity = surfaces(renderer, back)
    assert (identity == 0.0).all(), "the back of a one-sided light shows what is behind it"

    both = replace(back, lights=(replace(back.lights[0], two_sided=True),))
    _, _, identity = surfaces(renderer, both)
    assert ((identity == -1.0) == lit).mean() > 0.999


def test_a_lamp_flush_with_a_wall_is_in_front_of_it(renderer: Renderer) -> None:
    facing = (math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0)
    wall = SceneObject("wall", "plane", "glossy", Transform((0.0, 0.0, -2.0), facing, (9.0,) * 3))
    lamp = AreaLight("lamp", SQUARE, Plane((0.3, 0.8, -2.0)))
    camera = Camera((2.0, 1.2, 4.0), (0.0, 0.8, 0.0))
    _, _, identity = surfaces(renderer, Scene((GLOSSY,), (wall,), (lamp,), camera))
    frame, ray = rays(camera)
    point = frame.eye + ray * ((-2.0 - frame.eye[2]) / ray[..., 2])[..., None]
    inside = (np.abs(point[..., 0] - 0.3) < 0.99) & (np.abs(point[..., 1] - 0.8) < 0.99)
    assert (identity[inside] == -1.0).all()


def test_pick(renderer: Renderer) -> None:
    scene = one_light()
    with pytest.raises(RuntimeError, match="nothing was rendered"):
        renderer.pick(0.5, 0.5)
    renderer.render(Shot(scene, RenderSettings(samples=3), *SIZE))
    frame = CameraFrame.of(scene.camera, SIZE[0] / SIZE[1])

    centre = renderer.pick(80.0, 40.0)
    assert centre is not None
    assert (centre.kind, centre.index) == ("light", 0)
    assert centre.position_ws[2] == pytest.approx(-2.0, abs=1e-5)

    ground = renderer.pick(20.25, 80.75)
    assert ground is not None
    assert (ground.kind, ground.index) == ("object", 0)
    direction = frame.ray(20.25, 80.75, SIZE)
    expected = frame.eye - direction * frame.eye[1] / direction[1]
    np.testing.assert_allclose(ground.position_ws, expected, atol=1e-5)
    np.testing.assert_allclose(ground.normal_ws, (0.0, 1.0, 0.0), atol=1e-6)
    assert ground.tangent_ws is None

    sphere = renderer.pick(107.0, 52.0)
    assert isinstance(sphere, Hit)
    assert (sphere.kind, sphere.index) == ("object", 1)
    distance = math.dist(sphere.position_ws, ball().transform.translate)
    assert distance == pytest.approx(0.5, rel=2e-3)
    outward = np.subtract(sphere.position_ws, ball().transform.translate) / distance
    assert np.dot(outward, sphere.normal_ws) > 0.999  # a mesh of facets

    assert renderer.pick(3.0, 3.0) is None
    for outside in ((-1.0, 5.0), (160.0, 5.0), (5.0, 90.0)):
        assert renderer.pick(*outside) is None


def test_pick_without_lights(renderer: Renderer) -> None:
    renderer.render(Shot(Scene((GLOSSY,), (floor(),)), RenderSettings(), *SIZE))
    hit = renderer.pick(80.0, 80.0)
    assert hit is not None
    assert hit.kind == "object"


def test_pick_of_brushed_metal(renderer: Renderer) -> None:
    """The tangent is the mesh's, in world space: the x axis of a plane turned and tilted."""
    half = math.radians(15.0)
    turn = (math.cos(half), 0.6 * math.sin(half), 0.0, 0.8 * math.sin(half))
    metal = replace(GLOSSY, alpha=(0.4, 0.05))
    plane = SceneObject("plate", "plane", GLOSSY.name, Transform((0.0, 0.0, 0.0), turn, (5.0,) * 3))
    scene = Scene((metal,), (plane,), (KEY,))
    renderer.render(Shot(scene, RenderSettings("ggx"), *SIZE))
    hit = renderer.pick(80.0, 70.0)
    assert hit is not None
    assert hit.tangent_ws is not None
    matrix = world_from_object(plane.transform)[:3, :3] / 5.0
    np.testing.assert_allclose(hit.tangent_ws, matrix[:, 0], atol=1e-6)
    np.testing.assert_allclose(hit.normal_ws, matrix[:, 1], atol=1e-6)


def test_octahedral_round_trip(ctx: moderngl.Context, tmp_path: Path) -> None:
    rng = np.random.default_rng(8)
    direction = rng.normal(size=(4000, 3))
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    direction = np.concatenate(
        [direction, axes, axes @ np.array([[1, 1, 0], [0, 1, 1], [1, 0, 1]])]
    )
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    body = """
        vec2 p = octahedral_from_direction(3.0 * direction);
        result = vec4(direction_from_octahedral(p), max(abs(p.x), abs(p.y)));
    """
    got = evaluate(ctx, tmp_path, ["common/octahedron.glsl"], body, {"direction": direction})
    assert np.abs(got[:, :3] - direction).max() < 4e-7
    assert got[:, 3].max() <= 1.0
    nothing = evaluate(
        ctx, tmp_path, ["common/octahedron.glsl"], body, {"direction": np.zeros((1, 3))}
    )
    np.testing.assert_array_equal(nothing[0, :3], [0.0, 0.0, 1.0])


def test_depth_is_logarithmic(ctx: moderngl.Context, tmp_path: Path) -> None:
    depth = np.geomspace(0.5 * NEAR, 2.0 * FAR, 999)
    got = evaluate(
        ctx, tmp_path, ["common/depth.glsl"], "result.x = log_depth(depth);", {"depth": depth}
    )[:, 0]
    expected = np.clip(np.log(depth / NEAR) / np.log(FAR / NEAR), 0.0, 1.0)
    np.testing.assert_allclose(got, expected, atol=2e-7)
    assert (np.diff(got) >= 0.0).all()
