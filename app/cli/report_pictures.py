"""The report's pictures: where techniques of a scene differ most, and by how much."""

from __future__ import annotations

import base64
import io
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from app.measure.entries import Entry
from app.scene import RenderSettings, Scene, Shot

if TYPE_CHECKING:
    from app.render.renderer import Renderer

STANDARD = "ggx:4"
"""What pictures are compared with: within a few 1e-4 of GGX on average (docs/ggx.md) where lights
have no pictures, and made in seconds, where the exact integral of every pixel would take hours."""

OTHER = "ltc"
"""What differs from it there shows where to look."""

CROP = (160, 112)
"""Largest width and height of the pictures on the page [pixels]."""

FULL_COLOUR = 0.1
"""The difference that has the full colour, as a share of the crop's median radiance, black
left out. The median, because a light in the crop would be all that a mean or maximum shows."""

TOO_BRIGHT, TOO_DARK = (255, 140, 0), (60, 140, 255)
"""Colours that remain apart with any colour vision; no difference is black."""

QUALITY = 55
"""Of 100: some three hundred pictures shall be a page of two megabytes."""

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Pictures:
    """A crop of what a technique renders, and its difference, as ``data:`` addresses."""

    picture: str
    difference: str


class Comparison:
    """What the pictures of a scene are compared with, and where one looks."""

    def __init__(self, renderer: Renderer, scene: Scene, size: tuple[int, int]) -> None:
        self.scene = scene
        self._radiance = _radiance(renderer, Shot(scene, RenderSettings(STANDARD), *size))
        other = _radiance(renderer, Shot(scene, RenderSettings(OTHER), *size))
        self._crop = _worst_place(np.abs(other - self._radiance).sum(axis=-1), size)

    def of(self, renderer: Renderer, entry: Entry) -> tuple[Pictures, float | None]:
        """Return crops of an entry's picture, and the whole picture's difference.

        The latter is the mean difference over the mean of what it is compared with, None where
        that is black. Lights that are seen count too: they do not differ.
        """
        height, width = self._radiance.shape[:2]
        # All samples at the pixel's centre: what differs is the estimate, not the edges.
        settings = RenderSettings(entry.technique, entry.samples, positions=1)
        seen = _radiance(renderer, Shot(self.scene, settings, width, height))
        mean = float(self._radiance.mean())
        share = float(np.abs(seen - self._radiance).mean()) / mean if mean > 0.0 else None
        rows, columns = self._crop
        wanted = self._radiance[rows, columns]
        difference = (seen[rows, columns] - wanted).mean(axis=-1)
        shining = wanted[wanted.max(axis=-1) > 0.0].mean(axis=-1)
        full = FULL_COLOUR * float(np.median(shining)) if shining.size else 0.0
        signed = np.clip(difference / full, -1.0, 1.0)[..., None] if full > 0.0 else 0.0
        bright, dark = np.maximum(signed, 0.0), np.maximum(np.negative(signed), 0.0)
        image = bright * np.array(TOO_BRIGHT) + dark * np.array(TOO_DARK) + np.zeros(wanted.shape)
        pictures = Pictures(
            _data_address(renderer.display()[rows, columns]),
            _data_address(np.rint(image).astype(np.uint8)),
        )
        return pictures, share


def _radiance(renderer: Renderer, shot: Shot) -> FloatArray:
    renderer.render(shot)
    return renderer.radiance().astype(np.float64)


def _worst_place(difference: FloatArray, size: tuple[int, int]) -> tuple[slice, slice]:
    """Return the rows and columns of the crop in which the differences' sum is largest."""
    from scipy.ndimage import uniform_filter

    width, height = min(CROP[0], size[0]), min(CROP[1], size[1])
    sums = uniform_filter(difference, (height, width), mode="constant")
    row, column = np.unravel_index(int(np.argmax(sums)), sums.shape)
    top = int(np.clip(row - height // 2, 0, size[1] - height))
    left = int(np.clip(column - width // 2, 0, size[0] - width))
    return slice(top, top + height), slice(left, left + width)


def _data_address(colours: NDArray[np.uint8]) -> str:
    """Return a picture as the address of its bytes; WebP takes half of what JPEG and PNG do."""
    from PIL import Image

    buffer = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(colours)).save(buffer, "WEBP", quality=QUALITY, method=6)
    return f"data:image/webp;base64,{base64.b64encode(buffer.getvalue()).decode('ascii')}"
