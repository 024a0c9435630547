"""Pictures of lobes, what lies over them, and the surface points they are of."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from app.gui.lobe_point import SurfacePoint, light_lines, light_share, subject_of
from app.lobe_picture import Scale, directions_above, graticule, lobe_images, marks, number
from app.render.camera import normal_from_object, world_from_object
from app.render.picking import Hit
from app.scene import (
    AreaLight,
    Camera,
    Material,
    Outline,
    Plane,
    PolygonContour,
    Scene,
    SceneObject,
    Transform,
)
from ltc.lobe import WHOLE, Case, disk_from_direction, lobe_pair, pixel_directions


@pytest.mark.parametrize("logarithmic", [False, True])
def test_scale(logarithmic: bool) -> None:
    scale = Scale(37.0, logarithmic)
    values = np.array([0.0, 1e-5, 0.4, 37.0])
    places = scale.place(values)
    assert (places[0], places[-1]) == (0.0, 1.0)
    assert (np.diff(places) >= 0.0).all()
    np.testing.assert_allclose(scale.signed_place(values) + scale.signed_place(-values), 1.0)
    for place, text in scale.ticks():
        assert place == pytest.approx(float(scale.place(np.array(float(text)))), abs=1e-9)
    for place, text in scale.signed_ticks():
        value = float(text.replace("−", "-"))
        assert place == pytest.approx(float(scale.signed_place(np.array(value))), abs=1e-9)


def test_numbers_are_short() -> None:
    texts = [number(v) for v in (0.0, 0.0123456, 12.3456, 1e-4, 2.5e-7, 123456.0)]
    assert texts == ["0", "0.0123", "12.3", "1e-4", "2.5e-7", "1.2e5"]


def test_images() -> None:
    pair = lobe_pair(Case(0.3, 0.3, 0.6))
    first, second, third = lobe_images(pair, 64, WHOLE, Scale(pair.peak, True))
    for image in (first, second, third):
        assert image.shape == (64, 64, 4)
        assert image[32, 32, 3] == 255
        assert image[0, 0, 3] == 0, "outside the disk"
    same = lobe_images(pair, 64, WHOLE, Scale(pair.peak, False))
    assert not np.array_equal(first, same[0])
    middle = third[:, :, :3][third[..., 3] == 255].astype(int).sum(-1)
    assert np.median(middle) < 120, "where the lobes agree the difference is dark"


def test_marks_and_graticule() -> None:
    case = Case(0.05, 0.4, 1.0, 0.5)
    found = {mark.name: (mark.x, mark.y) for mark in marks(case)}
    assert found["normal"] == (0.0, 0.0)
    assert found["tangent"] == (1.0, 0.0)
    assert np.allclose(found["view"], disk_from_direction(case.wo))
    assert np.allclose(np.add(found["view"], found["mirror"]), 0.0)
    assert "tangent" not in {mark.name for mark in marks(Case(0.1, 0.1, 1.0))}
    labels = [line.label for line in graticule(case, WHOLE)]
    assert {"30°", "60°"} <= set(labels)

    sharp = lobe_pair(Case(0.001, 0.001, 1.0, 0.5))
    rings = [line for line in graticule(sharp.case, sharp.window) if line.kind == "angle"]
    assert rings
    for ring in rings:
        apart = np.linalg.norm(ring.points - disk_from_direction(sharp.case.mirror), axis=-1)
        # From mirror direction to ring: the map stretches lengths by sqrt(1/8) to sqrt(2).
        ratio = apart / math.radians(float(ring.label[:-1]))
        assert (ratio > 0.49).all()
        assert (ratio < 1.01).all()
        assert apart.max() < sharp.window.half * math.sqrt(2.0)


def test_lines_end_at_the_horizon() -> None:
    frame = np.eye(3)
    wall = np.array([[1.0, 1.0, 1.0], [1.0, 1.0, -1.0], [1.0, -1.0, -1.0], [1.0, -1.0, 1.0]])
    first, second = directions_above(wall, np.zeros(3), frame)
    np.testing.assert_allclose(np.linalg.norm(first[-1]), 1.0)
    np.testing.assert_allclose(np.linalg.norm(second[0]), 1.0)
    np.testing.assert_allclose(first[-1] / first[-1, 0], [1.0, 1.0])
    above = np.array([[0.2, 0.1, 2.0], [-0.3, 0.4, 1.0]])
    (line,) = directions_above(above, np.zeros(3), frame)
    unit = above / np.linalg.norm(above, axis=-1, keepdims=True)
    np.testing.assert_allclose(line, disk_from_direction(unit))
    assert directions_above(-above, np.zeros(3), frame) == []


METAL = Material("metal", (0.0, 0.0, 0.0), (1.0, 1.0, 1.0), (0.4, 0.05), rotation=0.3)
PLATE = SceneObject("plate", "plane", "metal", Transform((0.5, 0.2, -0.3), scale=(2.0, 1.0, 3.0)))
SCENE = Scene((METAL,), (PLATE,), camera=Camera((2.0, 2.0, 1.0)))


def hit_on(scene: Scene, local: tuple[float, float, float], tangents: bool = True) -> Hit:
    """Return what picking says of a point of the plane, whose normal is +y and tangent +x."""
    matrix = world_from_object(scene.objects[0].transform)
    position = matrix[:3, :3] @ local + matrix[:3, 3]
    normal = normal_from_object(matrix) @ np.array([0.0, 1.0, 0.0])
    tangent = matrix[:3, 0] / np.linalg.norm(matrix[:3, 0])
    normal /= np.linalg.norm(normal)
    return Hit("object", 0, tuple(position), tuple(normal), tuple(tangent) if tangents else None)


def test_a_point_of_brushed_metal() -> None:
    point = SurfacePoint.of(hit_on(SCENE, (0.1, 0.0, 0.2)), SCENE)
    assert point is not None
    seen = subject_of(point, SCENE, SCENE.camera)
    assert seen is not None
    assert (seen.case.alpha_x, seen.case.alpha_y) == METAL.alpha
    # The plane's bitangent normal x tangent is -z; the brushing is turned by .3 towards it.
    x = np.array([math.cos(0.3), 0.0, -math.sin(0.3)])
    np.testing.assert_allclose(seen.frame[0], x, atol=1e-12)
    np.testing.assert_allclose(seen.frame[2], [0.0, 1.0, 0.0], atol=1e-12)
    assert np.linalg.det(seen.frame) == pytest.approx(1.0)
    wo = np.array(SCENE.camera.eye) - seen.position
    wo /= np.linalg.norm(wo)
    np.testing.assert_allclose(seen.frame @ wo, seen.case.wo, atol=1e-12)

    # It moves and turns with its object, and so do normal and tangent.
    c, s = math.cos(0.4), math.sin(0.4)
    turned = replace(PLATE.transform, translate=(1.0, 2.0, 3.0), rotate=(c, s, 0.0, 0.0))
    scene = replace(SCENE, objects=(replace(PLATE, transform=turned),))
    later = subject_of(point, scene, SCENE.camera)
    assert later is not None
    matrix = world_from_object(turned)
    want = hit_on(scene, (0.1, 0.0, 0.2))
    np.testing.assert_allclose(later.position, want.position_ws, atol=1e-12)
    np.testing.assert_allclose(np.abs(later.frame[2] @ want.normal_ws), 1.0)
    assert later.frame[2] @ (np.array(SCENE.camera.eye) - later.position) > 0.0
    assert abs(later.frame[0] @ (matrix[:3, 0] / 2.0)) == pytest.approx(math.cos(0.3))

    gone = replace(SCENE, objects=(replace(PLATE, name="other"),))
    assert subject_of(point, gone, SCENE.camera) is None


def test_isotropic_points_have_the_viewer_to_their_right() -> None:
    scene = replace(SCENE, materials=(replace(METAL, alpha=(0.2, 0.2)),))
    point = SurfacePoint.of(hit_on(scene, (0.1, 0.0, 0.2)), scene)
    assert point is not None
    seen = subject_of(point, scene, scene.camera)
    assert seen is not None
    assert not seen.case.is_anisotropic
    assert seen.case.phi == 0.0
    assert seen.case.wo[0] > 0.0

    without = SurfacePoint.of(hit_on(SCENE, (0.1, 0.0, 0.2), tangents=False), SCENE)
    assert without is not None
    flat = subject_of(without, SCENE, SCENE.camera)
    assert flat is not None
    assert flat.case.alpha_x == flat.case.alpha_y == pytest.approx(math.sqrt(0.4 * 0.05))
    assert "isotropic" in flat.note


def test_lights_where_a_point_sees_them() -> None:
    square = Outline((PolygonContour(((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))),))
    down = AreaLight("down", square, Plane((0.5, 3.2, -0.3), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)))
    scene = replace(SCENE, lights=(down, replace(down, name="up", plane=Plane(
        (0.5, 3.2, -0.3), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)))))  # fmt: skip
    point = SurfacePoint.of(hit_on(scene, (0.0, 0.0, 0.0)), scene)
    assert point is not None
    seen = subject_of(point, scene, scene.camera)
    assert seen is not None
    dim, bright = light_lines(scene.lights, 0, seen)
    assert (dim.shines, bright.shines) == (False, True)
    assert (dim.chosen, bright.chosen) == (False, True)
    # Three metres overhead: its corners, sqrt(2) aside, are all as far from the normal.
    far = np.linalg.norm(bright.points, axis=-1).max()
    cosine = 3.0 / math.sqrt(3.0**2 + 2.0)
    assert far == pytest.approx(math.sqrt(1.0 - cosine), rel=1e-9)
    np.testing.assert_allclose(bright.points[0], bright.points[-1])


def test_what_a_light_adds() -> None:
    """Against the integral of the pictures themselves: pixels within the light's outline."""
    square = Outline((PolygonContour(((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))),))
    lamp = AreaLight("lamp", square, Plane((-0.8, 1.8, -0.9), (1.0, 0.2, 0.0), (0.0, 0.3, 1.0)))
    point = SurfacePoint.of(hit_on(SCENE, (0.0, 0.0, 0.0)), SCENE)
    assert point is not None
    seen = subject_of(point, SCENE, SCENE.camera)
    assert seen is not None
    pair = lobe_pair(seen.case)
    size = 1024
    w, _ = pixel_directions(size)
    normal = np.cross(lamp.plane.u, lamp.plane.v)
    away = w @ seen.frame
    distance = (np.array(lamp.plane.origin) - seen.position) @ normal / (away @ normal)
    flat = seen.position + distance[:, None] * away - np.array(lamp.plane.origin)
    st = flat @ np.linalg.pinv(np.array([lamp.plane.u, lamp.plane.v]))
    covered = (distance > 0.0) & (np.abs(st) < 1.0).all(axis=-1)
    solid_angle = 8.0 / size**2
    want = [f(w)[covered].sum() * solid_angle for f in (pair.ggx, pair.ltc)]
    got = light_share(lamp, seen, pair)
    np.testing.assert_allclose(got, want, rtol=0.01)  # pixels at the edge, in or out as a whole
    assert got[0] > 0.01
    turned = replace(lamp, plane=replace(lamp.plane, u=lamp.plane.v, v=lamp.plane.u))
    assert light_share(turned, seen, pair) == (0.0, 0.0)
    both = replace(turned, two_sided=True)
    np.testing.assert_allclose(light_share(both, seen, pair), got, rtol=1e-9)
