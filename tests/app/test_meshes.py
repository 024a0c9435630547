"""Built-in meshes against their formulas, files against bytes written by hand."""

from __future__ import annotations

import json
import math
import os
import socket
import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.errors import InputError
from app.meshes import MESH_SUFFIXES, Mesh, load_mesh, parallel_tangents
from app.scene import BUILT_IN_MESHES

CUBE_CORNERS = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
CUBE_QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
CUBE_TRIANGLES = [t for a, b, c, d in CUBE_QUADS for t in ((a, b, c), (a, c, d))]


def face_vectors(mesh: Mesh) -> np.ndarray:
    """Return each triangle's normal times twice its area, float64."""
    corners = mesh.positions.astype(np.float64)[mesh.indices]
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def check_invariants(mesh: Mesh) -> None:
    normals, tangents = mesh.normals.astype(np.float64), mesh.tangents.astype(np.float64)
    for array in (mesh.positions, mesh.normals, mesh.tangents):
        assert array.dtype == np.float32
        assert array.shape == (len(mesh.positions), 3)
        assert np.isfinite(array).all()
        assert not array.flags.writeable
    assert mesh.indices.dtype == np.uint32
    assert mesh.indices.max() < len(mesh.positions)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(tangents, axis=1), 1.0, atol=1e-6)
    np.testing.assert_allclose(np.sum(normals * tangents, axis=1), 0.0, atol=1e-6)
    assert (np.linalg.norm(face_vectors(mesh), axis=1) > 0.0).all()
    np.testing.assert_array_equal(mesh.bounds[0], mesh.positions.min(axis=0))
    np.testing.assert_array_equal(mesh.bounds[1], mesh.positions.max(axis=0))


def total_area(mesh: Mesh) -> float:
    return 0.5 * float(np.linalg.norm(face_vectors(mesh), axis=1).sum())


def is_wound_outwards(mesh: Mesh) -> bool:
    agreement = np.sum(face_vectors(mesh)[:, None] * mesh.normals[mesh.indices], axis=-1)
    return bool((agreement > 0.0).all())


# Built-ins


@pytest.mark.parametrize("name", BUILT_IN_MESHES)
def test_built_ins_are_sound_and_cached(name: str) -> None:
    mesh = load_mesh(name)
    check_invariants(mesh)
    assert is_wound_outwards(mesh)
    assert load_mesh(name) is mesh


@pytest.mark.parametrize(
    ("name", "exact", "relative"),
    [("plane", 4.0, 0.0), ("box", 24.0, 0.0), ("sphere", 4 * math.pi, 5e-4),
     ("disc", math.pi, 2e-4)],
)  # fmt: skip
def test_built_in_areas(name: str, exact: float, relative: float) -> None:
    assert total_area(load_mesh(name)) == pytest.approx(exact, rel=relative or 1e-12)


def test_plane_lies_in_xz() -> None:
    mesh = load_mesh("plane")
    np.testing.assert_array_equal(mesh.bounds, [[-1, 0, -1], [1, 0, 1]])
    np.testing.assert_array_equal(mesh.normals, np.tile([0, 1, 0], (4, 1)))
    np.testing.assert_array_equal(mesh.tangents, np.tile([1, 0, 0], (4, 1)))


def test_sphere_normals_are_radial_and_tangents_follow_parallels() -> None:
    mesh = load_mesh("sphere")
    np.testing.assert_allclose(mesh.positions, mesh.normals, atol=1e-7)
    off_poles = np.abs(mesh.positions[:, 1]) < 0.9999
    x, _, z = mesh.positions[off_poles].astype(np.float64).T
    along = np.stack((z, np.zeros_like(x), -x), axis=1)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    np.testing.assert_allclose(mesh.tangents[off_poles], along, atol=1e-6)
    # At the poles the parallels shrink to a point: each sector has its own direction.
    assert len(np.unique(mesh.tangents[~off_poles], axis=0)) > 100


def test_sphere_silhouette_is_round() -> None:
    mesh = load_mesh("sphere")
    middles = mesh.positions.astype(np.float64)[mesh.indices].mean(axis=1)
    assert np.linalg.norm(middles, axis=1).min() > 1.0 - 6e-4


def test_disc_tangents_are_azimuthal() -> None:
    mesh = load_mesh("disc")
    np.testing.assert_allclose(mesh.normals, np.tile([0, 1, 0], (len(mesh.normals), 1)))
    radius = np.linalg.norm(mesh.positions, axis=1)
    rim = radius > 0.5
    np.testing.assert_allclose(radius[rim], 1.0, atol=1e-6)
    assert np.abs(np.sum(mesh.tangents[rim] * mesh.positions[rim], axis=1)).max() < 1e-6
    # Interpolated inside a sector, the tangent stays azimuthal to half a sector's angle.
    corners = mesh.indices
    inside = mesh.positions[corners].mean(axis=1)
    tangents = mesh.tangents[corners].mean(axis=1)
    cosine = np.sum(inside * tangents, axis=1) / np.linalg.norm(inside, axis=1)
    assert np.abs(cosine).max() < math.pi / 256


def test_box_has_flat_sides() -> None:
    mesh = load_mesh("box")
    assert len(mesh.positions) == 24
    assert (np.abs(mesh.normals).max(axis=1) == 1.0).all()
    np.testing.assert_array_equal(mesh.bounds, [[-1, -1, -1], [1, 1, 1]])
    top = mesh.normals[:, 1] == 1.0
    np.testing.assert_array_equal(mesh.tangents[top], np.tile([1, 0, 0], (4, 1)))


# Files, written by hand


def obj_text(points: list, faces: list) -> str:
    lines = [f"v {x} {y} {z}" for x, y, z in points]
    lines += ["f " + " ".join(str(i + 1) for i in face) for face in faces]
    return "\n".join(lines) + "\n"


def stl_bytes(points: list, triangles: list) -> bytes:
    out = b"\0" * 80 + struct.pack("<I", len(triangles))
    for triangle in triangles:
        out += struct.pack("<3f", 0, 0, 0)
        for index in triangle:
            out += struct.pack("<3f", *points[index])
        out += b"\0\0"
    return out


def ply_text(points: list, triangles: list) -> str:
    head = (
        f"ply\nformat ascii 1.0\nelement vertex {len(points)}\nproperty float x\n"
        f"property float y\nproperty float z\nelement face {len(triangles)}\n"
        "property list uchar int vertex_indices\nend_header\n"
    )
    body = [f"{x} {y} {z}" for x, y, z in points]
    body += ["3 " + " ".join(map(str, triangle)) for triangle in triangles]
    return head + "\n".join(body) + "\n"


def gltf_document(points: list, triangles: list, nodes: list | None = None) -> tuple[dict, bytes]:
    positions = np.asarray(points, dtype="<f4").tobytes()
    indices = np.asarray(triangles, dtype="<u4").tobytes()
    nodes = nodes or [{"mesh": 0}]
    low, high = np.min(points, axis=0).tolist(), np.max(points, axis=0).tolist()
    document = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": len(positions) + len(indices)}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": len(positions)},
            {"buffer": 0, "byteOffset": len(positions), "byteLength": len(indices)},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": len(points), "type": "VEC3",
             "min": low, "max": high},
            {"bufferView": 1, "componentType": 5125, "count": 3 * len(triangles),
             "type": "SCALAR"},
        ],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "nodes": nodes,
        "scenes": [{"nodes": list(range(len(nodes)))}],
        "scene": 0,
    }  # fmt: skip
    return document, positions + indices


def glb_bytes(points: list, triangles: list, nodes: list | None = None) -> bytes:
    document, binary = gltf_document(points, triangles, nodes)
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    body = struct.pack("<II", len(text), 0x4E4F534A) + text
    body += struct.pack("<II", len(binary), 0x004E4942) + binary
    return struct.pack("<III", 0x46546C67, 2, 12 + len(body)) + body


def write_mesh(folder: Path, suffix: str, points: list, triangles: list) -> Path:
    path = folder / f"mesh{suffix}"
    if suffix == ".obj":
        path.write_text(obj_text(points, triangles))
    elif suffix == ".stl":
        path.write_bytes(stl_bytes(points, triangles))
    elif suffix == ".ply":
        path.write_text(ply_text(points, triangles))
    elif suffix == ".glb":
        path.write_bytes(glb_bytes(points, triangles))
    else:
        document, binary = gltf_document(points, triangles)
        document["buffers"][0]["uri"] = "mesh.bin"
        path.write_text(json.dumps(document))
        (folder / "mesh.bin").write_bytes(binary)
    return path


def globe(sectors: int = 24, stacks: int = 12) -> tuple[list, list]:
    """Return a coarse sphere whose seam and poles repeat vertices."""
    points, triangles = [], []
    for i in range(stacks + 1):
        for j in range(sectors + 1):
            polar, azimuth = math.pi * i / stacks, math.tau * j / sectors
            points.append(
                (math.sin(polar) * math.sin(azimuth), math.cos(polar),
                 math.sin(polar) * math.cos(azimuth))
            )  # fmt: skip
    width = sectors + 1
    for i in range(stacks):
        for j in range(sectors):
            a, b, c, d = (r * width + s for r in (i, i + 1) for s in (j, j + 1))
            triangles += [(a, c, d), (a, d, b)]
    return points, triangles


@pytest.mark.parametrize("suffix", MESH_SUFFIXES)
def test_a_cube_without_normals_keeps_its_edges(tmp_path: Path, suffix: str) -> None:
    mesh = load_mesh(str(write_mesh(tmp_path, suffix, CUBE_CORNERS, CUBE_TRIANGLES)))
    check_invariants(mesh)
    assert len(mesh.indices) == 12
    assert len(mesh.positions) == 24
    assert (np.abs(mesh.normals).max(axis=1) == 1.0).all()
    assert is_wound_outwards(mesh)
    assert np.all(np.sum(mesh.normals * mesh.positions, axis=1) > 0.0)
    assert total_area(mesh) == pytest.approx(24.0)


@pytest.mark.parametrize("suffix", MESH_SUFFIXES)
def test_a_globe_without_normals_is_smooth(tmp_path: Path, suffix: str) -> None:
    points, triangles = globe()
    mesh = load_mesh(str(write_mesh(tmp_path, suffix, points, triangles)))
    check_invariants(mesh)
    # The poles' degenerate halves of quads are gone.
    assert len(mesh.indices) == len(triangles) - 2 * 24
    cosine = np.sum(mesh.normals * mesh.positions, axis=1)
    assert cosine.min() > math.cos(math.radians(1.5))
    # The seam is closed: one place, one normal.
    places, which = np.unique(np.round(mesh.positions, 5), axis=0, return_inverse=True)
    first = np.zeros((len(places), 3), dtype=np.float32)
    first[which.reshape(-1)] = mesh.normals
    np.testing.assert_array_equal(first[which.reshape(-1)], mesh.normals)


def test_normals_of_a_file_are_kept(tmp_path: Path) -> None:
    path = tmp_path / "tilted.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0.6 0.8\nvn 0 0 2\nf 1//1 2//2 3//2\n")
    mesh = load_mesh(str(path))
    check_invariants(mesh)
    order = np.argsort(mesh.normals[:, 1])
    np.testing.assert_allclose(
        mesh.normals[order], [[0, 0, 1], [0, 0, 1], [0, 0.6, 0.8]], atol=1e-7
    )


def test_zero_normals_of_a_file_are_made_afresh(tmp_path: Path) -> None:
    path = tmp_path / "zero.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 0\nf 1//1 2//1 3//1\n")
    np.testing.assert_allclose(load_mesh(str(path)).normals, np.tile([0, 0, 1], (3, 1)))


def test_tangents_follow_texture_coordinates(tmp_path: Path) -> None:
    path = tmp_path / "uv.obj"
    # u grows along +y, v along -x; and a corner where u stands still falls back.
    path.write_text(
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 1\nvt 0 0\nvt 1 0\nvt 1 1\n"
        "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n"
    )
    mesh = load_mesh(str(path))
    check_invariants(mesh)
    np.testing.assert_allclose(mesh.tangents, np.tile([0, 1, 0], (4, 1)), atol=1e-6)
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0.5 0.5\nf 1/1 2/1 3/1\n")
    os.utime(path, ns=(1, 1))
    mesh = load_mesh(str(path))
    check_invariants(mesh)
    np.testing.assert_allclose(mesh.tangents, np.tile([1, 0, 0], (3, 1)), atol=1e-6)


def test_all_nodes_of_a_gltf_are_transformed_and_merged(tmp_path: Path) -> None:
    path = tmp_path / "nodes.glb"
    nodes = [
        {"mesh": 0, "translation": [10, 0, 0]},
        {"mesh": 0, "scale": [-1, 2, 3]},
    ]
    path.write_bytes(glb_bytes(CUBE_CORNERS, CUBE_TRIANGLES, nodes))
    mesh = load_mesh(str(path))
    check_invariants(mesh)
    assert len(mesh.indices) == 24
    np.testing.assert_allclose(mesh.bounds, [[-1, -2, -3], [11, 2, 3]])
    # The mirrored node too is wound outwards.
    assert is_wound_outwards(mesh)
    middle = np.where(mesh.positions[:, :1] > 5.0, [10.0, 0, 0], [0.0, 0, 0])
    assert np.all(np.sum(mesh.normals * (mesh.positions - middle), axis=1) > 0.0)


def test_degenerate_triangles_are_dropped(tmp_path: Path) -> None:
    path = tmp_path / "some.obj"
    faces = [(0, 1, 2), (0, 0, 1), (0, 1, 3), (4, 4, 4)]
    path.write_text(obj_text([(0, 0, 0), (1, 0, 0), (0, 1, 0), (2, 0, 0), (9, 9, 9)], faces))
    mesh = load_mesh(str(path))
    check_invariants(mesh)
    assert len(mesh.indices) == 1
    assert mesh.bounds[1].tolist() == [1, 1, 0]


def test_quads_become_triangles(tmp_path: Path) -> None:
    path = tmp_path / "quads.obj"
    path.write_text(obj_text(CUBE_CORNERS, CUBE_QUADS))
    assert len(load_mesh(str(path)).indices) == 12


def test_a_file_is_read_again_once_it_changes(tmp_path: Path) -> None:
    path = write_mesh(tmp_path, ".obj", CUBE_CORNERS, CUBE_TRIANGLES)
    first = load_mesh(str(path))
    assert load_mesh(str(path)) is first
    path.write_text(obj_text(CUBE_CORNERS, CUBE_TRIANGLES[:2]))
    assert len(load_mesh(str(path)).indices) == 2


def test_neither_network_nor_output(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise AssertionError("a mesh reached for the network")

    monkeypatch.setattr(socket.socket, "connect", refuse)
    document, _ = gltf_document(CUBE_CORNERS, CUBE_TRIANGLES)
    document["buffers"][0]["uri"] = "http://127.0.0.1:9/mesh.bin"
    path = tmp_path / "remote.gltf"
    path.write_text(json.dumps(document))
    with pytest.raises(InputError, match=r"remote\.gltf"):
        load_mesh(str(path))
    (tmp_path / "noise.ply").write_bytes(bytes(range(256)) * 4)
    with pytest.raises(InputError):
        load_mesh(str(tmp_path / "noise.ply"))
    assert capfd.readouterr() == ("", "")


@settings(max_examples=40)
@given(
    st.lists(
        st.tuples(*[st.sampled_from((-1.0, 0.0, 1e-6, 0.5, 1.0, 1e6))] * 3), min_size=3, max_size=12
    ),
    st.lists(st.tuples(*[st.integers(0, 11)] * 3), min_size=1, max_size=20),
)
def test_any_soup_of_triangles_is_finite(
    tmp_path_factory: pytest.TempPathFactory, points: list, triangles: list
) -> None:
    triangles = [tuple(i % len(points) for i in triangle) for triangle in triangles]
    path = tmp_path_factory.mktemp("soup") / "soup.stl"
    path.write_bytes(stl_bytes(points, triangles))
    try:
        check_invariants(load_mesh(str(path)))
    except InputError as error:
        assert "zero area" in str(error)


def test_parallel_tangents_are_continuous_off_the_poles() -> None:
    angles = np.linspace(0.0, math.tau, 400)
    normals = np.stack((0.8 * np.cos(angles), np.full(400, 0.6), 0.8 * np.sin(angles)), axis=1)
    steps = np.linalg.norm(np.diff(parallel_tangents(normals), axis=0), axis=1)
    assert steps.max() < 0.02
