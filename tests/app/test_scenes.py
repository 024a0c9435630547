"""The scenes and models that the program ships."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from app.meshes import load_mesh
from app.outline import boundary, resolve
from app.scene import BUILT_IN_MESHES, BezierContour, Scene, SvgSource, TextSource
from app.scene_io import demo_scenes, load_scene, save_scene, scene_to_json
from app.sources import outline_from
from ltc.resources import resource_path

DEMOS = demo_scenes()
BENCHES = {
    path.stem: path for path in sorted((resource_path("assets", "scenes", "bench")).glob("*.json"))
}
ALL = {**DEMOS, **BENCHES}
MODELS = sorted(resource_path("assets", "models").glob("*.glb"))


def test_there_are_enough() -> None:
    assert len(DEMOS) >= 6
    assert {path.stem for path in MODELS} >= {"teapot", "bunny"}
    assert set(BENCHES) == {
        "lights-08",
        "lights-32",
        "quad",
        "quad-brushed",
        "ngon-40",
        "star-10",
        "letter-16-curves",
        "ring-08-curves",
    }


def test_the_still_life_comes_first() -> None:
    first = load_scene(next(iter(DEMOS.values())))
    meshes = {Path(item.mesh).stem for item in first.objects}
    assert {"teapot", "bunny"} <= meshes
    assert 2 <= len(first.lights) <= 3


@pytest.mark.parametrize("name", ALL)
def test_scene_loads_and_nothing_in_it_is_empty(name: str) -> None:
    scene = load_scene(ALL[name])
    assert scene.objects
    assert scene.lights
    for item in scene.objects:
        assert len(load_mesh(item.mesh).indices) > 0, item.name
    for light in scene.lights:
        assert resolve(light.outline), light.name
        assert max(light.radiance) > 0.0, light.name
    used = {item.material for item in scene.objects}
    assert used == {material.name for material in scene.materials}, "a material is not used"


def test_outlines_are_what_their_sources_make() -> None:
    """So that editing a text or a drawing's file changes only what was edited."""
    made = [light for path in DEMOS.values() for light in load_scene(path).lights if light.source]
    assert {type(light.source) for light in made} == {TextSource, SvgSource}
    for light in made:
        assert light.source
        remade = outline_from(light.source)
        assert remade.fill_rule == light.outline.fill_rule
        for now, kept in zip(remade.contours, light.outline.contours, strict=True):
            assert isinstance(now, BezierContour)
            assert isinstance(kept, BezierContour)
            # Processors round differently.
            np.testing.assert_allclose(now.curves, kept.curves, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("name", ALL)
def test_scene_round_trips(name: str, tmp_path: Path) -> None:
    scene = load_scene(ALL[name])
    copy = tmp_path / "copy.json"
    save_scene(scene, copy)
    assert load_scene(copy) == scene


@pytest.mark.parametrize("name", ALL)
def test_scene_file_is_as_the_program_writes_it(name: str) -> None:
    """So that opening and saving a demo changes nothing in version control."""
    path = ALL[name]
    assert scene_to_json(load_scene(path), path.parent) == path.read_text(encoding="utf-8")


@pytest.mark.parametrize("name", ALL)
def test_meshes_are_named_relative_to_the_scene(name: str) -> None:
    scene = load_scene(ALL[name])
    folder = resource_path("assets", "models").resolve()
    for item in scene.objects:
        if item.mesh not in BUILT_IN_MESHES:
            assert Path(item.mesh).resolve().parent == folder


def _edges(scene: Scene) -> list[int]:
    return [sum(len(loop) for loop in resolve(light.outline)) for light in scene.lights]


def test_bench_scenes_have_the_edges_that_their_names_say() -> None:
    edges = {name: _edges(load_scene(path)) for name, path in BENCHES.items()}
    assert edges["quad"] == [4]
    assert edges["star-10"] == [10]
    assert edges["ngon-40"] == [40]
    for count in (8, 32):
        assert edges[f"lights-{count:02}"] == [4] * count
    for name, count in (("ring-08-curves", 8), ("letter-16-curves", 16)):
        (light,) = load_scene(BENCHES[name]).lights
        curves = np.concatenate(boundary(light.outline))
        assert len(curves) == count


@pytest.mark.parametrize("path", MODELS, ids=lambda path: path.stem)
def test_model_stands_one_metre_tall_at_the_origin(path: Path) -> None:
    mesh = load_mesh(str(path))
    low, high = mesh.bounds
    assert low[1] == pytest.approx(0.0, abs=1e-6)
    assert high[1] == pytest.approx(1.0, abs=1e-6)
    assert np.allclose(low[[0, 2]], -high[[0, 2]], atol=1e-6)


@pytest.mark.parametrize("path", MODELS, ids=lambda path: path.stem)
def test_model_normals_agree_with_its_triangles(path: Path) -> None:
    mesh = load_mesh(str(path))
    corners = mesh.positions[mesh.indices].astype(np.float64)
    face = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    face /= np.linalg.norm(face, axis=-1, keepdims=True)
    cosine = np.einsum("fi,fki->fk", face, mesh.normals[mesh.indices])
    assert np.median(cosine) > math.cos(math.radians(8.0))
    assert (cosine < 0.0).mean() < 0.002


@pytest.mark.parametrize("path", MODELS, ids=lambda path: path.stem)
def test_model_encloses_what_it_should(path: Path) -> None:
    """Triangles face outwards: the divergence theorem gives a positive volume."""
    mesh = load_mesh(str(path))
    a, b, c = np.moveaxis(mesh.positions[mesh.indices].astype(np.float64), 1, 0)
    volume = np.einsum("fi,fi->f", a, np.cross(b, c)).sum() / 6.0
    assert 0.02 < volume < 1.2


def test_teapot_is_smooth_across_its_patches() -> None:
    """Where two patches of the body share a vertex, they share its normal."""
    mesh = load_mesh(str(resource_path("assets", "models", "teapot.glb")))
    x, y, z = mesh.positions.T
    body = (y > 0.3) & (y < 0.7) & (np.hypot(x, z) > 0.4) & (np.abs(x) < 0.3)
    place, normal = mesh.positions[body], mesh.normals[body]
    distance = np.linalg.norm(place[:, None] - place[None], axis=-1)
    first, second = np.nonzero(np.triu(distance < 1e-5, 1))
    assert len(first) >= 20
    assert np.abs(normal[first] - normal[second]).max() < 1e-4
