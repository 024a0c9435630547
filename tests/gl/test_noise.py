"""Pictures made of random samples: means that stay exact, and errors that they tell themselves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from app.render import renderer as renderer_module
from app.scene import Material, RenderSettings, Shot
from ltc.sequence import pcg4d
from tests.gl import test_truth
from tests.gl.evaluate import evaluate

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
RUNS, RUN = 17, 60_000
"""A million samples; the software rasteriser ends a loop after 65,536 turns."""


def values(lane: np.ndarray) -> np.ndarray:
    """Return the values of lanes, (lanes, RUNS * RUN): rarely 3, else 0, as of far lights."""
    index = np.arange(RUNS * RUN)
    bits = [pcg4d(np.stack(np.broadcast_arrays(n, 0, 0, index), axis=-1))[:, 0] for n in lane]
    return np.where(np.array(bits) < 2**32 // 100, 3.0, 0.0)


def test_means_stay_exact_over_a_million_samples(ctx, tmp_path):
    """And plain running means do not: theirs stand still."""
    lane = np.arange(4)
    body = f"""
        vec4 mean = vec4(state.x);
        vec4 rest = vec4(state.y);
        float plain = state.z;
        // The pixels that fill up the row must not loop.
        for (uint i = uint(start); lane >= 0.0 && i < uint(start) + {RUN}u; ++i) {{
            bool is_bright = pcg4d(uvec4(uint(lane), 0u, 0u, i)).x < {2**32 // 100}u;
            float value = is_bright ? 3.0 : 0.0;
            float weight = 1.0 / float(i + 1u);
            mean = next_mean(mean, rest, vec4(value), weight);
            plain += (value - plain) * weight;
        }}
        result = vec4(mean.x, rest.x, plain, 0.0);
    """
    files = ["common/running_mean.glsl", "common/sequence.glsl"]
    filled = np.concatenate([lane, np.full(252, -1)])
    state = np.zeros((256, 4))
    for run in range(RUNS):
        inputs = {"lane": filled, "start": np.full(256, RUN * run), "state": state}
        state = evaluate(ctx, tmp_path, files, body, inputs)
    want = values(lane).mean(axis=1)
    # A unit in the last place, and with what was carried along far less.
    np.testing.assert_allclose(state[:4, 0], want, rtol=1.2e-7)
    np.testing.assert_allclose(state[:4, 0] + state[:4, 1], want, rtol=2e-8)
    assert np.abs(state[:4, 2] / want - 1.0).max() > 1e-5


@pytest.fixture
def still(monkeypatch):
    """Keep all samples at the pixel's centre, where the truth is."""
    monkeypatch.setattr(renderer_module, "pixel_offset", lambda index: (0.0, 0.0))


def floor(technique: str, samples: int) -> Shot:
    material = Material("floor", tuple(test_truth.DIFFUSE), tuple(test_truth.F0), (0.2, 0.2))
    scene = replace(test_truth.scene((0.2, 0.2), 1.5), materials=(material,))
    return Shot(scene, RenderSettings(technique, samples), test_truth.WIDTH, test_truth.HEIGHT)


@pytest.mark.parametrize("technique", ["reference", "ltc+residual"])
def test_the_estimated_error_is_the_error(renderer, still, technique):
    exact, seen = test_truth.exact(floor(technique, 2))
    for samples in (2, 16, 64, 256):
        shot = floor(technique, samples)
        renderer.render(shot)
        noise = renderer.noise()
        error = (renderer.radiance() - exact)[seen] @ LUMINANCE
        assert noise.samples == samples
        assert noise.mean == pytest.approx(float((renderer.radiance()[seen] @ LUMINANCE).mean()))
        # Both are known to 5 to 15 % by 700 pixels, which differ much.
        assert noise.error == pytest.approx(np.sqrt(np.mean(error**2)), rel=0.4)
        assert noise.relative == noise.error / noise.mean


def test_single_samples_spread_more_than_their_mean(renderer, still):
    """Why the spread of single samples is not what is kept: it would say several times too much."""
    shot = floor("reference", 256)
    samples, before = [], np.zeros(3)
    for n in range(1, 257):
        renderer.accumulate(shot, 256)
        mean = renderer.radiance().astype(np.float64)
        samples.append((n * mean - (n - 1) * before) @ LUMINANCE)
        before = mean
    naive = np.sqrt(np.mean(np.var(samples, axis=0, ddof=1)[test_truth.exact(shot)[1]]) / 256)
    assert naive > 2.0 * renderer.noise().error


def test_only_random_samples_have_noise(renderer):
    for technique, samples in (("ltc", 4), ("ggx", 4), ("reference", 1)):
        renderer.render(floor(technique, samples))
        assert renderer.noise() is None
        assert not {"noise", "noise 2"} & set(renderer.allocated())
    shot = floor("reference", 4)
    renderer.render(shot)
    assert {"noise", "noise 2"} < set(renderer.allocated())
    planned, held = renderer.plan(shot).allocated, renderer.allocated()
    assert [planned[name] for name in ("noise", "noise 2")] == [held["noise"], held["noise 2"]]
    matt = replace(shot.scene.materials[0], f0=(0.0, 0.0, 0.0))
    scene = replace(shot.scene, materials=(matt,))
    renderer.render(replace(shot, scene=scene, settings=RenderSettings("ltc+residual", 4)))
    assert renderer.noise() is None


def test_halves_must_be_whole(renderer):
    renderer.render(floor("reference", 3))
    with pytest.raises(RuntimeError, match="3 samples, expected an even number"):
        renderer.noise()
