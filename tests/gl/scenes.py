"""Small scenes that several tests render."""

from __future__ import annotations

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

SQUARE = Outline((PolygonContour(((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))),))
FRAME = Outline(
    (
        PolygonContour(((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))),
        PolygonContour(((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5))),
    )
)

GLOSSY = Material("glossy", (0.2, 0.2, 0.2), (0.04, 0.04, 0.04), (0.1, 0.1))
MATTE = Material("matte", (0.5, 0.4, 0.3), (0.0, 0.0, 0.0))
MIRROR = Material("mirror", (0.0, 0.0, 0.0), (0.9, 0.9, 0.9), (0.05, 0.05))

KEY = AreaLight("key", SQUARE, Plane((0.0, 1.0, -2.0)), (5.0, 4.0, 3.0))


def floor(material: Material = GLOSSY) -> SceneObject:
    return SceneObject("floor", "plane", material.name, Transform(scale=(10.0, 10.0, 10.0)))


def ball(material: Material = GLOSSY) -> SceneObject:
    transform = Transform(translate=(1.0, 0.5, 0.0), scale=(0.5, 0.5, 0.5))
    return SceneObject("ball", "sphere", material.name, transform)


def one_light(material: Material = GLOSSY, light: AreaLight = KEY) -> Scene:
    """A floor, a ball, and a square light behind them that faces the camera."""
    return Scene(materials=(material,), objects=(floor(material), ball(material)), lights=(light,))


def many_lights(count: int, *, two_sided: bool = False) -> Scene:
    """A floor under a ring of small coloured lights."""
    lights = tuple(
        AreaLight(
            f"light {i}",
            SQUARE,
            Plane(
                ((i % 32 - 15.5) * 0.3, 0.6 + 0.05 * (i % 7), -1.0 - 0.4 * (i // 32)),
                (0.1, 0.0, 0.0),
                (0.0, 0.1, 0.0),
            ),
            (1.0 + i % 3, 2.0 - i % 2, 1.0),
            two_sided=two_sided and i % 2 == 0,
        )
        for i in range(count)
    )
    return Scene(materials=(GLOSSY,), objects=(floor(),), lights=lights)


DARK = Scene(materials=(GLOSSY,), objects=(floor(),), lights=())
CLOSE_CAMERA = Camera((0.0, 0.5, 1.0), (0.0, 0.4, 0.0))
