"""The error of fetched pictures, against exact integrals of the same light.

`measure` draws lights as the fits do (`ltc.objective.random_lights`: rectangles of any
orientation, .1 to 3 times the distance, many of them cut by the horizon or by the lobe), puts
random pictures on them and compares, for each way to fetch, form factor times fetched mean with
the integral of the picture. The lobe is the same on both sides, so that the fetch alone is
measured: the table's lobe (``ltc``) or diffuse reflection. ``ggx`` compares the technique ``ltc``
with GGX. Form factors are those of the exact integrals.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from ltc import transform
from ltc.bezier import from_polygon
from ltc.ggx_boundary import Views
from ltc.objective import random_lights
from ltc.picture_cells import coverage
from ltc.prefilter import prefilter
from ltc.published_prefilter import gaussian_levels, published_mean_radiance
from ltc.table import load_isotropic
from ltc.textured import SPREAD, cosine_mean_radiance
from ltc.textured_reference import CosineLobe, GgxLobe, textured_integrals

FloatArray: TypeAlias = npt.NDArray[np.float64]

ALPHA_BOUNDS = (0.01, 0.03, 0.1, 0.3, 1.0)
THETA_MAX = 85.0
RECTANGLE = [from_polygon([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])]


def _circle(radius: float) -> FloatArray:
    """Return a contour (4, 4, 2) about the picture's middle, round within 3e-4."""
    quarter = np.array([[1.0, 0.0], [1.0, 0.5522847498], [0.5522847498, 1.0], [0.0, 1.0]])
    turn = np.array([[0.0, 1.0], [-1.0, 0.0]])
    turns = [quarter @ np.linalg.matrix_power(turn, k) for k in range(4)]
    return np.asarray(0.5 + radius * np.stack(turns))


def _star(tips: int, inner: float) -> FloatArray:
    angle = np.pi * np.arange(2 * tips) / tips
    radius = np.where(np.arange(2 * tips) % 2 == 0, 0.5, 0.5 * inner)[:, None]
    return from_polygon(0.5 + radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1))


OUTLINES = {
    "rectangle": RECTANGLE,
    "disk": [_circle(0.5)],
    "ring": [_circle(0.5), _circle(0.25)[::-1, ::-1]],
    "star": [_star(5, 0.42)],
}
"""In picture coordinates, by the names that `measure` takes."""

Picture = Callable[[np.random.Generator, int], FloatArray]


def _places(size: int) -> tuple[FloatArray, FloatArray]:
    x = (np.arange(size) + 0.5) / size
    return x, x[:, None]


def _stretched(f: FloatArray) -> FloatArray:
    return np.asarray((f - f.min()) / max(float(np.ptp(f)), 1e-12))


def smooth(rng: np.random.Generator, size: int) -> FloatArray:
    """Return a sum of waves, at most four along a side."""
    x, y = _places(size)
    f = np.zeros((size, size))
    for a, b in itertools.product(range(4), range(-3, 4)):
        wave = np.cos(2.0 * np.pi * (a * x + b * y) + rng.uniform(0.0, 2.0 * np.pi))
        f += rng.normal() * wave
    return _stretched(f)


def blocky(rng: np.random.Generator, size: int) -> FloatArray:
    """Return 8 x 8 blocks, half of them black, the others uniformly random."""
    b = rng.random((8, 8)) * (rng.random((8, 8)) < 0.5)
    index = np.arange(size) * 8 // size
    return np.asarray(b[index[:, None], index])


def mask(rng: np.random.Generator, size: int) -> FloatArray:
    """Return a white disk on black, Heitz et al. 2016, Fig. 12."""
    x, y = _places(size)
    cx, cy = rng.uniform(0.3, 0.7, 2)
    inside = (rng.uniform(0.2, 0.5) - np.hypot(x - cx, y - cy)) * size + 0.5
    return np.asarray(np.clip(inside, 0.0, 1.0))


def pink(rng: np.random.Generator, size: int) -> FloatArray:
    """Return noise with a spectrum of 1/f, like photographs."""
    k = np.hypot(np.fft.fftfreq(size)[:, None], np.fft.fftfreq(size))
    k[0, 0] = 1.0
    return _stretched(np.real(np.fft.ifft2(np.fft.fft2(rng.normal(size=(size, size))) / k)))


def stained_glass(rng: np.random.Generator, size: int) -> FloatArray:
    """Return 30 panes with black leads between them, Heitz et al. 2016, Fig. 12."""
    x, y = _places(size)
    seeds, glass = rng.random((30, 2)), rng.random(30)
    distance = np.hypot(x - seeds[:, :1, None], y - seeds[:, 1:, None])
    order = np.sort(distance, axis=0)
    return np.where(order[1] - order[0] > 0.03, glass[np.argmin(distance, axis=0)], 0.0)


KINDS: dict[str, Picture] = {
    "smooth": smooth,
    "blocky": blocky,
    "mask": mask,
    "1/f": pink,
    "glass": stained_glass,
}

METHODS = ("paper", *(f"{n} taps" for n in SPREAD))


@dataclass(frozen=True, eq=False, slots=True)
class Measured:
    """Absolute errors of the shading integral, pictures running from 0 to 1.

    ``errors`` maps a method to (configurations, kinds, pictures) float64.
    """

    alpha: FloatArray
    errors: dict[str, FloatArray]
    exact_error: float
    """The largest error estimate of the exact integrals."""

    def figures(
        self, method: str, kind: str | None = None, low: float = 0.0, high: float = 2.0
    ) -> tuple[float, float]:
        """Return mean and 95th percentile of a method, of one kind or all, alpha in [low, high).

        NaN where there is no such configuration.
        """
        some = self.errors[method][(self.alpha >= low) & (self.alpha < high)]
        if kind is not None:
            some = some[:, list(KINDS).index(kind)]
        if some.size == 0:
            return float("nan"), float("nan")
        return float(np.mean(some)), float(np.percentile(some, 95))


class _Case(NamedTuple):
    alpha: FloatArray
    frames: FloatArray
    """(n, 3, 3): in cosine space."""
    scale: FloatArray
    """(n): what the mean radiance is multiplied with."""
    exact: FloatArray
    """(n, channels)."""
    error: float


def _case(
    rng: np.random.Generator, count: int, lobe: str, picture: FloatArray, outline: list[FloatArray]
) -> _Case:
    alpha = 10.0 ** rng.uniform(np.log10(ALPHA_BOUNDS[0]), 0.0, count)
    theta = np.radians(rng.uniform(0.0, THETA_MAX, count))
    wo = np.stack([np.sin(theta), np.zeros(count), np.cos(theta)], axis=-1)
    corners = random_lights(rng, alpha, alpha, wo).corners
    o = corners[:, 0]
    frames = np.stack([o, corners[:, 1] - o, corners[:, 3] - o], axis=1)
    if lobe == "diffuse":
        inverse = np.broadcast_to(np.eye(3), (count, 3, 3))
    else:
        table = load_isotropic()
        M = table.matrix(alpha, np.cos(theta))
        inverse = transform.invert(M)
    cosine = CosineLobe(inverse)
    if lobe == "ggx":
        one = textured_integrals(np.ones((1, 1, 1)), outline, frames, cosine).one
        scale = one * table.albedo_terms(alpha, np.cos(theta))[0] / (1.0 - transform.leak(M))
        exact = textured_integrals(picture, outline, frames, GgxLobe(Views(wo, alpha, alpha)))
    else:
        exact = textured_integrals(picture, outline, frames, cosine)
        scale = exact.one
    space = transform.apply(inverse[:, None], frames)
    return _Case(alpha, space, scale, exact.value, float(np.max(exact.error)))


def measure(
    configurations: int = 500,
    seed: int = 1,
    size: int = 64,
    pictures: int = 3,
    lobe: str = "ltc",
    half: bool = False,
    outline: str = "rectangle",
) -> Measured:
    """Return the errors of all ways to fetch.

    Parameters
    ----------
    configurations : int
        Lights and views, each with all pictures.
    seed : int
        Of all randomness.
    size : int
        Texels of the pictures on both axes.
    pictures : int
        Of each kind.
    lobe : str
        ``ltc``, ``diffuse`` or ``ggx``.
    half : bool
        Whether our pyramids are rounded to half floats.
    outline : str
        One of `OUTLINES`, in the rectangle's place.

    Raises
    ------
    ValueError
        For another lobe or outline, or a number that is too small.
    """
    if lobe not in ("ltc", "diffuse", "ggx"):
        raise ValueError(f"lobe is {lobe!r}, expected ltc, diffuse or ggx")
    if outline not in OUTLINES:
        raise ValueError(f"outline is {outline!r}, expected one of {', '.join(OUTLINES)}")
    for name, value, least in (
        ("configurations", configurations, 1),
        ("seed", seed, 0),
        ("size", size, 8),
        ("pictures", pictures, 1),
    ):
        if value < least:
            raise ValueError(f"{name} is {value}, expected {least} or more")
    rng = np.random.default_rng(seed)
    drawn = [kind(rng, size) for kind in KINDS.values() for _ in range(pictures)]
    picture = np.stack(drawn, axis=-1)
    case = _case(rng, configurations, lobe, picture, OUTLINES[outline])
    pyramid = prefilter(picture, OUTLINES[outline])
    if half:
        pyramid = pyramid.half()[0]
    cover = coverage(np.concatenate(OUTLINES[outline]), size, size)
    levels = gaussian_levels(picture, cover)
    shape = (configurations, len(KINDS), pictures)
    errors = {}
    for method in METHODS:
        if method == "paper":
            mean = published_mean_radiance(levels, case.frames, float(np.mean(cover)))
        else:
            mean = cosine_mean_radiance(pyramid, case.frames, int(method.split()[0]))
        errors[method] = np.abs(mean * case.scale[:, None] - case.exact).reshape(shape)
    return Measured(case.alpha, errors, case.error)
