"""The lighting pass in float32 against the float64 definition of its technique.

`Renderer.probe` runs the very functions of the lighting pass at given points. Its
twin here is `ltc.polygon.ltc_specular` with the table looked up as the GPU does,
over the scene's own outline and plane in float64. Light radiance is 1.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray

from app.outline import resolve
from app.render.renderer import Renderer
from app.render.tables import isotropic_textures
from app.scene import AreaLight, Outline, Plane, PolygonContour, RenderSettings, Scene
from ltc.polygon import loops_form_factor, ltc_specular, positive_winding
from ltc.table import sample_textures

FloatArray = NDArray[np.float64]

SPECULAR = 1e-4  # absolute, light radiance 1
DIFFUSE = 1e-5


@dataclass
class Points:
    """Float32 inputs of the probe, n of them."""

    position: FloatArray
    normal: FloatArray
    view: FloatArray
    alpha: FloatArray

    @property
    def tangent(self) -> FloatArray:
        axis = np.where(np.abs(self.normal[:, :1]) < 0.5, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
        return unit(np.cross(self.normal, axis))

    def rounded(self) -> Points:
        """As the GPU gets them, in float64 again, directions unit again."""
        fields = (self.position, self.normal, self.view, self.alpha)
        p, n, v, a = (f.astype(np.float32).astype(np.float64) for f in fields)
        return Points(p, unit(n), unit(v), a)


def unit(v: FloatArray) -> FloatArray:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def light(
    *contours: list[tuple[float, float]] | FloatArray,
    plane: Plane = Plane(),
    two_sided: bool = False,
    fill_rule: str = "evenodd",
) -> AreaLight:
    loops = tuple(PolygonContour(tuple((float(s), float(t)) for s, t in c)) for c in contours)
    return AreaLight("l", Outline(loops, fill_rule), plane, (1.0, 1.0, 1.0), two_sided)


def reference(lamp: AreaLight, points: Points) -> tuple[FloatArray, FloatArray]:
    """Return (specular, diffuse), each (n,), in float64."""
    at = points.rounded()
    n, wo = at.normal, at.view
    c = np.clip(np.sum(n * wo, axis=-1), 0.0, 1.0)
    x = wo - n * np.sum(n * wo, axis=-1, keepdims=True)
    degenerate = np.linalg.norm(x, axis=-1) < 1e-7
    x = unit(np.where(degenerate[:, None], at.tangent, x))
    frame = np.stack([x, np.cross(n, x), n], axis=-2)

    origin, u, v = (np.array(a) for a in (lamp.plane.origin, lamp.plane.u, lamp.plane.v))
    loops = []
    for loop in resolve(lamp.outline):
        world = positive_winding(origin + loop[:, :1] * u + loop[:, 1:] * v)
        loops.append((world - at.position[:, None, :]) @ np.swapaxes(frame, -1, -2))
    M, A, _ = sample_textures(isotropic_textures(), at.alpha[:, 0], c)
    specular, diffuse = ltc_specular(M, loops, A), loops_form_factor(loops)
    front = np.sum(np.cross(u, v) * (at.position - origin), axis=-1) > 0.0
    sign = np.where(front, 1.0, -1.0)
    lit = front | lamp.two_sided
    zero = np.zeros(len(c))
    return (
        np.where(lit, np.maximum(0.0, sign * specular), zero) + zero,
        np.where(lit, np.maximum(0.0, sign * diffuse), zero) + zero,
    )


def measure(
    renderer: Renderer, lamp: AreaLight, points: Points
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return (GPU specular, reference, GPU diffuse, reference); nothing may be non-finite."""
    out = renderer.probe(
        Scene(lights=(lamp,)),
        RenderSettings(),
        points.position,
        points.normal,
        points.tangent,
        points.view,
        points.alpha,
    )
    for name in ("specular", "diffuse"):
        assert np.all(np.isfinite(out[name])), name
        assert np.all(out[name] >= 0.0), name
    specular, diffuse = reference(lamp, points)
    return (
        out["specular"][:, 0].astype(np.float64),
        specular,
        out["diffuse"][:, 0].astype(np.float64),
        diffuse,
    )


def random_points(
    rng: np.random.Generator,
    count: int,
    position: FloatArray,
    alpha: tuple[float, float] = (1e-3, 1.0),
    theta: tuple[float, float] = (0.0, 89.5),
    mirror: FloatArray | None = None,
) -> Points:
    """Return points at ``position``, with random frames.

    ``mirror`` (n, 3) are points of the light: the view is then chosen so that
    the lobe points there, give or take its width, which is where errors show.
    """
    a = np.exp(rng.uniform(*np.log(alpha), count))
    t = np.radians(rng.uniform(*theta, count))
    if mirror is None:
        n = unit(rng.normal(size=(count, 3)))
        side = unit(np.cross(n, rng.normal(size=(count, 3))))
    else:
        d = unit(mirror - position)
        side = unit(np.cross(d, rng.normal(size=(count, 3))))
        # The normal at angle t from d; the view is d mirrored, jittered by the lobe's width.
        n = unit(np.cos(t)[:, None] * d + np.sin(t)[:, None] * side)
        side = -unit(
            d - n * np.sum(d * n, axis=-1, keepdims=True) + 1e-9 * rng.normal(size=d.shape)
        )
        t = np.clip(t + a * rng.normal(size=count), 0.0, math.radians(89.5))
    side = unit(side - n * np.sum(n * side, axis=-1, keepdims=True))
    view = np.cos(t)[:, None] * n + np.sin(t)[:, None] * side
    return Points(position, n, view, np.stack([a, a], axis=-1))


def random_light(rng: np.random.Generator, size: float = 1.0, two_sided: bool = False) -> AreaLight:
    """Return a star-shaped polygon of 3 to 8 corners, convex or not, in a skew plane."""
    corners = int(rng.integers(3, 9))
    angle = np.sort(rng.uniform(0.0, 2.0 * np.pi, corners))
    radius = rng.uniform(0.3, 1.0, corners) * size
    contour = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)
    if rng.uniform() < 0.5:
        contour = contour[::-1]
    u = rng.normal(size=3)
    v = np.cross(u, rng.normal(size=3)) + 0.3 * rng.normal() * u
    scale = rng.uniform(0.3, 1.0)
    plane = Plane(
        tuple(rng.uniform(-1.0, 1.0, 3)),
        tuple(u / np.linalg.norm(u)),
        tuple(scale * v / np.linalg.norm(v)),
    )
    return light(contour, plane=plane, two_sided=two_sided)


def on_light(rng: np.random.Generator, lamp: AreaLight, count: int, edge: float) -> FloatArray:
    """Return world points of the light; a share ``edge`` of them on its outline."""
    loop = np.array(lamp.outline.contours[0].points)
    i = rng.integers(0, len(loop), count)
    f = rng.uniform(0.0, 1.0, (count, 1))
    st = loop[i] * (1.0 - f) + loop[(i + 1) % len(loop)] * f
    inside = st * rng.uniform(0.0, 1.0, (count, 1))
    st = np.where(rng.uniform(size=(count, 1)) < edge, st, inside)
    return lamp_points(lamp, st)


def lamp_points(lamp: AreaLight, st: FloatArray) -> FloatArray:
    origin, u, v = (np.array(a) for a in (lamp.plane.origin, lamp.plane.u, lamp.plane.v))
    return origin + st[:, :1] * u + st[:, 1:] * v


def emitting_normal(lamp: AreaLight) -> FloatArray:
    return unit(np.cross(lamp.plane.u, lamp.plane.v))


def check(renderer: Renderer, lamp: AreaLight, points: Points, specular: float = SPECULAR) -> None:
    gpu_specular, ref_specular, gpu_diffuse, ref_diffuse = measure(renderer, lamp, points)
    error = np.abs(gpu_specular - ref_specular)
    worst = int(np.argmax(error))
    assert error[worst] <= specular, (
        f"specular {gpu_specular[worst]:.6f}, expected {ref_specular[worst]:.6f}, "
        f"alpha {points.alpha[worst, 0]:.4g}, point {points.position[worst]}"
    )
    error = np.abs(gpu_diffuse - ref_diffuse)
    worst = int(np.argmax(error))
    assert error[worst] <= DIFFUSE, (gpu_diffuse[worst], ref_diffuse[worst])


def test_random_configurations(renderer):
    """6,400 points: random frames, and lobes aimed at light and outline."""
    rng = np.random.default_rng(20161)
    for index in range(100):
        lamp = random_light(rng, size=float(10 ** rng.uniform(-1, 0.7)), two_sided=index % 3 == 0)
        position = rng.uniform(-2.0, 2.0, (64, 3))
        mirror = on_light(rng, lamp, 64, edge=0.3) if index % 2 else None
        check(renderer, lamp, random_points(rng, 64, position, mirror=mirror))


def test_sharpest_lobes_at_the_outline(renderer):
    """Alpha at its least, every lobe centred within its width of an edge."""
    rng = np.random.default_rng(1)
    errors = []
    for _ in range(40):
        lamp = random_light(rng, two_sided=True)
        position = rng.uniform(-2.0, 2.0, (64, 3))
        aim = on_light(rng, lamp, 64, edge=1.0)
        points = random_points(rng, 64, position, alpha=(1e-3, 1.001e-3), mirror=aim)
        gpu, ref, _, _ = measure(renderer, lamp, points)
        errors.append(np.abs(gpu - ref))
    error = np.concatenate(errors)
    # Across an edge a lobe of width alpha turns one rounding of a direction (6e-8) into
    # 3e-5 of the result, at grazing views, where it is alpha cos theta narrow, into more.
    assert np.percentile(error, 99) <= SPECULAR
    assert error.max() <= 3e-4


@pytest.mark.parametrize("theta", [(0.0, 1e-3), (80.0, 88.0), (88.0, 89.5)])
def test_normal_and_grazing_views(renderer, theta):
    rng = np.random.default_rng(2)
    for _ in range(10):
        lamp = random_light(rng, two_sided=True)
        position = rng.uniform(-2.0, 2.0, (64, 3))
        check(renderer, lamp, random_points(rng, 64, position, theta=theta))


def test_view_along_the_normal_exactly(renderer):
    rng = np.random.default_rng(3)
    lamp = random_light(rng, two_sided=True)
    points = random_points(rng, 64, rng.uniform(-2.0, 2.0, (64, 3)))
    points.view = points.normal
    check(renderer, lamp, points)


def floor_points(rng: np.random.Generator, position: FloatArray) -> Points:
    """Points with normal +y, whose views are random above it."""
    count = len(position)
    t, p = np.radians(rng.uniform(0, 89.5, count)), rng.uniform(0, 2 * np.pi, count)
    view = np.stack([np.sin(t) * np.cos(p), np.cos(t), np.sin(t) * np.sin(p)], axis=-1)
    a = np.exp(rng.uniform(np.log(1e-3), 0.0, count))
    normal = np.broadcast_to([0.0, 1.0, 0.0], (count, 3)).copy()
    return Points(position, normal, view, np.stack([a, a], axis=-1))


SQUARE = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
STAR = [
    (math.cos(math.pi * i / 5) * (1.0 if i % 2 else 0.4),
     math.sin(math.pi * i / 5) * (1.0 if i % 2 else 0.4))
    for i in range(10)
]  # fmt: skip


@pytest.mark.parametrize("height", [1.0, 0.5, 0.0, -0.5, -0.999], ids=lambda h: f"centre{h:+g}")
@pytest.mark.parametrize("contour", [SQUARE, STAR], ids=["square", "star"])
def test_light_touching_and_crossing_the_floor(renderer, contour, height):
    """At +1 the square stands on the floor, at 0 it is half sunk."""
    rng = np.random.default_rng(4)
    lamp = light(contour, plane=Plane((0.0, height, 0.0)), two_sided=True)
    position = rng.uniform(-3.0, 3.0, (256, 3)) * [1.0, 0.0, 1.0]
    check(renderer, lamp, floor_points(rng, position))


@pytest.mark.parametrize(
    "plane",
    [
        Plane((0.0, -1.01, 0.0)),
        Plane((0.0, -1.0, 0.0)),  # touches the floor from below
        Plane((0.0, -1e-3, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
        Plane((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),  # lies in the floor
    ],
)
def test_exactly_zero_below_the_surface(renderer, plane):
    rng = np.random.default_rng(5)
    lamp = light(SQUARE, plane=plane, two_sided=True)
    points = floor_points(rng, rng.uniform(-3.0, 3.0, (256, 3)) * [1.0, 0.0, 1.0])
    gpu_specular, _, gpu_diffuse, _ = measure(renderer, lamp, points)
    assert not gpu_specular.any()
    assert not gpu_diffuse.any()


def test_exactly_zero_behind_a_one_sided_light(renderer):
    rng = np.random.default_rng(6)
    lamp = random_light(rng)
    away = rng.uniform(0.0, 2.0, (256, 1)) * emitting_normal(lamp)
    aim = on_light(rng, lamp, 256, edge=0.0)
    points = random_points(rng, 256, aim - away - 1e-3 * emitting_normal(lamp), mirror=aim)
    gpu_specular, _, gpu_diffuse, _ = measure(renderer, lamp, points)
    assert not gpu_specular.any()
    assert not gpu_diffuse.any()


@pytest.mark.parametrize("distance", [1e-3, 1e-4, 1e-5])
def test_close_to_an_edge(renderer, distance):
    """Within a millimetre of the outline, in every direction around it, alpha from .001."""
    rng = np.random.default_rng(7)
    for _ in range(10):
        lamp = random_light(rng, two_sided=True)
        near = on_light(rng, lamp, 64, edge=1.0)
        position = near + distance * unit(rng.normal(size=(64, 3)))
        check(renderer, lamp, random_points(rng, 64, position))


def test_in_the_plane_of_the_light(renderer):
    """Outside the outline nothing is seen; a rounding to either side changes nothing."""
    rng = np.random.default_rng(8)
    lamp = light(SQUARE, plane=Plane((0.0, 0.5, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)))
    st = unit(rng.normal(size=(256, 2))) * rng.uniform(1.5, 5.0, (256, 1))
    points = random_points(rng, 256, lamp_points(lamp, st))
    check(renderer, lamp, points)


@pytest.mark.parametrize("ratio", [1e-4, 1e-3, 1e-2, 0.1, 1.0, 10.0, 100.0, 1e3, 1e4])
def test_size_against_distance(renderer, ratio):
    """Lights of 1e-4 to 1e4 times the distance; small ones to relative precision."""
    rng = np.random.default_rng(9)
    for _ in range(10):
        lamp = light(
            np.array(STAR) * ratio,
            plane=Plane(
                tuple(rng.uniform(-1.0, 1.0, 3)),
                *(tuple(a) for a in np.linalg.qr(rng.normal(size=(3, 3)))[0][:2]),
            ),
            two_sided=True,
        )
        origin = np.array(lamp.plane.origin)
        position = origin + unit(rng.normal(size=(64, 3)))
        points = random_points(rng, 64, position, mirror=np.broadcast_to(origin, position.shape))
        check(renderer, lamp, points)
        if ratio <= 1e-2:
            gpu_specular, ref_specular, gpu_diffuse, ref_diffuse = measure(renderer, lamp, points)
            # Seen edge-on, or cut by the horizon to a sliver, the projected area itself is
            # a difference: those are the few that lose two digits.
            n = emitting_normal(lamp)
            facing = np.abs(np.sum(unit(position - origin) * n, axis=-1)) > 0.02
            for gpu, ref, keep in (
                (gpu_diffuse, ref_diffuse, facing),
                (gpu_specular, ref_specular, facing & (points.alpha[:, 0] > 0.02)),
            ):
                error = np.abs(gpu - ref)[keep] / np.maximum(ref[keep], 1e-20)
                assert np.percentile(error, 90) <= 1e-5
                assert error.max() <= 5e-4


CASES = {
    "needle": light([(-1.0, 0.0), (1.0, 0.0), (1.0, 1e-5), (-1.0, 1e-5)]),
    "sliver": light([(-1.0, -1.0), (1.0, 1.0), (1.0, 1.0 + 1e-6)]),
    "bow tie": light([(-1.0, -1.0), (1.0, 1.0), (1.0, -1.0), (-1.0, 1.0)]),
    "touching squares": light([(-1, -1), (0, -1), (0, 0), (1, 0), (1, 1), (0, 1), (0, 0), (-1, 0)]),
    "repeated corners": light([(-1, -1), (-1, -1), (1, -1), (1, 1), (1, 1), (1, 1), (-1, 1)]),
    "collinear corners": light([(-1, -1), (0, -1), (0.5, -1), (1, -1), (1, 1), (0, 1), (-1, 1)]),
    "no area": light([(-1, -1), (0, 0), (1, 1)]),
    "clockwise": light(SQUARE[::-1]),
    "two sided": light(SQUARE, two_sided=True),
    "hole": light(SQUARE, np.array(SQUARE) * 0.5),
    "hole, same winding": light(SQUARE, np.array(SQUARE[::-1]) * 0.5),
    "island in a hole": light(SQUARE, np.array(SQUARE) * 0.6, np.array(SQUARE) * 0.3),
    "pentagram": light([STAR[(4 * i + 1) % 10] for i in range(5)]),
    "pentagram, nonzero": light([STAR[(4 * i + 1) % 10] for i in range(5)], fill_rule="nonzero"),
    "1000 corners": light(
        [(math.cos(math.pi * i / 500), math.sin(math.pi * i / 500)) for i in range(1000)]
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_outlines(renderer, name):
    rng = np.random.default_rng(10)
    lamp = CASES[name]
    position = rng.uniform([-2.0, -1.0, -1.0], [2.0, 3.0, 3.0], (256, 3))
    mirror = on_light(rng, lamp, 256, edge=0.3)
    check(renderer, lamp, random_points(rng, 256, position, mirror=mirror))
    floor = rng.uniform([-2.0, 0.8, -2.0], [2.0, 0.8, 2.0], (256, 3))
    check(renderer, lamp, floor_points(rng, floor))


def test_winding_does_not_matter(renderer):
    rng = np.random.default_rng(11)
    points = random_points(rng, 256, rng.uniform([-2.0, -1.0, -1.0], [2.0, 3.0, 3.0], (256, 3)))
    a = measure(renderer, CASES["clockwise"], points)
    b = measure(renderer, light(SQUARE), points)
    np.testing.assert_array_equal(a[0], b[0])
    np.testing.assert_array_equal(a[2], b[2])


def test_a_light_that_fills_the_sky_returns_the_albedo(renderer):
    """No energy is lost to the lobe's part below the surface."""
    rng = np.random.default_rng(12)
    lamp = light(
        np.array(SQUARE) * 1e4,
        plane=Plane((0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
        two_sided=True,
    )
    points = floor_points(rng, np.zeros((256, 3)))
    gpu_specular, _, gpu_diffuse, _ = measure(renderer, lamp, points)
    _, A, _ = sample_textures(isotropic_textures(), points.alpha[:, 0], points.view[:, 1])
    # The strip of sky below the light's rim is 1e-4 rad high.
    assert np.abs(gpu_diffuse - 1.0).max() <= 1e-4
    rough = points.alpha[:, 0] > 0.05
    assert np.abs(gpu_specular - A)[rough].max() <= 2e-3


def test_many_lights_add_up(renderer):
    rng = np.random.default_rng(13)
    lamps = [random_light(rng, two_sided=True) for _ in range(20)]
    points = random_points(rng, 128, rng.uniform(-2.0, 2.0, (128, 3)))
    scene = Scene(
        lights=tuple(
            AreaLight(str(i), lamp.outline, lamp.plane, (1.0, 2.0, 3.0), True)
            for i, lamp in enumerate(lamps)
        )
    )
    inputs = (points.position, points.normal, points.tangent, points.view, points.alpha)
    out = renderer.probe(scene, RenderSettings(), *inputs)
    specular = sum(reference(lamp, points)[0] for lamp in lamps)
    diffuse = sum(reference(lamp, points)[1] for lamp in lamps)
    colour = np.array([1.0, 2.0, 3.0])
    assert np.abs(out["specular"] - specular[:, None] * colour).max() <= 20 * SPECULAR
    assert np.abs(out["diffuse"] - diffuse[:, None] * colour).max() <= 20 * DIFFUSE
