"""Draws the pictures of the demo scenes: python assets/pictures/draw.py

Each function returns frames (n, h, w, 3 or 4) of sRGB codes in [0, 1]; nothing is random but by
a fixed seed. Written for this project, under its licence.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy.ndimage import gaussian_filter

FloatArray = NDArray[np.float64]

FINE = 3
"""Samples across a texel, averaged."""

STEPS, FRAME_MILLISECONDS = 48, 80
"""Of the film."""


def colours(*codes: str) -> FloatArray:
    """Return colours (n, 3) of hexadecimal codes such as "ff8800"."""
    return np.array([[int(code[i : i + 2], 16) / 255 for i in (0, 2, 4)] for code in codes])


def places(width: int, height: int) -> tuple[FloatArray, FloatArray]:
    """Return x to the right and y up of all samples, (h, w); y runs from -1 to 1."""
    x = (np.arange(width * FINE) + 0.5) / FINE - 0.5 * width
    y = 0.5 * height - (np.arange(height * FINE) + 0.5) / FINE
    return np.meshgrid(x / (0.5 * height), y / (0.5 * height))


def averaged(samples: FloatArray) -> FloatArray:
    """Return texels of samples (h, w, channels)."""
    rows, columns, channels = samples.shape
    blocks = samples.reshape(rows // FINE, FINE, columns // FINE, FINE, channels)
    return blocks.mean(axis=(1, 3))


def ramp(position: FloatArray, stops: FloatArray) -> FloatArray:
    """Return colours between equally spaced stops (n, 3) for positions in [0, 1]."""
    at = np.clip(position, 0.0, 1.0) * (len(stops) - 1)
    low = np.minimum(at.astype(int), len(stops) - 2)
    share = (at - low)[..., None]
    return stops[low] * (1.0 - share) + stops[low + 1] * share


def sunset() -> FloatArray:
    """A lake between hills: the picture of the quad."""
    x, y = places(480, 300)
    horizon = -0.28
    sky = colours("ffe08a", "ff9a4a", "e8505b", "8e3b7e", "38306e", "14183f")
    below = y < horizon
    up = np.where(below, 0.9 * (horizon - y), y - horizon)  # the lake mirrors the sky
    near = np.maximum(horizon - y, 0.0)
    ripple = 0.03 * near**0.5 * np.sin(60.0 * np.log(near + 0.05))
    x = x + ripple
    picture = ramp(up / 1.28, sky)
    distance = np.hypot(x - 0.25, up - 0.52)
    glow = np.exp(-distance / 0.3)[..., None]
    picture = picture + 0.8 * glow * (colours("fff2b0")[0] - picture)
    picture[distance < 0.19] = colours("fffbe0")[0]
    for level, height, rate, phase, shade in (
        (0.34, 0.13, 2.1, 0.4, "a8527c"), (0.24, 0.09, 3.3, 2.0, "6d3a70"),
        (0.13, 0.08, 5.2, 4.4, "33245a"),
    ):  # fmt: skip
        ridge = level + height * (np.sin(rate * x + phase) + 0.3 * np.sin(2.7 * rate * x))
        hill = up < ridge
        picture[hill] = picture[hill] * 0.12 + 0.88 * colours(shade)[0]
    picture[below] *= 0.86
    return averaged(picture)[None]


def stained_glass() -> FloatArray:
    """A rose window: panes of saturated colours, lead between them."""
    x, y = places(384, 384)
    radius, angle = np.hypot(x, y), np.arctan2(y, x)
    lead = np.full_like(x, np.inf)
    pane = np.zeros(x.shape, dtype=int)
    generator = np.random.default_rng(7)
    palette = colours("d7263d", "f49d37", "f7e733", "3bb273", "1b98e0", "3f37c9", "9b2fae",
                      "e84a8a", "35c9d6", "ff5714")  # fmt: skip
    inner, count = 0.0, 0
    rings = ((0.14, 1), (0.33, 8), (0.58, 16), (0.80, 16), (0.97, 32))
    for number, (outer, parts) in enumerate(rings):
        turn = (angle / (2.0 * np.pi) * parts + 0.5 * (number % 2)) % parts
        # Edges of the panes bow outwards, like petals.
        petal = outer + (0.05 if 1 < parts < 32 else 0.0) * (np.abs(np.cos(np.pi * turn)) - 0.6)
        inside = (radius >= inner) & (radius < petal)
        lead = np.minimum(lead, np.abs(radius - petal))
        if parts > 1:
            beside = np.abs(turn - np.round(turn)) * 2.0 * np.pi / parts * radius
            lead = np.where(inside, np.minimum(lead, beside), lead)
        chosen = count + np.floor(turn).astype(int) % parts
        pane = np.where(inside, chosen, pane)
        count += parts
        inner = petal
    tints = palette[(np.arange(count) * 3 + generator.integers(0, 3, count)) % len(palette)]
    grain = gaussian_filter(generator.standard_normal(x.shape), 14.0)
    shade = np.clip(0.82 + 2.2 * grain + 0.18 * (1.0 - radius), 0.45, 1.0)
    picture = tints[pane] * shade[..., None]
    picture[(lead < 0.013) | (radius > 0.97)] = 0.0
    return averaged(picture)[None]


def disk() -> FloatArray:
    """A white disk whose surroundings let no light through, of (h, w, 4)."""
    x, y = places(192, 192)
    cover = (np.hypot(x, y) < 0.96).astype(float)[..., None]
    return averaged(np.concatenate((np.ones((*x.shape, 3)), cover), axis=-1))[None]


def swirl() -> FloatArray:
    """Colours that turn about the middle, for a shape of curves."""
    x, y = places(256, 256)
    radius, angle = np.hypot(x, y), np.arctan2(y, x)
    wheel = colours("ff2e63", "ff9f1c", "ffe74c", "2ec4b6", "1877f2", "8f2dff", "ff2e63")
    turn = (angle / (2.0 * np.pi) + 0.35 * radius + 0.03 * np.sin(3.0 * angle)) % 1.0
    return averaged(ramp(turn, wheel))[None]


def embers() -> FloatArray:
    """Glowing coals, for a letter."""
    generator = np.random.default_rng(3)
    noise = np.zeros((256, 256))
    for size in (2.0, 5.0, 12.0, 30.0):
        layer = gaussian_filter(generator.standard_normal(noise.shape), size, mode="wrap")
        noise += np.abs(layer / layer.std()) * np.sqrt(size)
    heat = 1.0 - noise / np.quantile(noise, 0.98)
    heat += 0.35 * np.linspace(-1.0, 1.0, 256)[:, None]
    stops = colours("1a0206", "6e0d12", "d62a0c", "ff7a12", "ffc94a", "fff6d0")
    return ramp(np.clip(0.15 + 0.9 * heat, 0.0, 1.0), stops)[None]


def television() -> FloatArray:
    """The view from a night train: hills and lamps, then the light of a station, and again."""
    return np.array([night_train(step) for step in range(STEPS)])


def night_train(step: int) -> FloatArray:
    """Return frame 0 to 47 of the television's film, which leads to the first one again."""
    x, y = places(160, 100)
    phase = step / STEPS
    sky = colours("0a1238", "1d2f6f", "4a5aa8", "d98a6a")
    generator = np.random.default_rng(11)
    stars = generator.uniform((-1.6, 0.1), (1.6, 0.98), (40, 2))
    picture = ramp((1.0 - y) / 1.3, sky)
    for sx, sy in stars:
        near = np.hypot(x - sx, y - sy) < 0.016
        picture[near] = 0.95
    moon = np.hypot(x + 0.8, y - 0.55)
    picture[moon < 0.2] = colours("fff3d0")[0]
    for repeats, level, height, shade in (
        (1, 0.0, 0.16, "27306b"), (2, -0.2, 0.12, "182250"), (4, -0.42, 0.08, "0c1634"),
    ):  # fmt: skip
        # Whole repeats in a round, so that the last frame leads to the first.
        along = 2.0 * np.pi * (x / 3.2 + repeats * phase)
        ridge = level + height * (np.sin(along) + 0.5 * np.sin(3.0 * along + 1.0))
        picture[y < ridge] = colours(shade)[0]
    lamp = (x / 3.2 + 8.0 * phase) % 1.0  # eight lamps pass in a round
    post = (np.abs(lamp - 0.5) < 0.006) & (y < -0.1)
    picture[post] = colours("05070f")[0]
    glow = np.exp(-np.hypot((lamp - 0.5) * 3.2, y + 0.1) / 0.11)[..., None]
    picture = picture + np.minimum(1.3 * glow, 1.0) * (colours("ffd27a")[0] - picture)
    # Between the 26th and the 38th frame a station passes.
    here = np.clip(min(step - 25.0, 39.0 - step) / 3.0, 0.0, 1.0)
    wall = ramp((1.0 - y) / 2.0, colours("fff0c0", "ffb347", "c8551b"))
    window = np.abs((x / 0.64 + 12.0 * phase) % 1.0 - 0.5) < 0.36
    wall[window & (np.abs(y - 0.1) < 0.5)] = colours("fffbe8")[0]
    wall[y < -0.7] = colours("7a3416")[0]
    picture = picture * (1.0 - here) + here * wall
    return averaged(picture)


PICTURES: dict[str, Callable[[], FloatArray]] = {
    "sunset.webp": sunset,
    "stained-glass.webp": stained_glass,
    "disk.png": disk,
    "swirl.webp": swirl,
    "embers.webp": embers,
    "television.webp": television,
}


def main(folder: Path) -> None:
    """Write all pictures."""
    for name, draw in PICTURES.items():
        codes = np.round(255.0 * np.clip(draw(), 0.0, 1.0)).astype(np.uint8)
        first, *others = (Image.fromarray(frame) for frame in codes)
        options = {"quality": 88, "method": 6} if name.endswith(".webp") else {"optimize": True}
        if others:
            options |= {"save_all": True, "append_images": others,
                        "duration": FRAME_MILLISECONDS, "loop": 0}  # fmt: skip
        first.save(folder / name, **options)


if __name__ == "__main__":
    main(Path(__file__).parent)
