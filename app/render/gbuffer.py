"""The G-buffer pass: which surface each pixel sees, and where.

One RGBA32F attachment holds (octahedral normal, depth along the view axis [m],
id); the background's depth is 0. Where anisotropic materials are shaded a second,
RG32F, holds the octahedral tangent. Ids: an object's index, or -1 - i for light i.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import moderngl
import numpy as np
from numpy.typing import NDArray

from app.errors import InputError
from app.meshes import Mesh, load_mesh
from app.render.camera import CameraFrame, normal_from_object, world_from_object
from app.render.features import STORAGE_TEXTURE_WIDTH
from app.render.light_shapes import CurvedShape, pack_light_curves, pack_light_triangles
from app.render.pack import LARGEST_NUMBER, SMALLEST_NUMBER
from app.render.programs import Programs, ProgramSpec, set_uniform, write_uniform
from app.render.state import FullScreenTriangle, begin_pass
from app.render.storage import TexelStorage
from app.scene import AreaLight, Outline, SceneObject

LIGHTS = ProgramSpec.of("light shapes", "passes/light_shape.vert", "passes/light_shape.frag")
CURVED_LIGHTS = ProgramSpec.of(
    "light curves",
    "passes/light_curves.vert",
    "passes/light_curves.frag",
    {"STORAGE_TEXTURE_WIDTH": STORAGE_TEXTURE_WIDTH},
)

WHOLE_PICTURE = (1.0, 1.0, 0.0, 0.0)
OUTLINE_UNIT = 0
"""Texture unit of the curved lights' outlines."""


def objects_spec(tangents: bool) -> ProgramSpec:
    """Return the program that draws objects, with or without their tangents."""
    features = {"HAS_TANGENTS": int(tangents)}
    return ProgramSpec.of("gbuffer", "passes/gbuffer.vert", "passes/gbuffer.frag", features)


def mesh_bytes(mesh: Mesh, tangents: bool) -> int:
    """Return the bytes that a mesh takes on the GPU: vertices and indices."""
    floats = mesh.positions.size + mesh.normals.size + (mesh.tangents.size if tangents else 0)
    return 4 * (floats + mesh.indices.size)


def load_meshes(objects: Sequence[SceneObject]) -> dict[str, Mesh]:
    """Return the meshes of objects by name, each once.

    Raises
    ------
    InputError
        If a file cannot be loaded.
    """
    return {name: load_mesh(name) for name in dict.fromkeys(item.mesh for item in objects)}


class _Vertices:
    """Buffers, and their vertex array for whichever program draws them now."""

    def __init__(
        self, ctx: moderngl.Context, vertices: bytes, layout: str, indices: bytes | None = None
    ) -> None:
        self._ctx = ctx
        self._layout = layout
        self._vertices = ctx.buffer(vertices)
        self._indices = None if indices is None else ctx.buffer(indices)
        self._array: moderngl.VertexArray | None = None
        self._program: moderngl.Program | None = None

    def array(self, program: moderngl.Program) -> moderngl.VertexArray:
        if self._array is None or self._program is not program:
            if self._array is not None:
                self._array.release()
            locations = range(len(self._layout.split()))
            self._array = self._ctx.vertex_array(
                program,
                [(self._vertices, self._layout, *locations)],
                index_buffer=self._indices,
                index_element_size=4,
            )
            self._program = program
        return self._array

    @property
    def bytes(self) -> int:
        return int(self._vertices.size + (self._indices.size if self._indices else 0))

    def release(self) -> None:
        for thing in (self._array, self._vertices, self._indices):
            if thing is not None:
                thing.release()


@dataclass(frozen=True, eq=False)
class _Instance:
    mesh: str
    world_from_object: NDArray[np.float64]
    object_from_world: NDArray[np.float64]
    normal: NDArray[np.float64]
    mirrors: bool


def _instance(item: SceneObject) -> _Instance:
    """Return an object's matrices; raise `InputError` if float32 cannot hold them."""
    matrix = world_from_object(item.transform)
    largest = float(np.abs(matrix).max())
    if not largest < LARGEST_NUMBER:
        raise InputError(
            f"object '{item.name}': its transform reaches {largest:g}, "
            f"expected numbers below {LARGEST_NUMBER:g}"
        )
    smallest = min(abs(factor) for factor in item.transform.scale)
    if not smallest > SMALLEST_NUMBER:
        raise InputError(
            f"object '{item.name}': its scale goes down to {smallest:g}, "
            f"expected numbers above {SMALLEST_NUMBER:g}"
        )
    return _Instance(
        item.mesh,
        matrix,
        np.asarray(np.linalg.inv(matrix), dtype=np.float64),
        normal_from_object(matrix),
        bool(np.linalg.det(matrix[:3, :3]) < 0.0),
    )


def _is_outside(eye: NDArray[np.float64], instance: _Instance, mesh: Mesh) -> bool:
    """Return whether the eye is outside the box around an object's mesh."""
    low, high = mesh.bounds.astype(np.float64)
    local = instance.object_from_world[:3, :3] @ eye + instance.object_from_world[:3, 3]
    return bool(np.any(local < low) or np.any(local > high))


class GBufferPass:
    """Owner of the vertex buffers and of the outlines of curved lights.

    ``uploads`` counts fillings of meshes and of light shapes, triangles or curves.
    """

    def __init__(self, ctx: moderngl.Context, programs: Programs) -> None:
        self._ctx = ctx
        self._programs = programs
        self._meshes: dict[str, tuple[Mesh, _Vertices]] = {}
        self._instances: dict[SceneObject, _Instance] = {}
        self._tangents = False
        self._shapes: _Vertices | None = None
        self._shape_counts = (0, 0)
        self._curved: tuple[CurvedShape, ...] = ()
        self._outlines = TexelStorage(ctx, "outline", "Outlines")
        self._outlines_held: tuple[Outline, ...] = ()
        self._triangle = FullScreenTriangle(ctx)
        self.uploads = {"meshes": 0, "light shapes": 0}

    @property
    def has_tangents(self) -> bool:
        """Whether objects are held, and drawn, with their tangents."""
        return self._tangents

    def set_objects(self, objects: Sequence[SceneObject], tangents: bool) -> None:
        """Hold the meshes of ``objects`` and no others, with their tangents if asked for.

        Raises
        ------
        InputError
            If a mesh cannot be loaded; what was held stays.
        """
        meshes = load_meshes(objects)
        instances = {item: self._instances.get(item) or _instance(item) for item in objects}
        for name in list(self._meshes):
            if self._meshes[name][0] is not meshes.get(name) or self._tangents != tangents:
                self._meshes.pop(name)[1].release()
        for name, mesh in meshes.items():
            if name not in self._meshes:
                parts = [mesh.positions, mesh.normals, *([mesh.tangents] if tangents else [])]
                data = np.hstack(parts, dtype=np.float32)
                indices = mesh.indices.astype(np.uint32).tobytes()
                vertices = _Vertices(
                    self._ctx, data.tobytes(), " ".join(["3f"] * len(parts)), indices
                )
                self._meshes[name] = (mesh, vertices)
                self.uploads["meshes"] += 1
        self._instances = instances
        self._tangents = tangents

    def set_lights(self, lights: Sequence[AreaLight]) -> None:
        """Hold the triangles, or the curves, of the visible ones of ``lights``."""
        if self._shapes is not None:
            self._shapes.release()
            self._shapes = None
        shapes = pack_light_triangles(lights)
        if len(shapes.vertices):
            self._shapes = _Vertices(self._ctx, shapes.vertices.tobytes(), "3f 3f 1f")
            self._shape_counts = (shapes.one_sided, len(shapes.vertices) - shapes.one_sided)
            self.uploads["light shapes"] += 1
        self._set_curves(lights)

    def _set_curves(self, lights: Sequence[AreaLight]) -> None:
        texels, self._curved = pack_light_curves(lights)
        if not self._curved:
            self._drop_curves()
            return
        # A light that moves keeps its curves: they do not depend on its plane.
        outlines = tuple(lights[-1 - shape.id].outline for shape in self._curved)
        if outlines != self._outlines_held:
            self._outlines.update(texels, 0)
            self._outlines_held = outlines
            self.uploads["light shapes"] += 1

    def _drop_curves(self) -> None:
        self._outlines.release()
        self._outlines_held = ()
        self._curved = ()
        self._triangle.release()

    def draw(
        self,
        target: moderngl.Framebuffer,
        frame: CameraFrame,
        window: tuple[float, float, float, float] = WHOLE_PICTURE,
    ) -> None:
        """Draw what is held into ``target``, seen by ``frame``.

        ``window`` is (scale x, scale y, offset x, offset y) of the normalised
        device coordinates: which part of the picture the target shows.
        """
        ctx = begin_pass(target, target.size, depth=True)
        target.clear(0.0, 0.0, 0.0, 0.0, depth=1.0)
        clip_from_world = frame.clip_from_world()
        if self._instances:
            program = self._programs.get(objects_spec(self._tangents))
            set_uniform(program, "clip_window", window)
            for index, instance in enumerate(self._instances.values()):
                clip_from_object = clip_from_world @ instance.world_from_object
                write_uniform(program, "clip_from_object", clip_from_object)
                write_uniform(program, "world_from_object_normal", instance.normal)
                if self._tangents:
                    linear = instance.world_from_object[:3, :3]
                    write_uniform(program, "world_from_object", linear)
                ctx.front_face = "cw" if instance.mirrors else "ccw"
                set_uniform(program, "object_id", float(index))
                mesh, vertices = self._meshes[instance.mesh]
                # At a silhouette a sample may hit the far side by a rounding, whose normal,
                # turned to the viewer, reflects what is behind the object.
                if mesh.is_closed and _is_outside(frame.eye, instance, mesh):
                    ctx.enable(moderngl.CULL_FACE)
                else:
                    ctx.disable(moderngl.CULL_FACE)
                vertices.array(program).render()
            ctx.front_face = "ccw"
        if self._shapes is not None:
            program = self._programs.get(LIGHTS)
            set_uniform(program, "clip_window", window)
            write_uniform(program, "clip_from_world", clip_from_world)
            array = self._shapes.array(program)
            one_sided, two_sided = self._shape_counts
            if one_sided:
                ctx.enable(moderngl.CULL_FACE)
                array.render(vertices=one_sided)
            if two_sided:
                ctx.disable(moderngl.CULL_FACE)
                array.render(vertices=two_sided, first=one_sided)
        if self._curved:
            self._draw_curves(target.size, frame, window)

    def _draw_curves(
        self,
        size: tuple[int, int],
        frame: CameraFrame,
        window: tuple[float, float, float, float],
    ) -> None:
        """Draw every curved light that shows a side, one triangle each."""
        self._ctx.disable(moderngl.CULL_FACE)
        program = self._programs.get(CURVED_LIGHTS)
        self._outlines.bind(program, OUTLINE_UNIT)
        set_uniform(program, "clip_window", window)
        set_uniform(program, "middle", (0.5 * size[0], 0.5 * size[1]))
        clip_from_world = frame.clip_from_world()
        for shape in self._curved:
            side = shape.faces(frame.eye)
            if not (side > 0.0 or (side < 0.0 and shape.two_sided)):
                continue
            corners = clip_from_world @ np.vstack([shape.corners().T, np.ones(3)])
            write_uniform(program, "clip_corners", corners)
            write_uniform(program, "box_from_pixel", shape.box_from_pixel(frame, window, size))
            set_uniform(program, "normal_ws", tuple(side * shape.normal))
            set_uniform(program, "light_id", float(shape.id))
            set_uniform(program, "first_texel", shape.first)
            set_uniform(program, "band_count", shape.bands)
            self._triangle.draw(program)

    def allocated(self) -> dict[str, int]:
        """Return the bytes of every buffer held, by name."""
        held = {f"mesh {name}": vertices.bytes for name, (_, vertices) in self._meshes.items()}
        if self._shapes is not None:
            held["light shapes"] = self._shapes.bytes
        if self._curved:
            held["light curves"] = self._outlines.bytes
        return held

    def release(self) -> None:
        """Release every GPU object."""
        for _, vertices in self._meshes.values():
            vertices.release()
        self._meshes.clear()
        self._instances = {}
        if self._shapes is not None:
            self._shapes.release()
            self._shapes = None
        self._drop_curves()
