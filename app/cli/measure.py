"""What ``bench`` and ``report`` measure of a shot: times of passes, errors, evaluations.

Errors are those of the integration at random pixels' surface points, against integrals in
float64 along the very curves (`app.render.truth`).
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from app.cli.common import Steps
from app.render.techniques import find_technique
from app.render.truth import Lobe, exact_radiance, shading_frames
from app.scene import Scene, Shot

if TYPE_CHECKING:
    import moderngl

    from app.render.renderer import Renderer

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Quartiles:
    """Of one pass's times [ms]."""

    median: float
    q1: float
    q3: float
    repeats: int

    @classmethod
    def of(cls, times: list[float]) -> Quartiles:
        q1, median, q3 = np.quantile(times, (0.25, 0.5, 0.75))
        return cls(float(median), float(q1), float(q3), len(times))


@dataclass(frozen=True)
class Errors:
    """Absolute errors at ``points`` pixels, of lights with radiance 1 on a white material."""

    mean: float
    p95: float
    max: float
    points: int

    @classmethod
    def of(cls, found: NDArray[np.float32], truth: FloatArray) -> Errors:
        errors = np.abs(found.astype(np.float64) - truth).max(axis=1)
        p95 = float(np.quantile(errors, 0.95))
        return cls(float(errors.mean()), p95, float(errors.max()), len(errors))


def mean_evaluations(renderer: Renderer, shot: Shot) -> float | None:
    """Return how often a pixel that shows a surface evaluates the contour integral, on average."""
    renderer.render(replace(shot, settings=replace(shot.settings, view="cost")))
    pixels = len(renderer.surfaces().index)
    return float(renderer.radiance()[..., 0].sum(dtype=np.float64)) / pixels if pixels else None


def own_lobe(technique: str) -> Lobe:
    """Return the lobe whose integral a technique approximates."""
    return "ltc" if find_technique(technique).has_tables else "ggx"


class Exact:
    """The truth at random pixels of a scene, computed once for all techniques."""

    def __init__(self, renderer: Renderer, points: int) -> None:
        self._renderer = renderer
        self._points = points
        self._scene: Scene | None = None
        self._inputs: dict[str, FloatArray] = {}
        self._truth: dict[Lobe, dict[str, FloatArray]] = {}
        self._anisotropic = False

    def errors(self, shot: Shot, lobe: Lobe | None = None) -> dict[str, Errors]:
        """Return the errors of the shot that was rendered last; empty if it shows no surface.

        Parameters
        ----------
        lobe : {"ltc", "ggx"}, optional
            The truth to compare with; by default `own_lobe`, what the technique approximates.
        """
        lights = (light for light in shot.scene.lights if any(light.radiance))
        lit = tuple(replace(light, radiance=(1.0, 1.0, 1.0)) for light in lights)
        scene = replace(shot.scene, lights=lit)
        if scene != self._scene:
            self._scene, self._truth = scene, {}
            self._choose(scene)
        if not len(self._inputs["position"]):
            return {}
        found = self._renderer.probe(
            scene, shot.settings, anisotropic=self._anisotropic, **self._inputs
        )
        truth = self._exact(scene, lobe or own_lobe(shot.settings.technique))
        return {name: Errors.of(found[name], truth[name]) for name in truth}

    def _choose(self, scene: Scene) -> None:
        """Choose pixels; what the probe gets is rounded first, so that both see the same points."""
        seen = self._renderer.surfaces()
        rng = np.random.default_rng(0)
        count = min(self._points, len(seen.index))
        which = rng.choice(len(seen.index), count, replace=False)
        alphas = np.array([m.alpha for m in scene.object_materials()]).reshape(-1, 2)
        self._anisotropic = seen.tangent is not None
        if seen.tangent is not None:
            tangent = seen.tangent[which]
        else:
            # Without the mesh's own tangents there is but the isotropic lobe of the same area.
            alphas = np.sqrt(alphas.prod(axis=1, keepdims=True)) * np.ones(2)
            tangent = shading_frames(seen.normal[which], seen.view[which])[:, 0]
        inputs = {
            "position": seen.position[which],
            "normal": seen.normal[which],
            "tangent": tangent,
            "view": seen.view[which],
            "alpha": alphas[seen.index[which]],
        }
        self._inputs = {
            name: array.astype(np.float32).astype(np.float64) for name, array in inputs.items()
        }

    def _exact(self, scene: Scene, lobe: Lobe) -> dict[str, FloatArray]:
        if lobe not in self._truth:
            normal, view = (
                array / np.linalg.norm(array, axis=1, keepdims=True)
                for array in (self._inputs["normal"], self._inputs["view"])
            )
            alpha = self._inputs["alpha"]
            specular, diffuse = exact_radiance(
                scene.lights,
                self._inputs["position"],
                normal,
                view,
                alpha if self._anisotropic else alpha[:, 0],
                lobe,
                self._inputs["tangent"] if self._anisotropic else None,
            )
            self._truth[lobe] = {"specular": specular, "diffuse": diffuse}
        return self._truth[lobe]


def measure_passes(
    ctx: moderngl.Context,
    renderer: Renderer,
    shot: Shot,
    warm_up: int,
    repeats: int,
    steps: Steps | None = None,
) -> tuple[dict[str, Quartiles], Quartiles]:
    """Render a shot ``warm_up`` and then ``repeats`` times.

    Returns
    -------
    passes : dict of Quartiles
        Times [ms] by name: of the GPU by timer queries, or by the wall clock, whichever
        ``renderer.timing_source`` says.
    wall : Quartiles
        Of the whole frame with a glFinish [ms].
    """
    return measure_in_turn(ctx, [renderer], shot, warm_up, repeats, steps)[0]


def measure_in_turn(
    ctx: moderngl.Context,
    renderers: Sequence[Renderer],
    shot: Shot,
    warm_up: int,
    repeats: int,
    steps: Steps | None = None,
) -> list[tuple[dict[str, Quartiles], Quartiles]]:
    """Render a shot with several renderers, a frame each in turn.

    What else the machine does then disturbs all alike. Returns for each what
    `measure_passes` does.
    """
    before = steps.count if steps is not None else 0
    times: list[dict[str, list[float]]] = [{} for _ in renderers]
    wall: list[list[float]] = [[] for _ in renderers]
    for index in range((warm_up + repeats) * len(renderers)):
        which = index % len(renderers)
        renderer = renderers[which]
        ctx.finish()
        start = time.perf_counter()
        renderer.render(shot)
        _ = renderer.texture  # draws the display pass
        ctx.finish()
        elapsed = 1e3 * (time.perf_counter() - start)
        figures = renderer.timings()
        if renderer.timing_source == "wall clock":
            figures.pop("cpu", None)  # it would contain the passes
        if index >= warm_up * len(renderers):
            wall[which].append(elapsed)
            for key, value in figures.items():
                times[which].setdefault(key, []).append(value)
        if steps is not None:
            steps.done(before + index + 1)
    return [
        ({key: Quartiles.of(values) for key, values in passes.items()}, Quartiles.of(frames))
        for passes, frames in zip(times, wall, strict=True)
    ]
