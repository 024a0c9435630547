"""How far a technique is from the truth, at random pixels of a picture.

Errors are those of the integration alone: each pixel's surface point is given a white material
(F = 1, albedo 1) and all lights radiance 1. The truth is the integral in float64 along the very
outlines (`app.render.truth`), which any executor can compute in parts; or, as a second opinion,
what the technique ``reference`` converges to, with its standard error.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor, as_completed
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from app.measure.entries import Entry
from app.render.techniques import parse_technique
from app.render.truth import Lobe, exact_radiance, shading_frames
from app.scene import AreaLight, RenderSettings, Scene, Shot

if TYPE_CHECKING:
    from app.render.renderer import Renderer

FloatArray = NDArray[np.float64]

POINTS_A_TASK = 16
"""Small enough to share out among many workers: points of hundreds of curves take 0.1 s each."""

CHECKED = 8
"""One point in so many is integrated again, finer: the difference says how exact the truth is."""

REPLICAS = 8
"""Independent estimates of a sampled truth, whose spread is its standard error."""


@dataclass(frozen=True, eq=False)
class SurfacePoints:
    """Points of surfaces as the probe takes them: float32 values, in float64.

    ``position``, ``normal``, ``tangent`` and ``view`` are (n, 3) in world space, all but the
    first unit; ``alpha`` is (n, 2). ``anisotropic`` says whether the tangents mean something.
    """

    position: FloatArray
    normal: FloatArray
    tangent: FloatArray
    view: FloatArray
    alpha: FloatArray
    anisotropic: bool

    def __len__(self) -> int:
        return len(self.position)

    def inputs(self, some: slice | NDArray[np.int64] = slice(None)) -> dict[str, FloatArray]:
        """Return what `Renderer.probe` takes, of all points or some."""
        names = ("position", "normal", "tangent", "view", "alpha")
        return {name: getattr(self, name)[some] for name in names}


@dataclass(frozen=True, eq=False)
class Truth:
    """Radiance (n,) for F = 1 and albedo 1, and the error that it may itself have, absolute.

    That is the largest difference from a finer integral, or, of a truth that was ``sampled``, the
    largest standard error.
    """

    specular: FloatArray
    diffuse: FloatArray
    uncertainty: float
    sampled: bool = False


@dataclass(frozen=True)
class Errors:
    """Absolute errors at ``points`` pixels, of lights with radiance 1 on a white material."""

    mean: float
    p95: float
    max: float
    points: int

    @classmethod
    def of(cls, found: NDArray[np.float32], truth: FloatArray) -> Errors:
        """Return the errors of radiance (n, 3), the same in all channels, to its truth (n,)."""
        errors = np.abs(found.astype(np.float64) - truth[:, None]).max(axis=1)
        p95 = float(np.quantile(errors, 0.95))
        return cls(float(errors.mean()), p95, float(errors.max()), len(errors))


def lit_evenly(scene: Scene) -> Scene:
    """Return the scene with every light that shines at radiance 1."""
    lights = (light for light in scene.lights if any(light.radiance))
    return replace(scene, lights=tuple(replace(one, radiance=(1.0, 1.0, 1.0)) for one in lights))


def choose_points(renderer: Renderer, scene: Scene, count: int) -> SurfacePoints:
    """Return random pixels' points of the picture rendered last, always the same ones.

    They are rounded first, so that both sides of a comparison see the same points.
    """
    seen = renderer.surfaces()
    rng = np.random.default_rng(0)
    which = rng.choice(len(seen.index), min(count, len(seen.index)), replace=False)
    alphas = np.array([m.alpha for m in scene.object_materials()]).reshape(-1, 2)
    normal, view = seen.normal[which], seen.view[which]
    if seen.tangent is not None:
        tangent = seen.tangent[which]
    else:
        # Without the mesh's own tangents there is but the isotropic lobe of the same area.
        alphas = np.sqrt(alphas.prod(axis=1, keepdims=True)) * np.ones(2)
        tangent = shading_frames(normal, view)[:, 0]
    position, normal, tangent, view, alpha = (
        array.astype(np.float32).astype(np.float64)
        for array in (seen.position[which], normal, tangent, view, alphas[seen.index[which]])
    )
    return SurfacePoints(position, normal, tangent, view, alpha, seen.tangent is not None)


def has_exact_truth(scene: Scene) -> bool:
    """Return whether `exact_truth` integrates what a scene's lights send: not their pictures."""
    return not any(light.picture is not None and any(light.radiance) for light in scene.lights)


def own_lobe(entry: Entry) -> Lobe | None:
    """Return the lobe whose integral a technique approximates, None if it has no such aim."""
    if entry.looks_up:
        return str(parse_technique(entry.technique).without_curves)
    return None if entry.name == "representative-point" else "ggx"


def exact_part(
    lights: Sequence[AreaLight],
    position: FloatArray,
    normal: FloatArray,
    tangent: FloatArray,
    view: FloatArray,
    alpha: FloatArray,
    lobe: Lobe,
    anisotropic: bool,
) -> tuple[FloatArray, FloatArray, float]:
    """Return specular and diffuse radiance (n,) and how far the first is from a finer integral.

    A plain function of arrays, that executors can send to other processes and machines.
    """
    n, wo = (array / np.linalg.norm(array, axis=1, keepdims=True) for array in (normal, view))

    def radiance(some: slice, finer: bool) -> tuple[FloatArray, FloatArray]:
        alphas = alpha[some] if anisotropic else alpha[some, 0]
        along = tangent[some] if anisotropic else None
        return exact_radiance(lights, position[some], n[some], wo[some], alphas, lobe, along, finer)

    specular, diffuse = radiance(slice(None), False)
    some = slice(0, None, CHECKED)
    apart = np.abs(radiance(some, True)[0] - specular[some])
    return specular[:, 0], diffuse[:, 0], float(apart.max(initial=0.0))


def exact_truth(
    scene: Scene,
    points: SurfacePoints,
    lobe: Lobe,
    executor: Executor | None = None,
    on_done: Callable[[int], None] | None = None,
) -> Truth:
    """Return the integrals of a lobe over a scene's lights, as they are, in float64.

    Parameters
    ----------
    executor : Executor, optional
        Computes the parts; without one they are computed here, one after the other.
    on_done : callable, optional
        Is told how many more points are done, whenever some are.
    """
    specular, diffuse = np.zeros((2, len(points)))
    uncertainty = 0.0
    parts = [slice(start, start + POINTS_A_TASK) for start in range(0, len(points), POINTS_A_TASK)]

    def keep(part: slice, result: tuple[FloatArray, FloatArray, float]) -> None:
        nonlocal uncertainty
        specular[part], diffuse[part] = result[:2]
        uncertainty = max(uncertainty, result[2])
        if on_done is not None:
            on_done(len(result[0]))

    def arguments(part: slice) -> tuple[object, ...]:
        arrays = points.inputs(part).values()
        return (scene.lights, *arrays, lobe, points.anisotropic)

    if executor is None:
        for part in parts:
            keep(part, exact_part(*arguments(part)))  # type: ignore[arg-type]
    else:
        tasks = {executor.submit(exact_part, *arguments(part)): part for part in parts}  # type: ignore[arg-type]
        try:
            for task in as_completed(tasks):
                keep(tasks[task], task.result())
        finally:
            for task in tasks:
                task.cancel()
    return Truth(specular, diffuse, uncertainty)


def sampled_truth(renderer: Renderer, scene: Scene, points: SurfacePoints, samples: int) -> Truth:
    """Return what ``reference`` converges to, and its largest standard error.

    Parameters
    ----------
    samples : int
        Of a point; shared out to `REPLICAS` estimates that know nothing of each other.
    """
    many = {name: np.tile(a, (REPLICAS, 1)) for name, a in points.inputs().items()}
    settings = RenderSettings("reference", max(samples // REPLICAS, 1))
    found = renderer.probe(scene, settings, anisotropic=points.anisotropic, **many)
    means, worst = [], 0.0
    for name in ("specular", "diffuse"):
        each = found[name][:, 0].astype(np.float64).reshape(REPLICAS, -1)
        means.append(each.mean(axis=0))
        error = each.std(axis=0, ddof=1) / np.sqrt(REPLICAS)
        worst = max(worst, float(error.max(initial=0.0)))
    return Truth(means[0], means[1], worst, sampled=True)


def probe_errors(
    renderer: Renderer, scene: Scene, entry: Entry, points: SurfacePoints, truth: Truth
) -> dict[str, Errors]:
    """Return the errors of an entry's ``specular`` and ``diffuse``; none without points."""
    if not len(points):
        return {}
    found = renderer.probe(
        scene, entry.settings(), anisotropic=points.anisotropic, **points.inputs()
    )
    return {
        "specular": Errors.of(found["specular"], truth.specular),
        "diffuse": Errors.of(found["diffuse"], truth.diffuse),
    }


def mean_evaluations(renderer: Renderer, shot: Shot) -> float | None:
    """Return how often a pixel that shows a surface evaluates the contour integral, on average."""
    renderer.render(replace(shot, settings=replace(shot.settings, view="cost", samples=1)))
    pixels = len(renderer.surfaces().index)
    if not pixels:
        return None
    return float(renderer.radiance()[..., 0].sum(dtype=np.float64)) / pixels * shot.settings.samples


class Exact:
    """The truth at random pixels of a scene, computed once for all techniques."""

    def __init__(self, renderer: Renderer, points: int) -> None:
        self._renderer = renderer
        self._count = points
        self._scene: Scene | None = None
        self._points: SurfacePoints | None = None
        self._truth: dict[Lobe, Truth] = {}

    def errors(self, shot: Shot, entry: Entry) -> dict[str, Errors]:
        """Return the errors of the shot that was rendered last to the integral that its technique
        approximates, or to GGX; empty if it shows no surface.
        """
        scene = lit_evenly(shot.scene)
        if self._points is None or scene != self._scene:
            self._scene, self._truth = scene, {}
            self._points = choose_points(self._renderer, scene, self._count)
        lobe = own_lobe(entry) or "ggx"
        if lobe not in self._truth:
            self._truth[lobe] = exact_truth(scene, self._points, lobe)
        return probe_errors(self._renderer, scene, entry, self._points, self._truth[lobe])
