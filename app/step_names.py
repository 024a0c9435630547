"""Names for the steps of the history: what differs between two scenes, in a few words."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from typing import TypeAlias

from app.scene import AreaLight, Material, Scene, SceneObject

_Items: TypeAlias = tuple[Material | SceneObject | AreaLight, ...]

_FIELD_NAMES = {
    "alpha": "roughness",
    "f0": "reflectance",
    "diffuse": "diffuse colour",
    "two_sided": "two-sided",
    "visible": "visibility",
    "fov_y": "field of view",
    "tone_map": "tone map",
    "plane": "position",
    "rotate": "rotation",
    "translate": "position",
    "outline": "shape",
    "align": "alignment",
    "line_height": "line height",
    "path": "drawing",
}
_PICTURE_NAMES = {
    "color_space": "colours",
    "offset": "position",
    "scale": "size",
    "mirror": "mirroring",
    "frames_per_second": "speed",
}


def describe(before: Scene, after: Scene) -> str:
    """Return a short name for the difference of two scenes: "Change roughness of 'floor'".

    Names the first difference only, which is what one panel makes in a frame.
    """
    for kind, old, new in _lists_of(before, after):
        if len(new) > len(old):
            return f"Add {kind} '{new[-1].name}'"
        if len(new) < len(old):
            gone = {item.name for item in old} - {item.name for item in new}
            return f"Remove {kind} '{min(gone, default='')}'"
        for a, b in zip(old, new, strict=True):
            if a == b:
                continue
            if a.name != b.name:
                return f"Rename {kind} '{a.name}'"
            if isinstance(a, AreaLight) and isinstance(b, AreaLight):
                if b.source is not None and (a.source, a.outline) != (b.source, b.outline):
                    return _change_of_source(a, b)
                if (a.picture is None) != (b.picture is None):
                    way = "Remove picture of" if b.picture is None else "Put picture on"
                    return f"{way} '{a.name}'"
                if a.picture != b.picture:
                    changed = _first_difference(a.picture, b.picture)
                    changed = _PICTURE_NAMES.get(changed, changed)
                    return f"Change {changed} of the picture on '{a.name}'"
                more = len(b.outline.contours) - len(a.outline.contours)
                if more:
                    return f"{'Add' if more > 0 else 'Remove'} outline of '{a.name}'"
            return f"Change {_first_difference(a, b)} of '{a.name}'"
    if before.display != after.display:
        return f"Change {_first_difference(before.display, after.display)}"
    return "Move camera"


def _change_of_source(a: AreaLight, b: AreaLight) -> str:
    """Name the difference of two lights of which the later one is made from something."""
    if type(a.source) is not type(b.source):
        return f"Make '{a.name}' anew"
    changed = _first_difference(a.source, b.source) if a.source != b.source else ""
    return f"Change {changed} of '{a.name}'" if changed else f"Reload '{a.name}'"


def _lists_of(before: Scene, after: Scene) -> tuple[tuple[str, _Items, _Items], ...]:
    return (
        ("light", before.lights, after.lights),
        ("object", before.objects, after.objects),
        ("material", before.materials, after.materials),
    )


def _first_difference(a: object, b: object) -> str:
    if not is_dataclass(a):
        return ""
    for field in fields(a):
        old, new = getattr(a, field.name), getattr(b, field.name)
        if old != new:
            inner = _first_difference(old, new) if field.name == "transform" else ""
            return inner or _FIELD_NAMES.get(field.name, field.name)
    return "value"
