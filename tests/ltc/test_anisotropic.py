"""The anisotropic table: axes, symmetries, seams, what it refuses, its file."""

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from ltc import brdf, transform
from ltc.anisotropic import (
    AnisotropicTable,
    entry_basis,
    halfway_points,
    interpolate,
    load_anisotropic,
    multilinear,
    node_views,
    save_anisotropic,
    table_coordinates,
    tied,
    view_direction,
)
from ltc.anisotropic_fit import random_views
from ltc.polygon import ltc_specular
from ltc.resources import resource_path
from ltc.table import ALPHA_MIN, load_isotropic

FloatArray = NDArray[np.float64]
SEAMS = np.array([0.0, 0.5, 1.0, 1.5, 2.0]) * np.pi


@pytest.fixture(scope="module")
def shipped() -> AnisotropicTable:
    return load_anisotropic()


def _density(table: AnisotropicTable, ax: FloatArray, ay: FloatArray, v: FloatArray) -> FloatArray:
    """Return the lobe's density at fixed directions, (n, k)."""
    rng = np.random.default_rng(8)
    w = rng.normal(size=(40, 3))
    w /= np.linalg.norm(w, axis=-1, keepdims=True)
    return transform.evaluate(w, table.matrix_of_view(ax, ay, v)[:, None])


class TestAxes:
    def test_nodes_are_where_they_say(self) -> None:
        shape = (3, 4, 5, 6)
        a, b, v = node_views(shape)
        inner = (slice(None), slice(None), slice(1, None), slice(1, None))
        want = np.stack(
            np.meshgrid(*(np.linspace(0.0, 1.0, n) for n in shape), indexing="ij"), axis=-1
        )
        got = table_coordinates(a, b, v)[inner]
        np.testing.assert_allclose(got, want[inner], atol=1e-7)
        np.testing.assert_allclose(np.linalg.norm(v, axis=-1), 1.0)

    def test_stay_within_the_table(self) -> None:
        alpha = np.array([ALPHA_MIN, 1e-3, 0.3, 1.0])
        c = np.array([0.0, 1e-9, 0.5, 1.0 - 1e-12, 1.0])
        ax, ay, cosine, phi = np.meshgrid(alpha, alpha, c, np.append(SEAMS, 0.3))
        t = table_coordinates(ax, ay, view_direction(cosine, phi))
        assert np.all((t >= 0.0) & (t <= 1.0))

    def test_interpolation_is_exact_at_nodes_and_for_products(
        self, rng: np.random.Generator
    ) -> None:
        shape = (2, 3, 4, 5)
        values = rng.normal(size=(*shape, 2))
        points = halfway_points(shape)
        np.testing.assert_allclose(interpolate(values, points)[::2, ::2, ::2, ::2], values)
        t = rng.random((50, 4))
        index, weight = multilinear(t, shape)
        np.testing.assert_allclose(np.sum(weight, axis=-1), 1.0)
        axes = np.stack(np.meshgrid(*(np.linspace(0, 1, n) for n in shape), indexing="ij"), -1)
        np.testing.assert_allclose(
            np.sum(weight * np.prod(axes, axis=-1).ravel()[index], axis=-1), np.prod(t, axis=-1)
        )

    def test_textures_hold_what_the_docstring_says(self, shipped: AnisotropicTable) -> None:
        """Sampled as a GPU does, by texture coordinates, they give what `interpolate` gives."""
        first, second, albedo = shipped.textures()
        rng = np.random.default_rng(4)
        t = rng.random((100, 4))
        entries = interpolate(shipped.residual, t)
        got = np.concatenate([_sample(first, shipped, t), _sample(second, shipped, t)], axis=-1)
        np.testing.assert_allclose(got[:, :7], entries, atol=1e-12)
        np.testing.assert_array_equal(got[:, 7], 0.0)
        assert shipped.payload == first.nbytes + second.nbytes + albedo.nbytes <= 48 * 1024
        pair = np.stack([shipped.albedo, shipped.fresnel], axis=-1)
        np.testing.assert_array_equal(albedo.reshape(pair.shape), pair)


def _sample(texture: NDArray[np.float16], table: AnisotropicTable, t: FloatArray) -> FloatArray:
    """Sample a 3D texture with linear filtering, twice, and mix."""
    n0, n1, _, _ = table.residual.shape[:4]
    depth, height, width, _ = texture.shape
    slab = np.minimum((t[:, 0] * (n0 - 1)).astype(int), n0 - 2)
    result = []
    for k in (slab, slab + 1):
        r = (k * n1 + 0.5 + t[:, 1] * (n1 - 1)) / (n0 * n1)
        coordinates = ((r, depth), (_centred(t[:, 2], height), height))
        axes = [*coordinates, (_centred(t[:, 3], width), width)]
        texel = np.stack([x * n - 0.5 for x, n in axes], axis=-1)
        low = np.floor(texel).astype(int)
        value = np.zeros((len(t), 4))
        for corner in np.ndindex(2, 2, 2):
            at = np.minimum(low + corner, np.array(texture.shape[:3]) - 1)
            f = np.where(np.array(corner) == 1, texel - low, 1.0 - (texel - low))
            value += np.prod(f, axis=-1)[:, None] * texture[at[:, 0], at[:, 1], at[:, 2]]
        result.append(value)
    f = (t[:, 0] * (n0 - 1) - slab)[:, None]
    return (1.0 - f) * result[0] + f * result[1]


def _centred(t: FloatArray, n: int) -> FloatArray:
    return (0.5 + t * (n - 1)) / n


class TestSymmetry:
    """What makes the table serve all quadrants and both orders of the alphas."""

    def test_mirrored_views_have_mirrored_lobes(
        self, shipped: AnisotropicTable, rng: np.random.Generator
    ) -> None:
        ax, ay, v = random_views(rng, 200)
        M = shipped.matrix_of_view(ax, ay, v)
        for mirror in (np.diag([-1.0, 1.0, 1.0]), np.diag([1.0, -1.0, 1.0])):
            other = shipped.matrix_of_view(ax, ay, v @ mirror)
            np.testing.assert_allclose(other, mirror @ M @ mirror, atol=1e-12)

    def test_exchanged_alphas_exchange_the_axes(
        self, shipped: AnisotropicTable, rng: np.random.Generator
    ) -> None:
        ax, ay, v = random_views(rng, 200)
        P = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
        M, other = shipped.matrix_of_view(ax, ay, v), shipped.matrix_of_view(ay, ax, v @ P)
        np.testing.assert_allclose(other, P @ M @ P, atol=1e-12)
        np.testing.assert_allclose(
            shipped.albedo_terms_of_view(ay, ax, v @ P), shipped.albedo_terms_of_view(ax, ay, v)
        )

    def test_equal_alphas_turn_with_the_view(
        self, shipped: AnisotropicTable, rng: np.random.Generator
    ) -> None:
        alpha, c = rng.uniform(0.01, 1.0, 50), rng.uniform(0.0, 1.0, 50)
        zero = shipped.matrix(alpha, alpha, c, 0.0)
        assert np.max(np.abs(zero[:, [0, 1, 1, 2], [1, 0, 2, 1]])) < 1e-12
        for phi in (0.4, 1.3, 2.0, 4.0):
            R = np.array(
                [[np.cos(phi), -np.sin(phi), 0.0], [np.sin(phi), np.cos(phi), 0.0], [0.0, 0.0, 1.0]]
            )
            turned = shipped.matrix(alpha, alpha, c, phi)
            np.testing.assert_allclose(turned, R @ zero @ R.T, atol=1e-10)

    @pytest.mark.parametrize("step", [1e-6, 1e-9])
    def test_no_step_at_any_seam(
        self, shipped: AnisotropicTable, rng: np.random.Generator, step: float
    ) -> None:
        """Density, albedo and Fresnel part on both sides of a seam differ by its distance."""
        a = rng.uniform(0.03, 1.0, 200)
        b = a * rng.uniform(0.1, 1.0, 200)
        c, phi = rng.uniform(0.05, 1.0, 200), rng.uniform(0.0, 2.0 * np.pi, 200)
        seam = rng.choice(SEAMS, 200)
        view, less = view_direction(c, phi), a * (1.0 - step)
        upright = view_direction(np.ones(200), 0.0)
        sides = [
            ((a, b, view_direction(c, seam - step)), (a, b, view_direction(c, seam + step))),
            ((a, a, view), (a, less, view)),
            ((a, less, view), (less, a, view)),
            ((a, b, view_direction(1.0 - step * step, phi)), (a, b, upright)),
        ]
        for here, there in sides:
            one, other = _density(shipped, *here), _density(shipped, *there)
            scale = 1.0 + np.max(one, axis=1, keepdims=True)
            assert np.max(np.abs(one - other) / scale) < 1e4 * step
            for one, other in zip(
                shipped.albedo_terms_of_view(*here),
                shipped.albedo_terms_of_view(*there),
                strict=True,
            ):
                assert np.max(np.abs(one - other)) < 1e2 * step

    def test_basis_is_linear_in_nothing_but_the_view(self, rng: np.random.Generator) -> None:
        basis = entry_basis(0.2, 0.1, rng.normal(size=(10, 3)))
        assert basis.shape == (10, 7, 3, 3)
        np.testing.assert_array_equal(basis[..., 2, 2], 0.0)


class TestLobes:
    def test_extremes_are_finite_and_regular(self, shipped: AnisotropicTable) -> None:
        large = np.array([1e-3, 0.02, 0.1, 0.5, 1.0])
        ratio = np.array([0.01, 0.02, 0.1, 0.5, 1.0])
        theta = np.radians([0.0, 1e-5, 30.0, 80.0, 89.5, 90.0])
        a, q, angle, phi = np.meshgrid(large, ratio, theta, np.append(SEAMS, [0.1, 3.0]))
        M = shipped.matrix(a, a * q, np.cos(angle), phi)
        assert np.all(np.isfinite(M))
        assert np.all(np.linalg.det(M) > 0.0)
        A, B = shipped.albedo_terms(a, a * q, np.cos(angle), phi)
        assert np.all((A > 0.0) & (A <= 1.0) & (B >= 0.0) & (B <= A))

    def test_agrees_with_the_isotropic_table(
        self, shipped: AnisotropicTable, rng: np.random.Generator
    ) -> None:
        alpha, c = rng.uniform(0.05, 1.0, 300), np.cos(np.radians(rng.uniform(0.0, 80.0, 300)))
        isotropic = load_isotropic()
        one, other = isotropic.matrix(alpha, c), shipped.matrix(alpha, alpha, c, 0.0)
        change = np.linalg.solve(one, other) - np.eye(3)
        assert np.mean(np.max(np.abs(change), axis=(1, 2))) < 0.06
        A, B = isotropic.albedo_terms(alpha, c)
        C, D = shipped.albedo_terms(alpha, alpha, c, 0.0)
        assert np.max(np.abs(A - C)) < 0.02
        assert np.max(np.abs(B - D)) < 0.03

    def test_albedo_is_that_of_ggx(
        self, shipped: AnisotropicTable, rng: np.random.Generator
    ) -> None:
        ax, ay, v = random_views(rng, 150)
        A, B = brdf.directional_albedo(v, ax, ay, 0.2)
        C, D = shipped.albedo_terms_of_view(ax, ay, v)
        assert np.mean(np.abs(A - C)) < 0.0012
        assert np.max(np.abs(A - C)) < 0.015
        assert np.mean(np.abs(B - D)) < 0.0008
        assert np.max(np.abs(B - D)) < 0.03

    def test_a_light_that_fills_the_sky_gives_the_albedo(
        self, shipped: AnisotropicTable, rng: np.random.Generator
    ) -> None:
        alpha = rng.uniform(0.03, 1.0, (2, 100))
        c, phi = rng.uniform(0.01, 1.0, 100), rng.uniform(0.0, 2.0 * np.pi, 100)
        M = shipped.matrix(*alpha, c, phi)
        A, _ = shipped.albedo_terms(*alpha, c, phi)
        sky = np.array([[-1e7, -1e7, 1.0], [1e7, -1e7, 1.0], [1e7, 1e7, 1.0], [-1e7, 1e7, 1.0]])
        np.testing.assert_allclose(ltc_specular(M, [sky], A), A, atol=1e-4)


class TestValidation:
    @pytest.mark.parametrize(
        ("name", "change", "message"),
        [
            ("residual", lambda r: r[..., :6], r"residual has shape .* expected \(n0, n1, n2"),
            ("residual", lambda r: r.astype("f4"), "residual is float32, expected float16"),
            ("residual", lambda r: _with(r, (1, 1, 2, 3, 4), np.nan), r"1, 1, 2, 3, 4\] is nan"),
            ("residual", lambda r: _with(r, (1, -1, 2, 3, 0), 0.9), "meets at equal alphas"),
            ("residual", lambda r: _with(r, (1, 1, 0, 3, 1), 0.9), "along the normal"),
            ("residual", lambda r: _with(r, (1, 1, 2, 3, 0), -1.0), "determinant -"),
            ("residual", lambda r: _with(r, (1, 1, 2, 3, 0), -9.0), "trace -"),
            ("albedo", lambda a: a[0], "albedo has shape"),
            ("albedo", lambda a: _with(a, (1, 1, 2, 3), 0.0), "albedo runs from 0.0 to"),
            ("albedo", lambda a: _with(a, (1, -1, 2, 3), 0.25), "meets at equal alphas"),
            ("fresnel", lambda f: f[:-1], "fresnel has shape .* expected that of albedo"),
            ("fresnel", lambda f: _with(f, (1, 1, 2, 3), -1.0), "fresnel goes down to -1.0"),
        ],
    )  # fmt: skip
    def test_refuses(self, shipped: AnisotropicTable, name, change, message) -> None:
        with pytest.raises(ValueError, match=message):
            dataclasses.replace(shipped, **{name: change(getattr(shipped, name))})

    def test_tied_values_stay(self, shipped: AnisotropicTable) -> None:
        np.testing.assert_array_equal(tied(shipped.residual, True), shipped.residual)
        np.testing.assert_array_equal(tied(shipped.albedo, False), shipped.albedo)


def _with(values: NDArray[np.float16], place: tuple[int, ...], value: float) -> NDArray[np.float16]:
    changed = values.copy()
    changed[place] = value
    return changed


class TestFile:
    def test_round_trip_gives_the_same_bytes(
        self, shipped: AnisotropicTable, tmp_path: Path
    ) -> None:
        for name in ("a.npz", "b.npz"):
            save_anisotropic(shipped, tmp_path / name)
        again = load_anisotropic(tmp_path / "a.npz")
        assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()
        for name in ("residual", "albedo", "fresnel"):
            np.testing.assert_array_equal(getattr(again, name), getattr(shipped, name))
        assert json.dumps(again.provenance) == json.dumps(shipped.provenance)

    def test_refuses_other_files(self, shipped: AnisotropicTable, tmp_path: Path) -> None:
        file = tmp_path / "table.npz"
        with pytest.raises(FileNotFoundError):
            load_anisotropic(file)
        file.write_bytes(b"PK nonsense")
        with pytest.raises(ValueError, match=r"table.npz: not an npz archive.*an anisotropic"):
            load_anisotropic(file)
        np.savez(file, residual=shipped.residual)
        with pytest.raises(ValueError, match="'albedo' is missing, found residual"):
            load_anisotropic(file)
        with pytest.raises(ValueError, match=r"ltc_isotropic.npz: .*expected float16"):
            load_anisotropic(resource_path("luts", "ltc_isotropic.npz"))
        with pytest.raises(ValueError, match=r"ltc_anisotropic.npz.*is float16, expected float32"):
            load_isotropic(resource_path("luts", "ltc_anisotropic.npz"))
