"""Lobes fitted to one view each."""

from __future__ import annotations

import numpy as np
import pytest

from ltc import brdf
from ltc.objective import exact_integrals, random_lights
from ltc.point_fit import LEAST_COSINE, fit_points
from ltc.polygon import ltc_specular
from ltc.table import load_isotropic


def views(theta: np.ndarray, phi: float = 0.0) -> np.ndarray:
    s = np.sin(theta)
    return np.stack([s * np.cos(phi), s * np.sin(phi), np.cos(theta)], axis=-1)


ALPHA = np.array([0.02, 0.1, 0.3, 0.8])
WO = views(np.radians([20.0, 70.0, 45.0, 84.0]))


def mean_errors(matrix: np.ndarray, albedo: np.ndarray) -> np.ndarray:
    """Return each lobe's mean error over lights that it was not fitted to."""
    count, means = 200, []
    for i, alpha in enumerate(ALPHA):
        alphas = np.full(count, alpha)
        cases = random_lights(
            np.random.default_rng(50 + i), alphas, alphas, np.tile(WO[i], (count, 1))
        )
        M = np.broadcast_to(matrix[i], (count, 3, 3))
        means.append(
            np.mean(np.abs(ltc_specular(M, [cases.corners], albedo[i]) - exact_integrals(cases)))
        )
    return np.array(means)


def test_no_worse_than_the_table() -> None:
    done: list[int] = []
    fitted = fit_points(ALPHA, ALPHA, WO, done.append)
    assert done == [1, 2, 3, 4]
    table = load_isotropic()
    cosine = WO[:, 2]
    of_table = mean_errors(table.matrix(ALPHA, cosine), table.albedo_terms(ALPHA, cosine)[0])
    # Fitted to 96 lights, measured on 200 others.
    assert np.all(mean_errors(fitted.matrix, fitted.albedo) < 1.12 * of_table + 2e-5)
    A, B = brdf.directional_albedo(WO, ALPHA, ALPHA)
    np.testing.assert_allclose(fitted.albedo, A, rtol=1e-7)
    np.testing.assert_allclose(fitted.fresnel, B, rtol=1e-7)
    np.testing.assert_allclose(np.linalg.norm(fitted.matrix[:, :, 2], axis=1), 1.0)
    assert np.all(np.linalg.det(fitted.matrix) > 0.0)


def test_a_view_does_not_depend_on_the_others() -> None:
    both = fit_points(ALPHA[:2], ALPHA[:2], WO[:2], lights=16)
    alone = fit_points(ALPHA[1:2], ALPHA[1:2], WO[1:2], lights=16)
    np.testing.assert_array_equal(both.matrix[1], alone.matrix[0])


def test_extremes_stay_regular() -> None:
    wo = np.concatenate([WO[:1], views(np.array([0.0, 0.5 * np.pi])), views(np.array([1.0]), 0.6)])
    found = fit_points([1e-6, 1.0, 0.3, 0.05], [1e-6, 1.0, 0.3, 0.6], wo, lights=16)
    for part in found:
        assert np.all(np.isfinite(part))
    assert np.all(np.linalg.cond(found.matrix) < 1e6)
    low = fit_points([0.3], [0.3], views(np.array([np.arccos(LEAST_COSINE)])), lights=16)
    np.testing.assert_allclose(found.matrix[2], low.matrix[0], atol=1e-6)


def test_wrong_input() -> None:
    with pytest.raises(ValueError, match=r"\(4,\), \(4,\) and \(3, 3\)"):
        fit_points(ALPHA, ALPHA, WO[:3])
    with pytest.raises(ValueError, match="lights is 2"):
        fit_points(ALPHA, ALPHA, WO, lights=2)
