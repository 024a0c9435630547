"""Sampled techniques have no bias: means of independent estimates against float64 integrals.

Pixels of the demo and bench scenes, brushed ones with their tangents; outlines of every kind
have points around them in test_reference_technique.py. The truth is `ltc.reference` and
`ltc.curved_reference`, in which nothing is random. Each pixel is estimated `REPLICAS` times
from sequences that know nothing of each other, so that the spread of these means is the standard
error of their own mean, however evenly points are laid.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2, norm
from scipy.stats import t as student

from app.measure.errors import (
    SurfacePoints,
    choose_points,
    exact_part,
    has_exact_truth,
    lit_evenly,
)
from app.scene import RenderSettings, Scene, Shot
from app.scene_io import demo_scenes, load_scene
from ltc.resources import resource_path
from tests.gl.test_reference_technique import ANALYTIC, FLOAT32

FloatArray = np.ndarray

BENCH = sorted(resource_path("assets", "scenes", "bench").glob("*.json"))
NAMES = [*demo_scenes(), *(f"bench/{path.stem}" for path in BENCH)]
QUICK = ["02-quad", "04-ring", "06-grazing", "09-brushed", "bench/letter-16-curves"]
REPLICAS = 64
SAMPLES = {"reference": 32, "ltc+residual": 8}
"""Few enough that the noise is above what rounding adds to all alike."""
POINTS = 12
UNLIKELY = 1e-5
"""How often a test may fail by chance, all of its pixels together."""


def load(name: str) -> Scene:
    folder, _, stem = name.rpartition("/")
    path = BENCH[0].parent / f"{stem}.json" if folder else demo_scenes()[name]
    return lit_evenly(load_scene(path))


def points_of(renderer, scene: Scene, count: int) -> SurfacePoints:
    renderer.render(Shot(scene, RenderSettings("ggx"), 64, 36))
    return choose_points(renderer, scene, count)


def z_values(
    renderer, scene: Scene, points: SurfacePoints, technique: str, wrong: float = 1.0
) -> FloatArray:
    """Return (2, n) deviations of specular and diffuse in standard errors.

    ``wrong`` is what alpha is multiplied by in the truth.
    """
    many = {name: np.tile(a, (REPLICAS, 1)) for name, a in points.inputs().items()}
    found = renderer.probe(
        scene, RenderSettings(technique, SAMPLES[technique]), anisotropic=points.anisotropic, **many
    )
    given = points.inputs()
    given["alpha"] = wrong * given["alpha"]
    specular, diffuse, _ = exact_part(scene.lights, *given.values(), "ggx", points.anisotropic)
    rounding = FLOAT32 if technique == "reference" else ANALYTIC
    z = []
    for name, want in (("specular", specular), ("diffuse", diffuse)):
        each = found[name][:, 0].astype(np.float64).reshape(REPLICAS, -1)
        error = each.std(axis=0, ddof=1) / np.sqrt(REPLICAS)
        z.append((each.mean(axis=0) - want) / np.hypot(error, rounding))
    return np.array(z)


def bias(z: FloatArray) -> str:
    """Return why such deviations are no chance, or nothing."""
    z = z.ravel()
    largest = student.isf(0.5 * UNLIKELY / z.size, REPLICAS - 1)
    if np.abs(z).max() > largest:
        return f"one is {np.abs(z).max():.1f} standard errors off, expected at most {largest:.1f}"
    # Squares of Student's are larger than those of normal values.
    total = np.sum(z * z) * (REPLICAS - 3) / (REPLICAS - 1)
    if total > chi2.isf(UNLIKELY, z.size):
        return f"squares add up to {total:.0f} for {z.size} pixels"
    mean = z.sum() / np.sqrt(z.size)
    if abs(mean) > norm.isf(0.5 * UNLIKELY):
        return f"their mean is {mean:.1f} standard errors off"
    return ""


@pytest.mark.parametrize("technique", SAMPLES)
def test_no_bias(renderer, technique):
    z = []
    for name in QUICK:
        scene = load(name)
        points = points_of(renderer, scene, POINTS)
        z.append(z_values(renderer, scene, points, technique))
        assert not bias(z[-1]), name
    assert not bias(np.concatenate(z, axis=1))
    # Deviations are those of noise, not drowned in the allowance for rounding.
    specular = np.concatenate(z, axis=1)[0]
    assert np.sqrt(np.mean(specular**2)) > 0.4


@pytest.mark.slow
@pytest.mark.parametrize("technique", SAMPLES)
def test_no_bias_anywhere(renderer, technique):
    """276 pixels of 23 scenes; those with pictures have a test in test_pictures.py."""
    z = []
    for scene in filter(has_exact_truth, map(load, NAMES)):
        points = points_of(renderer, scene, POINTS)
        z.append(z_values(renderer, scene, points, technique))
    every = np.concatenate(z, axis=1)
    assert len(z) >= 20
    assert every.shape[1] >= 200
    assert not bias(every)


@pytest.mark.parametrize("wrong", [0.97, 1.03])
@pytest.mark.parametrize("technique", SAMPLES)
def test_a_slightly_wrong_lobe_is_rejected(renderer, technique, wrong):
    """Alpha 3 % off, which no picture shows."""
    scene = load("02-quad")
    points = points_of(renderer, scene, 4 * POINTS)
    assert not bias(z_values(renderer, scene, points, technique))
    assert bias(z_values(renderer, scene, points, technique, wrong))
