"""What the editor can do to a scene: pure functions from a scene to a new one.

Nothing is changed in place; unchanged parts are shared with the input, so a
history of scenes costs little. Lights and objects are named by their index,
materials by their name.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from app import contours
from app.lights import bounds_of, move_light, regular_polygon
from app.pictures import picture_size
from app.presets import PRESETS
from app.scene import (
    AreaLight,
    Camera,
    Material,
    Outline,
    OutlineSource,
    Picture,
    Plane,
    PolygonContour,
    Scene,
    SceneObject,
    SvgSource,
    TextSource,
    Transform,
)
from app.sources import outline_from
from app.vectors import (
    add,
    cross,
    dot,
    length,
    multiply_quaternions,
    normalize,
    quaternion_of,
    scale,
    subtract,
)

FloatArray = NDArray[np.float64]

NEW_MATERIAL = Material("new", (0.4, 0.4, 0.4), (0.04, 0.04, 0.04), (0.0625, 0.0625))
"""What a new object is made of: grey, satin."""


def unique_name(wanted: str, taken: Iterable[str]) -> str:
    """Return ``wanted``, or with the first free number behind it: 'key', 'key 2', ..."""
    names = set(taken)
    if wanted not in names:
        return wanted
    stem, _, tail = wanted.rpartition(" ")
    base = stem if stem and tail.isdigit() else wanted
    number = 2
    while f"{base} {number}" in names:
        number += 1
    return f"{base} {number}"


def replace_light(scene: Scene, index: int, light: AreaLight) -> Scene:
    """Put another light in the place of light ``index``."""
    return replace(scene, lights=(*scene.lights[:index], light, *scene.lights[index + 1 :]))


def replace_object(scene: Scene, index: int, item: SceneObject) -> Scene:
    """Put another object in the place of object ``index``."""
    return replace(scene, objects=(*scene.objects[:index], item, *scene.objects[index + 1 :]))


def replace_material(scene: Scene, name: str, material: Material) -> Scene:
    """Put another material in the place of the one called ``name``; objects follow a new name."""
    materials = tuple(material if m.name == name else m for m in scene.materials)
    objects = scene.objects
    if material.name != name:
        objects = tuple(
            replace(item, material=material.name) if item.material == name else item
            for item in objects
        )
    return replace(scene, materials=materials, objects=objects)


def add_light(
    scene: Scene,
    outline: Outline | None = None,
    name: str = "light",
    source: OutlineSource | None = None,
) -> tuple[Scene, int]:
    """Add a light above and behind the camera's target, facing it; return the scene and its index.

    Parameters
    ----------
    outline : Outline, optional
        In metres, upright as it is seen; a square of `new_size` if there is none.
    source : OutlineSource, optional
        What the outline was made from.
    """
    camera = scene.camera
    up = normalize(camera.up)
    away = subtract(camera.target, camera.eye)
    distance = length(away)
    flat = normalize(subtract(away, scale(up, dot(away, up))))
    origin = add(camera.target, add(scale(up, 0.22 * distance), scale(flat, 0.35 * distance)))
    normal = normalize(subtract(camera.target, origin))
    right = normalize(cross(flat, up))
    if outline is None:
        outline = Outline((regular_polygon(4, new_size(camera) / math.sqrt(2.0)),))
    light = AreaLight(
        name=unique_name(name, (light.name for light in scene.lights)),
        outline=outline,
        plane=Plane(origin, right, cross(normal, right)),
        radiance=(5.0, 5.0, 5.0),
        source=source,
    )
    return replace(scene, lights=(*scene.lights, light)), len(scene.lights)


def new_size(camera: Camera) -> float:
    """Return the longer side [m] of a new light: a third of the distance at which one looks."""
    return 0.32 * length(subtract(camera.target, camera.eye))


def add_preset(scene: Scene, name: str) -> tuple[Scene, int]:
    """Add a light of one of `app.presets.PRESETS`, of `new_size`; return its index."""
    outline = PRESETS[name]()
    low, high = np.array(contours.bounds(outline))
    factor = new_size(scene.camera) / float((high - low).max())
    shift = -0.5 * factor * (low + high)
    fitted = tuple(
        contours.transform(contour, factor * np.eye(2), shift) for contour in outline.contours
    )
    return add_light(scene, replace(outline, contours=fitted), name.lower())


def add_picture(scene: Scene, picture: Picture) -> tuple[Scene, int]:
    """Add a rectangular light with a picture and of its shape; return its index.

    Raises
    ------
    InputError
        If the picture's size cannot be read.
    """
    columns, rows = picture_size(picture)
    texel = 0.5 * new_size(scene.camera) / max(columns, rows)
    s, t = columns * texel, rows * texel
    outline = Outline((PolygonContour(((-s, -t), (s, -t), (s, t), (-s, t))),))
    scene, index = add_light(scene, outline, Path(picture.file).stem)
    return replace_light(scene, index, replace(scene.lights[index], picture=picture)), index


def add_text(scene: Scene, text: str = "Light", font: str = "") -> tuple[Scene, int]:
    """Add a text as a light, in a font file or the program's own; return its index.

    Raises
    ------
    InputError
        If the font cannot be read or lacks a letter.
    """
    source = TextSource(text, font, size=0.6 * new_size(scene.camera))
    return add_light(scene, outline_from(source), "text", source)


def add_drawing(scene: Scene, path: str) -> tuple[Scene, int]:
    """Add a drawing, an SVG file by its absolute path, as a light; return its index.

    Raises
    ------
    InputError
        If the file cannot be read.
    """
    source = SvgSource(path, size=1.25 * new_size(scene.camera))
    return add_light(scene, outline_from(source), Path(path).stem, source)


def add_object(
    scene: Scene, mesh: str, name: str, transform: Transform | None = None
) -> tuple[Scene, int]:
    """Add a mesh (built-in name or absolute path) with a material of its own; return its index.

    Without a transform, spheres and boxes are half as large as they come and
    stand on the ground.
    """
    if transform is None:
        transform = Transform()
        if mesh in ("sphere", "box"):
            transform = Transform((0.0, 0.5, 0.0), scale=(0.5, 0.5, 0.5))
    material = replace(NEW_MATERIAL, name=unique_name(name, (m.name for m in scene.materials)))
    item = SceneObject(
        name=unique_name(name, (item.name for item in scene.objects)),
        mesh=mesh,
        material=material.name,
        transform=transform,
    )
    grown = replace(scene, materials=(*scene.materials, material), objects=(*scene.objects, item))
    return grown, len(scene.objects)


def remove_light(scene: Scene, index: int) -> Scene:
    """Remove light ``index``."""
    return replace(scene, lights=scene.lights[:index] + scene.lights[index + 1 :])


def remove_object(scene: Scene, index: int) -> Scene:
    """Remove object ``index``; its material stays."""
    return replace(scene, objects=scene.objects[:index] + scene.objects[index + 1 :])


def duplicate_light(scene: Scene, index: int) -> tuple[Scene, int]:
    """Add a copy of a light, shifted along its plane by its own width; return its index."""
    light = scene.lights[index]
    _, radius = bounds_of(light)
    shift = scale(normalize(light.plane.u), 1.5 * radius)
    name = unique_name(light.name, (other.name for other in scene.lights))
    copy = replace(move_light(light, shift), name=name)
    return replace(scene, lights=(*scene.lights, copy)), len(scene.lights)


def duplicate_object(scene: Scene, index: int) -> tuple[Scene, int]:
    """Add a copy of an object, half a metre to the right; return its index."""
    item = scene.objects[index]
    name = unique_name(item.name, (other.name for other in scene.objects))
    moved = replace(item.transform, translate=add(item.transform.translate, (0.5, 0.0, 0.0)))
    copy = replace(item, name=name, transform=moved)
    return replace(scene, objects=(*scene.objects, copy)), len(scene.objects)


def own_material(scene: Scene, index: int) -> Scene:
    """Give object ``index`` a material of its own, a copy of the one it shares."""
    item = scene.objects[index]
    material = scene.material_of(item)
    name = unique_name(material.name, (other.name for other in scene.materials))
    widened = replace(scene, materials=(*scene.materials, replace(material, name=name)))
    return replace_object(widened, index, replace(item, material=name))


def rename_light(scene: Scene, index: int, name: str) -> Scene:
    """Name a light; an empty name changes nothing, a taken one gets a number."""
    light, name = scene.lights[index], name.strip()
    if not name or name == light.name:
        return scene
    taken = (other.name for other in scene.lights if other is not light)
    return replace_light(scene, index, replace(light, name=unique_name(name, taken)))


def rename_object(scene: Scene, index: int, name: str) -> Scene:
    """Name an object; an empty name changes nothing, a taken one gets a number."""
    item, name = scene.objects[index], name.strip()
    if not name or name == item.name:
        return scene
    taken = (other.name for other in scene.objects if other is not item)
    return replace_object(scene, index, replace(item, name=unique_name(name, taken)))


def rename_material(scene: Scene, material: str, name: str) -> Scene:
    """Name a material; its objects follow. Empty and taken names as `rename_light`."""
    name = name.strip()
    if not name or name == material:
        return scene
    old = next(m for m in scene.materials if m.name == material)
    taken = (other.name for other in scene.materials if other is not old)
    return replace_material(scene, material, replace(old, name=unique_name(name, taken)))


def transform_object(item: SceneObject, rigid: FloatArray) -> SceneObject:
    """Return the object moved by a (4, 4) world matrix of rotation and translation."""
    transform = item.transform
    x, y, z = (rigid[:3, :3] @ transform.translate + rigid[:3, 3]).tolist()
    turn = quaternion_of(rigid[:3, :3])
    product = multiply_quaternions(turn, transform.rotate)
    norm = math.hypot(*product)
    w, i, j, k = (component / norm for component in product)
    return replace(item, transform=replace(transform, translate=(x, y, z), rotate=(w, i, j, k)))
