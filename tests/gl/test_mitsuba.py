"""A third opinion: Mitsuba 3's renders of the same points, where it is installed.

Mitsuba masks both directions independently, G2 = G1 G1, and not height-correlated as here. So
one quadrature in float64 over the light stands between the two: with the one G2 it must agree
with Mitsuba, with the other with `reference`, and Lambert's must agree with both at once.
"""

from __future__ import annotations

import numpy as np
import pytest

from app.scene import AreaLight, Outline, Plane, PolygonContour, RenderSettings, Scene
from ltc import brdf
from ltc.quadrature import gauss_legendre

mitsuba = pytest.importorskip("mitsuba", reason="Mitsuba 3 is optional: pip install mitsuba")

SQUARE = Outline((PolygonContour(((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))),))
ORIGIN, U, V = np.array([0.3, 1.1, -1.4]), np.array([0.8, 0.0, 0.3]), np.array([0.0, 0.7, 0.0])
POINTS = 6
SEEDS, SAMPLES = 16, 32768
LARGEST_Z = 5.0
"""Standard errors of 16 means, for a few dozen values: by chance one in a hundred runs."""


def views() -> tuple[np.ndarray, np.ndarray]:
    """Return points on the floor and unit directions to their viewers."""
    rng = np.random.default_rng(3)
    position = np.stack([rng.uniform(-1, 1, POINTS), np.zeros(POINTS), rng.uniform(-1, 1, POINTS)])
    view = rng.normal(size=(POINTS, 3)) * (1.0, 0.5, 1.0) + (0.0, 1.2, 1.0)
    return position.T, view / np.linalg.norm(view, axis=1, keepdims=True)


def quadrature(alpha: tuple[float, float], correlated: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return the light's (specular for F = 1, diffuse for albedo 1) integrals at `views`."""
    position, view = views()
    x, w = gauss_legendre(80)
    s, t = 2.0 * x[:, None, None] - 1.0, 2.0 * x[None, :, None] - 1.0
    lit = (ORIGIN + s * U + t * V).reshape(-1, 3)
    normal = np.cross(U, V)
    weights = 4.0 * (w[:, None] * w[None, :]).ravel()
    found = []
    # The floor's frame: x, -z, y.
    frame = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    for p, toward in zip(position, view, strict=True):
        way = lit - p
        r2 = np.sum(way * way, axis=1)
        wi = way / np.sqrt(r2)[:, None]
        solid = weights * np.maximum(-wi @ normal, 0.0) / r2
        wo, wi = np.broadcast_to(frame @ toward, wi.shape), wi @ frame.T
        value = brdf.evaluate(wo, wi, *alpha)
        if not correlated:
            apart = brdf.smith_g1(wo, *alpha) * brdf.smith_g1(wi, *alpha)
            value = value * apart / brdf.smith_g2(wo, wi, *alpha)
        found.append([np.sum(solid * value), np.sum(solid * np.maximum(wi[:, 2], 0.0)) / np.pi])
    specular, diffuse = np.transpose(found)
    return specular, diffuse


def rendered(material: dict) -> tuple[np.ndarray, np.ndarray]:
    """Return Mitsuba's radiance at `views` and its standard error, (n,) each."""
    mitsuba.set_variant("scalar_rgb")
    transform = mitsuba.ScalarTransform4f
    to_world = np.eye(4)
    n = np.cross(U, V)
    to_world[:3] = np.stack([U, V, n / np.linalg.norm(n), ORIGIN], axis=1)
    floor = transform().rotate([1, 0, 0], -90).scale(20.0)
    scene = {
        "type": "scene",
        "integrator": {"type": "direct"},
        "floor": {"type": "rectangle", "to_world": floor, "bsdf": material},
        "light": {
            "type": "rectangle",
            "to_world": transform(to_world),
            "bsdf": {"type": "diffuse", "reflectance": 0.0},
            "emitter": {"type": "area", "radiance": 1.0},
        },
    }
    loaded = mitsuba.load_dict(scene)
    means = []
    for p, toward in zip(*views(), strict=True):
        sensor = mitsuba.load_dict(
            {
                "type": "radiancemeter",
                "origin": list(p + 0.05 * toward),
                "direction": list(-toward),
                "film": {"type": "hdrfilm", "width": 1, "height": 1, "rfilter": {"type": "box"}},
                "sampler": {"type": "independent"},
            }
        )
        each = [
            float(np.array(mitsuba.render(loaded, sensor=sensor, spp=SAMPLES, seed=seed))[0, 0, 0])
            for seed in range(SEEDS)
        ]
        means.append((np.mean(each), np.std(each, ddof=1) / np.sqrt(SEEDS)))
    mean, error = np.transpose(means)
    return mean, error


def reference(renderer, alpha: tuple[float, float]) -> dict[str, np.ndarray]:
    position, view = views()
    light = AreaLight("l", SQUARE, Plane(tuple(ORIGIN), tuple(U), tuple(V)), (1.0, 1.0, 1.0))
    constant = np.ones((POINTS, 1))
    found = renderer.probe(
        Scene(lights=(light,)),
        RenderSettings("reference", 4096),
        position,
        constant * (0.0, 1.0, 0.0),
        constant * (1.0, 0.0, 0.0),
        view,
        constant * alpha,
    )
    return {name: values[:, 0] for name, values in found.items()}


@pytest.mark.parametrize("alpha", [(0.3, 0.3), (0.6, 0.25)])
def test_specular(renderer, alpha):
    mean, error = rendered(
        {"type": "roughconductor", "material": "none", "distribution": "ggx",
         "alpha_u": alpha[0], "alpha_v": alpha[1]}
    )  # fmt: skip
    apart, _ = quadrature(alpha, correlated=False)
    assert apart.max() > 0.1
    assert np.abs((mean - apart) / np.hypot(error, 1e-5)).max() < LARGEST_Z
    together, _ = quadrature(alpha, correlated=True)
    # 4,096 evenly laid samples are within some 1e-3.
    np.testing.assert_allclose(reference(renderer, alpha)["specular"], together, atol=2e-3)
    # And the two ways to mask can be told apart, by 1 %: this is no test of nothing.
    z = (together - mean) / np.hypot(error, 1e-5)
    assert z.sum() / np.sqrt(POINTS) > LARGEST_Z


def test_diffuse(renderer):
    mean, error = rendered({"type": "diffuse", "reflectance": 1.0})
    _, want = quadrature((0.3, 0.3), correlated=True)
    assert np.abs((mean - want) / np.hypot(error, 1e-5)).max() < LARGEST_Z
    found = reference(renderer, (0.3, 0.3))["diffuse"]
    np.testing.assert_allclose(found, want, atol=1e-3)
