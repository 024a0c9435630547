"""Pictures on lights: the atlas against `ltc.prefilter`, what lobes see against `ltc.textured`.

And what only the renderer has: where a picture lies on a light, its filling and refilling, and
that scenes without pictures have nothing of it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from app.pictures import load_frame
from app.presets import ring
from app.render.features import Limits
from app.render.needs import needs_of
from app.render.picture_layout import LaidPicture, lay_pictures
from app.render.pictures import PictureAtlas
from app.render.programs import Programs
from app.render.tables import isotropic_textures
from app.render.truth import shading_frames
from app.scene import (
    AreaLight,
    Camera,
    Material,
    Outline,
    Picture,
    Plane,
    PolygonContour,
    RenderSettings,
    Scene,
    SceneObject,
    Shot,
)
from ltc import transform
from ltc.bezier import from_polygon
from ltc.ggx_boundary import Views
from ltc.prefilter import HALF_SCALE, PAD, Pyramid, prefilter
from ltc.table import sample_textures
from ltc.textured import cosine_mean_radiance
from ltc.textured_reference import CosineLobe, GgxLobe, textured_integrals

FloatArray = NDArray[np.float64]

SQUARE = Outline((PolygonContour(((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))),))
TAPS = 5


def unit(v: FloatArray) -> FloatArray:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def smooth_picture(path: Path, width: int = 96, height: int = 64) -> Picture:
    """Write a picture of soft blobs and return it."""
    rng = np.random.default_rng(3)
    y, x = np.mgrid[0:height, 0:width]
    value = np.zeros((height, width, 3))
    for _ in range(9):
        centre, size = rng.uniform(0, 1, 2) * [width, height], rng.uniform(0.05, 0.2) * width
        bump = np.exp(-((x - centre[0]) ** 2 + (y - centre[1]) ** 2) / (2.0 * size**2))
        value += bump[..., None] * rng.uniform(0.0, 1.0, 3)
    Image.fromarray((255.0 * value / value.max()).astype(np.uint8)).save(path)
    return Picture(str(path))


def lamp(picture: Picture | None, outline: Outline = SQUARE) -> AreaLight:
    return AreaLight("l", outline, Plane(), (1.0, 1.0, 1.0), picture=picture)


def scene_of(light: AreaLight) -> Scene:
    return Scene((Material("m"),), (SceneObject("o", "plane", "m"),), (light,))


def rectangle_of(laid: LaidPicture) -> tuple[FloatArray, FloatArray]:
    """Return corner and size of the rectangle around a light, in its own (s, t) [m]."""
    inner = laid.size / (1.0 + 2.0 * PAD)
    return laid.corner + PAD * inner, inner


def outline_in_rectangle(laid: LaidPicture) -> list[FloatArray]:
    corner, size = rectangle_of(laid)
    return [
        ((loop if loop.ndim == 3 else from_polygon(loop)) - corner) / size
        for loop in laid.geometry.loops
    ]


def pyramid_of(laid: LaidPicture) -> Pyramid:
    """Return the library's pyramid of a picture."""
    # Row 0 of a file is the top, v goes up.
    return prefilter(laid.frame.texels[::-1, :, :3], outline_in_rectangle(laid), limit=1024)


@pytest.fixture
def atlas(ctx):
    """An atlas to be filled; what it holds is read back with `PictureAtlas.read`."""
    programs = Programs(ctx)
    made = PictureAtlas(ctx, programs)
    yield made
    made.release()
    programs.release()


@pytest.mark.parametrize("outline", [SQUARE, ring()], ids=["square", "ring"])
def test_levels_are_those_of_the_library(atlas, tmp_path, outline):
    layout = lay_pictures((lamp(smooth_picture(tmp_path / "p.png"), outline),), 0.0, 16384)
    atlas.update(layout)
    laid = layout.pictures[0]
    texels = atlas.read() / HALF_SCALE * np.array([laid.largest] * 3 + [1.0])
    pyramid = pyramid_of(laid)
    for level, (x, y), (width, height) in zip(
        pyramid.levels, laid.level_corners(), laid.level_sizes(), strict=True
    ):
        found = texels[y : y + height, x : x + width]
        # Half floats keep 11 binary digits; the shader samples a texel at 16 points.
        np.testing.assert_allclose(found[..., 3], level[..., 3], rtol=1.1e-3, atol=1e-7)
        np.testing.assert_allclose(found[..., :3], level[..., :3], rtol=2e-3, atol=4e-3)


@dataclass(frozen=True)
class Case:
    """Points that see a light with a picture, and the light as they see it."""

    inputs: list[FloatArray]
    """position, normal, tangent, view, alpha: as the probe takes them."""
    frames: FloatArray
    """(n, 3, 3): rows o, U, W of the picture's rectangle in the shading frame, x along the view."""
    wo: FloatArray
    """(n, 3) in that frame."""


def random_case(laid: LaidPicture, seed: int, n: int, alpha: tuple[float, float]) -> Case:
    rng = np.random.default_rng(seed)
    position = 1.5 * rng.normal(size=(n, 3))
    position[:, 2] = np.exp(rng.uniform(np.log(0.1), np.log(6.0), n))
    target = np.concatenate([0.6 * rng.normal(size=(n, 2)), np.zeros((n, 1))], axis=1)
    way = unit(target - position)
    theta = np.radians(rng.uniform(0.0, 85.0, n))[:, None]
    normal = unit(np.cos(theta) * way + np.sin(theta) * unit(np.cross(way, rng.normal(size=3))))
    view = 2.0 * np.sum(normal * way, axis=-1, keepdims=True) * normal - way
    a = np.exp(rng.uniform(*np.log(alpha), n))
    tangent = unit(np.cross(normal, [0.3, 0.5, 0.1]))
    inputs = [
        values.astype(np.float32).astype(np.float64)
        for values in (position, normal, tangent, view, np.stack([a, a], axis=-1))
    ]
    position, normal, view = inputs[0], unit(inputs[1]), unit(inputs[3])
    frame = shading_frames(normal, view)
    corner, size = rectangle_of(laid)
    basis = np.stack([laid.geometry.u, laid.geometry.v])
    origin = laid.geometry.origin + corner @ basis - position
    axes = np.broadcast_to(size[:, None] * basis, (n, 2, 3))
    rows = np.concatenate([origin[:, None], axes], axis=1)
    return Case(
        inputs, np.einsum("nij,nkj->nki", frame, rows), np.einsum("nij,nj->ni", frame, view)
    )


@pytest.mark.parametrize("outline", [SQUARE, ring()], ids=["square", "ring"])
def test_lobes_see_what_the_library_says(renderer, tmp_path, outline):
    """The probe with a picture, over the probe without, against `cosine_mean_radiance`."""
    light = lamp(smooth_picture(tmp_path / "p.png"), outline)
    laid = lay_pictures((light,), 0.0, 16384).pictures[0]
    pyramid = pyramid_of(laid)
    case = random_case(laid, 0, 3000, (0.01, 1.0))
    seen = renderer.probe(Scene(lights=(light,)), RenderSettings("ltc"), *case.inputs)
    plain = renderer.probe(
        Scene(lights=(replace(light, picture=None),)), RenderSettings("ltc"), *case.inputs
    )
    M, _, _ = sample_textures(isotropic_textures(), case.inputs[4][:, 0], case.wo[:, 2])
    in_cosine = np.einsum("nij,nkj->nki", transform.invert(M), case.frames)
    for lobe, frames in (("specular", in_cosine), ("diffuse", case.frames)):
        error = np.abs(seen[lobe] - plain[lobe] * cosine_mean_radiance(pyramid, frames, TAPS))
        assert np.mean(error) <= 2e-4
        assert np.quantile(error, 0.99) <= 2e-3
        assert np.max(error) <= 1e-2


@pytest.mark.parametrize("taps", [1, 3, 9])
def test_other_numbers_of_taps(renderer, tmp_path, taps):
    light = lamp(smooth_picture(tmp_path / "p.png"))
    laid = lay_pictures((light,), 0.0, 16384).pictures[0]
    case = random_case(laid, 2, 500, (0.01, 1.0))
    settings = RenderSettings(f"ltc/taps-{taps}")
    seen = renderer.probe(Scene(lights=(light,)), settings, *case.inputs)["diffuse"]
    plain = renderer.probe(Scene(lights=(replace(light, picture=None),)), settings, *case.inputs)[
        "diffuse"
    ]
    error = np.abs(seen - plain * cosine_mean_radiance(pyramid_of(laid), case.frames, taps))
    assert np.mean(error) <= 2e-4
    assert np.max(error) <= 1e-2


def test_diffuse_lobes_take_one_look_where_texels_are_nearly_square(renderer, tmp_path):
    light = lamp(smooth_picture(tmp_path / "p.png", 64, 64))
    laid = lay_pictures((light,), 0.0, 16384).pictures[0]
    case = random_case(laid, 4, 500, (0.01, 1.0))
    seen = renderer.probe(Scene(lights=(light,)), RenderSettings("ltc"), *case.inputs)["diffuse"]
    plain = renderer.probe(
        Scene(lights=(replace(light, picture=None),)), RenderSettings("ltc"), *case.inputs
    )["diffuse"]
    pyramid = pyramid_of(laid)
    one, five = (plain * cosine_mean_radiance(pyramid, case.frames, n) for n in (1, TAPS))
    assert np.max(np.abs(seen - one)) <= 2e-3
    np.testing.assert_allclose(one, five, atol=1e-4)


def test_half_vectors_are_nearer_the_truth_than_feet(renderer, tmp_path):
    """What the paper's place costs a diffuse surface, with the same levels.

    Its footprints are nearly round, so that more taps change next to nothing.
    """
    light = lamp(smooth_picture(tmp_path / "p.png", 24, 16))
    laid = lay_pictures((light,), 0.0, 16384).pictures[0]
    case = random_case(laid, 3, 150, (0.05, 1.0))
    front = case.inputs[0][:, 2] > 0.0
    exact = textured_integrals(
        laid.frame.texels[::-1, :, :3], outline_in_rectangle(laid), case.frames,
        CosineLobe.diffuse(len(front)),
    ).value * front[:, None]  # fmt: skip
    errors = []
    for variant in ("/foot-tap", "/taps-1", ""):
        settings = RenderSettings(f"ltc{variant}")
        seen = renderer.probe(Scene(lights=(light,)), settings, *case.inputs)["diffuse"]
        errors.append(np.mean(np.abs(seen - exact)))
    assert errors[1] < 0.6 * errors[0]
    assert abs(errors[2] - errors[1]) < 0.01 * errors[1]


@pytest.mark.parametrize("technique", ["reference", "ltc+residual"])
@pytest.mark.parametrize("outline", [SQUARE, ring()], ids=["square", "ring"])
def test_samples_converge_to_exact_integrals(renderer, tmp_path, technique, outline):
    """Of the very picture, bilinear: 24 points, 64 independent means of 64 samples each."""
    light = lamp(smooth_picture(tmp_path / "p.png", 24, 16), outline)
    laid = lay_pictures((light,), 0.0, 16384).pictures[0]
    case = random_case(laid, 1, 24, (0.05, 1.0))
    picture = laid.frame.texels[::-1, :, :3]
    alpha = case.inputs[4][:, 0]
    outline_in = outline_in_rectangle(laid)
    lobes = {
        "specular": GgxLobe(Views(case.wo, alpha, alpha)),
        "diffuse": CosineLobe.diffuse(len(alpha)),
    }
    front = np.sum(case.inputs[0] * np.cross(laid.geometry.u, laid.geometry.v), axis=-1) > 0.0
    replicas = 64
    repeated = [np.tile(values, (replicas, 1)) for values in case.inputs]
    found = renderer.probe(Scene(lights=(light,)), RenderSettings(technique, 64), *repeated)
    for name, lobe in lobes.items():
        exact = textured_integrals(picture, outline_in, case.frames, lobe).value * front[:, None]
        means = found[name].reshape(replicas, -1, 3).astype(np.float64)
        error = np.maximum(means.std(axis=0, ddof=1) / np.sqrt(replicas), 3e-5)
        z = (means.mean(axis=0) - exact) / error
        # 72 numbers, of which three colours share their samples.
        assert np.max(np.abs(z)) <= 4.5, name
        assert np.mean(z**2) <= 2.0, name


@pytest.mark.parametrize("technique", ["ltc", "ggx"])
def test_a_picture_of_one_colour_is_that_colour(renderer, tmp_path, technique):
    Image.new("RGB", (5, 3), (188, 128, 64)).save(tmp_path / "p.png")
    light = lamp(Picture(str(tmp_path / "p.png")), ring())
    colour = load_frame(light.picture, 0.0).texels[0, 0, :3]
    shots = [
        Shot(
            replace(scene_of(item), camera=Camera((0.0, 1.0, 4.0), (0.0, 0.0, 0.0))),
            RenderSettings(technique), 32, 24,
        )
        for item in (light, replace(light, picture=None, radiance=tuple(map(float, colour))))
    ]  # fmt: skip
    pictures = []
    for shot in shots:
        renderer.render(shot)
        pictures.append(renderer.radiance())
    # Colour and coverage are rounded to half floats one by one.
    np.testing.assert_allclose(pictures[0], pictures[1], rtol=5e-4, atol=1e-6)


def test_a_picture_stands_upright_where_it_was_put(renderer, tmp_path):
    """Seen from the front: top left red, top right green, bottom left blue, bottom right white."""
    corners = np.array([[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [255, 255, 255]]], np.uint8)
    Image.fromarray(corners.repeat(8, axis=0).repeat(8, axis=1)).save(tmp_path / "p.png")
    light = lamp(Picture(str(tmp_path / "p.png")))
    camera = Camera((0.0, 1.0, 5.0), (0.0, 1.0, 0.0))

    def seen(picture: Picture) -> FloatArray:
        scene = replace(scene_of(replace(light, picture=picture)), objects=(), camera=camera)
        renderer.render(Shot(scene, RenderSettings("ltc"), 64, 64))
        return renderer.radiance()[24:40:15, 24:40:15]

    assert light.picture is not None
    linear = (corners / 255.0) ** 2.2
    np.testing.assert_allclose(seen(light.picture), linear, atol=0.01)
    mirrored = seen(replace(light.picture, mirror=(True, False)))
    np.testing.assert_allclose(mirrored, linear[:, ::-1], atol=0.01)
    turned = seen(replace(light.picture, rotation=np.pi / 2.0))
    np.testing.assert_allclose(turned, np.rot90(linear), atol=0.01)


def test_only_what_changed_is_filtered_again(atlas, tmp_path):
    first = lamp(smooth_picture(tmp_path / "a.png"))
    second = replace(lamp(smooth_picture(tmp_path / "b.png", 40, 80)), name="k")

    def filtered(*lights: AreaLight) -> int:
        layout, before = lay_pictures(lights, 0.0, 16384), atlas.filtered
        held = atlas.holds(layout)
        atlas.update(layout)
        assert held == (atlas.filtered == before)
        assert atlas.holds(layout)
        return atlas.filtered - before

    assert filtered(first, second) == 2
    moved = replace(first, plane=Plane((1.0, 2.0, 3.0)), radiance=(2.0, 1.0, 0.5))
    assert filtered(moved, second) == 0
    assert first.picture is not None
    assert filtered(replace(first, picture=replace(first.picture, mirror=(True, False))), second)
    atlas.forget()
    assert filtered(first, second) == 2
    atlas.update(lay_pictures((), 0.0, 16384))
    assert atlas.bytes == 0


@pytest.mark.parametrize("size", [(1, 1), (1, 700), (300, 2)])
def test_thin_pictures(atlas, renderer, tmp_path, size):
    values = np.random.default_rng(1).integers(0, 255, (size[1], size[0], 3), dtype=np.uint8)
    Image.fromarray(values).save(tmp_path / "p.png")
    light = lamp(Picture(str(tmp_path / "p.png")))
    layout = lay_pictures((light,), 0.0, 16384)
    atlas.update(layout)
    texels = atlas.read()
    assert np.all(np.isfinite(texels))
    # Values are relative to the largest, and no mean is above it.
    assert np.all(texels <= HALF_SCALE * 1.001)
    renderer.render(Shot(scene_of(light), RenderSettings("ltc"), 32, 24))
    assert np.all(np.isfinite(renderer.radiance()))


def test_scenes_without_pictures_have_nothing_of_it(tmp_path):
    with_picture = needs_of(scene_of(lamp(smooth_picture(tmp_path / "p.png"))), 1, Limits(), "ltc")
    without = needs_of(scene_of(lamp(None)), 1, Limits(), "ltc")
    (name,) = {"picture base"} & {spec.name for spec in with_picture.programs}
    assert name not in {spec.name for spec in without.programs}
    dark = replace(lamp(smooth_picture(tmp_path / "p.png")), radiance=(0.0, 0.0, 0.0))
    assert not needs_of(scene_of(dark), 1, Limits(), "ltc").lighting.lights.pictures
