"""Variants of ``ltc`` that are there to be measured: in float32 against the same in float64."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from app.render.techniques import VARIANTS
from app.render.truth import exact_radiance
from app.scene import Outline, Plane, PolygonContour, RenderSettings, Scene, Shot
from tests.gl.test_probe import Points, on_light, random_light, random_points
from tests.gl.test_techniques import BRUSHED, PLAIN, shot

COUNT = 200


def points_about(rng: np.random.Generator, lamp, theta=(0.0, 88.0)) -> Points:
    """Half of them aimed at the light or its outline, all of them in the light's reach."""
    aim = on_light(rng, lamp, COUNT, 0.4)
    position = rng.uniform(-2.0, 2.0, (COUNT, 3))
    return random_points(rng, COUNT, position, alpha=(0.02, 1.0), theta=theta, mirror=aim)


def compare(renderer, lamp, points: Points, technique: str, anisotropic: bool):
    """Return the GPU's specular and diffuse, and the definition's, (n,) each."""
    at = points.rounded()
    alpha = points.alpha * ([1.0, 0.6] if anisotropic else [1.0, 1.0])
    out = renderer.probe(
        Scene(lights=(lamp,)), RenderSettings(technique), points.position, points.normal,
        points.tangent, points.view, alpha, anisotropic,
    )  # fmt: skip
    alpha = alpha.astype(np.float32).astype(np.float64)
    specular, diffuse = exact_radiance(
        (lamp,), at.position, at.normal, at.view, alpha if anisotropic else alpha[:, 0],
        technique, points.tangent.astype(np.float32) if anisotropic else None,
    )  # fmt: skip
    found = (out[name][:, 0].astype(np.float64) for name in ("specular", "diffuse"))
    return (*found, specular[:, 0], diffuse[:, 0])


# Those of pictures: test_pictures.py.
@pytest.mark.parametrize(
    "variant", [name for name, changes in VARIANTS.items() if not changes.is_of_pictures]
)
def test_variants_are_what_python_says(renderer, variant):
    rng = np.random.default_rng(71)
    changed = 0.0
    for index in range(8):
        lamp = random_light(rng, size=float(10 ** rng.uniform(-0.5, 0.7)), two_sided=index % 2 > 0)
        points = points_about(rng, lamp)
        technique = f"ltc/{variant}"
        specular, diffuse, wanted, lambert = compare(renderer, lamp, points, technique, False)
        # As for ltc itself, see test_probe.py; and what is cut off need not be so small.
        assert np.abs(specular - np.minimum(wanted, wanted.max())).max() <= 2e-4
        assert np.abs(diffuse - lambert).max() <= 1e-5
        plain = compare(renderer, lamp, points, "ltc", False)
        changed = max(changed, float(np.abs(plain[0] - specular).max()))
    assert changed > 1e-3, "a variant that changes nothing measures nothing"


@pytest.mark.parametrize("variant", ["undivided", "published-clip"])
def test_they_hold_for_brushed_surfaces(renderer, variant):
    rng = np.random.default_rng(72)
    for _ in range(4):
        lamp = random_light(rng, two_sided=True)
        points = points_about(rng, lamp, theta=(0.0, 80.0))
        specular, _, wanted, _ = compare(renderer, lamp, points, f"ltc/{variant}", True)
        # The sampler's interpolation of half floats, see test_anisotropic.py.
        assert np.quantile(np.abs(specular - wanted), 0.98) <= 2e-3


def test_light_from_below_leaks_in_as_published(renderer):
    """A light wholly below the surface: nothing, but as published something.

    Most of a smooth lobe at grazing view, of which 6 % lie below.
    """
    square = PolygonContour(((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)))
    plane = Plane((0.0, -0.5, -2.0), (0.4, 0.0, 0.0), (0.0, 0.4, 0.0))
    lamp = replace(random_light(np.random.default_rng(0)), outline=Outline((square,)), plane=plane)
    theta = np.radians(85.0)
    view = np.array([[0.0, np.cos(theta), np.sin(theta)]])
    points = Points(np.zeros((1, 3)), np.array([[0.0, 1.0, 0.0]]), view, np.array([[0.1, 0.1]]))
    found = {
        variant: compare(renderer, lamp, points, f"ltc{variant}", False)[0][0]
        for variant in ("", "/undivided", "/published-clip")
    }
    assert found[""] == found["/undivided"] == 0.0
    assert found["/published-clip"] > 1e-3


def test_only_a_variant_needs_its_code_and_its_table(renderer):
    plain = shot(PLAIN, "ltc")
    bytes_of = {}
    for technique in ("ltc", *(f"ltc/{variant}" for variant in VARIANTS)):
        wanted = Shot(plain.scene, RenderSettings(technique), plain.width, plain.height)
        renderer.render(wanted)
        renderer.display()
        plan = renderer.plan(wanted)
        assert plan.allocated == renderer.allocated()
        files = next(p.files for p in plan.programs if p.name == "lighting")
        assert ("ltc/published_clip.glsl" in files) is technique.endswith("published-clip")
        bytes_of[technique] = plan.allocated["table_residual"]
    assert bytes_of["ltc/no-table"] < bytes_of["ltc/table-4"] < bytes_of["ltc/table-8"]
    assert bytes_of["ltc/table-8"] < bytes_of["ltc"] < bytes_of["ltc/table-32"]
    assert bytes_of["ltc/undivided"] == bytes_of["ltc"]


def test_changing_back_gives_the_same_picture(renderer):
    pictures = {}
    for _ in range(2):
        for material in (PLAIN, BRUSHED):
            for technique in ("ltc", "ltc/table-4", "ltc/published-clip"):
                renderer.render(shot(material, technique))
                picture = renderer.radiance()
                known = pictures.setdefault((material, technique), picture)
                np.testing.assert_array_equal(picture, known)
    assert not np.array_equal(pictures[PLAIN, "ltc"], pictures[PLAIN, "ltc/table-4"])
