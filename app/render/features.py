"""What the programs of a shot need, and nothing else.

What changes a *value* is a uniform. What changes which instructions, textures or
buffers exist is a feature here; what bounds an array is a feature rounded up to a
power of two, so that adding a light rarely compiles anything. Needs that cannot
matter are reset (two-sidedness without lights that shine, say): equal needs, equal
program.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import moderngl

from app.errors import InputError
from app.render.arithmetic import has_exact_fma
from app.render.pack import (
    MAX_INDEX,
    TEXELS_PER_EDGE,
    TEXELS_PER_LIGHT,
    TEXELS_PER_MATERIAL,
    TEXELS_PER_NODE,
    TEXELS_PER_PICTURE,
    CurveForm,
    has_curves,
    light_geometry,
    part_count,
)
from app.render.tables import anisotropic_azimuths
from app.render.techniques import DEFAULT_TECHNIQUE, find_technique, parse_technique
from app.scene import AreaLight, PixelView, Scene

STORAGE_TEXTURE_WIDTH = 1024
"""Texels in a row of the textures that hold lights or materials too many for a block."""


@dataclass(frozen=True, slots=True)
class Limits:
    """What a GL implementation allows. The defaults are the least that OpenGL 4.1 guarantees."""

    uniform_block_bytes: int = 16384
    texture_side: int = 16384
    exact_fma: bool = False

    @classmethod
    def of(cls, ctx: moderngl.Context) -> Limits:
        """Return what a context allows."""
        info = ctx.info
        viewport = info["GL_MAX_VIEWPORT_DIMS"]
        return cls(
            int(info["GL_MAX_UNIFORM_BLOCK_SIZE"]),
            min(int(info["GL_MAX_TEXTURE_SIZE"]), *(int(side) for side in viewport)),
            has_exact_fma(ctx),
        )

    @property
    def storage_texels(self) -> int:
        """Most vec4 records that lights or materials may take."""
        return min(MAX_INDEX, STORAGE_TEXTURE_WIDTH * self.texture_side)


def _rounded(count: int) -> int:
    """Return the power of two, at least 16, that holds ``count``."""
    return max(16, 1 << (count - 1).bit_length()) if count else 0


def light_texels(count: int, parts: int, curved: bool, bounded: bool, pictures: int) -> int:
    """Return the records of lights with so many parts, that are nodes if ``curved``."""
    size = TEXELS_PER_NODE if curved else TEXELS_PER_EDGE
    return (TEXELS_PER_LIGHT + int(bounded)) * count + size * parts + TEXELS_PER_PICTURE * pictures


@dataclass(frozen=True, slots=True)
class LightNeeds:
    """The lights of a scene that reach surfaces.

    ``curves`` says how curves are packed, ``parts`` counts what they then are:
    edges, nodes of trees, or the curves themselves; ``bounded`` is whether the rectangle
    around each is packed too; ``uniform_texels`` is the uniform
    block's array length, 0 where the lights need a texture (or there are none); ``pictures``
    counts the lights that have one to show.
    """

    count: int
    parts: int
    curves: CurveForm
    bounded: bool
    texels: int
    one_sided: bool
    two_sided: bool
    uniform_texels: int
    exact_fma: bool
    pictures: int = 0

    @classmethod
    def of(
        cls,
        lights: Sequence[AreaLight],
        limits: Limits,
        technique: str = DEFAULT_TECHNIQUE,
        bounded: bool = False,
    ) -> LightNeeds:
        """Raise `InputError` if the lights are more, or larger, than the machine can hold."""
        geometries = [light_geometry(light) for light in lights]
        shining = [
            light
            for light, geometry in zip(lights, geometries, strict=True)
            if any(light.radiance) and geometry.parts
        ]
        choice = parse_technique(technique)
        curves = choice.curves if has_curves(lights) else 1
        bounded = bounded or choice.technique.is_sampled
        curved = not isinstance(curves, int)
        parts = sum(part_count(item, curves) for item in shining)
        pictures = sum(light.picture is not None for light in shining)
        texels = light_texels(len(lights), parts, curved, bounded, pictures)
        if texels > limits.storage_texels:
            raise InputError(
                f"lights: {len(lights)} lights with {parts} {'curves' if curved else 'edges'} "
                f"need {texels} records, expected at most {limits.storage_texels} on this machine"
            )
        rounded = _rounded(texels)
        return cls(
            len(lights),
            parts,
            curves,
            bounded,
            texels,
            any(not light.two_sided for light in shining),
            any(light.two_sided for light in shining),
            rounded if 16 * rounded <= limits.uniform_block_bytes else 0,
            limits.exact_fma,
            pictures,
        )

    @property
    def curved(self) -> bool:
        """Whether shaders integrate along curves."""
        return not isinstance(self.curves, int)

    @property
    def part_name(self) -> str:
        """What ``parts`` counts."""
        return {"tree": "node", "whole": "curve"}.get(str(self.curves), "edge")

    def technique(self, wanted: str) -> str:
        """Return whose shaders integrate these lights: ``ltc`` if only curves would differ."""
        choice = parse_technique(wanted)
        alike = choice.follows_ltc and self.curves != "whole"
        if alike or (choice.name == DEFAULT_TECHNIQUE and self.curves != "tree"):
            return str(choice.without_curves)
        return wanted

    def defines(self) -> dict[str, int]:
        """Return the numbers that shaders which read lights are assembled with."""
        return {
            "HAS_ONE_SIDED": int(self.one_sided),
            "HAS_TWO_SIDED": int(self.two_sided),
            "HAS_CURVES": int(self.curved),
            "HAS_EXACT_FMA": int(self.exact_fma),
            "LIGHT_STORAGE_UNIFORM": int(self.uniform_texels > 0),
            "LIGHT_TEXELS": self.uniform_texels,
            "STORAGE_TEXTURE_WIDTH": STORAGE_TEXTURE_WIDTH,
        }


@dataclass(frozen=True, slots=True)
class LightingFeatures:
    """What the lighting program of a scene needs.

    Attributes
    ----------
    specular, diffuse : bool
        Some object's material reflects so, and some light shines.
    shapes : bool
        Some light is visible to the camera.
    accumulates : bool
        The result is averaged with earlier samples.
    lights : LightNeeds
    uniform_materials : int
        Array length of the material block, 0 where materials need a texture
        (or nothing is shaded).
    technique : str
        Whose shaders are included; the default one's where nothing is glossy, because
        diffuse reflection is the same in all but those that take curves whole or have their own.
    tangents : bool
        Some glossy material is anisotropic, and the technique shades it so.
    counts : bool
        Pixels get the number of evaluations instead of radiance.
    culls : bool
        Lights that a bound puts below what can be seen are skipped, which the user asked for.
    anisotropic : bool
        Lobes are looked up in the anisotropic tables, where the technique has tables.
    estimates_noise : bool
        Samples are random, so the picture tells how far off it is (`app.render.noise`).
    mixed : bool
        Some material lacks a lobe that another has: where it is seen, one lobe is integrated.
        Only of ``ggx``, where the test is worth its while.
    """

    specular: bool
    diffuse: bool
    shapes: bool
    accumulates: bool
    lights: LightNeeds
    uniform_materials: int
    technique: str
    tangents: bool
    counts: bool
    anisotropic: bool
    culls: bool
    estimates_noise: bool
    mixed: bool

    @classmethod
    def of(
        cls,
        scene: Scene,
        samples: int,
        limits: Limits,
        technique: str = DEFAULT_TECHNIQUE,
        view: PixelView = "radiance",
        culls: bool = False,
    ) -> LightingFeatures:
        """Raise `InputError` if lights or objects are more than the machine can hold."""
        culls = culls and parse_technique(technique).skips_lobes
        lights = LightNeeds.of(scene.lights, limits, technique, culls)
        shines = lights.one_sided or lights.two_sided
        used = scene.object_materials()
        if TEXELS_PER_MATERIAL * len(used) > limits.storage_texels:
            raise InputError(
                f"objects: there are {len(used)}, "
                f"expected at most {limits.storage_texels // TEXELS_PER_MATERIAL} on this machine"
            )
        specular = shines and any(any(material.f0) for material in used)
        diffuse = shines and any(any(material.diffuse) for material in used)
        rounded = _rounded(TEXELS_PER_MATERIAL * len(used))
        fits = (specular or diffuse) and 16 * rounded <= limits.uniform_block_bytes
        anisotropic = (
            specular
            and find_technique(technique).anisotropic
            and any(material.is_anisotropic and any(material.f0) for material in used)
        )
        own_shaders = specular or lights.curves == "whole"
        own_shaders |= diffuse and find_technique(technique).has_own_diffuse
        used_technique = lights.technique(technique) if own_shaders else DEFAULT_TECHNIQUE
        if find_technique(technique).is_sampled and not find_technique(used_technique).is_sampled:
            lights = LightNeeds.of(scene.lights, limits, used_technique, culls)
        return cls(
            specular,
            diffuse,
            any(light.visible and light_geometry(light).parts for light in scene.lights),
            samples > 1,
            lights,
            rounded if fits else 0,
            used_technique,
            anisotropic,
            view == "cost",
            anisotropic,
            culls and (specular or diffuse),
            samples > 1 and find_technique(used_technique).is_sampled and view != "cost",
            specular
            and diffuse
            and parse_technique(used_technique).name == "ggx"
            and not all(any(material.f0) and any(material.diffuse) for material in used),
        )

    @property
    def reads_tables(self) -> bool:
        """Whether the technique's tables are looked up: the anisotropic ones if ``anisotropic``."""
        return self.specular and find_technique(self.technique).has_tables

    @property
    def residual_size(self) -> int | None:
        """Texels on each axis of the residual's texture where a variant has its own number."""
        return parse_technique(self.technique).changes.residual

    @property
    def shades(self) -> bool:
        """Whether any surface reflects any light."""
        return self.specular or self.diffuse

    @property
    def lit(self) -> bool:
        """Whether there is anything to see: without this no lighting program exists."""
        return self.shades or self.shapes

    def defines(self) -> dict[str, int]:
        """Return the numbers that the lighting shaders are assembled with."""
        lights, skips = self.lights, parse_technique(self.technique).skips_lobes
        if not self.shades:
            lights = replace(lights, one_sided=False, two_sided=False)
        return {
            "HAS_SPECULAR": int(self.specular),
            "HAS_DIFFUSE": int(self.diffuse),
            "HAS_SHAPES": int(self.shapes),
            "ACCUMULATES": int(self.accumulates),
            "PROBES": 0,
            "ESTIMATES_NOISE": int(self.estimates_noise),
            "COUNTS_EVALUATIONS": int(self.counts),
            "HAS_TANGENTS": int(self.tangents),
            "CULLS": int(self.culls and skips),
            "MIXED_LOBES": int(self.mixed),
            **technique_defines(self.technique, self.anisotropic),
            **picture_defines(lights, self.technique),
            "MATERIAL_STORAGE_UNIFORM": int(self.uniform_materials > 0),
            "MATERIAL_TEXELS": self.uniform_materials,
            **lights.defines(),
        }


def picture_defines(lights: LightNeeds, technique: str) -> dict[str, int]:
    """Return the numbers that say how lobes look at pictures, 0 where no light has one."""
    taps = parse_technique(technique).changes.picture_taps
    return {
        "HAS_PICTURES": int(lights.pictures > 0),
        "PICTURE_TAPS": taps if lights.pictures else 0,
    }


def technique_defines(technique: str, anisotropic: bool) -> dict[str, int]:
    """Return the numbers that choose a technique's shaders, for lobes that may be anisotropic.

    What looks lobes up takes no tangent where none matters: it has an isotropic table.
    """
    choice = parse_technique(technique)
    has_tables = choice.technique.has_tables
    takes_tangent = choice.technique.anisotropic and (anisotropic or not has_tables)
    azimuths = anisotropic_azimuths() if has_tables and takes_tangent else (0, 0)
    defines = {
        "TECHNIQUE_GGX": int(choice.name == "ggx"),
        "TECHNIQUE_REFERENCE": int(choice.name == "reference"),
        "TECHNIQUE_RESIDUAL": int(choice.name == "ltc+residual"),
        "TAKES_SEED": int(choice.technique.is_sampled),
        "TECHNIQUE_REPRESENTATIVE_POINT": int(choice.name == "representative-point"),
        "TAKES_TANGENT": int(takes_tangent),
        "RESIDUAL_AZIMUTHS": azimuths[0],
        "ALBEDO_AZIMUTHS": azimuths[1],
        "CURVE_RULE": choice.technique.curve_rule,
        "CURVE_NODES": choice.curve_nodes,
        "DIVIDES_BY_ABOVE": int(choice.changes.divides),
        "CUTS_AT_LOBE": int(choice.changes.cuts_at_lobe),
    }
    if choice.name == "ggx" and choice.number is not None:
        defines["GGX_NODES"] = choice.number
    return defines


def probe_defines(lights: LightNeeds, technique: str, anisotropic: bool) -> dict[str, int]:
    """Return the numbers that the probe's shaders are assembled with: a white, glossy material.

    ``anisotropic``: whether that of some point is.
    """
    return {
        "HAS_SPECULAR": 1,
        "HAS_DIFFUSE": 1,
        "PROBES": 1,
        "COUNTS_EVALUATIONS": 0,
        "CULLS": 0,
        "MIXED_LOBES": 0,
        **technique_defines(lights.technique(technique), anisotropic),
        **picture_defines(lights, technique),
        **lights.defines(),
    }
