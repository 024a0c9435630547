"""Demo scenes with curved lights against the same scenes with polygons of 4,096 edges.

The second route to a picture of a letter: its outline as a fine polygon, whose edges
are integrated in closed form. What is compared are display values, the sRGB codes in
[0, 1] that come out of exposure and tone map, before they are rounded and dithered.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from app.curves import evaluate, is_straight, signed_areas
from app.outline import boundary, resolve
from app.render.renderer import Renderer
from app.render.tone_map import display_codes
from app.scene import AreaLight, BezierContour, Outline, PolygonContour, RenderSettings, Scene, Shot
from app.scene_io import demo_scenes, load_scene

EDGES = 4096

SHADED = 64, 36
"""Pixels of the pictures whose shading is compared: thousands of edges cost seconds."""

SEEN = 320, 180

CODE = 1.0 / 255.0

FloatArray = NDArray[np.float64]


def is_curved(light: AreaLight) -> bool:
    return any(isinstance(contour, BezierContour) for contour in light.outline.contours)


CURVED = {
    name: scene
    for name, scene in ((name, load_scene(path)) for name, path in demo_scenes().items())
    if any(is_curved(light) for light in scene.lights)
}


def as_polygons(outline: Outline) -> Outline:
    """Return the outline with `EDGES` straight edges, shared out evenly among its curves."""
    loops = boundary(outline)
    straight = np.concatenate([is_straight(loop) for loop in loops])
    bent = int(np.count_nonzero(~straight))
    each, more = divmod(EDGES - int(np.count_nonzero(straight)), bent)
    counts = np.ones(len(straight), dtype=int)
    counts[~straight] = each + (np.arange(bent) < more)
    assert counts.sum() == EDGES
    contours, first = [], 0
    for loop in loops:
        points = [
            evaluate(curve, np.arange(count) / count)
            for curve, count in zip(loop, counts[first:], strict=False)
        ]
        first += len(loop)
        contours.append(PolygonContour(tuple(map(tuple, np.concatenate(points).tolist()))))
    return Outline(tuple(contours), "evenodd")


def with_polygons(scene: Scene) -> Scene:
    return replace(
        scene,
        lights=tuple(
            replace(light, outline=as_polygons(light.outline), source=None)
            if is_curved(light)
            else light
            for light in scene.lights
        ),
    )


def hidden(scene: Scene) -> Scene:
    return replace(scene, lights=tuple(replace(light, visible=False) for light in scene.lights))


def display_values(renderer: Renderer, scene: Scene, size: tuple[int, int]) -> FloatArray:
    renderer.render(Shot(scene, RenderSettings(samples=1), *size))
    return display_codes(renderer.radiance(), scene.display)


def seen(renderer: Renderer) -> NDArray[np.float32]:
    """Return what every pixel of the last picture shows, by number."""
    texture = renderer._targets.texture("gbuffer")
    data = np.frombuffer(texture.read(), dtype=np.float32)
    return data.reshape(texture.height, texture.width, -1)[::-1, :, 3]


def test_there_are_letters() -> None:
    assert {"12-letter", "13-word", "14-logo"} <= set(CURVED)


@pytest.mark.parametrize("name", CURVED)
def test_polygons_are_of_the_same_outline(name: str) -> None:
    for light in CURVED[name].lights:
        if is_curved(light):
            loops = resolve(as_polygons(light.outline))
            assert sum(len(loop) for loop in loops) == EDGES
            x, y = (np.concatenate([loop[:, i] for loop in loops]) for i in range(2))
            following = np.concatenate([np.roll(loop, -1, axis=0) for loop in loops])
            area = 0.5 * np.sum(x * following[:, 1] - y * following[:, 0])
            want = sum(float(signed_areas(loop).sum()) for loop in boundary(light.outline))
            assert abs(area - want) < 1e-4 * want


@pytest.mark.parametrize("name", CURVED)
def test_surfaces_look_as_lit_by_polygons(renderer: Renderer, name: str) -> None:
    scene = hidden(CURVED[name])
    got = display_values(renderer, scene, SHADED)
    want = display_values(renderer, with_polygons(scene), SHADED)
    assert want.max() > 0.2
    difference = np.abs(got - want).max()
    print(f"\n{name}: {255.0 * difference:.3f} codes")
    assert difference <= CODE


@pytest.mark.parametrize("name", CURVED)
def test_lights_look_like_polygons(renderer: Renderer, name: str) -> None:
    """Without surfaces, so that nothing is shaded; away from edges, which pixels round."""
    scene = replace(CURVED[name], objects=(), materials=())
    got = display_values(renderer, scene, SEEN)
    got_seen = seen(renderer)
    want = display_values(renderer, with_polygons(scene), SEEN)
    want_seen = seen(renderer)
    around = np.lib.stride_tricks.sliding_window_view(np.pad(want_seen, 1, mode="edge"), (3, 3))
    on_edge = around.min(axis=(-2, -1)) != around.max(axis=(-2, -1))
    assert 0.01 < on_edge.mean() < 0.2
    assert np.abs(got - want)[~on_edge].max() <= CODE
    # On an edge a rasteriser's rounding of corners, 1/256 of a pixel, may decide.
    assert np.mean(got_seen[on_edge] != want_seen[on_edge]) <= 0.01
