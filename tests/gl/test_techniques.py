"""What choosing a technique compiles, allocates and loads."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from app.scene import (
    AreaLight,
    Material,
    Plane,
    RenderSettings,
    Scene,
    SceneObject,
    Shot,
    Transform,
)
from tests.gl.scenes import SQUARE

PLAIN = Material("m", (0.2, 0.2, 0.2), (0.5, 0.5, 0.5), (0.2, 0.2))
BRUSHED = replace(PLAIN, alpha=(0.05, 0.4))
MATT = replace(BRUSHED, f0=(0.0, 0.0, 0.0))


def shot(material: Material, technique: str = "auto", mesh: str = "disc") -> Shot:
    scene = Scene(
        materials=(material,),
        objects=(SceneObject("o", mesh, "m", Transform(scale=(2.0, 2.0, 2.0))),),
        lights=(AreaLight("l", SQUARE, Plane((0.0, 1.5, -2.0)), (3.0, 3.0, 3.0)),),
    )
    return Shot(scene, RenderSettings(technique, 1), 96, 64)


@pytest.mark.parametrize(
    ("material", "technique", "tables", "tangents"),
    [
        (PLAIN, "auto", True, False),
        (PLAIN, "ltc", True, False),
        (PLAIN, "ggx", False, False),
        (BRUSHED, "auto", False, True),
        (BRUSHED, "ggx", False, True),
        (BRUSHED, "ltc", True, True),
        (MATT, "auto", False, False),
        (MATT, "ggx", False, False),
    ],
)
def test_only_what_is_needed(renderer, material, technique, tables, tangents):
    wanted = shot(material, technique)
    renderer.render(wanted)
    renderer.display()
    held = renderer.allocated()
    assert ("table_residual" in held) is tables
    assert ("tangents" in held) is tangents
    plan = renderer.plan(wanted)
    assert plan.allocated == held
    lighting = next(program for program in plan.programs if program.name == "lighting")
    glossy = material is not MATT
    ggx = technique == "ggx" or (technique == "auto" and material.is_anisotropic)
    assert any(name.startswith("ggx/") for name in lighting.files) is (glossy and ggx)
    looked_up = "ltc/anisotropic.glsl" if tangents else "ltc/lobe.glsl"
    other = "ltc/lobe.glsl" if tangents else "ltc/anisotropic.glsl"
    assert (looked_up in lighting.files) is (glossy and not ggx)
    assert other not in lighting.files


def test_changing_the_technique_back_and_forth_leaves_nothing(renderer):
    pictures = {}
    for _ in range(2):
        for material, technique in ((BRUSHED, "ggx"), (BRUSHED, "ltc"), (PLAIN, "auto")):
            renderer.render(shot(material, technique))
            renderer.display()
            picture = renderer.radiance()
            known = pictures.setdefault((material, technique), (picture, renderer.allocated()))
            np.testing.assert_array_equal(picture, known[0])
            assert renderer.allocated() == known[1]


def test_techniques_agree_on_isotropic_surfaces(renderer):
    """The table's error lies between them, and no more."""
    pictures = []
    for technique in ("ltc", "ggx"):
        renderer.render(shot(PLAIN, technique))
        pictures.append(renderer.radiance())
    difference = np.abs(pictures[0] - pictures[1]) / 3.0
    assert difference.mean() <= 0.003
    assert difference.max() <= 0.03


def test_techniques_agree_on_brushed_surfaces(renderer):
    pictures = []
    for technique in ("ltc", "ggx"):
        renderer.render(shot(BRUSHED, technique))
        pictures.append(renderer.radiance())
    difference = np.abs(pictures[0] - pictures[1]) / 3.0
    assert difference.mean() <= 0.005
    assert difference.max() <= 0.06


@pytest.mark.parametrize("mesh", ["plane", "sphere", "disc", "box"])
@pytest.mark.parametrize("alpha", [(1e-4, 1.0), (1.0, 1e-4), (0.05, 0.4)])
@pytest.mark.parametrize("technique", ["ggx", "ltc"])
def test_brushed_meshes_are_finite_everywhere(renderer, technique, mesh, alpha):
    """Poles of the tangents, silhouettes and edges included."""
    renderer.render(shot(replace(PLAIN, alpha=alpha), technique, mesh))
    radiance = renderer.radiance()
    assert np.all(np.isfinite(radiance))
    assert radiance.min() >= 0.0
    assert radiance.max() <= 3.0 * 1.05
