"""Where the camera's rays go, in float64; the one place that knows the projection.

View space: +x right, +y up, the camera looks along -z; "depth" is the distance
along the view axis [m], positive in front of the eye. Pixels are counted from
the top left corner, pixel (0, 0) has its centre at (0.5, 0.5).

Clip coordinates are (x, y, depth - 2 NEAR, depth): a projection without a far
plane that clips at depth < `NEAR`. The depth buffer holds
log2(depth / NEAR) / log2(FAR / NEAR), written by the fragment shader: 24 bits
then resolve 1.7e-6 of any distance from 0.1 mm to 100,000 km, where the usual
hyperbolic depth has nothing left at a thousandth of that range. OpenGL 4.1 has
no glClipControl, so a reversed float depth is not to be had.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.scene import Camera, Transform

FloatArray = NDArray[np.float64]

NEAR = 1e-4
"""Nearest visible depth [m]."""
FAR = 1e8
"""Depth beyond which things still show but no longer hide each other [m]."""


@dataclass(frozen=True, eq=False)
class CameraFrame:
    """A camera and an aspect ratio: eye, and rays with unit depth.

    Attributes
    ----------
    eye : (3,) float64
    forward : (3,) float64, unit
    right, up : (3,) float64
        From the middle of the picture to its right and upper edge at depth 1.
    """

    eye: FloatArray
    forward: FloatArray
    right: FloatArray
    up: FloatArray

    @classmethod
    def of(cls, camera: Camera, aspect: float) -> CameraFrame:
        """``aspect`` is width / height of the picture."""
        eye = np.array(camera.eye, dtype=np.float64)
        forward = np.array(camera.target, dtype=np.float64) - eye
        forward /= np.linalg.norm(forward)
        right = np.cross(forward, np.array(camera.up, dtype=np.float64))
        right /= np.linalg.norm(right)
        up = np.cross(right, forward)
        tangent = math.tan(0.5 * camera.fov_y)
        return cls(eye, forward, right * (tangent * aspect), up * tangent)

    def ray(
        self, x: FloatArray | float, y: FloatArray | float, size: tuple[int, int]
    ) -> FloatArray:
        """Return (..., 3) rays of unit depth through pixel coordinates (x, y) from the top left."""
        ndc_x = 2.0 * np.asarray(x, dtype=np.float64)[..., None] / size[0] - 1.0
        ndc_y = 1.0 - 2.0 * np.asarray(y, dtype=np.float64)[..., None] / size[1]
        return np.asarray(self.forward + ndc_x * self.right + ndc_y * self.up)

    def clip_from_world(self) -> FloatArray:
        """Return the (4, 4) matrix to (x, y, depth - 2 NEAR, depth)."""
        matrix = np.zeros((4, 4))
        matrix[0, :3] = self.right / float(self.right @ self.right)
        matrix[1, :3] = self.up / float(self.up @ self.up)
        matrix[3, :3] = self.forward
        matrix[:, 3] = -matrix[:, :3] @ self.eye
        matrix[2] = matrix[3]
        matrix[2, 3] -= 2.0 * NEAR
        return matrix


def world_from_object(transform: Transform) -> FloatArray:
    """Return the (4, 4) matrix of scale, then rotation, then translation."""
    w, x, y, z = np.array(transform.rotate) / math.hypot(*transform.rotate)
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    matrix = np.eye(4)
    matrix[:3, :3] = rotation * np.array(transform.scale)
    matrix[:3, 3] = transform.translate
    return matrix


def normal_from_object(matrix: FloatArray) -> FloatArray:
    """Return the (3, 3) matrix that takes normals along: the cofactors, up to a positive factor.

    The cofactor matrix is the inverse transpose times the determinant; a
    mirroring transform's negative determinant is divided out, so outward
    normals stay outward.
    """
    linear = matrix[:3, :3]
    cofactors = np.linalg.inv(linear).T
    return np.asarray(cofactors / np.abs(cofactors).max())
