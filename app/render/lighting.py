"""The lighting pass: from surfaces to radiance, by the technique's own shaders.

It owns what shading reads: the lights, the materials, and the tables of a scene
that has something glossy. The probe runs the very same functions on given points.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack

import moderngl
import numpy as np
from numpy.typing import NDArray

from app.render.camera import CameraFrame
from app.render.features import LightingFeatures, LightNeeds, probe_defines
from app.render.pack import pack_lights, pack_materials
from app.render.picture_layout import PictureLayout
from app.render.pictures import PictureAtlas
from app.render.programs import Programs, ProgramSpec, set_uniform
from app.render.state import FullScreenTriangle, begin_pass, release_framebuffer
from app.render.storage import TexelStorage
from app.render.tables import table_textures
from app.scene import AreaLight, Material

# Texture units and uniform block bindings; each pass binds its own anew.
SURFACES, TANGENTS, HISTORY, NOISE_HISTORY, LIGHTS, MATERIALS, FIRST_TABLE = range(7)

POINT_INPUTS = ("positions", "normals", "tangents", "views", "alphas")
FIRST_POINT_UNIT = 9
"""Behind the units of the tables."""
PICTURES = FIRST_POINT_UNIT + len(POINT_INPUTS)

PROBE_SIDE = 1024
"""Points are probed in pictures of at most this side."""


def lighting_spec(features: LightingFeatures) -> ProgramSpec:
    """Return the lighting program of a scene that has one."""
    return ProgramSpec.of(
        "lighting", "passes/fullscreen.vert", "passes/lighting.frag", features.defines()
    )


def probe_spec(lights: LightNeeds, technique: str, anisotropic: bool) -> ProgramSpec:
    """Return the probe's program for a scene's lights, a technique and points."""
    return ProgramSpec.of(
        "probe",
        "passes/fullscreen.vert",
        "passes/probe.frag",
        probe_defines(lights, technique, anisotropic),
    )


class LightingPass:
    """Owner of lights, materials and tables on the GPU. ``uploads`` counts their fillings."""

    def __init__(self, ctx: moderngl.Context, programs: Programs) -> None:
        self._ctx = ctx
        self._programs = programs
        self._lights = TexelStorage(ctx, "light", "Lights")
        self._materials = TexelStorage(ctx, "material", "Materials")
        self._pictures = PictureAtlas(ctx, programs)
        self._tables: dict[str, moderngl.Texture | moderngl.TextureArray] = {}
        self._tables_hold: tuple[bool, int | None] = (False, None)
        self._triangle = FullScreenTriangle(ctx)
        self._light_count = 0

    @property
    def uploads(self) -> dict[str, int]:
        """How often lights, materials and pictures were sent to the GPU."""
        return {
            "lights": self._lights.uploads,
            "materials": self._materials.uploads,
            "pictures": self._pictures.filtered,
        }

    def set_lights(
        self, lights: Sequence[AreaLight], needs: LightNeeds, pictures: PictureLayout
    ) -> None:
        """Hold the texels of ``lights``, and of where their pictures are."""
        self._light_count = len(lights)
        texels = pack_lights(lights, needs.curves, needs.bounded, pictures.records())
        self._lights.update(texels, needs.uniform_texels)

    def has_pictures(self, pictures: PictureLayout) -> bool:
        """Return whether these pictures are held already, and no others."""
        return self._pictures.holds(pictures)

    def set_pictures(self, pictures: PictureLayout) -> None:
        """Hold pictures and their blurred levels."""
        self._pictures.update(pictures)

    def forget_pictures(self) -> None:
        """Filter pictures again when they are set next."""
        self._pictures.forget()

    def set_materials(self, materials: Sequence[Material], uniform_texels: int) -> None:
        """Hold one record per object."""
        self._materials.update(pack_materials(materials), uniform_texels)

    def drop(self, *, lights: bool = False, materials: bool = False, tables: bool = False) -> None:
        """Release what the scene no longer needs."""
        if lights:
            self._lights.release()
            self._pictures.release()
        if materials:
            self._materials.release()
        if tables:
            for texture in self._tables.values():
                texture.release()
            self._tables.clear()

    def load_tables(self, anisotropic: bool, residual: int | None) -> None:
        """Hold the technique's tables, as `table_textures` returns them, and no others."""
        if self._tables and self._tables_hold == (anisotropic, residual):
            return
        self.drop(tables=True)
        self._tables_hold = (anisotropic, residual)
        wanted = table_textures(anisotropic, residual)
        for name, texels in wanted.items():
            texture: moderngl.Texture | moderngl.TextureArray
            *layers, height, width, channels = texels.shape
            if layers:
                size = (width, height, layers[0])
                texture = self._ctx.texture_array(size, channels, texels.tobytes(), dtype="f2")
                texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
                texture.repeat_x = texture.repeat_y = False
            else:
                texture = self._ctx.texture((width, height), channels, texels.tobytes(), dtype="f4")
                texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
            self._tables[name] = texture

    def draw(
        self,
        target: moderngl.Framebuffer,
        surfaces: moderngl.Texture,
        tangents: moderngl.Texture | None,
        features: LightingFeatures,
        frame: CameraFrame,
        offset: tuple[float, float],
        history: moderngl.Texture | None,
        sample: int,
        faint: float = 0.0,
        noise_history: moderngl.Texture | None = None,
    ) -> None:
        """Write the radiance of one sample, or its mean with ``history``, to ``target``.

        Parameters
        ----------
        tangents : texture or None
            The G-buffer's second attachment, where ``features`` ask for it.
        offset : (right, up)
            Where in its pixel the G-buffer's sample lies, from the centre [pixels].
        history : texture or None
            The mean of the ``sample`` samples before this one.
        faint : float
            Radiance that all that is skipped at a pixel may add up to.
        noise_history : texture or None
            What goes with ``history`` where ``features`` say that noise is estimated.
        """
        width, height = target.size
        begin_pass(target, target.size)
        program = self._programs.get(lighting_spec(features))
        set_uniform(program, "surfaces", SURFACES)
        surfaces.use(SURFACES)
        if tangents is not None:
            set_uniform(program, "tangents", TANGENTS)
            tangents.use(TANGENTS)
        if history is not None:
            set_uniform(program, "history", HISTORY)
            history.use(HISTORY)
        if noise_history is not None:
            set_uniform(program, "noise_history", NOISE_HISTORY)
            noise_history.use(NOISE_HISTORY)
        set_uniform(program, "sample_sign", 1.0 - 2.0 * (sample % 2))
        set_uniform(program, "sample_weight", 1.0 / (sample + 1))
        set_uniform(program, "sample_index", sample)
        set_uniform(program, "faint_radiance", faint)
        corner = (
            frame.forward
            + (2.0 * offset[0] / width - 1.0) * frame.right
            + (2.0 * offset[1] / height - 1.0) * frame.up
        )
        set_uniform(program, "eye", tuple(frame.eye))
        set_uniform(program, "ray_corner", tuple(corner))
        set_uniform(program, "ray_dx", tuple(2.0 / width * frame.right))
        set_uniform(program, "ray_dy", tuple(2.0 / height * frame.up))
        self._bind_shading(program)
        self._materials.bind(program, MATERIALS)
        self._triangle.draw(program)

    def probe(
        self,
        needs: LightNeeds,
        technique: str,
        anisotropic: bool,
        position: NDArray[np.float32],
        normal: NDArray[np.float32],
        tangent: NDArray[np.float32],
        view: NDArray[np.float32],
        alpha: NDArray[np.float32],
        samples: int = 1,
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return (specular, diffuse), each (n, 3), of a white material at n points.

        They are the mean of ``samples`` estimates, of a technique that samples.
        """
        program = self._programs.get(probe_spec(needs, technique, anisotropic))
        batch = PROBE_SIDE * PROBE_SIDE
        pieces = [
            self._probe_batch(program, [a[start : start + batch] for a in inputs], samples)
            for inputs in [(position, normal, tangent, view, alpha)]
            for start in range(0, len(position), batch)
        ]
        empty = np.zeros((0, 3), dtype=np.float32)
        specular = np.concatenate([empty, *(piece[0] for piece in pieces)])
        diffuse = np.concatenate([empty, *(piece[1] for piece in pieces)])
        return specular, diffuse

    def _probe_batch(
        self, program: moderngl.Program, inputs: list[NDArray[np.float32]], samples: int
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        count = len(inputs[0])
        width = min(count, PROBE_SIDE)
        height = -(-count // width)
        with ExitStack() as stack:
            for unit, (name, values) in enumerate(
                zip(POINT_INPUTS, inputs, strict=True), start=FIRST_POINT_UNIT
            ):
                # Points that fill up the last row repeat the last one: all are valid.
                filled = np.concatenate([values, values[-1:].repeat(width * height - count, 0)])
                texture = self._ctx.texture(
                    (width, height), values.shape[1], filled.tobytes(), alignment=4, dtype="f4"
                )
                stack.callback(texture.release)
                texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
                texture.use(unit)
                set_uniform(program, name, unit)
            outputs = [self._ctx.texture((width, height), 4, dtype="f4") for _ in range(2)]
            for output in outputs:
                stack.callback(output.release)
            target = self._ctx.framebuffer(color_attachments=outputs)
            stack.callback(release_framebuffer, target)
            begin_pass(target, (width, height))
            self._bind_shading(program)
            sums = np.zeros((2, count, 3))
            for sample in range(samples):
                set_uniform(program, "sample_index", sample)
                self._triangle.draw(program)
                for total, output in zip(sums, outputs, strict=True):
                    texels = np.frombuffer(output.read(), dtype=np.float32).reshape(-1, 4)
                    total += texels[:count, :3]
            specular, diffuse = (sums / samples).astype(np.float32)
            return specular, diffuse

    def _bind_shading(self, program: moderngl.Program) -> None:
        set_uniform(program, "light_count", self._light_count)
        self._lights.bind(program, LIGHTS)
        self._pictures.bind(program, PICTURES)
        for unit, (name, texture) in enumerate(self._tables.items(), start=FIRST_TABLE):
            if name in program:
                set_uniform(program, name, unit)
                texture.use(unit)

    def allocated(self) -> dict[str, int]:
        """Return the bytes of every buffer and table held, by name."""
        held = {
            name: storage.bytes
            for name, storage in (
                ("lights", self._lights),
                ("materials", self._materials),
                ("light pictures", self._pictures),
            )
            if storage.bytes
        }
        for name, texels in table_textures(*self._tables_hold).items():
            if name in self._tables:
                held[name] = int(texels.nbytes)
        return held

    def release(self) -> None:
        """Release every GPU object."""
        self.drop(lights=True, materials=True, tables=True)
        self._triangle.release()
