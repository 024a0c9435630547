"""Points of a picture, and what the GPU makes of each, for measuring: a few at a time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from app.errors import InputError
from app.render.pack import has_curves
from app.render.techniques import AUTOMATIC, find_technique, parse_technique, suited_technique
from app.render.truth import shading_frames
from app.scene import Material, RenderSettings, Scene, Shot

if TYPE_CHECKING:
    from app.render.renderer import Renderer

FloatArray = NDArray[np.float64]

FINEST = 6
"""The most nodes that ``ltc`` can integrate curves with."""
TRIES = 50
"""Random pixels that are looked at for each point wanted, until enough show a surface."""


@dataclass(frozen=True, eq=False)
class Points:
    """Surface points of a picture, and what the GPU makes of them.

    Attributes
    ----------
    place : (n, 2) float64
        Pixel coordinates from the top left.
    position, normal, view, tangent : (n, 3) float64
        World space; view and normal unit; the material's own tangent.
    materials : sequence of n Material
    radiance : (n, 3) float64
        Of one sample at the very place.
    finer : (2, n, 3) float64 or None
        How much the specular and diffuse parts of a white material change without the
        quadrature of curves, where that can be told.
    skips : bool
        Whether lights too faint to see were skipped.
    """

    place: FloatArray
    position: FloatArray
    normal: FloatArray
    view: FloatArray
    tangent: FloatArray
    materials: Sequence[Material]
    radiance: FloatArray
    finer: FloatArray | None
    skips: bool = False

    @property
    def count(self) -> int:
        return len(self.place)


def check_breakdown(technique: str, scene: Scene | None = None) -> None:
    """Raise `InputError` if a technique's error, or that in a scene, cannot be told apart."""
    if technique != AUTOMATIC and find_technique(technique).is_sampled:
        raise InputError(
            f"technique {technique} errs by the noise of its samples alone, expected one that does "
            "not sample"
        )
    for light in scene.lights if scene is not None else ():
        if light.picture is not None:
            raise InputError(
                f"light '{light.name}' has a picture, expected lights of one colour: only of those "
                "is it known which part of an error is whose"
            )


def random_places(size: tuple[int, int], seed: int = 0) -> Iterator[tuple[float, float]]:
    """Yield random pixels' centres without end."""
    rng = np.random.default_rng(seed)
    while True:
        column, row = (int(rng.integers(side)) for side in size)
        yield column + 0.5, row + 0.5


class Gathering:
    """Points of the picture that a renderer made last, gathered a few at a time.

    Parameters
    ----------
    renderer : Renderer
        It has rendered ``shot``; its picture stays as it is.
    places : iterator of (x, y)
        Pixel coordinates to look at, `random_places` or a single one.
    wanted : int
        How many that show a surface.
    """

    def __init__(
        self,
        renderer: Renderer,
        shot: Shot,
        places: Iterator[tuple[float, float]],
        wanted: int,
    ) -> None:
        scene, technique = shot.scene, shot.settings.technique
        check_breakdown(technique, scene)
        self._renderer, self._scene = renderer, scene
        self._skips = shot.settings.cull > 0.0
        self.technique = suited_technique(technique, shades_anisotropic(scene, technique))
        self._places, self._wanted = places, wanted
        self._left = TRIES * wanted
        self._rows: list[tuple[FloatArray, Material]] = []

    @property
    def done(self) -> int:
        return len(self._rows)

    def step(self) -> bool:
        """Look at one more place; return whether that was the last one."""
        place = next(self._places, None)
        self._left -= 1
        if place is None:
            return True
        hit = self._renderer.pick(*place)
        if hit is not None and hit.kind == "object":
            material = self._scene.object_materials()[hit.index]
            tangent = hit.tangent_ws or (0.0, 0.0, 0.0)
            view = np.array(self._scene.camera.eye) - np.array(hit.position_ws)
            view /= np.linalg.norm(view)
            radiance = self._renderer.shade_at(*place)
            row = [*place, *hit.position_ws, *hit.normal_ws, *view, *tangent, *radiance]
            self._rows.append((np.array(row), material))
        return self._left <= 0 or len(self._rows) >= self._wanted

    def points(self) -> Points:
        """Return what was gathered."""
        table = np.array([row for row, _ in self._rows]).reshape(-1, 17)
        materials = [material for _, material in self._rows]
        place, position, normal, view, tangent, radiance = np.split(
            table, [2, 5, 8, 11, 14], axis=1
        )
        tangent = _own_tangents(normal, view, tangent, materials)
        points = Points(
            place, position, normal, view, tangent, materials, radiance, None, self._skips
        )
        choice = parse_technique(self.technique)
        if choice.name == "ltc" and choice.number != FINEST and has_curves(self._scene.lights):
            return replace(points, finer=self._finer(points, str(choice._replace(number=FINEST))))
        return points

    def _finer(self, points: Points, finest: str) -> FloatArray:
        """Return what the technique's own nodes change against the most there can be."""
        alpha = np.array([material.alpha for material in points.materials]).reshape(-1, 2)
        inputs = (points.position, points.normal, points.tangent, points.view, alpha)
        anisotropic = shades_anisotropic(self._scene, self.technique)
        found = [
            self._renderer.probe(
                self._scene, RenderSettings(name), *inputs, anisotropic=anisotropic
            )
            for name in (self.technique, finest)
        ]
        return np.array(
            [found[0][lobe].astype(np.float64) - found[1][lobe] for lobe in ("specular", "diffuse")]
        )


def shades_anisotropic(scene: Scene, technique: str) -> bool:
    """Tell whether lobes are shaded along tangents, as `LightingFeatures.of` does."""
    used = scene.object_materials()
    shades = technique == AUTOMATIC or find_technique(technique).anisotropic
    return shades and any(m.is_anisotropic and any(m.f0) for m in used)


def _own_tangents(
    normal: FloatArray, view: FloatArray, tangent: FloatArray, materials: Sequence[Material]
) -> FloatArray:
    """Return the materials' tangents as ``shaders/passes/lighting.frag`` has them."""
    t = tangent - normal * np.sum(normal * tangent, axis=-1, keepdims=True)
    length = np.linalg.norm(t, axis=-1, keepdims=True)
    # Any will do where there is none: of isotropic surfaces, and at a mesh's poles.
    other = shading_frames(normal, view)[:, 0] if len(normal) else normal
    t = np.where(length > 1e-4, t / np.maximum(length, 1e-4), other)
    turn = np.array([material.rotation for material in materials]).reshape(-1, 1)
    return np.asarray(np.cos(turn) * t + np.sin(turn) * np.cross(normal, t))
