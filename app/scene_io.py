"""Scene files: JSON to `Scene` and back, exactly.

The format is ``ltc-scene/1``. Every key but ``format`` has a default, unknown
keys are errors, and each error is one sentence that names the file, the place
in it (``lights[0].outline.contours[1].polygon[2]``, or line and column where
the JSON itself is broken), what was found and what was expected.

Reading is a walk over the parsed JSON with one small function per part, next
to the function that writes that part. What later versions add has its
key named in `_LATER`, so that this version says plainly that it cannot
read it.

Numbers keep their text while reading. Angles need that: degrees times pi/180
in float64 skips some radians, so that not every scene could be written. A
number with more digits than float64 needs is converted in decimal arithmetic;
with that every angle has a text that reads back to the very same bits, and
ordinary ones stay short.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from decimal import Context, Decimal
from itertools import islice
from pathlib import Path
from typing import Any, TypeVar

from app.errors import InputError, describe, expected_one_of, nearest, os_reason, require_file
from app.files import replace_file
from app.meshes import check_mesh_path
from app.scene import (
    ANCHOR_KINDS,
    BUILT_IN_MESHES,
    FILL_RULES,
    TONE_MAPS,
    AnchorKind,
    AreaLight,
    BezierContour,
    Camera,
    Contour,
    CubicCurve,
    Display,
    Material,
    Outline,
    Plane,
    PolygonContour,
    Scene,
    SceneError,
    SceneObject,
    Transform,
    Vec2,
    Vec3,
)
from ltc.resources import resource_path

FORMAT = "ltc-scene/1"
FORMAT_FAMILY = "ltc-scene/"

DEFAULT_MATERIAL = "default"
DEFAULT_MESH = "sphere"
DEFAULT_CONTOUR = PolygonContour(((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)))

LARGEST_NUMBER = 1e15
"""Beyond this the square of a number, times a scene's sizes, leaves float32."""

LARGEST_FILE = 256 * 2**20
"""Bytes of a scene file; anything larger is not a scene."""

SNAP = 1e-6
"""Curves whose ends lie closer than this share of their contour's extent meet there."""

LINE_LENGTH = 100
"""Columns of a written file; names and long numbers may exceed it."""

_LATER = {"texture": "textured lights", "text": "text lights", "svg": "SVG lights"}
"""Keys of the format that this version does not support, and what they stand for."""

_DECIMAL = Context(prec=60)
_PI = Decimal("3.14159265358979323846264338327950288419716939937510582097494459")

T = TypeVar("T")


# Files


def load_scene(path: Path | str) -> Scene:
    """Read a scene file.

    Mesh paths are relative to the file, must exist and become absolute; the
    meshes themselves are read when they are drawn.

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

    Mesh paths are written relative to the file. What was written is read back
    first, so that a saved scene always opens.

    Raises
    ------
    InputError
        If the file cannot be written, or the scene holds what a file cannot.
    """
    path = Path(path)
    text = scene_to_json(scene, path.parent)
    meant = replace(scene, objects=tuple(_with_absolute_mesh(item) for item in scene.objects))
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
    require_file(path, "a scene file (.json)")
    try:
        size = path.stat().st_size
        if size > LARGEST_FILE:
            raise InputError(f"{path}: the file has {size} bytes, expected at most {LARGEST_FILE}")
        data = path.read_bytes()
    except OSError as error:
        raise InputError(
            f"{path}: cannot be read ({os_reason(error)}), expected a scene file"
        ) from error
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
        The folder that mesh paths are relative to; None is the current one.
    name : str
        What errors call the text, such as the file's name.

    Raises
    ------
    InputError
        Naming ``name`` and the place in the text.
    """
    document = _parse(text, name)
    try:
        return _scene(document, base or Path())
    except _PlaceError as fault:
        place = f"{fault.place}: " if fault.place else ""
        raise InputError(f"{name}: {place}{fault.message}") from None


class _PlaceError(Exception):
    """Something wrong at a place; becomes an `InputError` once the file's name is known."""

    def __init__(self, place: str, message: str) -> None:
        super().__init__(message)
        self.place = place
        self.message = message


class _Object(dict[str, Any]):
    """A JSON object that remembers a key that occurred twice."""

    repeated: str | None = None


def _object_of(pairs: list[tuple[str, Any]]) -> _Object:
    result = _Object()
    for key, value in pairs:
        if key in result:
            result.repeated = key
        result[key] = value
    return result


def _parse(text: str, name: str) -> Any:
    if not text.strip("\ufeff \t\r\n"):
        raise InputError(f'{name}: the file is empty, expected {{"format": "{FORMAT}", ...}}')

    def constant(word: str) -> Any:
        line, column = _line_and_column(text, _constant_position(text, word))
        raise InputError(
            f"{name}: line {line}, column {column}: found {word}, expected a finite number"
        )

    try:
        return json.loads(
            text.removeprefix("\ufeff"),
            object_pairs_hook=_object_of,
            parse_float=Decimal,
            parse_int=Decimal,
            parse_constant=constant,
        )
    except json.JSONDecodeError as error:
        found = "the end of the file" if error.pos >= len(error.doc) else repr(error.doc[error.pos])
        expected = error.msg[0].lower() + error.msg[1:]
        raise InputError(
            f"{name}: line {error.lineno}, column {error.colno}: found {found}, "
            f"not valid JSON ({expected})"
        ) from None
    except RecursionError:
        raise InputError(
            f"{name}: lists or objects are nested too deeply, expected a scene file"
        ) from None
    except ArithmeticError:
        raise InputError(
            f"{name}: a number has an impossible exponent, "
            f"expected numbers up to {LARGEST_NUMBER:g}"
        ) from None


def _constant_position(text: str, word: str) -> int:
    """Return where NaN or Infinity stands outside quotes; the parser does not tell."""
    inside = False
    position = 0
    while position < len(text):
        character = text[position]
        if inside and character == "\\":
            position += 1
        elif character == '"':
            inside = not inside
        elif not inside and text.startswith(word, position):
            return position
        position += 1
    return 0


def _line_and_column(text: str, position: int) -> tuple[int, int]:
    before = text[:position]
    return before.count("\n") + 1, position - (before.rfind("\n") + 1) + 1


def _step(place: str, key: str) -> str:
    """Return the place of a key: dotted where it is a plain word, else in brackets."""
    if key.isidentifier():
        return f"{place}.{key}" if place else key
    return f"{place}[{json.dumps(key)}]"


def _fields(value: Any, place: str, known: Iterable[str], kind: str) -> _Object:
    """Check that a value is an object with known keys only."""
    if not isinstance(value, _Object):
        raise _PlaceError(place, f"found {describe(value)}, expected an object ({kind})")
    if value.repeated is not None:
        raise _PlaceError(
            place, f"the key '{value.repeated}' occurs twice, expected each key at most once"
        )
    for key in value:
        if key in known:
            continue
        if key in _LATER:
            raise _PlaceError(
                _step(place, key),
                f"{_LATER[key]} are not supported by this version, "
                "expected lights of constant radiance",
            )
        guess = nearest(key, known)
        meant = f" (did you mean '{guess}'?)" if guess else ""
        raise _PlaceError(
            place, f"found the unknown key {json.dumps(key)}, expected {', '.join(known)}{meant}"
        )
    return value


def _list(value: Any, place: str, what: str) -> list[Any]:
    if not isinstance(value, list):
        raise _PlaceError(place, f"found {describe(value)}, expected a list of {what}")
    return value


def _number(value: Any, place: str) -> float:
    if not isinstance(value, Decimal):
        raise _PlaceError(place, f"found {describe(value)}, expected a number")
    number = float(value)
    if not abs(number) <= LARGEST_NUMBER:
        raise _PlaceError(
            place,
            f"found {describe(value)}, "
            f"expected a number between {-LARGEST_NUMBER:g} and {LARGEST_NUMBER:g}",
        )
    return number


def _angle(value: Any, place: str) -> float:
    """Return radians from a number in degrees."""
    degrees = _number(value, place)
    if value == Decimal(repr(degrees)):
        return math.radians(degrees)
    return float(_DECIMAL.divide(_DECIMAL.multiply(value, _PI), Decimal(180)))


def _numbers(value: Any, place: str, length: int, what: str) -> tuple[float, ...]:
    if not isinstance(value, list) or len(value) != length:
        raise _PlaceError(place, f"found {describe(value)}, expected {length} numbers {what}")
    return tuple(_number(item, f"{place}[{i}]") for i, item in enumerate(value))


def _vec2(value: Any, place: str, what: str) -> Vec2:
    x, y = _numbers(value, place, 2, what)
    return x, y


def _vec3(value: Any, place: str) -> Vec3:
    x, y, z = _numbers(value, place, 3, "[x, y, z]")
    return x, y, z


def _colour(value: Any, place: str) -> Vec3:
    red, green, blue = _numbers(value, place, 3, "[red, green, blue]")
    return red, green, blue


def _rotation(value: Any, place: str) -> tuple[float, float, float, float]:
    w, x, y, z = _numbers(value, place, 4, "[w, x, y, z] (a unit quaternion)")
    return w, x, y, z


def _bool(value: Any, place: str) -> bool:
    if not isinstance(value, bool):
        raise _PlaceError(place, f"found {describe(value)}, expected true or false")
    return value


def _text(value: Any, place: str, what: str) -> str:
    if not isinstance(value, str):
        raise _PlaceError(place, f"found {describe(value)}, expected {what}")
    if not value.strip():
        raise _PlaceError(place, f"found the empty text {json.dumps(value)}, expected {what}")
    try:
        value.encode("utf-8")
    except UnicodeEncodeError:
        raise _PlaceError(
            place, f"found {describe(value)} with half a character, expected {what}"
        ) from None
    if "\0" in value:
        raise _PlaceError(place, f"found {describe(value)} with a zero character, expected {what}")
    return value


def _choice(value: Any, place: str, choices: tuple[T, ...]) -> T:
    for choice in choices:
        if value == choice and isinstance(value, str):
            return choice
    names = [str(choice) for choice in choices]
    expected = expected_one_of(value if isinstance(value, str) else "", names)
    raise _PlaceError(place, f"found {describe(value)}, {expected}")


Reader = Callable[[Any, str], Any]


def _read(value: Any, place: str, kind: str, readers: dict[str, Reader]) -> dict[str, Any]:
    """Read the present keys of an object with the reader of each."""
    fields = _fields(value, place, readers, kind)
    return {key: readers[key](item, _step(place, key)) for key, item in fields.items()}


def _build(place: str, owner: str, make: Callable[..., T], **values: Any) -> T:
    """Construct a part; turn its complaint about values into a fault at ``place``."""
    try:
        return make(**values)
    except SceneError as error:
        message = str(error).removeprefix(f"{owner}: ")
        field, _, rest = message.partition(" ")
        if field in values and field != "name":
            place = _step(place, field)
            message = f"found {rest[3:]}" if rest.startswith("is ") else message
        raise _PlaceError(place, message) from None


def _scene(value: Any, base: Path) -> Scene:
    if not isinstance(value, _Object):
        raise _PlaceError("", f'found {describe(value)}, expected {{"format": "{FORMAT}", ...}}')
    _check_format(value)
    readers: dict[str, Reader] = {
        "format": lambda _value, _place: None,
        "camera": _camera,
        "materials": _materials,
        "objects": lambda items, place: _objects(items, place, base),
        "lights": _lights,
        "display": _display,
    }
    parts = _read(value, "", "a scene", readers)
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
            raise _PlaceError(
                f"objects[{index}].material",
                f"found '{item.material}', which is not among the scene's materials, "
                + expected_one_of(item.material, names),
            )
    parts["materials"] = materials
    return _build("", "", Scene, **parts)


def _check_format(value: _Object) -> None:
    if "format" not in value:
        guess = nearest("format", [key for key in value if key != "format"])
        meant = f" (did you mean it by '{guess}'?)" if guess else ""
        raise _PlaceError("", f'the key "format" is missing, expected "format": "{FORMAT}"{meant}')
    found = value["format"]
    if found == FORMAT:
        return
    newer = isinstance(found, str) and found.startswith(FORMAT_FAMILY)
    hint = " (a newer version of this program may read the file)" if newer else ""
    raise _PlaceError("format", f'found {describe(found)}, expected "{FORMAT}"{hint}')


def _camera(value: Any, place: str) -> Camera:
    readers: dict[str, Reader] = {"eye": _vec3, "target": _vec3, "up": _vec3, "fov_y": _angle}
    return _build(place, "camera", Camera, **_read(value, place, "a camera", readers))


def _materials(value: Any, place: str) -> tuple[Material, ...]:
    if not isinstance(value, _Object):
        raise _PlaceError(
            place, f"found {describe(value)}, expected an object of materials by their names"
        )
    if value.repeated is not None:
        raise _PlaceError(
            place, f"the material '{value.repeated}' occurs twice, expected unique names"
        )
    return tuple(_material(item, _step(place, key), key, place) for key, item in value.items())


def _material(value: Any, place: str, name: str, parent: str) -> Material:
    readers: dict[str, Reader] = {
        "diffuse": _colour,
        "f0": _colour,
        "alpha": lambda item, at: _vec2(item, at, "[along the tangent, along the bitangent]"),
        "rotation": _angle,
    }
    _text(name, parent, "a name for each material")
    values = _read(value, place, "a material", readers)
    return _build(place, f"material '{name}'", Material, name=name, **values)


def _name(value: Any, place: str) -> str:
    return _text(value, place, "a name")


def _objects(value: Any, place: str, base: Path) -> tuple[SceneObject, ...]:
    def mesh(item: Any, at: str) -> str:
        found = _text(item, at, f"a path or one of {', '.join(BUILT_IN_MESHES)}")
        return found if found in BUILT_IN_MESHES else _absolute(folder / found)

    folder = base.resolve()
    readers: dict[str, Reader] = {
        "name": _name,
        "mesh": mesh,
        "material": lambda item, at: _text(item, at, "a material's name"),
        "transform": _transform,
    }
    items = _list(value, place, "objects")
    read = [_read(item, f"{place}[{i}]", "an object", readers) for i, item in enumerate(items)]
    _fill_names(read, place, "object")
    return tuple(
        SceneObject(**{"mesh": DEFAULT_MESH, "material": DEFAULT_MATERIAL, **values})
        for values in read
    )


def _transform(value: Any, place: str) -> Transform:
    readers: dict[str, Reader] = {"translate": _vec3, "rotate": _rotation, "scale": _vec3}
    return _build(place, "transform", Transform, **_read(value, place, "a transform", readers))


def _lights(value: Any, place: str) -> tuple[AreaLight, ...]:
    readers: dict[str, Reader] = {
        "name": _name,
        "plane": _plane,
        "outline": _outline,
        "radiance": _colour,
        "two_sided": _bool,
        "visible": _bool,
    }
    items = _list(value, place, "lights")
    read = [_read(item, f"{place}[{i}]", "a light", readers) for i, item in enumerate(items)]
    _fill_names(read, place, "light")
    return tuple(
        _build(
            f"{place}[{i}]",
            f"light '{values['name']}'",
            AreaLight,
            **{"outline": Outline((DEFAULT_CONTOUR,)), **values},
        )
        for i, values in enumerate(read)
    )


def _fill_names(read: list[dict[str, Any]], place: str, kind: str) -> None:
    """Refuse repeated names; give nameless items "object 1", "object 2" by position."""
    first: dict[str, int] = {}
    for index, values in enumerate(read):
        if "name" not in values:
            continue
        name = values["name"]
        if name in first:
            raise _PlaceError(
                f"{place}[{index}].name",
                f"found '{name}', the name of {place}[{first[name]}] already, "
                "expected unique names",
            )
        first[name] = index
    for index, values in enumerate(read):
        if "name" in values:
            continue
        number = index + 1
        while f"{kind} {number}" in first:
            number += 1
        values["name"] = f"{kind} {number}"
        first[values["name"]] = index


def _plane(value: Any, place: str) -> Plane:
    readers: dict[str, Reader] = {"origin": _vec3, "u": _vec3, "v": _vec3}
    return _build(place, "plane", Plane, **_read(value, place, "a plane", readers))


def _outline(value: Any, place: str) -> Outline:
    readers: dict[str, Reader] = {
        "fill_rule": lambda item, at: _choice(item, at, FILL_RULES),
        "contours": lambda items, at: tuple(
            _contour(item, f"{at}[{i}]") for i, item in enumerate(_list(items, at, "contours"))
        ),
    }
    values = _read(value, place, "an outline", readers)
    return _build(place, "outline", Outline, **{"contours": (DEFAULT_CONTOUR,), **values})


def _contour(value: Any, place: str) -> Contour:
    fields = _fields(value, place, ("polygon", "bezier", "kinds"), "a contour")
    given = [key for key in ("polygon", "bezier") if key in fields]
    if len(given) != 1:
        found = "both polygon and bezier" if given else "neither polygon nor bezier"
        raise _PlaceError(
            place,
            f'found {found}, expected {{"polygon": [[s, t], ...]}} or '
            '{"bezier": [[[s, t], [s, t], [s, t], [s, t]], ...]}',
        )
    if given == ["bezier"]:
        return _bezier(fields, place)
    if "kinds" in fields:
        raise _PlaceError(
            _step(place, "kinds"),
            "found kinds of anchors for a polygon, expected them for a bezier",
        )
    at = _step(place, "polygon")
    items = _list(fields["polygon"], at, "points [s, t]")
    points = tuple(_vec2(item, f"{at}[{i}]", "[s, t]") for i, item in enumerate(items))
    return _build(at, "polygon", PolygonContour, points=points)


def _bezier(fields: _Object, place: str) -> BezierContour:
    at = _step(place, "bezier")
    items = _list(fields["bezier"], at, "curves [[s, t], [s, t], [s, t], [s, t]]")
    written = [_curve(item, f"{at}[{i}]") for i, item in enumerate(items)]
    curves = _joined(written, at)
    kinds: tuple[AnchorKind, ...] = ()
    if "kinds" in fields:
        named = _step(place, "kinds")
        words = _list(fields["kinds"], named, "kinds of anchors")
        kinds = tuple(_choice(word, f"{named}[{i}]", ANCHOR_KINDS) for i, word in enumerate(words))
        if len(kinds) == len(written) < len(curves):
            kinds = (*kinds, "corner")
    return _build(at, "bezier", BezierContour, curves=curves, kinds=kinds)


def _curve(value: Any, place: str) -> CubicCurve:
    if not isinstance(value, list) or len(value) != 4:
        raise _PlaceError(
            place,
            f"found {describe(value)}, expected 4 points [s, t]: anchor, handle, handle, anchor",
        )
    start, leaving, arriving, end = (
        _vec2(item, f"{place}[{i}]", "[s, t]") for i, item in enumerate(value)
    )
    return start, leaving, arriving, end


def _joined(curves: list[CubicCurve], place: str) -> tuple[CubicCurve, ...]:
    """Close a chain of curves: ends that nearly meet do, and a last side that lacks is straight."""
    if not curves:
        return ()
    axes = [[point[axis] for curve in curves for point in curve] for axis in (0, 1)]
    near = SNAP * max(max(values) - min(values) for values in axes)
    joined = list(curves)
    for i, curve in enumerate(curves):
        following = curves[(i + 1) % len(curves)][0]
        if curve[3] == following:
            continue
        if math.dist(curve[3], following) <= near:
            joined[i] = _ending_at(curve, following)
        elif i + 1 == len(curves):
            joined.append(_straight(curve[3], following))
        else:
            raise _PlaceError(
                f"{place}[{i + 1}][0]",
                f"found {list(following)}, expected {list(curve[3])}, "
                "where the curve before it ends",
            )
    return tuple(joined)


def _ending_at(curve: CubicCurve, end: Vec2) -> CubicCurve:
    """Move a curve's end and shear the rest along, which keeps straight sides straight."""
    s, t = end[0] - curve[3][0], end[1] - curve[3][1]
    leaving, arriving = (
        (curve[i][0] + share * s, curve[i][1] + share * t) for i, share in ((1, 1 / 3), (2, 2 / 3))
    )
    return curve[0], leaving, arriving, end


def _straight(start: Vec2, end: Vec2) -> CubicCurve:
    s, t = end[0] - start[0], end[1] - start[1]
    leaving, arriving = ((start[0] + share * s, start[1] + share * t) for share in (1 / 3, 2 / 3))
    return start, leaving, arriving, end


def _display(value: Any, place: str) -> Display:
    readers: dict[str, Reader] = {
        "exposure": _number,
        "tone_map": lambda item, at: _choice(item, at, TONE_MAPS),
    }
    return _build(place, "display", Display, **_read(value, place, "display settings", readers))


# Writing


class _Raw(str):
    """Text that stands in the file as it is: a number that needs its own digits."""


def scene_to_json(scene: Scene, base: Path | None) -> str:
    """Return a scene as the text of a scene file, every key written out.

    Parameters
    ----------
    scene : Scene
        With absolute mesh paths.
    base : Path or None
        The folder that mesh paths are written relative to; None keeps them absolute.

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
            "fov_y": _degrees(scene.camera.fov_y),
        },
        "materials": {
            material.name: {
                "diffuse": material.diffuse,
                "f0": material.f0,
                "alpha": material.alpha,
                "rotation": _degrees(material.rotation),
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
        "lights": [
            {
                "name": light.name,
                "plane": {"origin": light.plane.origin, "u": light.plane.u, "v": light.plane.v},
                "outline": {
                    "fill_rule": light.outline.fill_rule,
                    "contours": [_contour_fields(item) for item in light.outline.contours],
                },
                "radiance": light.radiance,
                "two_sided": light.two_sided,
                "visible": light.visible,
            }
            for light in scene.lights
        ],
        "display": {"exposure": scene.display.exposure, "tone_map": scene.display.tone_map},
    }
    return _layout(document, 0) + "\n"


def _contour_fields(contour: Contour) -> dict[str, Any]:
    if isinstance(contour, PolygonContour):
        return {"polygon": contour.points}
    kinds = {"kinds": list(contour.kinds)} if contour.kinds else {}
    return {"bezier": contour.curves, **kinds}


def _mesh_reference(mesh: str, base: Path | None) -> str:
    if mesh in BUILT_IN_MESHES:
        return mesh
    if base is None:
        return _absolute(mesh)
    try:
        relative = Path(os.path.relpath(_absolute(mesh), base.resolve())).as_posix()
    except ValueError:  # another drive
        return _absolute(mesh)
    return f"./{relative}" if relative in BUILT_IN_MESHES else relative


def _with_absolute_mesh(item: SceneObject) -> SceneObject:
    return item if item.mesh in BUILT_IN_MESHES else replace(item, mesh=_absolute(item.mesh))


def _absolute(path: str | Path) -> str:
    """Return an absolute path without "..", links kept: the inverse of `os.path.relpath`."""
    return os.path.abspath(path)  # noqa: PTH100 (Path.resolve would follow links)


def _degrees(radians: float) -> _Raw:
    """Return the shortest decimal of degrees that reads back as exactly ``radians``."""
    exact = _DECIMAL.divide(_DECIMAL.multiply(Decimal(radians), Decimal(180)), _PI)
    for digits in range(1, 40):
        text = format(Context(prec=digits).plus(exact).normalize(), "g")
        if _angle(Decimal(text), "") == radians:
            return _Raw(text)
    raise InputError(f"{radians} radians are no angle that a file can hold, expected a finite one")


def _plain_number(value: float) -> str:
    is_negative_zero = value == 0 and math.copysign(1.0, value) < 0.0
    if value == int(value) and abs(value) < 1e15 and not is_negative_zero:
        return str(int(value))
    return repr(float(value))


def _layout(value: Any, depth: int, key_length: int = 0) -> str:
    """Write JSON with two spaces a level; whatever fits on one line stays on one."""
    few = sum(1 for _ in islice(_leaves(value), LINE_LENGTH)) < LINE_LENGTH
    if depth > 0 and few:
        line = _one_line(value)
        if len(line) + key_length + 2 * depth < LINE_LENGTH:
            return line
    indent = "  " * (depth + 1)
    if isinstance(value, dict) and value:
        keys = [json.dumps(key, ensure_ascii=False) + ": " for key in value]
        items = (
            key + _layout(item, depth + 1, len(key))
            for key, item in zip(keys, value.values(), strict=True)
        )
        return "{\n" + indent + f",\n{indent}".join(items) + "\n" + indent[2:] + "}"
    if isinstance(value, list):
        items = (_layout(item, depth + 1) for item in value)
        return "[\n" + indent + f",\n{indent}".join(items) + "\n" + indent[2:] + "]"
    if isinstance(value, tuple):  # of points or curves: as many on a line as fit
        return "[\n" + _filled(value, indent, 1) + "]"
    return _one_line(value)


def _leaves(value: Any) -> Iterator[Any]:
    if isinstance(value, dict):
        value = value.values()
    elif not isinstance(value, list | tuple):
        yield value
        return
    for item in value:
        yield from _leaves(item)


def _filled(items: tuple[Any, ...], indent: str, closing: int) -> str:
    """Lay out points or curves in lines, with ``closing`` brackets to follow the last."""
    lines: list[str] = []
    line = indent
    for item in items:
        word = _one_line(item)
        if len(indent) + len(word) + closing + 1 > LINE_LENGTH and isinstance(item[0], tuple):
            word = "[" + _filled(item, indent + " ", closing + 1).lstrip() + "]"
        if line == indent:
            line += word
        elif len(line) + len(word) + closing + 3 > LINE_LENGTH:
            lines.append(line + ",")
            line = indent + word
        else:
            line += ", " + word
    return "\n".join([*lines, line])


def _one_line(value: Any) -> str:
    if isinstance(value, _Raw):
        return str(value)
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float):
        return _plain_number(value)
    if isinstance(value, dict):
        items = (
            f"{json.dumps(key, ensure_ascii=False)}: {_one_line(item)}"
            for key, item in value.items()
        )
        return "{" + ", ".join(items) + "}"
    return "[" + ", ".join(_one_line(item) for item in value) + "]"
