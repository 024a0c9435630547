"""Lights too faint to see are skipped, and the error is no larger than was asked for."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import moderngl
import numpy as np
import pytest

from app.presets import heart
from app.render.pack import light_bounds, light_geometry
from app.render.renderer import Renderer
from app.scene import (
    AreaLight,
    Display,
    Material,
    Outline,
    Plane,
    PolygonContour,
    RenderSettings,
    Scene,
    SceneError,
    SceneObject,
    Shot,
    Transform,
)
from app.scene_io import demo_scenes, load_scene
from tests.gl.scenes import GLOSSY, MATTE, many_lights

SIZE = (96, 54)
TRIANGLE = Outline((PolygonContour(((-0.5, -0.2), (1.5, -0.4), (0.1, 0.6))),))


@pytest.fixture(scope="module")
def module_renderer(session_context: moderngl.Context) -> Iterator[Renderer]:
    with session_context:
        renderer = Renderer(session_context)
    yield renderer
    with session_context:
        renderer.release()


@pytest.fixture
def renderer(ctx: moderngl.Context, module_renderer: Renderer) -> Renderer:
    return module_renderer


def picture(renderer: Renderer, scene: Scene, **settings) -> np.ndarray:
    renderer.render(Shot(scene, RenderSettings(**settings), *SIZE))
    return renderer.radiance().astype(np.float64)


def crowd(seed: int, curved: bool = False) -> Scene:
    """A floor and two balls, rough and smooth, among lights of all sizes, far and near."""
    rng = np.random.default_rng(seed)
    outlines = (TRIANGLE, heart(1.0) if curved else TRIANGLE)
    lights = []
    for i in range(24):
        u, v = rng.normal(size=(2, 3)) * np.exp(rng.uniform(-3.0, 0.0, (2, 1)))
        origin = rng.normal(size=3) * [3.0, 1.0, 3.0] + [0.0, 1.5, -2.0]
        lights.append(
            AreaLight(
                f"light {i}",
                outlines[i % 2],
                Plane(tuple(origin), tuple(u), tuple(v)),
                tuple(np.exp(rng.uniform(-3.0, 3.0, 3))),
                two_sided=bool(i % 3),
                visible=False,
            )
        )
    materials = (
        Material("floor", (0.2, 0.3, 0.4), (0.04, 0.04, 0.04), (0.05, 0.05)),
        Material("rough", (0.0, 0.0, 0.0), (0.9, 0.7, 0.5), (0.6, 0.6)),
        Material("smooth", (0.5, 0.5, 0.5), (0.0, 0.0, 0.0), (0.01, 0.01)),
        Material("brushed", (0.1, 0.1, 0.1), (0.5, 0.5, 0.5), (0.4, 0.05)),
    )
    objects = (
        SceneObject("floor", "plane", "floor", Transform(scale=(9.0, 9.0, 9.0))),
        *(
            SceneObject(
                name, "sphere", name, Transform((1.2 * i - 1.2, 0.5, 0.6), scale=(0.5,) * 3)
            )
            for i, name in enumerate(("rough", "smooth", "brushed"))
        ),
    )
    return Scene(materials, objects, tuple(lights), display=Display(1.5))


@pytest.mark.parametrize(
    ("technique", "curved"), [("ltc", False), ("ggx", False), ("ltc", True), ("uniform:4", True)]
)
def test_the_error_is_what_was_allowed(renderer, technique: str, curved: bool) -> None:
    scene = crowd(1 + curved, curved)
    white = 2.0**-scene.display.exposure
    whole = picture(renderer, scene, technique=technique)
    cost = picture(renderer, scene, technique=technique, view="cost").mean()
    for share, saved in ((1e-4, 0.1), (1e-2, 0.3)):
        culled = picture(renderer, scene, technique=technique, cull=share)
        missing = whole - culled
        # What is skipped is missing; curves with a chord each where one lobe alone is
        # walked differ by the chords' own error besides, 1e-4 of a light.
        tolerance = (1e-4 * 20.0 if curved else 2e-6 * whole.max()) + share * white
        assert missing.max() <= tolerance
        assert missing.min() >= share * white - tolerance
        assert missing.max() > 0.0
        less = picture(renderer, scene, technique=technique, cull=share, view="cost").mean()
        assert less < (1.0 - saved) * cost, "the view of costs shows what is spared"


@pytest.mark.parametrize("name", ["05-many-lights", "06-grazing", "09-brushed", "13-word"])
def test_demo_scenes(renderer, name: str) -> None:
    scene = load_scene(demo_scenes()[name])
    whole = picture(renderer, scene)
    culled = picture(renderer, scene, cull=1 / 1024)
    allowed = 2.0**-scene.display.exposure / 1024
    assert np.abs(whole - culled).max() <= allowed * (1.0 + 1e-3)
    assert np.any(whole != culled)


def test_almost_nothing_allowed_changes_nothing(renderer) -> None:
    scene = crowd(3)
    whole = picture(renderer, scene, technique="ltc")
    culled = picture(renderer, scene, technique="ltc", cull=1e-12)
    np.testing.assert_allclose(culled, whole, rtol=0.0, atol=1e-6 * whole.max())


def test_everything_allowed_leaves_black(renderer) -> None:
    """No light of radiance 1 to 2, on a floor that reflects less than 1/4, exceeds 1 in all."""
    scene = replace(many_lights(3), display=Display(-6.0))
    assert picture(renderer, scene, technique="ltc", cull=1.0)[-1].max() == 0.0
    assert picture(renderer, scene, technique="ltc")[-1].max() > 0.0


def test_exposure_counts_only_then(renderer) -> None:
    dark = crowd(4)
    bright = replace(dark, display=replace(dark.display, exposure=4.0))
    shots = [Shot(scene, RenderSettings("ltc", cull=1e-2), *SIZE) for scene in (dark, bright)]
    renderer.render(shots[0])
    first, passes = renderer.radiance(), renderer.lighting_passes
    renderer.accumulate(shots[1], 1)
    assert renderer.lighting_passes == passes + 1
    assert np.any(renderer.radiance() != first)
    plain = [replace(shot, settings=RenderSettings("ltc")) for shot in shots]
    renderer.render(plain[0])
    passes = renderer.lighting_passes
    renderer.accumulate(plain[1], 1)
    assert renderer.lighting_passes == passes


def test_a_point_is_shaded_as_its_pixel_is(renderer) -> None:
    """Also after a probe, which holds the lights without their rectangles."""
    scene = crowd(6)
    shot = Shot(scene, RenderSettings("ltc", cull=1e-2), *SIZE)
    renderer.render(shot)
    whole = renderer.radiance()
    up = np.array([[0.0, 1.0, 0.0]])
    renderer.probe(scene, shot.settings, up * 0.0, up, up[:, [1, 0, 2]], up, [[0.1, 0.1]])
    for x, y in ((48, 50), (20, 40), (60, 30)):
        np.testing.assert_allclose(
            renderer.shade_at(x + 0.5, y + 0.5), whole[y, x], rtol=0.0, atol=1e-5 * whole.max()
        )
    renderer.probe(scene, shot.settings, up * 0.0, up, up[:, [1, 0, 2]], up, [[0.1, 0.1]])
    renderer.accumulate(shot, 2)
    renderer.accumulate(shot, 2)
    mean = renderer.radiance()
    renderer.render(replace(shot, settings=replace(shot.settings, samples=2)))
    np.testing.assert_array_equal(renderer.radiance(), mean)


def test_it_is_left_out_unless_asked_for(renderer) -> None:
    scene = crowd(5)
    plain = renderer.plan(Shot(scene, RenderSettings("ltc"), *SIZE))
    culls = renderer.plan(Shot(scene, RenderSettings("ltc", cull=1 / 1024), *SIZE))
    files = [{name for program in plan.programs for name in program.files}
             for plan in (plain, culls)]  # fmt: skip
    extra = {"common/allowance.glsl", "common/greatest.glsl", "common/light_rectangle.glsl",
             "ltc/bound.glsl"}  # fmt: skip
    assert files[1] - files[0] == extra
    assert plain.allocated["lights"] <= culls.allocated["lights"]
    assert any(left.what == "bounds of faint lights" for left in plain.left_out)
    assert "less than 1/1024 of white" in culls.text()
    sampled = renderer.plan(Shot(scene, RenderSettings("reference", cull=1e-3), *SIZE))
    assert any("integrates every light" in left.why for left in sampled.left_out)
    matt = renderer.plan(Shot(replace(scene, materials=(MATTE,), objects=()),
                              RenderSettings(cull=1e-3), *SIZE))  # fmt: skip
    assert not any("allowance" in name for p in matt.programs for name in p.files)


def test_rectangles_hold_their_outlines() -> None:
    for outline in (TRIANGLE, heart(1.0)):
        light = AreaLight("l", outline, Plane(u=(0.5, 0.1, 0.0), v=(-0.2, 1.0, 0.3)))
        low, high = light_bounds(light).reshape(2, 2)
        for loop in light_geometry(light).loops:
            ends = loop.reshape(-1, 2) if loop.ndim == 2 else loop[:, [0, 3]].reshape(-1, 2)
            assert np.all(ends > low)
            assert np.all(ends < high)


def test_shares_that_are_none() -> None:
    for share in (-0.1, 1.5, float("nan")):
        with pytest.raises(SceneError, match=r"cull is .*, expected between 0 and 1"):
            RenderSettings(cull=share)
    assert GLOSSY.name == "glossy"
