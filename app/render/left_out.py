"""What a shot does without, why, and the bytes that it would take."""

from __future__ import annotations

from dataclasses import dataclass

from app.render.features import LightingFeatures
from app.render.light_shapes import curve_texels, has_triangles
from app.render.needs import FORMAT_BYTES
from app.render.tables import table_textures
from app.render.techniques import parse_technique
from app.scene import TONE_MAPS, Shot


@dataclass(frozen=True)
class LeftOut:
    """Something that this shot does without, why, and the bytes that it would take."""

    what: str
    why: str
    bytes: int = 0


def left_out(shot: Shot, features: LightingFeatures) -> tuple[LeftOut, ...]:
    """Return what a shot's picture needs no part of."""
    scene, used, lights = shot.scene, shot.scene.object_materials(), features.lights
    shines = lights.one_sided or lights.two_sided
    out: list[LeftOut] = []

    pixels = shot.width * shot.height

    def leave(what: str, why: str, saved: int = 0) -> None:
        out.append(LeftOut(what, why, saved))

    if not scene.lights:
        dark = "the scene has no lights"
    elif not shines:
        dark = "no light has radiance and an outline"
    elif not used:
        dark = "the scene has no objects"
    else:
        dark = ""
    if not features.lit:
        why = dark or "nothing reflects and no light is visible"
        bytes_each = FORMAT_BYTES["RGBA32F"] + FORMAT_BYTES["DEPTH24"]
        leave("G-buffer and its program", why, pixels * bytes_each)
        leave("lighting program", why)
    if not features.specular:
        leave("specular shading", dark or "every material has f0 = 0")
    if not features.reads_tables:
        if features.specular:
            why = f"technique {features.technique} needs none"
        else:
            why = f"{dark or 'every material has f0 = 0'}, so nothing looks them up"
        tables = sum(int(texels.nbytes) for texels in table_textures(features.anisotropic).values())
        leave("tables of the technique", why, tables)
    if not features.diffuse:
        leave("diffuse shading", dark or "every material has diffuse = 0")
    if not features.shades and features.lit:
        leave("material records", dark or "no material reflects anything")
    if features.lit and not features.shapes:
        leave("light-shape programs, triangles and curves", "no light is visible")
    elif features.lit and not curve_texels(scene.lights):
        leave("light-curve program and outlines", "no visible light has curves")
    elif features.lit and not has_triangles(scene.lights):
        leave("light-shape program and triangles", "every visible light has curves")
    if features.lit and not lights.pictures:
        leave("picture atlas and the programs that fill it", "no light has a picture")
    if features.shades and not lights.two_sided:
        leave("light from back sides", "no light is two-sided")
    if features.shades and not lights.one_sided:
        leave("test for dark sides", "every light is two-sided")
    both = all(any(material.f0) and any(material.diffuse) for material in used)
    if features.specular and features.diffuse and not features.mixed:
        why = "every material has both" if both else "walking both costs ltc no more"
        leave("choice of lobes for each pixel", why)
    if features.shades and not features.culls:
        can = parse_technique(features.technique).skips_lobes
        leave(
            "bounds of faint lights",
            "no light is to be skipped (--cull)"
            if can
            else f"technique {features.technique} integrates every light",
        )
    if features.lit and not features.accumulates:
        leave(
            "second radiance attachment and averaging",
            "one sample per pixel needs no history",
            pixels * FORMAT_BYTES["RGBA32F"],
        )
    elif features.lit and not features.estimates_noise:
        leave(
            "noise attachments and their mean",
            "costs have no noise"
            if features.counts
            else f"technique {features.technique} has no noise",
            2 * pixels * FORMAT_BYTES["RGBA32F"],
        )
    if features.lit and not features.tangents:
        anisotropic = any(material.is_anisotropic and any(material.f0) for material in used)
        leave(
            "second G-buffer attachment (tangents)",
            f"technique {features.technique} shades no anisotropic lobes"
            if anisotropic and features.specular
            else "no glossy material is anisotropic",
            pixels * FORMAT_BYTES["RG32F"],
        )
    if features.counts:
        leave("tone maps", "costs have colours of their own")
    else:
        others = [name for name in TONE_MAPS if name != scene.display.tone_map]
        leave("other tone maps", f"{', '.join(others)} are not chosen")
    return tuple(out)
