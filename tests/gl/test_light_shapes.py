"""Visible lights with curves: every pixel against the outline in float64, at any zoom."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import moderngl
import numpy as np
import pytest
from numpy.typing import NDArray

from app.curves import evaluate as evaluate_curves
from app.curves import extrema, flatten, line_as_cubic, part
from app.errors import InputError
from app.outline import boundary, contains
from app.planes import normal_of
from app.presets import disk, ellipse, heart, ring
from app.render.camera import CameraFrame
from app.render.features import Limits
from app.render.light_shapes import TEXELS_PER_PIECE, outline_bands, pack_light_curves
from app.render.needs import needs_of
from app.render.renderer import Renderer
from app.scene import (
    AreaLight,
    BezierContour,
    Camera,
    FillRule,
    Outline,
    Plane,
    PolygonContour,
    RenderSettings,
    Scene,
    SceneObject,
    Shot,
    TextSource,
    Transform,
)
from app.text import text_outline
from tests.gl.evaluate import evaluate
from tests.gl.scenes import FRAME, GLOSSY, KEY, SQUARE, floor, many_lights, one_light

FloatArray = NDArray[np.float64]

SIZE = (160, 90)


def curves(*points: tuple[float, float], fill_rule: FillRule = "evenodd") -> Outline:
    """Return a closed contour; every third point is an anchor, the others are handles."""
    closed = (*points, points[0])
    chain = tuple(closed[i : i + 4] for i in range(0, len(points), 3))
    return Outline((BezierContour(chain),), fill_rule)  # type: ignore[arg-type]


def flower(petals: int) -> Outline:
    """Return a star whose rays are curves, two for each, with sharp tips."""
    points: list[tuple[float, float]] = []
    for i in range(petals):
        for j, radius in enumerate((0.4, 0.4, 0.9, 1.0, 0.9, 0.5)):
            angle = 2.0 * math.pi * (i + j / 6.0 + 0.03 * (j % 3)) / petals
            points.append((radius * math.cos(angle), radius * math.sin(angle)))
    return curves(*points)


def overlapping(fill_rule: FillRule) -> Outline:
    """Return two disks and a square that overlap."""
    small = tuple((0.6 * x + 0.5, 0.6 * y) for x, y in SQUARE.contours[0].points)
    moved = tuple(
        tuple((s + 0.7, t + 0.2) for s, t in curve) for curve in disk(1.0).contours[0].curves
    )
    contours = (*disk(1.0).contours, BezierContour(moved), PolygonContour(small))
    return Outline(contours, fill_rule)


def mixed() -> Outline:
    """Return a polygon with a round hole in which a disk lies."""
    square = SQUARE.contours
    return Outline((*square, *disk(0.7).contours, *disk(0.3).contours))


CUSP = curves((0.0, 0.0), (1.0, 1.0), (0.0, 1.0), (1.0, 0.0), (0.9, -0.4), (0.1, -0.4))
LOOP = curves((0.0, 0.0), (1.6, 1.0), (-0.6, 1.0), (1.0, 0.0), (0.9, -0.4), (0.1, -0.4))
NEEDLE = curves((-1.0, 0.0), (0.0, 1e-5), (0.5, 2e-5), (1.0, 0.0), (0.5, -1e-6), (0.0, 1e-6))
FLAT_TIPS = curves((-1.0, 0.0), (-1.0, 0.0), (1.0, 1.0), (1.0, 1.0), (1.0, 1.0), (-1.0, 0.8))
STAIRS = curves(
    *((i / 8.0 + dx, (i + dy) / 8.0) for i in range(8) for dx, dy in ((0, 0), (0, 0.4), (0, 0.6),
      (0, 1), (0.04, 1), (0.08, 1))),
    (1.0, 1.0), (1.0, 0.7), (1.0, 0.3), (1.0, 0.0), (0.7, 0.0), (0.3, 0.0),
)  # fmt: skip

OUTLINES = {
    "disk": disk(1.0),
    "ellipse": ellipse(2.0, 0.1),
    "ring": ring(1.0, 0.5),
    "heart": heart(1.0),
    "letters": text_outline(TextSource("S&gB")),
    "two lines": text_outline(TextSource("Bézier\nlights")),
    "cusp": CUSP,
    "loop": LOOP,
    "loop, nonzero": replace(LOOP, fill_rule="nonzero"),
    "needle": NEEDLE,
    "flat tips": FLAT_TIPS,
    "stairs": STAIRS,
    "mixed": mixed(),
    "overlapping, evenodd": overlapping("evenodd"),
    "overlapping, nonzero": overlapping("nonzero"),
    "500 curves": flower(250),
}


def box_points(outline: Outline, points: FloatArray) -> FloatArray:
    """Return plane coordinates (n, 2) in the box of the outline's bands."""
    bands = outline_bands(outline)
    box = (points - bands.centre) / bands.half
    return box[:, ::-1] if bands.swapped else box


def plane_points(outline: Outline, box: FloatArray) -> FloatArray:
    bands = outline_bands(outline)
    return (box[:, ::-1] if bands.swapped else box) * bands.half + bands.centre


def distances(outline: Outline, points: FloatArray) -> FloatArray:
    """Return how far points (n, 2) are from the boundary, both in the box."""
    bands = outline_bands(outline)
    result = np.full(len(points), np.inf)
    places = (points - bands.centre) / bands.half
    for loop in boundary(outline):
        a = flatten((loop - bands.centre) / bands.half, 1e-9)
        way = np.roll(a, -1, axis=0) - a
        squares = np.maximum((way**2).sum(axis=-1), 1e-300)
        for i, place in enumerate(places):
            along = np.clip(((place - a) * way).sum(axis=-1) / squares, 0.0, 1.0)
            gap = np.hypot(*(a + along[:, None] * way - place).T)
            result[i] = min(result[i], gap.min())
    return result


def insides(outline: Outline, points: FloatArray) -> NDArray[np.bool_]:
    """Return which points (n, 2) are inside, by the contours as drawn, their winding and float64.

    `contains` for many points: a ray along +s meets a monotone piece once, found by halving.
    """
    drawn = np.concatenate(
        [
            np.array(contour.curves)
            if isinstance(contour, BezierContour)
            else line_as_cubic(contour.points, np.roll(contour.points, -1, axis=0))
            for contour in outline.contours
        ]
    )
    stops = np.nan_to_num(extrema(drawn), nan=0.0).reshape(-1, 4)
    stops = np.sort(np.pad(stops, ((0, 0), (1, 1)), constant_values=((0, 0), (0, 1))), axis=1)
    pieces = np.concatenate([part(drawn, stops[:, i], stops[:, i + 1]) for i in range(5)])
    (s0, t0), (s1, t1) = pieces[:, 0].T, pieces[:, 3].T
    s, t = points[:, :1], points[:, 1:]
    spans = (t0 <= t) != (t1 <= t)
    beyond = spans & (s < np.minimum(s0, s1))
    point, piece = np.nonzero(spans & ~beyond & (s < np.maximum(s0, s1)))
    low, high = np.zeros(len(point)), np.ones(len(point))
    for _ in range(50):
        middle = 0.5 * (low + high)
        above = evaluate_curves(pieces[piece], middle)[:, 1] > points[point, 1]
        before = above == (t1 > t0)[piece]
        low, high = np.where(before, low, middle), np.where(before, middle, high)
    beyond[point, piece] = evaluate_curves(pieces[piece], low)[:, 0] > points[point, 0]
    winding = np.where(beyond, np.sign(t1 - t0), 0.0).sum(axis=1)
    return winding % 2 != 0 if outline.fill_rule == "evenodd" else winding != 0


def assert_only_the_edge_differs(
    outline: Outline, points: FloatArray, inside: NDArray[np.bool_], tolerance: float
) -> None:
    """``tolerance`` is a distance from the boundary in its box from -1 to 1."""
    expected = insides(outline, points)
    wrong = points[inside != expected]
    assert len(wrong) <= 0.05 * len(points) + 5
    assert np.all(distances(outline, wrong) <= tolerance)
    for i in range(0, len(points), len(points) // 20):
        assert contains(outline, tuple(points[i])) == expected[i]


# The test of a point


def is_inside(
    ctx: moderngl.Context, folder: Path, outline: Outline, box: FloatArray
) -> NDArray[np.bool_]:
    """Return what the shader says of points in the outline's box, which it gets as float32."""
    bands = outline_bands(outline)
    texels = np.pad(bands.texels, ((0, -len(bands.texels) % 64), (0, 0)))
    got = evaluate(
        ctx,
        folder,
        ["common/outline_bands.glsl"],
        f"result.x = is_inside_outline(0, {bands.bands}, at) ? 1.0 : 0.0;",
        {"at": box},
        tables={"texels": texels.reshape(-1, 64, 4)},
        prelude="vec4 outline_texel(int i){ return texelFetch(texels, ivec2(i % 64, i / 64), 0); }",
    )
    return np.asarray(got[:, 0] == 1.0)


@pytest.mark.parametrize("name", OUTLINES)
def test_no_point_is_wrong_but_on_the_edge(
    ctx: moderngl.Context, tmp_path: Path, name: str
) -> None:
    """Also at the very q of the pieces' ends, of neighbouring floats, and of the bands' edges.

    A ray through a corner must count one of two pieces: a slip would be a wrong line.
    """
    outline = OUTLINES[name]
    bands = outline_bands(outline)
    rng = np.random.default_rng(5)
    pieces = bands.texels[bands.bands :].reshape(-1, TEXELS_PER_PIECE, 4)
    ends = np.unique(pieces[:, 0, :2])
    ends = rng.choice(ends, min(40, len(ends)), replace=False)
    edges = np.linspace(-1.0, 1.0, bands.bands + 1, dtype=np.float32)[::4]
    special = np.concatenate([ends, edges])
    q = np.concatenate([special, np.nextafter(special, 2.0), np.nextafter(special, -2.0)])
    q = np.repeat(np.clip(q, -1.0, 1.0), 6)
    lines = np.stack([rng.uniform(-1.0, 1.0, len(q)), q], axis=1)
    anywhere = rng.uniform(-1.0, 1.0, (500, 2))
    # Near the boundary, from far to a few roundings away.
    loops = np.concatenate(boundary(outline))
    near = box_points(outline, loops[rng.integers(0, len(loops), 300), 0])
    near = near + rng.normal(size=near.shape) * 10.0 ** rng.uniform(-6.5, -1.0, (300, 1))
    box = np.concatenate([lines, anywhere, np.clip(near, -1.0, 1.0)]).astype(np.float32)
    inside = is_inside(ctx, tmp_path, outline, box.astype(np.float64))
    # The ends are rounded by 3e-8 or 6e-8, the zero of the cubic to 4e-7 of its handles.
    assert_only_the_edge_differs(
        outline, plane_points(outline, box.astype(np.float64)), inside, 5e-7
    )


def test_zeros_of_rising_cubics(ctx: moderngl.Context, tmp_path: Path) -> None:
    """Random, straight, with double and triple zeros at the ends and between."""
    rng = np.random.default_rng(9)
    n = 20_000
    low, high = -(10.0 ** rng.uniform(-7.0, 0.0, n)), 10.0 ** rng.uniform(-7.0, 0.0, n)
    low, high = np.where(rng.random((2, n)) < 0.5, [low, high], [low / -low, high / high])
    third = (high - low) / 3.0
    a, b = np.sort(rng.uniform(low, high, (2, n)), axis=0)
    between = rng.uniform(0.0, 3.0, n) * third
    kinds = [
        (low, a, b, high),
        (low, low, low, high),
        (low, high, high, high),
        (low, low, high, high),
        (low, low + third, high - third, high),
        (low, high, low, high),  # a triple zero in the middle
        (low, low + between, high - between, high),
    ]
    f = np.stack([np.concatenate(part) for part in zip(*kinds, strict=True)], axis=1)
    f = f.astype(np.float32).astype(np.float64)
    got = evaluate(
        ctx,
        tmp_path,
        ["common/monotone_cubic.glsl"],
        "result.x = rising_cubic_zero(f); result.y = cubic_at(f, result.x);",
        {"f": f},
    )
    x = got[:, 0]
    assert np.all((x >= 0.0) & (x <= 1.0))
    u = 1.0 - x
    weights = np.stack([u * u * u, 3.0 * u * u * x, 3.0 * u * x * x, x * x * x], axis=1)
    assert np.abs((weights * f).sum(axis=1)).max() < 5e-7
    assert np.abs(got[:, 1] - (weights * f).sum(axis=1)).max() < 3e-7


# Pictures


def identities(
    renderer: Renderer, scene: Scene, size: tuple[int, int] = SIZE
) -> tuple[FloatArray, FloatArray]:
    """Return id and depth (h, w) of sample 0."""
    renderer.render(Shot(scene, RenderSettings(), *size))
    raw = np.frombuffer(renderer._targets.texture("gbuffer").read(), dtype=np.float32)
    surface = raw.reshape(size[1], size[0], 4)[::-1].astype(np.float64)
    return surface[..., 3], surface[..., 2]


def on_the_plane(
    light: AreaLight, camera: Camera, size: tuple[int, int] = SIZE
) -> tuple[FloatArray, FloatArray]:
    """Return (s, t) (h, w, 2) and depth (h, w) where the pixels' rays meet a light's plane."""
    frame = CameraFrame.of(camera, size[0] / size[1])
    y, x = np.mgrid[0 : size[1], 0 : size[0]] + 0.5
    ray = frame.ray(x, y, size)
    u, v, origin = (np.array(part) for part in (light.plane.u, light.plane.v, light.plane.origin))
    normal = np.cross(u, v)
    depth = (origin - frame.eye) @ normal / (ray @ normal)
    place = frame.eye + depth[..., None] * ray - origin
    basis = np.linalg.pinv(np.stack([u, v], axis=1))
    return place @ basis.T, depth


TURNED = Plane((0.3, 0.8, -2.0), (0.9, 0.1, 0.2), (-0.3, 1.1, 0.1))


@pytest.mark.parametrize("name", OUTLINES)
def test_a_picture_agrees_with_the_outline(renderer: Renderer, name: str) -> None:
    outline = OUTLINES[name]
    light = AreaLight("l", outline, TURNED)
    middle = outline_bands(outline)
    u, v = np.array(TURNED.u), np.array(TURNED.v)
    target = np.array(TURNED.origin) + middle.centre[0] * u + middle.centre[1] * v
    eye = target + np.array([0.4, 0.2, 2.2]) * max(middle.half)
    camera = Camera(tuple(eye), tuple(target))
    scene = Scene(lights=(light,), camera=camera)
    identity, depth = identities(renderer, scene)
    points, expected = on_the_plane(light, camera)
    seen = identity == -1.0
    assert np.all((depth > 0.0) == seen)
    assert np.all(np.abs(depth[seen] / expected[seen] - 1.0) < 1e-6)
    pick = np.random.default_rng(1).choice(seen.size, 1000, replace=False)
    assert_only_the_edge_differs(outline, points.reshape(-1, 2)[pick], seen.reshape(-1)[pick], 1e-6)
    if name != "needle":
        assert seen.sum() > 100


@pytest.mark.parametrize("name", ["ring", "letters", "500 curves", "heart"])
@pytest.mark.parametrize("zoom", [1e3, 3e4])
def test_an_edge_is_curved_at_any_zoom(renderer: Renderer, name: str, zoom: float) -> None:
    """A pixel is 1e-5, or 4e-7, of the light; a chord of 4,096 would be off by 3e-7."""
    outline = OUTLINES[name]
    light = AreaLight("l", outline, TURNED)
    half = max(outline_bands(outline).half)
    curve = boundary(outline)[-1][0]
    s, t = (curve @ [[1.0], [0.0]]).ravel(), (curve @ [[0.0], [1.0]]).ravel()
    weights = np.array([0.343, 0.441, 0.189, 0.027])
    u, v, n = np.array(TURNED.u), np.array(TURNED.v), np.array(normal_of(TURNED))
    target = np.array(TURNED.origin) + (weights @ s) * u + (weights @ t) * v
    fov = math.radians(1.0)
    eye = target + (n + 0.3 * u) * half / zoom / math.tan(0.5 * fov)
    camera = Camera(tuple(eye), tuple(target), fov_y=fov)
    identity, _ = identities(renderer, Scene(lights=(light,), camera=camera))
    points, _ = on_the_plane(light, camera)
    seen = identity == -1.0
    assert 0.1 < seen.mean() < 0.9
    pick = np.random.default_rng(1).choice(seen.size, 1000, replace=False)
    assert_only_the_edge_differs(outline, points.reshape(-1, 2)[pick], seen.reshape(-1)[pick], 5e-7)


def test_no_lines_leak_wherever_pixels_fall(renderer: Renderer) -> None:
    """Pixel rows and columns through anchors and corners, at many offsets.

    A leak is a pixel that differs from both its neighbours across the ray, and from the truth.
    """
    size = (65, 65)  # the middle row sees the middle of the light
    for name in ("disk", "stairs", "mixed", "ring"):
        outline = OUTLINES[name]
        light = AreaLight("l", outline, Plane((0.0, 0.0, 0.0)))
        bands = outline_bands(outline)
        x, y = bands.centre
        for step in range(8):
            distance = 2.0 + 0.5 * (step % 2)
            shift = (step // 2) / 8.0 * bands.half
            camera = Camera((x + shift[0], y + shift[1], distance), (x + shift[0], y + shift[1], 0))
            scene = Scene(lights=(light,), camera=camera)
            identity, _ = identities(renderer, scene, size)
            points, _ = on_the_plane(light, camera, size)
            seen = identity == -1.0
            rows = [0, 16, 32, 48, 64]
            for line in (np.s_[rows, :], np.s_[:, rows]):
                assert_only_the_edge_differs(
                    outline, points[line].reshape(-1, 2), seen[line].reshape(-1), 1e-6
                )


def test_sides_holes_and_ids(renderer: Renderer) -> None:
    camera = Camera((0.0, 0.0, 4.0), (0.0, 0.0, 0.0))
    behind = SceneObject("wall", "box", "glossy", Transform((0.0, 0.0, -3.0), scale=(9, 9, 1)))
    light = AreaLight("ring", ring(1.0, 0.5), Plane((0.0, 0.0, 0.0)))
    polygon = AreaLight("frame", FRAME, Plane((0.0, 0.0, 0.5), (0.2, 0.0, 0.0), (0.0, 0.2, 0.0)))
    hidden = replace(light, name="hidden", visible=False)
    scene = Scene((GLOSSY,), (behind,), (hidden, polygon, light), camera)
    points, _ = on_the_plane(light, camera)
    radius = np.hypot(points[..., 0], points[..., 1])
    lit = (radius < 0.999) & (radius > 0.501)
    dark = (radius > 1.001) | ((radius < 0.499) & (np.abs(points).max(axis=-1) > 0.3))

    identity, _ = identities(renderer, scene)
    assert (identity[lit] == -3.0).all()
    assert (identity[dark] == 0.0).all()
    assert (identity == -2.0).sum() > 20

    away = replace(light, plane=Plane((0.0, 0.0, 0.0), (-1.0, 0.0, 0.0)))
    back = replace(scene, lights=(hidden, polygon, away))
    identity, _ = identities(renderer, back)
    assert (identity[lit] == 0.0).all(), "the back of a one-sided light shows what is behind it"

    both = replace(back, lights=(hidden, polygon, replace(away, two_sided=True)))
    identity, _ = identities(renderer, both)
    assert (identity[lit] == -3.0).all()
    raw = np.frombuffer(renderer._targets.texture("gbuffer").read(), dtype=np.float32)
    normals = raw.reshape(*SIZE[::-1], 4)[::-1][lit][:, :2]
    np.testing.assert_allclose(normals, 0.0, atol=1e-7)  # (0, 0) is +z: turned to the viewer


def test_a_curved_lamp_flush_with_a_wall_is_in_front_of_it(renderer: Renderer) -> None:
    facing = (math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0)
    wall = SceneObject("wall", "plane", "glossy", Transform((0.0, 0.0, -2.0), facing, (9.0,) * 3))
    lamp = AreaLight("lamp", disk(1.0), Plane((0.3, 0.8, -2.0)))
    camera = Camera((2.0, 1.2, 4.0), (0.0, 0.8, 0.0))
    identity, _ = identities(renderer, Scene((GLOSSY,), (wall,), (lamp,), camera))
    points, _ = on_the_plane(lamp, camera)
    radius = np.hypot(points[..., 0], points[..., 1])
    assert (identity[radius < 0.999] == -1.0).all()
    assert (identity[radius > 1.001] == 0.0).all()


def test_picking_finds_the_curve_within_a_pixel(renderer: Renderer) -> None:
    light = AreaLight("ring", ring(1.0, 0.5), Plane((0.0, 0.0, 0.0)))
    camera = Camera((0.3, 0.2, 4.0), (0.0, 0.0, 0.0))
    renderer.render(Shot(Scene(lights=(light,), camera=camera), RenderSettings(), *SIZE))
    frame = CameraFrame.of(camera, SIZE[0] / SIZE[1])
    for angle in np.linspace(0.0, 6.2, 12):
        for radius, hit in ((1.0 - 1e-5, True), (1.0 + 3e-4, False), (0.5 - 3e-4, False)):
            point = np.array([radius * math.cos(angle), radius * math.sin(angle), 0.0])
            clip = frame.clip_from_world() @ [*point, 1.0]
            x = 0.5 * SIZE[0] * (1.0 + clip[0] / clip[3])
            y = 0.5 * SIZE[1] * (1.0 - clip[1] / clip[3])
            # Four cubics leave a circle by 2.7e-4 at most, outwards.
            found = renderer.pick(x, y)
            assert (found is not None) == hit, (angle, radius)
            if found is not None:
                assert (found.kind, found.index) == ("light", 0)
                np.testing.assert_allclose(found.position_ws, point, atol=1e-5)


def test_close_far_and_edge_on(renderer: Renderer) -> None:
    """Under the camera and behind it; a millimetre a kilometre away; seen from its plane."""
    big = AreaLight("big", disk(100.0), Plane((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, -1.0)))
    camera = Camera((0.0, 1.0, 0.0), (0.0, 0.7, -1.0))
    identity, depth = identities(renderer, Scene(lights=(big,), camera=camera))
    points, expected = on_the_plane(big, camera)
    radius = np.where(expected > 0.0, np.hypot(points[..., 0], points[..., 1]), np.inf)
    assert (identity[radius < 99.9] == -1.0).all()
    assert (depth[radius > 100.1] == 0.0).all()
    seen = identity == -1.0
    # Towards the horizon by as many roundings as the eye's height goes into the distance.
    assert np.all(np.abs(depth[seen] / expected[seen] - 1.0) < 6e-8 * (2.0 + expected[seen]))

    place = (1000.0, 2000.0, -500.0)
    small = AreaLight("small", ring(1e-3, 5e-4), Plane(place))
    camera = Camera((1000.0, 2000.0, -499.99), place, fov_y=math.radians(20.0))
    identity, _ = identities(renderer, Scene(lights=(small,), camera=camera))
    points, _ = on_the_plane(small, camera)
    radius = np.hypot(points[..., 0], points[..., 1])
    assert (identity[(radius < 9.99e-4) & (radius > 5.01e-4)] == -1.0).all()
    assert not (identity[(radius > 1.001e-3) | (radius < 4.99e-4)] == -1.0).any()

    for height in (0.0, 1e-14, 1e-7):
        camera = Camera((0.0, height, 300.0), (0.0, height, 0.0))
        identity, depth = identities(renderer, Scene(lights=(big,), camera=camera))
        assert (depth > 0.0).sum() <= SIZE[0]


# What it costs


def test_a_scene_without_curves_has_none_of_this(renderer: Renderer) -> None:
    plain = Shot(one_light(), RenderSettings(), *SIZE)
    renderer.render(plain)
    assert not {"light curves"} & {spec.name for spec in renderer.programs.specs()}
    plan = renderer.plan(plain)
    assert "light curves" not in plan.allocated
    for program in plan.programs:
        assert not any("outline_bands" in name for name in program.files)
    assert any("no visible light has curves" in left.why for left in plan.left_out)

    curved = replace(plain, scene=one_light(light=replace(KEY, outline=heart(1.0))))
    renderer.render(curved)
    renderer.display()
    plan = renderer.plan(curved)
    assert renderer.allocated() == plan.allocated
    assert plan.allocated["light curves"] > 0
    assert "light shapes" not in plan.allocated
    assert "light curves" in plan.text()

    renderer.render(plain)
    renderer.display()
    assert renderer.allocated() == renderer.plan(plain).allocated


def test_a_moved_light_keeps_its_curves(renderer: Renderer) -> None:
    light = AreaLight("l", heart(1.0), Plane((0.0, 1.0, -2.0)))
    scene = Scene((GLOSSY,), (floor(),), (light,))
    renderer.render(Shot(scene, RenderSettings(), *SIZE))
    uploads = renderer.uploads["light shapes"]
    moved = replace(light, plane=TURNED, radiance=(9.0, 9.0, 9.0))
    renderer.render(Shot(replace(scene, lights=(moved,)), RenderSettings(), *SIZE))
    assert renderer.uploads["light shapes"] == uploads
    other = replace(light, outline=heart(1.1))
    renderer.render(Shot(replace(scene, lights=(other,)), RenderSettings(), *SIZE))
    assert renderer.uploads["light shapes"] == uploads + 1


def test_bands_stay_small() -> None:
    """A pixel of a line of text looks at a letter or two, and copies of pieces are few."""
    word = outline_bands(text_outline(TextSource("A long line of text in lights")))
    assert word.swapped, "cut into columns"
    assert word.looks < 10.0
    assert outline_bands(flower(250)).looks < 30.0
    for name, outline in OUTLINES.items():
        bands = outline_bands(outline)
        pieces = bands.texels[bands.bands :].reshape(-1, 3, 4)
        distinct = np.unique(np.hstack([pieces[:, 0, :2], pieces[:, 1]]), axis=0)
        assert len(pieces) <= 16 * len(distinct) + bands.bands, name
    nothing = curves((0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (3.0, 0.0), (2.0, 0.0), (1.0, 0.0))
    assert outline_bands(nothing).bands == 0
    assert pack_light_curves([AreaLight("l", nothing)])[1] == ()


def test_more_curves_than_the_machine_holds() -> None:
    scene = Scene(lights=(AreaLight("l", flower(250)),))
    with pytest.raises(InputError, match=r"lights: .* records, expected at most"):
        needs_of(scene, 1, Limits(texture_side=1))
    needs_of(many_lights(2), 1, Limits())
