"""Figures of lobes on paper: one pair with its legend, or a sheet of many, as KT et al. 2022.

Everything is drawn at twice the size and reduced, which smooths lines and text.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.colour_maps import BERLIN, MAGMA, ColourMap, colours_at
from app.lobe_picture import (
    NAMES,
    Kind,
    Scale,
    Ticks,
    graticule,
    lobe_images,
    marks,
)
from ltc.lobe import WHOLE, LobePair, Window
from ltc.resources import resource_path

if TYPE_CHECKING:
    from PIL import ImageFont

Ink: TypeAlias = tuple[int, int, int, int]

INK, GREY, PALE = (38, 40, 46, 255), (112, 116, 124, 255), (222, 224, 228, 255)
WHITE, SHADE = (255, 255, 255, 255), (0, 0, 0, 150)
LINES: dict[Kind, Ink] = {
    "rim": (120, 120, 124, 255),
    "grid": (255, 255, 255, 60),
    "angle": (255, 255, 255, 110),
}
SAMPLES = 2
"""By how much more pixels are drawn, in width and in height."""


def lobe_figure(pair: LobePair, pixels: int, logarithmic: bool) -> NDArray[np.uint8]:
    """Return GGX, LTC and their difference with scales and numbers, (h, w, 3) sRGB.

    Parameters
    ----------
    pair : LobePair
    pixels : int
        Width of one picture. A second row shows the lobes larger where they are small.
    logarithmic : bool
        The scale.
    """
    em = max(pixels / 22.0, 9.0)
    margin, gap = 2.0 * em, 1.4 * em
    windows = [WHOLE] if pair.window.zoom == 1 else [WHOLE, pair.window]
    top = margin + 4.6 * em
    width = 2.0 * margin + 3.0 * pixels + 2.0 * gap
    below = top + len(windows) * (pixels + gap)
    page = _Page(width, below + 3.2 * em + 0.5 * margin, em)
    scale = Scale(pair.peak, logarithmic)

    case = pair.case
    title = f"GGX and its transformed cosine   {_alphas(pair)}   {_view(pair)}"
    page.text(margin, margin, title, 1.25, INK)
    numbers = (
        f"albedo {pair.exact_albedo:.4f} exact, {pair.albedo:.4f} table   ·   "
        f"total variation {pair.variation:.3f}   ·   "
        f"{100.0 * pair.leak:.1f} % below the surface   ·   {pair.table}"
    )
    page.text(margin, margin + 1.8 * em, numbers, 0.95, GREY)
    for row, window in enumerate(windows):
        images = lobe_images(pair, round(SAMPLES * pixels), window, scale)
        y = top + row * (pixels + gap)
        for column, (name, image) in enumerate(zip(NAMES, images, strict=True)):
            x = margin + column * (pixels + gap)
            page.disk(x, y, pixels, image, pair, window, labelled=column == 0)
            if row == 0:
                page.text(x, y - 0.2 * em, name, 1.0, INK)
            if window.zoom > 1:
                page.text(x + pixels - 0.4 * em, y + 0.3 * em, f"×{window.zoom}", 0.9, WHITE, "ra")
    wide = 2.0 * pixels + gap
    label = f"1/sr{', logarithmic' if logarithmic else ''}"
    page.scale(margin, below, wide, MAGMA, scale.ticks(), label)
    page.scale(margin + wide + gap, below, pixels, BERLIN, scale.signed_ticks(), "")
    if case.is_anisotropic:
        page.text(margin + pixels, top + 0.5 * pixels - 0.5 * em, " x", 0.9, GREY, "la")
    return page.finished()


def lobe_sheet(
    rows: Sequence[Sequence[LobePair]], pixels: int, logarithmic: bool
) -> NDArray[np.uint8]:
    """Return a contact sheet, (h, w, 3) sRGB: GGX and LTC side by side for each pair.

    Parameters
    ----------
    rows : sequence of equally long sequences of LobePair
        Rows share their alphas, columns their view.
    pixels : int
        Width of one picture.
    logarithmic : bool
        The scale; each pair has its own peak.
    """
    em = max(pixels / 9.0, 9.0)
    margin, gap, inner = 2.0 * em, 1.6 * em, 0.25 * em
    cell, left, top = 2.0 * pixels + inner, margin + 5.2 * em, margin + 3.4 * em
    columns = len(rows[0])
    page = _Page(
        left + columns * (cell + gap) - gap + margin,
        top + len(rows) * (pixels + gap) + 0.5 * margin,
        em,
    )
    for column, pair in enumerate(rows[-1]):
        x = left + column * (cell + gap)
        page.text(x + 0.5 * cell, margin, _view(pair), 1.1, INK, "ma")
        for half, name in enumerate(NAMES[:2]):
            middle = x + half * (pixels + inner) + 0.5 * pixels
            page.text(middle, margin + 1.7 * em, name, 0.85, GREY, "ma")
    for row, pairs in enumerate(rows):
        y = top + row * (pixels + gap)
        for line, text in enumerate(_alphas(pairs[0]).split("   ")):
            at = y + 0.5 * pixels + (1.3 * line - 1.3) * em
            page.text(margin, at, text, 1.0, INK)
        for column, pair in enumerate(pairs):
            x = left + column * (cell + gap)
            window = pair.window if pair.window.zoom > 2 else WHOLE
            images = lobe_images(
                pair, round(SAMPLES * pixels), window, Scale(pair.peak, logarithmic)
            )
            for half, image in enumerate(images[:2]):
                page.disk(x + half * (pixels + inner), y, pixels, image, pair, window)
            zoom = f"×{window.zoom}   " if window.zoom > 1 else ""
            text = f"{zoom}variation {pair.variation:.3f}"
            page.text(x + 0.5 * cell, y + pixels + 0.05 * em, text, 0.8, GREY, "ma")
    return page.finished()


def _alphas(pair: LobePair) -> str:
    return f"αx {pair.case.alpha_x:.3g}   αy {pair.case.alpha_y:.3g}"


def _view(pair: LobePair) -> str:
    theta, phi = math.degrees(pair.case.theta), math.degrees(pair.case.phi)
    return f"θ {theta:.4g}°   φ {phi:.4g}°" if pair.case.is_anisotropic else f"θ {theta:.4g}°"


class _Page:
    """A white page; places and sizes in pixels of the result, text in ems."""

    def __init__(self, width: float, height: float, em: float) -> None:
        from PIL import Image, ImageDraw

        size = (round(width) * SAMPLES, round(height) * SAMPLES)
        self._image = Image.new("RGBA", size, WHITE)
        self._em = em
        self._draw = ImageDraw.Draw(self._image, "RGBA")
        self._fonts: dict[int, ImageFont.FreeTypeFont] = {}

    def text(self, x: float, y: float, text: str, ems: float, ink: Ink, anchor: str = "la") -> None:
        """Write; the anchor is Pillow's: l, m or r, and a for the top."""
        from PIL import ImageFont

        size = round(SAMPLES * ems * self._em)
        if size not in self._fonts:
            path = resource_path("assets", "fonts", "SourceSans3-Bold.otf")
            self._fonts[size] = ImageFont.truetype(str(path), size)
        place = (SAMPLES * x, SAMPLES * y)
        self._draw.text(place, text, fill=ink, font=self._fonts[size], anchor=anchor)

    def disk(
        self,
        x: float,
        y: float,
        side: float,
        image: NDArray[np.uint8],
        pair: LobePair,
        window: Window,
        labelled: bool = False,
    ) -> None:
        """Put a picture at its place, with its lines and marks."""
        from PIL import Image, ImageDraw

        pixels = len(image)
        picture = Image.fromarray(image)
        overlay = Image.new("RGBA", picture.size, (0, 0, 0, 0))
        draw = ImageDraw.Draw(overlay)
        unit = 0.5 * pixels / window.half

        def at(px: float, py: float) -> tuple[float, float]:
            return (
                0.5 * pixels + (px - window.x) * unit,
                0.5 * pixels - (py - window.y) * unit,
            )

        line_width = max(round(pixels / 280.0), 2)
        for line in graticule(pair.case, window):
            places = [at(*point) for point in line.points.tolist()]
            draw.line(places, fill=LINES[line.kind], width=line_width)
            if labelled and line.label and pixels >= 300:
                self._label(draw, min(places, key=lambda place: place[1]), line.label)
        picture.alpha_composite(overlay)
        left, top = round(SAMPLES * x), round(SAMPLES * y)
        self._image.alpha_composite(picture, (left, top))
        # Marks may reach beyond the picture's edge, if their place is within it.
        r = max(pixels / 55.0, 4.0)
        pad = 2 * round(r)
        marked = Image.new("RGBA", (pixels + 2 * pad, pixels + 2 * pad), (0, 0, 0, 0))
        draw = ImageDraw.Draw(marked)
        for mark in marks(pair.case):
            cx, cy = at(mark.x, mark.y)
            if 0.0 <= cx <= pixels and 0.0 <= cy <= pixels:
                for ink, extra in ((SHADE, 2 * line_width), (WHITE, 0)):
                    place = (cx + pad, cy + pad)
                    self._mark(draw, mark.name, *place, r, ink, line_width + extra)
        self._image.alpha_composite(marked, (left - pad, top - pad))

    def _label(self, draw: object, place: tuple[float, float], text: str) -> None:
        from PIL import ImageDraw, ImageFont

        assert isinstance(draw, ImageDraw.ImageDraw)
        path = resource_path("assets", "fonts", "SourceSans3-Bold.otf")
        font = ImageFont.truetype(str(path), round(SAMPLES * 0.75 * self._em))
        draw.text((place[0] + 4, place[1]), text, fill=(255, 255, 255, 170), font=font)

    @staticmethod
    def _mark(draw: object, name: str, x: float, y: float, r: float, ink: Ink, width: int) -> None:
        from PIL import ImageDraw

        assert isinstance(draw, ImageDraw.ImageDraw)
        if name == "normal":
            reach = 0.3 * r + 0.4 * width
            draw.ellipse((x - reach, y - reach, x + reach, y + reach), fill=ink)
        elif name == "view":
            reach = r + 0.5 * width
            draw.ellipse((x - reach, y - reach, x + reach, y + reach), outline=ink, width=width)
        elif name == "mirror":
            for sx, sy in ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)):
                near, far = 0.45 * r, 1.5 * r
                draw.line(
                    (x + sx * near, y + sy * near, x + sx * far, y + sy * far),
                    fill=ink,
                    width=width,
                )
        else:
            for sign in (-1.0, 1.0):
                draw.line((x - 1.3 * r, y + sign * r, x - 2, y), fill=ink, width=width)

    def scale(
        self, x: float, y: float, width: float, map_: ColourMap, ticks: Ticks, label: str
    ) -> None:
        """Draw a map's colours with numbers below, and a label at the right."""
        high = 0.8 * self._em
        count = round(SAMPLES * width)
        colours = np.rint(colours_at(map_, np.linspace(0.0, 1.0, count))).astype(int)
        for i, colour in enumerate(colours.tolist()):
            at = SAMPLES * x + i
            self._draw.line((at, SAMPLES * y, at, SAMPLES * (y + high)), fill=(*colour, 255))
        taken: list[float] = [x + width - 0.5 * self._em] if label else []
        if label:
            self.text(x + width, y + 1.1 * self._em, label, 0.85, GREY, "ra")
            taken = [x + width - 0.27 * self._em * len(label)]
        for place, text in ticks:
            px = x + place * width
            room = 0.3 * self._em * (len(text) + 2)
            if all(abs(px - other) > room + (1.5 * self._em if label else 0.0) for other in taken):
                taken.append(px)
                line = (SAMPLES * px, SAMPLES * (y + high), SAMPLES * px,
                        SAMPLES * (y + high + 0.25 * self._em))  # fmt: skip
                self._draw.line(line, fill=GREY, width=SAMPLES)
                self.text(px, y + 1.1 * self._em, text, 0.85, GREY, "ma")

    def finished(self) -> NDArray[np.uint8]:
        """Return the page, (h, w, 3)."""
        from PIL import Image

        width, height = self._image.size
        small = self._image.convert("RGB").resize(
            (width // SAMPLES, height // SAMPLES), Image.Resampling.BOX
        )
        return np.asarray(small)
