"""Meshes as arrays: four analytic built-ins, and files read through trimesh.

Everything that the renderer needs is made here, once per mesh: triangles
without degenerate ones, unit normals, and a unit tangent perpendicular to each
normal. Units are metres, +y up; nothing here knows OpenGL.

Normals that a file lacks are made per smoothing group: around a vertex,
triangles belong together while the edges between them bend by less than
`CREASE`, so a scanned bunny is smooth and a box keeps its edges. Tangents
follow the texture coordinates where the file has some; elsewhere they run
along the parallels about +y, as on the built-in sphere, which is continuous
wherever the normal is not vertical.
"""

from __future__ import annotations

import logging
import math
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from app.errors import InputError, expected_one_of, os_reason, require_file
from app.scene import BUILT_IN_MESHES

if TYPE_CHECKING:
    import trimesh

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

MESH_SUFFIXES = (".glb", ".gltf", ".obj", ".ply", ".stl")

CREASE = math.radians(44.0)
"""Edges that bend by more stay sharp; just under a right angle's half, so octagons do too."""

SAME_PLACE = 2.0**20
"""Vertices are one place for smoothing if they agree to this fraction of the extent."""

SPHERE_SECTORS, SPHERE_STACKS = 160, 80
"""The sphere's chords are within 2e-4 radii of it."""

DISC_SECTORS = 256
"""The disc's rim is within 8e-5 radii of the circle."""

LARGEST_COORDINATE = 1e15
"""Positions beyond this lose their squares in float32."""

CACHED_MESHES = 64


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles ready for upload; compared by identity.

    Attributes
    ----------
    positions, normals, tangents : (n, 3) float32, read-only
        Metres in the mesh's own space; normals and tangents unit and
        perpendicular to each other.
    indices : (m, 3) uint32, read-only
        Counter-clockwise seen from outside.
    bounds : (2, 3) float32, read-only
        The lowest and the highest corner of the box around ``positions``.
    is_closed : bool
        Every edge joins two triangles that face out: from outside, nobody sees a
        back face.
    """

    positions: NDArray[np.float32]
    normals: NDArray[np.float32]
    tangents: NDArray[np.float32]
    indices: NDArray[np.uint32]
    bounds: NDArray[np.float32]
    is_closed: bool


def load_mesh(name_or_path: str) -> Mesh:
    """Return a built-in mesh by name, or the merged meshes of a file.

    Files are cached until their modification time or size changes. Every node
    of a glTF scene is transformed and merged.

    Raises
    ------
    InputError
        If the file is missing, unreadable, of another kind, damaged, or holds
        no triangle with an area.
    """
    if name_or_path in BUILT_IN_MESHES:
        return _built_in(name_or_path)
    path = Path(name_or_path)
    check_mesh_path(path)
    try:
        state = path.stat()
        return _from_file(path, state.st_mtime_ns, state.st_size)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({os_reason(error)}), expected a mesh") from error


def check_mesh_path(path: Path) -> None:
    """Raise `InputError` unless ``path`` is an existing file with a known suffix."""
    kinds = ", ".join(MESH_SUFFIXES)
    if path.suffix.lower() not in MESH_SUFFIXES:
        if not path.suffix and not path.exists():
            raise InputError(
                f"{path}: there is no such file and no built-in mesh of that name, "
                + expected_one_of(path.name, BUILT_IN_MESHES)
                + f", or a path to one of {kinds}"
            )
        if not path.is_dir():
            found = f"the suffix '{path.suffix}'" if path.suffix else "no suffix"
            raise InputError(f"{path}: {found} is not a mesh format, expected one of {kinds}")
    require_file(path, f"a mesh file ({kinds})")


# Built-ins


@lru_cache(maxsize=len(BUILT_IN_MESHES))
def _built_in(name: str) -> Mesh:
    return {"plane": _plane, "sphere": _sphere, "disc": _disc, "box": _box}[name]()


def _plane() -> Mesh:
    positions = np.array([[-1, 0, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1]], dtype=np.float64)
    normals = np.tile([0.0, 1.0, 0.0], (4, 1))
    tangents = np.tile([1.0, 0.0, 0.0], (4, 1))
    return _mesh(positions, normals, tangents, np.array([[0, 1, 2], [0, 2, 3]]))


def _sphere() -> Mesh:
    # Azimuth from +z towards +x, so that the tangent is up x normal; a column more
    # than sectors closes the seam, and each pole has one vertex per sector.
    azimuth = np.linspace(0.0, 2.0 * np.pi, SPHERE_SECTORS + 1)
    polar = np.linspace(0.0, np.pi, SPHERE_STACKS + 1)
    azimuth, polar = np.meshgrid(azimuth, polar)
    at_pole = (np.arange(SPHERE_STACKS + 1) % SPHERE_STACKS == 0)[:, None]
    azimuth = np.where(at_pole, azimuth + np.pi / SPHERE_SECTORS, azimuth)
    radius = np.where(at_pole, 0.0, np.sin(polar))
    normals = np.stack((radius * np.sin(azimuth), np.cos(polar), radius * np.cos(azimuth)), -1)
    tangents = np.stack((np.cos(azimuth), np.zeros_like(azimuth), -np.sin(azimuth)), -1)

    corner = np.arange(azimuth.size).reshape(azimuth.shape)
    a, b = corner[:-1, :-1].ravel(), corner[:-1, 1:].ravel()
    c, d = corner[1:, :-1].ravel(), corner[1:, 1:].ravel()
    upper = np.stack((a, c, d), -1)[: SPHERE_SECTORS * (SPHERE_STACKS - 1)]
    lower = np.stack((a, d, b), -1)[SPHERE_SECTORS:]
    flat = normals.reshape(-1, 3)
    return _mesh(flat, flat, tangents.reshape(-1, 3), np.concatenate((upper, lower)))


def _disc() -> Mesh:
    # The azimuthal direction is undefined at the centre: one centre vertex per
    # sector, with the direction of the sector's middle.
    angle = np.linspace(0.0, 2.0 * np.pi, DISC_SECTORS + 1)
    middle = 0.5 * (angle[:-1] + angle[1:])

    def around(azimuth: FloatArray) -> tuple[FloatArray, FloatArray]:
        zero = np.zeros_like(azimuth)
        outward = np.stack((np.sin(azimuth), zero, np.cos(azimuth)), -1)
        return outward, np.stack((np.cos(azimuth), zero, -np.sin(azimuth)), -1)

    rim, rim_tangents = around(angle)
    _, centre_tangents = around(middle)
    positions = np.concatenate((rim, np.zeros((DISC_SECTORS, 3))))
    tangents = np.concatenate((rim_tangents, centre_tangents))
    sector = np.arange(DISC_SECTORS)
    indices = np.stack((sector, sector + 1, DISC_SECTORS + 1 + sector), -1)
    return _mesh(positions, np.tile([0.0, 1.0, 0.0], (len(positions), 1)), tangents, indices)


def _box() -> Mesh:
    positions, normals, tangents = [], [], []
    for axis in range(3):
        for sign in (1.0, -1.0):
            normal = np.zeros(3)
            normal[axis] = sign
            tangent = parallel_tangents(normal[None])[0]
            bitangent = np.cross(normal, tangent)
            for s, t in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
                positions.append(normal + s * tangent + t * bitangent)
                normals.append(normal)
                tangents.append(tangent)
    quad = np.array([[0, 1, 2], [0, 2, 3]])
    indices = (4 * np.arange(6)[:, None, None] + quad).reshape(-1, 3)
    return _mesh(np.array(positions), np.array(normals), np.array(tangents), indices)


def _mesh(
    positions: FloatArray, normals: FloatArray, tangents: FloatArray, indices: IntArray
) -> Mesh:
    """Round to the GPU's types and freeze."""
    rounded = np.ascontiguousarray(positions, dtype=np.float32)
    mesh = Mesh(
        positions=rounded,
        normals=np.ascontiguousarray(normals, dtype=np.float32),
        tangents=np.ascontiguousarray(tangents, dtype=np.float32),
        indices=np.ascontiguousarray(indices, dtype=np.uint32),
        bounds=np.stack((rounded.min(axis=0), rounded.max(axis=0))),
        is_closed=_is_closed(positions, indices),
    )
    for array in (mesh.positions, mesh.normals, mesh.tangents, mesh.indices, mesh.bounds):
        array.setflags(write=False)
    return mesh


def _is_closed(positions: FloatArray, indices: IntArray) -> bool:
    """Return whether triangles bound a volume and face out of it.

    Corners within a millionth of the mesh's size count as one: normals and seams
    split vertices.
    """
    low, high = positions.min(axis=0), positions.max(axis=0)
    grid = np.rint((positions - low) / (1e-6 * max(float((high - low).max()), 1e-30)))
    _, corner = np.unique(grid, axis=0, return_inverse=True)
    triangles = corner.reshape(-1)[indices]
    a, b = triangles.reshape(-1), np.roll(triangles, -1, axis=1).reshape(-1)
    count = len(positions)
    edges, times = np.unique(a * count + b, return_counts=True)
    if np.any(times > 1) or not np.array_equal(edges, np.unique(b * count + a)):
        return False
    p, q, r = (positions[indices[:, i]] for i in range(3))
    return bool(np.sum(p * np.cross(q, r)) > 0.0)


# Files


@lru_cache(maxsize=CACHED_MESHES)
def _from_file(path: Path, mtime_ns: int, size: int) -> Mesh:
    """Read, check and merge a mesh file; time and size are there for the cache's key."""
    del mtime_ns
    if size == 0:
        raise InputError(f"{path}: the file is empty, expected a mesh")
    pieces = [piece for piece in _pieces(path) if len(piece.faces)]
    if not pieces:
        raise InputError(f"{path}: no triangles were found, expected at least one")
    parts = [_finished(piece, path) for piece in pieces]
    parts = [part for part in parts if len(part[3])]
    if not parts:
        raise InputError(f"{path}: every triangle has zero area, expected at least one with area")
    offsets = np.cumsum([0] + [len(part[0]) for part in parts[:-1]])
    return _mesh(
        np.concatenate([part[0] for part in parts]),
        np.concatenate([part[1] for part in parts]),
        np.concatenate([part[2] for part in parts]),
        np.concatenate([part[3] + start for part, start in zip(parts, offsets, strict=True)]),
    )


@dataclass(frozen=True, eq=False)
class _Piece:
    """One node's triangles in the file's space, as found."""

    positions: FloatArray
    faces: IntArray
    normals: FloatArray | None
    uv: FloatArray | None


def _pieces(path: Path) -> list[_Piece]:
    scene = _read(path)
    pieces = []
    for node in scene.graph.nodes_geometry:
        matrix, name = scene.graph[node]
        geometry = scene.geometry[name]
        if not hasattr(geometry, "faces"):
            continue  # points and lines
        linear = np.asarray(matrix, dtype=np.float64)[:3, :3]
        offset = np.asarray(matrix, dtype=np.float64)[:3, 3]
        faces = np.asarray(geometry.faces, dtype=np.int64).reshape(-1, 3)
        with np.errstate(all="ignore"):
            positions = np.asarray(geometry.vertices, dtype=np.float64) @ linear.T + offset
            normals = None
            if "vertex_normals" in geometry._cache:
                # Cofactors: the inverse transpose times the determinant, no division.
                cofactors = np.stack([np.cross(linear[i - 2], linear[i - 1]) for i in range(3)])
                normals = np.asarray(geometry.vertex_normals, dtype=np.float64) @ cofactors.T
            mirrored = np.linalg.det(linear) < 0.0
        if mirrored:
            faces = faces[:, ::-1]
            normals = None if normals is None else -normals
        uv = getattr(geometry.visual, "uv", None)
        uv = None if uv is None or len(uv) != len(positions) else np.asarray(uv, dtype=np.float64)
        pieces.append(_Piece(positions, faces, normals, uv))
    return pieces


def _read(path: Path) -> trimesh.Scene:
    """Read a file with trimesh: local files only, nothing printed, every failure one sentence."""
    import trimesh
    from trimesh.resolvers import FilePathResolver

    logging.getLogger("trimesh").disabled = True  # or its warnings reach stderr
    suffix = path.suffix.lower()
    # glTF keeps texture coordinates with the material; elsewhere materials only cost time.
    options: dict[str, Any] = {"process": False}
    if suffix in (".obj", ".ply"):
        options["skip_materials"] = True
    try:
        with path.open("rb") as file, np.errstate(all="ignore"):
            return trimesh.load_scene(
                file,
                file_type=suffix[1:],
                resolver=FilePathResolver(str(path)),
                allow_remote=False,
                **options,
            )
    except OSError as error:
        # The resolver's own errors hold nothing but the name of the file that it looked for.
        missing = str(error.args[0]) if error.errno is None and error.args else ""
        if missing == "model.gltf":  # what trimesh seeks in an archive, if a .gltf is no JSON
            reason, expected = "damaged or cut off", "a complete glTF mesh"
        elif missing:
            reason, expected = f"it refers to the missing file '{missing}'", "a complete mesh"
        else:
            reason, expected = f"cannot be read ({os_reason(error)})", "a mesh"
        raise InputError(f"{path}: {reason}, expected {expected}") from error
    except Exception as error:  # damaged files fail in as many ways as there are parsers
        if isinstance(error, ImportError):
            reason = "it is not text in UTF-8"  # trimesh looks for a module that guesses encodings
        else:
            reason = " ".join(str(error).split())[:120] or type(error).__name__
        raise InputError(
            f"{path}: the file is damaged or cut off ({reason}), "
            f"expected a complete {suffix[1:].upper()} mesh"
        ) from error


def _finished(piece: _Piece, path: Path) -> tuple[FloatArray, FloatArray, FloatArray, IntArray]:
    """Check a piece; return positions, normals, tangents and faces without degenerate ones."""
    positions, faces = piece.positions, piece.faces
    if faces.min() < 0 or faces.max() >= len(positions):
        wrong = int(faces.min() if faces.min() < 0 else faces.max())
        raise InputError(
            f"{path}: a triangle uses vertex {wrong}, expected 0 to {len(positions) - 1}"
        )
    used = np.unique(faces)
    finite = np.isfinite(positions[used]).all(axis=1)
    if not finite.all():
        vertex = int(used[~finite][0])
        found = ", ".join(f"{x:g}" for x in positions[vertex])
        raise InputError(f"{path}: vertex {vertex} is ({found}), expected finite coordinates")
    if np.abs(positions[used]).max() > LARGEST_COORDINATE:
        raise InputError(
            f"{path}: a coordinate is {np.abs(positions[used]).max():g}, "
            f"expected at most {LARGEST_COORDINATE:g}"
        )

    # The GPU sees float32; what has no area there has none.
    rounded = positions.astype(np.float32).astype(np.float64)
    faces = faces[_has_area(rounded, faces)]
    if not len(faces):
        empty = np.zeros((0, 3))
        return empty, empty, empty, faces
    normals = _unit_or_none(piece.normals, faces)
    source = np.arange(len(positions))
    if normals is None:
        source, faces, normals = _smooth_normals(rounded, faces, piece.uv is not None)
    keep, flat = np.unique(faces, return_inverse=True)
    faces = flat.reshape(-1, 3)
    positions, normals, source = rounded[source[keep]], normals[keep], source[keep]
    uv = None if piece.uv is None else piece.uv[source]
    return positions, normals, _tangents(positions, normals, uv, faces), faces


def _has_area(positions: FloatArray, faces: IntArray) -> NDArray[np.bool_]:
    corners = positions[faces]
    edges = np.roll(corners, -1, axis=1) - corners
    longest = np.max(np.sum(edges**2, axis=-1), axis=1)
    twice_area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    return np.asarray((longest > 0.0) & (twice_area > 1e-12 * longest))


def _unit_or_none(normals: FloatArray | None, faces: IntArray) -> FloatArray | None:
    """Return unit normals, or None if a vertex in use has none that is finite and non-zero."""
    if normals is None:
        return None
    with np.errstate(all="ignore"):
        unit = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    return unit if np.isfinite(unit[np.unique(faces)]).all() else None


def _smooth_normals(
    positions: FloatArray, faces: IntArray, keep_apart: bool
) -> tuple[IntArray, IntArray, FloatArray]:
    """Make normals per smoothing group, weighted by the corners' angles.

    Corners of two triangles that share an edge (by position) bending less than
    `CREASE` join one group at each end of that edge, with one normal. With
    ``keep_apart`` the file's vertices are not merged even where they coincide,
    because their texture coordinates differ.

    Returns
    -------
    source : (k,) int64
        The vertex of ``positions`` that each new vertex repeats.
    faces : (m, 3) int64
        Indices of new vertices.
    normals : (k, 3) float64
        Unit.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    # Exporters leave poles and seams apart by rounding: nearly equal places are one.
    extent = float(np.ptp(positions[faces.ravel()], axis=0).max())
    cells = np.rint(positions * (SAME_PLACE / extent))
    _, place = np.unique(cells, axis=0, return_inverse=True)
    place = place.reshape(-1)[faces]
    corners = positions[faces]
    face_normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    face_normals /= np.linalg.norm(face_normals, axis=1, keepdims=True)

    # Every directed edge (face, i -> i+1), ordered so that equal edges are neighbours.
    corner = np.arange(faces.size).reshape(-1, 3)
    start, end = place.ravel(), np.roll(place, -1, axis=1).ravel()
    start_corner, end_corner = corner.ravel(), np.roll(corner, -1, axis=1).ravel()
    flipped = start > end
    low, high = np.where(flipped, end, start), np.where(flipped, start, end)
    low_corner = np.where(flipped, end_corner, start_corner)
    high_corner = np.where(flipped, start_corner, end_corner)
    order = np.lexsort((high, low))
    first, second = order[:-1], order[1:]
    same = (low[first] == low[second]) & (high[first] == high[second])
    bend = np.sum(face_normals[first // 3] * face_normals[second // 3], axis=1)
    joined = same & (bend > math.cos(CREASE)) & (first // 3 != second // 3)
    first, second = first[joined], second[joined]

    rows = np.concatenate((low_corner[first], high_corner[first]))
    columns = np.concatenate((low_corner[second], high_corner[second]))
    links = coo_matrix((np.ones(len(rows)), (rows, columns)), shape=(faces.size, faces.size))
    count, group = connected_components(links, directed=False)
    group = group.astype(np.int64)

    ahead = np.roll(corners, -1, axis=1) - corners
    behind = np.roll(corners, 1, axis=1) - corners
    angle = np.arctan2(
        np.linalg.norm(np.cross(ahead, behind), axis=-1), np.sum(ahead * behind, axis=-1)
    )
    normals = np.zeros((count, 3))
    np.add.at(normals, group, (angle[..., None] * face_normals[:, None, :]).reshape(-1, 3))
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    # A group folded onto itself cancels: there any of its triangles' normals serves.
    fallback = np.zeros((count, 3))
    fallback[group] = np.repeat(face_normals, 3, axis=0)
    normals = np.where(length > 1e-6, normals / np.maximum(length, 1e-6), fallback)
    # In a group one vertex for each exact position; for each of the file's where those differ.
    exact = faces.ravel()
    if not keep_apart:
        _, exact = np.unique(positions, axis=0, return_inverse=True)
        exact = exact.reshape(-1)[faces.ravel()]
    _, some, vertex = np.unique(
        group * len(positions) + exact, return_index=True, return_inverse=True
    )
    return faces.ravel()[some], vertex.reshape(-1, 3).astype(np.int64), normals[group[some]]


def parallel_tangents(normals: FloatArray) -> FloatArray:
    """Return unit tangents along the parallels about +y, +x where a normal is vertical.

    Parameters
    ----------
    normals : (n, 3) float64
        Unit.

    Returns
    -------
    (n, 3) float64
        Unit and perpendicular to the normals; +y x normal, normalised.
    """
    tangents = np.stack((normals[:, 2], np.zeros(len(normals)), -normals[:, 0]), axis=-1)
    length = np.linalg.norm(tangents, axis=1, keepdims=True)
    vertical = length < 1e-6
    return np.where(vertical, [1.0, 0.0, 0.0], tangents / np.where(vertical, 1.0, length))


def _tangents(
    positions: FloatArray, normals: FloatArray, uv: FloatArray | None, faces: IntArray
) -> FloatArray:
    """Return the direction of growing u at each vertex, or the parallel where u is of no use."""
    tangents = parallel_tangents(normals)
    # Close to vertical the parallel is taken as +x: make it perpendicular exactly.
    tangents -= normals * np.sum(normals * tangents, axis=1, keepdims=True)
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    if uv is None or not np.isfinite(uv[faces]).all():
        return tangents
    edge1 = positions[faces[:, 1]] - positions[faces[:, 0]]
    edge2 = positions[faces[:, 2]] - positions[faces[:, 0]]
    du1, dv1 = (uv[faces[:, 1]] - uv[faces[:, 0]]).T
    du2, dv2 = (uv[faces[:, 2]] - uv[faces[:, 0]]).T
    # Lengyel: the gradient of u is (e1 dv2 - e2 dv1) over the determinant, whose sign matters.
    orientation = np.sign(du1 * dv2 - du2 * dv1)[:, None]
    along = orientation * (edge1 * dv2[:, None] - edge2 * dv1[:, None])
    length = np.linalg.norm(along, axis=1, keepdims=True)
    along = np.where(length > 0.0, along / np.where(length > 0.0, length, 1.0), 0.0)
    total = np.zeros_like(normals)
    np.add.at(total, faces.ravel(), np.repeat(along, 3, axis=0))
    total -= normals * np.sum(normals * total, axis=1, keepdims=True)
    length = np.linalg.norm(total, axis=1, keepdims=True)
    useful = length > 1e-3
    return np.where(useful, total / np.where(useful, length, 1.0), tangents)
