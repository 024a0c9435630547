"""Why a shot needs what it needs, in words for people."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from app.render.features import LightingFeatures
from app.render.pack import is_curved, light_geometry
from app.scene import Material, Shot

NAMED = 2
"""So many things are named; the rest are counted."""


def counted(number: int, noun: str) -> str:
    """Return a number with its noun, "3 lights"."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def named(names: Sequence[str], noun: str) -> str:
    """Return names in quotes, "'a' and 'b'"; of many the number, "5 lights"."""
    unique = list(dict.fromkeys(names))
    if len(unique) > NAMED:
        return counted(len(unique), noun)
    return " and ".join(f"'{name}'" for name in unique)


def program_reason(name: str, shot: Shot, features: LightingFeatures) -> str:
    """Return why a program exists."""
    scene = shot.scene
    if name == "gbuffer":
        tangents = ", with tangents" if features.tangents else ""
        return f"{counted(len(scene.objects), 'object')} drawn{tangents}"
    if name in ("light shapes", "light curves"):
        curves = name == "light curves"
        seen = [
            light.name
            for light in scene.lights
            if light.visible and light_geometry(light).parts and is_curved(light) == curves
        ]
        verb = "is" if len(seen) == 1 else "are"
        return f"{named(seen, 'light')} {verb} visible, with {'curves' if curves else 'edges only'}"
    if name.startswith("picture "):
        return f"{counted(features.lights.pictures, 'light')} with a picture, blurred beforehand"
    if name == "lighting":
        lobes = [lobe for lobe, on in (("glossy", features.specular), ("matt", features.diffuse))
                 if on]  # fmt: skip
        shade = f"{' and '.join(lobes)} materials are lit" if lobes else ""
        shapes = "visible lights show their radiance" if features.shapes else ""
        return ", ".join(part for part in (shade, shapes) if part)
    if features.counts:
        return "costs are shown as colours"
    return f"tone map {scene.display.tone_map} is chosen"


def resource_reason(name: str, shot: Shot, features: LightingFeatures) -> str:
    """Return why an attachment, a table or a buffer is there."""
    scene = shot.scene
    if name.startswith("mesh "):
        worn = [item.name for item in scene.objects if item.mesh == name[5:]]
        return f"drawn as {named(worn, 'object')}"
    if name.startswith("table_"):
        return _materials(shot, lambda m: any(m.f0), "glossy")
    fixed = {
        "gbuffer": "normal, depth and id of what each pixel shows",
        "tangents": _materials(
            shot, lambda m: m.is_anisotropic and any(m.f0), "glossy and anisotropic"
        ),
        "depth": "which surface is in front",
        "radiance": "the picture in linear light",
        "radiance 2": f"{shot.settings.samples} samples are averaged, each with those before",
        "noise": "samples are random: what rounding took, and the estimated error",
        "noise 2": "the same, of the samples before",
        "display": "what screens and .png files show",
        "light shapes": "visible lights with edges only",
        "light curves": "visible lights with curves",
        "lights": f"{counted(len(scene.lights), 'light')}, "
        f"{counted(features.lights.parts, features.lights.part_name)}"
        f"{', a rectangle around each' if features.lights.bounded else ''}",
        "light pictures": f"{counted(features.lights.pictures, 'light')} with a picture",
        "materials": f"{counted(len(scene.objects), 'object')}, a record each",
    }
    return fixed.get(name, "")


def _materials(shot: Shot, holds: Callable[[Material], bool], what: str) -> str:
    found = [material.name for material in shot.scene.object_materials() if holds(material)]
    verb = "is" if len(set(found)) == 1 else "are"
    return f"{named(found, 'material')} {verb} {what}" if found else ""
