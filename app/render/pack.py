"""Scene data as the GPU reads it: arrays of vec4 "texels", and vertices of visible lights.

Lights and materials are plain vec4 arrays. In a uniform block std140 gives such
an array a stride of 16 bytes, the same as rows of an RGBA32F texture, so one
array serves both storages. `LIGHT_HEADER` and `MATERIAL_RECORD` name the members;
``shaders/common/light_data.glsl`` and ``shaders/common/material.glsl`` read them.

Everything is computed in float64 and rounded once.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.errors import InputError
from app.outline import resolve, triangulate
from app.render.caching import ByteCache
from app.scene import AreaLight, Material, Plane

FloatArray = NDArray[np.float64]

LIGHT_HEADER = np.dtype(
    [
        ("origin", "<f4", 3),
        ("first_edge", "<f4"),
        ("u", "<f4", 3),
        ("edge_count", "<f4"),
        ("v", "<f4", 3),
        ("radius", "<f4"),
        ("n", "<f4", 3),
        ("two_sided", "<f4"),
        ("origin_low", "<f4", 3),
        ("red", "<f4"),
        ("u_low", "<f4", 3),
        ("green", "<f4"),
        ("v_low", "<f4", 3),
        ("blue", "<f4"),
        ("n_low", "<f4", 3),
        ("unused", "<f4"),
    ]
)
"""Eight texels. Indices and counts are floats, exact up to 2^24; ``low`` is what
rounding to float32 took."""

MATERIAL_RECORD = np.dtype(
    [
        ("diffuse", "<f4", 3),
        ("rotation", "<f4"),
        ("f0", "<f4", 3),
        ("unused", "<f4"),
        ("alpha", "<f4", 2),
        ("unused_2", "<f4", 2),
    ]
)
"""Three texels, one record per object."""

LIGHT_VERTEX = np.dtype([("position", "<f4", 3), ("normal", "<f4", 3), ("id", "<f4")])
"""A vertex of a visible light: world position, emitting normal, G-buffer id."""

TEXELS_PER_LIGHT = LIGHT_HEADER.itemsize // 16
TEXELS_PER_MATERIAL = MATERIAL_RECORD.itemsize // 16
TEXELS_PER_EDGE = 2
MAX_INDEX = 2**24
"""Texel indices are stored as float32."""
CACHED_BYTES = 16 * 2**20
"""Of each of the three things that are kept of every light."""
SMALLEST_NUMBER = 1e-12
"""Lengths [m] and scales up to here would vanish from products of three."""
LARGEST_NUMBER = 1e12
"""Lengths [m] and radiance from here on would overflow float32 in products of three."""


@dataclass(frozen=True, eq=False)
class LightGeometry:
    """One light in an orthonormal basis of its plane.

    Attributes
    ----------
    origin : (3,) float64
        Area centroid of the outline, world.
    u, v : (3,) float64
        Orthonormal, u x v is the emitting normal.
    edges : (n, 4) float64
        (a.s, a.t, b.s, b.t) about the origin [m], interior on the left.
    radius : float
        Bounding radius about the origin [m].
    """

    origin: FloatArray
    u: FloatArray
    v: FloatArray
    edges: FloatArray
    radius: float


def plane_basis(plane: Plane) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return (u, v, to_metres): an orthonormal basis and the (2, 2) map from (s, t) to metres."""
    u = np.array(plane.u, dtype=np.float64)
    v = np.array(plane.v, dtype=np.float64)
    length = np.linalg.norm(u)
    e1 = u / length
    normal = np.cross(e1, v / np.linalg.norm(v))
    normal /= np.linalg.norm(normal)
    e2 = np.cross(normal, e1)
    return e1, e2, np.array([[length, v @ e1], [0.0, v @ e2]])


def light_geometry(light: AreaLight) -> LightGeometry:
    """Return a light's geometry; one whose outline is empty has no edges.

    Raises
    ------
    InputError
        If its lengths or radiance do not fit into float32.
    """
    return _geometries(light)


def _checked_geometry(light: AreaLight) -> LightGeometry:
    for name, axis in (("u", light.plane.u), ("v", light.plane.v)):
        if not SMALLEST_NUMBER < math.hypot(*axis) < LARGEST_NUMBER:
            raise InputError(
                f"light '{light.name}': its plane's {name} is {math.hypot(*axis):g} long, "
                f"expected between {SMALLEST_NUMBER:g} and {LARGEST_NUMBER:g} metres"
            )
    geometry = _light_geometry(light)
    largest = max(float(np.abs(geometry.origin).max()), geometry.radius, *light.radiance)
    if not largest < LARGEST_NUMBER:
        raise InputError(
            f"light '{light.name}': it reaches {largest:g}, expected lengths in metres and "
            f"radiance below {LARGEST_NUMBER:g}"
        )
    return geometry


def _light_geometry(light: AreaLight) -> LightGeometry:
    e1, e2, to_metres = plane_basis(light.plane)
    loops = [loop @ to_metres.T for loop in resolve(light.outline)]
    if not loops:
        return LightGeometry(np.array(light.plane.origin), e1, e2, np.zeros((0, 4)), 0.0)
    centroid = _centroid(loops)
    edges = np.concatenate(
        [np.hstack([loop, np.roll(loop, -1, axis=0)]) - np.tile(centroid, 2) for loop in loops]
    )
    radius = float(np.sqrt((edges[:, :2] ** 2).sum(axis=1).max()))
    origin = np.array(light.plane.origin) + centroid[0] * e1 + centroid[1] * e2
    return LightGeometry(origin, e1, e2, edges, radius)


def _centroid(loops: Sequence[FloatArray]) -> FloatArray:
    """Return the area centroid of loops whose areas add up to more than zero."""
    pivot = loops[0][0]
    area = 0.0
    moment = np.zeros(2)
    for loop in loops:
        a = loop - pivot
        b = np.roll(a, -1, axis=0)
        cross = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
        area += float(cross.sum())
        moment += (cross[:, None] * (a + b)).sum(axis=0)
    return np.asarray(pivot + moment / (3.0 * area))


def pack_lights(lights: Sequence[AreaLight]) -> NDArray[np.float32]:
    """Return (n, 4) float32 texels: all headers, then all edges.

    A light without radiance keeps its header and gets no edges: nothing to integrate.
    """
    packed = [_packed(light) for light in lights]
    header = np.concatenate([np.zeros(0, LIGHT_HEADER), *(record for record, _ in packed)])
    counts = np.array([len(edges) for _, edges in packed], dtype=np.int64)
    before = np.cumsum(counts) - counts
    header["first_edge"] = TEXELS_PER_LIGHT * len(lights) + before
    texels = header.view(np.float32).reshape(-1, 4)
    return np.concatenate([texels, *(edges for _, edges in packed)])


def _packed_light(light: AreaLight) -> tuple[NDArray[np.void], NDArray[np.float32]]:
    """Return a header (1,), still without its first edge, and the texels (2 edges, 4)."""
    geometry = light_geometry(light)
    edges = geometry.edges if any(light.radiance) else geometry.edges[:0]
    record = np.zeros(1, dtype=LIGHT_HEADER)
    for name, vector in (
        ("origin", geometry.origin),
        ("u", geometry.u),
        ("v", geometry.v),
        ("n", np.cross(geometry.u, geometry.v)),
    ):
        record[name], record[f"{name}_low"] = _split(vector)
    record["edge_count"] = len(edges)
    # Rounded up: the shader skips what this circle says is below the surface.
    record["radius"] = np.float32(geometry.radius) * np.float32(1.0 + 1e-6)
    record["two_sided"] = light.two_sided
    record["red"], record["green"], record["blue"] = light.radiance
    return record, np.stack(_split(edges), axis=1).reshape(-1, 4)


def _split(values: FloatArray) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return ``values`` as an unevaluated sum of two float32 arrays."""
    high = values.astype(np.float32)
    return high, (values - high).astype(np.float32)


def pack_materials(materials: Sequence[Material]) -> NDArray[np.float32]:
    """Return (3 n, 4) float32 texels, one record per object's material."""
    records = np.zeros(len(materials), dtype=MATERIAL_RECORD)
    for record, material in zip(records, materials, strict=True):
        record["diffuse"] = material.diffuse
        record["rotation"] = material.rotation
        record["f0"] = material.f0
        record["alpha"] = material.alpha
    return records.view(np.float32).reshape(-1, 4)


@dataclass(frozen=True, eq=False)
class LightShapes:
    """Triangles of the visible lights, counter-clockwise seen from the emitting side.

    ``vertices[:one_sided]`` show that side only, the rest both sides.
    """

    vertices: NDArray[np.void]
    one_sided: int


def pack_light_shapes(lights: Sequence[AreaLight]) -> LightShapes:
    """Return the triangles of all visible lights; light i has the id -1 - i."""
    one: list[NDArray[np.void]] = []
    two: list[NDArray[np.void]] = []
    for index, light in enumerate(lights):
        if light.visible:
            (two if light.two_sided else one).append(_triangles(light, index))
    vertices = np.concatenate([np.zeros(0, dtype=LIGHT_VERTEX), *one, *two])
    return LightShapes(vertices, sum(len(part) for part in one))


def _light_triangles(light: AreaLight, index: int) -> NDArray[np.void]:
    points, triangles = triangulate(light.outline)
    e1, e2, to_metres = plane_basis(light.plane)
    plane = points @ to_metres.T
    positions = np.array(light.plane.origin) + plane[:, :1] * e1 + plane[:, 1:] * e2
    vertices = np.zeros(3 * len(triangles), dtype=LIGHT_VERTEX)
    vertices["position"] = positions[_counter_clockwise(points, triangles).reshape(-1)]
    vertices["normal"] = np.cross(e1, e2)
    vertices["id"] = -1 - index
    return vertices


def _counter_clockwise(points: FloatArray, triangles: NDArray[np.int32]) -> NDArray[np.int32]:
    a, b, c = (points[triangles[:, i]] for i in range(3))
    area = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    return np.where(area[:, None] < 0.0, triangles[:, ::-1], triangles)


# Hashing and per-entry overhead are worth about 1 KB.
_geometries = ByteCache(_checked_geometry, lambda g: 1024 + g.edges.nbytes, CACHED_BYTES)
_packed = ByteCache(_packed_light, lambda p: 1024 + p[1].nbytes, CACHED_BYTES)
_triangles = ByteCache(_light_triangles, lambda t: 1024 + t.nbytes, CACHED_BYTES)
