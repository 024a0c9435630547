"""Moving the camera, and between pixels and the world: pure functions of `Camera`.

Pixel coordinates are continuous with the origin at the top left corner of the
picture; pixel (i, j) has its centre at (i + 0.5, j + 0.5). Every movement
returns a valid camera: the view never reaches the poles of ``up``, and the
eye never reaches the target.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from app.scene import Camera, Vec3
from app.vectors import add, cross, dot, length, normalize, rotate, scale, subtract

FloatArray = NDArray[np.float64]

POLE_MARGIN = math.radians(1.0)
"""Smallest angle left between the view and ``up`` or its opposite [rad]."""

LEAST_ASPECT = 16.0 / 9.0
WIDEST = math.radians(150.0)
"""Most that `widened` opens the field of view [rad]."""

DISTANCE_MIN, DISTANCE_MAX = 1e-3, 1e5
NEAR = 1e-3
"""Depth [m] in front of which `project` and `clip_to_view` drop points."""


@dataclass(frozen=True, slots=True)
class Basis:
    """Unit axes of a camera: right, up, and forward into the picture."""

    right: Vec3
    up: Vec3
    forward: Vec3


def basis_of(camera: Camera) -> Basis:
    """Return the camera's axes in the world."""
    forward = normalize(subtract(camera.target, camera.eye))
    right = normalize(cross(forward, camera.up))
    return Basis(right, cross(right, forward), forward)


def distance_of(camera: Camera) -> float:
    """Return the distance from eye to target [m]."""
    return length(subtract(camera.target, camera.eye))


def orbit(camera: Camera, yaw: float, pitch: float) -> Camera:
    """Turn the eye about the target.

    Parameters
    ----------
    yaw : float
        About the camera's ``up``, counter-clockwise seen from above [rad].
    pitch : float
        Upwards [rad]; stops `POLE_MARGIN` short of the poles.
    """
    pole = normalize(camera.up)
    offset = rotate(subtract(camera.eye, camera.target), pole, yaw)
    distance = length(offset)
    polar = math.acos(max(-1.0, min(1.0, dot(offset, pole) / distance)))
    wanted = max(POLE_MARGIN, min(math.pi - POLE_MARGIN, polar - pitch))
    flat = normalize(subtract(offset, scale(pole, dot(offset, pole))))
    turned = add(scale(pole, math.cos(wanted)), scale(flat, math.sin(wanted)))
    return replace(camera, eye=add(camera.target, scale(turned, distance)))


def pan(camera: Camera, dx: float, dy: float, height: float) -> Camera:
    """Move the camera sideways so that the target follows the pointer.

    Parameters
    ----------
    dx, dy : float
        The pointer's way in pixels, right and down.
    height : float
        The picture's height in pixels.
    """
    axes = basis_of(camera)
    metres = 2.0 * distance_of(camera) * math.tan(camera.fov_y / 2.0) / height
    shift = add(scale(axes.right, -dx * metres), scale(axes.up, dy * metres))
    return replace(camera, eye=add(camera.eye, shift), target=add(camera.target, shift))


def dolly(camera: Camera, steps: float) -> Camera:
    """Move the eye towards the target, a tenth of the way per step."""
    distance = distance_of(camera)
    wanted = max(DISTANCE_MIN, min(DISTANCE_MAX, distance * 0.9**steps))
    offset = scale(subtract(camera.eye, camera.target), wanted / distance)
    return replace(camera, eye=add(camera.target, offset))


def frame(camera: Camera, centre: Vec3, radius: float, aspect: float) -> Camera:
    """Look at a sphere from the present direction so that it fills the picture.

    Parameters
    ----------
    centre, radius
        The sphere [m]; a radius of zero is taken as 1 mm.
    aspect : float
        The picture's width over its height.
    """
    narrow = min(math.tan(camera.fov_y / 2.0), math.tan(camera.fov_y / 2.0) * aspect)
    distance = 1.15 * max(radius, 1e-3) / math.sin(math.atan(narrow))
    distance = max(DISTANCE_MIN, min(DISTANCE_MAX, distance))
    offset = scale(normalize(subtract(camera.eye, camera.target)), distance)
    return replace(camera, eye=add(centre, offset), target=centre)


def widened(camera: Camera, aspect: float) -> Camera:
    """Return the camera with a field of view that shows the width of a `LEAST_ASPECT` picture.

    Scenes are composed for wide pictures; a narrow one shows more above and
    below instead of cutting off the sides.
    """
    if aspect >= LEAST_ASPECT:
        return camera
    half = math.atan(math.tan(camera.fov_y / 2.0) * LEAST_ASPECT / aspect)
    return replace(camera, fov_y=min(2.0 * half, WIDEST))


def project(camera: Camera, point: Vec3, width: float, height: float) -> Vec3 | None:
    """Return (x, y) in pixels and the depth [m] of a point; None if not in front of the eye."""
    axes = basis_of(camera)
    offset = subtract(point, camera.eye)
    depth = dot(offset, axes.forward)
    if depth < NEAR:
        return None
    focal = 0.5 * height / math.tan(camera.fov_y / 2.0)
    x = 0.5 * width + focal * dot(offset, axes.right) / depth
    y = 0.5 * height - focal * dot(offset, axes.up) / depth
    return (x, y, depth)


def project_all(camera: Camera, points: FloatArray, width: float, height: float) -> FloatArray:
    """Return (..., 3) pixels and depths [m] of (..., 3) points; NaN where not before the eye."""
    axes = basis_of(camera)
    local = (points - np.array(camera.eye)) @ np.array([axes.right, axes.up, axes.forward]).T
    depth = np.where(local[..., 2] < NEAR, np.nan, local[..., 2])
    focal = 0.5 * height / math.tan(camera.fov_y / 2.0)
    x = 0.5 * width + focal * local[..., 0] / depth
    y = 0.5 * height - focal * local[..., 1] / depth
    return np.stack([x, y, depth], axis=-1)


def clip_to_view(camera: Camera, a: Vec3, b: Vec3) -> tuple[Vec3, Vec3] | None:
    """Return the part of a segment that is in front of the eye, None if there is none."""
    forward = basis_of(camera).forward
    depth_a = dot(subtract(a, camera.eye), forward)
    depth_b = dot(subtract(b, camera.eye), forward)
    near = 2.0 * NEAR
    if depth_a < near and depth_b < near:
        return None
    if depth_a < near:
        a = add(a, scale(subtract(b, a), (near - depth_a) / (depth_b - depth_a)))
    elif depth_b < near:
        b = add(b, scale(subtract(a, b), (near - depth_b) / (depth_a - depth_b)))
    return a, b


def ray_through(camera: Camera, x: float, y: float, width: float, height: float) -> Vec3:
    """Return the unit direction from the eye through a point of the picture in pixels."""
    axes = basis_of(camera)
    focal = 0.5 * height / math.tan(camera.fov_y / 2.0)
    across = scale(axes.right, (x - 0.5 * width) / focal)
    upwards = scale(axes.up, (0.5 * height - y) / focal)
    return normalize(add(axes.forward, add(across, upwards)))


def intersect_plane(origin: Vec3, direction: Vec3, point: Vec3, normal: Vec3) -> Vec3 | None:
    """Return where a ray meets a plane.

    None if the plane is behind the origin, or within 1 degree of edge-on,
    where a pixel's step would throw the point to the horizon.
    """
    facing = dot(direction, normal)
    if abs(facing) < math.sin(math.radians(1.0)) * length(direction) * length(normal):
        return None
    distance = dot(subtract(point, origin), normal) / facing
    return add(origin, scale(direction, distance)) if distance > 0.0 else None


def view_from_world(camera: Camera) -> FloatArray:
    """Return the (4, 4) view matrix, looking along -z (OpenGL's convention)."""
    axes = basis_of(camera)
    matrix = np.eye(4)
    for row, axis in enumerate((axes.right, axes.up, scale(axes.forward, -1.0))):
        matrix[row, :3] = axis
        matrix[row, 3] = -dot(axis, camera.eye)
    return matrix


def clip_from_view(camera: Camera, aspect: float) -> FloatArray:
    """Return the (4, 4) perspective projection (OpenGL's clip space), near 1 cm, far 1 km."""
    near, far = 0.01, 1000.0
    focal = 1.0 / math.tan(camera.fov_y / 2.0)
    matrix = np.zeros((4, 4))
    matrix[0, 0] = focal / aspect
    matrix[1, 1] = focal
    matrix[2, 2] = (far + near) / (near - far)
    matrix[2, 3] = 2.0 * far * near / (near - far)
    matrix[3, 2] = -1.0
    return matrix
