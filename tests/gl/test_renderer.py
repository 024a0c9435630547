"""Shots in, pictures out: samples, uploads, programs, limits, memory."""

from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import moderngl
import numpy as np
import pytest

from app.errors import InputError
from app.render.assemble import ShaderError
from app.render.camera import CameraFrame
from app.render.features import LightingFeatures, Limits
from app.render.programs import Programs, ProgramSpec, shader_roots
from app.render.renderer import Renderer
from app.render.sampling import FILTER_RADIUS, pixel_offset
from app.scene import (
    AreaLight,
    Display,
    Material,
    Plane,
    RenderSettings,
    Scene,
    SceneObject,
    Shot,
    Transform,
)
from tests.gl.scenes import (
    DARK,
    FRAME,
    GLOSSY,
    KEY,
    MATTE,
    MIRROR,
    SQUARE,
    ball,
    floor,
    many_lights,
    one_light,
)


def shot(scene: Scene, samples: int = 1, width: int = 64, height: int = 36) -> Shot:
    return Shot(scene, RenderSettings(samples=samples), width, height)


# The picture


def test_orientation(renderer: Renderer) -> None:
    """Row 0 is the top: the lamp is above its reflection, and red is left of green."""
    lamps = tuple(
        AreaLight(name, SQUARE, Plane((x, 1.5, -2.0), (0.5, 0.0, 0.0), (0.0, 0.5, 0.0)), colour)
        for name, x, colour in (("red", -1.0, (9.0, 0.0, 0.0)), ("green", 1.0, (0.0, 9.0, 0.0)))
    )
    scene = Scene((MIRROR,), (floor(MIRROR),), lamps)
    renderer.render(shot(scene))
    radiance = renderer.radiance()
    assert radiance.shape == (36, 64, 3)
    assert radiance.dtype == np.float32
    for channel, side in ((0, slice(0, 32)), (1, slice(32, 64))):
        other = slice(32, 64) if side.start == 0 else slice(0, 32)
        assert radiance[:18, side, channel].max() == 9.0, "the lamp itself, undimmed"
        assert radiance[:18, other, channel].max() < 0.1
        assert 0.1 < radiance[18:, side, channel].max() < 9.0, "its reflection"
    codes = renderer.display()
    assert codes.shape == (36, 64, 3)
    assert codes.dtype == np.uint8
    assert codes[:18, :32, 0].max() > 200
    assert codes[:18, :32, 1].max() < codes[:18, :32, 0].max()


def test_no_lights_is_black(renderer: Renderer) -> None:
    renderer.render(shot(DARK))
    assert not renderer.radiance().any()
    assert not renderer.display().any()
    assert renderer.lighting_passes == 0
    assert [renderer.accumulate(shot(DARK), 3) for _ in range(4)] == [1, 2, 3, 3]


def test_everything_is_finite(renderer: Renderer) -> None:
    for material in (GLOSSY, MATTE, MIRROR, replace(GLOSSY, alpha=(1e-4, 1e-4))):
        for light in (KEY, replace(KEY, two_sided=True), replace(KEY, outline=FRAME)):
            renderer.render(shot(one_light(material, light), 3))
            assert np.isfinite(renderer.radiance()).all()
            assert (renderer.radiance() >= 0.0).all()


def test_diffuse_and_specular_add_up(renderer: Renderer) -> None:
    """Three programs, one picture: diffuse-only plus specular-only is both."""
    hidden = replace(KEY, visible=False)
    pictures = []
    for diffuse, f0 in (
        ((0.5,) * 3, (0.3,) * 3),
        ((0.5,) * 3, (0.0,) * 3),
        ((0.0,) * 3, (0.3,) * 3),
    ):
        material = Material("glossy", diffuse, f0, (0.2, 0.2))
        renderer.render(shot(one_light(material, hidden)))
        pictures.append(renderer.radiance())
    np.testing.assert_allclose(pictures[0], pictures[1] + pictures[2], rtol=1e-5, atol=1e-6)


def test_materials_do_not_depend_on_their_neighbours(renderer: Renderer) -> None:
    """A matte floor looks the same whether or not something glossy is in the scene."""
    alone = Scene((MATTE,), (floor(MATTE),), (KEY,))
    renderer.render(shot(alone))
    expected = renderer.radiance()
    far = replace(ball(GLOSSY), transform=Transform((0.0, 0.0, 90.0)))
    renderer.render(shot(replace(alone, materials=(MATTE, GLOSSY), objects=(floor(MATTE), far))))
    assert renderer._needs is not None
    assert renderer._needs.lighting.specular
    np.testing.assert_allclose(renderer.radiance(), expected, rtol=1e-6)


def test_storages_give_the_same_picture(ctx: moderngl.Context, renderer: Renderer) -> None:
    scene = many_lights(12, two_sided=True)
    renderer.render(shot(scene))
    block = renderer.radiance()
    assert any("Lights" in p for p in _blocks(renderer))
    renderer.limits = replace(renderer.limits, uniform_block_bytes=0)
    renderer.render(shot(replace(scene, camera=replace(scene.camera))))
    renderer._stale = True
    renderer.accumulate(shot(scene), 1)
    assert not _blocks(renderer) or renderer._lighting._lights._texture is not None
    np.testing.assert_array_equal(renderer.radiance(), block)


def _blocks(renderer: Renderer) -> list[str]:
    return [
        name
        for spec in renderer.programs.specs()
        for name in renderer.programs.get(spec)
        if isinstance(renderer.programs.get(spec).get(name, None), moderngl.UniformBlock)
    ]


# Samples


def test_sample_offsets() -> None:
    assert pixel_offset(0) == (0.0, 0.0)
    offsets = np.array([pixel_offset(i) for i in range(4096)])
    assert np.abs(offsets).max() < FILTER_RADIUS
    np.testing.assert_allclose(offsets.mean(axis=0), 0.0, atol=2e-3)
    # The filter's variance, from its definition: a separable window of cosines.
    x = np.linspace(-1.0, 1.0, 20001)
    window = sum(
        a * np.cos(k * np.pi * x) for k, a in enumerate((0.35875, 0.48829, 0.14128, 0.01168))
    )
    variance = FILTER_RADIUS**2 * float((window * x * x).sum() / window.sum())
    np.testing.assert_allclose(offsets.var(axis=0), variance, rtol=5e-3)
    assert len({tuple(offset) for offset in offsets}) == len(offsets)


def test_accumulate_is_render(renderer: Renderer) -> None:
    wanted = shot(one_light(), 5)
    renderer.render(wanted)
    expected = renderer.radiance()
    codes = renderer.display()
    moved = replace(
        wanted, scene=replace(wanted.scene, camera=replace(wanted.scene.camera, fov_y=1.0))
    )
    renderer.accumulate(moved, 5)
    assert [renderer.accumulate(wanted, 5) for _ in range(7)] == [1, 2, 3, 4, 5, 5, 5]
    np.testing.assert_array_equal(renderer.radiance(), expected)
    np.testing.assert_array_equal(renderer.display(), codes)


def test_one_sample_is_the_first_of_many(renderer: Renderer) -> None:
    renderer.render(shot(one_light(), 1))
    first = renderer.radiance()
    renderer.accumulate(shot(DARK), 4)
    renderer.accumulate(shot(one_light(), 4), 4)
    np.testing.assert_array_equal(renderer.radiance(), first)


def test_the_mean_of_samples_is_their_mean(renderer: Renderer) -> None:
    """Against the single samples averaged in float64, here each drawn on its own."""
    wanted = shot(one_light(), 8, 48, 27)
    renderer.render(wanted)
    mean = renderer.radiance()
    total = np.zeros((27, 48, 3))
    for i in range(8):
        renderer._begin(replace(wanted, settings=RenderSettings(samples=1)), 1)
        renderer._samples = i
        renderer._add_sample()
        total += renderer.radiance()
    np.testing.assert_allclose(mean, total / 8, rtol=2e-6, atol=1e-6)


def test_the_mean_survives_65536_samples() -> None:
    """The shader's running mean in float32, against float64: it forgets its roundings."""
    rng = np.random.default_rng(11)
    scale = np.geomspace(1e-4, 1e4, 48).astype(np.float32)
    noise = np.repeat(np.array([0.0, 1e-3, 1.0], dtype=np.float32), 16)
    mean, exact = np.zeros(48, dtype=np.float32), np.zeros(48)
    for sample in range(65536):
        value = scale * (1 + noise * (rng.random(48, dtype=np.float32) - np.float32(0.5)))
        weight = np.float32(1.0 / (sample + 1))
        mean = value if sample == 0 else mean + (value - mean) * weight
        exact += value
    # Half units in the last place, damped, walk at random: 2^-25 sqrt(65536) = 8e-6.
    np.testing.assert_allclose(mean, exact / 65536, rtol=2e-5)


def test_idle_draws_nothing(renderer: Renderer) -> None:
    wanted = shot(one_light(), 2)
    for _ in range(2):
        renderer.accumulate(wanted, 2)
    passes, uploads = renderer.lighting_passes, renderer.uploads
    for _ in range(3):
        renderer.accumulate(wanted, 2)
        # An equal shot of other objects is the same picture as well.
        renderer.accumulate(shot(one_light(), 2), 2)
    assert renderer.lighting_passes == passes
    assert renderer.uploads == uploads


def test_display_changes_keep_the_samples(renderer: Renderer) -> None:
    wanted = shot(one_light(), 3)
    for _ in range(3):
        renderer.accumulate(wanted, 3)
    before = renderer.display()
    passes = renderer.lighting_passes
    brighter = replace(wanted, scene=replace(wanted.scene, display=Display(exposure=2.0)))
    assert renderer.accumulate(brighter, 3) == 3
    assert renderer.lighting_passes == passes
    assert renderer.display().mean() > before.mean()


# Uploads and programs


def test_only_what_changed_is_uploaded(renderer: Renderer) -> None:
    scene = one_light()
    renderer.render(shot(scene))
    assert renderer.uploads == {
        "meshes": 2,
        "light shapes": 1,
        "lights": 1,
        "materials": 1,
        "pictures": 0,
    }

    def after(changed: Scene) -> dict[str, int]:
        before = renderer.uploads
        renderer.render(shot(changed))
        return {k: n - before[k] for k, n in renderer.uploads.items() if n != before[k]}

    assert after(replace(scene, camera=replace(scene.camera, fov_y=0.5))) == {}
    assert after(replace(scene, display=Display(1.0, "none"))) == {}
    moved = replace(scene.objects[1], transform=Transform((0.0, 0.5, 0.0)))
    assert after(replace(scene, objects=(scene.objects[0], moved))) == {"materials": 1}
    after(scene)
    assert after(replace(scene, materials=(replace(GLOSSY, alpha=(0.3, 0.3)),))) == {"materials": 1}
    brighter = replace(KEY, radiance=(9.0, 9.0, 9.0))
    assert after(replace(scene, lights=(brighter,), materials=renderer_materials(renderer))) == {
        "lights": 1,
        "light shapes": 1,
    }


def renderer_materials(renderer: Renderer) -> tuple[Material, ...]:
    held = renderer._held
    assert held is not None
    return held.materials


def test_a_hundred_roughness_steps_compile_nothing(renderer: Renderer) -> None:
    renderer.render(shot(one_light()))
    _ = renderer.texture
    compiled = renderer.programs.compiled
    for i in range(1, 101):
        a = i / 100
        material = Material("glossy", (a, 0.1, 0.1), (1.0 - a, 0.5, 0.5), (a, a))
        renderer.accumulate(shot(one_light(material, replace(KEY, radiance=(a, a, a)))), 1)
    _ = renderer.texture
    assert renderer.programs.compiled == compiled


def test_what_is_not_needed_does_not_exist(ctx: moderngl.Context) -> None:
    """The plan, which needs no GPU, against what a fresh renderer really made."""
    scenes = {
        "dark": DARK,
        "matte": one_light(MATTE),
        "glossy": one_light(GLOSSY),
        "mirror, hidden light": one_light(MIRROR, replace(KEY, visible=False)),
        "shapes only": replace(one_light(), objects=()),
        "many": many_lights(600, two_sided=True),
    }
    plans = {}
    for (name, scene), samples in itertools.product(scenes.items(), (1, 2)):
        renderer = Renderer(ctx)
        wanted = shot(scene, samples)
        renderer.render(wanted)
        renderer.display()
        plan = plans[name, samples] = renderer.plan(wanted)
        assert renderer.allocated() == plan.allocated, name
        compiled = {spec.name: spec.features for spec in renderer.programs.specs()}
        assert compiled == {p.name: p.features for p in plan.programs}, name
        renderer.release()
        assert renderer.allocated() == {}
    for name in ("matte", "shapes only", "dark"):
        assert plans[name, 1].tables == ()
    assert "light shapes" not in plans["mirror, hidden light", 1].allocated
    assert "gbuffer" not in plans["dark", 2].allocated
    assert "radiance 2" not in plans["glossy", 1].allocated
    assert "radiance 2" in plans["glossy", 2].allocated


def test_a_simpler_scene_gives_back_what_it_does_not_need(renderer: Renderer) -> None:
    renderer.render(shot(one_light(), 4))
    renderer.render(shot(one_light(MATTE, replace(KEY, visible=False))))
    assert set(renderer.allocated()) == {
        "gbuffer",
        "depth",
        "radiance",
        "mesh plane",
        "mesh sphere",
        "lights",
        "materials",
    }
    renderer.render(shot(DARK))
    assert set(renderer.allocated()) == {"radiance"}


PAIRED = {
    "HAS_SPECULAR": (0, 1),
    "HAS_DIFFUSE": (0, 1),
    "HAS_SHAPES": (0, 1),
    "ACCUMULATES": (0, 1),
    "HAS_ONE_SIDED": (0, 1),
    "HAS_TWO_SIDED": (0, 1),
    "CULLS": (0, 1),
    "MIXED_LOBES": (0, 1),
    "LIGHT_TEXELS": (0, 64),
    "MATERIAL_TEXELS": (0, 16),
}


def covering_rows() -> list[dict[str, int]]:
    """Return few feature sets in which every pair of values occurs (greedy)."""
    names = list(PAIRED)
    wanted = {
        ((a, x), (b, y))
        for a, b in itertools.combinations(names, 2)
        for x in PAIRED[a]
        for y in PAIRED[b]
    }
    rows = []
    every = [dict(zip(names, v, strict=True)) for v in itertools.product(*PAIRED.values())]
    while wanted:
        best = max(every, key=lambda row: len(wanted & _pairs(row)))
        wanted -= _pairs(best)
        rows.append(best)
    return rows


def _pairs(row: dict[str, int]) -> set[tuple[tuple[str, int], tuple[str, int]]]:
    return set(itertools.combinations(row.items(), 2))


def test_every_pair_of_features_links(ctx: moderngl.Context) -> None:
    programs = Programs(ctx)
    others = LightingFeatures.of(one_light(), 1, Limits.of(ctx)).defines()
    assert others.keys() > PAIRED.keys()
    for row in covering_rows():
        features = {
            **others,
            **row,
            "LIGHT_STORAGE_UNIFORM": int(row["LIGHT_TEXELS"] > 0),
            "MATERIAL_STORAGE_UNIFORM": int(row["MATERIAL_TEXELS"] > 0),
        }
        programs.get(
            ProgramSpec.of("lighting", "passes/fullscreen.vert", "passes/lighting.frag", features)
        )
    assert programs.compiled <= 12
    programs.release()


# Robustness


def test_limits_are_sentences(renderer: Renderer) -> None:
    renderer.limits = replace(renderer.limits, texture_side=256)
    with pytest.raises(InputError, match=r"size: 300x36 is too large .* at most 256 pixels"):
        renderer.render(shot(one_light(), width=300))
    renderer.limits = replace(renderer.limits, uniform_block_bytes=256, texture_side=1)
    with pytest.raises(InputError, match=r"lights: 200 lights with 800 edges .* at most 1024"):
        renderer.render(Shot(many_lights(200), RenderSettings(), 1, 1))


def test_numbers_that_float32_cannot_hold(renderer: Renderer) -> None:
    bright = replace(KEY, radiance=(1.0, 1e30, 1.0))
    far = replace(KEY, plane=Plane((0.0, 1e200, 0.0)))
    for light in (bright, far):
        with pytest.raises(InputError, match=r"light 'key': it reaches 1e\+(30|200), expected"):
            renderer.render(shot(one_light(GLOSSY, light)))
    for axis in (1e-160, 1e-13, 1e13):
        tiny = replace(KEY, plane=Plane((0.0, 0.0, 0.0), (axis, 0.0, 0.0), (0.0, axis, 0.0)))
        with pytest.raises(InputError, match=r"light 'key': its plane's u is 1e[+-]\d+ long"):
            renderer.render(shot(one_light(GLOSSY, tiny)))
    flat = replace(floor(), transform=Transform(scale=(1.0, 1e-300, 1.0)))
    with pytest.raises(InputError, match=r"object 'floor': its scale goes down to 1e-300"):
        renderer.render(shot(replace(one_light(), objects=(flat,))))
    huge = replace(floor(), transform=Transform(scale=(1e13, 1.0, 1.0)))
    with pytest.raises(InputError, match=r"object 'floor': its transform reaches 1e\+13"):
        renderer.render(shot(replace(one_light(), objects=(huge,))))


def test_unknown_techniques_are_refused(renderer: Renderer) -> None:
    with pytest.raises(InputError, match="technique 'lct' is unknown"):
        renderer.render(Shot(one_light(), RenderSettings(technique="lct"), 8, 8))


def test_a_failure_keeps_the_last_picture(renderer: Renderer) -> None:
    renderer.render(shot(one_light()))
    before = renderer.display()
    broken = replace(one_light(), objects=(SceneObject("x", "/no/such.obj", "glossy"),))
    for _ in range(2):
        with pytest.raises(InputError, match=r"such\.obj"):
            renderer.accumulate(shot(broken), 4)
        np.testing.assert_array_equal(renderer.display(), before)
    assert renderer.accumulate(shot(one_light()), 4) == 1
    np.testing.assert_array_equal(renderer.display(), before)


def test_a_broken_shader_keeps_the_last_good_program(
    ctx: moderngl.Context, renderer: Renderer, tmp_path: Path
) -> None:
    (tmp_path / "passes").mkdir()
    override = tmp_path / "passes" / "display.frag"
    good = (shader_roots()[0] / "passes" / "display.frag").read_text(encoding="utf-8")
    override.write_text(good, encoding="utf-8")
    renderer.programs.roots = (tmp_path, *shader_roots())
    renderer.render(shot(one_light()))
    before = renderer.display()
    assert not renderer.reload_shaders(), "nothing changed"

    lines = good.splitlines()
    at = next(i for i, line in enumerate(lines) if "ivec2 pixel" in line)
    broken = [*lines[:at], "    float x = no_such_name;", *lines[at:]]
    override.write_text("\n".join(broken), encoding="utf-8")
    with pytest.raises(ShaderError) as caught:
        renderer.reload_shaders()
    assert caught.value.file == "passes/display.frag"
    assert caught.value.line == at + 1
    assert "no_such_name" in caught.value.message
    np.testing.assert_array_equal(renderer.display(), before)

    override.write_text('#include "common/no_such.glsl"\n' + good, encoding="utf-8")
    with pytest.raises(ShaderError, match=r"passes/display.frag:1: .*no_such.glsl"):
        renderer.reload_shaders()
    np.testing.assert_array_equal(renderer.display(), before)

    inverted = good.replace("color = vec4(quantise(", "color = vec4(1.0 - quantise(")
    override.write_text(inverted, encoding="utf-8")
    assert renderer.reload_shaders()
    np.testing.assert_array_equal(renderer.display(), 255 - before)


def test_a_broken_library_file_is_named(ctx: moderngl.Context, tmp_path: Path) -> None:
    (tmp_path / "common").mkdir()
    (tmp_path / "common" / "srgb.glsl").write_text(
        "\n\n// A comment\nvec3 srgb_from_linear(vec3 linear)\n{\n    return vec2(0.0);\n}\n"
    )
    renderer = Renderer(ctx)
    renderer.programs.roots = (tmp_path, *shader_roots())
    renderer.render(shot(one_light()))
    with pytest.raises(ShaderError) as caught:
        renderer.display()
    assert (caught.value.file, caught.value.line) == ("common/srgb.glsl", 6)
    renderer.release()


class Recorder:
    """A context that remembers what it made, so that a test can ask what is still alive."""

    MAKERS = ("texture", "buffer", "framebuffer", "depth_renderbuffer", "vertex_array", "program")

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._made: list[Any] = []

    def __getattr__(self, name: str) -> Any:
        attribute = getattr(self._ctx, name)
        if name not in self.MAKERS:
            return attribute

        def make(*args: Any, **kwargs: Any) -> Any:
            made = attribute(*args, **kwargs)
            self._made.append(made)
            return made

        return make

    def alive(self) -> int:
        self._made = [m for m in self._made if not isinstance(m.mglo, moderngl.InvalidObject)]
        return len(self._made)


def test_memory_is_flat_over_200_scene_changes(ctx: moderngl.Context) -> None:
    recorder = Recorder(ctx)
    renderer = Renderer(cast(moderngl.Context, recorder))
    variants = [
        one_light(),
        one_light(MATTE),
        one_light(MIRROR, replace(KEY, visible=False)),
        many_lights(20),
        many_lights(150),
        DARK,
    ]

    def step(i: int) -> None:
        size = (16 + 4 * (i % 3), 12)
        renderer.render(shot(variants[i % len(variants)], 1 + i % 2, *size))
        renderer.display()
        renderer.pick(5.0, 5.0)

    for i in range(12):
        step(i)
    before, programs = recorder.alive(), renderer.programs.compiled
    for i in range(12, 204):
        step(i)
    assert recorder.alive() == before
    assert renderer.programs.compiled == programs
    renderer.release()
    assert recorder.alive() == 0


def test_state_left_by_others_does_not_matter(ctx: moderngl.Context, renderer: Renderer) -> None:
    renderer.render(shot(one_light(), 2))
    expected = renderer.display()
    ctx.enable(moderngl.BLEND | moderngl.CULL_FACE | moderngl.DEPTH_TEST)
    ctx.blend_func = moderngl.ZERO, moderngl.ZERO
    ctx.cull_face = "front_and_back"
    ctx.front_face = "cw"
    ctx.depth_func = ">"
    ctx.wireframe = True
    for capability in (0x0B90, 0x8037, 0x8DB9, 0x864F):
        ctx.enable_direct(capability)
    foreign = ctx.simple_framebuffer((7, 5))
    foreign.use()
    foreign.scissor = (1, 1, 2, 2)
    renderer.render(shot(one_light(), 2))
    np.testing.assert_array_equal(renderer.display(), expected)
    ctx.screen.use() if ctx.screen else ctx.detect_framebuffer(0).use()
    foreign.release()


def test_two_renderers_agree(ctx: moderngl.Context, renderer: Renderer) -> None:
    other = Renderer(ctx)
    renderer.render(shot(one_light(), 3))
    other.render(shot(many_lights(5)))
    other.render(shot(one_light(), 3))
    assert renderer.radiance().tobytes() == other.radiance().tobytes()
    assert renderer.display().tobytes() == other.display().tobytes()
    other.release()


def test_timings(renderer: Renderer) -> None:
    renderer.render(shot(one_light(), 1, 320, 180))
    renderer.display()
    figures = renderer.timings()
    assert set(figures) == {"gbuffer", "lighting", "display", "cpu"}
    assert all(0.0 < ms < 60e3 for ms in figures.values())
    assert renderer.timing_source in ("timer queries", "wall clock")
    # Without waiting: the sample before, so nothing new after the first.
    for _ in range(3):
        renderer.render(shot(one_light(), 1, 320, 180))
        renderer.display()
        assert set(renderer.timings(wait=False)) == set(figures)
    assert renderer.timings(wait=False) != figures
    renderer.use_clock("wall clock")
    renderer.render(shot(one_light(), 1, 320, 180))
    renderer.display()
    assert renderer.timing_source == "wall clock"
    assert set(renderer.timings()) == set(figures)
    renderer.render(shot(DARK))
    assert "lighting" not in renderer.timings()


def test_timer_queries_that_return_nothing(renderer: Renderer) -> None:
    """Some software drivers answer 0; the wall clock steps in and says so."""
    renderer.render(shot(one_light(), 3))
    renderer.display()

    class Silent:
        elapsed = 0

    timers = renderer._timers
    timers._unread = {name: [cast(Any, Silent())] for name in timers._unread}
    figures = renderer.timings()
    assert renderer.timing_source == "wall clock"
    assert all(figures[name] > 0.0 for name in ("gbuffer", "lighting", "display"))


def test_nothing_rendered_yet(renderer: Renderer) -> None:
    for ask in (renderer.radiance, renderer.display, lambda: renderer.texture):
        with pytest.raises(RuntimeError, match="nothing was rendered yet"):
            ask()


# Probe


def test_probe_shapes(renderer: Renderer) -> None:
    n = 3
    good = {
        "position": np.zeros((n, 3)),
        "normal": np.tile([0.0, 1.0, 0.0], (n, 1)),
        "tangent": np.tile([1.0, 0.0, 0.0], (n, 1)),
        "view": np.tile([0.0, 0.6, 0.8], (n, 1)),
        "alpha": np.full((n, 2), 0.1),
    }
    out = renderer.probe(one_light(), RenderSettings(), **good)
    assert {k: (v.shape, v.dtype) for k, v in out.items()} == {
        "specular": ((n, 3), np.dtype(np.float32)),
        "diffuse": ((n, 3), np.dtype(np.float32)),
    }
    for name, bad in (
        ("alpha", np.zeros((n, 3))),
        ("view", np.zeros(3)),
        ("normal", np.zeros((2, 3))),
    ):
        with pytest.raises(ValueError, match=name):
            renderer.probe(one_light(), RenderSettings(), **{**good, name: bad})
    empty = {name: values[:0] for name, values in good.items()}
    assert renderer.probe(one_light(), RenderSettings(), **empty)["specular"].shape == (0, 3)
    assert not renderer.probe(DARK, RenderSettings(), **good)["diffuse"].any()


def test_probe_batches(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(7)
    n = 1000
    position = rng.uniform(-1.0, 1.0, (n, 3)) * [1.0, 0.0, 1.0]
    up = np.tile([0.0, 1.0, 0.0], (n, 1))
    inputs = (position, up, up, up, rng.uniform(0.05, 1.0, (n, 1)).repeat(2, axis=1))
    whole = renderer.probe(one_light(), RenderSettings(), *inputs)
    monkeypatch.setattr("app.render.lighting.PROBE_SIDE", 13)
    batched = renderer.probe(one_light(), RenderSettings(), *inputs)
    for name in whole:
        np.testing.assert_array_equal(whole[name], batched[name])
        assert (whole[name] > 0.0).any()


def test_probe_is_what_the_picture_shows(renderer: Renderer) -> None:
    """A white floor's radiance equals the probe at the same points: one shading, two passes."""
    for material, name in (
        (Material("glossy", (1.0,) * 3, (0.0,) * 3), "diffuse"),
        (Material("glossy", (0.0,) * 3, (1.0,) * 3, (0.2, 0.2)), "specular"),
    ):
        scene = Scene((material,), (floor(material),), (replace(KEY, visible=False),))
        renderer.render(shot(scene))
        radiance = renderer.radiance()
        surfaces = renderer._targets.texture("gbuffer")
        depth = np.frombuffer(surfaces.read(), dtype=np.float32).reshape(36, 64, 4)[::-1, :, 2]
        rows, columns = np.nonzero(depth > 0.0)
        frame = CameraFrame.of(scene.camera, 64 / 36)
        ray = frame.ray(columns + 0.5, rows + 0.5, (64, 36))
        position = frame.eye + depth[rows, columns, None].astype(np.float64) * ray
        view = -ray / np.linalg.norm(ray, axis=-1, keepdims=True)
        up = np.tile([0.0, 1.0, 0.0], (len(rows), 1))
        out = renderer.probe(
            scene, RenderSettings(), position, up, up, view, np.full((len(rows), 2), 0.2)
        )
        np.testing.assert_allclose(radiance[rows, columns], out[name], rtol=1e-3, atol=2e-5)
