"""Scene files: JSON to `Scene` and back, exactly.

The format is ``ltc-scene/1``. Every key but ``format`` has a default, unknown
keys are errors, and each error is one sentence that names the file, the place
in it (``lights[0].outline.contours[1].polygon[2]``, or line and column where
the JSON itself is broken), what was found and what was expected.

Reading is a walk over the parsed JSON (`app.json_reader`) with one small
function per part, next to the function that writes that part; lights have a
module of their own (`app.light_io`).
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from app.errors import InputError, describe, expected_one_of, nearest
from app.files import absolute_path, read_file, relative_path, replace_file
from app.json_reader import (
    JsonObject,
    PlaceError,
    Reader,
    build_part,
    fill_names,
    parse_json,
    place_of,
    read_angle,
    read_choice,
    read_colour,
    read_list,
    read_name,
    read_number,
    read_object,
    read_rotation,
    read_text,
    read_vec2,
    read_vec3,
)
from app.json_writer import degrees, layout
from app.light_io import light_fields, read_lights, with_absolute_paths
from app.meshes import check_mesh_path
from app.scene import (
    BUILT_IN_MESHES,
    TONE_MAPS,
    Camera,
    Display,
    Material,
    Scene,
    SceneObject,
    Transform,
)
from ltc.resources import resource_path

FORMAT = "ltc-scene/1"
FORMAT_FAMILY = "ltc-scene/"

DEFAULT_MATERIAL = "default"
DEFAULT_MESH = "sphere"

LARGEST_FILE = 256 * 2**20
"""Bytes of a scene file; anything larger is not a scene."""


# Files


def load_scene(path: Path | str) -> Scene:
    """Read a scene file.

    Paths are relative to the file and become absolute. Those of meshes must
    exist; the meshes themselves are read when they are drawn, and pictures too.
    Fonts and drawings are read only for lights that lack the outline made from them.

    Raises
    ------
    InputError
        If the file cannot be read or is not a valid scene.
    """
    path = Path(path)
    scene = scene_from_json(_read_text(path), path.parent, str(path))
    for index, item in enumerate(scene.objects):
        if item.mesh not in BUILT_IN_MESHES:
            try:
                check_mesh_path(Path(item.mesh))
            except InputError as error:
                raise InputError(f"{path}: objects[{index}].mesh: {error}") from None
    return scene


def save_scene(scene: Scene, path: Path | str) -> None:
    """Write a scene file in one step: either the old or the new file is there, never half.

    Paths are written relative to the file. What was written is read back
    first, so that a saved scene always opens.

    Raises
    ------
    InputError
        If the file cannot be written, or the scene holds what a file cannot.
    """
    path = Path(path)
    text = scene_to_json(scene, path.parent)
    meant = replace(
        scene,
        objects=tuple(_with_absolute_mesh(item) for item in scene.objects),
        lights=tuple(with_absolute_paths(light) for light in scene.lights),
    )
    try:
        if scene_from_json(text, path.parent, str(path)) != meant:
            raise InputError(f"{path}: this scene does not survive a file, expected an exact copy")
        data = text.encode("utf-8")
    except UnicodeEncodeError:
        raise InputError(
            f"{path}: a name in the scene holds half a character, expected valid text"
        ) from None
    replace_file(path, data, "a scene file")


def demo_scenes() -> dict[str, Path]:
    """Return the demo scenes' names and files, in alphabetic order."""
    return {path.stem: path for path in sorted(resource_path("assets", "scenes").glob("*.json"))}


def _read_text(path: Path) -> str:
    data = read_file(path, "a scene file", ".json", LARGEST_FILE)
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise InputError(f"{path}: the file is in UTF-16, expected UTF-8")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(
            f"{path}: byte {error.start} is {data[error.start]:#04x}, expected UTF-8 text"
        ) from None


# Reading


def scene_from_json(text: str, base: Path | None, name: str) -> Scene:
    """Return the scene that a text describes.

    Parameters
    ----------
    text : str
        JSON as in scene files.
    base : Path or None
        The folder that paths are relative to; None is the current one.
    name : str
        What errors call the text, such as the file's name.

    Raises
    ------
    InputError
        Naming ``name`` and the place in the text.
    """
    if not text.strip("\ufeff \t\r\n"):
        raise InputError(f'{name}: the file is empty, expected {{"format": "{FORMAT}", ...}}')
    document = parse_json(text, name)
    try:
        return _scene(document, base or Path())
    except PlaceError as fault:
        place = f"{fault.place}: " if fault.place else ""
        raise InputError(f"{name}: {place}{fault.message}") from None


def _scene(value: Any, base: Path) -> Scene:
    if not isinstance(value, JsonObject):
        raise PlaceError("", f'found {describe(value)}, expected {{"format": "{FORMAT}", ...}}')
    _check_format(value)
    readers: dict[str, Reader] = {
        "format": lambda _value, _place: None,
        "camera": _camera,
        "materials": _materials,
        "objects": lambda items, place: _objects(items, place, base),
        "lights": lambda items, place: read_lights(items, place, base),
        "display": _display,
    }
    parts = read_object(value, "", "a scene", readers)
    del parts["format"]
    materials: tuple[Material, ...] = parts.get("materials", ())
    objects: tuple[SceneObject, ...] = parts.get("objects", ())
    names = {material.name for material in materials}
    for index, item in enumerate(objects):
        given = "material" in value["objects"][index]
        if not given and DEFAULT_MATERIAL not in names:
            materials = (*materials, Material(DEFAULT_MATERIAL))
            names.add(DEFAULT_MATERIAL)
        elif item.material not in names:
            raise PlaceError(
                f"objects[{index}].material",
                f"found '{item.material}', which is not among the scene's materials, "
                + expected_one_of(item.material, names),
            )
    parts["materials"] = materials
    return build_part("", "", Scene, **parts)


def _check_format(value: JsonObject) -> None:
    if "format" not in value:
        guess = nearest("format", [key for key in value if key != "format"])
        meant = f" (did you mean it by '{guess}'?)" if guess else ""
        raise PlaceError("", f'the key "format" is missing, expected "format": "{FORMAT}"{meant}')
    found = value["format"]
    if found == FORMAT:
        return
    newer = isinstance(found, str) and found.startswith(FORMAT_FAMILY)
    hint = " (a newer version of this program may read the file)" if newer else ""
    raise PlaceError("format", f'found {describe(found)}, expected "{FORMAT}"{hint}')


def _camera(value: Any, place: str) -> Camera:
    readers: dict[str, Reader] = {
        "eye": read_vec3,
        "target": read_vec3,
        "up": read_vec3,
        "fov_y": read_angle,
    }
    return build_part(place, "camera", Camera, **read_object(value, place, "a camera", readers))


def _materials(value: Any, place: str) -> tuple[Material, ...]:
    if not isinstance(value, JsonObject):
        raise PlaceError(
            place, f"found {describe(value)}, expected an object of materials by their names"
        )
    if value.repeated is not None:
        raise PlaceError(
            place, f"the material '{value.repeated}' occurs twice, expected unique names"
        )
    return tuple(_material(item, place_of(place, key), key, place) for key, item in value.items())


def _material(value: Any, place: str, name: str, parent: str) -> Material:
    readers: dict[str, Reader] = {
        "diffuse": read_colour,
        "f0": read_colour,
        "alpha": lambda item, at: read_vec2(item, at, "[along the tangent, along the bitangent]"),
        "rotation": read_angle,
    }
    read_text(name, parent, "a name for each material")
    values = read_object(value, place, "a material", readers)
    return build_part(place, f"material '{name}'", Material, name=name, **values)


def _objects(value: Any, place: str, base: Path) -> tuple[SceneObject, ...]:
    def mesh(item: Any, at: str) -> str:
        found = read_text(item, at, f"a path or one of {', '.join(BUILT_IN_MESHES)}")
        return found if found in BUILT_IN_MESHES else absolute_path(folder / found)

    folder = base.resolve()
    readers: dict[str, Reader] = {
        "name": read_name,
        "mesh": mesh,
        "material": lambda item, at: read_text(item, at, "a material's name"),
        "transform": _transform,
    }
    items = read_list(value, place, "objects")
    read = [
        read_object(item, f"{place}[{i}]", "an object", readers) for i, item in enumerate(items)
    ]
    fill_names(read, place, "object")
    return tuple(
        SceneObject(**{"mesh": DEFAULT_MESH, "material": DEFAULT_MATERIAL, **values})
        for values in read
    )


def _transform(value: Any, place: str) -> Transform:
    readers: dict[str, Reader] = {
        "translate": read_vec3,
        "rotate": read_rotation,
        "scale": read_vec3,
    }
    return build_part(
        place, "transform", Transform, **read_object(value, place, "a transform", readers)
    )


def _display(value: Any, place: str) -> Display:
    readers: dict[str, Reader] = {
        "exposure": read_number,
        "tone_map": lambda item, at: read_choice(item, at, TONE_MAPS),
    }
    return build_part(
        place, "display", Display, **read_object(value, place, "display settings", readers)
    )


# Writing


def scene_to_json(scene: Scene, base: Path | None) -> str:
    """Return a scene as the text of a scene file, every key written out.

    Parameters
    ----------
    scene : Scene
        With absolute paths.
    base : Path or None
        The folder that paths are written relative to; None keeps them absolute.

    Returns
    -------
    str
        JSON that `scene_from_json` turns back into an equal scene.
    """
    document = {
        "format": FORMAT,
        "camera": {
            "eye": scene.camera.eye,
            "target": scene.camera.target,
            "up": scene.camera.up,
            "fov_y": degrees(scene.camera.fov_y),
        },
        "materials": {
            material.name: {
                "diffuse": material.diffuse,
                "f0": material.f0,
                "alpha": material.alpha,
                "rotation": degrees(material.rotation),
            }
            for material in scene.materials
        },
        "objects": [
            {
                "name": item.name,
                "mesh": _mesh_reference(item.mesh, base),
                "material": item.material,
                "transform": {
                    "translate": item.transform.translate,
                    "rotate": item.transform.rotate,
                    "scale": item.transform.scale,
                },
            }
            for item in scene.objects
        ],
        "lights": [light_fields(light, base) for light in scene.lights],
        "display": {"exposure": scene.display.exposure, "tone_map": scene.display.tone_map},
    }
    return layout(document, 0) + "\n"


def _mesh_reference(mesh: str, base: Path | None) -> str:
    if mesh in BUILT_IN_MESHES:
        return mesh
    relative = relative_path(mesh, base)
    return f"./{relative}" if relative in BUILT_IN_MESHES else relative


def _with_absolute_mesh(item: SceneObject) -> SceneObject:
    return item if item.mesh in BUILT_IN_MESHES else replace(item, mesh=absolute_path(item.mesh))
