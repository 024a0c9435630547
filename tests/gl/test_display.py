"""The display pass against its definition in float64."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import moderngl
import numpy as np
import pytest
from numpy.typing import NDArray

from app.render import tone_map
from app.render.post import DisplayPass
from app.render.programs import Programs
from app.render.renderer import Renderer
from app.scene import TONE_MAPS, Display, RenderSettings, Shot, ToneMap
from tests.gl.evaluate import evaluate
from tests.gl.scenes import one_light

FloatArray = NDArray[np.float64]


def colours() -> FloatArray:
    """Random colours over 40 stops, and the corners: black, greys, pure and huge ones."""
    rng = np.random.default_rng(3)
    spread = 2.0 ** rng.uniform(-20.0, 20.0, (4000, 1)) * rng.uniform(0.0, 1.0, (4000, 3))
    greys = np.repeat(np.geomspace(1e-6, 1e6, 200)[:, None], 3, axis=1)
    pure = np.concatenate([np.eye(3) * scale for scale in (1e-3, 0.18, 1.0, 30.0, 1e9)])
    return np.concatenate([np.zeros((1, 3)), np.full((1, 3), 1e9), greys, pure, spread])


@pytest.mark.parametrize("name", TONE_MAPS)
def test_tone_maps(ctx: moderngl.Context, tmp_path: Path, name: ToneMap) -> None:
    color = colours().astype(np.float32)
    got = evaluate(
        ctx,
        tmp_path,
        ["common/tone_map.glsl"],
        f"result.rgb = tone_map_{name}(color);",
        {"color": color},
        {f"TONE_MAP_{other.upper()}": 1 for other in TONE_MAPS},
    )[:, :3]
    expected = tone_map.TONE_MAP_FUNCTIONS[name](color)
    assert np.isfinite(got).all()
    assert (got >= 0.0).all()
    assert (got <= 1.0).all()
    # Far below a step of 8 bits, 4e-3. AgX's polynomial cancels: its terms reach 40.
    np.testing.assert_allclose(got, expected, atol=4e-5 if name == "agx" else 2e-6)


@pytest.mark.parametrize("name", TONE_MAPS)
def test_tone_maps_are_monotonic_in_grey(name: ToneMap) -> None:
    grey = np.repeat(np.geomspace(1e-5, 1e5, 2000)[:, None], 3, axis=1)
    mapped = tone_map.TONE_MAP_FUNCTIONS[name](grey)
    assert (np.diff(mapped, axis=0) >= -1e-12).all()
    assert np.ptp(mapped, axis=1).max() < 4e-3, "grey stays grey"
    assert mapped[0].max() < 1e-2
    assert mapped[-1].min() > 0.9


def test_agx_puts_middle_grey_in_the_middle() -> None:
    """Of the code values: AgX's contrast curve pivots there."""
    code = tone_map.srgb_from_linear(tone_map.agx([0.18, 0.18, 0.18]))
    np.testing.assert_allclose(code, 0.5, atol=0.03)


def test_srgb(ctx: moderngl.Context, tmp_path: Path) -> None:
    linear = np.concatenate([np.linspace(0.0, 1.0, 1001), np.linspace(0.003, 0.0033, 64)])
    color = np.repeat(linear[:, None], 3, axis=1).astype(np.float32)
    got = evaluate(
        ctx,
        tmp_path,
        ["common/srgb.glsl"],
        "result.rgb = srgb_from_linear(color);",
        {"color": color},
    )[:, :3]
    np.testing.assert_allclose(got, tone_map.srgb_from_linear(color), atol=1e-6)
    # Known code values: IEC 61966-2-1.
    np.testing.assert_allclose(
        tone_map.srgb_from_linear([0.0, 0.0031308, 0.21404114, 1.0]),
        [0.0, 0.04045, 0.5, 1.0],
        atol=1e-6,
    )


def test_thresholds(ctx: moderngl.Context, tmp_path: Path) -> None:
    y, x = np.mgrid[0:16, 0:16]
    got = evaluate(
        ctx,
        tmp_path,
        ["common/dither.glsl"],
        "result.x = bayer_threshold(ivec2(x, y));",
        {"x": x.ravel(), "y": y.ravel()},
    )[:, 0].reshape(16, 16)
    np.testing.assert_array_equal(got, tone_map.bayer_thresholds(16, 16)[::-1])
    # Each 8x8 block holds every threshold once, so a flat tone keeps its mean.
    np.testing.assert_array_equal(np.sort(got[:8, :8].ravel()), (np.arange(64) + 0.5) / 64)
    np.testing.assert_array_equal(got[:8, :8], got[8:, 8:])


def display_of(ctx: moderngl.Context, radiance: FloatArray, display: Display) -> NDArray[np.uint8]:
    """Return what the display pass makes of a picture (h, w, 3), row 0 at the top."""
    height, width = radiance.shape[:2]
    texels = np.zeros((height, width, 4), dtype=np.float32)
    texels[..., :3] = radiance[::-1]
    texture = ctx.texture((width, height), 4, texels.tobytes(), dtype="f4")
    target = ctx.simple_framebuffer((width, height))
    programs = Programs(ctx)
    display_pass = DisplayPass(ctx, programs)
    display_pass.draw(target, texture, display)
    data = np.frombuffer(target.read(components=3, alignment=1), dtype=np.uint8)
    (ctx.screen or ctx.detect_framebuffer(0)).use()
    for thing in (display_pass, programs, target, texture):
        thing.release()
    return data.reshape(height, width, 3)[::-1]


@pytest.mark.parametrize("name", TONE_MAPS)
def test_pictures(ctx: moderngl.Context, name: ToneMap) -> None:
    rng = np.random.default_rng(5)
    radiance = (2.0 ** rng.uniform(-8.0, 6.0, (40, 56, 3))).astype(np.float32).astype(np.float64)
    display = Display(-1.5, name)
    got = display_of(ctx, radiance, display)
    expected = tone_map.quantise(tone_map.display_codes(radiance, display))
    difference = np.abs(got.astype(int) - expected.astype(int))
    # Only where a value falls on a threshold within rounding.
    assert difference.max() <= 1
    assert (difference > 0).mean() < 5e-3


def test_dither_is_unbiased_and_below_one_step(ctx: moderngl.Context) -> None:
    code = np.linspace(10.0, 12.0, 33) / 255.0
    linear = np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)
    for wanted, value in zip(code * 255.0, linear, strict=True):
        got = display_of(ctx, np.full((16, 16, 3), value), Display(0.0, "none")).astype(float)
        assert np.abs(got - wanted).max() < 1.0
        assert got.mean() == pytest.approx(wanted, abs=1.0 / 64)


def test_black_and_white_are_not_dithered(ctx: moderngl.Context) -> None:
    for value, code in ((0.0, 0), (1.0, 255), (1e30, 255)):
        assert (display_of(ctx, np.full((8, 8, 3), value), Display(32.0, "none")) == code).all()


def test_exposure_is_in_stops(ctx: moderngl.Context) -> None:
    radiance = np.full((8, 8, 3), 0.02)
    brighter = display_of(ctx, radiance, Display(3.0, "none"))
    np.testing.assert_array_equal(brighter, display_of(ctx, 8.0 * radiance, Display(0.0, "none")))


def test_present_equals_display(ctx: moderngl.Context, renderer: Renderer) -> None:
    """The hook for windows: the same bytes in anybody's framebuffer."""
    shot = Shot(one_light(), RenderSettings(samples=2), 70, 40)
    renderer.render(shot)
    target = ctx.simple_framebuffer((70, 40))
    renderer.present(shot, target)
    data = np.frombuffer(target.read(components=3, alignment=1), dtype=np.uint8)
    np.testing.assert_array_equal(data.reshape(40, 70, 3)[::-1], renderer.display())
    # Other display settings need no new samples.
    plain = replace(shot, scene=replace(shot.scene, display=Display(1.0, "none")))
    renderer.present(plain, target)
    data = np.frombuffer(target.read(components=3, alignment=1), dtype=np.uint8)
    expected = tone_map.quantise(tone_map.display_codes(renderer.radiance(), plain.scene.display))
    difference = np.abs(data.reshape(40, 70, 3)[::-1].astype(int) - expected.astype(int))
    assert difference.max() <= 1
    (ctx.screen or ctx.detect_framebuffer(0)).use()
    target.release()
