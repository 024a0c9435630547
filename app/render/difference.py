"""How far one picture, A, is from another, B: per pixel, in numbers, and as colours.

B is what A is measured by, the reference as a rule. A pixel's difference is one number, of
its luminance or of the channel that differs most. Twins of what the window does on the GPU
(``shaders/common/difference.glsl``); pictures that are compared in files have no other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from app.colour_maps import BERLIN, SEQUENTIAL, Colour, ColourMap, Legend, MapName
from app.colour_maps import colours_at as map_colours
from app.scene import AreaLight

FloatArray = NDArray[np.float64]

DifferenceView: TypeAlias = Literal["signed", "absolute", "relative", "flip"]
"""What false colours show."""
DIFFERENCE_VIEWS: tuple[DifferenceView, ...] = get_args(DifferenceView)
Measure: TypeAlias = Literal["luminance", "largest channel"]
"""What of a pixel is compared."""
MEASURES: tuple[Measure, ...] = get_args(Measure)

LUMINANCE = (0.2126, 0.7152, 0.0722)
"""Of linear Rec. 709 components."""

RELATIVE_FLOOR = 0.01
"""Relative differences divide by B, but by no less than this share of B's mean: what is nearly
black would else be all that one sees."""

NOT_A_NUMBER: Colour = (0, 255, 0)
"""The colour of pixels where A or B is not finite: on none of the maps."""


def difference(a: ArrayLike, b: ArrayLike, measure: Measure = "luminance") -> FloatArray:
    """Return how much more A has than B, (...), with its sign.

    Parameters
    ----------
    a, b : (..., 3) float
        Linear radiance.
    measure : {"luminance", "largest channel"}
        Of the latter, the channel with the largest absolute difference.
    """
    apart = np.asarray(a, dtype=np.float64) - np.asarray(b, dtype=np.float64)
    if measure == "luminance":
        return np.asarray(apart @ np.array(LUMINANCE))
    largest = np.argmax(np.abs(apart), axis=-1)[..., None]
    return np.take_along_axis(apart, largest, axis=-1)[..., 0]


def magnitude(radiance: ArrayLike, measure: Measure = "luminance") -> FloatArray:
    """Return what a relative difference divides by: (...) of (..., 3) linear radiance."""
    array = np.asarray(radiance, dtype=np.float64)
    if measure == "luminance":
        return np.asarray(array @ np.array(LUMINANCE))
    return np.asarray(array.max(axis=-1))


@dataclass(frozen=True, slots=True)
class Numbers:
    """A picture's differences in numbers, over all pixels where both are finite.

    Attributes
    ----------
    measure : Measure
        What was compared; radiance [W m^-2 sr^-1], as all that follows.
    pixels, bad : int
        How many pixels there are, and how many of them are not finite in A or B.
    bias : float
        Mean of the differences with their sign.
    mean, rmse, p95, p99, max : float
        Of the absolute differences.
    mean_b : float
        Mean of B.
    light : float or None
        The largest radiance of any light, None where that is not known.
    noise : (float or None, float or None)
        Root of the mean square of A's and of B's standard error; None where one is the same
        every time, or not known to err.
    """

    measure: Measure
    pixels: int
    bad: int
    bias: float
    mean: float
    rmse: float
    p95: float
    p99: float
    max: float
    mean_b: float
    light: float | None = None
    noise: tuple[float | None, float | None] = (None, None)

    @property
    def floor(self) -> float:
        """Least radiance that relative differences divide by."""
        return max(RELATIVE_FLOOR * self.mean_b, 1e-30)

    def rows(self) -> list[tuple[str, float, float | None, float | None]]:
        """Return (name, radiance, share of B's mean, share of the light's radiance) to show."""
        values = [
            ("mean", self.mean), ("RMSE", self.rmse), ("95 % below", self.p95),
            ("99 % below", self.p99), ("largest", self.max), ("A brighter by", self.bias),
        ]  # fmt: skip
        for name, noise in zip("AB", self.noise, strict=True):
            if noise is not None:
                values.append((f"{name}'s own noise", noise))
        if any(self.noise):
            # Of two errors that know nothing of each other the squares add up. The noise is no
            # more than it says of itself, so what is left is at least this.
            noise2 = sum(noise * noise for noise in self.noise if noise is not None)
            values.append(
                ("RMSE beyond it, at least", float(np.sqrt(max(self.rmse**2 - noise2, 0.0))))
            )
        of_b, of_light = self.mean_b or None, self.light or None
        return [
            (name, value, value / of_b if of_b else None, value / of_light if of_light else None)
            for name, value in values
        ]


def numbers(
    a: ArrayLike,
    b: ArrayLike,
    measure: Measure = "luminance",
    lights: Sequence[AreaLight] = (),
    noise: tuple[ArrayLike | None, ArrayLike | None] = (None, None),
) -> Numbers:
    """Return the numbers of two pictures (h, w, 3) of linear radiance.

    Parameters
    ----------
    lights : sequence of AreaLight
        The scene's, if there is one: differences are also given as a share of the brightest.
    noise : pair of (h, w, 3) float or None
        The standard errors of A's and B's pixels, where they are estimates.

    Raises
    ------
    ValueError
        If the pictures differ in size.
    """
    first, second = np.asarray(a), np.asarray(b)
    if first.shape != second.shape:
        raise ValueError(f"pictures have shapes {first.shape} and {second.shape}, expected equal")
    good = (np.isfinite(first) & np.isfinite(second)).all(axis=-1)
    signed = difference(first[good], second[good], measure)
    seen = magnitude(second[good], measure)
    if not signed.size:
        signed, seen = np.zeros(1), np.zeros(1)
    apart = np.abs(signed)
    p95, p99 = np.quantile(apart, (0.95, 0.99))
    radiances = [float(magnitude(light.radiance, measure)) for light in lights]
    sizes = []
    for error in noise:
        size = None
        if error is not None:
            # Channels of one estimate rise and fall together: an upper bound.
            squares = magnitude(np.asarray(error)[good], measure) ** 2
            size = float(np.sqrt(squares.mean())) if squares.size else 0.0
        sizes.append(size)
    return Numbers(
        measure, good.size, int(good.size - np.count_nonzero(good)),
        float(signed.mean()), float(apart.mean()), float(np.sqrt(np.mean(apart * apart))),
        float(p95), float(p99), float(apart.max()), float(seen.mean()),
        max(radiances) if radiances and max(radiances) > 0.0 else None, (sizes[0], sizes[1]),
    )  # fmt: skip


@dataclass(frozen=True, slots=True)
class Scale:
    """What colours mean: the map, and the value at its upper end.

    ``high`` is positive; a signed view begins at ``-high``, every other at 0.
    """

    view: DifferenceView
    high: float
    measure: Measure = "luminance"
    map: MapName = "magma"

    @property
    def low(self) -> float:
        return -self.high if self.view == "signed" else 0.0

    @property
    def colours(self) -> ColourMap:
        return BERLIN if self.view == "signed" else SEQUENTIAL[self.map]

    def legend(self, names: tuple[str, str] = ("A", "B"), bad: bool = False) -> Legend:
        """Return what explains the colours.

        Parameters
        ----------
        names : (str, str)
            What A and B are.
        bad : bool
            Whether some pixels are not finite: their colour is named then.
        """
        a, b = names
        label = {
            "signed": f"{a} - {b}, {self.measure}",
            "absolute": f"|{a} - {b}|, {self.measure}",
            "relative": f"|{a} - {b}| / {b}, {self.measure}",
            "flip": f"FLIP of {a} and {b}: 0 no visible difference",
        }[self.view]
        places = np.linspace(0.0, 1.0, 5)
        ticks = tuple(
            (float(place), self._text(self.low + (self.high - self.low) * float(place)))
            for place in places
        )
        return Legend(label, self.colours, ticks, ((NOT_A_NUMBER, "NaN"),) if bad else ())

    def _text(self, value: float) -> str:
        if self.view == "signed":
            return f"{value:+.3g}" if value else "0"
        text = f"{100.0 * value:.3g} %" if self.view == "relative" else f"{value:.3g}"
        return f"{text}+" if value == self.high and self.view != "flip" else text


def robust_high(
    view: DifferenceView, a: ArrayLike, b: ArrayLike, measure: Measure, floor: float
) -> float:
    """Return the upper end of a scale that few pixels go beyond: a round number.

    The 99th percentile of what is above rounding, or 1 where the pictures agree. FLIP
    has its own scale, from 0 to 1.
    """
    if view == "flip":
        return 1.0
    values = np.abs(values_of(view, a, b, measure, floor))
    values = values[np.isfinite(values) & (values > 0.0)]
    return rounded_up(float(np.quantile(values, 0.99))) if values.size else 1.0


def rounded_up(value: float) -> float:
    """Return the next number of 1, 2 and 5 times a power of ten; 1 for what is not above 0."""
    if not value > 0.0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(value))
    step = next(step for step in (1.0, 2.0, 5.0, 10.0) if value <= step * power * (1.0 + 1e-9))
    return float(f"{step * power:.3g}")


def values_of(
    view: DifferenceView, a: ArrayLike, b: ArrayLike, measure: Measure, floor: float
) -> FloatArray:
    """Return what a view shows of two pictures of radiance, (h, w); not for FLIP.

    Raises
    ------
    ValueError
        For FLIP, which is not of radiance but of display colours.
    """
    if view == "flip":
        raise ValueError("FLIP compares display colours, not radiance")
    with np.errstate(invalid="ignore"):
        signed = difference(a, b, measure)
        if view == "signed":
            return signed
        if view == "absolute":
            return np.abs(signed)
        return np.asarray(np.abs(signed) / np.maximum(magnitude(b, measure), floor))


def colours_of(values: ArrayLike, scale: Scale) -> NDArray[np.uint8]:
    """Return (h, w, 3) sRGB colours of values (h, w) on a scale."""
    array = np.asarray(values, dtype=np.float64)
    good = np.isfinite(array)
    place = (np.where(good, array, 0.0) - scale.low) / (scale.high - scale.low)
    colours = np.where(good[..., None], map_colours(scale.colours, place), NOT_A_NUMBER)
    return np.asarray(np.round(colours), dtype=np.uint8)
