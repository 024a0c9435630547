"""Functions of ``shaders/reference`` and ``shaders/residual`` against float64, one pixel a call.

`TWINS` lists every function with a test here; `WHOLE` those that are stages of an estimate,
tested as a whole by test_reference_technique.py and test_residual.py. A function in neither
list fails `test_every_function_is_listed`.
"""

from __future__ import annotations

import re

import numpy as np
import pytest

from ltc import brdf, spherical_rectangle
from ltc.resources import resource_path
from tests.gl.evaluate import evaluate

COUNT = 8192
FEATURES = {
    "HAS_SPECULAR": 1,
    "HAS_DIFFUSE": 1,
    "TECHNIQUE_RESIDUAL": 1,
    "HAS_ONE_SIDED": 1,
    "HAS_TWO_SIDED": 1,
    "HAS_CURVES": 0,
    "CURVE_RULE": 0,
    "COUNTS_EVALUATIONS": 0,
    "HAS_EXACT_FMA": 0,
    "HAS_PICTURES": 0,
    "PROBES": 1,
}
TWINS = {
    "stretched_length",
    "ggx_lobe",
    "ggx_value",
    "ggx_direction",
    "cosine_value",
    "cosine_direction",
    "seen_rectangle",
    "place_on_rectangle",
    "rectangle_density",
}
WHOLE = {
    "is_crossed",
    "is_on_light",
    "begin_estimate",
    "weighted_terms",
    "rectangle_of",
    "terms_along",
    "terms_by_place",
    "light_terms",
    "coloured_terms",
    "cosine_lobe",
    "begin_residual",
    "shade_lights",
    "probe_lights",
}


def test_every_function_is_listed():
    found = set()
    for folder in ("reference", "residual"):
        for path in resource_path("shaders", folder).glob("*.glsl"):
            text = re.sub(r"//[^\n]*|^\s*#[^\n]*", "", path.read_text(encoding="utf-8"), flags=re.M)
            found |= set(re.findall(r"^\w+ (\w+)\(", text, flags=re.M))
    assert found == TWINS | WHOLE
    assert not TWINS & WHOLE


@pytest.fixture
def glsl(ctx, tmp_path):
    def run(include, body, inputs):
        return evaluate(ctx, tmp_path, [include], body, inputs, FEATURES)

    return run


def f32(values):
    """Rounded to what the GPU gets, in float64."""
    return np.asarray(values, dtype=np.float32).astype(np.float64)


def unit(v):
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def upper(rng):
    w = rng.normal(size=(COUNT, 3))
    w[:, 2] = np.abs(w[:, 2]) * 10 ** rng.uniform(-2.0, 1.0, COUNT)
    return f32(unit(w))


def alphas(rng, least=1e-3):
    return f32(np.exp(rng.uniform(np.log(least), 0.0, (COUNT, 2))))


def test_ggx_value(glsl):
    rng = np.random.default_rng(0)
    wo, wi, alpha = upper(rng), upper(rng), alphas(rng, 0.02)
    got = glsl(
        "reference/lobe.glsl", "result.xyz = ggx_value(ggx_lobe(wo, alpha), wi);",
        {"wo": wo, "wi": wi, "alpha": alpha},
    )  # fmt: skip
    wo, wi = unit(wo), unit(wi)
    one = brdf.evaluate(wo, wi, *alpha.T)
    h = brdf.half_vector(wo, wi)
    fresnel = one * brdf.schlick_fresnel(np.sum(h * wo, axis=-1), 0.0)
    want = np.stack([one, fresnel, brdf.pdf(wo, wi, *alpha.T)], axis=-1)
    # A half vector that is 6e-8 off is 3e-6 of a lobe of alpha .02 off, and its height by
    # as many times the slope, relative; the fifth power of 1 - wo.h loses more where it is small.
    np.testing.assert_allclose(got[:, [0, 2]], want[:, [0, 2]], rtol=1e-4, atol=1e-9)
    np.testing.assert_allclose(got[:, 1], want[:, 1], rtol=1e-4, atol=1e-6 * one.max())


def test_ggx_direction(glsl):
    rng = np.random.default_rng(1)
    wo, alpha, u = upper(rng), alphas(rng), f32(rng.random((COUNT, 2)))
    got = glsl(
        "reference/lobe.glsl", "result.xyz = ggx_direction(ggx_lobe(wo, alpha), u);",
        {"wo": wo, "alpha": alpha, "u": u},
    )  # fmt: skip
    want = brdf.reflect(unit(wo), brdf.sample_visible_normals(unit(wo), u, *alpha.T))
    # The driver's own sine and cosine are 1e-7 off at best.
    np.testing.assert_allclose(got[:, :3], want, atol=3e-5)
    assert np.percentile(np.abs(got[:, :3] - want), 99) < 1e-6


TRANSFORM = """
    mat3 k = mat3(k0, k1, k2);
    mat3 n = mat3(cross(k1, k2), cross(k2, k0), cross(k0, k1));
    CosineLobe lobe = CosineLobe(k, n, dot(k0, n[0]));
"""


def transforms(rng):
    """Return K, (COUNT, 3, 3), of positive determinant and condition below some 100."""
    k = np.linalg.qr(rng.normal(size=(COUNT, 3, 3)))[0] * 10 ** rng.uniform(-1, 1, (COUNT, 1, 3))
    k *= np.sign(np.linalg.det(k))[:, None, None]
    return f32(k), {f"k{i}": f32(k[:, :, i]) for i in range(3)}


def test_cosine_value(glsl):
    rng = np.random.default_rng(2)
    k, columns = transforms(rng)
    w = f32(unit(rng.normal(size=(COUNT, 3))))
    body = f"{TRANSFORM} result.x = cosine_value(lobe, w);"
    got = glsl("reference/lobe.glsl", body, {**columns, "w": w})[:, 0]
    c = np.einsum("nij,nj->ni", k, w)
    length = np.linalg.norm(c, axis=1)
    want = np.linalg.det(k) * np.maximum(c[:, 2], 0.0) / (np.pi * length**4)
    scale = np.linalg.det(k) / (np.pi * length**3)
    assert np.abs((got - want) / scale).max() < 2e-4


def test_cosine_direction(glsl):
    """K takes it back to the cosine's own direction."""
    rng = np.random.default_rng(3)
    k, columns = transforms(rng)
    u = f32(rng.random((COUNT, 2)))
    body = f"{TRANSFORM} result.xyz = cosine_direction(lobe, u);"
    got = glsl("reference/lobe.glsl", body, {**columns, "u": u})[:, :3]
    np.testing.assert_allclose(np.linalg.norm(got, axis=1), 1.0, atol=1e-6)
    r, a = np.sqrt(u[:, 1]), 2.0 * np.pi * u[:, 0]
    want = np.stack([r * np.cos(a), r * np.sin(a), np.sqrt(1.0 - u[:, 1])], axis=-1)
    back = unit(np.einsum("nij,nj->ni", k, got))
    np.testing.assert_allclose(back, want, atol=2e-4)
    assert np.percentile(np.abs(back - want), 99) < 1e-5


def rectangles(rng):
    low = rng.normal(0.0, 2.0, (COUNT, 2))
    sides = np.concatenate([low, low + 10 ** rng.uniform(-1.0, 1.0, (COUNT, 2))], axis=1)
    return f32(sides), f32(10 ** rng.uniform(-2.0, 1.0, COUNT))


def test_rectangle(glsl):
    rng = np.random.default_rng(4)
    sides, depth = rectangles(rng)
    u = f32(rng.random((COUNT, 2)))
    body = """
        SeenRectangle seen = seen_rectangle(sides, depth);
        vec2 at = place_on_rectangle(seen, u);
        float reach = length(vec3(at, depth));
        result = vec4(at, seen.solid_angle, rectangle_density(seen, reach));
    """
    got = glsl("reference/rectangle.glsl", body, {"sides": sides, "depth": depth, "u": u})
    solid = got[:, 2] > 0.0
    assert 0.2 < solid.mean() < 0.8
    exact = spherical_rectangle.solid_angle(sides, depth)
    size = (sides[:, 2:] - sides[:, :2]).max(axis=1)
    clear = np.abs(exact - 0.02) > 1e-5
    assert np.array_equal(solid[clear], ((exact > 0.02) & (depth > 0.02 * size))[clear])
    np.testing.assert_allclose(got[solid, 2], exact[solid], atol=2e-6)
    np.testing.assert_allclose(got[solid, 3], 1.0 / exact[solid], rtol=1e-4)
    want = spherical_rectangle.place(sides, depth, u)
    wrong = np.abs(got[:, :2] - want).max(axis=1)[solid] / size[solid]
    assert wrong.max() < 2e-3
    assert np.percentile(wrong, 99) < 1e-4
    # Evenly over the area elsewhere: r^2 / (area cos).
    at = sides[:, :2] + u * (sides[:, 2:] - sides[:, :2])
    np.testing.assert_allclose(got[~solid, :2], at[~solid], atol=1e-5)
    area = np.prod(sides[:, 2:] - sides[:, :2], axis=1)
    r2 = np.sum(at * at, axis=1) + depth * depth
    np.testing.assert_allclose(got[~solid, 3], (r2**1.5 / (area * depth))[~solid], rtol=1e-4)
