"""Lights in scene files: outlines, the text or drawing that one was made from, pictures.

A source stands beside its outline. The outline is what counts, so a scene still
opens where a font or a drawing is missing; only where there is no outline is it
made from the source.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

from app.errors import InputError, describe
from app.files import absolute_path, relative_path
from app.json_reader import (
    JsonObject,
    PlaceError,
    Reader,
    build_part,
    check_fields,
    fill_names,
    place_of,
    read_angle,
    read_any_text,
    read_bool,
    read_choice,
    read_colour,
    read_list,
    read_name,
    read_number,
    read_object,
    read_text,
    read_vec2,
    read_vec3,
)
from app.json_writer import degrees
from app.scene import (
    ANCHOR_KINDS,
    COLOR_SPACES,
    FILL_RULES,
    PICTURE_FITS,
    TEXT_ALIGNS,
    AnchorKind,
    AreaLight,
    BezierContour,
    Contour,
    CubicCurve,
    Outline,
    OutlineSource,
    Picture,
    Plane,
    PolygonContour,
    SvgSource,
    TextSource,
    Vec2,
)
from app.sources import outline_from

DEFAULT_CONTOUR = PolygonContour(((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)))

SNAP = 1e-6
"""Curves whose ends lie closer than this share of their contour's extent meet there."""


# Reading


def read_lights(value: Any, place: str, base: Path) -> tuple[AreaLight, ...]:
    """Return a scene's lights; paths are relative to the folder ``base``."""
    readers: dict[str, Reader] = {
        "name": read_name,
        "plane": _plane,
        "outline": _outline,
        "text": lambda item, at: _text_source(item, at, base),
        "svg": lambda item, at: _svg_source(item, at, base),
        "radiance": read_colour,
        "two_sided": read_bool,
        "visible": read_bool,
        "picture": lambda item, at: _picture(item, at, base),
    }
    items = read_list(value, place, "lights")
    read = [
        _with_outline(read_object(item, f"{place}[{i}]", "a light", readers), f"{place}[{i}]")
        for i, item in enumerate(items)
    ]
    fill_names(read, place, "light")
    return tuple(
        build_part(f"{place}[{i}]", f"light '{values['name']}'", AreaLight, **values)
        for i, values in enumerate(read)
    )


def _with_outline(values: dict[str, Any], place: str) -> dict[str, Any]:
    """Put a light's source in one field, and make the outline that is not written."""
    sources = {key: values.pop(key) for key in ("text", "svg") if key in values}
    if len(sources) > 1:
        raise PlaceError(place, "found both text and svg, expected one of them")
    made = Outline((DEFAULT_CONTOUR,))
    for key, source in sources.items():
        values["source"] = source
        if "outline" not in values:
            made = _made(source, place_of(place, key))
    return {"outline": made, **values}


def _made(source: OutlineSource, place: str) -> Outline:
    try:
        return outline_from(source)
    except InputError as error:
        raise PlaceError(place, str(error)) from None


def _text_source(value: Any, place: str, base: Path) -> TextSource:
    if isinstance(value, str):
        return TextSource(read_any_text(value, place))
    readers: dict[str, Reader] = {
        "string": read_any_text,
        "text": read_any_text,
        "font": lambda item, at: _font(item, at, base),
        "size": read_number,
        "align": lambda item, at: read_choice(item, at, TEXT_ALIGNS),
        "spacing": read_number,
        "line_height": read_number,
    }
    values = read_object(value, place, "a text", readers)
    given = [values.pop(key) for key in ("string", "text") if key in values]
    if len(given) != 1:
        found = "both string and text" if given else 'no "string"'
        raise PlaceError(place, f'found {found}, expected {{"string": "Light"}}')
    return build_part(place, "text", TextSource, text=given[0], **values)


def _font(value: Any, place: str, base: Path) -> str:
    if value == "":
        return ""
    return absolute_path(base.resolve() / read_text(value, place, "the path of a font file"))


def _svg_source(value: Any, place: str, base: Path) -> SvgSource:
    def path(item: Any, at: str) -> str:
        return absolute_path(base.resolve() / read_text(item, at, "the path of an SVG file"))

    if isinstance(value, str):
        return SvgSource(path(value, place))
    values = read_object(value, place, "a drawing", {"path": path, "size": read_number})
    if "path" not in values:
        raise PlaceError(place, 'the key "path" is missing, expected {"path": "logo.svg"}')
    return build_part(place, "svg", SvgSource, **values)


def _picture(value: Any, place: str, base: Path) -> Picture:
    def file(item: Any, at: str) -> str:
        return absolute_path(base.resolve() / read_text(item, at, "the path of a picture file"))

    if isinstance(value, str):
        return Picture(file(value, place))
    readers: dict[str, Reader] = {
        "file": file,
        "color_space": lambda item, at: read_choice(item, at, COLOR_SPACES),
        "fit": lambda item, at: read_choice(item, at, PICTURE_FITS),
        "offset": lambda item, at: read_vec2(item, at, "[right, up]"),
        "scale": lambda item, at: read_vec2(item, at, "[width, height]"),
        "rotation": read_angle,
        "mirror": _mirror,
        "frames_per_second": read_number,
        "start": read_number,
    }
    values = read_object(value, place, "a picture", readers)
    if "file" not in values:
        raise PlaceError(place, 'the key "file" is missing, expected {"file": "window.png"}')
    return build_part(place, "picture", Picture, **values)


def _mirror(value: Any, place: str) -> tuple[bool, bool]:
    if not isinstance(value, list) or len(value) != 2:
        raise PlaceError(
            place,
            f"found {describe(value)}, "
            "expected 2 of true and false [left and right, top and bottom]",
        )
    across, down = (read_bool(item, f"{place}[{i}]") for i, item in enumerate(value))
    return across, down


def _plane(value: Any, place: str) -> Plane:
    readers: dict[str, Reader] = {"origin": read_vec3, "u": read_vec3, "v": read_vec3}
    return build_part(place, "plane", Plane, **read_object(value, place, "a plane", readers))


def _outline(value: Any, place: str) -> Outline:
    readers: dict[str, Reader] = {
        "fill_rule": lambda item, at: read_choice(item, at, FILL_RULES),
        "contours": lambda items, at: tuple(
            _contour(item, f"{at}[{i}]") for i, item in enumerate(read_list(items, at, "contours"))
        ),
    }
    values = read_object(value, place, "an outline", readers)
    return build_part(place, "outline", Outline, **{"contours": (DEFAULT_CONTOUR,), **values})


def _contour(value: Any, place: str) -> Contour:
    fields = check_fields(value, place, ("polygon", "bezier", "kinds"), "a contour")
    given = [key for key in ("polygon", "bezier") if key in fields]
    if len(given) != 1:
        found = "both polygon and bezier" if given else "neither polygon nor bezier"
        raise PlaceError(
            place,
            f'found {found}, expected {{"polygon": [[s, t], ...]}} or '
            '{"bezier": [[[s, t], [s, t], [s, t], [s, t]], ...]}',
        )
    if given == ["bezier"]:
        return _bezier(fields, place)
    if "kinds" in fields:
        raise PlaceError(
            place_of(place, "kinds"),
            "found kinds of anchors for a polygon, expected them for a bezier",
        )
    at = place_of(place, "polygon")
    items = read_list(fields["polygon"], at, "points [s, t]")
    points = tuple(read_vec2(item, f"{at}[{i}]", "[s, t]") for i, item in enumerate(items))
    return build_part(at, "polygon", PolygonContour, points=points)


def _bezier(fields: JsonObject, place: str) -> BezierContour:
    at = place_of(place, "bezier")
    items = read_list(fields["bezier"], at, "curves [[s, t], [s, t], [s, t], [s, t]]")
    written = [_curve(item, f"{at}[{i}]") for i, item in enumerate(items)]
    curves = _joined(written, at)
    kinds: tuple[AnchorKind, ...] = ()
    if "kinds" in fields:
        named = place_of(place, "kinds")
        words = read_list(fields["kinds"], named, "kinds of anchors")
        kinds = tuple(
            read_choice(word, f"{named}[{i}]", ANCHOR_KINDS) for i, word in enumerate(words)
        )
        if len(kinds) == len(written) < len(curves):
            kinds = (*kinds, "corner")
    return build_part(at, "bezier", BezierContour, curves=curves, kinds=kinds)


def _curve(value: Any, place: str) -> CubicCurve:
    if not isinstance(value, list) or len(value) != 4:
        raise PlaceError(
            place,
            f"found {describe(value)}, expected 4 points [s, t]: anchor, handle, handle, anchor",
        )
    start, leaving, arriving, end = (
        read_vec2(item, f"{place}[{i}]", "[s, t]") for i, item in enumerate(value)
    )
    return start, leaving, arriving, end


def _joined(curves: list[CubicCurve], place: str) -> tuple[CubicCurve, ...]:
    """Close a chain of curves: ends that nearly meet do, and a missing last side is straight."""
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
            raise PlaceError(
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


# Writing


def light_fields(light: AreaLight, base: Path | None) -> dict[str, Any]:
    """Return a light as it stands in a scene file in the folder ``base``."""
    return {
        "name": light.name,
        "plane": {"origin": light.plane.origin, "u": light.plane.u, "v": light.plane.v},
        **_source_fields(light.source, base),
        "outline": {
            "fill_rule": light.outline.fill_rule,
            "contours": [_contour_fields(item) for item in light.outline.contours],
        },
        "radiance": light.radiance,
        "two_sided": light.two_sided,
        "visible": light.visible,
        **_picture_fields(light.picture, base),
    }


def _picture_fields(picture: Picture | None, base: Path | None) -> dict[str, Any]:
    if picture is None:
        return {}
    return {
        "picture": {
            "file": relative_path(picture.file, base),
            "color_space": picture.color_space,
            "fit": picture.fit,
            "offset": picture.offset,
            "scale": picture.scale,
            "rotation": degrees(picture.rotation),
            "mirror": list(picture.mirror),
            "frames_per_second": picture.frames_per_second,
            "start": picture.start,
        }
    }


def _source_fields(source: OutlineSource | None, base: Path | None) -> dict[str, Any]:
    if isinstance(source, TextSource):
        return {
            "text": {
                "string": source.text,
                "font": relative_path(source.font, base) if source.font else "",
                "size": source.size,
                "align": source.align,
                "spacing": source.spacing,
                "line_height": source.line_height,
            }
        }
    if isinstance(source, SvgSource):
        return {"svg": {"path": relative_path(source.path, base), "size": source.size}}
    return {}


def _contour_fields(contour: Contour) -> dict[str, Any]:
    if isinstance(contour, PolygonContour):
        return {"polygon": contour.points}
    kinds = {"kinds": list(contour.kinds)} if contour.kinds else {}
    return {"bezier": contour.curves, **kinds}


def with_absolute_paths(light: AreaLight) -> AreaLight:
    """Return a light whose files have the paths that a saved scene gives them when read again."""
    source = light.source
    if light.picture is not None:
        light = replace(
            light, picture=replace(light.picture, file=absolute_path(light.picture.file))
        )
    if isinstance(source, TextSource) and source.font:
        return replace(light, source=replace(source, font=absolute_path(source.font)))
    if isinstance(source, SvgSource):
        return replace(light, source=replace(source, path=absolute_path(source.path)))
    return light
