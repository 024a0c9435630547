"""Pyramids of pictures: filters against their formula, coverage against areas, extremes."""

import re

import numpy as np
import pytest

from ltc.bezier import from_polygon
from ltc.picture_cells import bilinear, coverage
from ltc.prefilter import PAD, RADIUS, level_size, prefilter
from ltc.reference import winding_number

K = 0.5522847498  # a quarter of a circle as a cubic, within 3e-4


def circle(radius: float, clockwise: bool = False) -> np.ndarray:
    """Return a contour (4, 4, 2) about the picture's middle."""
    c = np.array([[1.0, 0.0], [1.0, K], [K, 1.0], [0.0, 1.0]])
    turn = np.array([[0.0, 1.0], [-1.0, 0.0]])
    contour = 0.5 + radius * np.stack([c @ np.linalg.matrix_power(turn, k) for k in range(4)])
    return contour[::-1, ::-1] if clockwise else contour


RING = [circle(0.5), circle(0.22, clockwise=True)]
STAR = [
    from_polygon(
        0.5
        + np.array([0.5, 0.21] * 5)[:, None]
        * np.stack([np.cos(np.pi * np.arange(10) / 5), np.sin(np.pi * np.arange(10) / 5)], axis=-1)
    )
]


@pytest.mark.parametrize("size", [(1, 1), (5, 3), (40, 33)])
def test_coverage_is_area(size: tuple[int, int]) -> None:
    """Sums against the shoelace formula and Green's for circles; texels against points inside."""
    columns, rows = size
    disc = np.pi * (0.5**2 - 0.22**2)
    got = coverage(np.concatenate(RING), columns, rows)
    assert np.mean(got) == pytest.approx(disc, rel=6e-4)  # the cubics' circles are that round
    corners = STAR[0][:, 0]
    x, y = corners.T
    area = 0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))
    got = coverage(STAR[0], columns, rows)
    assert np.mean(got) == pytest.approx(area, abs=1e-13)
    n = 12
    u, v = ((np.arange(n * k) + 0.5) / (n * k) for k in size)
    points = np.stack([np.tile(u, v.size), np.repeat(v, u.size), np.ones(u.size * v.size)], axis=-1)
    lifted = np.concatenate([corners, np.ones((10, 1))], axis=-1)
    inside = winding_number([lifted], points).reshape(rows, n, columns, n)
    # Within a texel of n x n points at most one row or column of them is off.
    assert np.max(np.abs(inside.mean(axis=(1, 3)) - got)) < 2.0 / n


@pytest.mark.parametrize("shape", [(1, 1), (1, 4096), (300, 2), (33, 100)])
@pytest.mark.parametrize("outline", [None, RING, STAR], ids=["square", "ring", "star"])
def test_constant_pictures_stay_constant(shape: tuple[int, int], outline: object) -> None:
    """At every place of every level; black stays black, 1e6 stays 1e6."""
    picture = np.empty((*shape, 3))
    picture[...] = [1e6, 0.0, 1.0]
    pyramid = prefilter(picture, outline)  # type: ignore[arg-type]
    for level in pyramid.levels:
        cover = level[..., 3]
        assert np.all((cover >= 0.0) & (cover <= 1.0 + 1e-6))
        lit = cover > 1e-30
        mean = level[lit] / cover[lit][:, None]
        # A few float32 roundings for each of up to 13 levels.
        assert np.allclose(mean[:, 0], 1e6, rtol=3e-6)
        assert np.all(mean[:, 1] == 0.0)
        assert np.allclose(mean[:, 2], 1.0, rtol=3e-6)
    assert pyramid.levels[-1].shape == (1, 1, 4)
    assert np.all(pyramid.levels[0][..., 3] > 0.0)


def test_sizes_are_powers_of_two() -> None:
    assert [level_size(n) for n in (1, 32, 33, 600, 1024, 8192)] == [32, 32, 64, 1024, 1024, 4096]
    shapes = [level.shape[:2] for level in prefilter(np.ones((70, 20, 1))).levels]
    assert shapes == [(128 >> k, max(32 >> k, 1)) for k in range(8)]


@pytest.mark.parametrize("k", [0, 1, 2, 3])
def test_the_filter_is_the_projected_cosine(k: int) -> None:
    """One white texel in black comes out nearly as T: a tenth of its mass is elsewhere.

    RADIUS is that of what is fetched: between texels, which makes it wider, and between levels;
    1.15 fits the texels themselves better, and errs more (`docs/textures.md`). The first
    level is not much wider than the texel.
    """
    size = 128
    picture = np.zeros((size, size, 1))
    picture[size // 2, size // 2] = 1.0
    level = prefilter(picture).levels[k][..., 0].astype(np.float64)
    n = level.shape[0]
    pitch = (1.0 + 2.0 * PAD) / n
    x = (np.arange(n) + 0.5) * pitch - PAD - (size // 2 + 0.5) / size
    d = RADIUS * pitch
    exact = 1.0 / (np.pi * d * d * (1.0 + (x**2 + x[:, None] ** 2) / d**2) ** 2) / size**2
    difference = np.sum(np.abs(level - exact)) / np.sum(exact)
    assert 0.5 * difference < (0.19 if k == 0 else 0.12)


def test_level_zero_averages_the_picture(rng: np.random.Generator) -> None:
    """Mass is kept: of the texels on the light, of all of them, and of each level's sum."""
    picture = rng.random((45, 83, 2))
    pyramid = prefilter(picture, RING)
    # Against sums over a fine grid of the bilinear picture times coverage.
    n = 768
    x = (np.arange(n) + 0.5) / n
    fine = bilinear(picture, np.stack(np.meshgrid(x, x), axis=-1))
    cover = coverage(np.concatenate(RING), n, n)[..., None]
    mean = np.sum(fine * cover, axis=(0, 1)) / np.sum(cover)
    # Coverage and picture are averaged apart within texels of the outline: 1e-3.
    top = pyramid.levels[-1][0, 0]
    assert top[:2] / top[2] == pytest.approx(mean, rel=0.02)


def test_levels_are_linear_and_symmetric(rng: np.random.Generator) -> None:
    a, b = rng.random((2, 19, 31, 1))
    la, lb = prefilter(a).levels, prefilter(b).levels
    both = prefilter(2.0 * a + b).levels
    mirrored = prefilter(a[:, ::-1]).levels
    for p, q, r, m in zip(la, lb, both, mirrored, strict=True):
        assert r[..., 0] == pytest.approx(2.0 * p[..., 0] + q[..., 0], abs=2e-6)
        assert m[:, ::-1] == pytest.approx(p, abs=2e-6)


def test_threads_change_nothing(rng: np.random.Generator) -> None:
    picture = rng.random((40, 40, 3))
    for a, b in zip(
        prefilter(picture, threads=1).levels, prefilter(picture, threads=3).levels, strict=True
    ):
        assert np.array_equal(a, b)


def test_half_floats_keep_faint_coverage(rng: np.random.Generator) -> None:
    """Means change by a few parts in a thousand at most, HDR and far from a tiny light."""
    speck = [0.5 + 0.01 * (circle(0.5) - 0.5)]
    picture = 1e6 * rng.random((256, 256, 3)) ** 8
    pyramid = prefilter(picture, speck)
    half, scale = pyramid.half()
    assert scale == pytest.approx(np.max(pyramid.picture[..., :3]))
    for a, b in zip(pyramid.levels, half.levels, strict=True):
        lit = a[..., 3] > 1e-7
        mean, other = (level[lit][:, :3] / level[lit][:, 3:] for level in (a, b))
        bright = mean > 1e-3 * scale
        assert np.max(np.abs(other / np.maximum(mean, 1.0) - 1.0)[bright]) < 4e-3


@pytest.mark.parametrize(
    ("picture", "message"),
    [
        (np.ones((3, 3)), "picture has shape (3, 3), expected (rows, columns, channels)"),
        (np.ones((0, 3, 3)), "picture has shape (0, 3, 3)"),
        (np.array([[[1.0], [np.nan]]]), "picture[0, 1, 0] is nan, expected finite radiance"),
        (np.array([[[1.0], [-1.0]]]), "picture[0, 1, 0] is -1.0"),
    ],
)
def test_bad_pictures_are_named(picture: np.ndarray, message: str) -> None:
    with pytest.raises(ValueError, match=re.escape(message)):
        prefilter(picture)
