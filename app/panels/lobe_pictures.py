"""The pictures of the lobe panel: both lobes and their difference, with what lies over them."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from imgui_bundle import ImVec2, ImVec4, imgui
from numpy.typing import NDArray

from app.colour_maps import BERLIN, MAGMA, ColourMap
from app.lobe_picture import NAMES, Line, Mark, Scale, graticule, marks, number
from app.panels.widgets import ACCENT, MUTED
from ltc.lobe import Case, LobePair, Window, direction_from_disk

FloatArray = NDArray[np.float64]

NARROWEST = 9.0
"""Width of a picture in font sizes from which on three stand in a row."""
LABELLED = 11.0
"""Width in font sizes from which on marks have their names written beside them."""
NEAR = 0.6
"""Distance from a mark in font sizes within which the pointer reads its name."""

WORDS = {
    "normal": "The surface's normal",
    "view": "Where the viewer is",
    "mirror": "The view's mirror direction",
    "tangent": "The tangent, x",
}

_WHITE, _SHADE = ImVec4(1.0, 1.0, 1.0, 1.0), ImVec4(0.0, 0.0, 0.0, 1.0)
_LIGHT = ImVec4(0.62, 0.93, 1.0, 1.0)
"""Of the lights' outlines: nothing else in the pictures has it."""


@dataclass(frozen=True, slots=True, eq=False)
class LightLine:
    """A run of a light's outline above the horizon, (n, 2) in the disk.

    ``shines``: on this point; ``chosen``: the light is selected.
    """

    points: FloatArray
    shines: bool
    chosen: bool


@dataclass(frozen=True, slots=True, eq=False)
class LobeView:
    """What the panel shows.

    Attributes
    ----------
    title : what the point is on
    note : a sentence about it, or nothing
    pair : both lobes
    window : the part of the disk that the pictures show
    scale : from values to colours
    textures : OpenGL names of the pictures of `app.lobe_picture.NAMES`
    lights : outlines of the scene's lights
    """

    title: str
    note: str
    pair: LobePair
    window: Window
    scale: Scale
    textures: tuple[int, int, int]
    lights: Sequence[LightLine] = ()


def lobe_pictures(view: LobeView) -> None:
    """Draw the three pictures and their scales, side by side or in two rows."""
    em, spacing = imgui.get_font_size(), imgui.get_style().item_spacing.x
    room = imgui.get_content_region_avail().x
    in_a_row = room - 2.0 * spacing >= 3.0 * NARROWEST * em
    columns = 3 if in_a_row else 2
    side = math.floor((room - (columns - 1) * spacing) / columns)
    for i, (name, texture) in enumerate(zip(NAMES, view.textures, strict=True)):
        if i % columns:
            imgui.same_line()
        _picture(view, name, texture, side, labelled=i == 0 and side >= LABELLED * em)
    if not in_a_row:
        imgui.same_line()
    imgui.begin_group()
    corner = imgui.get_cursor_screen_pos()
    imgui.dummy(ImVec2(room if in_a_row else side, 4.6 * em))
    low = ImVec2(corner.x + 0.4 * em, corner.y)
    wide = (room if in_a_row else side) - 0.8 * em
    _scale(low, wide, MAGMA, view.scale.ticks())
    _scale(ImVec2(low.x, low.y + 2.3 * em), wide, BERLIN, view.scale.signed_ticks())
    if not in_a_row:
        _summary(view.pair.case)
    imgui.end_group()


def _summary(case: Case) -> None:
    """Say which view it is, in the place that three pictures leave."""
    size = 0.87 * imgui.get_font_size()
    imgui.push_font(None, size)
    phi = math.degrees(math.remainder(case.phi, 2.0 * math.pi))
    for name, degrees in (("theta", math.degrees(case.theta)), ("phi", phi)):
        imgui.text_colored(MUTED, name)
        imgui.same_line(3.4 * size + imgui.get_cursor_start_pos().x)
        imgui.text_unformatted(f"{degrees:.1f}°")
    imgui.pop_font()


def _picture(view: LobeView, name: str, texture: int, side: float, labelled: bool) -> None:
    """Draw one picture with its lines and marks; the pointer reads values from it."""
    corner = imgui.get_cursor_screen_pos()
    imgui.invisible_button(f"##{name}", ImVec2(side, side))
    hovered = imgui.is_item_hovered()
    draw, em = imgui.get_window_draw_list(), imgui.get_font_size()
    low, high = corner, ImVec2(corner.x + side, corner.y + side)
    draw.push_clip_rect(low, high, True)
    draw.add_image(imgui.ImTextureRef(texture), low, high)
    canvas = _Disk(draw, corner, side, view.window)
    for line in graticule(view.pair.case, view.window):
        canvas.grid(line, labelled)
    for light in view.lights:
        strength = (1.0 if light.chosen else 0.75) if light.shines else 0.25
        canvas.line(light.points, _LIGHT, strength, 1.8 if light.chosen else 1.2)
    for mark in marks(view.pair.case):
        canvas.mark(mark, labelled)
    canvas.text(ImVec2(corner.x + 0.25 * em, corner.y + 0.1 * em), name, _WHITE, 0.9)
    if view.window.zoom > 1:
        text = f"×{view.window.zoom}"
        wide = imgui.calc_text_size(text).x
        canvas.text(ImVec2(high.x - wide - 0.25 * em, corner.y + 0.1 * em), text, MUTED, 1.0)
        canvas.locator(0.16 * side)
    draw.pop_clip_rect()
    if hovered:
        _read(view, canvas)


def _read(view: LobeView, canvas: _Disk) -> None:
    """Say what the lobes are in the direction under the pointer."""
    mouse = imgui.get_io().mouse_pos
    p = canvas.place(mouse)
    if float(p @ p) >= 1.0:
        return
    w = direction_from_disk(p)
    theta = math.degrees(math.acos(min(float(w[2]), 1.0)))
    phi = math.degrees(math.atan2(float(w[1]), float(w[0])))
    ggx, ltc = float(view.pair.ggx(w)), float(view.pair.ltc(w))
    text = f"theta {theta:.2f}°, phi {phi:.1f}°\nGGX {number(ggx)} /sr\nLTC {number(ltc)} /sr"
    for mark in marks(view.pair.case):
        at = canvas.at(mark.x, mark.y)
        if math.hypot(at.x - mouse.x, at.y - mouse.y) < NEAR * imgui.get_font_size():
            text = f"{WORDS[mark.name]}\n{text}"
            break
    imgui.set_tooltip(text)


class _Disk:
    """Draws in disk coordinates into a square of the screen."""

    def __init__(self, draw: imgui.ImDrawList, corner: ImVec2, side: float, window: Window) -> None:
        self._draw, self._corner, self._side, self._window = draw, corner, side, window
        self._unit = 0.5 * side / window.half

    def at(self, x: float, y: float) -> ImVec2:
        """Return the place on the screen of a place in the disk."""
        half = 0.5 * self._side
        return ImVec2(
            self._corner.x + half + (x - self._window.x) * self._unit,
            self._corner.y + half - (y - self._window.y) * self._unit,
        )

    def place(self, at: ImVec2) -> FloatArray:
        """Return the place in the disk, (2,), of a place on the screen."""
        half = 0.5 * self._side
        return np.array(
            [
                self._window.x + (at.x - self._corner.x - half) / self._unit,
                self._window.y - (at.y - self._corner.y - half) / self._unit,
            ]
        )

    def line(self, points: FloatArray, ink: ImVec4, alpha: float, thickness: float) -> None:
        """Draw a line with a dark rim, which shows on bright lobes."""
        places: list[Any] = [self.at(x, y) for x, y in points.tolist()]
        self._draw.add_polyline(places, _u32(_SHADE, 0.5 * alpha), thickness + 1.6, 0)
        self._draw.add_polyline(places, _u32(ink, alpha), thickness, 0)

    def grid(self, line: Line, labelled: bool) -> None:
        places: list[Any] = [self.at(x, y) for x, y in line.points.tolist()]
        alpha = {"rim": 0.5, "grid": 0.2, "angle": 0.35}[line.kind]
        self._draw.add_polyline(places, _u32(_WHITE, alpha), 1.0, 0)
        if labelled and line.label:
            highest = min(places, key=lambda at: at.y)
            em = imgui.get_font_size()
            at = ImVec2(highest.x + 0.15 * em, highest.y)
            self.text(at, line.label, MUTED, 1.0, small=True)

    def mark(self, mark: Mark, labelled: bool) -> None:
        em, at = imgui.get_font_size(), self.at(mark.x, mark.y)
        draw, r = self._draw, 0.28 * em
        for ink, thickness in ((_u32(_SHADE, 0.7), 3.4), (_u32(_WHITE), 1.5)):
            if mark.name == "normal":
                draw.add_circle_filled(at, 0.5 * thickness + 0.08 * em, ink)
            elif mark.name == "view":
                draw.add_circle(at, r, ink, 0, thickness)
            elif mark.name == "mirror":
                for sx, sy in ((1.0, 0.0), (0.0, 1.0)):
                    for sign in (-1.0, 1.0):  # a cross with its middle left free
                        a = ImVec2(at.x + sign * sx * 0.45 * r, at.y + sign * sy * 0.45 * r)
                        b = ImVec2(at.x + sign * sx * 1.5 * r, at.y + sign * sy * 1.5 * r)
                        draw.add_line(a, b, ink, thickness)
            else:
                tip = ImVec2(at.x - 0.1 * em, at.y)
                for dy in (-r, r):
                    draw.add_line(ImVec2(tip.x - 1.3 * r, tip.y + dy), tip, ink, thickness)
        if labelled and mark.name != "tangent":
            self.text(ImVec2(at.x + 1.4 * r, at.y - 0.1 * em), mark.name, _WHITE, 0.85, small=True)

    def text(self, at: ImVec2, text: str, ink: ImVec4, alpha: float, small: bool = False) -> None:
        size = imgui.get_font_size() * (0.8 if small else 1.0)
        for dx, dy in ((-1.0, 0.0), (1.0, 0.0), (0.0, -1.0), (0.0, 1.0)):
            self._draw.add_text(
                imgui.get_font(), size, ImVec2(at.x + dx, at.y + dy), _u32(_SHADE, 0.5), text
            )
        self._draw.add_text(imgui.get_font(), size, at, _u32(ink, alpha), text)

    def locator(self, side: float) -> None:
        """Draw the whole disk small, and in it where the window is."""
        em, radius = imgui.get_font_size(), 0.5 * side
        middle = ImVec2(
            self._corner.x + self._side - radius - 0.3 * em,
            self._corner.y + self._side - radius - 0.3 * em,
        )
        self._draw.add_circle_filled(middle, radius, _u32(_SHADE, 0.75))
        self._draw.add_circle(middle, radius, _u32(_WHITE, 0.45))
        window = self._window
        half = max(window.half * radius, 1.5)
        x, y = middle.x + window.x * radius, middle.y - window.y * radius
        low, high = ImVec2(x - half, y - half), ImVec2(x + half, y + half)
        self._draw.add_rect(low, high, _u32(ACCENT), 0.0, thickness=1.2)


def _scale(low: ImVec2, width: float, stops: ColourMap, ticks: Sequence[tuple[float, str]]) -> None:
    """Draw a map's colours with numbers below, the first ones rather than later ones."""
    draw, em = imgui.get_window_draw_list(), imgui.get_font_size()
    edges = np.linspace(low.x, low.x + width, len(stops))
    bottom = low.y + 0.7 * em
    for i, (low_stop, high_stop) in enumerate(itertools.pairwise(stops)):
        a, b = _ink(low_stop), _ink(high_stop)
        start, stop = ImVec2(float(edges[i]), low.y), ImVec2(float(edges[i + 1]), bottom)
        draw.add_rect_filled_multi_color(start, stop, a, b, b, a)
    size = 0.8 * em
    taken: list[tuple[float, float]] = []
    for place, text in ticks:
        x = low.x + place * width
        half = 0.4 * imgui.calc_text_size(text).x
        left = min(max(x - half, low.x - 0.3 * em), low.x + width + 0.3 * em - 2.0 * half)
        draw.add_line(ImVec2(x, bottom), ImVec2(x, bottom + 0.2 * em), _u32(MUTED))
        span = left - 0.25 * em, left + 2.0 * half + 0.25 * em
        if all(span[1] < start or span[0] > end for start, end in taken):
            taken.append(span)
            at = ImVec2(left, bottom + 0.2 * em)
            draw.add_text(imgui.get_font(), size, at, _u32(MUTED), text)


def _ink(colour: tuple[int, int, int]) -> int:
    red, green, blue = (c / 255.0 for c in colour)
    return _u32(ImVec4(red, green, blue, 1.0))


def _u32(colour: ImVec4, alpha: float = 1.0) -> int:
    faded = ImVec4(colour.x, colour.y, colour.z, colour.w * alpha)
    return int(imgui.color_convert_float4_to_u32(faded))
