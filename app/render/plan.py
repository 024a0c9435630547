"""What a shot needs on the GPU, derived in one place, and what it can do without.

`needs_of` is what the renderer carries out; `make_plan` adds sizes, sources and
reasons for people (`ltc-viewer explain`, the window's panel). Neither touches GL.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from app.errors import InputError
from app.render import gbuffer
from app.render.features import LightingFeatures, Limits
from app.render.gbuffer import load_meshes, mesh_bytes, objects_spec
from app.render.light_shapes import (
    LIGHT_VERTEX,
    curve_texels,
    has_triangles,
    pack_light_curves,
    pack_light_triangles,
)
from app.render.lighting import lighting_spec
from app.render.pack import TEXELS_PER_MATERIAL
from app.render.post import display_spec
from app.render.programs import ProgramSpec
from app.render.storage import storage_bytes
from app.render.tables import isotropic_textures
from app.render.techniques import DEFAULT_TECHNIQUE, find_technique, technique_of
from app.scene import TONE_MAPS, PixelView, Scene, Shot

ATTACHMENTS = {
    "gbuffer": "RGBA32F",
    "tangents": "RG32F",
    "depth": "DEPTH24",
    "radiance": "RGBA32F",
    "radiance 2": "RGBA32F",
    "display": "RGBA8",
}
"""Every attachment's format."""

FORMAT_BYTES = {"RGBA32F": 16, "RG32F": 8, "RGBA8": 4, "DEPTH24": 4}
"""Bytes of a pixel; 24 bits of depth are stored in 32."""


@dataclass(frozen=True)
class Needs:
    """What the renderer compiles, allocates and runs for a scene.

    ``programs`` are compiled by the G-buffer and lighting passes (the display
    program comes with the first picture that is shown); ``attachments`` are
    (name, format) pairs.
    """

    lighting: LightingFeatures
    programs: tuple[ProgramSpec, ...]
    attachments: tuple[tuple[str, str], ...]

    @property
    def accumulates(self) -> bool:
        """Whether each sample reads the mean of those before it."""
        return any(name == "radiance 2" for name, _ in self.attachments)


def needs_of(
    scene: Scene,
    samples: int,
    limits: Limits,
    technique: str = DEFAULT_TECHNIQUE,
    view: PixelView = "radiance",
) -> Needs:
    """Return what a scene needs with ``samples`` per pixel.

    Raises
    ------
    InputError
        If lights or objects are more than the machine can hold.
    """
    lighting = LightingFeatures.of(scene, samples, limits, technique, view)
    outlines = curve_texels(scene.lights)
    if outlines > limits.storage_texels:
        raise InputError(
            f"lights: the curves of visible lights need {outlines} records, "
            f"expected at most {limits.storage_texels} on this machine"
        )
    programs: list[ProgramSpec] = []
    attachments: list[str] = []
    if lighting.lit:
        attachments += ["gbuffer", *(["tangents"] if lighting.tangents else []), "depth"]
        if scene.objects:
            programs.append(objects_spec(lighting.tangents))
        if has_triangles(scene.lights):
            programs.append(gbuffer.LIGHTS)
        if outlines:
            programs.append(gbuffer.CURVED_LIGHTS)
        programs.append(lighting_spec(lighting))
    attachments.append("radiance")
    if lighting.lit and lighting.accumulates:
        attachments.append("radiance 2")
    attachments.append("display")
    return Needs(
        lighting, tuple(programs), tuple((name, ATTACHMENTS[name]) for name in attachments)
    )


@dataclass(frozen=True)
class PlannedProgram:
    """A program: its entry files, the features it is assembled with, and its size."""

    name: str
    entries: tuple[str, ...]
    features: tuple[tuple[str, int], ...]
    files: tuple[str, ...]
    lines: int
    characters: int


@dataclass(frozen=True)
class PlannedResource:
    """Something allocated: an attachment, a table or a buffer."""

    name: str
    form: str
    bytes: int

    @property
    def label(self) -> str:
        """The name without the folders of a mesh file."""
        return f"mesh {Path(self.name[5:]).name}" if self.name.startswith("mesh ") else self.name


@dataclass(frozen=True)
class LeftOut:
    """Something that this shot does without, why, and the bytes that it would take."""

    what: str
    why: str
    bytes: int = 0


@dataclass(frozen=True)
class Plan:
    """What rendering a shot compiles, allocates, loads and runs, and what it leaves out."""

    title: str
    programs: tuple[PlannedProgram, ...]
    attachments: tuple[PlannedResource, ...]
    tables: tuple[PlannedResource, ...]
    buffers: tuple[PlannedResource, ...]
    passes: tuple[str, ...]
    left_out: tuple[LeftOut, ...]

    @property
    def allocated(self) -> dict[str, int]:
        """Bytes by name of everything allocated; `Renderer.allocated` shows the same."""
        parts = (*self.attachments, *self.tables, *self.buffers)
        return {part.name: part.bytes for part in parts}

    @property
    def bytes(self) -> int:
        """Bytes of everything allocated."""
        return sum(self.allocated.values())

    def text(self) -> str:
        """Return the plan in plain text, a few columns wide."""
        lines = [self.title, "", "Passes"]
        lines += [f"  {i}. {text}" for i, text in enumerate(self.passes, start=1)]
        lines += ["", "Programs"]
        for program in self.programs:
            lines.append(
                f"  {program.name:<14} {program.lines:>5} lines, {program.characters} characters"
            )
            lines.append(f"  {'':<14} {' + '.join(program.entries)}")
            included = [name for name in program.files if name not in program.entries]
            if included:
                lines.append(f"  {'':<14} with {', '.join(included)}")
            on = [f"{name}={value}" for name, value in program.features if value]
            if on:
                lines.append(f"  {'':<14} {' '.join(on)}")
        for heading, resources in (
            ("Attachments", self.attachments),
            ("Tables", self.tables),
            ("Buffers", self.buffers),
        ):
            lines += ["", heading]
            lines += [
                f"  {part.label:<20} {format_bytes(part.bytes):>10}  {part.form}"
                for part in resources
            ] or ["  none"]
        lines += ["", f"Allocated: {format_bytes(self.bytes)}", "", "Left out"]
        for left in self.left_out:
            saved = f" (saves {format_bytes(left.bytes)})" if left.bytes else ""
            lines.append(f"  {left.what}: {left.why}{saved}")
        if not self.left_out:
            lines.append("  nothing")
        return "\n".join(lines) + "\n"


def format_bytes(count: int) -> str:
    """Return a number of bytes in B, KB (1024 B) or MB."""
    if count < 10_000:
        return f"{count} B"
    if count < 10_000_000:
        return f"{count / 1024:.1f} KB"
    return f"{count / 1024**2:.1f} MB"


def make_plan(shot: Shot, limits: Limits, roots: Sequence[Path]) -> Plan:
    """Return the plan of a shot.

    Parameters
    ----------
    limits : Limits
        Of the machine, or the defaults, which every OpenGL 4.1 machine has.
    roots : sequence of Path
        Folders of shaders, see `app.render.programs.shader_roots`.

    Raises
    ------
    InputError
        If the scene needs more than the limits, or a mesh cannot be loaded.
    ShaderError
        If a shader does not assemble.
    """
    scene, settings = shot.scene, shot.settings
    technique = technique_of(scene, settings.technique)
    needs = needs_of(scene, settings.samples, limits, technique, settings.view)
    pixels = shot.width * shot.height
    samples = "1 sample" if settings.samples == 1 else f"{settings.samples} samples"
    return Plan(
        f"{shot.width}x{shot.height}, {samples} per pixel, technique {technique} "
        f"({find_technique(technique).description})",
        tuple(
            _planned_program(spec, roots)
            for spec in (*needs.programs, display_spec(scene.display, settings.view))
        ),
        tuple(
            PlannedResource(name, form, pixels * FORMAT_BYTES[form])
            for name, form in needs.attachments
        ),
        _tables(needs.lighting),
        _buffers(scene, needs.lighting),
        _passes(shot, needs.lighting),
        _left_out(shot, needs.lighting),
    )


def _planned_program(spec: ProgramSpec, roots: Sequence[Path]) -> PlannedProgram:
    sources = spec.sources(roots)
    return PlannedProgram(
        spec.name,
        (spec.vertex, spec.fragment),
        spec.features,
        tuple(dict.fromkeys(name for source in sources for name in source.files)),
        sum(source.lines for source in sources),
        sum(len(source.text) for source in sources),
    )


def _tables(features: LightingFeatures) -> tuple[PlannedResource, ...]:
    if not features.reads_tables:
        return ()
    return tuple(
        PlannedResource(
            name, f"float32 texture, {' x '.join(str(n) for n in texels.shape)}", int(texels.nbytes)
        )
        for name, texels in zip(
            ("table_residual", "table_albedo"), isotropic_textures(), strict=True
        )
    )


def _buffers(scene: Scene, features: LightingFeatures) -> tuple[PlannedResource, ...]:
    if not features.lit:
        return ()
    lights = features.lights
    parts = []
    for name, mesh in load_meshes(scene.objects).items():
        form = f"vertices and indices, {len(mesh.indices)} triangles"
        parts.append(PlannedResource(f"mesh {name}", form, mesh_bytes(mesh, features.tangents)))
    if has_triangles(scene.lights):
        vertices = len(pack_light_triangles(scene.lights).vertices)
        parts.append(
            PlannedResource(
                "light shapes", f"{vertices // 3} triangles", vertices * LIGHT_VERTEX.itemsize
            )
        )
    if curve_texels(scene.lights):
        outlines, shapes = pack_light_curves(scene.lights)
        bands = sum(shape.bands for shape in shapes)
        parts.append(
            PlannedResource(
                "light curves",
                f"RGBA32F texture, {_count(len(shapes), 'outline')} in {_count(bands, 'band')}",
                storage_bytes(len(outlines), 0),
            )
        )
    parts.append(_storage("lights", lights.texels, lights.uniform_texels))
    if features.shades:
        texels = TEXELS_PER_MATERIAL * len(scene.objects)
        parts.append(_storage("materials", texels, features.uniform_materials))
    return tuple(parts)


def _storage(name: str, texels: int, uniform_texels: int) -> PlannedResource:
    form = "uniform block" if uniform_texels else "RGBA32F texture, too many for a uniform block"
    return PlannedResource(name, f"{form}, {texels} records", storage_bytes(texels, uniform_texels))


def _passes(shot: Shot, features: LightingFeatures) -> tuple[str, ...]:
    scene = shot.scene
    passes = []
    if features.lit:
        drawn = []
        if scene.objects:
            drawn.append(_count(len(scene.objects), "object"))
        if features.shapes:
            visible = sum(light.visible for light in scene.lights)
            drawn.append(_count(visible, "visible light"))
        times = f", {shot.settings.samples} times" if features.accumulates else ""
        passes.append(f"gbuffer: {' and '.join(drawn)}{times}")
        does = []
        if features.shades:
            lobes = [n for n, on in (("specular", features.specular), ("diffuse", True)) if on]
            if not features.diffuse:
                lobes.remove("diffuse")
            does.append(
                f"{' and '.join(lobes)} of {_count(features.lights.count, 'light')} "
                f"with {_count(features.lights.parts, features.lights.part_name)}"
            )
        if features.shapes:
            does.append("the radiance of visible lights")
        passes.append(f"lighting: {', '.join(does)}{times}")
    else:
        passes.append("clear: there is nothing to see")
    if features.counts:
        passes.append("display: evaluations per pixel as colours")
        return tuple(passes)
    exposure = f"{scene.display.exposure:+g} stops, " if scene.display.exposure else ""
    passes.append(f"display: {exposure}tone map {scene.display.tone_map}, sRGB, dither to 8 bits")
    return tuple(passes)


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def _left_out(shot: Shot, features: LightingFeatures) -> tuple[LeftOut, ...]:
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
        tables = sum(int(texels.nbytes) for texels in isotropic_textures())
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
    if features.shades and not lights.two_sided:
        leave("light from back sides", "no light is two-sided")
    if features.shades and not lights.one_sided:
        leave("test for dark sides", "every light is two-sided")
    if features.lit and not features.accumulates:
        leave(
            "second radiance attachment and averaging",
            "one sample per pixel needs no history",
            pixels * FORMAT_BYTES["RGBA32F"],
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
