"""What is asked of single pixels: their radiance and their cost."""

from __future__ import annotations

import numpy as np
import pytest

from app.render.renderer import Renderer
from app.scene import RenderSettings, Scene, Shot
from app.scene_io import demo_scenes, load_scene
from tests.gl.scenes import one_light

SIZE = (60, 40)


def some_pixels(count: int = 20) -> np.ndarray:
    rng = np.random.default_rng(4)
    return np.stack([rng.integers(0, SIZE[0], count), rng.integers(0, SIZE[1], count)], axis=1)


@pytest.mark.parametrize(
    ("demo", "technique"),
    [("", "ltc"), ("", "ggx"), ("12-letter", "ltc"), ("09-brushed", "auto")],
)
def test_evaluations_are_those_of_the_view_of_costs(
    renderer: Renderer, demo: str, technique: str
) -> None:
    scene = load_scene(demo_scenes()[demo]) if demo else one_light()
    renderer.render(Shot(scene, RenderSettings(technique, 1, "cost"), *SIZE))
    costs = renderer.radiance()[..., 0]
    renderer.render(Shot(scene, RenderSettings(technique, 2), *SIZE))
    radiance = renderer.radiance()
    other = 0
    for column, row in some_pixels():
        assert renderer.radiance_at(column, row) == tuple(radiance[row, column].tolist())
        found = renderer.evaluations_at(column + 0.5, row + 0.5)
        # Its rays are rounded in another way: a light's pieces may be taken or left there.
        other += found != costs[row, column]
    assert costs.max() > 0.0
    assert other <= 1
    # The picture is what it was.
    np.testing.assert_array_equal(renderer.radiance(), radiance)
    shot = Shot(scene, RenderSettings(technique, 1), *SIZE)
    for _ in range(2):
        renderer.accumulate(shot, 2)
    np.testing.assert_array_equal(renderer.radiance(), radiance)


def test_nothing_there(renderer: Renderer) -> None:
    with pytest.raises(RuntimeError, match="nothing was rendered"):
        renderer.evaluations_at(1.0, 1.0)
    renderer.render(Shot(Scene(), RenderSettings(), *SIZE))
    assert renderer.evaluations_at(5.5, 5.5) == 0
    assert renderer.radiance_at(5, 5) == (0.0, 0.0, 0.0)
    with pytest.raises(ValueError, match=r"pixel \(60, 0\)"):
        renderer.radiance_at(60, 0)
