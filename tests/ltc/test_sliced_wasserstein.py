"""The published fit: samples, distance, derivatives, alignment, symmetries, any BRDF."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from ltc import __main__ as command_line
from ltc import fitting, transform
from ltc import sliced_wasserstein as sw
from ltc.sliced_wasserstein import Brdf, SlicedWasserstein, fit_lobe, fit_published, ggx

FloatArray = NDArray[np.float64]
WO = np.array([0.6, 0.3, np.sqrt(1.0 - 0.45)])


def lambertian(alpha_x: float, alpha_y: float) -> Brdf:
    """Return a BRDF that is a clamped cosine whatever the alphas."""

    def density(wo: FloatArray, wi: FloatArray) -> FloatArray:
        return np.maximum(wi[..., 2], 0.0) / np.pi

    def sample(wo: FloatArray, u: FloatArray) -> FloatArray:
        return transform.sample(u, np.eye(3))

    return Brdf(density, sample, density)


def _example() -> dict[str, Any]:
    """Run the worked example of docs/fitting.md and return what it defines."""
    page = (Path(__file__).resolve().parents[2] / "docs" / "fitting.md").read_text("utf-8")
    found: dict[str, Any] = {}
    exec(re.findall(r"```python\n(.*?)```", page, re.DOTALL)[0], found)
    return found


beckmann = _example()["beckmann"]


class TestSamples:
    @pytest.mark.parametrize("material", [ggx, lambertian, beckmann])
    def test_follow_the_brdf(self, material: Any) -> None:
        """Moments of accepted samples, against an integral over the hemisphere."""
        lobe = material(0.6, 0.3)
        samples = sw.rejection_samples(lobe, WO, 4096, [1])
        z, phi = (np.arange(400) + 0.5) / 400, 2.0 * np.pi * (np.arange(800) + 0.5) / 800
        z, phi = (a.ravel() for a in np.meshgrid(z, phi))
        r = np.sqrt(1.0 - z * z)
        w = np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=-1)
        density = lobe.evaluate(np.broadcast_to(WO, w.shape), w)
        total = np.sum(density)
        np.testing.assert_allclose(np.mean(samples, axis=0), density @ w / total, atol=0.015)
        second = np.einsum("n,ni,nj->ij", density, w, w) / total
        np.testing.assert_allclose(samples.T @ samples / 4096, second, atol=0.015)
        albedo, fresnel = sw.albedo(lobe, WO)
        assert albedo == pytest.approx(total * 2.0 * np.pi / w.shape[0], rel=0.01)
        assert 0.0 < fresnel < albedo

    def test_a_brdf_that_reflects_nothing_is_refused(self) -> None:
        lobe = ggx(0.5, 0.5)
        nothing = Brdf(lambda wo, wi: 0.0 * wi[..., 0], lobe.sample, lobe.pdf)
        with pytest.raises(ValueError, match=r"fewer than 64 were accepted.*smaller bound"):
            sw.rejection_samples(nothing, WO, 64, [1])


class TestDistance:
    def test_of_a_shifted_set(self, rng: np.random.Generator) -> None:
        f = rng.normal(size=(64, 3))
        shift = np.array([0.1, -0.2, 0.3])
        directions = sw.slice_directions(128)
        want = np.mean(np.abs(directions @ shift))
        assert sw.sliced_wasserstein(f, f[::-1] + shift, directions) == pytest.approx(want)
        assert sw.sliced_wasserstein(f, f[::-1], directions) == 0.0

    def test_derivatives(self, rng: np.random.Generator) -> None:
        target = sw.rejection_samples(ggx(0.4, 0.15), WO, 256, [5])
        distance = SlicedWasserstein(target, sw.slice_directions(24))
        M = sw.starting_matrix(target) @ (np.eye(3) + 0.2 * rng.normal(size=(3, 3)))
        loss, curvature, slope = distance.normal_equations(M)
        assert loss == pytest.approx(distance.loss(M))
        assert np.min(np.linalg.eigvalsh(curvature)) > 0.0
        # The slope is that of squares with fixed weights; with weights 1/|e| of the loss.
        softening = sw._SOFTENING
        sw._SOFTENING = 0.0
        try:
            _, _, slope = distance.normal_equations(M)
        finally:
            sw._SOFTENING = softening
        for i in range(7):
            step = np.zeros(7)
            step[i] = 1e-6
            high, low = (distance.loss(M @ (np.eye(3) + sw._change(s))) for s in (step, -step))
            assert slope[i] == pytest.approx((high - low) / 2e-6, rel=2e-3, abs=1e-4)


class TestFit:
    def test_finds_a_known_lobe(self, rng: np.random.Generator) -> None:
        """Samples of a transformed cosine give back its density, from a start by moments."""
        M = np.array([[0.3, 0.05, 0.4], [0.0, 0.1, -0.2], [-0.1, 0.0, 0.9]])
        u = rng.random((1024, 2))
        found, loss = fit_lobe(transform.sample(u, M))
        w = transform.sample(rng.random((50, 2)), M)
        np.testing.assert_allclose(
            transform.evaluate(w, found), transform.evaluate(w, M), rtol=0.25
        )
        assert loss < 0.02

    @pytest.mark.parametrize("alphas", [(1e-4, 1e-4), (0.5, 1e-4), (0.3, 0.1), (1.0, 1.0)])
    @pytest.mark.parametrize("theta", [0.0, 50.0, 89.9])
    def test_every_lobe_starts_close_and_improves(
        self, alphas: tuple[float, float], theta: float
    ) -> None:
        s, c = np.sin(np.radians(theta)), np.cos(np.radians(theta))
        wo = np.array([s * np.cos(0.7), s * np.sin(0.7), c])
        target = sw.rejection_samples(ggx(*alphas), wo, 512, [9])
        distance = SlicedWasserstein(target, sw.slice_directions(48))
        start = sw.starting_matrix(target)
        size = np.sqrt(np.sum(np.var(target, axis=0)))
        M, loss = fit_lobe(target)
        assert loss <= distance.loss(start) < 0.4 * size
        assert loss < 0.15 * size  # a lune of half the hemisphere is worst
        assert np.linalg.det(M) > 0.0

    def test_alignment_undoes_rotations(self, rng: np.random.Generator) -> None:
        M = np.eye(3) + 0.2 * rng.normal(size=(3, 3))
        for angle in (0.3, 2.0, 4.0):
            R = sw._rotations(np.array([angle]))[0]
            np.testing.assert_allclose(sw.align(M @ R), sw.align(M), atol=2e-3)
        np.testing.assert_allclose(
            sw.align(np.diag([2.0, 2.0, 1.0])), np.diag([2, 2, 1]), atol=2e-3
        )

    @pytest.mark.parametrize("axis", [0, 1])
    def test_straightening_changes_no_lobe(self, rng: np.random.Generator, axis: int) -> None:
        M = np.eye(3) + 0.2 * rng.normal(size=(3, 3))
        straight = sw.straighten(M, axis)
        assert abs(straight[axis, 1 - axis]) < 1e-15
        w = transform.sample(rng.random((20, 2)), M)
        np.testing.assert_allclose(transform.evaluate(w, straight), transform.evaluate(w, M))

    def test_symmetries(self, rng: np.random.Generator) -> None:
        table = sw.symmetrise(np.eye(3) + 0.2 * rng.normal(size=(2, 2, 3, 4, 3, 3)))
        np.testing.assert_array_equal(table[..., 0, [0, 1, 1, 2], [1, 0, 2, 1]], 0.0)
        np.testing.assert_array_equal(table[..., -1, [0, 0, 1, 2], [1, 2, 0, 0]], 0.0)
        upright = table[:, :, 0]
        np.testing.assert_array_equal(upright, np.broadcast_to(upright[:, :, :1], upright.shape))
        off = ~np.eye(3, dtype=bool)
        np.testing.assert_array_equal(upright[..., off], 0.0)
        np.testing.assert_allclose(np.linalg.norm(table[..., 2], axis=-1), 1.0)


class TestTable:
    SHAPE = (2, 2, 2, 3)

    def test_any_brdf(self, tmp_path: Path) -> None:
        table = fit_published(tmp_path / "x.npy", self.SHAPE, material=lambertian)
        np.testing.assert_allclose(table.albedo, 1.0, atol=1e-6)
        np.testing.assert_allclose(
            table.matrices, np.broadcast_to(np.eye(3), (*self.SHAPE, 3, 3)), atol=0.06
        )

    def test_interrupted_it_continues_to_the_same_result(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(sw, "_PIECE", 4)
        monkeypatch.setattr(sw, "_STEPS", 2)
        monkeypatch.setattr(fitting, "SAVE_EVERY", 0.0)
        fit_published(tmp_path / "whole.npy", self.SHAPE)
        lines = 0

        def interrupt(message: str) -> None:
            nonlocal lines
            lines += 1
            if lines == 3:
                raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            fit_published(tmp_path / "out.npy", self.SHAPE, report=interrupt)
        assert not (tmp_path / "out.npy").exists()
        fit_published(tmp_path / "out.npy", self.SHAPE, resume=True)
        for one, other in zip(
            sw.published_files(tmp_path / "out.npy"),
            sw.published_files(tmp_path / "whole.npy"),
            strict=True,
        ):
            assert one.read_bytes() == other.read_bytes()
        assert len(list(tmp_path.iterdir())) == 6

    def test_command(self, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        output = tmp_path / "out.npy"
        arguments = ["fit", "published", "--output", str(output), "--shape", "2,2,2,2"]
        assert command_line.main([*arguments, "--workers", "1"]) == 0
        out, err = capsys.readouterr()
        assert "sliced Wasserstein distance  mean" in out
        assert "entries: 16 of 16" in err
        matrices = np.load(output)
        assert matrices.shape == (2, 2, 2, 2, 3, 3)
        assert np.all(np.linalg.det(matrices) > 0.0)

    @pytest.mark.parametrize(
        ("arguments", "message"),
        [({"shape": (2, 2, 2)}, r"shape is \(2, 2, 2\)"), ({"seed": -1}, "seed is -1")],
    )
    def test_refuses(self, tmp_path: Path, arguments: dict[str, Any], message: str) -> None:
        with pytest.raises(ValueError, match=message):
            fit_published(tmp_path / "x.npy", **arguments)
