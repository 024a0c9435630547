"""Differences in false colours: the shaders against their definition in float64."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import moderngl
import numpy as np
import pytest

from app.colour_maps import BERLIN, MAGMA, SEQUENTIAL, colours_at
from app.render.difference import (
    DIFFERENCE_VIEWS,
    LUMINANCE,
    MEASURES,
    NOT_A_NUMBER,
    Numbers,
    Scale,
    colours_of,
    difference,
    magnitude,
    numbers,
    robust_high,
    rounded_up,
    values_of,
)
from app.render.difference_pass import DifferencePass
from app.render.renderer import Renderer
from app.scene import RenderSettings, SceneError, Shot
from tests.gl.evaluate import evaluate
from tests.gl.scenes import one_light

FLOOR = 0.02


def pair(count: int = 4096) -> tuple[np.ndarray, np.ndarray]:
    """Radiances over 8 decades; half of the pairs close to each other."""
    rng = np.random.default_rng(1)
    b = (10.0 ** rng.uniform(-6.0, 2.0, (count, 3))).astype(np.float32)
    near = b * (1.0 + 0.01 * rng.standard_normal((count, 3)))
    a = np.where(np.arange(count)[:, None] % 2, near, b[::-1]).astype(np.float32)
    return a, b


@pytest.mark.parametrize("measure", MEASURES)
def test_functions(ctx, tmp_path, measure):
    a, b = pair()
    body = "result = vec4(difference(a, b), magnitude(b), 0.0, 0.0);"
    features = {"LARGEST_CHANNEL": int(measure == "largest channel"), "MAP_COLORS": 2}
    found = evaluate(ctx, tmp_path, ["common/difference.glsl"], body, {"a": a, "b": b}, features)
    # Rounding of products and of the difference of what is given.
    size = np.maximum(np.abs(a), np.abs(b)).max(axis=1)
    assert np.all(np.abs(found[:, 0] - difference(a, b, measure)) <= 3e-7 * size)
    np.testing.assert_allclose(found[:, 1], magnitude(b, measure), rtol=3e-7)


def test_what_is_not_finite_is_known(ctx, tmp_path):
    values = np.array([0.0, -1.0, 3e38, np.inf, -np.inf, np.nan, 1e-40], np.float32)
    body = "result.x = is_finite(value) ? 1.0 : 0.0;"
    features = {"LARGEST_CHANNEL": 0, "MAP_COLORS": 2}
    found = evaluate(ctx, tmp_path, ["common/difference.glsl"], body, {"value": values}, features)
    np.testing.assert_array_equal(found[:, 0], np.isfinite(values))


@pytest.fixture
def differences(ctx: moderngl.Context) -> Iterator[DifferencePass]:
    made = DifferencePass(ctx)
    yield made
    made.release()


def texture(ctx: moderngl.Context, radiance: np.ndarray) -> moderngl.Texture:
    height, width, _ = radiance.shape
    padded = np.dstack([radiance[::-1], np.ones((height, width), np.float32)])
    made = ctx.texture((width, height), 4, padded.astype(np.float32).tobytes(), dtype="f4")
    made.filter = (moderngl.NEAREST, moderngl.NEAREST)
    return made


def seen(colours: moderngl.Texture) -> np.ndarray:
    width, height = colours.size
    return np.frombuffer(colours.read(), np.uint8).reshape(height, width, 4)[::-1, :, :3]


@pytest.mark.parametrize("measure", MEASURES)
@pytest.mark.parametrize("view", DIFFERENCE_VIEWS[:3])
def test_pictures(ctx, differences, view, measure):
    a, b = (p.reshape(64, 64, 3).copy() for p in pair())
    a[3, 5] = np.nan
    b[7, 9, 1] = np.inf
    scale = Scale(view, 0.7, measure, "viridis")
    textures = [texture(ctx, p) for p in (a, b)]
    got = seen(differences.draw(*textures, scale, FLOOR, (64, 64)))
    for one in textures:
        one.release()
    wanted = colours_of(values_of(view, a, b, measure, FLOOR), scale)
    assert tuple(got[3, 5]) == tuple(got[7, 9]) == NOT_A_NUMBER
    # A level of 255, where float32 rounds the other way.
    assert np.abs(got.astype(int) - wanted).max() <= 1


def test_pictures_of_unequal_size(ctx, differences):
    """A smaller picture is stretched, pixel by pixel."""
    a, b = (p.reshape(64, 64, 3) for p in pair())
    small = b[::2, ::2]
    scale = Scale("absolute", 0.3)
    textures = [texture(ctx, p) for p in (a, small)]
    got = seen(differences.draw(*textures, scale, FLOOR, (64, 64)))
    for one in textures:
        one.release()
    stretched = np.repeat(np.repeat(small, 2, axis=0), 2, axis=1)
    wanted = colours_of(values_of("absolute", a, stretched, "luminance", FLOOR), scale)
    assert np.abs(got.astype(int) - wanted).max() <= 1


def test_values_of_elsewhere(differences):
    rng = np.random.default_rng(2)
    scale = Scale("flip", 1.0)
    with pytest.raises(RuntimeError, match="no values"):
        differences.draw_values(scale, (4, 4))
    for size in ((30, 20), (12, 14)):
        values = rng.random(size[::-1])
        differences.set_values(values)
        got = seen(differences.draw_values(scale, size))
        assert np.abs(got.astype(int) - colours_of(values, scale)).max() <= 1


def test_maps_say_more_by_lightness():
    """A sequential map's lightness only grows, a signed one's only grows from zero outwards."""
    places = np.linspace(0.0, 1.0, 101)
    for name, colours in SEQUENTIAL.items():
        light = (colours_at(colours, places) / 255.0) ** 2.2 @ np.array(LUMINANCE)
        assert np.all(np.diff(light) > 0.0), name
    light = (colours_at(BERLIN, places) / 255.0) ** 2.2 @ np.array(LUMINANCE)
    assert np.all(np.diff(light[50:]) > -1e-3)
    assert np.all(np.diff(light[:50]) < 1e-3)
    # And its two sides differ in hue: blue against red.
    low, high = colours_at(BERLIN, np.array([0.2, 0.8]))
    assert low[2] > low[0] + 50.0
    assert high[0] > high[2] + 50.0


def test_numbers():
    b = np.full((10, 10, 3), 2.0)
    a = b.copy()
    a[0, 0] += (0.5, 0.0, 0.0)
    a[0, 1] -= 0.1
    b[9, 9] = np.nan
    found = numbers(a, b, "largest channel", one_light().lights, (None, np.full((10, 10, 3), 0.3)))
    assert isinstance(found, Numbers)
    assert (found.pixels, found.bad) == (100, 1)
    assert found.max == 0.5
    assert found.mean == pytest.approx(0.6 / 99.0)
    assert found.bias == pytest.approx(0.4 / 99.0)
    assert found.rmse == pytest.approx(np.sqrt((0.25 + 0.01) / 99.0))
    assert found.mean_b == 2.0
    assert found.noise == (None, pytest.approx(0.3))
    assert found.light == max(one_light().lights[0].radiance)
    shares = {name: (of_b, of_light) for name, _, of_b, of_light in found.rows()}
    assert shares["largest"] == pytest.approx((0.25, 0.5 / found.light))
    assert numbers(a, b).max == pytest.approx(0.5 * LUMINANCE[0])
    empty = numbers(np.full((2, 2, 3), np.nan), np.zeros((2, 2, 3)))
    assert (empty.bad, empty.max, empty.mean_b) == (4, 0.0, 0.0)
    with pytest.raises(ValueError, match="expected equal"):
        numbers(a, b[1:])


def test_scales():
    assert [rounded_up(x) for x in (0.0, 0.013, 0.02, 3.1, 7e-9)] == [1.0, 0.02, 0.02, 5.0, 1e-8]
    a, b = pair()
    assert robust_high("flip", a, b, "luminance", FLOOR) == 1.0
    assert robust_high("absolute", b, b, "luminance", FLOOR) == 1.0
    high = robust_high("absolute", a, b, "luminance", FLOOR)
    values = values_of("absolute", a, b, "luminance", FLOOR)
    assert np.mean(values > high) <= 0.01
    assert np.mean(values > high / 2.5) >= 0.01
    signed = Scale("signed", 0.02).legend(("ltc", "reference"))
    assert [text for _, text in signed.ticks] == ["-0.02", "-0.01", "0", "+0.01", "+0.02"]
    assert signed.colours == BERLIN
    absolute = Scale("absolute", 0.02).legend(bad=True)
    assert [text for _, text in absolute.ticks] == ["0", "0.005", "0.01", "0.015", "0.02+"]
    assert absolute.colours == MAGMA
    assert absolute.boxes == ((NOT_A_NUMBER, "NaN"),)
    assert Scale("relative", 0.5).legend().ticks[1][1] == "12.5 %"
    with pytest.raises(ValueError, match="display colours"):
        values_of("flip", a, b, "luminance", FLOOR)


def test_samples_share_their_positions(renderer: Renderer):
    """Twice the samples at the same four places are the same picture; elsewhere they are not."""
    settings = RenderSettings("ltc", 4)
    shot = Shot(one_light(), settings, 48, 32)
    pictures = {}
    for name, wanted in {
        "four": settings,
        "eight": replace(settings, samples=8),
        "four twice": replace(settings, samples=8, positions=4),
    }.items():
        renderer.render(replace(shot, settings=wanted))
        pictures[name] = renderer.radiance()
    # The running mean rounds.
    np.testing.assert_allclose(pictures["four twice"], pictures["four"], atol=1e-6)
    assert np.abs(pictures["eight"] - pictures["four"]).max() > 0.01
    accumulated = replace(shot, settings=replace(settings, samples=1, positions=4))
    for _ in range(8):
        renderer.accumulate(accumulated, 8)
    np.testing.assert_array_equal(renderer.radiance(), pictures["four twice"])
    with pytest.raises(SceneError, match="positions is -1"):
        RenderSettings(positions=-1)
