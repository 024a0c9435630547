"""Lobes beside each other: integrals, peaks, differences and pictures, by other routes."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import minimize

from ltc import brdf, lobe
from ltc.anisotropic import load_anisotropic
from ltc.lobe import Case, LobePair, Window, lobe_pair
from ltc.table import ALPHA_MIN, load_isotropic, sample_textures

FloatArray = NDArray[np.float64]
PIXELS = 512
SOLID_ANGLE = 8.0 / PIXELS**2  # of a pixel of the whole disk


def random_cases(rng: np.random.Generator, count: int, least: float) -> list[Case]:
    """Return cases with both alphas above ``least``, every third isotropic."""
    cases = []
    for i in range(count):
        ax, ay = np.exp(rng.uniform(np.log(least), 0.0, 2)).tolist()
        theta, phi = np.radians(rng.uniform(0.0, 88.0)), rng.uniform(-np.pi, np.pi)
        cases.append(Case(ax, ax if i % 3 == 0 else ay, float(theta), float(phi)))
    return cases


def test_integrals(rng: np.random.Generator) -> None:
    """Over the whole disk: the albedos, and the total variation, of lobes that pixels resolve."""
    for case in random_cases(rng, 9, 0.1):
        pair = lobe_pair(case)
        ggx, ltc = lobe.pictures(pair, PIXELS)
        assert np.isnan(ggx).sum() == np.isnan(ltc).sum()
        # The rim's pixels are in or out as a whole: about 1 in 2 PIXELS of the lobe there.
        np.testing.assert_allclose(np.nansum(ggx) * SOLID_ANGLE, pair.exact_albedo, atol=1.5e-3)
        np.testing.assert_allclose(np.nansum(ltc) * SOLID_ANGLE, pair.albedo, atol=1.5e-3)
        shapes = ggx / pair.exact_albedo - ltc / pair.albedo
        variation = 0.5 * np.nansum(np.abs(shapes)) * SOLID_ANGLE
        assert pair.variation == pytest.approx(variation, abs=4e-3)  # .003 of it the samples'


def test_albedos_are_those_of_the_tables(rng: np.random.Generator) -> None:
    for case in random_cases(rng, 9, 0.01):
        pair = lobe_pair(case)
        exact, _ = brdf.directional_albedo(case.wo, case.alpha_x, case.alpha_y, 0.05)
        assert pair.exact_albedo == pytest.approx(float(exact), abs=2e-8)
        # The doctor's largest error of either table's albedo is .031 (docs/tables.md).
        assert pair.albedo == pytest.approx(pair.exact_albedo, abs=0.031)


def test_the_table_is_the_material_s() -> None:
    case = Case(0.05, 0.4, 1.0, 0.5)
    pair = lobe_pair(case)
    assert pair.table == "ltc_anisotropic.npz"
    want = load_anisotropic().matrix(0.05, 0.4, np.cos(1.0), 0.5)
    np.testing.assert_allclose(pair.M, want, atol=1e-12)

    round_case = Case(0.2, 0.2, 1.0, 0.5)
    pair = lobe_pair(round_case)
    assert pair.table == "ltc_isotropic.npz"
    M, A, _ = sample_textures(load_isotropic().textures(), 0.2, np.cos(1.0))
    assert pair.albedo == float(A)
    np.testing.assert_allclose(pair.M, lobe.about_normal(0.5) @ M, atol=1e-12)
    # Turned about the normal the lobe is another's, at a view that is turned as far.
    w = lobe.direction_from_disk(np.random.default_rng(1).uniform(-0.6, 0.6, (50, 2)))
    unturned = lobe_pair(Case(0.2, 0.2, 1.0)).ltc(w @ lobe.about_normal(0.5))
    np.testing.assert_allclose(pair.ltc(w), unturned, rtol=1e-12)


def peak(pair: LobePair, name: str) -> tuple[FloatArray, float]:
    """Return where one of the lobes is largest, (2,) in the disk, and how large."""
    value = getattr(pair, name)

    def negative(p: FloatArray) -> float:
        inside = float(p @ p) < 1.0
        return -float(value(lobe.direction_from_disk(p))) if inside else 0.0

    scale = pair.window.half
    grid = np.stack(np.meshgrid(*[np.linspace(-1.0, 1.0, 81)] * 2), axis=-1).reshape(-1, 2)
    starts = np.array([pair.window.x, pair.window.y]) + scale * grid
    starts = starts[np.sum(starts * starts, axis=-1) < 1.0]
    best = starts[np.argmax(value(lobe.direction_from_disk(starts)))]
    simplex = best + 0.02 * scale * np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    options = {"initial_simplex": simplex, "xatol": 1e-4 * scale, "fatol": 0.0}
    found = minimize(negative, best, method="Nelder-Mead", options=options)
    return found.x, -found.fun


def test_the_brightest_pixel_is_where_the_peak_is(rng: np.random.Generator) -> None:
    for case in random_cases(rng, 6, 0.02):
        pair = lobe_pair(case)
        size, window = 96, pair.window
        for name, values in zip(("ggx", "ltc"), lobe.pictures(pair, size, window), strict=True):
            at, most = peak(pair, name)
            row, column = np.unravel_index(np.nanargmax(values), values.shape)
            step = 2.0 * window.half / size
            x = window.x - window.half + (column + 0.5) * step
            y = window.y + window.half - (row + 0.5) * step
            # A ridge may be flat along its length: as good a pixel is as good.
            nearest = np.hypot(x - at[0], y - at[1]) < 1.5 * step
            assert nearest or values[row, column] > 0.98 * most, (case, name)
            assert pair.peak > 0.9 * most


def test_the_window_follows_the_lobe() -> None:
    """Whatever the alphas, the window holds nearly all of both lobes, and little else."""
    for ax in (ALPHA_MIN, 1e-3, 0.01, 0.1, 1.0):
        for ay in (ALPHA_MIN, 0.01, 1.0):
            for theta in (0.0, 0.5, 1.2, 1.5):
                pair = lobe_pair(Case(ax, ay, theta, 0.7))
                ggx, ltc = lobe.pictures(pair, 256, pair.window)
                area = 2.0 * (2.0 * pair.window.half / 256) ** 2
                if min(ax, ay) * pair.window.zoom > 0.03:  # pixels resolve the lobe
                    assert np.nansum(ggx) * area > 0.85 * pair.exact_albedo
                    assert np.nansum(ltc) * area > 0.8 * pair.albedo
                assert np.nanmax(ggx) <= 1.2 * pair.peak
                reach = abs(pair.window.x) + pair.window.half, abs(pair.window.y) + pair.window.half
                assert max(reach) <= 1.0 + 1e-12
    assert lobe_pair(Case(ALPHA_MIN, ALPHA_MIN, 0.5)).window.zoom >= 512
    assert lobe_pair(Case(0.8, 0.8, 0.5)).window == Window()


def test_the_disk_is_of_equal_areas(rng: np.random.Generator) -> None:
    z, phi = rng.random(4000), rng.uniform(0.0, 2.0 * np.pi, 4000)
    r = np.sqrt(1.0 - z * z)
    w = np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=-1)
    p = lobe.disk_from_direction(w)
    np.testing.assert_allclose(np.sum(p * p, axis=-1), 1.0 - z, atol=1e-14)
    np.testing.assert_allclose(lobe.direction_from_disk(p), w, atol=1e-12)
    directions, inside = lobe.pixel_directions(64)
    assert inside.sum() == len(directions)
    first = np.argwhere(inside)[0]
    assert first[0] == 0, "row 0 is at the top"
    assert directions[0, 1] > 0.9, "and the top is +y"


@pytest.mark.parametrize(
    ("numbers", "named"),
    [
        ((0.0, 0.1, 0.0), "alpha_x is 0"),
        ((0.1, 1.5, 0.0), "alpha_y is 1.5"),
        ((0.1, 0.1, 1.5708), "theta is 1.5708"),
        ((0.1, 0.1, float("nan")), "theta is nan"),
    ],
)
def test_numbers_out_of_range(numbers: tuple[float, float, float], named: str) -> None:
    with pytest.raises(ValueError, match=named):
        Case(*numbers)
