"""The isotropic table: guess, axes, interpolation, files."""

import dataclasses
import io
import json
import zipfile
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from ltc import brdf, table
from ltc.table import IsotropicTable, load_isotropic, save_isotropic

FloatArray = NDArray[np.float64]


def _views(rng: np.random.Generator, n: int) -> FloatArray:
    z, phi = rng.uniform(0.0, 1.0, n), rng.uniform(0.0, 2.0 * np.pi, n)
    z[:4] = (1.0, 0.0, 1e-9, 1.0 - 1e-12)
    r = np.sqrt(1.0 - z * z)
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=-1)


@pytest.fixture(scope="module")
def shipped() -> IsotropicTable:
    return load_isotropic()


class TestGuess:
    def test_determinant_is_positive_and_third_column_unit(self, rng: np.random.Generator) -> None:
        v = _views(rng, 2000)
        ax, ay = 10.0 ** rng.uniform(-4.0, 0.0, (2, 2000))
        M = table.closed_form_guess(ax, ay, v)
        assert np.all(np.linalg.det(M / np.stack([ax, ay, np.ones(2000)], -1)[:, None]) > 0.0)
        np.testing.assert_allclose(np.linalg.norm(M[..., 2], axis=-1), 1.0, atol=1e-14)

    def test_mirrors_and_swaps_with_the_surface(self, rng: np.random.Generator) -> None:
        v, (ax, ay) = _views(rng, 200), rng.uniform(0.01, 1.0, (2, 200))
        M = table.closed_form_guess(ax, ay, v)
        flip = np.diag([1.0, -1.0, 1.0])
        np.testing.assert_allclose(
            table.closed_form_guess(ax, ay, v @ flip), flip @ M @ flip, atol=1e-13
        )
        swap = np.eye(3)[[1, 0, 2]]
        np.testing.assert_allclose(
            table.closed_form_guess(ay, ax, v @ swap), swap @ M @ swap, atol=1e-13
        )

    def test_turns_with_the_view_where_the_alphas_are_equal(self, rng: np.random.Generator) -> None:
        v, alpha, phi = _views(rng, 200), rng.uniform(0.01, 1.0, 200), 0.7
        R = np.array([[np.cos(phi), -np.sin(phi), 0.0], [np.sin(phi), np.cos(phi), 0.0], [0, 0, 1]])
        turned = table.closed_form_guess(alpha, alpha, v @ R.T)
        np.testing.assert_allclose(
            turned, R @ table.closed_form_guess(alpha, alpha, v) @ R.T, atol=1e-13
        )

    def test_is_round_and_upright_at_normal_incidence(self) -> None:
        M = table.closed_form_guess(0.3, 0.3, [0.0, 0.0, 1.0])
        np.testing.assert_allclose(M, np.diag([0.6, 0.6, 1.0]), atol=1e-15)

    def test_is_the_reflection_to_first_order(self) -> None:
        # The second route: reflect half vectors numerically and difference them.
        v = np.array([np.sin(1.1), 0.0, np.cos(1.1)])
        M = table.closed_form_guess(1e-4, 1e-4, v)
        step = 1e-5
        for axis in range(2):
            offset = np.zeros(3)
            offset[axis] = 1e-4 * step
            h = np.array([0.0, 0.0, 1.0]) + offset
            wi = brdf.reflect(v, h / np.linalg.norm(h))
            centre = brdf.reflect(v, np.array([0.0, 0.0, 1.0]))
            near = M @ np.array([step * (axis == 0), step * (axis == 1), 1.0])
            expected = wi - centre
            np.testing.assert_allclose(
                near / np.linalg.norm(near) - M[:, 2], expected, atol=3e-4 * step * 1e-4 * 2
            )

    @pytest.mark.parametrize(
        ("alphas", "v", "message"),
        [
            ((0.1, 0.1), [0.0, 1.0], "shape"),
            ((0.0, 0.1), [0.0, 0.0, 1.0], "positive"),
            ((0.1, np.nan), [0.0, 0.0, 1.0], "positive"),
            ((0.1, 0.1), [0.0, 0.0, -1.0], "below"),
        ],
    )
    def test_refuses(self, alphas: tuple[float, float], v: list[float], message: str) -> None:
        with pytest.raises(ValueError, match=message):
            table.closed_form_guess(*alphas, v)


class TestAxes:
    def test_are_inverse_to_each_other(self) -> None:
        alpha, c = table.node_grid(33)
        inside = alpha >= table.ALPHA_MIN
        x, y = table.table_coordinates(alpha[inside], c[inside])
        back = table.alpha_and_cosine(x, y)
        np.testing.assert_allclose(back[0], alpha[inside], rtol=1e-12)
        np.testing.assert_allclose(back[1], c[inside], rtol=1e-9, atol=1e-15)

    def test_run_over_the_unit_square(self) -> None:
        for alpha in (0.0, 1e-4, 1e-3, 1.0, 2.0):
            x, y = table.table_coordinates(alpha, np.linspace(-0.1, 1.1, 200))
            assert np.all((x > 0.0) & (x <= 1.0))
            assert y[0] == 1.0
            assert y[-1] == 0.0
            assert np.all(np.diff(y) <= 0.0)

    def test_need_two_nodes(self) -> None:
        with pytest.raises(ValueError, match="at least 2"):
            table.node_grid(1)


class TestInterpolation:
    def test_weights_reproduce_what_they_should(self, rng: np.random.Generator) -> None:
        x, y = rng.uniform(0.0, 1.0, (2, 300))
        x[:2], y[:2] = (0.0, 1.0), (1.0, 0.0)
        nodes = np.linspace(0.0, 1.0, 7)
        X, Y = np.meshgrid(nodes, nodes)
        index, weight = table.bilinear_weights(x, y, 7)
        assert np.all(weight >= 0.0)
        plane = (1.0 + 2.0 * X - 3.0 * Y + X * Y).ravel()
        np.testing.assert_allclose(
            np.sum(plane[index] * weight, axis=-1), 1.0 + 2.0 * x - 3.0 * y + x * y, atol=1e-13
        )
        cubic = (X**3 * Y**2 - Y**3).ravel()
        np.testing.assert_allclose(
            table.bicubic_weights(x, y, 7) @ cubic, x**3 * y**2 - y**3, atol=1e-13
        )

    def test_weights_are_the_tables_interpolation(
        self, shipped: IsotropicTable, rng: np.random.Generator
    ) -> None:
        alpha, c = rng.uniform(0.01, 1.0, 100), rng.uniform(0.0, 1.0, 100)
        x, y = table.table_coordinates(alpha, c)
        A = table.bicubic_weights(x, y, len(shipped.albedo)) @ shipped.albedo.ravel().astype(float)
        np.testing.assert_allclose(shipped.albedo_terms(alpha, c)[0], A, atol=1e-12)


class TestShipped:
    def test_albedo_is_exact(self, shipped: IsotropicTable, rng: np.random.Generator) -> None:
        alpha = 10.0 ** rng.uniform(-4.0, 0.0, 150)
        c = np.cos(np.radians(rng.uniform(0.0, 89.9, 150)))
        wo = np.stack([np.sqrt(1.0 - c * c), np.zeros(150), c], axis=-1)
        A, B = brdf.directional_albedo(wo, alpha, alpha)
        direct = shipped.albedo_terms(alpha, c)
        np.testing.assert_allclose(direct[0], A, atol=3e-4)
        np.testing.assert_allclose(direct[1], B, atol=1.2e-3)
        _, A_gpu, B_gpu = table.sample_textures(shipped.textures(), alpha, c)
        np.testing.assert_allclose(A_gpu, A, atol=5e-4)
        np.testing.assert_allclose(B_gpu, B, atol=1.2e-3)

    def test_textures_hold_what_the_table_says(
        self, shipped: IsotropicTable, rng: np.random.Generator
    ) -> None:
        alpha = 10.0 ** rng.uniform(-4.0, 0.0, 3000)
        c = np.cos(np.radians(rng.uniform(0.0, 89.9, 3000)))
        residual, albedo = shipped.textures()
        assert residual.shape == (table.RESIDUAL_SIZE, table.RESIDUAL_SIZE, 4)
        assert albedo.shape == (table.ALBEDO_SIZE, table.ALBEDO_SIZE, 2)
        assert residual.dtype == albedo.dtype == np.float32
        M, _, _ = table.sample_textures((residual, albedo), alpha, c)
        change = np.linalg.solve(shipped.matrix(alpha, c), M) - np.eye(3)
        assert np.mean(np.abs(change)) < 0.002
        assert np.max(np.abs(change)) < 0.03

    def test_is_regular_everywhere(self, shipped: IsotropicTable) -> None:
        alpha = np.array([0.0, 1e-4, 3e-4, 1e-3, 0.01, 0.1, 0.5, 1.0])[:, None]
        c = np.cos(np.radians([0.0, 1e-3, 30.0, 60.0, 80.0, 89.0, 89.9, 89.99, 90.0]))
        a = np.maximum(alpha, table.ALPHA_MIN)
        for M in (shipped.matrix(alpha, c), table.sample_textures(shipped.textures(), alpha, c)[0]):
            assert np.all(np.isfinite(M))
            assert np.all(np.linalg.det(M) > 1e-6 * a * a)
            np.testing.assert_allclose(np.linalg.norm(M[..., 2], axis=-1), 1.0, atol=1e-12)

    def test_lobe_is_round_at_normal_incidence(self, shipped: IsotropicTable) -> None:
        alpha = np.linspace(0.01, 1.0, 20)
        for M in (
            shipped.matrix(alpha, 1.0),
            table.sample_textures(shipped.textures(), alpha, 1.0)[0],
        ):
            np.testing.assert_allclose(M[:, 0, 0], M[:, 1, 1], rtol=1e-6)
            np.testing.assert_array_equal(M[:, [0, 2], [2, 0]], 0.0)

    def test_fits_in_16_kilobytes_and_says_where_it_comes_from(
        self, shipped: IsotropicTable
    ) -> None:
        assert shipped.payload <= 16384
        assert {"what", "how", "settings", "versions", "error"} <= set(shipped.provenance)

    def test_refuses_other_textures(self, shipped: IsotropicTable) -> None:
        residual, albedo = shipped.textures()
        with pytest.raises(ValueError, match="texture albedo has shape"):
            table.sample_textures((residual, residual), 0.1, 0.5)
        with pytest.raises(ValueError, match="texture residual has shape"):
            table.sample_textures((albedo, albedo), 0.1, 0.5)


class TestFile:
    def test_round_trip_is_exact_and_repeatable(
        self, shipped: IsotropicTable, tmp_path: Path
    ) -> None:
        save_isotropic(shipped, tmp_path / "a.npz")
        again = load_isotropic(tmp_path / "a.npz")
        for name in ("residual", "albedo", "fresnel"):
            np.testing.assert_array_equal(getattr(again, name), getattr(shipped, name))
        assert again.provenance == shipped.provenance
        save_isotropic(again, tmp_path / "b.npz")
        assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()

    def test_writing_is_atomic(
        self, shipped: IsotropicTable, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        file = tmp_path / "a.npz"
        file.write_bytes(b"old")

        def fail(self: Path, target: Path) -> None:
            raise KeyboardInterrupt

        monkeypatch.setattr(Path, "replace", fail)
        with pytest.raises(KeyboardInterrupt):
            save_isotropic(shipped, file)
        assert file.read_bytes() == b"old"
        assert list(tmp_path.iterdir()) == [file]

    def test_missing_file(self, tmp_path: Path) -> None:
        with pytest.raises(FileNotFoundError):
            load_isotropic(tmp_path / "none.npz")

    @staticmethod
    def _arrays(shipped: IsotropicTable) -> dict[str, NDArray]:
        text = json.dumps({"format": table.FORMAT}).encode()
        return {
            "residual": shipped.residual.copy(),
            "albedo": shipped.albedo.copy(),
            "fresnel": shipped.fresnel.copy(),
            "provenance": np.frombuffer(text, dtype=np.uint8),
        }

    @pytest.mark.parametrize(
        ("damage", "message"),
        [
            (lambda a: a.pop("albedo"), "array 'albedo' is missing, found fresnel, provenance, re"),
            (lambda a: a.update(residual=a["residual"][..., :3]), r"residual has shape \(\d+, \d+"),
            (lambda a: a.update(residual=a["residual"][:3]), "expected .n, n, 4. with n >= 4"),
            (lambda a: a.update(albedo=a["albedo"][:2, :2]), "k >= 4"),
            (lambda a: a.update(fresnel=a["fresnel"][1:]), "expected that of albedo"),
            (lambda a: a.update(residual=a["residual"].astype(float)), "float64, expected float32"),
            (lambda a: a["residual"].__setitem__((2, 1, 0), np.nan), r"residual\[2, 1, 0\] is nan"),
            (lambda a: a["albedo"].__setitem__((0, 3), np.inf), r"albedo\[0, 3\] is inf"),
            (lambda a: a["albedo"].__setitem__((0, 3), 0.0), "albedo runs from 0.0"),
            (lambda a: a["fresnel"].__setitem__((0, 3), -1.0), "fresnel goes down to -1.0"),
            (lambda a: a["residual"].__setitem__((1, 2, 2), -1.5), r"\[1, 2\] .*determinant"),
            (lambda a: a["residual"].__setitem__((1, 2), [-2, 0, -2, 0]), "two positive factors"),
            (lambda a: a.update(provenance=np.zeros(3, np.uint8)), "provenance is not JSON"),
            (
                lambda a: a.update(provenance=np.frombuffer(b'{"format": "x"}', np.uint8)),
                "format is 'x', expected 'ltc-isotropic/1'",
            ),
            (
                lambda a: a.update(provenance=np.frombuffer(b"[1]", np.uint8)),
                "format is None",
            ),
        ],
    )
    def test_damage_is_named(self, shipped, tmp_path, damage, message) -> None:  # type: ignore[no-untyped-def]
        arrays = self._arrays(shipped)
        damage(arrays)
        file = tmp_path / "damaged.npz"
        file.write_bytes(table.npz_bytes(arrays))
        with pytest.raises(ValueError, match=message) as caught:
            load_isotropic(file)
        assert str(caught.value).startswith(f"{file}: ")

    def test_what_is_no_archive(self, shipped: IsotropicTable, tmp_path: Path) -> None:
        file = tmp_path / "a.npz"
        save_isotropic(shipped, file)
        whole = file.read_bytes()
        for data in (b"", b"no archive at all", whole[: len(whole) // 2]):
            file.write_bytes(data)
            with pytest.raises(ValueError, match="not an npz archive"):
                load_isotropic(file)
        flipped = bytearray(whole)
        flipped[300] ^= 0xFF
        file.write_bytes(bytes(flipped))
        with pytest.raises(ValueError, match="array 'residual' cannot be read"):
            load_isotropic(file)

    def test_objects_are_refused(self, shipped: IsotropicTable, tmp_path: Path) -> None:
        member = io.BytesIO()
        np.save(member, np.array([{}], dtype=object), allow_pickle=True)
        file = tmp_path / "a.npz"
        with zipfile.ZipFile(file, "w") as archive:
            archive.writestr("residual.npy", member.getvalue())
        with pytest.raises(ValueError, match="array 'residual' cannot be read"):
            load_isotropic(file)


def test_a_table_is_checked_between_nodes(shipped: IsotropicTable) -> None:
    swing = np.zeros((4, 4, 4), np.float32)
    swing[1:3, :, 2] = -0.95  # the cubic through 0, -.95, -.95, 0 undershoots
    with pytest.raises(ValueError, match="between nodes"):
        dataclasses.replace(shipped, residual=swing)
