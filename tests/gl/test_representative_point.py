"""The baseline ``representative-point`` in float32 against its float64 twin.

`Renderer.probe` runs the very functions of the lighting pass at given points.
"""

from __future__ import annotations

import re

import numpy as np
import pytest

from app.outline import resolve
from app.render.pack import light_geometry
from app.scene import AreaLight, BezierContour, Outline, Plane, RenderSettings, Scene
from ltc.representative_point import representative_point
from ltc.resources import resource_path
from tests.gl.test_ggx import Points, frames, random_points, which
from tests.gl.test_probe import light, on_light, random_light

EACH = 256
SHIFT = np.array([3.0, 0.0])
ROUNDING = 3e-6
"""Over alpha: a few roundings of a direction, 6e-8 each, are so much of a lobe's width, on which
GGX depends with the fourth power."""
STAGE = "a stage of the estimate, tested whole through probe_lights"
TWINS = {"probe_lights"}
GPU_ONLY = {
    "nearest_on_arc": STAGE,
    "half_solid_angle": STAGE,
    "point_terms": STAGE,
    "shade_lights": "the probe's sum weighted by a material",
}


def test_every_function_is_listed():
    path = resource_path("shaders", "representative_point", "shade.glsl")
    text = re.sub(r"//[^\n]*|^\s*#[^\n]*", "", path.read_text(encoding="utf-8"), flags=re.M)
    assert set(re.findall(r"^\w+ (\w+)\(", text, flags=re.M)) == TWINS | set(GPU_ONLY)


def twin(lamp, points):
    """Return (specular, diffuse), each (n,), in float64."""
    at = points.rounded()
    frame = frames(at)
    wo = np.einsum("nij,nj->ni", frame, at.view)

    def local(world):
        return np.einsum("nij,n...j->n...i", frame, world)

    origin, u, v = (np.array(a) for a in (lamp.plane.origin, lamp.plane.u, lamp.plane.v))
    loops = [
        local(origin + loop[:, :1] * u + loop[:, 1:] * v - at.position[:, None])
        for loop in resolve(lamp.outline)
    ]
    centre = local(light_geometry(lamp).origin - at.position)
    one, _, diffuse = representative_point(loops, centre, wo, *at.alpha.T)
    front = np.sum(np.cross(u, v) * (at.position - origin), axis=-1) > 0.0
    lit = (front | lamp.two_sided) & np.any([(p[..., 2] > 0).any(axis=-1) for p in loops], axis=0)
    return np.where(lit, one, 0.0), np.where(lit, diffuse, 0.0)


def probe(renderer, lamp, points):
    out = renderer.probe(
        Scene(lights=(lamp,)), RenderSettings("representative-point"), points.position,
        points.normal, points.tangent, points.view, points.alpha,
    )  # fmt: skip
    for name in ("specular", "diffuse"):
        assert np.isfinite(out[name]).all()
        assert out[name].min() >= 0.0
    return out["specular"][:, 0].astype(np.float64), out["diffuse"][:, 0].astype(np.float64)


def points_of(rng, lamp, alpha, aimed):
    aim = on_light(rng, lamp, EACH, 0.3)
    position = rng.uniform(-2.0, 2.0, (EACH, 3))
    return random_points(rng, which(1, EACH), position, alpha=alpha, mirror=aim if aimed else None)


def relative(found, wanted):
    """Its scale has no bound, so errors count as shares of what is more than 1."""
    return np.abs(found - wanted) / np.maximum(np.abs(wanted), 1.0)


@pytest.mark.parametrize("alpha", [(0.05, 1.0), (1e-3, 0.05)])
@pytest.mark.parametrize("aimed", [False, True])
def test_twin(renderer, alpha, aimed):
    rng = np.random.default_rng(41)
    specular, diffuse = [], []
    for index in range(24):
        size = float(10 ** rng.uniform(-1.0, 0.7))
        lamp = random_light(rng, size=size, two_sided=index % 3 > 0)
        points = points_of(rng, lamp, alpha, aimed)
        found, wanted = probe(renderer, lamp, points), twin(lamp, points)
        specular.append(relative(found[0], wanted[0]))
        diffuse.append(relative(found[1], wanted[1]))
    assert np.max(diffuse) <= 1e-5
    assert np.quantile(specular, 0.99) <= ROUNDING / alpha[0]
    # Two points of an outline may be as near as each other, but for rounding, and one below the
    # horizon: few are.
    assert np.mean(np.array(specular) > 1e-4 / alpha[0]) <= 1e-3


def test_holes_and_lights_apart(renderer):
    """In a hole the nearest point is its rim, between two parts that of one of them."""
    square = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
    rng = np.random.default_rng(5)
    for contours in ((square, 0.5 * square), (square - SHIFT, square + SHIFT)):
        lamp = light(*contours, plane=Plane((0.0, 2.0, 0.0), (1, 0, 0), (0, 0, 1)), two_sided=True)
        points = points_of(rng, lamp, (0.1, 0.5), aimed=True)
        found, wanted = probe(renderer, lamp, points), twin(lamp, points)
        assert np.quantile(relative(found[0], wanted[0]), 0.99) <= ROUNDING / 0.1
        np.testing.assert_allclose(found[1], wanted[1], rtol=0, atol=1e-5)


def test_curves_become_edges(renderer):
    """A disk of Bézier curves is close to a polygon of many corners, and closer with more edges."""
    h = 0.5522847498
    quarter = [[(1, 0), (1, h), (h, 1), (0, 1)]]
    for _ in range(3):
        quarter.append([(-y, x) for x, y in quarter[-1]])
    plane = Plane((0.0, 1.0, -1.0))
    curves = tuple(tuple((float(s), float(t)) for s, t in curve) for curve in quarter)
    outline = Outline((BezierContour(curves),))
    disk = AreaLight("l", outline, plane, (1.0, 1.0, 1.0), two_sided=True)
    angle = np.linspace(0.0, 2.0 * np.pi, 256, endpoint=False)
    polygon = light(np.stack([np.cos(angle), np.sin(angle)], axis=-1), plane=plane, two_sided=True)
    rng = np.random.default_rng(6)
    points = points_of(rng, polygon, (0.2, 0.5), aimed=False)
    wanted = twin(polygon, points)
    errors = []
    for edges in (4, 18):
        out = renderer.probe(
            Scene(lights=(disk,)), RenderSettings(f"representative-point:{edges}"),
            points.position, points.normal, points.tangent, points.view, points.alpha,
        )  # fmt: skip
        errors.append(np.abs(out["diffuse"][:, 0] - wanted[1]).mean())
    assert errors[1] < 0.2 * errors[0]
    assert errors[1] <= 2e-3


def test_brushed_and_turned_surfaces():
    """Points carry their own tangents: alphas swapped and tangents turned are the same."""
    rng = np.random.default_rng(7)
    points = points_of(rng, random_light(rng), (0.05, 1.0), aimed=True)
    assert isinstance(points, Points)
    turned = Points(
        points.lamp, points.position, points.normal,
        np.cross(points.normal, points.tangent), points.view, points.alpha[:, ::-1],
    )  # fmt: skip
    lamp = random_light(rng, two_sided=True)
    np.testing.assert_allclose(twin(lamp, points), twin(lamp, turned), rtol=1e-4, atol=1e-6)
