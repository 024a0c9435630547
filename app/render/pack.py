"""Scene data as the GPU reads it: arrays of vec4 "texels".

Lights and materials are plain vec4 arrays. In a uniform block std140 gives such
an array a stride of 16 bytes, the same as rows of an RGBA32F texture, so one
array serves both storages. `LIGHT_HEADER` and `MATERIAL_RECORD` name the members;
``shaders/common/light_data.glsl`` and ``shaders/common/material.glsl`` read them.

Everything is computed in float64 and rounded once.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.caching import ByteCache
from app.curves import bounds, derivative, evaluate, is_straight, line_as_cubic
from app.errors import InputError
from app.outline import boundary, resolve
from app.render.contour_tree import TreeNodes, contour_tree, curve_list
from app.scene import AreaLight, BezierContour, Material, Plane

FloatArray = NDArray[np.float64]

LIGHT_HEADER = np.dtype(
    [
        ("origin", "<f4", 3),
        ("first_part", "<f4"),
        ("u", "<f4", 3),
        ("part_count", "<f4"),
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
        ("picture", "<f4"),
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

TEXELS_PER_LIGHT = LIGHT_HEADER.itemsize // 16
TEXELS_PER_MATERIAL = MATERIAL_RECORD.itemsize // 16
TEXELS_PER_EDGE = 2
TEXELS_PER_PICTURE = 5
TEXELS_PER_NODE = 4
MAX_INDEX = 2**24
"""Texel indices are stored as float32."""
CurveForm: TypeAlias = Literal["tree", "whole"] | int
"""How curves are packed: cut into a tree (`app.render.contour_tree`), each as it is, or
as so many edges."""

CACHED_BYTES = 16 * 2**20
"""Of each of the three things that are kept of every light."""
SMALLEST_AREA = 1e-30
"""[m^2] Added to an inner node's area, whose sign says that it is one."""
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
    loops : tuple of (k, 2) or (k, 4, 2) float64
        Simple closed loops about the origin [m], interior on the left: vertices,
        or cubics where the outline has curves.
    radius : float
        Bounding radius about the origin [m].
    """

    origin: FloatArray
    u: FloatArray
    v: FloatArray
    loops: tuple[FloatArray, ...]
    radius: float

    @property
    def parts(self) -> int:
        """Edges, straight or curved."""
        return sum(len(loop) for loop in self.loops)

    @property
    def bytes(self) -> int:
        return sum(loop.nbytes for loop in self.loops)


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


def is_curved(light: AreaLight) -> bool:
    """Return whether a light's outline has Bézier contours."""
    return any(isinstance(contour, BezierContour) for contour in light.outline.contours)


def has_curves(lights: Sequence[AreaLight]) -> bool:
    """Return whether some light that shines has curves."""
    return any(any(light.radiance) and is_curved(light) for light in lights)


def _light_geometry(light: AreaLight) -> LightGeometry:
    e1, e2, to_metres = plane_basis(light.plane)
    inside = boundary(light.outline) if is_curved(light) else resolve(light.outline)
    loops = [loop @ to_metres.T for loop in inside]
    if not loops:
        return LightGeometry(np.array(light.plane.origin), e1, e2, (), 0.0)
    centroid = _centroid(loops)
    about = tuple(loop - centroid for loop in loops)
    radius = max(float(np.sqrt((loop**2).sum(axis=-1).max())) for loop in about)
    origin = np.array(light.plane.origin) + centroid[0] * e1 + centroid[1] * e2
    return LightGeometry(origin, e1, e2, about, radius)


MOMENT_NODES, MOMENT_WEIGHTS = np.polynomial.legendre.leggauss(5)
"""Exact for the moments of cubics, whose integrands have degree 8."""


def _centroid(loops: Sequence[FloatArray]) -> FloatArray:
    """Return the area centroid of loops whose areas add up to more than zero."""
    pivot = loops[0].reshape(-1, 2)[0]
    area = 0.0
    moment = np.zeros(2)
    for loop in loops:
        if loop.ndim == 3:
            curves = (loop - pivot)[:, None]
            t = 0.5 + 0.5 * MOMENT_NODES
            middle, way = evaluate(curves, t), derivative(curves, t)
            weights = 0.5 * MOMENT_WEIGHTS
        else:
            a = (loop - pivot)[:, None]
            way = np.roll(a, -1, axis=0) - a
            # Over an edge p varies linearly and p x p' not at all: its middle will do.
            middle, weights = a + 0.5 * way, np.ones(1)
        cross = (middle[..., 0] * way[..., 1] - middle[..., 1] * way[..., 0]) * weights
        area += float(cross.sum())
        moment += np.einsum("ij,ijk->k", cross, middle)
    return np.asarray(pivot + moment / (1.5 * area))


def edges_of(loops: Sequence[FloatArray]) -> FloatArray:
    """Return the edges (n, 4) of polygons: (a.s, a.t, b.s, b.t)."""
    return np.concatenate(
        [np.zeros((0, 4)), *(np.hstack([loop, np.roll(loop, -1, axis=0)]) for loop in loops)]
    )


def pack_lights(
    lights: Sequence[AreaLight],
    curves: CurveForm | None = None,
    bounded: bool = False,
    pictures: Mapping[int, NDArray[np.void]] | None = None,
) -> NDArray[np.float32]:
    """Return (n, 4) float32 texels: all headers, then all edges, or all nodes, then pictures.

    ``pictures`` are records of `app.render.picture_layout` by the index of their light.

    If one light has curves (`has_curves`) every light's outline becomes a tree, so
    that one walk serves all, unless ``curves`` says otherwise. A light without
    radiance keeps its header and gets no outline: nothing to integrate. ``bounded``
    puts a texel before every outline, the rectangle around it (`light_bounds`).
    """
    form: CurveForm = ("tree" if has_curves(lights) else 1) if curves is None else curves
    packed = [_packed_light(light, form) for light in lights]
    header = np.concatenate([np.zeros(0, LIGHT_HEADER), *(record for record, _ in packed)])
    outlines = [parts for _, parts in packed]
    if bounded:
        outlines = [
            np.concatenate([light_bounds(light)[None], parts])
            for light, parts in zip(lights, outlines, strict=True)
        ]
    counts = np.array([len(parts) for parts in outlines], dtype=np.int64)
    before = np.cumsum(counts) - counts
    header["first_part"] = TEXELS_PER_LIGHT * len(lights) + before + int(bounded)
    records = [np.zeros((0, 4), np.float32)]
    texel = TEXELS_PER_LIGHT * len(lights) + int(counts.sum())
    for index, record in (pictures or {}).items():
        header["picture"][index] = texel
        # Stored pictures are relative to their largest value.
        for colour in ("red", "green", "blue"):
            header[colour][index] *= record["largest"][0]
        records.append(record.view(np.float32).reshape(-1, 4))
        texel += len(records[-1])
    texels = header.view(np.float32).reshape(-1, 4)
    return np.concatenate([texels, *outlines, *records])


def light_bounds(light: AreaLight) -> NDArray[np.float32]:
    """Return (least s, least t, greatest s, greatest t) about a light's origin [m], (4,) float32.

    Rounded outwards, so that all of the outline as the shader sees it is inside.
    """
    geometry = light_geometry(light)
    if not geometry.loops:
        return np.zeros(4, np.float32)
    corners = np.concatenate(
        [np.concatenate(bounds(loop)) if loop.ndim == 3 else loop for loop in geometry.loops]
    )
    margin = 1e-6 * geometry.radius
    low, high = corners.min(axis=0) - margin, corners.max(axis=0) + margin
    return np.concatenate([low, high]).astype(np.float32)


def part_count(light: AreaLight, curves: CurveForm) -> int:
    """Return the nodes or edges that a light's outline is packed as."""
    return int(_packed_light(light, curves)[0]["part_count"][0])


Packed = tuple[NDArray[np.void], NDArray[np.float32]]
"""A header (1,), still without its first part, and texels (n, 4)."""


def _pack_light(light: AreaLight, curves: CurveForm) -> Packed:
    if isinstance(curves, int):
        return _pack_edges(light, curves)
    return _pack_nodes(light, contour_tree if curves == "tree" else curve_list)


def _pack_edges(light: AreaLight, per_curve: int) -> Packed:
    geometry = light_geometry(light)
    loops = [
        inscribed(loop, per_curve) if loop.ndim == 3 else loop
        for loop in (geometry.loops if any(light.radiance) else ())
    ]
    edges = edges_of(loops)
    return _header(light, geometry, len(edges)), np.stack(_split(edges), axis=1).reshape(-1, 4)


def inscribed(loop: FloatArray, per_curve: int) -> FloatArray:
    """Return the polygon of a loop of cubics (k, 4, 2) at equal steps of their parameters.

    Straight ones are one edge each.
    """
    t = np.arange(per_curve) / per_curve
    points = evaluate(loop[:, None], t)
    keep = ~is_straight(loop)[:, None] | (np.arange(per_curve) == 0)
    return np.asarray(points[keep])


def _pack_nodes(light: AreaLight, nodes_of: Callable[[Sequence[FloatArray]], TreeNodes]) -> Packed:
    geometry = light_geometry(light)
    if not geometry.loops or not any(light.radiance):
        return _header(light, geometry, 0), np.zeros((0, 4), np.float32)
    curves = [
        loop if loop.ndim == 3 else line_as_cubic(loop, np.roll(loop, -1, axis=0))
        for loop in geometry.loops
    ]
    tree = nodes_of(curves)
    ends = tree.curves[:, [0, 3]].reshape(-1, 4)
    texels = np.zeros((len(ends), TEXELS_PER_NODE, 4), np.float32)
    texels[:, 0], texels[:, 1] = _split(ends)
    texels[:, 2, :2] = tree.disc[:, :2]
    texels[:, 2, 2:] = np.stack([tree.disc[:, 2], tree.area], axis=1) * (1.0 + 1e-6)
    # Handles from their own ends, which they are close to; inner nodes say where
    # their subtree ends by a negative index.
    steps = tree.curves[:, 1:3] - tree.curves[:, [0, 3]]
    texels[:, 3] = steps.reshape(-1, 4)
    inner = ~tree.is_leaf
    texels[inner, 2, 3] = -texels[inner, 2, 3] - np.float32(SMALLEST_AREA)
    texels[inner, 3, 0] = tree.skip[inner]
    texels[inner, 3, 1] = tree.signed_area[inner]
    return _header(light, geometry, len(ends)), texels.reshape(-1, 4)


def _header(light: AreaLight, geometry: LightGeometry, parts: int) -> NDArray[np.void]:
    record = np.zeros(1, dtype=LIGHT_HEADER)
    for name, vector in (
        ("origin", geometry.origin),
        ("u", geometry.u),
        ("v", geometry.v),
        ("n", np.cross(geometry.u, geometry.v)),
    ):
        record[name], record[f"{name}_low"] = _split(vector)
    record["part_count"] = parts
    # Rounded up: the shader skips what this circle says is below the surface.
    record["radius"] = np.float32(geometry.radius) * np.float32(1.0 + 1e-6)
    record["two_sided"] = light.two_sided
    record["red"], record["green"], record["blue"] = light.radiance
    return record


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


# Hashing and per-entry overhead are worth about 1 KB.
_geometries = ByteCache(_checked_geometry, lambda g: 1024 + g.bytes, CACHED_BYTES)
_packed_light = ByteCache(_pack_light, lambda p: 1024 + p[1].nbytes, CACHED_BYTES)
