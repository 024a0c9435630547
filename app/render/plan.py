"""What rendering a shot takes, and what it can do without, with sizes and reasons.

For people: `ltc-viewer explain` and the window's panel. What the renderer carries out is
`app.render.needs`. Nothing here touches GL.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from app.plan_rows import PlanRow, PlanSection, format_bytes, section_lines, share_text
from app.render.features import LightingFeatures, Limits
from app.render.gbuffer import load_meshes, mesh_bytes
from app.render.left_out import LeftOut, left_out
from app.render.light_shapes import (
    LIGHT_VERTEX,
    curve_texels,
    has_triangles,
    pack_light_curves,
    pack_light_triangles,
)
from app.render.needs import FORMAT_BYTES, needs_of
from app.render.pack import TEXELS_PER_MATERIAL
from app.render.picture_layout import lay_pictures
from app.render.post import display_spec
from app.render.programs import ProgramSpec
from app.render.reasons import counted, program_reason, resource_reason
from app.render.storage import storage_bytes
from app.render.tables import table_textures
from app.render.techniques import find_technique, technique_of
from app.scene import Scene, Shot


@dataclass(frozen=True)
class PlannedProgram:
    """A program: why it exists, its entry files, the features it is assembled with, its size."""

    name: str
    why: str
    entries: tuple[str, ...]
    features: tuple[tuple[str, int], ...]
    files: tuple[str, ...]
    lines: int
    characters: int

    def row(self) -> PlanRow:
        """Return it for people."""
        included = [name for name in self.files if name not in self.entries]
        on = [f"{name}={value}" for name, value in self.features if value]
        more = [
            f"{self.characters} characters of {' + '.join(self.entries)}",
            *([f"with {', '.join(included)}"] if included else []),
            *([" ".join(on)] if on else []),
        ]
        return PlanRow(self.name, f"{self.lines} lines", self.why, more=tuple(more))


@dataclass(frozen=True)
class PlannedResource:
    """Something allocated, and why: an attachment, a table or a buffer."""

    name: str
    form: str
    bytes: int
    why: str

    @property
    def label(self) -> str:
        """The name without the folders of a mesh file."""
        return f"mesh {Path(self.name[5:]).name}" if self.name.startswith("mesh ") else self.name

    def row(self) -> PlanRow:
        """Return it for people."""
        return PlanRow(self.label, format_bytes(self.bytes), self.why, self.form)


@dataclass(frozen=True)
class Plan:
    """What rendering a shot compiles, allocates, loads and runs, and what it leaves out.

    ``technique`` says in a line what the technique does.
    """

    title: str
    technique: str
    programs: tuple[PlannedProgram, ...]
    attachments: tuple[PlannedResource, ...]
    tables: tuple[PlannedResource, ...]
    buffers: tuple[PlannedResource, ...]
    passes: tuple[tuple[str, str], ...]
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

    @property
    def lines(self) -> int:
        """Lines of all programs."""
        return sum(program.lines for program in self.programs)

    def sections(self) -> tuple[PlanSection, ...]:
        """Return everything in rows, for people."""
        return (
            PlanSection("Passes", tuple(PlanRow(name, "", does) for name, does in self.passes)),
            PlanSection("Programs", tuple(program.row() for program in self.programs)),
            *(
                PlanSection(title, tuple(part.row() for part in parts))
                for title, parts in (
                    ("Attachments", self.attachments),
                    ("Tables", self.tables),
                    ("Buffers", self.buffers),
                )
            ),
            PlanSection(
                "Left out",
                tuple(
                    PlanRow(left.what, format_bytes(left.bytes) if left.bytes else "", left.why)
                    for left in self.left_out
                ),
            ),
        )

    def summary(self) -> str:
        """Return the sums in one sentence."""
        return f"{self.lines} lines compiled, {format_bytes(self.bytes)} allocated"

    def text(self) -> str:
        """Return the plan in plain text, a few columns wide."""
        lines = [f"{self.title} ({self.technique})", self.summary()]
        for section in self.sections():
            lines += ["", *section_lines(section)]
        return "\n".join(lines) + "\n"


def make_plan(shot: Shot, limits: Limits, roots: Sequence[Path], everything: bool = False) -> Plan:
    """Return the plan of a shot.

    Parameters
    ----------
    limits : Limits
        Of the machine, or the defaults, which every OpenGL 4.1 machine has.
    roots : sequence of Path
        Folders of shaders, see `app.render.programs.shader_roots`.
    everything : bool
        Plan with nothing left out (`app.render.everything`).

    Raises
    ------
    InputError
        If the scene needs more than the limits, or a mesh cannot be loaded.
    ShaderError
        If a shader does not assemble.
    """
    scene, settings = shot.scene, shot.settings
    technique = technique_of(scene, settings.technique)
    needs = needs_of(
        scene, settings.samples, limits, technique, settings.view, settings.cull > 0.0, everything
    )
    features = needs.lighting
    pixels = shot.width * shot.height
    samples = "1 sample" if settings.samples == 1 else f"{settings.samples} samples"

    def resources(parts: Iterable[tuple[str, str, int]]) -> tuple[PlannedResource, ...]:
        return tuple(
            PlannedResource(name, form, size, resource_reason(name, shot, features))
            for name, form, size in parts
        )

    return Plan(
        f"{shot.width}x{shot.height}, {samples} per pixel, technique {technique}",
        find_technique(technique).description,
        tuple(
            _planned_program(spec, roots, program_reason(spec.name, shot, features))
            for spec in (*needs.programs, display_spec(scene.display, settings.view))
        ),
        resources((name, form, pixels * FORMAT_BYTES[form]) for name, form in needs.attachments),
        resources(_tables(features)),
        resources(_buffers(scene, features, settings.time, limits)),
        tuple(_passes(shot, features)),
        left_out(shot, features),
    )


def _planned_program(spec: ProgramSpec, roots: Sequence[Path], why: str) -> PlannedProgram:
    sources = spec.sources(roots)
    return PlannedProgram(
        spec.name,
        why,
        (spec.vertex, spec.fragment),
        spec.features,
        tuple(dict.fromkeys(name for source in sources for name in source.files)),
        sum(source.lines for source in sources),
        sum(len(source.text) for source in sources),
    )


def _tables(features: LightingFeatures) -> Iterator[tuple[str, str, int]]:
    """Yield name, form and bytes of each table."""
    if not features.reads_tables:
        return
    for name, texels in table_textures(features.anisotropic, features.residual_size).items():
        form = f"{texels.dtype} texture, {' x '.join(str(n) for n in texels.shape)}"
        yield name, form, int(texels.nbytes)


def _buffers(
    scene: Scene, features: LightingFeatures, time: float, limits: Limits
) -> Iterator[tuple[str, str, int]]:
    """Yield name, form and bytes of each buffer."""
    if not features.lit:
        return
    lights = features.lights
    for name, mesh in load_meshes(scene.objects).items():
        form = f"vertices and indices, {counted(len(mesh.indices), 'triangle')}"
        yield f"mesh {name}", form, mesh_bytes(mesh, features.tangents)
    if has_triangles(scene.lights):
        vertices = len(pack_light_triangles(scene.lights).vertices)
        form = counted(vertices // 3, "triangle")
        yield "light shapes", form, vertices * LIGHT_VERTEX.itemsize
    if curve_texels(scene.lights):
        outlines, shapes = pack_light_curves(scene.lights)
        bands = counted(sum(shape.bands for shape in shapes), "band")
        form = f"RGBA32F texture, {counted(len(shapes), 'outline')} in {bands}"
        yield "light curves", form, storage_bytes(len(outlines), 0)
    yield _storage("lights", lights.texels, lights.uniform_texels)
    if lights.pictures:
        atlas = lay_pictures(scene.lights, time, limits.texture_side)
        form = f"RGBA16F texture, {atlas.width} x {atlas.height}, pictures and their levels"
        yield "light pictures", form, atlas.bytes
    if features.shades:
        texels = TEXELS_PER_MATERIAL * len(scene.objects)
        yield _storage("materials", texels, features.uniform_materials)


def _storage(name: str, texels: int, uniform_texels: int) -> tuple[str, str, int]:
    form = "uniform block" if uniform_texels else "RGBA32F texture, too many for a uniform block"
    return name, f"{form}, {texels} records", storage_bytes(texels, uniform_texels)


def _passes(shot: Shot, features: LightingFeatures) -> Iterator[tuple[str, str]]:
    """Yield each pass and what it does."""
    scene = shot.scene
    if features.lit:
        drawn = []
        if scene.objects:
            drawn.append(counted(len(scene.objects), "object"))
        if features.shapes:
            visible = sum(light.visible for light in scene.lights)
            drawn.append(counted(visible, "visible light"))
        times = f", {shot.settings.samples} times" if features.accumulates else ""
        yield "gbuffer", f"{' and '.join(drawn)}{times}"
        does = []
        if features.shades:
            lobes = [name for name in ("specular", "diffuse") if getattr(features, name)]
            does.append(
                f"{' and '.join(lobes)} of {counted(features.lights.count, 'light')} "
                f"with {counted(features.lights.parts, features.lights.part_name)}"
            )
        if features.culls:
            share = share_text(shot.settings.cull)
            does.append(f"but for lights that add up to less than {share} of white")
        if features.shapes:
            does.append("the radiance of visible lights")
        yield "lighting", f"{', '.join(does)}{times}"
    else:
        yield "clear", "there is nothing to see"
    if features.counts:
        yield "display", "evaluations per pixel as colours"
        return
    exposure = f"{scene.display.exposure:+g} stops, " if scene.display.exposure else ""
    yield "display", f"{exposure}tone map {scene.display.tone_map}, sRGB, dither to 8 bits"
