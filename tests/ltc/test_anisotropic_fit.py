"""The anisotropic fit: derivatives, the whole of its equations, result, executors, interrupts."""

import dataclasses
from collections.abc import Callable
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from ltc import __main__ as command_line
from ltc import anisotropic_fit as fit
from ltc import fit_command, fitting
from ltc.anisotropic import (
    AnisotropicTable,
    entry_basis,
    load_anisotropic,
    table_coordinates,
    tied,
    view_direction,
)
from ltc.anisotropic_fit import GridFit, fit_anisotropic
from ltc.fit import random_configurations as isotropic_configurations
from ltc.objective import (
    Configurations,
    FitState,
    Lobe,
    LobeVariation,
    ShadingError,
    exact_integrals,
)
from ltc.polygon import ltc_specular
from ltc.table import closed_form_guess, load_isotropic

FloatArray = NDArray[np.float64]
SETTINGS: dict[str, Any] = {
    "shape": (2, 3, 4, 3),
    "albedo_shape": (2, 2, 3, 3),
    "seed": 3,
    "configurations": 60,
}


@pytest.fixture(scope="module")
def shipped() -> AnisotropicTable:
    return load_anisotropic()


@pytest.fixture
def cheap(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave out what is slow and tested elsewhere."""
    monkeypatch.setattr(fit, "measure", lambda table, seed: {"rectangles": {}})
    monkeypatch.setattr(fit, "_ALBEDO_STEP", 0.4)
    monkeypatch.setattr(fit, "_STEPS", 4)
    monkeypatch.setattr(fitting, "CHUNK", 20)
    monkeypatch.setattr(fitting, "SAVE_EVERY", 0.0)


def _terms(rng: np.random.Generator, count: int) -> tuple[ShadingError, LobeVariation, Any, Any]:
    cases = fit.random_configurations(rng, count, training=True)
    views = (cases.alpha_x, cases.alpha_y, cases.wo)
    shading = ShadingError(
        cases, rng.random(count), rng.uniform(0.5, 1, count), entry_basis(*views)
    )
    lobe_views = fit.random_views(rng, count, training=True)
    lobes = LobeVariation(rng, *lobe_views, 200, entry_basis(*lobe_views), 0.1)
    return shading, lobes, table_coordinates(*views), table_coordinates(*lobe_views)


class TestViews:
    @pytest.mark.parametrize("training", [False, True])
    def test_cover_what_they_promise(self, rng: np.random.Generator, training: bool) -> None:
        ax, ay, wo = fit.random_views(rng, 4000, training)
        ratio = np.minimum(ax, ay) / np.maximum(ax, ay)
        assert 0.45 < np.mean(ax > ay) < 0.55
        assert np.min(ratio) < 0.02
        assert np.max(ratio) > 0.99
        assert np.min(np.minimum(ax, ay)) >= 1e-4
        for quadrant in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
            assert 0.2 < np.mean(np.all(wo[:, :2] * quadrant > 0.0, axis=1)) < 0.3
        theta = np.degrees(np.arccos(wo[:, 2]))
        assert np.min(theta) < 1.0
        assert 89.0 < np.max(theta) <= 89.9 + 1e-9


class TestDerivatives:
    def test_shading(self, rng: np.random.Generator) -> None:
        shading = _terms(rng, 200)[0]
        X = rng.normal(scale=0.1, size=(200, 7))
        _, slope = shading.evaluate(X, slice(None))
        for i in range(7):
            step = np.zeros(7)
            step[i] = 1e-6
            high, low = (shading.evaluate(X + s, slice(None))[0] for s in (step, -step))
            np.testing.assert_allclose(slope[:, i], (high - low) / 2e-6, atol=2e-6)

    def test_shading_is_the_technique(self, rng: np.random.Generator) -> None:
        cases = fit.random_configurations(rng, 100)
        basis = entry_basis(cases.alpha_x, cases.alpha_y, cases.wo)
        X = rng.normal(scale=0.1, size=(100, 7))
        A, exact = rng.uniform(0.5, 1.0, 100), rng.random(100)
        guess = closed_form_guess(cases.alpha_x, cases.alpha_y, cases.wo)
        M = guess @ Lobe(guess, basis, X).residual
        error, _ = ShadingError(cases, exact, A, basis).evaluate(X, slice(None))
        np.testing.assert_allclose(error, ltc_specular(M, [cases.corners], A) - exact, atol=1e-10)

    def test_variation(self, rng: np.random.Generator) -> None:
        lobes = _terms(rng, 20)[1]
        X = rng.normal(scale=0.02, size=(20, 7))
        _, _, slope = lobes.normal_equations(X, slice(None))
        for i in range(7):
            step = np.zeros(7)
            step[i] = 1e-6
            high, low = (lobes.normal_equations(X + s, slice(None))[0] for s in (step, -step))
            assert np.sum(slope[:, i]) == pytest.approx((high - low) / 2e-6, rel=1e-4, abs=1e-7)

    def test_small_determinants(self, rng: np.random.Generator) -> None:
        determinants = fit._Determinants(entry_basis(*fit.random_views(rng, 400)))
        X = np.tile([-0.7, 0.2, 0.1, 0.1, 0.1, 0.1, 0.1], (400, 1))
        loss, _, slope = determinants.normal_equations(X, slice(None))
        assert 0.0 < loss < np.inf
        for i in range(7):
            step = np.zeros(7)
            step[i] = 1e-6
            high, low = (
                determinants.normal_equations(X + s, slice(None))[0] for s in (step, -step)
            )
            assert np.sum(slope[:, i]) == pytest.approx((high - low) / 2e-6, rel=1e-4, abs=1e-7)
        X[7, :2] = [-0.5, 0.6]
        assert determinants.normal_equations(X, slice(None))[0] == np.inf
        X[7, :2] = [-9.0, 0.0]
        assert determinants.normal_equations(X, slice(None))[0] == np.inf


class TestEquations:
    def test_whole(self, rng: np.random.Generator) -> None:
        """Slope and step by the sparse equations, against differences and a dense solution."""
        shading, lobes, t, s = _terms(rng, 60)
        grid = GridFit((2, 3, 4, 3), [(shading, t), (lobes, s)])
        z = rng.normal(scale=0.03, size=grid.unknowns)
        here: Any = grid.equations(z)
        for _ in range(5):
            d = rng.normal(size=z.size)
            high, low = (grid.equations(z + h * d).loss for h in (1e-6, -1e-6))
            assert here._g @ d == pytest.approx((high - low) / 2e-6, rel=1e-4)
        H = here._H.toarray()
        np.testing.assert_allclose(H, H.T, atol=1e-12)
        assert np.min(np.linalg.eigvalsh(H)) > -1e-10
        diagonal = np.diag(H)
        dense = np.linalg.solve(H + np.diag(0.1 * (diagonal + 0.1 * np.mean(diagonal))), -here._g)
        np.testing.assert_allclose(here.step(0.1), dense, atol=5e-3 * np.max(np.abs(dense)))

    def test_nodes_that_meet_are_one_unknown(self, rng: np.random.Generator) -> None:
        grid = GridFit((3, 3, 3, 3), [])
        z = rng.normal(size=grid.unknowns)
        nodes = grid.nodes(z)
        np.testing.assert_array_equal(tied(nodes, residual=True), nodes)
        np.testing.assert_array_equal(grid.free(nodes), z)


class TestShipped:
    def test_errs_as_documented(self, shipped: AnisotropicTable) -> None:
        cases = fit.random_configurations(np.random.default_rng(2718), 400)
        figures = fit.error_figures(
            fit.shading_errors(shipped, cases, exact_integrals(cases)), cases
        )
        assert figures["mean"] < 0.0045  # 400 cases scatter by .0004
        assert figures["p99"] < 0.055
        assert set(figures["ratio"]) == {"0.01-0.05", "0.05-0.1", "0.1-0.3", "0.3-0.6", "0.6-1"}
        documented = shipped.provenance["error"]
        assert documented["rectangles"]["mean"] <= 0.0040
        assert documented["rectangles"]["p99"] <= 0.045
        assert documented["variation"]["mean"] <= 0.080
        isotropic = load_isotropic().provenance["error"]["rectangles"]["mean"]
        assert documented["diagonal"]["mean"] <= isotropic + 0.0006

    def test_diagonal(self, shipped: AnisotropicTable) -> None:
        cases = isotropic_configurations(np.random.default_rng(315), 300)
        errors = fit.shading_errors(shipped, cases, exact_integrals(cases))
        assert np.mean(errors) < 0.0028

    def test_variation(self, shipped: AnisotropicTable) -> None:
        rng = np.random.default_rng(12)
        variation = fit.lobe_variations(shipped, fit.random_views(rng, 400), rng, 256)
        assert np.mean(variation) < 0.09

    def test_shading_takes_no_step_at_a_seam(
        self, shipped: AnisotropicTable, rng: np.random.Generator
    ) -> None:
        cases = fit.random_configurations(rng, 300)
        a, b = cases.alpha, cases.alpha * cases.ratio
        c, phi = cases.cos_theta, rng.uniform(0.0, 2.0 * np.pi, 300)
        seam, h = 0.5 * np.pi * rng.integers(0, 5, 300), 1e-7
        for here, there in (
            ((a, b, view_direction(c, seam - h)), (a, b, view_direction(c, seam + h))),
            (
                (a, a * (1.0 - h), view_direction(c, phi)),
                (a * (1.0 - h), a, view_direction(c, phi)),
            ),
        ):
            steps = [
                ltc_specular(
                    shipped.matrix_of_view(*side),
                    [cases.corners],
                    shipped.albedo_terms_of_view(*side)[0],
                )
                for side in (here, there)
            ]
            assert np.max(np.abs(steps[0] - steps[1])) < 1e-4


class _Shuffled(Executor):
    """An executor that computes only when asked, last first."""

    def __init__(self) -> None:
        self.calls: list[tuple[Future[Any], Any, Any]] = []

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: _Asked = _Asked(self)
        self.calls.append((future, fn, args))
        return future

    def run(self) -> None:
        for future, fn, args in reversed(self.calls):
            future.set_result(fn(*args))
        self.calls = []


class _Asked(Future[Any]):
    def __init__(self, executor: _Shuffled) -> None:
        super().__init__()
        self.executor = executor

    def result(self, timeout: float | None = None) -> Any:
        self.executor.run()
        return super().result(timeout)


@pytest.mark.usefixtures("cheap")
class TestFitting:
    def test_is_deterministic_by_any_executor_and_lowers_the_error(self, tmp_path: Path) -> None:
        lines: list[str] = []
        fit_anisotropic(tmp_path / "a.npz", **SETTINGS, report=lines.append)
        fit_anisotropic(tmp_path / "b.npz", **SETTINGS, executor=_Shuffled())
        assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()
        assert sorted(p.name for p in tmp_path.iterdir()) == ["a.npz", "b.npz"]
        assert any("left" in line for line in lines)
        fitted = load_anisotropic(tmp_path / "a.npz")
        cases = fit.random_configurations(np.random.default_rng([3, 0]), 60, training=True)
        exact = exact_integrals(cases)
        plain = dataclasses.replace(fitted, residual=np.zeros_like(fitted.residual))
        assert np.mean(fit.shading_errors(fitted, cases, exact)) < 0.6 * np.mean(
            fit.shading_errors(plain, cases, exact)
        )

    def test_on_a_cluster(self, tmp_path: Path) -> None:
        distributed = pytest.importorskip("distributed")
        with (
            np.errstate(all="warn"),
            distributed.Client(
                processes=False, n_workers=2, threads_per_worker=1, dashboard_address=None
            ) as client,
        ):
            fit_anisotropic(tmp_path / "a.npz", **SETTINGS, executor=client.get_executor())
        fit_anisotropic(tmp_path / "b.npz", **SETTINGS)
        assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()

    @pytest.mark.parametrize(
        ("stage", "after"),
        [("albedo at", 1), ("albedo between", 2), ("exact integrals", 2), ("fit: step", 2)],
    )
    def test_interrupted_it_continues_to_the_same_result(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, stage: str, after: int
    ) -> None:
        fit_anisotropic(tmp_path / "whole.npz", **SETTINGS)
        output = tmp_path / "out.npz"
        output.write_bytes(b"old")
        integrals = 0

        def counting(cases: Configurations) -> FloatArray:
            nonlocal integrals
            integrals += cases.count
            return exact_integrals(cases)

        monkeypatch.setattr(fit, "exact_integrals", counting)
        with pytest.raises(KeyboardInterrupt):
            fit_anisotropic(output, **SETTINGS, report=_interrupt(stage, after))
        assert output.read_bytes() == b"old"
        assert fitting.checkpoint_path(output).exists()
        fit_anisotropic(output, **SETTINGS, resume=True)
        assert output.read_bytes() == (tmp_path / "whole.npz").read_bytes()
        assert integrals == SETTINGS["configurations"]
        assert not fitting.checkpoint_path(output).exists()

    def test_an_interrupt_cancels_what_waits(self, tmp_path: Path) -> None:
        with ThreadPoolExecutor(1) as executor, pytest.raises(KeyboardInterrupt):
            fit_anisotropic(
                tmp_path / "out.npz",
                **(SETTINGS | {"configurations": 4000}),
                report=_interrupt("albedo between", 1),
                executor=executor,
            )
        with pytest.raises(fitting.CheckpointError, match=r"shape \[2, 3, 4, 3\].*expected"):
            fit_anisotropic(tmp_path / "out.npz", **(SETTINGS | {"seed": 5}))

    @pytest.mark.parametrize(
        ("change", "message"),
        [
            ({"shape": (4, 4, 8)}, r"shape is \(4, 4, 8\), expected four numbers from 2 to 64"),
            ({"albedo_shape": (1, 4, 8, 8)}, "albedo_shape is"),
            ({"seed": -1}, "seed is -1"),
            ({"configurations": 5}, "configurations is 5"),
        ],
    )
    def test_refuses(self, tmp_path: Path, change: dict[str, Any], message: str) -> None:
        with pytest.raises(ValueError, match=message):
            fit_anisotropic(tmp_path / "out.npz", **(SETTINGS | change))

    @pytest.mark.parametrize("workers", ["1", "2"])
    def test_command(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str], workers: str
    ) -> None:
        output = tmp_path / "out.npz"
        arguments = ["fit", "anisotropic", "--output", str(output), "--shape", "2,2,3,3"]
        arguments += ["--albedo-shape", "2,2,2,2", "--configurations", "32", "--workers", workers]
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(fit_command, "_print_error", lambda figures: None)
            assert command_line.main(arguments) == 0
        out, err = capsys.readouterr()
        assert str(output) in out
        assert "exact integrals: 32 of 32" in err
        assert load_anisotropic(output).residual.shape == (2, 2, 3, 3, 7)


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
    @pytest.mark.parametrize(
        ("arguments", "message"),
        [
            (["--shape", "4,x"], "'4,x' is not a list of numbers like 4,4,8,8"),
            (["--resume", "--fresh"], "not allowed with"),
        ],
    )
    def test_bad_arguments(
        self, arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
    ) -> None:
        with pytest.raises(SystemExit) as caught:
            command_line.main(["fit", "anisotropic", *arguments])
        assert caught.value.code == 2
        error = capsys.readouterr().err
        assert message in error
        assert error.count("\n") == 1

    @pytest.mark.parametrize(
        ("arguments", "message"),
        [
            (["--shape", "4,4,8"], "shape is (4, 4, 8), expected four numbers from 2 to 64"),
            (["--workers", "0"], "workers is 0, expected 1 or more"),
            (["--resume"], "nothing to resume"),
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
        assert command_line.main(["fit", "anisotropic", *arguments]) == 2
        out, error = capsys.readouterr()
        assert not out
        assert message in error
        assert error.count("\n") == 1
        assert list(tmp_path.iterdir()) == []


def test_a_finished_descent_takes_no_step() -> None:
    grid = GridFit((2, 2, 2, 2), [])
    assert list(grid.steps(FitState(np.zeros(grid.shape), done=True))) == []


@pytest.mark.slow
def test_a_smaller_fit_finds_the_shipped_table(shipped: AnisotropicTable, tmp_path: Path) -> None:
    table = fit_anisotropic(tmp_path / "out.npz", seed=99, configurations=12_000)
    figures, documented = table.provenance["error"], shipped.provenance["error"]
    assert figures["rectangles"]["mean"] < documented["rectangles"]["mean"] + 4e-4
    assert figures["variation"]["mean"] < documented["variation"]["mean"] + 4e-3
