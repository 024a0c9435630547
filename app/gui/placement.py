"""Where what is selected is, as matrices and bounds: what gizmo and framing need."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from app import edits, lights, planes
from app.editor import Selection
from app.meshes import load_mesh
from app.render.camera import world_from_object
from app.scene import Scene, Vec3
from app.vectors import length

FloatArray = NDArray[np.float64]


def name_of(scene: Scene, selection: Selection) -> str:
    """Return the name of the selected light or object."""
    items = scene.lights if selection.kind == "light" else scene.objects
    return items[selection.index].name


def pose_of(scene: Scene, selection: Selection) -> FloatArray:
    """Return the (4, 4) rotation and translation of what is selected.

    A light's pose has its centre as origin, x along u and z along the normal.
    """
    if selection.kind == "object":
        transform = scene.objects[selection.index].transform
        return world_from_object(replace(transform, scale=(1.0, 1.0, 1.0)))
    light = scene.lights[selection.index]
    normal = np.array(planes.normal_of(light.plane))
    u = np.array(light.plane.u) / length(light.plane.u)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([u, np.cross(normal, u), normal], axis=1)
    pose[:3, 3] = lights.centre_of(light)
    return pose


def moved_by(scene: Scene, selection: Selection, motion: FloatArray) -> Scene:
    """Return the scene with what is selected moved by a nearly rigid (4, 4) world matrix.

    Only its rotation (the nearest one, by singular values) and translation count.
    """
    left, _, right = np.linalg.svd(motion[:3, :3])
    rigid = motion.copy()
    rigid[:3, :3] = left @ right
    if selection.kind == "light":
        light = scene.lights[selection.index]
        plane = planes.transform_plane(light.plane, rigid)
        return edits.replace_light(scene, selection.index, replace(light, plane=plane))
    item = edits.transform_object(scene.objects[selection.index], rigid)
    return edits.replace_object(scene, selection.index, item)


def sphere_around(scene: Scene, selection: Selection) -> tuple[Vec3, float] | None:
    """Return centre and radius [m] of a sphere around what is selected.

    Around everything but the planes, floors mostly, if nothing is selected;
    None if there is nothing.

    Raises
    ------
    InputError
        If a mesh cannot be loaded.
    """
    if selection.kind == "light":
        return lights.bounds_of(scene.lights[selection.index])
    chosen = range(len(scene.objects)) if selection.kind == "none" else [selection.index]
    points = [
        corner
        for index in chosen
        if selection.kind == "object" or scene.objects[index].mesh != "plane"
        for corner in box_corners(scene, index)
    ]
    if selection.kind == "none":
        for light in scene.lights:
            (s0, t0), (s1, t1) = lights.extent_of(light)
            corners = ((s0, t0), (s1, t0), (s1, t1), (s0, t1))
            points += [planes.point_on(light.plane, corner) for corner in corners]
    if not points:
        return None
    world = np.array(points)
    centre = (world.max(0) + world.min(0)) / 2.0
    x, y, z = centre.tolist()
    return (x, y, z), float(np.linalg.norm(world - centre, axis=-1).max())


def box_corners(scene: Scene, index: int) -> list[Vec3]:
    """Return the world corners of an object's box; bits 1, 2, 4 of the index choose x, y, z.

    Raises
    ------
    InputError
        If the mesh cannot be loaded.
    """
    item = scene.objects[index]
    bounds = np.asarray(load_mesh(item.mesh).bounds, dtype=np.float64)
    matrix = world_from_object(item.transform)
    corners: list[Vec3] = []
    for i in range(8):
        point = np.array([bounds[i & 1, 0], bounds[i >> 1 & 1, 1], bounds[i >> 2 & 1, 2]])
        x, y, z = (matrix[:3, :3] @ point + matrix[:3, 3]).tolist()
        corners.append((x, y, z))
    return corners
