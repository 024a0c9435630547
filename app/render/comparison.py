"""Two pictures of one view and everything that is made of them without a GPU.

Used by the command line and, in the background, by the window.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.colour_maps import INK, PAPER, draw_legend
from app.render import difference as of
from app.render.difference import Measure, Numbers, Scale
from app.render.flip import flip
from app.scene import MAX_SAMPLES, AreaLight

SAMPLED = 256
"""Samples a pixel of a technique that samples, unless told otherwise."""


@dataclass(frozen=True, eq=False)
class Pictures:
    """What is compared: A with B.

    Attributes
    ----------
    names : (str, str)
        Techniques, or files.
    a, b : (h, w, 3) float32
        Linear radiance.
    shown_a, shown_b : (h, w, 3) uint8
        What the display shows of them, sRGB.
    lights : sequence of AreaLight
        The scene's; empty where pictures come from files.
    noise : pair of (h, w, 3) float32 or None
        `estimated_error` of A and B, where they are random estimates.
    """

    names: tuple[str, str]
    a: NDArray[np.float32]
    b: NDArray[np.float32]
    shown_a: NDArray[np.uint8]
    shown_b: NDArray[np.uint8]
    lights: Sequence[AreaLight] = ()
    noise: tuple[NDArray[np.float32] | None, NDArray[np.float32] | None] = (None, None)

    def numbers(self, measure: Measure) -> Numbers:
        """Return the differences in numbers."""
        return of.numbers(self.a, self.b, measure, self.lights, self.noise)

    def flip(self) -> NDArray[np.float64]:
        """Return FLIP of what the display shows, (h, w)."""
        return flip(self.shown_a, self.shown_b)

    def values(
        self, view: of.DifferenceView, measure: Measure, floor: float
    ) -> NDArray[np.float64]:
        """Return what a view shows, (h, w); ``floor`` as `Numbers.floor`."""
        if view == "flip":
            return self.flip()
        return of.values_of(view, self.a, self.b, measure, floor)

    def coloured(self, values: NDArray[np.float64], scale: Scale) -> NDArray[np.uint8]:
        """Return the colours of what `values` returned, with their legend, (h, w, 3)."""
        bad = not np.isfinite(values).all()
        return draw_legend(of.colours_of(values, scale), scale.legend(self.names, bad))

    def split(self) -> NDArray[np.uint8]:
        """Return what the display shows, A left and B right of the middle, with their names."""
        middle = self.shown_a.shape[1] // 2
        both = np.array(self.shown_a)
        both[:, middle:] = self.shown_b[:, middle:]
        return _labelled(both, self.names)


def estimated_error(
    mean: NDArray[np.float32], samples: int, earlier: NDArray[np.float32], fewer: int
) -> NDArray[np.float32]:
    """Return an estimate of the standard error of a mean of random samples, of any shape.

    Parameters
    ----------
    mean, samples
        The mean, and of how many samples it is.
    earlier, fewer
        The mean of the first ones, fewer but some, at the same positions in the pixel.

    Notes
    -----
    With n1 samples first and n2 after, both means have the same variance a sample, s^2, so
    (mean - earlier)^2 n1/n2 has the expectation s^2/n. Of a single pixel it says little, its mean
    over a picture much. Samples that avoid each other err less than it says.
    """
    return np.asarray(np.abs(mean - earlier) * np.sqrt(fewer / (samples - fewer)), np.float32)


def earlier_samples(samples: int, positions: int) -> int:
    """Return after how many samples to keep a mean for `estimated_error`, 0 for never.

    Half of them, as far as that is a multiple of the positions they take in turn.
    """
    rounds = samples // positions
    return rounds // 2 * positions


def shared_samples(
    wanted: int, sampled: tuple[bool, bool], estimates: int = SAMPLED
) -> tuple[int, int, int]:
    """Return how many samples A and B take, and how many positions in a pixel they share.

    Parameters
    ----------
    wanted : int
        Positions, and the samples of a technique that has the same result every time.
    sampled : (bool, bool)
        Whether A and B are random estimates.
    estimates : int
        Least samples of those; rounded up to a multiple of ``wanted``.
    """
    most = wanted * (MAX_SAMPLES // wanted)
    more = min(-(-max(estimates, wanted) // wanted) * wanted, most)
    a, b = (more if random else wanted for random in sampled)
    return a, b, wanted


def _labelled(picture: NDArray[np.uint8], names: tuple[str, str]) -> NDArray[np.uint8]:
    """Return a picture with a line down the middle and names at the top on both its sides."""
    from PIL import Image, ImageDraw, ImageFont

    image = Image.fromarray(np.ascontiguousarray(picture))
    draw = ImageDraw.Draw(image)
    em = max(10, min(image.width // 45, 28))
    font = ImageFont.load_default(em)
    middle = image.width // 2
    draw.line((middle, 0, middle, image.height), fill=INK)
    for name, x, anchor in ((names[0], middle - em, "ra"), (names[1], middle + em, "la")):
        left, top, right, bottom = draw.textbbox((x, em // 2), name, font=font, anchor=anchor)
        if left < 0 or right > image.width or bottom > image.height:
            continue
        pad = em // 4
        draw.rectangle((left - pad, top - pad, right + pad, bottom + pad), fill=PAPER)
        draw.text((x, em // 2), name, fill=INK, font=font, anchor=anchor)
    return np.array(image)
