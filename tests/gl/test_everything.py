"""Leaving out changes the cost and not the picture."""

from __future__ import annotations

from collections.abc import Iterator

import moderngl
import numpy as np
import pytest

from app.render.renderer import Renderer
from app.scene import RenderSettings, Shot
from app.scene_io import demo_scenes, load_scene
from tests.gl.scenes import DARK, MATTE, one_light


@pytest.fixture(scope="module")
def renderers(session_context: moderngl.Context) -> Iterator[tuple[Renderer, Renderer]]:
    with session_context:
        both = Renderer(session_context), Renderer(session_context, everything=True)
    yield both
    with session_context:
        for renderer in both:
            renderer.release()


def compare(renderers: tuple[Renderer, Renderer], shot: Shot) -> tuple[np.ndarray, ...]:
    """Return both pictures; what is held is what is planned."""
    pictures = []
    for renderer in renderers:
        renderer.render(shot)
        renderer.display()
        assert renderer.allocated() == renderer.plan(shot).allocated
        pictures.append(renderer.radiance().astype(np.float64))
    return tuple(pictures)


@pytest.mark.parametrize("name", demo_scenes())
def test_the_picture_is_the_same(ctx, renderers, name: str) -> None:
    """To 1e-6 of its largest value: edges are the same edges in another loop."""
    needed, full = compare(
        renderers, Shot(load_scene(demo_scenes()[name]), RenderSettings(), 96, 54)
    )
    assert needed.max() > 0.0
    assert np.abs(needed - full).max() <= 1e-6 * needed.max()


@pytest.mark.parametrize("scene", [DARK, one_light(MATTE)], ids=["dark", "matte"])
def test_a_scene_that_needs_little_gets_all_of_it(ctx, renderers, scene) -> None:
    shot = Shot(scene, RenderSettings(samples=2), 64, 36)
    needed, full = compare(renderers, shot)
    np.testing.assert_allclose(full, needed, rtol=0.0, atol=1e-6 * max(needed.max(), 1.0))
    plan = renderers[1].plan(shot)
    assert {"gbuffer", "light shapes", "light curves", "lighting"} < {
        program.name for program in plan.programs
    }
    assert {"tangents", "radiance 2", "table_residual"} < set(plan.allocated)
