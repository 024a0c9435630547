"""LDR-FLIP against what NVIDIA's implementation gives, and properties of the measure."""

from __future__ import annotations

import numpy as np
import pytest

from app.render.flip import flip


def pictures() -> tuple[np.ndarray, np.ndarray]:
    """Waves of colour, and the same with noise on the right and a red block: 40 x 56."""
    rng = np.random.default_rng(7)
    y, x = np.mgrid[0:40, 0:56]
    waves = 0.5 + 0.4 * np.stack([np.sin(x / 5), np.cos(y / 7), np.sin((x + y) / 9)], -1)
    noise = 0.2 * (rng.random((40, 56, 3)) - 0.5) * (x > 28)[..., None]
    other = np.clip(waves + noise, 0.0, 1.0)
    other[10:20, 5:15] = (0.9, 0.1, 0.1)
    first, second = (np.round(255.0 * p).astype(np.uint8) for p in (waves, other))
    return first, second


@pytest.mark.parametrize(
    ("angle", "mean", "points"),
    [
        (67.02064514, 0.11676283, (0.00057954, 0.7359371, 0.128964, 0.23945339)),
        (30.0, 0.15558273, (0.0, 0.83855987, 0.09432387, 0.366031)),
    ],
)
def test_values_of_the_published_implementation(angle, mean, points) -> None:
    """Made with ``flip-evaluator`` 1.7, whose arithmetic is float32."""
    found = flip(*pictures(), angle)
    assert found.mean() == pytest.approx(mean, abs=1e-6)
    places = ((0, 0), (15, 10), (20, 30), (39, 55))
    np.testing.assert_allclose([found[place] for place in places], points, atol=5e-5)


def test_whole_map_of_the_published_implementation() -> None:
    theirs = pytest.importorskip("flip_evaluator")
    a, b = pictures()
    wanted, _, _ = theirs.evaluate(
        (a / 255.0).astype(np.float32), (b / 255.0).astype(np.float32), "LDR", True, False
    )
    np.testing.assert_allclose(flip(a, b), wanted[..., 0], atol=5e-5)


def test_properties() -> None:
    a, b = pictures()
    assert np.all(flip(a, a) == 0.0)
    np.testing.assert_array_equal(flip(a, b), flip(b, a))
    turned = flip(a[::-1, ::-1], b[::-1, ::-1])
    np.testing.assert_allclose(flip(a, b)[::-1, ::-1], turned, atol=1e-9)
    np.testing.assert_allclose(flip(a, b), flip(a / 255.0, b / 255.0), atol=1e-12)
    black, white = np.zeros((9, 9, 3), np.uint8), np.full((9, 9, 3), 255, np.uint8)
    assert 0.9 < flip(black, white).min() <= flip(black, white).max() <= 1.0
    green, blue = black.copy(), black.copy()
    green[..., 1] = blue[..., 2] = 255
    # The two colours of a display that are furthest apart.
    np.testing.assert_allclose(flip(green, blue), 1.0, atol=1e-9)
    # One level of 255, a third of a unit of L*, is next to nothing.
    assert flip(white, white - 1).max() < 0.03


def test_wrong_pictures() -> None:
    a, b = pictures()
    with pytest.raises(ValueError, match=r"shapes \(40, 56, 3\) and \(39, 56, 3\)"):
        flip(a, b[1:])
    with pytest.raises(ValueError, match="pixels_per_degree is 0"):
        flip(a, b, 0.0)
