"""The legend of the view of costs, over the picture in the window."""

from __future__ import annotations

import numpy as np
from imgui_bundle import ImVec2, ImVec4, imgui

from app.gui import theme
from app.gui.overlays import View
from app.render.cost import LABEL, NONE, OCTAVES, TICKS, VIRIDIS


def cost_legend(view: View) -> None:
    """Draw the scale of colours with its numbers at the picture's lower left."""
    em = imgui.get_font_size()
    width, height = 24.0 * em, 4.0 * em
    # Above the line of help.
    x, y = view.x + 0.8 * em, view.y + view.height - height - 3.0 * em
    if width + 2.0 * em > view.width or y < view.y:
        return
    draw = imgui.get_window_draw_list()
    paper, ink = theme.u32(theme.grey(0.05), 0.85), theme.u32(theme.grey(0.95))
    draw.add_rect_filled(ImVec2(x, y), ImVec2(x + width, y + height), paper, 0.3 * em)
    draw.add_text(ImVec2(x + 0.6 * em, y + 0.3 * em), ink, LABEL)
    top, bottom = y + 1.6 * em, y + 2.5 * em
    box = ImVec2(x + 0.6 * em, top), ImVec2(x + 1.5 * em, bottom)
    draw.add_rect_filled(*box, _ink(NONE))
    draw.add_rect(*box, theme.u32(theme.grey(0.6)))
    start, end = x + 3.0 * em, x + width - 2.0 * em
    stops = np.linspace(start, end, len(VIRIDIS))
    for i, colour in enumerate(VIRIDIS[:-1]):
        left, right = _ink(colour), _ink(VIRIDIS[i + 1])
        low, high = ImVec2(float(stops[i]), top), ImVec2(float(stops[i + 1]), bottom)
        draw.add_rect_filled_multi_color(low, high, left, right, right, left)
    ticks = [("0", x + 1.05 * em)]
    for tick in TICKS:
        text = f"{tick}+" if tick == TICKS[-1] else str(tick)
        ticks.append((text, start + (end - start) * float(np.log2(tick)) / OCTAVES))
    for text, place in ticks:
        half = 0.5 * imgui.calc_text_size(text).x
        draw.add_text(ImVec2(place - half, bottom + 0.15 * em), ink, text)


def _ink(colour: tuple[int, int, int]) -> int:
    red, green, blue = (c / 255.0 for c in colour)
    return theme.u32(ImVec4(red, green, blue, 1.0))
