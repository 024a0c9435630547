"""The legend of a picture in false colours, over the picture in the window."""

from __future__ import annotations

import numpy as np
from imgui_bundle import ImVec2, ImVec4, imgui

from app.colour_maps import HEIGHT, WIDTH, Colour, Legend
from app.gui import theme
from app.gui.overlays import View


def draw_legend(view: View, legend: Legend) -> None:
    """Draw the scale of colours with its numbers at the picture's lower left."""
    em = imgui.get_font_size()
    width, height = WIDTH * em, HEIGHT * em
    # Above the line of help.
    x, y = view.x + 0.8 * em, view.y + view.height - height - 3.0 * em
    if width + 2.0 * em > view.width or y < view.y:
        return
    draw = imgui.get_window_draw_list()
    paper, ink = theme.u32(theme.grey(0.05), 0.85), theme.u32(theme.grey(0.95))
    draw.add_rect_filled(ImVec2(x, y), ImVec2(x + width, y + height), paper, 0.3 * em)
    draw.add_text(ImVec2(x + 0.6 * em, y + 0.3 * em), ink, legend.label)
    top, bottom = y + 1.6 * em, y + 2.5 * em
    texts = []
    for index, (colour, text) in enumerate(legend.boxes):
        left = x + (0.6 + 2.0 * index) * em
        box = ImVec2(left, top), ImVec2(left + 0.9 * em, bottom)
        draw.add_rect_filled(*box, _ink(colour))
        draw.add_rect(*box, theme.u32(theme.grey(0.6)))
        texts.append((text, left + 0.45 * em))
    start, end = x + (1.0 + 2.0 * max(len(legend.boxes), 1)) * em, x + width - 2.0 * em
    stops = np.linspace(start, end, len(legend.colours))
    for i, colour in enumerate(legend.colours[:-1]):
        first, last = _ink(colour), _ink(legend.colours[i + 1])
        low, high = ImVec2(float(stops[i]), top), ImVec2(float(stops[i + 1]), bottom)
        draw.add_rect_filled_multi_color(low, high, first, last, last, first)
    texts += [(text, start + (end - start) * place) for place, text in legend.ticks]
    for text, place in texts:
        half = 0.5 * imgui.calc_text_size(text).x
        draw.add_text(ImVec2(place - half, bottom + 0.15 * em), ink, text)


def _ink(colour: Colour) -> int:
    red, green, blue = (c / 255.0 for c in colour)
    return theme.u32(ImVec4(red, green, blue, 1.0))
