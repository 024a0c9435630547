"""The anisotropic table on the GPU: its functions, whole integrals, seams and extremes.

`ltc.anisotropic.AnisotropicTable` is the definition, `ltc.polygon.ltc_specular` what the probe
returns for it. The probe gets tangents and both alphas at every point.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from app.outline import resolve
from app.render.features import Limits
from app.render.plan import needs_of
from app.render.tables import anisotropic_azimuths, anisotropic_textures
from app.scene import (
    AreaLight,
    Material,
    Outline,
    Plane,
    PolygonContour,
    RenderSettings,
    Scene,
    SceneObject,
)
from ltc import transform
from ltc.anisotropic import entry_basis, interpolate, load_anisotropic, table_coordinates
from ltc.polygon import loops_form_factor, ltc_specular, positive_winding
from tests.gl.evaluate import evaluate

FloatArray = NDArray[np.float64]
OFF = (
    "COUNTS_EVALUATIONS", "HAS_EXACT_FMA", "HAS_ONE_SIDED", "HAS_PICTURES", "HAS_TWO_SIDED",
)  # fmt: skip
COUNT = 2000
SEAMS = np.radians([0.0, 90.0, 180.0, 270.0])


def f32(values: FloatArray) -> FloatArray:
    """Rounded to what the GPU gets, in float64."""
    return np.asarray(values, dtype=np.float32).astype(np.float64)


def unit(v: FloatArray) -> FloatArray:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def views(theta: FloatArray, phi: FloatArray) -> FloatArray:
    s = np.sin(theta)
    return np.stack([s * np.cos(phi), s * np.sin(phi), np.cos(theta)], axis=-1)


def random_lobes(rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Return alphas (n, 2) and unit views (n, 3), many of them at seams."""
    alpha = 10.0 ** rng.uniform(-4.0, 0.0, (COUNT, 2))
    alpha[:100, 1] = alpha[:100, 0]
    theta = np.radians(rng.uniform(0.0, 89.9, COUNT))
    theta[100:120] = 0.0
    phi = rng.uniform(-np.pi, np.pi, COUNT)
    phi[200:400] = np.repeat(SEAMS, 50)
    return f32(alpha), f32(views(theta, phi))


class TestTwins:
    @pytest.fixture
    def glsl(self, ctx, tmp_path):
        def run(body, inputs, **keywords):
            includes = ["ltc/anisotropic.glsl"]
            prelude = "vec4 light_texel(int index) { return vec4(0.0); }"
            features = dict.fromkeys(OFF, 0)
            return evaluate(ctx, tmp_path, includes, body, inputs, features, None, prelude,
                            **keywords)  # fmt: skip

        return run

    def test_coordinates(self, glsl):
        alpha, v = random_lobes(np.random.default_rng(0))
        got = glsl("result = anisotropic_coordinates(alpha, v);", {"alpha": alpha, "v": v})
        want = table_coordinates(alpha[:, 0], alpha[:, 1], v)
        # Two half-units of rounding in the direction (1 - cos theta is not stored) at grazing.
        np.testing.assert_allclose(got, want, rtol=0, atol=2e-6)

    def test_lookup(self, glsl):
        """To float32, where samplers have such weights: software rasterisers do."""
        rng = np.random.default_rng(1)
        t = f32(rng.uniform(0.0, 1.0, (COUNT, 4)))
        t[:32] = rng.integers(0, 2, (32, 4))
        table = load_anisotropic()
        first, second, albedo = anisotropic_textures()
        for texels, values, azimuths in (
            (first, table.residual[..., :4], anisotropic_azimuths()[0]),
            (second, table.residual[..., 4:], anisotropic_azimuths()[0]),
            (albedo, np.stack([table.albedo, table.fresnel], -1), anisotropic_azimuths()[1]),
        ):
            body = f"result = table_quadrilinear(table, {azimuths}, t);"
            got = glsl(body, {"t": t}, layers={"table": texels})
            want = interpolate(values, t)
            np.testing.assert_allclose(got[:, : want.shape[1]], want, rtol=0, atol=1e-6)

    def test_residual(self, glsl):
        rng = np.random.default_rng(2)
        alpha, v = random_lobes(rng)
        numbers = f32(rng.normal(size=(COUNT, 7)))
        want = np.eye(3) + np.einsum("np,npij->nij", numbers, entry_basis(*alpha.T, v))
        inputs = {"alpha": alpha, "v": v, "a": numbers[:, :4],
                  "b": np.pad(numbers[:, 4:], ((0, 0), (0, 1)))}  # fmt: skip
        for column in range(3):
            body = f"result.xyz = residual_matrix(alpha, v, a, b)[{column}];"
            got = glsl(body, inputs)[:, :3]
            np.testing.assert_allclose(got, want[:, :, column], rtol=0, atol=2e-6)

    def test_lobe(self, glsl):
        """points M is a multiple of the identity, normals its cofactors, above as in Python."""
        alpha, v = random_lobes(np.random.default_rng(3))
        v = unit(v)
        table = load_anisotropic()
        M = table.matrix_of_view(*alpha.T, v)
        X = np.einsum(
            "np,npij->nij", interpolate(table.residual, table_coordinates(*alpha.T, v)),
            entry_basis(*alpha.T, v),
        )  # fmt: skip
        inputs = {"alpha": alpha, "v": v} | {f"x{i}": X[:, :, i] for i in range(3)}
        lobe = """
            AnisotropicLobe lobe = anisotropic_lobe(
                alpha, v, mat3(x0 + vec3(1.0, 0.0, 0.0), x1 + vec3(0.0, 1.0, 0.0),
                               x2 + vec3(0.0, 0.0, 1.0)));
        """
        points, normals = (
            np.stack(
                [glsl(f"{lobe} result.xyz = lobe.{name}[{i}];", inputs)[:, :3] for i in range(3)],
                axis=-1,
            )
            for name in ("points", "normals")
        )
        above = glsl(f"{lobe} result.x = lobe.above;", inputs)[:, 0]
        np.testing.assert_allclose(above, 1.0 - transform.leak(M), atol=3e-6)
        product = points @ M
        scale = np.trace(product, axis1=1, axis2=2) / 3.0
        assert np.all(scale > 0.0)
        away = np.abs(product / scale[:, None, None] - np.eye(3)).max(axis=(1, 2))
        # A rounded view turns the lobe by 6e-8, which it feels times its steepness: as thin as
        # alpha v_z at grazing.
        sharp = alpha.min(axis=1)
        assert np.median(away * sharp) < 1e-7
        assert np.max(away * sharp * v[:, 2]) < 2e-6
        # Cofactors, each row on its own: rows of M transposed differ by up to 1/alpha.
        want = np.linalg.det(points)[:, None, None] * np.linalg.inv(points).swapaxes(1, 2)
        rough = (sharp > 0.05) & (v[:, 2] > 0.1)  # where inverting points keeps digits
        size = np.linalg.norm(want, axis=2, keepdims=True)
        assert np.max((np.abs(normals - want) / size)[rough]) < 1e-4


def random_light(rng: np.random.Generator) -> AreaLight:
    """Return a star-shaped polygon of 3 to 8 corners in a skew plane through the origin."""
    n = int(rng.integers(3, 9))
    angle, radius = np.sort(rng.uniform(0.0, 2.0 * np.pi, n)), rng.uniform(0.3, 1.0, n)
    corners = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0].T
    return AreaLight(
        "l",
        Outline((PolygonContour(tuple((float(x), float(y)) for x, y in corners)),)),
        Plane((0.0, 0.0, 0.0), tuple(axes[0].tolist()), tuple(axes[1].tolist())),
        (1.0, 1.0, 1.0),
    )


def aimed_points(rng: np.random.Generator, lamp: AreaLight, count: int) -> dict[str, FloatArray]:
    """Return points whose lobes, about, point at the light: tangents and alphas at random."""
    u, v = np.array(lamp.plane.u), np.array(lamp.plane.v)
    away = np.cross(u, v) * np.exp(rng.uniform(np.log(0.05), np.log(20.0), (count, 1)))
    position = away + 1.5 * rng.normal(size=(count, 3))
    spot = 0.6 * rng.normal(size=(count, 2)) @ np.stack([u, v])
    way = unit(spot - position)
    theta = np.radians(rng.uniform(0.0, 89.5, count))[:, None]
    normal = unit(np.cos(theta) * way + np.sin(theta) * unit(np.cross(way, rng.normal(size=3))))
    view = 2.0 * np.sum(normal * way, axis=-1, keepdims=True) * normal - way
    points = {
        "position": position,
        "normal": normal,
        "tangent": unit(np.cross(normal, rng.normal(size=(count, 3)))),
        "view": view,
        "alpha": np.exp(rng.uniform(np.log(1e-3), 0.0, (count, 2))),
    }
    return {name: f32(values) for name, values in points.items()}


def defined(lamp: AreaLight, points: dict[str, FloatArray]) -> tuple[FloatArray, FloatArray]:
    """Return (specular, diffuse), each (n,), in float64."""
    p, n, tangent, wo = (points[k] for k in ("position", "normal", "tangent", "view"))
    n, wo = unit(n), unit(wo)
    x = unit(tangent - n * np.sum(n * tangent, axis=-1, keepdims=True))
    frame = np.stack([x, np.cross(n, x), n], axis=-2)
    origin, u, v = (np.array(a) for a in (lamp.plane.origin, lamp.plane.u, lamp.plane.v))
    loops = [
        (positive_winding(origin + loop[:, :1] * u + loop[:, 1:] * v) - p[:, None])
        @ np.swapaxes(frame, -1, -2)
        for loop in resolve(lamp.outline)
    ]
    local = np.einsum("nij,nj->ni", frame, wo)
    table = load_anisotropic()
    M = table.matrix_of_view(*points["alpha"].T, local)
    A, _ = table.albedo_terms_of_view(*points["alpha"].T, local)
    front = np.sum(np.cross(u, v) * (p - origin), axis=-1) > 0.0
    return (
        np.where(front, np.maximum(ltc_specular(M, loops, A), 0.0), 0.0),
        np.where(front, np.maximum(loops_form_factor(loops), 0.0), 0.0),
    )


class TestProbe:
    def test_random_lights(self, renderer):
        """Observed over 40,000 points: 99.9 % below 5e-6, largest 2.7e-5."""
        rng = np.random.default_rng(4)
        errors = []
        for _ in range(12):
            lamp = random_light(rng)
            points = aimed_points(rng, lamp, 500)
            found = renderer.probe(Scene(lights=(lamp,)), RenderSettings("ltc"), **points)
            specular, diffuse = defined(lamp, points)
            assert np.all(np.isfinite(found["specular"]))
            errors.append(np.abs(found["specular"][:, 0] - specular))
            assert np.abs(found["diffuse"][:, 0] - diffuse).max() <= 1e-5
        assert np.max(errors) <= 1e-4
        assert np.quantile(errors, 0.99) <= 1e-5

    def test_seams_are_seamless(self, renderer):
        """Steps across quadrants, the swap of alphas and the normal, views 1e-6 apart."""
        rng = np.random.default_rng(5)
        lamp = random_light(rng)
        count, step = 4000, 1e-6
        points = aimed_points(rng, lamp, count)
        larger = points["alpha"].max(axis=1)
        smaller = larger * np.exp(rng.uniform(np.log(0.01), 0.0, count))
        normal, tangent = unit(points["normal"]), points["tangent"]
        tangent = unit(tangent - normal * np.sum(normal * tangent, axis=-1, keepdims=True))
        bitangent = np.cross(normal, tangent)
        theta = np.radians(rng.uniform(0.0, 89.5, count))
        phi = rng.choice(SEAMS, count)
        turned = rng.uniform(0.0, 2.0 * np.pi, count)

        def shade(theta, phi, alpha):
            local = views(theta, phi)
            axes = (tangent, bitangent, normal)
            view = sum(c[:, None] * axis for c, axis in zip(local.T, axes, strict=True))
            at = points | {"tangent": tangent, "view": view, "alpha": alpha}
            found = renderer.probe(
                Scene(lights=(lamp,)), RenderSettings("ltc"), anisotropic=True, **at
            )
            return found["specular"][:, 0].astype(np.float64)

        alphas = np.stack([larger, smaller], axis=-1)
        equal = np.stack([larger, larger], axis=-1)
        unequal = np.stack([larger, larger * (1.0 - step)], axis=-1)
        rough = larger > 0.01  # a lobe moves by step / alpha of its width
        for one, other in (
            ((theta, phi - step, alphas), (theta, phi + step, alphas)),
            ((theta, phi - step, alphas[:, ::-1]), (theta, phi + step, alphas[:, ::-1])),
            ((theta, turned, unequal), (theta, turned, unequal[:, ::-1])),
            ((theta, turned, unequal), (theta, turned, equal)),
            ((0.0 * theta, turned, alphas), (0.0 * theta + step, turned, alphas)),
        ):
            jump = np.abs(shade(*one) - shade(*other))[rough & (smaller > 0.01)]
            assert np.max(jump) <= 1e-4

    def test_extremes_are_finite_and_bounded(self, renderer):
        lamp = random_light(np.random.default_rng(6))
        larger, ratio, theta, phi = (
            a.ravel()
            for a in np.meshgrid(
                [1e-3, 0.03, 0.3, 1.0],
                [0.01, 0.1, 1.0],
                np.radians([0.0, 1e-4, 45.0, 89.5, 90.0]),
                np.append(SEAMS, [0.3, 2.0]),
            )
        )
        count = len(larger)
        ones = np.ones((count, 1))
        for position in ([0.0, 0.0, 1.0], [0.0, 0.0, 1e-3], [3.0, 0.0, 1e-4]):
            axes = np.stack([lamp.plane.u, lamp.plane.v, np.cross(lamp.plane.u, lamp.plane.v)])
            alpha = np.stack([larger, np.maximum(larger * ratio, 1e-4)], axis=-1)
            for alphas in (alpha, alpha[:, ::-1]):
                found = renderer.probe(
                    Scene(lights=(lamp,)), RenderSettings("ltc"), ones * (position @ axes),
                    ones * -axes[2], ones * axes[0], views(theta, phi) @ (axes * [[1], [1], [-1]]),
                    alphas, anisotropic=True,
                )["specular"]  # fmt: skip
                assert np.all(np.isfinite(found))
                assert np.all((found >= 0.0) & (found <= 1.0 + 1e-6))


class TestLeavingOut:
    def scene(self, *alphas: tuple[float, float], f0: float = 0.5) -> Scene:
        names = [f"m{i}" for i in range(len(alphas))]
        return Scene(
            materials=tuple(
                Material(name, f0=(f0,) * 3, alpha=alpha)
                for name, alpha in zip(names, alphas, strict=True)
            ),
            objects=tuple(SceneObject(name, "sphere", name) for name in names),
            lights=(random_light(np.random.default_rng(7)),),
        )

    @pytest.mark.parametrize("technique", ["ltc", "ltc:2", "uniform:30", "adaptive"])
    def test_isotropic_scenes_have_nothing_of_it(self, technique):
        needs = needs_of(self.scene((0.1, 0.1), (0.5, 0.5)), 1, Limits(), technique)
        assert not needs.lighting.tangents
        assert "tangents" not in dict(needs.attachments)
        (program,) = (spec for spec in needs.programs if spec.name == "lighting")
        assert dict(program.features)["TAKES_TANGENT"] == 0

    @pytest.mark.parametrize("technique", ["ltc", "uniform:30"])
    def test_one_anisotropic_material_brings_it(self, technique):
        needs = needs_of(self.scene((0.1, 0.1), (0.5, 0.2)), 1, Limits(), technique)
        assert needs.lighting.tangents
        assert "tangents" in dict(needs.attachments)

    def test_a_dull_one_does_not(self):
        needs = needs_of(self.scene((0.5, 0.2), f0=0.0), 1, Limits(), "ltc")
        assert not needs.lighting.tangents
