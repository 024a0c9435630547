"""Sobol's first two dimensions, scrambled: against scipy's, and by what they promise."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2, qmc

from ltc.sequence import pascal_digits, point_bits, reversed_bits, sequence_point


def test_unscrambled_it_is_sobols_sequence():
    index = np.arange(4096)
    ours = np.stack([reversed_bits(index), reversed_bits(pascal_digits(index))], axis=-1)
    theirs = qmc.Sobol(2, scramble=False, bits=32).random(4096) * 2.0**32
    # scipy goes through every 2^m points in Gray code's order.
    assert {tuple(p) for p in ours} == {tuple(p) for p in theirs.astype(np.uint32)}


def test_reversing_bits_twice_is_nothing():
    x = np.random.default_rng(0).integers(0, 2**32, 1000, dtype=np.uint32)
    assert f"{int(reversed_bits(np.uint32(0b1011))):032b}" == "1101" + 28 * "0"
    np.testing.assert_array_equal(reversed_bits(reversed_bits(x)), x)


@pytest.mark.parametrize("parity", [0, 1])
def test_every_box_of_a_run_holds_one_point(parity):
    """Runs of 2^m samples of one parity, wherever they start at a multiple of 2^m."""
    pixel = np.random.default_rng(1).integers(0, 4096, (64, 1, 2))
    for m in (1, 4, 9):
        for run in (0, 1, 5, 1000):
            samples = 2 * (run * 2**m + np.arange(2**m)) + parity
            points = point_bits(pixel, samples, 3).astype(np.uint64)
            for k in range(m + 1):
                box = (points[..., 0] >> (32 - k) << (m - k)) + (points[..., 1] >> (32 - m + k))
                assert np.all(np.sort(box, axis=-1) == np.arange(2**m))


def cells(points: np.ndarray, side: int) -> np.ndarray:
    index = np.floor(points * side).astype(int)
    return np.bincount(index @ side ** np.arange(points.shape[-1]), minlength=side**2)


def test_a_sample_is_uniform_over_pixels():
    """And so is its pair with another purpose, pixel or sequence: chi-square of 64 x 64 cells."""
    y, x = np.meshgrid(np.arange(512), np.arange(512), indexing="ij")
    pixel = np.stack([x, y], axis=-1)
    unlikely = chi2.isf(1e-4, 64 * 64 - 1)
    points = {key: sequence_point(pixel, *key) for key in [(0, 0), (1, 0), (2, 0), (0, 1), (77, 2)]}
    pairs = [
        *points.values(),
        *(
            np.stack([points[a][..., i], points[b][..., j]], axis=-1)
            for a, b in [((0, 0), (1, 0)), ((0, 0), (0, 1)), ((1, 0), (77, 2))]
            for i in range(2)
            for j in range(2)
        ),
        np.stack([points[0, 0][:, :-1, 0], points[0, 0][:, 1:, 0]], axis=-1),
        np.stack([points[0, 0][:-1, :, 1], points[0, 0][1:, :, 1]], axis=-1),
    ]
    for pair in pairs:
        count = cells(pair.reshape(-1, 2), 64)
        expected = count.sum() / count.size
        assert np.sum((count - expected) ** 2) / expected < unlikely


def test_means_converge_faster_than_random_ones():
    """Of a smooth function and of a step: 1/n^1.5 at best, and n^-.75; random ones n^-.5."""
    pixel = np.stack([np.arange(400), np.full(400, 9)], axis=-1)[:, None]
    errors = []
    for n in (64, 1024):
        x, y = np.moveaxis(sequence_point(pixel, np.arange(n), 0), -1, 0)
        smooth = np.mean(np.exp(x) * y, axis=1) - 0.5 * (np.e - 1.0)
        step = np.mean(x * x + y * y < 1.0, axis=1) - 0.25 * np.pi
        errors.append([np.sqrt(np.mean(e * e)) for e in (smooth, step)])
    smooth, step = np.divide(*errors)
    assert smooth > 16**1.3
    assert step > 16**0.65
