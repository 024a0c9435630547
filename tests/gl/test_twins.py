"""Functions of ``shaders/ltc`` against their float64 definitions, one pixel a call.

`TWINS` lists every function with a test here; `GPU_ONLY` says why others have none of
their own. A function in neither list fails `test_every_function_is_listed`.
"""

from __future__ import annotations

import re

import numpy as np
import pytest

from app.curves import signed_areas
from app.render.pack import LIGHT_HEADER
from app.render.tables import isotropic_textures
from ltc import table, transform
from ltc.bezier import sign_changes
from ltc.bounds import form_factor_bound
from ltc.polygon import clipped_form_factor
from ltc.resources import resource_path
from tests.gl.evaluate import evaluate

FEATURES = {
    "HAS_SPECULAR": 1,
    "HAS_DIFFUSE": 1,
    "HAS_ONE_SIDED": 1,
    "HAS_TWO_SIDED": 1,
    "HAS_CURVES": 1,
    "CURVE_NODES": 4,
    "CURVE_RULE": 0,
    "COUNTS_EVALUATIONS": 0,
    "HAS_EXACT_FMA": 0,
    "HAS_PICTURES": 0,
    "PROBES": 1,
    "CULLS": 0,
    "MIXED_LOBES": 0,
}
NO_LIGHTS = "vec4 light_texel(int index) { return vec4(0.0); }"
COUNT = 4096

TWINS = {
    "table_coordinates",
    "table_bilinear",
    "albedo_terms",
    "isotropic_lobe",
    "cosine_transform",
    "anisotropic_coordinates",
    "table_quadrilinear",
    "residual_matrix",
    "anisotropic_lobe",
    "product_error",
    "cross_2d",
    "accurate_difference",
    "accurate_dot",
    "plane_view",
    "planar_edge",
    "edge_angle",
    "cosine_light",
    "next_crossing",
    "sliver_area",
    "form_factor_bound",
}
THROUGH_PROBE = "a stage of the integral, tested whole by test_probe.py"
THROUGH_CURVES = "a stage of the integral along curves, tested whole by test_curves.py"
THROUGH_ADAPTIVE = "a stage of the published methods, tested whole by test_adaptive.py"
THROUGH_PICTURES = "a stage of what lobes see of pictures, tested whole by test_pictures.py"
GPU_ONLY = {
    "cosine_plane": THROUGH_PICTURES,
    "cosine_footprint": THROUGH_PICTURES,
    "squared_distance": THROUGH_PICTURES,
    "nearest_place": THROUGH_PICTURES,
    "footprint_on_light": THROUGH_PICTURES,
    "cosine_density": THROUGH_PICTURES,
    "fetched_picture": THROUGH_PICTURES,
    "picture_average": THROUGH_PICTURES,
    "picture_look": THROUGH_PICTURES,
    "seen_pictures": THROUGH_PICTURES,
    "point_at": THROUGH_ADAPTIVE,
    "chord_angle": THROUGH_ADAPTIVE,
    "azimuth_turn": THROUGH_ADAPTIVE,
    "chord_sum": THROUGH_ADAPTIVE,
    "specular_triangle": THROUGH_ADAPTIVE,
    "add_divided_curve": THROUGH_ADAPTIVE,
    "power_curve": THROUGH_CURVES,
    "curve_point": THROUGH_CURVES,
    "curve_way": THROUGH_CURVES,
    "bernstein": THROUGH_CURVES,
    "curve_node": THROUGH_CURVES,
    "curve_form": THROUGH_CURVES,
    "nearest_pole": THROUGH_CURVES,
    "pole_ellipse": THROUGH_CURVES,
    "node_pair": THROUGH_CURVES,
    "panels_of": THROUGH_CURVES,
    "has_panel": THROUGH_CURVES,
    "panel_middle": THROUGH_CURVES,
    "halve_panel": THROUGH_CURVES,
    "next_panel": THROUGH_CURVES,
    "panel_curve": THROUGH_CURVES,
    "add_accurately": THROUGH_CURVES,
    "accurate_place": THROUGH_CURVES,
    "horizon_place": THROUGH_CURVES,
    "curve_integral": THROUGH_CURVES,
    "add_curve": THROUGH_CURVES,
    "lobe_density": THROUGH_CURVES,
    "sliver_of": THROUGH_CURVES,
    "is_chord_enough": THROUGH_CURVES,
    "add_part": THROUGH_CURVES,
    "contour_node": THROUGH_CURVES,
    "node_chord": THROUGH_CURVES,
    "contour_part": THROUGH_CURVES,
    "extent_bound": "a stage of form_factor_bound, tested with it",
    "density_bound": "a stage of form_factor_bound, tested with it",
    "way_to_rectangle": "from a texel, tested by test_culling.py",
    "closing_edge": THROUGH_PROBE,
    "meet_horizon": THROUGH_PROBE,
    "height_of": THROUGH_PROBE,
    "clip_edge": THROUGH_PROBE,
    "pinned_weight": THROUGH_PROBE,
    "pinned_edge": THROUGH_PROBE,
    "add_edge": THROUGH_PROBE,
    "edge_plane": THROUGH_PROBE,
    "near_light": THROUGH_PROBE,
    "add_near_edge": THROUGH_CURVES,
    "form_factor": THROUGH_PROBE,
    "contour_start": THROUGH_PROBE,
    "contour_ends": THROUGH_PROBE,
    "contour_edge": THROUGH_PROBE,
    "light_form_factor": THROUGH_PROBE,
    "light_form_factors": THROUGH_CURVES,
    "form_factors_at": THROUGH_PROBE,
    "shows_nothing": THROUGH_PROBE,
    "is_unseen": THROUGH_PROBE,
    "light_winding": THROUGH_PROBE,
    "surface_point": THROUGH_PROBE,
    "specular_lobe": THROUGH_PROBE,
    "probe_lights": THROUGH_PROBE,
    "shade_lights": "the probe's sum weighted by a material, tested by test_renderer.py",
}


def test_every_function_is_listed():
    found = set()
    for path in resource_path("shaders", "ltc").glob("*.glsl"):
        text = re.sub(r"//[^\n]*|^\s*#[^\n]*", "", path.read_text(encoding="utf-8"), flags=re.M)
        found |= set(re.findall(r"^\w+ (\w+)\(", text, flags=re.M))
    assert found == TWINS | set(GPU_ONLY)
    assert not TWINS & set(GPU_ONLY)


@pytest.fixture
def glsl(ctx, tmp_path):
    def run(include, body, inputs, **keywords):
        keywords.setdefault("prelude", NO_LIGHTS)
        includes = [include] if isinstance(include, str) else include
        return evaluate(ctx, tmp_path, includes, body, inputs, FEATURES, **keywords)

    return run


def f32(values):
    """Rounded to what the GPU gets, in float64."""
    return np.asarray(values, dtype=np.float32).astype(np.float64)


def alphas_and_cosines(rng):
    alpha = f32(np.exp(rng.uniform(np.log(1e-4), 0.0, COUNT)))
    theta = np.radians(np.where(rng.uniform(size=COUNT) < 0.5, rng.uniform(0, 90, COUNT),
                                90 - 10 ** rng.uniform(-2, 1.9, COUNT)))  # fmt: skip
    return alpha, f32(np.sin(theta)), f32(np.cos(theta))


def test_table_coordinates(glsl):
    alpha, _, c = alphas_and_cosines(np.random.default_rng(0))
    got = glsl(
        "ltc/table.glsl", "result.xy = table_coordinates(alpha, c);", {"alpha": alpha, "c": c}
    )
    want = np.stack(table.table_coordinates(alpha, c), axis=-1)
    np.testing.assert_allclose(got[:, :2], want, rtol=3e-7, atol=1e-7)


def test_table_bilinear_and_albedo_terms(glsl):
    alpha, s, c = alphas_and_cosines(np.random.default_rng(1))
    residual, albedo = isotropic_textures()
    body = """
        vec2 at = table_coordinates(alpha, c);
        float q = length(vec2(alpha * s, c));
        result = vec4(albedo_terms(table_bilinear(albedo, at).rg, q), 0.0, 0.0);
    """
    inputs = {"alpha": alpha, "s": s, "c": c}
    got = glsl("ltc/table.glsl", body, inputs, tables={"albedo": albedo})
    _, A, B = table.sample_textures((residual, albedo), alpha, c)
    np.testing.assert_allclose(got[:, 0], A, rtol=0, atol=1e-6)
    np.testing.assert_allclose(got[:, 1], B, rtol=0, atol=2e-6)


def lobes(rng):
    alpha, s, c = alphas_and_cosines(rng)
    residual, albedo = isotropic_textures()
    M, _, _ = table.sample_textures((residual, albedo), alpha, c)
    inverse = np.linalg.inv(M)
    inverse *= alpha[:, None, None]  # as the shader scales it, up to |M's third column|
    return alpha, s, c, residual, M, inverse


LOBE = """
    vec2 at = table_coordinates(alpha, c);
    IsotropicLobe lobe = isotropic_lobe(alpha, s, c, table_bilinear(residual, at));
"""


def test_isotropic_lobe(ctx, tmp_path):
    alpha, s, c, residual, M, inverse = lobes(np.random.default_rng(2))
    inputs = {"alpha": alpha, "s": s, "c": c}

    def run(result):
        return evaluate(
            ctx, tmp_path, ["ltc/table.glsl", "ltc/lobe.glsl"], f"{LOBE} result = {result};",
            inputs, FEATURES, {"residual": residual}, NO_LIGHTS,
        )  # fmt: skip

    rows = run("vec4(lobe.row0, lobe.row2)")
    rest = run("vec4(lobe.row1, lobe.det, lobe.above, 0.0)")
    # Both are free up to a factor: compare relative to the middle entry.
    scale = rest[:, 0] / inverse[:, 1, 1]
    want = np.stack(
        [inverse[:, 0, 0], inverse[:, 0, 2], inverse[:, 2, 0], inverse[:, 2, 2]], axis=-1
    )
    want *= scale[:, None]
    size = np.abs(rows).max(axis=1)
    assert np.abs(rows - want).max(axis=1).max() <= 1e-5 * size.max()
    # The first row sets where the lobe points: its direction matters most.
    turn = rows[:, 0] * want[:, 1] - rows[:, 1] * want[:, 0]
    turn /= np.hypot(rows[:, 0], rows[:, 1]) * np.hypot(want[:, 0], want[:, 1])
    # c alone, rounded, says the view's angle to 6e-8 / s; the shader has s beside it.
    away = s > 0.1
    assert np.percentile(np.abs(turn[away]), 99) <= 1e-6
    assert np.abs(turn).max() <= 6e-8 / s.min()
    det = rows[:, 0] * rows[:, 3] - rows[:, 1] * rows[:, 2]
    assert np.all(rest[:, 1] > 0.0)
    rough = alpha > 0.1  # below, the difference itself cancels: that is what `det` is for
    np.testing.assert_allclose(rest[rough, 1], det[rough], rtol=2e-4)
    np.testing.assert_allclose(rest[:, 2], 1.0 - transform.leak(M), atol=1e-6)


def test_cosine_transform_normals_are_cofactors(glsl):
    """(K p) x (K q) = normals (p x q), up to a positive factor."""
    rng = np.random.default_rng(3)
    alpha, s, c = alphas_and_cosines(rng)
    rough = alpha > 0.05
    inputs = {"alpha": alpha[rough], "s": s[rough], "c": c[rough],
              "p": rng.normal(size=(COUNT, 3))[rough], "q": rng.normal(size=(COUNT, 3))[rough],
              "r": rng.normal(size=(COUNT, 4))[rough]}  # fmt: skip
    body = """
        IsotropicLobe lobe = isotropic_lobe(alpha, s, c, 0.1 * r / (1.0 + abs(r)));
        vec3 n = normalize(r.xyz);
        ViewFrame frame = view_aligned_frame(n, normalize(r.yzw + vec3(0.1)));
        CosineTransform t = cosine_transform(lobe, frame.world_from_shading);
        vec3 a = cross(t.points * p, t.points * q);
        vec3 b = t.normals * cross(p, q);
        result = vec4(a / length(a) - b / length(b), 0.0);
    """
    got = glsl(["common/frame.glsl", "ltc/lobe.glsl"], body, inputs)
    assert np.abs(got).max() <= 2e-4
    assert np.percentile(np.abs(got), 99) <= 1e-5


def test_positive_atan2(glsl):
    rng = np.random.default_rng(4)
    y = f32(10 ** rng.uniform(-12, 6, COUNT))
    x = f32(10 ** rng.uniform(-12, 6, COUNT) * rng.choice([-1, 1], COUNT))
    y[:3], x[:3] = [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]
    got = glsl("common/atan2.glsl", "result.x = positive_atan2(y, x);", {"x": x, "y": y})[:, 0]
    np.testing.assert_allclose(got, np.arctan2(y, x), rtol=4e-7)


def near_parallel(rng):
    a = f32(rng.normal(size=(COUNT, 2)))
    return a, f32(a * rng.normal(size=(COUNT, 1)) + 1e-5 * rng.normal(size=(COUNT, 2)))


def test_product_error(glsl):
    rng = np.random.default_rng(5)
    a, b = f32(rng.normal(size=COUNT)), f32(rng.normal(size=COUNT))
    body = "precise float p = a * b; result.x = product_error(a, b, p); result.y = p;"
    got = glsl("ltc/polygon.glsl", body, {"a": a, "b": b})
    np.testing.assert_array_equal(got[:, 0] + got[:, 1], a * b)


def test_cross_2d(glsl):
    a, b = near_parallel(np.random.default_rng(6))
    got = glsl("ltc/polygon.glsl", "result.x = cross_2d(a, b);", {"a": a, "b": b})[:, 0]
    want = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    np.testing.assert_allclose(got, want, rtol=3e-7, atol=1e-14)


def test_accurate_difference(glsl):
    rng = np.random.default_rng(7)
    x = rng.normal(size=(COUNT, 2))
    y = x * (1.0 + 1e-6 * rng.normal(size=(COUNT, 2)))
    x_high, y_high = f32(x), f32(y)
    inputs = {"x": np.hstack([x_high, x - x_high]), "y": np.hstack([y_high, y - y_high])}
    body = """
        vec2 low;
        result.xy = accurate_difference(x.xy, x.zw, y.xy, y.zw, low);
        result.zw = low;
    """
    got = glsl("ltc/polygon.glsl", body, inputs)
    np.testing.assert_allclose(got[:, :2] + got[:, 2:], x - y, rtol=0, atol=1e-13)


def test_accurate_dot(glsl):
    rng = np.random.default_rng(8)
    a, b = rng.normal(size=(2, COUNT, 3))
    a -= b * (np.sum(a * b, axis=1) / np.sum(b * b, axis=1))[:, None] * (1.0 - 1e-6)
    a_high, b_high = f32(a), f32(b)
    inputs = {"a": a_high, "a_low": a - a_high, "b": b_high, "b_low": b - b_high}
    got = glsl("ltc/polygon.glsl", "result.xy = accurate_dot(a, a_low, b, b_low);", inputs)
    want = np.sum(a * b, axis=1)
    # Nearly orthogonal by design: results near 1e-6 keep seven digits.
    np.testing.assert_allclose(got[:, 0] + got[:, 1], want, rtol=0, atol=3e-13)


def test_light_header_and_plane_view(glsl):
    """A header packed by numpy, read by GLSL: the foot to 1e-12, a metre away."""
    rng = np.random.default_rng(9)
    basis = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    if np.linalg.det(basis) < 0:
        basis[2] *= -1
    u, v, n = basis
    origin = rng.normal(size=3)
    header = np.zeros(1, dtype=LIGHT_HEADER)[0]
    for name, vector in (("origin", origin), ("u", u), ("v", v), ("n", n)):
        header[name] = vector
        header[f"{name}_low"] = vector - header[name].astype(np.float64)
    header["radius"], header["part_count"], header["first_part"] = 2.0, 5.0, 8.0
    texels = np.array([header]).view(np.float32).reshape(-1, 4)
    prelude = (
        "vec4 light_texel(int index) { const vec4 t[8] = vec4[]("
        + ", ".join(f"vec4({', '.join(f'{float(x):.9e}' for x in row)})" for row in texels)
        + "); return t[index]; }"
    )
    position = f32(rng.normal(size=(COUNT, 3)))
    body = """
        PlaneView view = plane_view(light_at(0), position);
        result = vec4(view.foot + view.foot_low * 0.0, view.foot_low);
    """
    got = glsl("ltc/polygon.glsl", body, {"position": position}, prelude=prelude)
    want = (position - origin) @ basis[:2].T
    np.testing.assert_allclose(got[:, :2] + got[:, 2:], want, rtol=0, atol=1e-12)
    body = "result.x = plane_view(light_at(0), position).depth; result.y = light_at(0).radius;"
    got = glsl("ltc/polygon.glsl", body, {"position": position}, prelude=prelude)
    np.testing.assert_allclose(got[:, 0], (origin - position) @ n, rtol=2e-7, atol=1e-12)
    assert np.all(got[:, 1] == 2.0)


def test_planar_edge_moment(glsl):
    """The moment of an edge that passes 1e-6 from the anchor, its ends a metre away."""
    rng = np.random.default_rng(10)
    direction = rng.normal(size=(COUNT, 2))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    normal = np.stack([-direction[:, 1], direction[:, 0]], axis=-1)
    anchor = rng.normal(size=(COUNT, 2))
    middle = anchor + 1e-6 * rng.uniform(0.5, 1.0, (COUNT, 1)) * normal
    corners = np.hstack([middle - direction, middle + direction])
    high, anchor_high = f32(corners), f32(anchor)
    inputs = {"high": high, "low": corners - high,
              "anchor": np.hstack([anchor_high, anchor - anchor_high])}  # fmt: skip
    body = "result.x = planar_edge(high, low, anchor.xy, anchor.zw).moment;"
    got = glsl("ltc/polygon.glsl", body, inputs)[:, 0]
    a, d = corners[:, :2] - anchor, corners[:, 2:] - corners[:, :2]
    np.testing.assert_allclose(got, a[:, 0] * d[:, 1] - a[:, 1] * d[:, 0], rtol=1e-6)


def test_edge_angle_sums_to_the_form_factor(glsl):
    """Triangles anywhere about the horizon, against the clipped polygon in float64."""
    rng = np.random.default_rng(11)
    a, b, c = f32(rng.normal(size=(3, COUNT, 3)))
    # Azimuths replace what is below the horizon: a triangle over the nadir counts 1 more.
    inside = np.linalg.solve(
        np.stack([a, b, c], axis=-1), np.broadcast_to([[0.0], [0.0], [-1.0]], (COUNT, 3, 1))
    )
    nadir = np.all(inside[..., 0] > 0, axis=1)
    body = """
        result.x = edge_angle(a, b, cross(a, b)) + edge_angle(b, c, cross(b, c)) +
                   edge_angle(c, a, cross(c, a));
    """
    got = glsl("ltc/polygon.glsl", body, {"a": a, "b": b, "c": c})[:, 0] / (2.0 * np.pi)
    want = clipped_form_factor(np.stack([a, b, c], axis=-2))
    keep = ~nadir
    np.testing.assert_allclose(got[keep], want[keep], rtol=0, atol=3e-6)


def test_cosine_light_pins_small_lights(glsl):
    rng = np.random.default_rng(12)
    distance = 10 ** rng.uniform(-1, 3, COUNT)
    body = """
        PlanarLight light;
        light.u = vec3(1.0, 0.0, 0.0);
        light.v = vec3(0.0, 1.0, 0.0);
        light.n = vec3(0.0, 0.0, 1.0);
        light.radius = 1.0;
        PlaneView view = PlaneView(vec3(0.0, 0.0, d), vec2(0.0), vec2(0.0), d);
        result.x = cosine_light(CosineTransform(mat3(1.0), mat3(1.0)), light, view).pin;
    """
    got = glsl("ltc/polygon.glsl", body, {"d": distance})[:, 0]
    far = f32(distance) > np.sqrt(2.0 / 0.01)
    np.testing.assert_allclose(got[far], 1.0 / f32(distance)[far] ** 2, rtol=1e-6)
    assert not got[~far].any()


def test_form_factor_bound(glsl):
    """Never below the definition, which is certified; above by what it allows for rounding."""
    rng = np.random.default_rng(14)
    middle = rng.normal(size=(COUNT, 3)) * np.exp(rng.uniform(-2.0, 3.0, COUNT))[:, None]
    u = rng.normal(size=(COUNT, 3))
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    v = np.cross(u, rng.normal(size=(COUNT, 3)))
    v /= np.linalg.norm(v, axis=1, keepdims=True)
    half = np.exp(rng.uniform(np.log(0.01), np.log(3.0), (COUNT, 2)))
    alpha, _, cosine = alphas_and_cosines(rng)
    inverse = transform.invert(table.load_isotropic().matrix(alpha, cosine))
    inverse /= np.abs(inverse).max(axis=(1, 2), keepdims=True)
    inputs = {"middle": f32(middle), "u": f32(u), "v": f32(v), "half_sides": f32(half)}
    inputs |= {f"row{i}": f32(inverse[:, i]) for i in range(3)}
    body = """
        PlanarLight light;
        light.u = u;
        light.v = v;
        light.n = cross(u, v);
        mat3 points = transpose(mat3(row0, row1, row2));
        mat3 normals = transpose(mat3(cross(row1, row2), cross(row2, row0), cross(row0, row1)));
        result.x = form_factor_bound(CosineTransform(points, normals), light, middle, half_sides);
    """
    got = glsl("ltc/bound.glsl", body, inputs)[:, 0]
    matrix = np.stack([inputs[f"row{i}"] for i in range(3)], axis=1)
    axes = inputs["half_sides"][:, :1] * inputs["u"], inputs["half_sides"][:, 1:] * inputs["v"]
    want = form_factor_bound(
        *(np.einsum("nij,nj->ni", matrix, w) for w in (inputs["middle"], *axes))
    )
    # Products of rounded terms in float32: a few units of 6e-8 each.
    assert np.all(got >= want * (1.0 - 2e-5) - 1e-12)
    close = np.isclose(got, want, rtol=1e-3, atol=1e-9)
    # The others are around the axis within rounding of an alpha of 1e-4's width.
    assert close.mean() > 0.99


def test_view_aligned_frame(glsl):
    """Orthonormal, right-handed, the view at x >= 0; also along and below the normal."""
    rng = np.random.default_rng(13)
    n = rng.normal(size=(COUNT, 3))
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    side = np.cross(n, rng.normal(size=(COUNT, 3)))
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    theta = 10 ** rng.uniform(-9, np.log10(2.0), COUNT)  # up to 115 degrees
    theta[:8] = 0.0
    wo = np.cos(theta)[:, None] * n + np.sin(theta)[:, None] * side
    inputs = {"n": f32(n), "wo": f32(wo)}
    columns = [
        glsl("common/frame.glsl", f"result.xyz = view_aligned_frame(n, wo).{what};", inputs)[:, :3]
        for what in ("world_from_shading[0]", "world_from_shading[1]", "world_from_shading[2]")
    ]
    x, y, z = columns
    np.testing.assert_array_equal(z, f32(n))
    np.testing.assert_allclose(np.cross(z, x), y, atol=3e-7)
    for a, b in ((x, y), (y, z), (z, x)):
        np.testing.assert_allclose(np.sum(a * b, axis=1), 0.0, atol=3e-7)
    np.testing.assert_allclose(np.linalg.norm(x, axis=1), 1.0, atol=3e-7)
    away = theta > 1e-4
    np.testing.assert_allclose(x[away], side[away], atol=2e-3)
    np.testing.assert_allclose(x[theta > 0.01], side[theta > 0.01], atol=2e-5)
    angles = glsl(
        "common/frame.glsl",
        "ViewFrame f = view_aligned_frame(n, wo); result.xy = vec2(f.sin_theta, f.cos_theta);",
        inputs,
    )
    np.testing.assert_allclose(angles[:, 0], np.sin(theta), atol=3e-7)
    np.testing.assert_allclose(angles[:, 1], np.maximum(np.cos(theta), 0.0), atol=3e-7)


def test_next_crossing(glsl):
    """All sign changes of cubics, one after another, ends at zero and straight lines included."""
    rng = np.random.default_rng(21)
    z = rng.normal(size=(COUNT, 4))
    z[: COUNT // 8] = np.linspace(z[: COUNT // 8, 0], z[: COUNT // 8, 3], 4).T
    z[COUNT // 8 : COUNT // 4, 0] = 0.0
    z[COUNT // 4 : COUNT // 3, 3] *= 1e-8
    z = f32(z)
    body = """
        bool above = z.x > 0.0;
        float one = next_crossing(z, 0.0, 1.0, above);
        float two = one < 1.0 ? next_crossing(z, one, 1.0, !above) : 1.0;
        float three = two < 1.0 ? next_crossing(z, two, 1.0, above) : 1.0;
        result = vec4(one, two, three, 0.0);
    """
    got = glsl("ltc/curve.glsl", body, {"z": z})[:, :3]
    _, count = sign_changes(z)
    assert np.array_equal((got < 1.0).sum(axis=1), count)
    # Where a cubic is flat its root is known no better than its values, to 1e-6.
    s = 1.0 - got
    value = ((z[:, :1] * s + 3 * z[:, 1:2] * got) * s + 3 * z[:, 2:3] * got**2) * s
    value += z[:, 3:] * got**3
    assert np.abs(value[got < 1.0]).max() <= 2e-6


def test_sliver_area(glsl):
    rng = np.random.default_rng(22)
    handles, d = f32(rng.normal(size=(COUNT, 4))), f32(rng.normal(size=(COUNT, 2)))
    zero = np.zeros_like(d)
    curves = np.stack([zero, handles[:, :2], d + handles[:, 2:], d], axis=1)
    got = glsl("ltc/tree.glsl", "result.x = sliver_area(handles, d);",
               {"handles": handles, "d": d})[:, 0]  # fmt: skip
    np.testing.assert_allclose(got, signed_areas(curves), atol=3e-6)
