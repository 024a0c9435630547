"""The view of costs: what is counted, its colours, and its legend."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from app.colour_maps import VIRIDIS, draw_legend
from app.presets import heart, ring
from app.render.cost import (
    EMPTY,
    LEGEND,
    NONE,
    OCTAVES,
    TICKS,
    WithLegend,
    colour_of,
)
from app.scene import (
    AreaLight,
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

SIZE = (96, 64)


def picture(*lights: AreaLight, material: Material = Material("m")) -> Scene:
    floor = SceneObject("floor", "plane", "m", Transform(scale=(3.0, 3.0, 3.0)))
    return Scene((material,), (floor,), lights)


def lamp(outline: Outline, **changes) -> AreaLight:
    return replace(AreaLight("l", outline, Plane((0.0, 2.0, -2.0))), **changes)


def counts(renderer, scene: Scene, technique: str, samples: int = 1) -> np.ndarray:
    renderer.render(Shot(scene, RenderSettings(technique, samples, "cost"), *SIZE))
    return renderer.radiance()[..., 0]


SQUARE = Outline((PolygonContour(((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))),))


def test_edges_are_counted_once_a_lobe(renderer):
    """A square above the floor: four edges for the specular lobe, four for the diffuse one."""
    scene = picture(lamp(SQUARE, visible=False))
    found = counts(renderer, scene, "ltc")
    assert set(np.unique(found)) == {0.0, 8.0}  # 0 off the floor
    matte = replace(scene, materials=(Material("m", f0=(0.0, 0.0, 0.0)),))
    assert set(np.unique(counts(renderer, matte, "ltc"))) == {0.0, 4.0}
    two = picture(lamp(SQUARE, visible=False), lamp(SQUARE, name="k", visible=False))
    assert set(np.unique(counts(renderer, two, "ltc"))) == {0.0, 16.0}


def test_published_methods_cost_what_they_say(renderer):
    """`adaptive` takes at least 4 intervals of 3 edges a curve and lobe, `uniform` its edges."""
    scene = picture(lamp(heart(), visible=False), material=Material("m", alpha=(0.01, 0.01)))
    curves = len(scene.lights[0].outline.contours[0].curves)
    found = counts(renderer, scene, "adaptive")
    assert found[found > 0.0].min() == 2 * curves * 12
    assert found.max() > 2 * curves * 12
    np.testing.assert_array_equal(found, counts(renderer, scene, "adaptive-extrapolated"))
    found = counts(renderer, scene, "uniform:7")
    assert set(np.unique(found)) == {0.0, 2.0 * curves * 7}


def test_default_costs_less(renderer):
    scene = picture(lamp(ring(), visible=False))
    default, adaptive = (counts(renderer, scene, name) for name in ("ltc", "adaptive"))
    lit = adaptive > 0.0
    assert np.all(default[lit] > 0.0)
    assert default[lit].mean() < 0.5 * adaptive[lit].mean()


@pytest.mark.parametrize("technique", ["ggx", "ggx:1"])
def test_other_techniques_count_too(renderer, technique):
    found = counts(renderer, picture(lamp(SQUARE, visible=False)), technique)
    assert set(np.unique(found)) == {0.0, 8.0}


def test_samples_are_averaged(renderer):
    found = counts(renderer, picture(lamp(SQUARE, visible=False)), "ltc", samples=4)
    assert found.max() == 8.0
    assert np.any((found > 0.0) & (found < 8.0))  # the floor's edge


def test_colours(renderer):
    """Lights themselves cost nothing, nothing has no cost, 8 evaluations are three doublings."""
    scene = picture(lamp(SQUARE))
    found = counts(renderer, scene, "ltc")
    colours = renderer.display()
    assert np.all(colours[found == 8.0] == np.round(colour_of(8.0)))
    zero = colours[found == 0.0]
    assert {tuple(int(c) for c in row) for row in zero} == {NONE, EMPTY}
    # Exposure and tone map are for radiance.
    other = replace(scene, display=replace(scene.display, exposure=3.0, tone_map="none"))
    counts(renderer, other, "ltc")
    np.testing.assert_array_equal(renderer.display(), colours)


def test_changing_the_view_renders_again(renderer):
    scene = picture(lamp(SQUARE))
    shots = [Shot(scene, RenderSettings("ltc", 1, view), *SIZE) for view in ("radiance", "cost")]
    for _ in range(2):
        pictures = []
        for shot in shots:
            renderer.accumulate(shot, 1)
            pictures.append(renderer.radiance())
        assert pictures[0].max() == 1.0  # the light
        assert pictures[1].max() == 8.0
    programs = [renderer.plan(shot).programs for shot in shots]
    radiance = next(program for program in programs[0] if program.name == "lighting")
    assert dict(radiance.features)["COUNTS_EVALUATIONS"] == 0
    assert "common/tone_map.glsl" not in programs[1][-1].files


def test_nothing_lit_has_no_cost(renderer):
    assert counts(renderer, picture(), "ltc").max() == 0.0
    assert np.all(renderer.display() == EMPTY)


def test_scale():
    assert colour_of(1.0) == VIRIDIS[0]
    assert colour_of(2.0**OCTAVES) == colour_of(1e9) == VIRIDIS[-1]
    assert colour_of(64.0) == VIRIDIS[4]
    assert max(TICKS) == 2**OCTAVES
    # Lightness alone tells more from less.
    weights = np.array([0.2126, 0.7152, 0.0722])
    linear = (np.array(VIRIDIS) / 255.0) ** 2.2 @ weights
    assert np.all(np.diff(linear) > 0.0)


def test_legend():
    grey = np.full((200, 400, 3), 89, np.uint8)
    drawn = draw_legend(grey, LEGEND)
    assert drawn.shape == grey.shape
    assert np.all(grey == 89)
    changed = np.any(drawn != grey, axis=-1)
    rows, columns = np.nonzero(changed)
    assert rows.min() > 100
    assert columns.max() < 300
    bar = drawn[rows.min() :, : columns.max()].reshape(-1, 3)
    for colour in (VIRIDIS[0], VIRIDIS[-1]):
        assert np.any(np.all(bar == colour, axis=-1))
    tiny = np.zeros((8, 8, 3), np.uint8)
    np.testing.assert_array_equal(draw_legend(tiny, LEGEND), tiny)


def test_files_get_colours_with_a_legend_or_counts(renderer):
    counts(renderer, picture(lamp(SQUARE)), "ltc")
    both = WithLegend(renderer)
    assert both.display().shape == (SIZE[1], SIZE[0], 3)
    assert both.radiance().max() == 8.0


def test_unknown_views():
    with pytest.raises(SceneError, match="view is 'x', expected one of radiance, cost"):
        RenderSettings(view="x")  # type: ignore[arg-type]
