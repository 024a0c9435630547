"""Techniques that sample: their mean is the exact integral, and their noise falls as it must.

The truths are deterministic float64 integrals that share nothing with it:
`app.render.truth` along curves, and those of `tests.gl.test_truth` over polygons.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from app.outline import resolve
from app.presets import disk, ring
from app.render import renderer as renderer_module
from app.render.truth import exact_radiance
from app.scene import (
    AreaLight,
    Material,
    Outline,
    Plane,
    PolygonContour,
    RenderSettings,
    Scene,
    Shot,
)
from ltc.reference import specular_integral_batch
from tests.gl import test_truth
from tests.gl.scenes import FRAME, SQUARE
from tests.gl.test_curves import about, letter, moved
from tests.gl.test_probe import FloatArray, Points, unit

LARGEST_Z = 4.5
"""Standard errors: 7e-6 of normal values are farther off, of some 10,000 looked at here."""
LARGEST_SAMPLE = 3.0
"""Of a light of radiance 1: three directions, each at most the albedo."""
FLOAT32 = 2e-5
"""Absolute, for what rounding adds to each sample alike."""
ANALYTIC = 1e-4
"""The same for the part of `ltc+residual` that is no estimate: float32 along the outline."""
TECHNIQUES = ["reference", "ltc+residual"]

STAR = Outline(
    (
        PolygonContour(
            tuple(
                (float(r * np.cos(a)), float(r * np.sin(a)))
                for a, r in zip(np.arange(10) * np.pi / 5, [1.0, 0.4] * 5, strict=True)
            )
        ),
    )
)
SLANTED = Plane((0.2, 0.1, -0.3), (0.8, 0.1, 0.2), (-0.1, 0.7, 0.4))
ONE = (1.0, 1.0, 1.0)
SCENES = {
    "square": (AreaLight("l", SQUARE, SLANTED, ONE, two_sided=True),),
    "polygon with a hole": (AreaLight("l", FRAME, SLANTED, ONE, two_sided=True),),
    "star, one-sided": (AreaLight("l", STAR, Plane(), ONE),),
    "disk": (AreaLight("l", disk(), SLANTED, ONE, two_sided=True),),
    "ring, one-sided": (AreaLight("l", ring(), Plane(), ONE),),
    "two round holes": (
        AreaLight(
            "l",
            Outline(
                (
                    *SQUARE.contours,
                    *moved(disk(), -0.45, 0.0, 0.4),
                    *moved(disk(), 0.5, 0.3, 0.3),
                )
            ),
            SLANTED,
            ONE,
            two_sided=True,
        ),
    ),
    "letter": (AreaLight("l", letter("&"), SLANTED, ONE, two_sided=True),),
    "strip": (
        AreaLight("l", SQUARE, Plane((0, 0, 0), (2.0, 0, 0), (0, 0.02, 0)), ONE, two_sided=True),
    ),
    "two lights": (
        AreaLight("a", SQUARE, SLANTED, ONE, two_sided=True),
        AreaLight("b", FRAME, Plane((0.5, 1.5, 0.0), (0.3, 0, 0), (0, 0, 0.3)), (0.4, 0.2, 0.6)),
    ),
    "a curved and a straight light, and a dark one": (
        AreaLight("a", disk(0.7), SLANTED, ONE, two_sided=True),
        AreaLight("dark", STAR, Plane(), (0.0, 0.0, 0.0)),
        AreaLight("b", STAR, Plane((0.5, 1.0, 0.0)), (0.2, 0.9, 0.1), two_sided=True),
    ),
}


def unlikely(
    mean: FloatArray,
    error: FloatArray,
    exact: FloatArray,
    samples: int,
    rounding: float = FLOAT32,
) -> str:
    """Return why such means of samples are not those of ``exact``, or nothing.

    ``mean``, their standard ``error`` and ``exact`` are (n,), for light of radiance 1. A value
    that is rare among the samples may have been missed: the error knows nothing of it.
    """
    z = (mean - exact) / np.hypot(error, LARGEST_SAMPLE / samples + rounding)
    i = int(np.abs(z).argmax())
    if abs(z[i]) > LARGEST_Z:
        return f"point {i}: {mean[i]:.5f} +- {error[i]:.5f}, expected {exact[i]:.5f}"
    bias = float(np.mean(mean - exact))
    doubt = float(np.sqrt(np.sum(error**2)) / len(error)) + rounding
    if abs(bias) > LARGEST_Z * doubt:
        return f"mean {mean.mean():.6f} +- {doubt:.6f}, expected {exact.mean():.6f}"
    return ""


def estimates(
    renderer,
    lights: tuple[AreaLight, ...],
    points: Points,
    samples: int,
    technique: str = "reference",
) -> tuple[tuple[FloatArray, FloatArray], ...]:
    """Return (mean, standard error), (n,) each, of specular and diffuse red."""
    many = [
        np.repeat(a, samples, axis=0)
        for a in (points.position, points.normal, points.tangent, points.view, points.alpha)
    ]
    out = renderer.probe(Scene(lights=lights), RenderSettings(technique), *many)
    found = []
    for name in ("specular", "diffuse"):
        values = out[name][:, 0].astype(np.float64).reshape(-1, samples)
        assert np.all(np.isfinite(values))
        largest = LARGEST_SAMPLE * sum(light.radiance[0] for light in lights)
        assert values.min() >= (-largest if technique == "ltc+residual" else 0.0)
        assert values.max() <= largest
        found.append((values.mean(axis=1), values.std(axis=1, ddof=1) / np.sqrt(samples)))
    return tuple(found)


def exact(lights: tuple[AreaLight, ...], points: Points, stretch: float = 1.0):
    at = points.rounded()
    alpha = stretch * at.alpha[:, 0]
    both = exact_radiance(lights, at.position, at.normal, at.view, alpha, "ggx")
    return tuple(value[:, 0] for value in both)


def some_points(lights: tuple[AreaLight, ...], seed: int, count: int = 24, **keywords) -> Points:
    return about(np.random.default_rng(seed), lights[0], count, **keywords)


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize(
    ("theta", "alpha"),
    [((0.0, 80.0), (0.05, 1.0)), ((0.0, 80.0), (0.001, 0.05)), ((80.0, 89.0), (0.02, 1.0))],
    ids=["rough", "sharp", "grazing"],
)
@pytest.mark.parametrize("technique", TECHNIQUES)
def test_points_converge_to_the_exact_integral(renderer, technique, name, theta, alpha):
    lights, samples = SCENES[name], 2048
    points = some_points(lights, len(name), theta=theta, alpha=alpha)
    found = estimates(renderer, lights, points, samples, technique)
    rounding = FLOAT32 if technique == "reference" else ANALYTIC
    for (mean, error), want in zip(found, exact(lights, points), strict=True):
        assert not unlikely(mean, error, want, samples, rounding)
        assert want.max() > 0.05


@pytest.mark.parametrize("stretch", [0.95, 1.05])
@pytest.mark.parametrize("technique", TECHNIQUES)
def test_a_wrong_lobe_is_rejected(renderer, technique, stretch):
    lights, samples = SCENES["disk"], 12000
    points = some_points(lights, 3, alpha=(0.1, 0.5))
    (mean, error), _ = estimates(renderer, lights, points, samples, technique)
    assert not unlikely(mean, error, exact(lights, points)[0], samples)
    assert unlikely(mean, error, exact(lights, points, stretch)[0], samples)


@pytest.mark.parametrize("alpha", [(0.05, 0.4), (1.0, 0.02)])
@pytest.mark.parametrize("technique", TECHNIQUES)
def test_anisotropic_points(renderer, technique, alpha):
    (lamp,), samples = SCENES["square"], 2048
    points = some_points((lamp,), 5)
    points = replace(points, alpha=np.tile(alpha, (len(points.position), 1)))
    (mean, error), _ = estimates(renderer, (lamp,), points, samples, technique)
    at = points.rounded()
    x = unit(at.tangent - at.normal * np.sum(at.normal * at.tangent, axis=-1, keepdims=True))
    frame = np.stack([x, np.cross(at.normal, x), at.normal], axis=-2)
    origin, u, v = (np.array(a) for a in (lamp.plane.origin, lamp.plane.u, lamp.plane.v))
    (corners,) = resolve(lamp.outline)
    world = origin + corners[:, :1] * u + corners[:, 1:] * v
    local = np.einsum("pij,pkj->pki", frame, world[None] - at.position[:, None])
    view = np.einsum("pij,pj->pi", frame, at.view)
    want, _ = specular_integral_batch(local, view, at.alpha[:, 0], at.alpha[:, 1])
    assert not unlikely(mean, error, np.abs(want), samples)
    swapped, _ = specular_integral_batch(local, view, at.alpha[:, 1], at.alpha[:, 0])
    assert unlikely(mean, error, np.abs(swapped), samples)


@pytest.fixture
def still(monkeypatch):
    """Keep all samples at the pixel's centre, where the truth is."""
    monkeypatch.setattr(renderer_module, "pixel_offset", lambda index: (0.0, 0.0))


def frames(renderer, shot: Shot, count: int) -> FloatArray:
    """Return the samples of a picture one by one, (count, h, w, 3)."""
    found, before = [], np.zeros(3)
    for n in range(1, count + 1):
        assert renderer.accumulate(shot, count) == n
        mean = renderer.radiance().astype(np.float64)
        found.append(n * mean - (n - 1) * before)
        before = mean
    return np.array(found)


BRUSHED = Material("floor", tuple(test_truth.DIFFUSE), tuple(test_truth.F0), (0.05, 0.4), 0.6)
DARK = (0.0, 0.0, 0.0)


def floor(material: Material, height: float = 0.4, technique: str = "reference") -> Shot:
    scene = replace(test_truth.scene((0.3, 0.3), height), materials=(material,))
    return Shot(scene, RenderSettings(technique), test_truth.WIDTH, test_truth.HEIGHT)


def mismatch(pictures: FloatArray, exact: FloatArray, seen: FloatArray) -> str:
    """Return in which colour samples (n, h, w, 3) are not those of ``exact``, and why."""
    count = len(pictures)
    assert np.all(np.isfinite(pictures))
    assert not np.any(pictures[:, ~seen])
    for channel, radiance in enumerate(test_truth.RADIANCE):
        values = pictures[:, seen, channel] / radiance
        error = values.std(axis=0, ddof=1) / np.sqrt(count)
        want = exact[seen][:, channel] / radiance
        if why := unlikely(values.mean(axis=0), error, want, count):
            return f"channel {channel}: {why}"
    return ""


@pytest.mark.parametrize("height", [1.5, 0.4], ids=["above", "crossing"])
@pytest.mark.parametrize("technique", TECHNIQUES)
def test_pictures_of_both_lobes_with_fresnel(renderer, still, technique, height):
    """A brushed floor, so the tangents of the G-buffer count too."""
    shot = floor(BRUSHED, height, technique)
    exact, seen = test_truth.exact(shot)
    pictures = frames(renderer, shot, 200)
    assert not mismatch(pictures, exact, seen)
    assert mismatch(pictures, 1.05 * exact, seen)


def test_pictures_of_metal(renderer, still, monkeypatch):
    monkeypatch.setattr(test_truth, "DIFFUSE", np.zeros(3))
    shot = floor(replace(BRUSHED, diffuse=DARK, alpha=(0.1, 0.1)))
    assert not mismatch(frames(renderer, shot, 200), *test_truth.exact(shot))


def test_pictures_of_lambert_alone(renderer, still):
    """Its form factor is exact in every other technique."""
    material = replace(BRUSHED, f0=DARK)
    seen = test_truth.exact(floor(material))[1]
    renderer.render(floor(material, technique="ltc"))
    exact = renderer.radiance().astype(np.float64)
    assert not mismatch(frames(renderer, floor(material), 200), exact, seen)


def test_noise_falls_faster_than_the_root_of_the_samples(renderer, still):
    shot = floor(BRUSHED)
    exact, seen = test_truth.exact(shot)
    deviation = []
    for samples in (8, 32, 128, 512):
        renderer.render(replace(shot, settings=RenderSettings("reference", samples)))
        error = (renderer.radiance() - exact)[seen] / test_truth.RADIANCE
        deviation.append(np.sqrt(np.mean(error**2)))
    # Random numbers halve it, to 4 %: 700 pixels know their deviation to 3 %.
    assert np.all(np.divide(deviation[:-1], deviation[1:]) > 2.3)


def test_same_shot_same_bytes(renderer):
    shot = replace(floor(BRUSHED), settings=RenderSettings("reference", 3))
    pictures = []
    for _ in range(2):
        renderer.render(shot)
        pictures.append(renderer.radiance())
    np.testing.assert_array_equal(*pictures)
    renderer.render(replace(shot, settings=RenderSettings("reference", 1)))
    assert np.any(renderer.radiance() != pictures[0])


def test_probe_averages_samples(renderer):
    lights = SCENES["two lights"]
    points = some_points(lights, 9, count=200)
    want = exact(lights, points)
    errors = []
    for samples in (4, 64):
        out = renderer.probe(
            Scene(lights=lights),
            RenderSettings("reference", samples),
            points.position,
            points.normal,
            points.tangent,
            points.view,
            points.alpha,
        )
        errors.append([np.std(out[k][:, 0] - w) for k, w in zip(out, want, strict=True)])
    assert np.all(np.divide(*errors) > 4.0)


@pytest.mark.parametrize("lamp", [SCENES["square"], SCENES["disk"]], ids=["polygon", "curved"])
@pytest.mark.parametrize("material", [BRUSHED, replace(BRUSHED, f0=DARK)], ids=["glossy", "matt"])
def test_compiled_where_it_is_chosen_only(renderer, lamp, material):
    def files(technique: str) -> set[str]:
        shot = floor(material, technique=technique)
        plan = renderer.plan(replace(shot, scene=replace(shot.scene, lights=lamp)))
        return set(next(p.files for p in plan.programs if p.name == "lighting"))

    estimate = {"reference/estimate.glsl", "common/sequence.glsl"}
    analytic = {"ltc/shade.glsl", "ltc/contour.glsl"}
    chosen = files("reference")
    assert estimate <= chosen
    assert not {*analytic, "ltc/lobe.glsl", "ltc/tree.glsl"} & chosen
    assert ("ltc/curve.glsl" in chosen) is (lamp is SCENES["disk"])
    both = files("ltc+residual")
    assert analytic <= both
    # Lambert has no residual.
    assert (estimate <= both) is (material is BRUSHED)
    for other in ("auto", "ltc", "ggx"):
        assert not estimate & files(other)


def test_residual_leaves_less_noise(renderer, still):
    """And none at all where all is Lambert's."""
    shot = floor(replace(BRUSHED, alpha=(0.2, 0.2)))
    exact, seen = test_truth.exact(shot)
    deviation = []
    for technique in TECHNIQUES:
        renderer.render(replace(shot, settings=RenderSettings(technique, 16)))
        deviation.append(np.sqrt(np.mean((renderer.radiance() - exact)[seen] ** 2)))
    assert deviation[1] < 0.5 * deviation[0]
    matt = replace(BRUSHED, f0=DARK)
    pictures = []
    for technique in ("ltc", "ltc+residual"):
        renderer.render(floor(matt, technique=technique))
        pictures.append(renderer.radiance())
    np.testing.assert_array_equal(*pictures)


def test_evaluations_are_counted(renderer):
    """One for each edge or curve that a direction's place on the plane is compared with."""
    shot = floor(BRUSHED)
    renderer.render(replace(shot, settings=RenderSettings("reference", 1, "cost")))
    counts = renderer.radiance()[test_truth.exact(shot)[1]][:, 0]
    assert set(np.unique(counts)) == {0.0, 4.0, 8.0, 12.0}
