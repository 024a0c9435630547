"""Cubics against their polynomials: points, parts, and where they change sign."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ltc import bezier

SQUARE = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


def test_evaluate_split_and_part(rng: np.random.Generator) -> None:
    p = rng.normal(size=(50, 4, 3))
    t, s = rng.random((2, 50))
    b = [(1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3]
    point = sum(b[j][:, None] * p[:, j] for j in range(4))
    np.testing.assert_allclose(bezier.evaluate(p, t), point, atol=1e-14)
    step = 1e-6
    difference = (bezier.evaluate(p, t + step) - bezier.evaluate(p, t - step)) / (2 * step)
    np.testing.assert_allclose(bezier.derivative(p, t), difference, atol=1e-8)
    before, after = bezier.split(p, t)
    np.testing.assert_array_equal(before[:, 3], after[:, 0])
    np.testing.assert_array_equal(before[:, 0], p[:, 0])
    np.testing.assert_array_equal(after[:, 3], p[:, 3])
    np.testing.assert_allclose(bezier.evaluate(before, s), bezier.evaluate(p, s * t), atol=1e-14)
    np.testing.assert_allclose(
        bezier.evaluate(after, s), bezier.evaluate(p, t + s * (1 - t)), atol=1e-14
    )
    lo, hi = np.minimum(s, t), np.maximum(s, t)
    np.testing.assert_allclose(
        bezier.evaluate(bezier.part(p, lo, hi), 0.3),
        bezier.evaluate(p, lo + 0.3 * (hi - lo)),
        atol=1e-14,
    )
    np.testing.assert_array_equal(bezier.part(p, 0.0, 1.0), p)


def test_raised_curves_are_the_same_curves(rng: np.random.Generator) -> None:
    q, t = rng.normal(size=(20, 3, 3)), rng.random(20)
    s = t[:, None]
    parabola = (1 - s) ** 2 * q[:, 0] + 2 * s * (1 - s) * q[:, 1] + s**2 * q[:, 2]
    np.testing.assert_allclose(bezier.evaluate(bezier.from_quadratic(q), t), parabola, atol=1e-15)
    line = bezier.from_line(q[:, 0], q[:, 2])
    straight = (1 - s) * q[:, 0] + s * q[:, 2]
    np.testing.assert_allclose(bezier.evaluate(line, t), straight, atol=1e-15)
    np.testing.assert_array_equal(bezier.flatten(bezier.from_polygon(SQUARE), 1), SQUARE)


def sampled_changes(b: np.ndarray) -> np.ndarray:
    """Return how often cubics (m, 4) change sign, by 4,001 samples."""
    t = np.linspace(0.0, 1.0, 4_001)
    f = np.stack([(1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3])
    positive = b @ f > 0.0
    return np.sum(positive[:, 1:] != positive[:, :-1], axis=-1)


@pytest.mark.parametrize("kind", ["cubics", "raised quadratics", "lines", "tiny", "huge"])
def test_sign_changes(kind: str, rng: np.random.Generator) -> None:
    b = rng.normal(size=(500, 4))
    if kind == "raised quadratics":
        b = bezier.from_quadratic(rng.normal(size=(500, 3, 1)))[..., 0]
    elif kind == "lines":
        b = bezier.from_line(b[:, :1], b[:, 3:])[..., 0]
    elif kind == "tiny":
        b *= 1e-250
    elif kind == "huge":
        b *= 1e250
    places, count = bezier.sign_changes(b)
    assert np.all(np.diff(places, axis=-1) >= 0.0)
    assert np.array_equal(count % 2 == 1, (b[:, 0] > 0.0) != (b[:, 3] > 0.0))
    scale = np.max(np.abs(b), axis=-1, keepdims=True)
    at = bezier.evaluate((b / scale)[:, None, :, None], places)[..., 0]
    found = np.arange(3) < count[:, None]
    assert np.max(np.abs(at[found])) < 1e-14
    assert np.all(places[~found] == 1.0)
    # Samples miss pairs of changes that are closer than their spacing.
    missed = count != sampled_changes(b / scale)
    assert np.sum(missed) <= 2


def test_sign_changes_in_stiff_cases() -> None:
    cases = {
        (0.0, 1.0, 1.0, 1.0): [0.0],  # an end on the horizon: zero is not above it
        (0.0, -1.0, -1.0, -1.0): [],
        (1.0, 1.0, 1.0, 0.0): [1.0],
        (-1.0, -1.0, -1.0, 0.0): [],
        (0.0, 0.0, 0.0, 0.0): [],
        (0.0, 0.0, 0.0, 1.0): [0.0],  # a triple root
        (1.0, -1.0, 1.0, -1.0): [0.5],
        (-1.0, 1.0, -1.0, 1.0): [0.5],
        (0.0, 1.0, -1.0, 0.0): [0.0, 0.5],
        (0.0, -1.0, 1.0, 0.0): [0.5, 1.0],
        (0.25, -1 / 12, -1 / 12, 0.25): [],  # touches at the middle
        (-1.0, -1 / 3, 1 / 3, 1.0): [0.5],
        (-0.125, 0.125, -0.125, 0.125): [0.5],
    }
    for coefficients, expected in cases.items():
        places, count = bezier.sign_changes(coefficients)
        assert count == len(expected), coefficients
        assert list(places[:count]) == pytest.approx(expected, abs=3e-6), coefficients
    triple = [(-0.3) ** 3, 0.3**2 * 0.7, -0.3 * 0.7**2, 0.7**3]
    places, count = bezier.sign_changes(triple)
    assert count in (1, 3)
    assert places[0] == pytest.approx(0.3, abs=1e-5)


@given(
    st.lists(st.sampled_from([-1.0, -1e-3, -1e-18, 0.0, 1e-18, 1e-3, 1.0]), min_size=4, max_size=4)
)
def test_sign_changes_alternate(coefficients: list[float]) -> None:
    b = np.array(coefficients)
    places, count = bezier.sign_changes(b)
    assert (count % 2 == 1) == ((b[0] > 0.0) != (b[3] > 0.0))
    if count:
        middles = np.concatenate([[0.0], places[:count], [1.0]])
        middles = 0.5 * (middles[1:] + middles[:-1])
        above = (b[0] > 0.0) != (np.arange(count + 1) % 2 == 1)
        f = bezier.evaluate(b[:, None], middles)[:, 0]
        # Parts narrower than rounding cannot tell.
        wide = np.diff(np.concatenate([[0.0], places[:count], [1.0]])) > 1e-6
        sure = wide & (np.abs(f) > 1e-16 * np.max(np.abs(b)))
        assert np.array_equal((f > 0.0)[sure], above[sure])
