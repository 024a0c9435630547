"""What a picture shows at one point: the G-buffer pass over a single pixel."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import moderngl
import numpy as np
from numpy.typing import NDArray

from app.render.camera import CameraFrame
from app.render.features import LightingFeatures
from app.render.gbuffer import GBufferPass
from app.render.lighting import LightingPass
from app.render.state import release_framebuffer
from app.scene import Vec3

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Hit:
    """What a pixel shows: ``index`` counts the scene's objects or lights.

    Attributes
    ----------
    position_ws : world space [m]
    normal_ws : unit, bent to face the viewer as the lighting pass does
    tangent_ws : the mesh's tangent, not perpendicular to the normal, zero at its poles; None
        where the shot needs no tangents
    """

    kind: Literal["object", "light"]
    index: int
    position_ws: Vec3
    normal_ws: Vec3
    tangent_ws: Vec3 | None = None


class Picker:
    """Owner of a target of one pixel, made when it is first asked something."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._target: moderngl.Framebuffer | None = None
        self._shaded: moderngl.Framebuffer | None = None

    def pick(
        self, gbuffer: GBufferPass, frame: CameraFrame, size: tuple[int, int], x: float, y: float
    ) -> Hit | None:
        """Return what ``gbuffer`` holds at pixel coordinates from the top left, or None."""
        self._draw(gbuffer, frame, size, x, y)
        surface = self._read(0, 4)
        depth, identity = float(surface[2]), int(surface[3])
        if depth <= 0.0:
            return None
        ray = frame.ray(x, y, size)
        wo = -ray / np.linalg.norm(ray)
        normal = facing_normal(direction_from_octahedral(surface[None, :2]), wo[None])[0]
        position = _vec3(frame.eye + depth * ray)
        if identity < 0:
            return Hit("light", -1 - identity, position, _vec3(normal))
        tangent = None
        if gbuffer.has_tangents:
            tangent = _vec3(direction_from_octahedral(self._read(1, 2)[None])[0])
        return Hit("object", identity, position, _vec3(normal), tangent)

    def shade(
        self,
        gbuffer: GBufferPass,
        lighting: LightingPass,
        features: LightingFeatures,
        frame: CameraFrame,
        size: tuple[int, int],
        x: float,
        y: float,
        faint: float = 0.0,
    ) -> Vec3:
        """Return what ``lighting`` makes of the point there: radiance, or its cost if it counts.

        ``features`` are those of the picture, of a single sample; ``faint`` is the radiance
        that all that is skipped may add up to.
        """
        target = self._draw(gbuffer, frame, size, x, y)
        if self._shaded is None:
            texture = self._ctx.texture((1, 1), 4, dtype="f4")
            self._shaded = self._ctx.framebuffer(color_attachments=[texture])
        surfaces, tangents = target.color_attachments
        assert isinstance(surfaces, moderngl.Texture)
        assert isinstance(tangents, moderngl.Texture)
        # A picture of this pixel alone, whose middle is the point.
        ray = frame.ray(x, y, size)
        pixel = CameraFrame(frame.eye, ray, frame.right / size[0], frame.up / size[1])
        lighting.draw(
            self._shaded, surfaces, tangents if features.tangents else None, features, pixel,
            (0.0, 0.0), None, 0, faint,
        )  # fmt: skip
        raw = self._shaded.read(components=3, dtype="f4")
        return _vec3(np.frombuffer(raw, dtype=np.float32).astype(np.float64))

    def _draw(
        self, gbuffer: GBufferPass, frame: CameraFrame, size: tuple[int, int], x: float, y: float
    ) -> moderngl.Framebuffer:
        """Draw the surface at pixel coordinates; return where."""
        if self._target is None:
            kinds = (4, 2)  # as `app.render.gbuffer` has them
            self._target = self._ctx.framebuffer(
                color_attachments=[self._ctx.texture((1, 1), n, dtype="f4") for n in kinds],
                depth_attachment=self._ctx.depth_renderbuffer((1, 1)),
            )
        width, height = size
        ndc = (2.0 * x / width - 1.0, 1.0 - 2.0 * y / height)
        window = (float(width), float(height), -ndc[0] * width, -ndc[1] * height)
        gbuffer.draw(self._target, frame, window)
        return self._target

    def _read(self, attachment: int, components: int) -> FloatArray:
        assert self._target is not None
        raw = self._target.read(components=components, attachment=attachment, dtype="f4")
        return np.frombuffer(raw, dtype=np.float32).astype(np.float64)

    def release(self) -> None:
        """Release every GPU object."""
        for target in (self._target, self._shaded):
            if target is None:
                continue
            attachments = (*target.color_attachments, target.depth_attachment)
            release_framebuffer(target)
            for attachment in attachments:
                if attachment is not None:
                    attachment.release()
        self._target = self._shaded = None


def direction_from_octahedral(p: FloatArray) -> FloatArray:
    """Return the unit vectors (n, 3) of (n, 2), as ``shaders/common/octahedron.glsl``."""
    z = 1.0 - np.abs(p).sum(axis=-1)
    folded = (1.0 - np.abs(p[:, ::-1])) * np.where(p < 0.0, -1.0, 1.0)
    v = np.column_stack([np.where(z[:, None] < 0.0, folded, p), z])
    return np.asarray(v / np.linalg.norm(v, axis=-1, keepdims=True))


def facing_normal(normal: FloatArray, wo: FloatArray) -> FloatArray:
    """Return normals as ``shaders/passes/lighting.frag`` bends them to face the viewer."""
    missing = np.maximum(1e-4 - np.sum(normal * wo, axis=-1, keepdims=True), 0.0)
    bent = normal + missing * wo
    return np.asarray(bent / np.linalg.norm(bent, axis=-1, keepdims=True))


def turned_tangent(tangent: FloatArray, normal: FloatArray, rotation: FloatArray) -> FloatArray:
    """Return tangents as ``material_tangent`` of ``lighting.frag`` bends and turns them."""
    x = tangent - normal * np.sum(normal * tangent, axis=-1, keepdims=True)
    square = np.sum(x * x, axis=-1, keepdims=True)
    axis = np.where(np.abs(normal[:, :1]) < 0.5, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    other = axis - normal * np.sum(normal * axis, axis=-1, keepdims=True)
    x = np.where(square > 1e-8, x, other)
    x /= np.linalg.norm(x, axis=-1, keepdims=True)
    c, s = np.cos(rotation)[:, None], np.sin(rotation)[:, None]
    return np.asarray(c * x + s * np.cross(normal, x))


def _vec3(values: FloatArray) -> Vec3:
    x, y, z = values.tolist()
    return (x, y, z)
