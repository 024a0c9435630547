"""Technique ``ggx`` in float32 against its float64 definition, `ltc.ggx`.

Whole functions of ``shaders/ggx`` run over arrays, each pixel with its own light, point,
tangent frame and alphas. Light radiance is 1.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import moderngl
import numpy as np
import pytest
from numpy.typing import NDArray

from app.outline import resolve
from app.render.pack import pack_lights
from app.scene import AreaLight, Plane
from ltc import ggx
from ltc.bounds import half_vector_bound
from ltc.polygon import loops_form_factor
from ltc.resources import resource_path
from tests.gl.evaluate import evaluate
from tests.gl.test_probe import (
    CASES,
    SQUARE,
    STAR,
    emitting_normal,
    lamp_points,
    light,
    on_light,
    random_light,
    unit,
)

FloatArray = NDArray[np.float64]

TWINS = {
    "ggx_view",
    "half_vector_cone",
    "half_vector_edge",
    "area_tangent",
    "double_cosine_of_third",
    "probe_lights",
    "shade_lights",
    "ggx_bound",
}
STAGE = "a stage of the integral, tested whole by the tests of probe_lights"
GPU_ONLY = {
    "span_along": "a stage of ggx_bound, tested with it",
    "half_vector_span": "a stage of ggx_bound, tested with it",
    "ggx_weights": STAGE,
    "add_fan_node": STAGE,
    "add_chord_node": STAGE,
    "along_edge": STAGE,
    "fan_node": STAGE,
    "ggx_light": STAGE,
    "direction_difference": STAGE,
    "origin_half_vector": STAGE,
    "is_pinned": STAGE,
    "add_pinned_edge": STAGE,
    "pinned_vector": STAGE,
    "light_edge": STAGE,
    "ggx_light_specular": STAGE,
    "ggx_sliver": STAGE,
    "ggx_contour_part": STAGE,
    "half_vector_node": STAGE,
    "is_panel_ready": STAGE,
    "curve_fan_node": STAGE,
    "add_pinned_curve": STAGE,
    "add_pinned_node": STAGE,
    "ggx_terms": STAGE,
}

FEATURES = {
    "HAS_SPECULAR": 1,
    "HAS_DIFFUSE": 1,
    "HAS_ONE_SIDED": 1,
    "HAS_TWO_SIDED": 1,
    "HAS_CURVES": 0,
    "CURVE_NODES": 4,
    "CURVE_RULE": 0,
    "COUNTS_EVALUATIONS": 0,
    "HAS_EXACT_FMA": 0,
    "HAS_PICTURES": 0,
    "PROBES": 1,
    "CULLS": 0,
    "MIXED_LOBES": 0,
    "GGX_NODES": 2,
}


def test_every_function_is_listed():
    found = set()
    for path in resource_path("shaders", "ggx").glob("*.glsl"):
        text = re.sub(r"//[^\n]*|^\s*#[^\n]*", "", path.read_text(encoding="utf-8"), flags=re.M)
        found |= set(re.findall(r"^\w+ (\w+)\(", text, flags=re.M))
    assert found == TWINS | set(GPU_ONLY)
    assert not TWINS & set(GPU_ONLY)


@dataclass
class Points:
    """Float32 inputs, n of them; point i sees the light ``lamp[i]``."""

    lamp: NDArray[np.int64]
    position: FloatArray
    normal: FloatArray
    tangent: FloatArray
    view: FloatArray
    alpha: FloatArray

    def rounded(self) -> Points:
        """As the GPU gets them, in float64 again, directions unit again."""

        def f32(a: FloatArray) -> FloatArray:
            return a.astype(np.float32).astype(np.float64)

        return Points(
            self.lamp,
            f32(self.position),
            unit(f32(self.normal)),
            f32(self.tangent),
            unit(f32(self.view)),
            f32(self.alpha),
        )


def frames(at: Points) -> FloatArray:
    """Return rows x, y, z of the tangent frames, (n, 3, 3)."""
    n = at.normal
    x = unit(at.tangent - n * np.sum(n * at.tangent, axis=-1, keepdims=True))
    return np.stack([x, np.cross(n, x), n], axis=-2)


def reference(
    lamps: Sequence[AreaLight], points: Points, nodes: int, f0: float = 1.0
) -> tuple[FloatArray, FloatArray]:
    """Return (specular, diffuse), each (n,), in float64."""
    at = points.rounded()
    frame = frames(at)
    wo = np.einsum("nij,nj->ni", frame, at.view)
    specular, diffuse = np.zeros((2, len(wo)))
    for index, lamp in enumerate(lamps):
        mine = np.flatnonzero(points.lamp == index)
        origin, u, v = (np.array(a) for a in (lamp.plane.origin, lamp.plane.u, lamp.plane.v))
        loops = []
        for loop in resolve(lamp.outline):
            # Not reversed: the same edges closing it, in the same order, as on the GPU.
            world = origin + loop[:, :1] * u + loop[:, 1:] * v
            loops.append((world - at.position[mine, None]) @ np.swapaxes(frame[mine], -1, -2))
        front = np.sum(np.cross(u, v) * (at.position[mine] - origin), axis=-1) > 0.0
        sign = np.where(front, -1.0, 1.0) * (front | lamp.two_sided)
        ax, ay = at.alpha[mine].T
        one, fresnel = ggx.ggx_specular(loops, wo[mine], ax, ay, nodes)
        specular[mine] = np.maximum(0.0, sign * (f0 * (one - fresnel) + fresnel))
        diffuse[mine] = np.maximum(0.0, sign * loops_form_factor(loops))
    return specular, diffuse


class Probe:
    """Runs probe_lights for points that each have their own light."""

    def __init__(self, ctx: moderngl.Context, folder: Path) -> None:
        self.ctx, self.folder = ctx, folder

    def run(
        self, lamps: Sequence[AreaLight], points: Points, nodes: int = 2
    ) -> tuple[FloatArray, FloatArray]:
        """Return GPU specular and diffuse, (n,); nothing may be non-finite or negative."""
        body = """
            vec3 specular;
            vec3 diffuse;
            probe_lights(1, position, normal, tangent, wo, alpha, specular, diffuse);
            result = vec4(specular.x, diffuse.x, 0.0, 0.0);
        """
        out = self.evaluate(lamps, points, nodes, body)
        return out[:, 0], out[:, 1]

    def evaluate(
        self, lamps: Sequence[AreaLight], points: Points, nodes: int, body: str
    ) -> FloatArray:
        """Return the ``result`` of statements that see each point's inputs, (n, 4)."""
        packed = [pack_lights([lamp]) for lamp in lamps]
        texels = np.zeros((len(lamps), max(map(len, packed)), 4), dtype=np.float32)
        for row, data in zip(texels, packed, strict=True):
            row[: len(data)] = data
        prelude = """
            int light_row;
            vec4 light_texel(int index) { return texelFetch(lights, ivec2(index, light_row), 0); }
        """
        inputs = {
            "lamp": points.lamp,
            "position": points.position,
            "normal": points.normal,
            "tangent": points.tangent,
            "wo": points.view,
            "alpha": points.alpha,
        }
        features = {**FEATURES, "GGX_NODES": nodes}
        out = evaluate(
            self.ctx, self.folder, ["ggx/shade.glsl"], f"light_row = int(lamp); {body}", inputs,
            features, {"lights": texels}, prelude,
        )  # fmt: skip
        assert np.all(np.isfinite(out))
        assert np.all(out >= 0.0)
        return out

    def __call__(
        self, lamps: Sequence[AreaLight], points: Points, nodes: int = 2
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return (GPU specular, reference, GPU diffuse, reference)."""
        specular, diffuse = self.run(lamps, points, nodes)
        want_specular, want_diffuse = reference(lamps, points, nodes)
        return specular, want_specular, diffuse, want_diffuse


@pytest.fixture
def probe(ctx: moderngl.Context, tmp_path: Path) -> Probe:
    return Probe(ctx, tmp_path)


def random_points(
    rng: np.random.Generator,
    lamp: NDArray[np.int64],
    position: FloatArray,
    alpha: tuple[float, float] = (1e-3, 1.0),
    theta: tuple[float, float] = (0.0, 89.5),
    mirror: FloatArray | None = None,
    isotropic: bool = False,
) -> Points:
    """Return points with random frames; the lobe points at ``mirror``, give or take its width."""
    count = len(position)
    a = np.exp(rng.uniform(*np.log(alpha), (count, 2)))
    if isotropic:
        a[:, 1] = a[:, 0]
    t = np.radians(rng.uniform(*theta, count))
    if mirror is None:
        n = unit(rng.normal(size=(count, 3)))
        side = unit(np.cross(n, rng.normal(size=(count, 3))))
    else:
        d = unit(mirror - position)
        across = unit(np.cross(d, rng.normal(size=(count, 3))))
        n = np.cos(t)[:, None] * d + np.sin(t)[:, None] * across
        side = -unit(d - n * np.sum(d * n, axis=-1, keepdims=True) + 1e-9 * across)
        t = np.clip(t + a.max(axis=-1) * rng.normal(size=count), 0.0, math.radians(89.5))
    n = unit(n)
    side = unit(side - n * np.sum(n * side, axis=-1, keepdims=True))
    view = np.cos(t)[:, None] * n + np.sin(t)[:, None] * side
    tangent = unit(np.cross(n, rng.normal(size=(count, 3))))
    return Points(lamp, position, n, tangent, view, a)


def which(lamps: int, each: int) -> NDArray[np.int64]:
    return np.repeat(np.arange(lamps), each)


def errors(result: tuple[FloatArray, FloatArray, FloatArray, FloatArray]) -> FloatArray:
    """Return absolute errors of the specular part, after a check of the diffuse one."""
    specular, want_specular, diffuse, want_diffuse = result
    assert np.max(np.abs(diffuse - want_diffuse)) <= 1e-5
    return np.abs(specular - want_specular)


SPECULAR = 1e-4  # absolute, light radiance 1
EACH = 64


def some_lamps(rng: np.random.Generator, count: int = 60) -> list[AreaLight]:
    return [
        random_light(rng, size=float(10 ** rng.uniform(-1.0, 0.7)), two_sided=i % 3 > 0)
        for i in range(count)
    ]


def on_lamps(
    rng: np.random.Generator, lamps: Sequence[AreaLight], edge: float
) -> tuple[NDArray[np.int64], FloatArray]:
    points = [on_light(rng, lamp, EACH, edge) for lamp in lamps]
    return which(len(lamps), EACH), np.concatenate(points)


@pytest.mark.parametrize("nodes", [1, 2, 3, 4])
def test_random_configurations(probe, nodes):
    """Random frames, and lobes aimed at light and outline; half of them isotropic."""
    rng = np.random.default_rng(20161)
    lamps = some_lamps(rng)
    for isotropic in (False, True):
        for aimed in (False, True):
            lamp, aim = on_lamps(rng, lamps, edge=0.3)
            position = rng.uniform(-2.0, 2.0, aim.shape)
            points = random_points(
                rng, lamp, position, mirror=aim if aimed else None, isotropic=isotropic
            )
            error = errors(probe(lamps, points, nodes))
            # The few above 1e-4 have an alpha of .001 at a cosine below .01.
            assert error.max() <= 2.0 * SPECULAR
            assert np.quantile(error, 0.99) <= 3e-5


def test_fresnel_and_diffuse_of_a_material(probe):
    rng = np.random.default_rng(14)
    lamps = some_lamps(rng)
    lamp, aim = on_lamps(rng, lamps, edge=0.3)
    points = random_points(rng, lamp, rng.uniform(-2.0, 2.0, aim.shape), mirror=aim)
    body = """
        MaterialSample material = MaterialSample(vec3(0.5), vec3(0.04), alpha);
        result.x = shade_lights(1, position, normal, tangent, wo, material).x;
        material.f0 = vec3(0.0);
        result.y = shade_lights(1, position, normal, tangent, wo, material).x;
    """
    got = probe.evaluate(lamps, points, 2, body)
    specular, diffuse = reference(lamps, points, 2, f0=0.04)
    np.testing.assert_allclose(got[:, 0], specular + 0.5 * diffuse, rtol=0, atol=SPECULAR)
    np.testing.assert_allclose(got[:, 1], 0.5 * diffuse, rtol=0, atol=5e-6)  # f0 = 0: no lobe


@pytest.mark.parametrize("alpha, p99, largest", [(1e-2, 2e-5, 1e-4), (1e-3, 1e-4, 1e-3),
                                                 (1e-4, 1e-3, 1e-2)])  # fmt: skip
def test_sharp_lobes_at_the_outline(probe, alpha, p99, largest):
    """A rounding of a direction, 6e-8, is 6e-8 / alpha of the lobe's width; a handful meet."""
    rng = np.random.default_rng(1)
    lamps = some_lamps(rng)
    lamp, aim = on_lamps(rng, lamps, edge=1.0)
    position = rng.uniform(-2.0, 2.0, aim.shape)
    points = random_points(rng, lamp, position, alpha=(alpha, 1.001 * alpha), mirror=aim)
    error = errors(probe(lamps, points))
    assert np.quantile(error, 0.99) <= p99
    assert error.max() <= largest


@pytest.mark.parametrize("theta", [(0.0, 1e-3), (80.0, 88.0), (88.0, 89.5)])
def test_normal_and_grazing_views(probe, theta):
    rng = np.random.default_rng(2)
    lamps = some_lamps(rng)
    lamp, aim = on_lamps(rng, lamps, edge=0.3)
    position = rng.uniform(-2.0, 2.0, aim.shape)
    error = errors(probe(lamps, random_points(rng, lamp, position, theta=theta, mirror=aim)))
    assert np.quantile(error, 0.99) <= 5e-5
    # A light whose plane holds the point, or an edge whose plane holds the view, within a
    # milliradian, at an alpha as small.
    assert error.max() <= 1e-3


def test_view_along_the_normal_exactly(probe):
    rng = np.random.default_rng(3)
    lamps = some_lamps(rng, 20)
    lamp, aim = on_lamps(rng, lamps, edge=0.3)
    position = rng.uniform(-2.0, 2.0, aim.shape)
    points = random_points(rng, lamp, position, mirror=aim)
    points.view = points.normal
    assert errors(probe(lamps, points)).max() <= SPECULAR
    points.alpha[:] = 1.0  # b1 = b2 everywhere
    assert errors(probe(lamps, points)).max() <= 1e-5


def floor_points(rng: np.random.Generator, lamp: NDArray[np.int64]) -> Points:
    """Points of the floor y = 0, views anywhere above it."""
    count = len(lamp)
    position = rng.uniform(-3.0, 3.0, (count, 3)) * [1.0, 0.0, 1.0]
    points = random_points(rng, lamp, position)
    t, p = np.radians(rng.uniform(0, 89.5, count)), rng.uniform(0, 2 * np.pi, count)
    points.view = np.stack([np.sin(t) * np.cos(p), np.cos(t), np.sin(t) * np.sin(p)], axis=-1)
    points.normal[:] = [0.0, 1.0, 0.0]
    points.tangent = np.stack([np.cos(p), 0.0 * p, np.sin(p)], axis=-1)
    return points


def test_lights_touching_and_crossing_the_floor(probe):
    """Upright squares and stars that stand on the floor, cross it, and touch it from below."""
    rng = np.random.default_rng(4)
    heights = [1.0, 0.5, 0.0, -0.5, -0.999]
    lamps = [
        light(contour, plane=Plane((0.0, h, 0.0)), two_sided=True)
        for contour in (SQUARE, STAR)
        for h in heights
    ]
    points = floor_points(rng, which(len(lamps), 256))
    assert errors(probe(lamps, points)).max() <= SPECULAR


def test_exactly_zero_where_nothing_is_lit(probe):
    rng = np.random.default_rng(5)
    planes = [
        Plane((0.0, -1.01, 0.0)),
        Plane((0.0, -1.0, 0.0)),  # touches the floor from below
        Plane((0.0, -1e-3, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
        Plane((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),  # lies in the floor
    ]
    lamps = [light(SQUARE, plane=plane, two_sided=True) for plane in planes]
    specular, _, diffuse, _ = probe(lamps, floor_points(rng, which(4, 256)))
    assert not specular.any()
    assert not diffuse.any()

    lamps = [random_light(rng, two_sided=False) for _ in range(20)]
    lamp, aim = on_lamps(rng, lamps, edge=0.0)
    away = np.array([emitting_normal(item) for item in lamps])[lamp]
    behind = aim - rng.uniform(1e-3, 2.0, (len(aim), 1)) * away
    specular, _, diffuse, _ = probe(lamps, random_points(rng, lamp, behind, mirror=aim))
    assert not specular.any()
    assert not diffuse.any()

    lamps = some_lamps(rng, 20)
    lamp, aim = on_lamps(rng, lamps, edge=0.0)
    points = random_points(rng, lamp, rng.uniform(-2.0, 2.0, aim.shape), mirror=aim)
    points.view -= 1.01 * points.normal * np.sum(points.normal * points.view, axis=1)[:, None]
    points.view = unit(points.view - 0.01 * points.normal)  # the viewer is below
    specular, _, _, _ = probe(lamps, points)
    assert not specular.any()


@pytest.mark.parametrize("distance", [1e-3, 1e-4])
def test_close_to_an_edge(probe, distance):
    rng = np.random.default_rng(7)
    lamps = some_lamps(rng)
    lamp, near = on_lamps(rng, lamps, edge=1.0)
    position = near + distance * unit(rng.normal(size=near.shape))
    error = errors(probe(lamps, random_points(rng, lamp, position, alpha=(0.05, 1.0))))
    # The outline is known to 1e-7 m of rounding: 1e-7 / distance rad, magnified by 1 / alpha.
    assert np.quantile(error, 0.99) <= 2e-6 * (1e-3 / distance)
    assert error.max() <= 2e-5 * (1e-3 / distance)


def test_in_the_plane_of_the_light(probe):
    """Outside the outline nothing is seen; a rounding to either side changes nothing."""
    rng = np.random.default_rng(8)
    lamp = light(SQUARE, plane=Plane((0.0, 0.5, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)))
    st = unit(rng.normal(size=(256, 2))) * rng.uniform(1.5, 5.0, (256, 1))
    points = random_points(rng, which(1, 256), lamp_points(lamp, st))
    assert errors(probe([lamp], points)).max() <= SPECULAR


@pytest.mark.parametrize("ratio", [1e-4, 1e-3, 1e-2, 0.1, 1.0, 10.0, 100.0, 1e3, 1e4])
def test_size_against_distance(probe, ratio):
    rng = np.random.default_rng(9)
    lamps = []
    for _ in range(40):
        u, v, _ = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        plane = Plane(tuple(rng.uniform(-1.0, 1.0, 3)), tuple(u), tuple(v))
        lamps.append(light(np.array(STAR) * ratio, plane=plane, two_sided=True))
    lamp = which(40, EACH)
    origin = np.array([item.plane.origin for item in lamps])[lamp]
    position = origin + unit(rng.normal(size=origin.shape))
    points = random_points(rng, lamp, position, mirror=origin)
    got, want, diffuse, want_diffuse = probe(lamps, points)
    error = errors((got, want, diffuse, want_diffuse))
    assert np.quantile(error, 0.99) <= 2e-5
    assert error.max() <= 2.0 * SPECULAR
    if ratio <= 1e-3:
        facing = np.abs(
            np.sum(
                unit(position - origin) * np.array([emitting_normal(x) for x in lamps])[lamp],
                axis=-1,
            )
        )
        keep = (facing > 0.02) & (points.alpha.min(axis=1) > 0.05) & (want > 0.0)
        error = (np.abs(got - want)[keep]) / want[keep]
        assert np.quantile(error, 0.9) <= 1e-5


@pytest.mark.parametrize("name", CASES)
def test_awkward_outlines(probe, name):
    rng = np.random.default_rng(10)
    lamp = CASES[name]
    aim = on_light(rng, lamp, 256, edge=0.5)
    position = rng.uniform(-2.0, 2.0, aim.shape)
    points = random_points(rng, which(1, 256), position, mirror=aim)
    assert errors(probe([lamp], points)).max() <= SPECULAR


def test_tangents_that_are_no_tangents(probe):
    """Zero, along the normal, or not unit: some frame, never a NaN."""
    rng = np.random.default_rng(11)
    lamps = some_lamps(rng, 8)
    lamp, aim = on_lamps(rng, lamps, edge=0.3)
    points = random_points(rng, lamp, rng.uniform(-2.0, 2.0, aim.shape), mirror=aim)
    points.tangent *= 3.0
    assert errors(probe(lamps, points)).max() <= SPECULAR


def test_hostile_points_stay_finite_and_bounded(probe):
    """On outlines and corners, in the light's plane, along axes, views that graze exactly."""
    rng = np.random.default_rng(13)
    lamps = [*some_lamps(rng, 20), CASES["sliver"], CASES["needle"], CASES["bow tie"]]
    lamp, on = on_lamps(rng, lamps, edge=0.5)
    corners = np.array(
        [
            lamp_points(lamps[i], np.array(lamps[i].outline.contours[0].points)[:3])[k % 3]
            for k, i in enumerate(lamp)
        ]
    )
    count = len(lamp)
    for nodes in (1, 2, 3, 4):
        place = rng.integers(0, 5, (count, 1))
        nearby = corners + 1e-7 * rng.normal(size=on.shape)
        places = [on, corners, nearby, 2.0 * on - corners]
        position = np.select([place == k for k in range(4)], places, rng.normal(size=on.shape))
        points = random_points(rng, lamp, position, alpha=(1e-4, 1.0), mirror=on + 1e-3)
        kind = rng.integers(0, 4, (count, 1))
        flat = np.array([emitting_normal(item) for item in lamps])[lamp]
        axis = np.eye(3)[rng.integers(0, 3, count)] * rng.choice([-1.0, 1.0], (count, 1))
        points.normal = np.select([kind == 0, kind == 1], [flat, axis], points.normal)
        grazing = unit(points.tangent + 1e-4 * points.normal)
        points.view = np.select([kind == 2, kind == 3], [points.normal, grazing], points.view)
        points.tangent[::3] = points.normal[::3]
        specular, diffuse = probe.run(lamps, points, nodes)  # asserts finite and >= 0
        assert specular.max() <= 1.0
        assert diffuse.max() <= 1.0


@pytest.mark.parametrize("alpha", [0.02, 0.1, 0.5, 1.0])
def test_a_receding_light_shows_no_seam(probe, alpha):
    """From 3 to 3,000 times its size: relative precision through the change to the pinned sum."""
    distance = np.exp(np.linspace(np.log(3.0), np.log(3000.0), 2048))
    toward = unit(np.array([0.5, 0.2, 1.0]))
    normal = unit(np.array([0.6, 0.1, 0.3]) - toward)
    view = -2.0 * normal * (normal @ toward) + toward
    each = (len(distance), 1)
    points = Points(
        which(1, len(distance)),
        distance[:, None] * toward,
        np.tile(normal, each),
        np.tile(unit(np.cross(normal, [1.0, 0.0, 0.0])), each),
        np.tile(view, each),
        np.full((len(distance), 2), alpha),
    )
    got, want, _, _ = probe([light(STAR, plane=Plane(), two_sided=True)], points)
    assert np.max(np.abs(got / want - 1.0)) <= 5e-4
    assert np.max(np.abs(got - want)) <= 2e-6


@pytest.fixture
def glsl(ctx: moderngl.Context, tmp_path):
    def run(body, inputs):
        prelude = "vec4 light_texel(int index) { return vec4(0.0); }"
        includes = ["ggx/shade.glsl"]
        return evaluate(ctx, tmp_path, includes, body, inputs, FEATURES, prelude=prelude)

    return run


@pytest.fixture
def glsl_bound(ctx, tmp_path):
    def run(body, inputs):
        prelude = "vec4 light_texel(int index) { return vec4(0.0); }"
        return evaluate(ctx, tmp_path, ["ggx/bound.glsl"], body, inputs, FEATURES, prelude=prelude)

    return run


def test_tangent_frame(glsl):
    rng = np.random.default_rng(12)
    normal = unit(rng.normal(size=(512, 3)))
    tangent = rng.normal(size=(512, 3))
    tangent[:128] = 0.0
    tangent[128:256] = normal[128:256]
    inputs = {"normal": normal, "tangent": tangent}
    x = glsl("result.xyz = tangent_frame(normal, tangent)[0];", inputs)[:, :3]
    y = glsl("result.xyz = tangent_frame(normal, tangent)[1];", inputs)[:, :3]
    np.testing.assert_allclose(np.linalg.norm(x, axis=1), 1.0, atol=3e-7)
    np.testing.assert_allclose(np.sum(x * normal, axis=1), 0.0, atol=1e-6)
    np.testing.assert_allclose(y, np.cross(normal, x), atol=5e-7)
    flat = tangent - normal * np.sum(normal * tangent, axis=1, keepdims=True)
    np.testing.assert_allclose(x[256:], unit(flat[256:]), atol=2e-5)


def edges(rng: np.random.Generator, count: int) -> dict[str, FloatArray]:
    """Random edges in the tangent frame; the inputs that half_vector_edge takes."""
    t, p = np.radians(rng.uniform(0, 89.5, count)), rng.uniform(0, 2 * np.pi, count)
    wo = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], axis=-1)
    alpha = np.exp(rng.uniform(np.log(1e-4), 0.0, (count, 2)))
    alpha[::3, 1] = alpha[::3, 0]
    alpha[::7] = 1.0
    wo[::11] = [0.0, 0.0, 1.0]
    a, b = unit(rng.normal(size=(2, count, 3)))
    a[:, 2], b[:, 2] = np.abs(a[:, 2]), np.abs(b[:, 2])
    # Planes with the view, k = 0 up to rounding; and short edges.
    b[::5] = unit(wo[::5] + rng.uniform(0.1, 2.0, (len(b[::5]), 1)) * a[::5])
    b[::13] = unit(a[::13] + 1e-4 * b[::13])
    wo, alpha, a, b = (x.astype(np.float32).astype(np.float64) for x in (wo, alpha, a, b))
    wo, a, b = unit(wo), unit(a), unit(b)
    inverse = np.concatenate([1.0 / alpha, np.ones((count, 1))], axis=1)
    n = unit(np.cross(a, b - a))
    return {"wo": wo, "alpha": alpha, "h": (wo + a) * inverse, "dh": (b - a) * inverse, "n": n,
            "a": a, "b": b}  # fmt: skip


def test_half_vector_edge(glsl):
    inputs = edges(np.random.default_rng(13), 8192)
    body = "result.xyz = half_vector_edge(h, dh, n, ggx_view(wo, alpha)).integral;"
    got = glsl(body, inputs)[:, :3]
    ax, ay = inputs["alpha"].T
    want = ggx.edge_integral(inputs["a"], inputs["b"], inputs["wo"], ax, ay)
    error = np.max(np.abs(got - want), axis=1)
    assert np.median(error) <= 3e-7
    assert np.quantile(error, 0.99) <= 2e-5
    assert error.max() <= 1e-3


def test_half_vector_cone(glsl):
    """The axes are orthonormal and the end points lie on the cone."""
    inputs = edges(np.random.default_rng(14), 4096)
    cone = "HalfVectorCone cone = half_vector_cone(n, ggx_view(wo, alpha)); "
    w1, w2, w3, b = (
        glsl(f"{cone} result.xyz = cone.{member};", inputs)[:, :3]
        for member in ("w1", "w2", "w3", "b")
    )
    frame = np.stack([w1, w2, w3], axis=1)
    eye = np.broadcast_to(np.eye(3), frame.shape)
    np.testing.assert_allclose(frame @ np.swapaxes(frame, 1, 2), eye, atol=1e-5)
    assert np.all(b[:, 0] >= b[:, 1])
    assert np.all(b[:, 1] >= 0.0)
    assert np.all(b[:, 2] >= 0.0)
    product = np.prod(inputs["alpha"] ** 2, axis=1) * np.abs(
        np.sum(inputs["n"] * inputs["wo"], axis=1)
    )
    # The graded eigenvalues hold their product to a few roundings of k, 6e-8.
    np.testing.assert_allclose(np.prod(b, axis=1), product, rtol=1e-4, atol=3e-7)
    h = unit(inputs["h"])
    local = np.einsum("nij,nj->ni", frame, h)
    residual = np.sum(b * [1.0, 1.0, -1.0] * local**2, axis=1)
    assert np.max(np.abs(residual)) <= 3e-6


def test_bound(glsl_bound):
    """Never below the definition, which is certified; above by what it allows for rounding."""
    rng = np.random.default_rng(15)
    count = 4096
    middle = unit(rng.normal(size=(count, 3))) * np.exp(rng.uniform(-1.5, 3.0, count))[:, None]
    u = unit(rng.normal(size=(count, 3)))
    v = unit(np.cross(u, rng.normal(size=(count, 3))))
    half = np.exp(rng.uniform(np.log(0.01), np.log(3.0), (count, 2, 1)))
    theta = np.radians(rng.uniform(0.0, 89.0, count))
    wo = np.stack([np.sin(theta), 0.0 * theta, np.cos(theta)], axis=-1)
    inputs = {
        "middle": middle, "u": half[:, 0] * u, "v": half[:, 1] * v, "wo": wo,
        "alpha": np.exp(rng.uniform(np.log(1e-3), 0.0, (count, 2))),
    }  # fmt: skip
    inputs = {name: x.astype(np.float32).astype(np.float64) for name, x in inputs.items()}
    got = glsl_bound("result.xy = ggx_bound(middle, u, v, ggx_view(wo, alpha));", inputs)
    middle, u, v, alpha = (inputs[name] for name in ("middle", "u", "v", "alpha"))
    corners = np.stack([middle - u - v, middle + u - v, middle + u + v, middle - u + v], axis=1)
    want = half_vector_bound(corners, unit(inputs["wo"]), alpha[:, 0], alpha[:, 1])
    # Half vectors are sums that cancel near the mirror direction, where they decide nothing.
    assert np.all(got[:, 0] >= want.one * (1.0 - 1e-3) - 1e-9)
    assert np.isclose(got[:, 0], want.one, rtol=1e-2, atol=1e-7).mean() > 0.98
    np.testing.assert_allclose(got[:, 1], want.fresnel, atol=1e-5)  # a root of nearly 0


def test_small_functions(glsl):
    x = np.linspace(-0.9999, 0.9999, 4096)
    got = glsl("result = vec4(area_tangent(x, 1.0), double_cosine_of_third(abs(x)), 0, 0);",
               {"x": x})  # fmt: skip
    x = x.astype(np.float32).astype(np.float64)
    np.testing.assert_allclose(got[:, 0], np.arctanh(x), rtol=2e-6, atol=1e-12)
    want = 2.0 * np.cos(np.arccos(np.abs(x)) / 3.0)
    np.testing.assert_allclose(got[:, 1], want, atol=7e-4)
    body = "GgxView view = ggx_view(wo, alpha); result = vec4(view.bent, view.bent_length);"
    got = glsl(body, {"wo": np.array([[0.6, 0.0, 0.8]]), "alpha": np.array([[0.5, 0.1]])})
    np.testing.assert_allclose(got[0], [0.3, 0.0, 0.8, np.hypot(0.3, 0.8)], rtol=1e-6)
