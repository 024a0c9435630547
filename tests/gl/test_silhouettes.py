"""Back faces: never seen through a closed mesh's silhouette, always seen from inside."""

from __future__ import annotations

import math

import pytest

from app.meshes import load_mesh
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
from tests.gl.scenes import SQUARE

WHITE = Material("white", (0.8, 0.8, 0.8), (0.04, 0.04, 0.04), (0.3, 0.3))


def scene(mesh, transform, lamp, camera):
    thing = SceneObject("thing", mesh, "white", transform)
    return Scene(materials=(WHITE,), objects=(thing,), lights=(lamp,), camera=camera)


@pytest.mark.parametrize(
    ("mesh", "closed"), [("sphere", True), ("box", True), ("plane", False), ("disc", False)]
)
def test_which_meshes_are_closed(mesh, closed):
    assert load_mesh(mesh).is_closed is closed


@pytest.mark.parametrize("mirror", [1.0, -1.0])
def test_no_light_leaks_around_a_silhouette(renderer, mirror):
    """A sphere before a light behind it: its dark half stays dark, rim included."""
    lamp = AreaLight("l", SQUARE, Plane((0.0, 0.0, -3.0)), (50.0, 50.0, 50.0), visible=False)
    for step in range(12):
        eye = (0.1 * math.cos(step), 0.1 * math.sin(step), 6.0)
        transform = Transform(scale=(mirror, 1.0, 1.0), translate=(2.0, 0.0, 0.0))
        shot = Shot(
            scene("sphere", transform, lamp, Camera(eye, (2.0, 0.0, 0.0))),
            RenderSettings("ltc", 1),
            320,
            240,
        )
        renderer.render(shot)
        right = renderer.radiance()[:, 165:]  # turned away from the light
        assert right.max() <= 1e-6


def test_the_inside_of_a_closed_mesh_is_a_room(renderer):
    lamp = AreaLight("l", SQUARE, Plane((0.0, 0.0, -3.0)), (5.0, 5.0, 5.0), visible=False)
    room = scene("box", Transform(scale=(4.0, 4.0, 4.0)), lamp, Camera((0, 0, 3), (0.5, -1, 0)))
    renderer.render(Shot(room, RenderSettings("ltc", 1), 64, 48))
    assert all(renderer.pick(x, y) for x in range(0, 64, 9) for y in range(0, 48, 9))
    assert renderer.radiance()[-8:].max() > 0.01  # the floor, lit
