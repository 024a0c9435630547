"""The surface points of a picture, read back from its G-buffer."""

from __future__ import annotations

from dataclasses import dataclass

import moderngl
import numpy as np
from numpy.typing import NDArray

from app.render.camera import CameraFrame
from app.render.picking import direction_from_octahedral, facing_normal, turned_tangent
from app.scene import Shot


@dataclass(frozen=True, eq=False)
class Surfaces:
    """Points of the objects that a picture shows, one a pixel, pixels with nothing left out.

    ``position``, ``normal`` and ``view``, (n, 3) float64, are as the lighting pass has
    them: world space, view and normal unit, the normal bent to face the viewer. ``index``,
    (n,), counts the scene's objects. ``tangent``, (n, 3), is the material's, unit and
    perpendicular to the normal; None where the technique shaded without.
    """

    position: NDArray[np.float64]
    normal: NDArray[np.float64]
    view: NDArray[np.float64]
    index: NDArray[np.int64]
    tangent: NDArray[np.float64] | None = None


_NONE = np.zeros((0, 3))

NO_SURFACES = Surfaces(_NONE, _NONE, _NONE, np.zeros(0, dtype=np.int64))
"""Of a picture that shows none."""


def surfaces_of(
    shot: Shot, gbuffer: moderngl.Texture, tangents: moderngl.Texture | None
) -> Surfaces:
    """Return the surface points of a shot's first sample, whose attachments these are."""
    width, height = shot.width, shot.height
    raw = np.frombuffer(gbuffer.read(), dtype=np.float32)
    pixels = raw.reshape(height, width, 4)[::-1].astype(np.float64)
    rows, columns = np.nonzero((pixels[..., 2] > 0.0) & (pixels[..., 3] >= 0.0))
    found = pixels[rows, columns]
    frame = CameraFrame.of(shot.scene.camera, width / height)
    x, y = (axis.astype(np.float64) + 0.5 for axis in (columns, rows))
    ray = frame.ray(x, y, (width, height))
    view = -ray / np.linalg.norm(ray, axis=-1, keepdims=True)
    normal = facing_normal(direction_from_octahedral(found[:, :2]), view)
    index = found[:, 3].astype(np.int64)
    tangent = None
    if tangents is not None:
        raw = np.frombuffer(tangents.read(), dtype=np.float32)
        along = raw.reshape(height, width, 2)[::-1][rows, columns].astype(np.float64)
        rotations = np.array([m.rotation for m in shot.scene.object_materials()])
        tangent = turned_tangent(direction_from_octahedral(along), normal, rotations[index])
    return Surfaces(frame.eye + found[:, 2:3] * ray, normal, view, index, tangent)
