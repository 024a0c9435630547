"""Make the models of this folder: ``python assets/models/convert.py``.

Reads ``teapot-1.0.0.tgz`` and ``bunny-1.0.1.tgz`` (``npm pack teapot@1.0.0
bunny@1.0.1``) from the current folder and writes ``teapot.glb``, ``bunny.glb``
and ``knot.glb`` beside this file. Every model stands on y = 0, centred on the
y axis, +y up, and is 1 m tall; every vertex has a smooth unit normal.

Teapot
    The package holds Newell's 32 bicubic patches sampled 5 by 5. Twenty-five
    samples determine sixteen control points, so least squares gives the
    patches back (largest residual 2e-6 of a 31-unit model); they are sampled
    again, 17 by 17, with the normals of the surface itself. The lid is widened
    by 14/13, so that it meets the rim instead of leaving the historical gap.
Bunny
    The package's 5,000-triangle scan has open holes in its base. Each is
    closed with a fan, the faces are oriented to the outside, and one step of
    Loop subdivision smooths the facets away.
Knot
    A tube of round section along a trefoil, written by formula.
"""

from __future__ import annotations

import json
import struct
import tarfile
from math import comb, pi
from pathlib import Path
from typing import TypeAlias

import numpy as np
import trimesh

Mesh: TypeAlias = tuple[np.ndarray, np.ndarray, np.ndarray]
"""Vertices (n, 3), unit normals (n, 3), faces (m, 3)."""

PATCH_SAMPLES = 5
"""Samples along a side of a patch in the npm package."""

PATCH_OUTPUT = 17
"""Samples along a side of a patch in the file written here."""


def read_package(archive: str, member: str) -> tuple[np.ndarray, np.ndarray]:
    """Return ``positions`` (n, 3) float64 and ``cells`` (m, 3) int64 of a CommonJS mesh."""
    with tarfile.open(archive) as tar:
        stream = tar.extractfile(member)
        if stream is None:
            raise SystemExit(f"{archive}: {member} is not a file")
        text = stream.read().decode()
    arrays = []
    for key in ("positions", "cells"):
        start = text.index("[", text.index(f"exports.{key}"))
        arrays.append(np.array(json.JSONDecoder().raw_decode(text, start)[0]))
    return arrays[0].astype(np.float64), arrays[1].astype(np.int64)


def bernstein(t: np.ndarray) -> np.ndarray:
    """Return the cubic Bernstein polynomials at t (n,), as (n, 4)."""
    return np.stack([comb(3, k) * t**k * (1.0 - t) ** (3 - k) for k in range(4)], axis=-1)


def bernstein_derivative(t: np.ndarray) -> np.ndarray:
    """Return the derivatives of `bernstein` at t (n,), as (n, 4)."""
    quadratic = np.stack([comb(2, k) * t**k * (1.0 - t) ** (2 - k) for k in range(3)], axis=-1)
    zero = np.zeros_like(quadratic[:, :1])
    return 3.0 * (np.hstack([zero, quadratic]) - np.hstack([quadratic, zero]))


def patch_grids(positions: np.ndarray) -> np.ndarray:
    """Return the samples as (32, 5, 5, 3).

    Vertices appear in the order in which the package's tessellation meets
    them, quad by quad. A patch that ends in a pole has one vertex fewer,
    because its first quad there is a triangle.
    """
    first_two_rows = [(0, 0), (1, 0), (1, 1), (0, 1)]
    first_two_rows += [(i, j) for j in range(2, PATCH_SAMPLES) for i in (1, 0)]
    later_rows = [(i, j) for i in range(2, PATCH_SAMPLES) for j in range(PATCH_SAMPLES)]
    regular = first_two_rows + later_rows
    pole_last = [ij for ij in regular if ij != (0, 4)]
    pole_first = [(1, 1), (0, 1), (1, 0), (1, 2), (0, 2), (1, 3), (0, 3), (1, 4), (0, 4)]
    for i in range(2, PATCH_SAMPLES):
        pole_first += [(i, 1), (i, 0), (i, 2), (i, 3), (i, 4)]
    orders = [regular] * 12 + [pole_last] * 4 + [regular] * 8 + [pole_first] * 4 + [regular] * 4

    grids = np.full((len(orders), PATCH_SAMPLES, PATCH_SAMPLES, 3), np.nan)
    start = 0
    for grid, order in zip(grids, orders, strict=True):
        for offset, (i, j) in enumerate(order):
            grid[i, j] = positions[start + offset]
        start += len(order)
        if order is pole_last:
            grid[0, 4] = grid[1, 4]
        if order is pole_first:
            grid[0, 0] = grid[1, 0]
    if start != len(positions) or not np.isfinite(grids).all():
        raise SystemExit("teapot: the package is not the one that this script knows")
    return grids


def patch_normals(controls: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Return unnormalised normals (p, n, n, 3) of patches (p, 4, 4, 3) at t x t, t (n,)."""
    value, slope = bernstein(t), bernstein_derivative(t)
    along_i = np.einsum("ia,jb,pabc->pijc", slope, value, controls)
    along_j = np.einsum("ia,jb,pabc->pijc", value, slope, controls)
    return np.cross(along_i, along_j)


def teapot(positions: np.ndarray) -> Mesh:
    """Return the Utah teapot from the package's samples (792, 3)."""
    grids = patch_grids(positions)
    basis = bernstein(np.linspace(0.0, 1.0, PATCH_SAMPLES))
    inverse = np.linalg.pinv(basis)
    controls = np.einsum("ai,bj,pijc->pabc", inverse, inverse, grids)
    residual = np.abs(np.einsum("ia,jb,pabc->pijc", basis, basis, controls) - grids).max()
    if residual > 1e-5:
        raise SystemExit(f"teapot: the samples are no bicubic patches (residual {residual:.1e})")
    controls = np.round(controls, 4)

    axis = grids[0, -1, 0, 0]  # x of the axis of revolution
    controls[24:, ..., 0] = axis + (controls[24:, ..., 0] - axis) * 14 / 13
    controls[24:, ..., 2] *= 14 / 13

    t = np.linspace(0.0, 1.0, PATCH_OUTPUT)
    value = bernstein(t)
    points = np.einsum("ia,jb,pabc->pijc", value, value, controls)
    normals = patch_normals(controls, t)
    # At a pole one derivative vanishes: take the normal a hair inside.
    length = np.linalg.norm(normals, axis=-1, keepdims=True)
    normals = np.where(length > 1e-3, normals, patch_normals(controls, np.clip(t, 1e-4, 1 - 1e-4)))
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)

    n = PATCH_OUTPUT
    corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    quads = np.stack([corner, corner + n, corner + n + 1, corner + 1], axis=-1)
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [2, 3, 0]]])
    faces = (faces[None] + np.arange(len(points))[:, None, None] * n * n).reshape(-1, 3)
    vertices = points.reshape(-1, 3)
    edges = vertices[faces[:, 1:]] - vertices[faces[:, :1]]
    faces = faces[np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=-1) > 1e-9]
    return vertices, normals.reshape(-1, 3), faces


def close_holes(faces: np.ndarray, vertices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return vertices and faces with every boundary loop closed by a fan about its centre."""
    directed = {(int(a), int(b)) for f in faces for a, b in zip(f, np.roll(f, -1), strict=True)}
    successor = {b: a for a, b in directed if (b, a) not in directed}
    new_vertices, new_faces = list(vertices), list(faces)
    while successor:
        start, current = successor.popitem()
        loop = [start]
        while current != start:
            loop.append(current)
            current = successor.pop(current)
        centre = len(new_vertices)
        new_vertices.append(vertices[loop].mean(axis=0))
        new_faces += [
            np.array([a, b, centre]) for a, b in zip(loop, loop[1:] + loop[:1], strict=True)
        ]
    return np.array(new_vertices), np.array(new_faces)


def bunny(positions: np.ndarray, cells: np.ndarray) -> Mesh:
    """Return the Stanford bunny, closed, outward and subdivided once."""
    vertices, faces = close_holes(cells, positions)
    if trimesh.Trimesh(vertices, faces, process=False).volume < 0.0:
        faces = faces[:, ::-1]
    vertices, faces = trimesh.remesh.subdivide_loop(vertices, faces, iterations=1)
    fine_vertices, fine_faces = trimesh.remesh.subdivide_loop(vertices, faces, iterations=1)
    fine = trimesh.Trimesh(fine_vertices, fine_faces, process=False)
    normals = fine.vertex_normals[: len(vertices)]  # old vertices come first
    return vertices, normals, faces


def knot(around: int = 256, section: int = 28, radius: float = 0.42) -> Mesh:
    """Return a tube of the given radius along the trefoil, standing upright."""
    t = np.arange(around) * (2.0 * pi / around)

    def curve(t: np.ndarray) -> np.ndarray:
        return np.stack(
            [np.sin(t) + 2.0 * np.sin(2 * t), np.cos(t) - 2.0 * np.cos(2 * t), -np.sin(3 * t)], -1
        )

    step = 1e-4
    centre = curve(t)
    tangent = curve(t + step) - curve(t - step)
    tangent /= np.linalg.norm(tangent, axis=-1, keepdims=True)
    bend = curve(t + step) - 2.0 * centre + curve(t - step)
    binormal = np.cross(tangent, bend)  # the trefoil bends everywhere
    binormal /= np.linalg.norm(binormal, axis=-1, keepdims=True)
    normal = np.cross(binormal, tangent)
    phi = np.arange(section) * (2.0 * pi / section)
    normals = (
        np.cos(phi)[None, :, None] * normal[:, None]
        + np.sin(phi)[None, :, None] * binormal[:, None]
    )
    vertices = centre[:, None] + radius * normals
    i, j = np.meshgrid(np.arange(around), np.arange(section), indexing="ij")
    i1, j1 = (i + 1) % around, (j + 1) % section
    quads = np.stack([i * section + j, i1 * section + j, i1 * section + j1, i * section + j1], -1)
    quads = quads.reshape(-1, 4)
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [2, 3, 0]]])
    return vertices.reshape(-1, 3), normals.reshape(-1, 3), faces


def stand(mesh: Mesh) -> Mesh:
    """Return the mesh 1 m tall on y = 0, faces turned to the side of the normals."""
    vertices, normals, faces = mesh
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    middle = np.array([(low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2])
    vertices = (vertices - middle) / (high[1] - low[1])
    corners = vertices[faces]
    face_normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    against = np.einsum("fc,fkc->f", face_normals, normals[faces]) < 0.0
    return vertices, normals, np.where(against[:, None], faces[:, ::-1], faces)


def write_glb(path: Path, mesh: Mesh) -> None:
    """Write positions, normals and 16-bit indices as binary glTF 2.0."""
    vertices, normals, faces = mesh
    positions = vertices.astype("<f4")
    blocks = [positions.tobytes(), normals.astype("<f4").tobytes(), faces.astype("<u2").tobytes()]
    blocks[2] += b"\0" * (-len(blocks[2]) % 4)
    starts = [0, len(blocks[0]), len(blocks[0]) + len(blocks[1])]
    n = len(vertices)
    bounds = {"min": positions.min(axis=0).tolist(), "max": positions.max(axis=0).tolist()}
    document = {
        "asset": {"version": "2.0", "generator": "assets/models/convert.py"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": path.stem, "mesh": 0}],
        "meshes": [
            {"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1}, "indices": 2, "mode": 4}]}
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": n, "type": "VEC3", **bounds},
            {"bufferView": 1, "componentType": 5126, "count": n, "type": "VEC3"},
            {"bufferView": 2, "componentType": 5123, "count": faces.size, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": start, "byteLength": len(block), "target": target}
            for start, block, target in zip(starts, blocks, (34962, 34962, 34963), strict=True)
        ],
        "buffers": [{"byteLength": sum(map(len, blocks))}],
    }
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    body = b"".join(blocks)
    header = struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(text) + 8 + len(body))
    chunks = [struct.pack("<I4s", len(text), b"JSON"), text]
    chunks += [struct.pack("<I4s", len(body), b"BIN\0"), body]
    path.write_bytes(header + b"".join(chunks))


def main() -> None:
    folder = Path(__file__).resolve().parent
    teapot_positions, _ = read_package("teapot-1.0.0.tgz", "package/teapot.js")
    models = {
        "teapot": teapot(teapot_positions),
        "bunny": bunny(*read_package("bunny-1.0.1.tgz", "package/index.js")),
        "knot": knot(),
    }
    for name, mesh in models.items():
        path = folder / f"{name}.glb"
        write_glb(path, stand(mesh))
        print(f"{path.name}: {len(mesh[0])} vertices, {len(mesh[2])} triangles")


if __name__ == "__main__":
    main()
