"""The parts of an error: they add up, and each is what its name says."""

from __future__ import annotations

import numpy as np
import pytest

from app.errors import InputError
from app.presets import ring
from app.render.breakdown import Breakdown, break_down
from app.render.gathering import Gathering, Points, random_places
from app.render.renderer import Renderer
from app.render.truth import exact_radiance
from app.scene import (
    AreaLight,
    Material,
    Outline,
    Plane,
    PolygonContour,
    RenderSettings,
    Scene,
    SceneObject,
    Shot,
    Transform,
)

SIZE = (48, 32)
SQUARE = Outline((PolygonContour(((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))),))
TABLE_PARTS = ("Fresnel", "lobe", "table", "textures", "outline", "float32")


def scene(
    outline: Outline = SQUARE,
    material: Material = Material("m", (0.3, 0.2, 0.1), (0.5, 0.6, 0.7), (0.2, 0.2)),
) -> Scene:
    floor = SceneObject("floor", "plane", "m", Transform(scale=(3.0, 3.0, 3.0)))
    lamp = AreaLight("l", outline, Plane((0.0, 1.2, -1.0)), (2.0, 1.5, 1.0), visible=False)
    other = AreaLight("k", SQUARE, Plane((-2.0, 1.3, 0.0), (0.0, 0.0, -1.0)), two_sided=True)
    return Scene((material,), (floor,), (lamp, other))


def broken_down(
    renderer: Renderer, shown: Scene, technique: str, count: int = 4
) -> tuple[Points, Breakdown]:
    # More than a sample: a breakdown is not of what happened to be rendered last.
    shot = Shot(shown, RenderSettings(technique, 2), *SIZE)
    renderer.render(shot)
    before = renderer.radiance()
    gathering = Gathering(renderer, shot, random_places(SIZE), count)
    while not gathering.step():
        pass
    points = gathering.points()
    assert points.count == count
    np.testing.assert_array_equal(renderer.radiance(), before)
    done: list[tuple[int, int]] = []
    found = break_down(points, shown, technique, lambda *steps: done.append(steps))
    assert done[-1][0] <= done[-1][1]
    np.testing.assert_allclose(found.exact + found.total, points.radiance, rtol=0.0, atol=1e-12)
    return points, found


def sizes(found: Breakdown) -> dict[str, float]:
    return {name: largest for name, _, _, largest, _ in found.rows()}


def test_polygons_by_tables(renderer: Renderer) -> None:
    """Edges are exact, single precision errs by little, the lobe by more than table and texels."""
    points, found = broken_down(renderer, scene(), "ltc")
    assert found.parts == TABLE_PARTS
    largest = sizes(found)
    assert largest["outline"] == 0.0
    assert largest["float32"] < 1e-5
    assert largest["textures"] < largest["table"] < largest["Fresnel"]
    assert largest["lobe"] > 1e-5
    # Another route to the first and to the last state in float64: a white material, apart.
    alpha = np.full(points.count, 0.2)
    lights = scene().lights
    inputs = (points.position, points.normal, points.view, alpha)
    white = scene(material=Material("m", (1.0, 1.0, 1.0), (1.0, 1.0, 1.0), (0.2, 0.2)))
    _, of_white = broken_down(renderer, white, "ltc")
    specular, diffuse = exact_radiance(lights, *inputs, "ggx")
    np.testing.assert_allclose(of_white.exact, specular + diffuse, rtol=1e-9)
    # F = 1 has no Fresnel term to take apart.
    assert sizes(of_white)["Fresnel"] < 1e-7
    specular, diffuse = exact_radiance(lights, *inputs, "ltc")
    looked_up = of_white.exact + of_white.shares[:4].sum(axis=0)
    np.testing.assert_allclose(looked_up, specular + diffuse, rtol=1e-9)


@pytest.mark.parametrize("technique", ["uniform:6", "adaptive-extrapolated", "ltc:2"])
def test_curves(renderer: Renderer, technique: str) -> None:
    """What an outline's integration costs is found by another route than what is left."""
    _, found = broken_down(renderer, scene(ring()), technique, 2)
    assert found.parts == TABLE_PARTS
    largest = sizes(found)
    assert largest["float32"] < 3e-5
    if technique in ("uniform:6", "ltc:2"):
        assert largest["outline"] > 3.0 * largest["float32"]


def test_finest_curves_cannot_be_told_from_float32(renderer: Renderer) -> None:
    _, found = broken_down(renderer, scene(ring()), "ltc:6", 1)
    assert found.parts == (*TABLE_PARTS[:4], "outline and float32")
    assert sizes(found)["outline and float32"] < 3e-5


@pytest.mark.parametrize("variant", ["table-4", "undivided", "published-clip"])
def test_variants(renderer: Renderer, variant: str) -> None:
    """What a variant does otherwise is found where it belongs, and nowhere else."""
    _, usual = broken_down(renderer, scene(), "ltc", 3)
    _, found = broken_down(renderer, scene(), f"ltc/{variant}", 3)
    largest = sizes(found)
    assert largest["float32"] < 1e-5
    if variant == "table-4":
        assert found.parts == TABLE_PARTS
        assert largest["textures"] > 2.0 * sizes(usual)["textures"]
    else:
        assert found.parts == (*TABLE_PARTS[:4], "horizon", "outline", "float32")
        assert largest["horizon"] > 1e-4


@pytest.mark.parametrize("technique", ["ltc", "ggx", "ggx:4"])
def test_brushed_metal(renderer: Renderer, technique: str) -> None:
    metal = Material("m", (0.0, 0.0, 0.0), (0.9, 0.8, 0.7), (0.1, 0.4), 0.7)
    _, found = broken_down(renderer, scene(material=metal), technique)
    largest = sizes(found)
    assert largest["float32"] < 3e-5
    if technique == "ltc":
        assert found.parts == ("Fresnel", "lobe", "table", "outline", "float32")
    else:
        assert found.parts == ("quadrature", "float32")
        assert largest["quadrature"] < (0.02 if technique == "ggx" else 0.005)


def test_more_nodes_leave_less_of_the_quadrature(renderer: Renderer) -> None:
    mean = {}
    for technique in ("ggx:1", "ggx:4"):
        _, found = broken_down(renderer, scene(), technique, 8)
        mean[technique] = found.rows()[0][1]
    assert mean["ggx:4"] < 0.3 * mean["ggx:1"]


def test_what_has_fewer_parts(renderer: Renderer) -> None:
    _, found = broken_down(renderer, scene(ring()), "ggx", 2)
    assert found.parts == ("quadrature and float32",)
    _, found = broken_down(renderer, scene(), "representative-point", 2)
    assert found.parts == ("technique",)
    matt = scene(material=Material("m", (0.5, 0.5, 0.5), (0.0, 0.0, 0.0)))
    _, found = broken_down(renderer, matt, "auto", 2)
    assert max(sizes(found).values()) < 1e-5
    with pytest.raises(InputError, match="technique reference errs by the noise"):
        Gathering(renderer, Shot(matt, RenderSettings("reference")), random_places(SIZE), 1)


def test_no_surface_and_no_light(renderer: Renderer) -> None:
    empty = Scene()
    shot = Shot(empty, RenderSettings("ltc"), *SIZE)
    renderer.render(shot)
    gathering = Gathering(renderer, shot, random_places(SIZE), 2)
    while not gathering.step():
        pass
    found = break_down(gathering.points(), empty, "ltc")
    assert found.exact.shape == (0, 3)
    assert [row[1:] for row in found.rows()] == [(0.0, 0.0, 0.0, 0.0)] * (len(TABLE_PARTS) + 1)
    dark = Scene(scene().materials, scene().objects)
    _, found = broken_down(renderer, dark, "ltc", 1)
    assert np.all(found.total == 0.0)


def test_what_was_skipped_is_named(renderer: Renderer) -> None:
    shot = Shot(scene(), RenderSettings("ltc", cull=0.004), *SIZE)
    renderer.render(shot)
    gathering = Gathering(renderer, shot, random_places(SIZE), 1)
    while not gathering.step():
        pass
    found = break_down(gathering.points(), shot.scene, "ltc")
    assert found.parts[-1] == "float32, skipped lights"
    assert sizes(found)["float32, skipped lights"] <= 0.004 + 1e-5
