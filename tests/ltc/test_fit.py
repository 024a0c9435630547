"""The fit: its derivatives, its result, and what happens when it is interrupted."""

import dataclasses
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from ltc import __main__ as command_line
from ltc import fit, fit_command, fitting, transform
from ltc.fit import fit_isotropic
from ltc.fitting import CheckpointError
from ltc.objective import Configurations, Lobe, ShadingError
from ltc.polygon import clipped_form_factor, ltc_specular
from ltc.table import (
    IsotropicTable,
    closed_form_guess,
    load_isotropic,
    residual_matrix,
    sample_textures,
)

FloatArray = NDArray[np.float64]
SETTINGS = {"size": 4, "seed": 3, "configurations": 48}


@pytest.fixture(scope="module")
def shipped() -> IsotropicTable:
    return load_isotropic()


@pytest.fixture
def cheap(monkeypatch: pytest.MonkeyPatch, shipped: IsotropicTable) -> None:
    """Leave out what is slow and tested elsewhere: exact albedo, the final figures."""
    monkeypatch.setattr(fit, "albedo_tables", lambda: (shipped.albedo, shipped.fresnel))
    monkeypatch.setattr(fit, "measure", lambda table, seed: {"rectangles": {}, "octagons": {}})
    monkeypatch.setattr(fitting, "CHUNK", 16)


def _direct(cases: Configurations, exact: FloatArray, A: FloatArray, X: FloatArray) -> FloatArray:
    """Return the technique's error by `ltc.polygon`, entry by entry."""
    guess = closed_form_guess(cases.alpha, cases.alpha, cases.wo)
    M = guess @ residual_matrix(X, np.ones(len(X)))
    return ltc_specular(M, [cases.corners], A) - exact


def _plain(count: int) -> FloatArray:
    """Return the basis of entries that are X00, X02, X11 and X20 themselves."""
    return fit.entry_basis(np.ones(count))


class TestConfigurations:
    @pytest.mark.parametrize("training", [False, True])
    @pytest.mark.parametrize("corners", [4, 8])
    def test_cover_what_they_promise(self, corners: int, training: bool) -> None:
        rng = np.random.default_rng(5)
        cases = fit.random_configurations(rng, 3000, corners, training)
        assert cases.corners.shape == (3000, corners, 3)
        theta = np.degrees(np.arccos(cases.cos_theta))
        assert 0.0 <= np.min(theta) < 1.0
        assert 89.0 < np.max(theta) <= 89.9 + 1e-9
        assert np.min(cases.alpha) < (0.001 if training else 0.003)
        assert np.max(cases.alpha) > 0.99
        assert np.all(clipped_form_factor(cases.corners) >= 0.0)
        above = np.mean(np.any(cases.corners[..., 2] > 0.0, axis=1))
        crossing = np.mean(
            np.any(cases.corners[..., 2] > 0.0, axis=1)
            & np.any(cases.corners[..., 2] < 0.0, axis=1)
        )
        assert above > 0.97
        assert 0.4 < crossing < 0.8

    def test_are_rectangles(self, rng: np.random.Generator) -> None:
        p = fit.random_configurations(rng, 100).corners
        sides = np.roll(p, -1, axis=1) - p
        np.testing.assert_allclose(sides[:, 0], -sides[:, 2], atol=1e-12)
        np.testing.assert_allclose(np.sum(sides[:, 0] * sides[:, 1], axis=-1), 0.0, atol=1e-12)


class TestDerivatives:
    def test_shading(self, rng: np.random.Generator) -> None:
        cases = fit.random_configurations(rng, 400, training=True)
        exact, A = rng.random(400), rng.uniform(0.5, 1.0, 400)
        shading = ShadingError(cases, exact, A, _plain(400))
        X = rng.normal(scale=0.1, size=(400, 4))
        error, slope = shading.evaluate(X, slice(None))
        np.testing.assert_allclose(error, _direct(cases, exact, A, X), atol=1e-10)
        for i in range(4):
            step = np.zeros(4)
            step[i] = 1e-6
            numeric = (
                _direct(cases, exact, A, X + step) - _direct(cases, exact, A, X - step)
            ) / 2e-6
            np.testing.assert_allclose(slope[:, i], numeric, atol=2e-6)

    def test_parts_are_the_whole(self, rng: np.random.Generator) -> None:
        cases = fit.random_configurations(rng, 50)
        shading = ShadingError(cases, np.zeros(50), np.ones(50), _plain(50))
        whole = shading.evaluate(np.zeros((50, 4)), slice(None))
        part = shading.evaluate(np.zeros((20, 4)), slice(10, 30))
        np.testing.assert_array_equal(whole[0][10:30], part[0])
        np.testing.assert_array_equal(whole[1][10:30], part[1])

    def test_share_above_the_horizon(self, rng: np.random.Generator) -> None:
        cases = fit.random_configurations(rng, 50)
        guess = closed_form_guess(cases.alpha, cases.alpha, cases.wo)
        X = rng.normal(scale=0.1, size=(50, 4))
        basis = _plain(50)
        model = Lobe(guess, basis, X)
        M = guess @ residual_matrix(X, np.ones(50))
        np.testing.assert_allclose(model.above, 1.0 - transform.leak(M), atol=1e-14)
        for i in range(4):
            step = np.zeros(4)
            step[i] = 1e-6
            high, low = Lobe(guess, basis, X + step).above, Lobe(guess, basis, X - step).above
            np.testing.assert_allclose(model.above_gradient()[:, i], (high - low) / 2e-6, atol=1e-7)

    def test_total_variation(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(fit, "_DIRECTIONS", 4000)
        lobes, _ = fit.random_variation(np.random.default_rng(2), 20)
        # Both densities are normalised above the horizon: the estimate of the integral
        # of each must be 1, and the variation between 0 and 1 per view.
        np.testing.assert_allclose(np.sum(2.0 * lobes.ggx * lobes.weight, axis=1), 1.0)
        X = np.zeros((20, 4))
        loss, _, slope = lobes.normal_equations(X, slice(None))
        assert 0.01 < loss / fit._VARIATION < 0.3
        for i in range(4):
            step = np.zeros(4)
            step[i] = 1e-4
            high = lobes.normal_equations(X + step, slice(None))[0]
            low = lobes.normal_equations(X - step, slice(None))[0]
            assert np.sum(slope[:, i]) == pytest.approx((high - low) / 2e-4, rel=1e-3, abs=1e-6)


class TestShipped:
    def test_errs_as_documented(self, shipped: IsotropicTable) -> None:
        cases = fit.random_configurations(np.random.default_rng(314), 400)
        errors = fit.shading_errors(shipped, cases, fit.exact_integrals(cases))
        figures = fit.error_figures(errors, cases)
        assert figures["mean"] < 0.0024
        assert figures["p99"] < 0.030
        assert set(figures["theta"]) == {"0-30", "30-60", "60-75", "75-87", "87-90"}
        documented = shipped.provenance["error"]["rectangles"]
        assert documented["mean"] < 0.0021
        assert documented["p99"] < 0.022

    def test_errs_no_more_on_octagons(self, shipped: IsotropicTable) -> None:
        cases = fit.random_configurations(np.random.default_rng(315), 300, corners=8)
        errors = fit.shading_errors(shipped, cases, fit.exact_integrals(cases))
        assert np.mean(errors) < 0.0024

    def test_nothing_comes_from_below_the_surface(
        self, shipped: IsotropicTable, rng: np.random.Generator
    ) -> None:
        cases = fit.random_configurations(rng, 500)
        M, A, _ = sample_textures(shipped.textures(), cases.alpha, cases.cos_theta)
        sunk = cases.corners - np.max(cases.corners[..., 2:], axis=1, keepdims=True) * [0, 0, 1]
        np.testing.assert_array_equal(ltc_specular(M, [sunk], A), 0.0)

    def test_a_light_that_fills_the_sky_gives_the_albedo(
        self, shipped: IsotropicTable, rng: np.random.Generator
    ) -> None:
        alpha, c = rng.uniform(0.03, 1.0, 100), rng.uniform(0.01, 1.0, 100)
        M, A, _ = sample_textures(shipped.textures(), alpha, c)
        sky = np.array([[-1e7, -1e7, 1.0], [1e7, -1e7, 1.0], [1e7, 1e7, 1.0], [-1e7, 1e7, 1.0]])
        np.testing.assert_allclose(ltc_specular(M, [sky], A), A, atol=1e-4)


@pytest.mark.usefixtures("cheap")
class TestFitting:
    def test_is_deterministic_and_lowers_the_error(self, tmp_path: Path) -> None:
        lines: list[str] = []
        for name in ("a.npz", "b.npz"):
            fit_isotropic(tmp_path / name, **SETTINGS, report=lines.append)
        assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()
        assert sorted(p.name for p in tmp_path.iterdir()) == ["a.npz", "b.npz"]
        assert any("left" in line for line in lines)
        fitted = load_isotropic(tmp_path / "a.npz")
        cases = fit.random_configurations(np.random.default_rng([3, 0]), 48, training=True)
        exact = fit.exact_integrals(cases)
        plain = dataclasses.replace(fitted, residual=np.zeros_like(fitted.residual))
        assert np.mean(fit.shading_errors(fitted, cases, exact)) < 0.5 * np.mean(
            fit.shading_errors(plain, cases, exact)
        )

    @pytest.mark.parametrize(
        ("stage", "after"), [("exact integrals", 2), ("fit: step", 1), ("fit: step", 4)]
    )
    def test_interrupted_it_continues_to_the_same_result(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, stage: str, after: int
    ) -> None:
        monkeypatch.setattr(fitting, "SAVE_EVERY", 0.0)  # report after every chunk
        fit_isotropic(tmp_path / "whole.npz", **SETTINGS)
        output = tmp_path / "out.npz"
        output.write_bytes(b"old")
        work = {"integrals": 0}
        exact = fit.exact_integrals

        def counting(cases: Configurations) -> FloatArray:
            work["integrals"] += cases.alpha.size
            return exact(cases)

        monkeypatch.setattr(fit, "exact_integrals", counting)
        with pytest.raises(KeyboardInterrupt):
            fit_isotropic(output, **SETTINGS, report=_interrupt(stage, after))
        assert output.read_bytes() == b"old"
        assert fitting.checkpoint_path(output).exists()
        fit_isotropic(output, **SETTINGS, resume=True)
        assert output.read_bytes() == (tmp_path / "whole.npz").read_bytes()
        assert work["integrals"] == SETTINGS["configurations"]
        assert not fitting.checkpoint_path(output).exists()

    def test_an_interrupt_amid_the_integrals_loses_one_chunk(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        exact, calls = fit.exact_integrals, 0

        def third_time(cases: Configurations) -> FloatArray:
            nonlocal calls
            calls += 1
            if calls == 3:
                raise KeyboardInterrupt
            return exact(cases)

        monkeypatch.setattr(fit, "exact_integrals", third_time)
        output = tmp_path / "out.npz"
        with pytest.raises(KeyboardInterrupt):
            fit_isotropic(output, **SETTINGS)
        fit_isotropic(output, **SETTINGS)
        assert calls == 4  # of three chunks only the third was done again

    def test_foreign_and_damaged_checkpoints_are_refused(self, tmp_path: Path) -> None:
        output = tmp_path / "out.npz"
        with pytest.raises(CheckpointError, match="nothing to resume"):
            fit_isotropic(output, **SETTINGS, resume=True)
        with pytest.raises(KeyboardInterrupt):
            fit_isotropic(output, **SETTINGS, report=_interrupt("fit: step", 1))
        with pytest.raises(CheckpointError, match=r"seed 3.*expected.*seed 4.*--fresh"):
            fit_isotropic(output, **(SETTINGS | {"seed": 4}))
        checkpoint = fitting.checkpoint_path(output)
        checkpoint.write_bytes(checkpoint.read_bytes()[:100])
        with pytest.raises(CheckpointError, match=r"damaged.*--fresh"):
            fit_isotropic(output, **SETTINGS)
        fit_isotropic(output, **SETTINGS, resume=False)
        assert not checkpoint.exists()

    @pytest.mark.parametrize(
        ("change", "message"),
        [
            ({"size": 3}, "size is 3, expected 4 to 32"),
            ({"seed": -1}, "seed is -1"),
            ({"configurations": 5}, "configurations is 5"),
        ],
    )
    def test_refuses(self, tmp_path: Path, change: dict[str, int], message: str) -> None:
        with pytest.raises(ValueError, match=message):
            fit_isotropic(tmp_path / "out.npz", **(SETTINGS | change))

    def test_command(self, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        output = tmp_path / "out.npz"
        arguments = ["fit", "isotropic", "--output", str(output), "--size", "4", "--seed", "3"]
        arguments += ["--configurations", "48"]
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(fit_command, "_print_error", lambda figures: None)
            assert command_line.main(arguments) == 0
        out, err = capsys.readouterr()
        assert str(output) in out
        assert "exact integrals: 48 of 48" in err
        assert load_isotropic(output).residual.shape == (4, 4, 4)


def _interrupt(stage: str, after: int) -> Callable[[str], None]:
    """Return a report that presses Ctrl-C at the given line of a stage."""
    seen = 0

    def report(message: str) -> None:
        nonlocal seen
        seen += message.startswith(stage)
        if seen == after:
            raise KeyboardInterrupt

    return report


class TestCommandLine:
    def test_alone_it_helps(self, capsys: pytest.CaptureFixture[str]) -> None:
        assert command_line.main([]) == 0
        assert "example: python -m ltc fit isotropic" in capsys.readouterr().out

    @pytest.mark.parametrize(
        ("arguments", "message"),
        [
            (["fit"], "TABLE"),
            (["paint"], "invalid choice: 'paint'"),
            (["fit", "isotropic", "--size", "x"], "invalid int value: 'x'"),
            (["fit", "isotropic", "--sise", "8"], "unrecognized arguments: --sise"),
            (["fit", "isotropic", "--resume", "--fresh"], "not allowed with"),
        ],
    )
    def test_bad_arguments(
        self, arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
    ) -> None:
        with pytest.raises(SystemExit) as caught:
            command_line.main(arguments)
        assert caught.value.code == 2
        error = capsys.readouterr().err
        assert message in error
        assert error.count("\n") == 1

    @pytest.mark.parametrize(
        ("arguments", "message"),
        [
            (["--output", "/nowhere/at/all/x.npz"], "/nowhere/at/all: no such folder"),
            (["--output", "."], "is a folder"),
            (["--output", "x.npz", "--size", "99"], "size is 99, expected 4 to 32"),
            (["--output", "x.npz", "--resume"], "nothing to resume"),
        ],
    )
    def test_bad_values(
        self,
        arguments: list[str],
        message: str,
        tmp_path: Path,
        monkeypatch: pytest.MonkeyPatch,
        capsys: pytest.CaptureFixture[str],
    ) -> None:
        monkeypatch.chdir(tmp_path)
        assert command_line.main(["fit", "isotropic", *arguments]) == 2
        out, error = capsys.readouterr()
        assert not out
        assert message in error
        assert error.count("\n") == 1
        assert list(tmp_path.iterdir()) == []

    def test_interrupted(
        self,
        tmp_path: Path,
        monkeypatch: pytest.MonkeyPatch,
        capsys: pytest.CaptureFixture[str],
    ) -> None:
        def interrupted(*_: object) -> None:
            raise KeyboardInterrupt

        monkeypatch.setattr(fit_command, "fit_isotropic", interrupted)
        assert command_line.main(["fit", "isotropic", "--output", str(tmp_path / "x.npz")]) == 130
        assert "the same command continues from" in capsys.readouterr().err


@pytest.mark.slow
def test_a_smaller_fit_finds_the_shipped_table(shipped: IsotropicTable, tmp_path: Path) -> None:
    size = len(shipped.residual)
    table = fit_isotropic(tmp_path / "out.npz", size=size, seed=99, configurations=12_000)
    figures = table.provenance["error"]["rectangles"]
    assert figures["mean"] < shipped.provenance["error"]["rectangles"]["mean"] + 1.5e-4
    np.testing.assert_allclose(table.albedo, shipped.albedo, atol=1e-6)
    alpha = np.array([0.05, 0.2, 0.5, 0.9])[:, None]
    c = np.cos(np.radians([10.0, 40.0, 65.0]))
    change = np.linalg.solve(shipped.matrix(alpha, c), table.matrix(alpha, c)) - np.eye(3)
    assert np.max(np.abs(change)) < 0.05
