"""Curved lights: the GPU's float32 against float64 along the very curves (ltc.curved_outline)."""

from __future__ import annotations

import math

import numpy as np
import pytest

from app.curves import evaluate
from app.outline import boundary
from app.presets import disk, ellipse, heart, ring
from app.render.contour_tree import contour_tree
from app.render.renderer import Renderer
from app.render.tables import isotropic_textures
from app.scene import (
    AreaLight,
    BezierContour,
    Outline,
    Plane,
    PolygonContour,
    RenderSettings,
    Scene,
)
from app.scene_io import load_scene
from app.stability.lights import STIFF, bezier, letter, moved, wild
from app.stability.lights import lamp as lamp_of
from app.stability.lights import random_plane as plane_of
from ltc.curved_outline import form_factor, ltc_specular, positive_winding
from ltc.curved_reference import curve_specular_integral_batch
from ltc.resources import resource_path
from ltc.table import sample_textures
from tests.gl.test_probe import FloatArray, Points, lamp_points, random_points, unit

LARGEST, P95 = 5e-4, 1e-4
"""Of radiance 1, specular and diffuse, alpha from 1e-3. Seen: 4e-4, where alpha is below
.005: float32's 6e-8 of the way to the light is 1e-4 of a lobe that is a thousand times
thinner, more in grazing views; 5e-5 for 95 of 100, chords being bounded to 1e-4 each."""


def smooth(rng: np.random.Generator, count: int) -> BezierContour:
    """Return a random smooth closed curve about the origin."""
    angle = np.arange(count) * 2.0 * np.pi / count
    p = rng.uniform(0.4, 1.2, (count, 1)) * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    way = (np.roll(p, -1, axis=0) - np.roll(p, 1, axis=0)) / 6.0 * rng.uniform(0.7, 1.8, (count, 1))
    q, q_way = np.roll(p, -1, axis=0), np.roll(way, -1, axis=0)
    return bezier(np.stack([p, p + way, q - q_way, q], axis=1))


def two_holes() -> Outline:
    return Outline(
        (*moved(disk(), 0, 0, 1), *moved(disk(), -0.4, 0, 0.3), *moved(heart(), 0.4, 0, 0.25))
    )


def logo() -> Outline:
    scene = load_scene(resource_path("assets", "scenes", "14-logo.json"))
    return scene.lights[0].outline


SQUARE = PolygonContour(((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)))
OUTLINES = {
    "disk": disk,
    "heart": heart,
    "ring": ring,
    "two holes": two_holes,
    "S": lambda: letter("S"),
    "&": lambda: letter("&"),
    "g": lambda: letter("g"),
    "B": lambda: letter("B"),
    "word": lambda: letter("Light"),
    "logo": logo,
    "touching": lambda: Outline((*moved(disk(), -0.5, 0, 0.5), *moved(disk(), 0.5, 0, 0.5))),
    "smooth": lambda: Outline((smooth(np.random.default_rng(1), 7),)),
    "wild": lambda: Outline((wild(np.random.default_rng(2), 5),)),
    "wild, nonzero": lambda: Outline((wild(np.random.default_rng(3), 6),), "nonzero"),
    "square with a round hole": lambda: Outline((SQUARE, *moved(disk(), 0.1, 0, 0.6))),
}


def on_outline(rng: np.random.Generator, lamp: AreaLight, count: int) -> FloatArray:
    """Return world points of the light, half of them on its outline, the others about it."""
    curves = np.concatenate(boundary(lamp.outline))
    st = evaluate(curves[rng.integers(0, len(curves), count)], rng.uniform(size=count))
    away = rng.uniform(size=(count, 1)) < 0.5
    st = np.where(away, st * rng.uniform(0.0, 1.5, (count, 1)), st)
    return lamp_points(lamp, st)


def about(rng: np.random.Generator, lamp: AreaLight, count: int, **keywords: object) -> Points:
    """Return points 3 cm to 10 m from the outline, with lobes that point there."""
    target = on_outline(rng, lamp, count)
    way = unit(rng.normal(size=(count, 3)))
    position = target + way * 10.0 ** rng.uniform(-1.5, 1.0, (count, 1))
    return random_points(rng, count, position, mirror=target, **keywords)  # type: ignore[arg-type]


def in_frames(lamp: AreaLight, at: Points, frame: FloatArray) -> list[FloatArray]:
    """Return the light's contours (n, k, 4, 3) in the frames (n, 3, 3) of points."""
    origin, u, v = (np.array(a) for a in (lamp.plane.origin, lamp.plane.u, lamp.plane.v))
    contours = []
    for loop in boundary(lamp.outline):
        world = positive_winding(origin + loop[..., :1] * u + loop[..., 1:] * v)
        away = world - at.position[:, None, None]
        contours.append(np.einsum("nij,nkcj->nkci", frame, away))
    return contours


def frames(normal: FloatArray, x: FloatArray) -> FloatArray:
    """Return rows x, y, normal (n, 3, 3); x is made perpendicular to the normal."""
    x = unit(x - normal * np.sum(normal * x, axis=-1, keepdims=True))
    return np.stack([x, np.cross(normal, x), normal], axis=-2)


def reference(lamp: AreaLight, points: Points) -> tuple[FloatArray, FloatArray]:
    """Return (specular, diffuse), each (n,), in float64."""
    at = points.rounded()
    cosine = np.clip(np.sum(at.normal * at.view, axis=-1), 0.0, 1.0)
    along = (cosine > 1.0 - 1e-14)[:, None]
    contours = in_frames(lamp, at, frames(at.normal, np.where(along, at.tangent, at.view)))
    M, A, _ = sample_textures(isotropic_textures(), at.alpha[:, 0], cosine)
    specular, diffuse = _seen(lamp, at, ltc_specular(M, contours, A), form_factor(contours).value)
    return specular, diffuse


def _seen(lamp: AreaLight, at: Points, *integrals: FloatArray) -> tuple[FloatArray, ...]:
    normal = np.cross(lamp.plane.u, lamp.plane.v)
    front = np.sum(normal * (at.position - np.array(lamp.plane.origin)), axis=-1) > 0.0
    lit = front | lamp.two_sided
    sign = np.where(front, 1.0, -1.0)
    return tuple(np.where(lit, np.maximum(0.0, sign * value), 0.0) for value in integrals)


def probe(
    renderer: Renderer, lamp: AreaLight, points: Points, technique: str = "ltc"
) -> tuple[FloatArray, FloatArray]:
    out = renderer.probe(
        Scene(lights=(lamp,)),
        RenderSettings(technique=technique),
        points.position,
        points.normal,
        points.tangent,
        points.view,
        points.alpha,
    )
    result = []
    for name in ("specular", "diffuse"):
        assert np.all(np.isfinite(out[name])), name
        assert np.all(out[name] >= 0.0), name
        result.append(out[name][:, 0].astype(np.float64))
    return result[0], result[1]


def check(renderer: Renderer, lamp: AreaLight, points: Points, p95: float = P95) -> None:
    for what, got, want in zip(
        ("specular", "diffuse"), probe(renderer, lamp, points), reference(lamp, points), strict=True
    ):
        error = np.abs(got - want)
        i = int(error.argmax())
        assert error[i] <= LARGEST, (
            f"{what} {got[i]:.6f}, expected {want[i]:.6f}, alpha {points.alpha[i, 0]:.4g}, "
            f"point {points.position[i]}"
        )
        assert np.quantile(error, 0.95) <= p95, what


def seed(name: str) -> int:
    return sum(ord(letter) * 31**i for i, letter in enumerate(name)) % 2**31


@pytest.mark.parametrize("name", OUTLINES)
def test_lobes_at_the_outline(renderer, name):
    rng = np.random.default_rng(seed(name))
    lamp = lamp_of(OUTLINES[name](), plane_of(rng))
    check(renderer, lamp, about(rng, lamp, 100))


def test_any_direction(renderer):
    """Most of these lobes see little of the light, and many points stand in its plane's way."""
    rng = np.random.default_rng(4)
    for outline in (disk(), letter("&"), Outline((wild(rng, 6),))):
        lamp = lamp_of(outline, plane_of(rng))
        position = rng.uniform(-2.0, 2.0, (150, 3))
        check(renderer, lamp, random_points(rng, 150, position))


@pytest.mark.parametrize("height", [0.0, 1e-4, 0.3, 0.95])
def test_through_the_horizon(renderer, height):
    """A disk on edge above, in and through the floor; at 0 curves end exactly in it."""
    rng = np.random.default_rng(5)
    for outline in (
        disk(),
        ring(),
        Outline((*moved(disk(), -0.6, 0, 0.5), *moved(heart(), 0.6, -0.5, 0.5))),
    ):
        lamp = lamp_of(outline, Plane((0.0, height, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)))
        count = 100
        position = np.stack(
            [rng.uniform(-2, 2, count), np.zeros(count), rng.uniform(-2, 2, count)], axis=-1
        )
        points = random_points(rng, count, position)
        up = np.tile([0.0, 1.0, 0.0], (count, 1))
        side = unit(np.cross(up, rng.normal(size=(count, 3))))
        theta = np.radians(rng.uniform(0.0, 89.0, count))[:, None]
        view = np.cos(theta) * up + np.sin(theta) * side
        check(renderer, lamp, Points(position, up, view, points.alpha))


@pytest.mark.parametrize("ratio", [1e-4, 1e-2, 1.0, 1e2, 1e4])
def test_size_against_distance(renderer, ratio):
    rng = np.random.default_rng(6)
    u, v = (ratio, 0.0, 0.0), (0.0, 0.6 * ratio, 0.8 * ratio)
    for outline in (heart(), letter("S")):
        lamp = lamp_of(outline, Plane((0.0, 0.0, 0.0), u, v))
        target = on_outline(rng, lamp, 80)
        position = target + unit(rng.normal(size=(80, 3)))
        # A curve 10 km long is known to half a millimetre, half of the sharpest lobe.
        alpha = (0.3, 1.0) if ratio > 1e3 else (1e-3, 1.0)
        points = random_points(rng, 80, position, alpha=alpha, mirror=target)
        check(renderer, lamp, points)


def test_tiny_far_lights_keep_their_digits(renderer):
    """Relative error where almost nothing arrives: pinned to the light's middle."""
    rng = np.random.default_rng(7)
    for distance in (1e2, 1e4):
        lamp = lamp_of(letter("g"), Plane((0.0, 0.0, 0.0), (0.3, 0.0, 0.0), (0.0, 0.3, 0.0)))
        way = unit(rng.normal(size=(60, 3)))
        way[:, 2] = np.abs(way[:, 2]) + 0.3
        position = distance * unit(way)
        points = random_points(rng, 60, position, alpha=(0.2, 1.0), mirror=np.zeros((60, 3)))
        got, want = probe(renderer, lamp, points)[1], reference(lamp, points)[1]
        seen = want > 0.05 * want.max()
        assert seen.sum() > 20
        # The chords that stand for curves so far away are certified absolutely, not relatively,
        # so this holds only because the light's area is exact.
        assert np.median(np.abs(got / np.where(seen, want, 1.0) - 1.0)[seen]) <= 2e-2


@pytest.mark.parametrize("technique", ["ltc", "ggx"])
def test_a_receding_round_light_never_goes_out(renderer, technique):
    """Far away one chord stands for all of it, which is no longer than nothing."""
    distance = np.geomspace(3.0, 3e5, 400)
    toward = unit(np.array([0.5, 0.2, 1.0]))
    normal = unit(np.array([0.6, 0.1, 0.3]) - toward)
    points = Points(
        distance[:, None] * toward,
        np.tile(normal, (400, 1)),
        np.tile(toward - 2.0 * normal * (normal @ toward), (400, 1)),
        np.full((400, 2), 0.2),
    )
    lamp = lamp_of(heart(), Plane((0.0, 0.0, 0.0)))
    seen = probe(renderer, lamp, points, technique)[0] * distance**2
    # Seen: 1e-3 per step, of the chords, which are certified absolutely.
    assert np.max(np.abs(np.diff(np.log(seen[distance > 30.0])))) <= 5e-3


@pytest.mark.parametrize("distance, largest", [(1e-3, LARGEST), (1e-4, LARGEST), (1e-5, 3e-3),
                                               (1e-6, 2e-2)])  # fmt: skip
def test_close_to_a_curve(renderer, distance, largest):
    """Panels meet within 6e-8 of the curve's length, 1 m here, which is felt as near as that."""
    rng = np.random.default_rng(12)
    for outline in (heart(), letter("&")):
        lamp = lamp_of(outline, plane_of(rng))
        curves = np.concatenate(boundary(outline))
        place = evaluate(curves[rng.integers(0, len(curves), 200)], rng.uniform(size=200))
        position = lamp_points(lamp, place) + distance * unit(rng.normal(size=(200, 3)))
        points = random_points(rng, 200, position, alpha=(0.05, 1.0))
        for got, want in zip(probe(renderer, lamp, points), reference(lamp, points), strict=True):
            # In between lies whether a point this near is in front of the curve or behind.
            wobble = 4.0 * 6e-8 / distance
            assert np.max(np.abs(got - want)) <= largest + wobble


@pytest.mark.parametrize("name", STIFF)
def test_stiff_curves(renderer, name):
    rng = np.random.default_rng(seed(name))
    lamp = lamp_of(Outline((bezier(np.array(STIFF[name])),)), plane_of(rng))
    check(renderer, lamp, about(rng, lamp, 80))


def test_one_contour_starts_above_and_one_below_the_horizon(renderer):
    """Each crosses the horizon in its own order; nothing may connect one with the other."""
    rng = np.random.default_rng(8)
    one, other = (
        loop
        for item in (*moved(disk(), -1.2, 0, 0.8), *moved(heart(), 1.2, 0, 0.9))
        for loop in [item]
    )
    for shift in range(4):
        turned = BezierContour(other.curves[shift:] + other.curves[:shift])
        lamp = lamp_of(
            Outline((one, turned)), Plane((0.0, 0.1, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
        )
        position = np.stack(
            [rng.uniform(-2, 2, 50), np.zeros(50), rng.uniform(0.1, 2, 50)], axis=-1
        )
        up = np.tile([0.0, 1.0, 0.0], (50, 1))
        view = unit(up + rng.normal(size=(50, 3)) * (1.0, 0.0, 1.0))
        alpha = np.exp(rng.uniform(np.log(1e-3), 0.0, (50, 1))).repeat(2, axis=1)
        check(renderer, lamp, Points(position, up, view, alpha))


def test_in_the_plane_of_the_light(renderer):
    rng = np.random.default_rng(9)
    lamp = lamp_of(letter("B"))
    st = rng.uniform(-2.0, 2.0, (60, 2))
    points = random_points(rng, 60, lamp_points(lamp, st))
    for values in probe(renderer, lamp, points):
        assert not values.any()


def test_behind_and_below_is_exactly_zero(renderer):
    rng = np.random.default_rng(10)
    lamp = lamp_of(letter("&"), two_sided=False)
    position = rng.uniform(-2.0, 2.0, (60, 3)) - (0.0, 0.0, 2.5)
    for values in probe(renderer, lamp, random_points(rng, 60, position)):
        assert not values.any()
    position = rng.uniform((-1.0, 3.0, 1.0), (1.0, 5.0, 3.0), (60, 3))
    up = np.tile([0.0, 1.0, 0.0], (60, 1))
    points = Points(
        position, up, unit(up + 0.5 * rng.normal(size=(60, 3)) * (1, 0, 1)), np.full((60, 2), 0.2)
    )
    for values in probe(renderer, lamp, points):
        assert not values.any()


def many_curves() -> Outline:
    """Return five hundred curves: a hundred hearts."""
    return Outline(
        tuple(
            item
            for i in range(100)
            for item in moved(heart(), (i % 10) - 4.5, (i // 10) - 4.5, 0.4)
        )
    )


def test_five_hundred_curves(renderer):
    rng = np.random.default_rng(11)
    outline = many_curves()
    assert sum(len(loop) for loop in boundary(outline)) >= 400
    lamp = lamp_of(outline, Plane((0.0, 0.0, 0.0), (0.3, 0.0, 0.0), (0.0, 0.3, 0.0)))
    points = about(rng, lamp, 40)
    # Hundreds of chords, each of them certified.
    check(renderer, lamp, points, p95=2e-4)


def test_polygons_beside_curves_stay_what_they_were(renderer):
    """A polygon's tree of chords gives what its edges alone give."""
    rng = np.random.default_rng(12)
    lamp = lamp_of(Outline((SQUARE,)), plane_of(rng))
    far = AreaLight("far", disk(), Plane((0.0, 1e4, 0.0), (1e-3, 0.0, 0.0), (0.0, 1e-3, 0.0)))
    points = about(rng, lamp, 100)
    alone = probe(renderer, lamp, points)
    out = renderer.probe(
        Scene(lights=(lamp, far)), RenderSettings(technique="ltc"), points.position, points.normal,
        points.tangent, points.view, points.alpha,
    )  # fmt: skip
    for name, values in zip(("specular", "diffuse"), alone, strict=True):
        np.testing.assert_allclose(out[name][:, 0], values, atol=1e-5)


@pytest.mark.parametrize("name", ["disk", "&", "ring"])
def test_ggx_against_the_exact_integral(renderer, name):
    """The default setting's error over anisotropic lobes: that of its weights (docs/ggx.md)."""
    rng = np.random.default_rng(seed(name))
    lamp = lamp_of(OUTLINES[name](), plane_of(rng))
    points = about(rng, lamp, 60, alpha=(5e-3, 1.0), theta=(0.0, 85.0))
    ratio = np.exp(rng.uniform(-1.5, 1.5, 60))
    points.alpha[:, 1] = np.clip(points.alpha[:, 1] * ratio, 5e-3, 1.0)
    at = points.rounded()
    frame = frames(at.normal, at.tangent)
    contours = in_frames(lamp, at, frame)
    wo = np.einsum("nij,nj->ni", frame, at.view)
    one, _ = curve_specular_integral_batch(contours, wo, at.alpha[:, 0], at.alpha[:, 1])
    (want,) = _seen(lamp, at, one)
    error = np.abs(probe(renderer, lamp, points, "ggx")[0] - want)
    # Its tables of errors for polygons: mean .0003, p99 .006, largest .02.
    assert error.mean() <= 1e-3
    assert error.max() <= 2e-2


def test_tree_covers_the_outline_once():
    """Leaves in order are the outline itself; skipping from any node lands where its run ends."""
    for outline in (disk(), letter("&"), many_curves()):
        loops = list(boundary(outline))
        tree = contour_tree(loops)
        leaves = tree.curves[tree.is_leaf]
        assert np.array_equal(tree.skip[tree.is_leaf], np.flatnonzero(tree.is_leaf) + 1)
        steps = [
            np.any(leaves[i, 3] != leaves[(i + 1) % len(leaves), 0]) for i in range(len(leaves))
        ]
        assert sum(steps) == (len(loops) if len(loops) > 1 else 0)
        t = np.linspace(0.0, 1.0, 9)
        for node in range(len(tree.area)):
            inside = np.arange(node, tree.skip[node])
            curves = tree.curves[inside[tree.is_leaf[inside]]]
            points = evaluate(curves[:, None], t).reshape(-1, 2)
            center, radius = tree.disc[node, :2], tree.disc[node, 2]
            assert np.all(np.hypot(*(points - center).T) <= radius * (1.0 + 1e-12))


def test_area_bounds_hold():
    """A node's area is at least what lies between it and its chord, however often."""
    from app.curves import signed_areas

    for outline in (ellipse(), letter("S"), letter("g")):
        tree = contour_tree(list(boundary(outline)))
        for node in range(len(tree.area)):
            inside = np.arange(node, tree.skip[node])
            leaves = tree.curves[inside[tree.is_leaf[inside]]]
            start = leaves[0, 0]
            between = float(np.sum(signed_areas(leaves - start)))
            assert abs(between) <= tree.area[node] * (1.0 + 1e-9) + 1e-15
            assert math.isfinite(tree.area[node])
