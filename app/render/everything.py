"""A scene's features with everything on that could have been left out.

What a renderer without `app.render.features` would do for the scene: one program for all
scenes, all attachments, the larger storage. The picture is the same, the cost is not; the
difference is what leaving out saves (``explain --everything``, ``bench --everything``).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any, TypeVar

from app.render.features import LightingFeatures, LightNeeds, light_texels

KEPT = {
    "count": "how many lights there are is the scene's",
    "parts": "so is how many edges, or curves, they have",
    "technique": "chosen by the user, as is its number",
    "exact_fma": "a property of the machine",
    "pictures": "there is nothing to look up for lights without",
    "anisotropic": "its tables are another fit: isotropic pictures change by the fits' error, 4e-3",
    "counts": "a view of its own, not a part of the picture",
}
"""Features that everything-on leaves as they are, and why."""

Record = TypeVar("Record", LightingFeatures, LightNeeds)


def everything_on(features: LightingFeatures) -> LightingFeatures:
    """Return features that leave nothing out, and give the same picture.

    Raises
    ------
    TypeError
        If a feature that is no switch is new: it must be forced here, or kept for a reason.
    """
    lights = features.lights
    # Edges as a flat list of curves that are straight, not as a tree: a tree takes chords
    # where they are within `CHORD_ERROR`, and the picture would change by as much.
    has_list = lights.curves == 1
    curved = has_list or lights.curved
    texels = light_texels(lights.count, lights.parts, curved, True, lights.pictures)
    forced_lights = _all_on(
        lights,
        {
            "curves": "whole" if has_list else lights.curves,
            "texels": texels,
            "uniform_texels": 0,
        },
    )
    return _all_on(features, {"lights": forced_lights, "uniform_materials": 0})


def _all_on(record: Record, forced: Mapping[str, Any]) -> Record:
    changes: dict[str, Any] = {}
    for field in fields(record):
        if field.name in KEPT:
            continue
        if field.name in forced:
            changes[field.name] = forced[field.name]
        elif isinstance(getattr(record, field.name), bool):
            changes[field.name] = True
        else:
            raise TypeError(f"feature '{field.name}': everything_on does not know what is most")
    return replace(record, **changes)
