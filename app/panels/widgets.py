"""Rows of a panel: a label with its tooltip on the left, the control on the right.

Every control has the ImGui id ``##<label>`` in lower case, so that tests and
people find the same thing under the same name. Controls work in float32; a
number that the user did not touch is returned as it came, in float64.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TypeVar

import numpy as np
from imgui_bundle import ImVec2, ImVec4, imgui

from app.scene import Vec3
from app.sliders import linear_from_srgb, srgb_from_linear

Name = TypeVar("Name", bound=str)

LABEL_EM = 6.2
"""Width of the column of labels, in font sizes."""

MUTED = ImVec4(0.56, 0.59, 0.64, 1.0)
ACCENT = ImVec4(1.0, 0.72, 0.36, 1.0)


def tidy(value: float) -> float:
    """Return a float32 as the shortest decimal near it, as it would be typed (7 digits)."""
    return float(f"{value:.7g}")


def _untouched(old: float, new: float) -> float:
    return old if np.float32(old) == np.float32(new) else tidy(new)


def tooltip(text: str) -> None:
    """Explain the item before when the pointer rests on it."""
    if text and imgui.is_item_hovered(imgui.HoveredFlags_.for_tooltip):
        imgui.begin_tooltip()
        imgui.push_text_wrap_pos(imgui.get_font_size() * 24.0)
        imgui.text_unformatted(text)
        imgui.pop_text_wrap_pos()
        imgui.end_tooltip()


def label(text: str, tip: str = "") -> str:
    """Draw a row's label, place the cursor for its control, and return the control's id."""
    imgui.align_text_to_frame_padding()
    imgui.text_colored(MUTED, text)
    tooltip(tip)
    imgui.same_line(imgui.get_font_size() * LABEL_EM)
    imgui.set_next_item_width(-1.0)
    return f"##{text.lower()}"


def right_text(text: str) -> None:
    """Draw text at the right end of a table's cell."""
    room = imgui.get_content_region_avail().x - imgui.calc_text_size(text).x
    imgui.set_cursor_pos_x(imgui.get_cursor_pos_x() + max(room, 0.0))
    imgui.text_unformatted(text)


def heading(text: str) -> None:
    """Draw the title of a group of rows."""
    imgui.spacing()
    imgui.separator_text(text)


def hint(text: str) -> None:
    """Draw a muted, wrapped sentence."""
    imgui.push_style_color(imgui.Col_.text, MUTED)
    imgui.text_wrapped(text)
    imgui.pop_style_color()


def slider(
    text: str,
    value: float,
    low: float,
    high: float,
    form: str = "%.3f",
    tip: str = "",
    logarithmic: bool = False,
) -> float:
    """Draw a slider; Ctrl+click types a number within the bounds."""
    flags = imgui.SliderFlags_.always_clamp
    if logarithmic:
        flags = imgui.SliderFlags_(flags | imgui.SliderFlags_.logarithmic)
    identity = label(text, tip)
    shown = min(max(value, low), high)
    changed, new = imgui.slider_float(identity, shown, low, high, form, flags)
    tooltip(tip)
    return _untouched(value, new) if changed else value


def numbers(
    text: str, values: Sequence[float], speed: float, form: str = "%.3f", tip: str = ""
) -> tuple[float, ...]:
    """Draw two or three numbers to drag or, by double-click, to type."""
    identity = label(text, tip)
    draw = {2: imgui.drag_float2, 3: imgui.drag_float3}[len(values)]
    shown = [round(value, 9) + 0.0 for value in values]  # no "-0.000"
    changed, new = draw(identity, shown, speed, 0.0, 0.0, form)
    tooltip(tip)
    if not changed:
        return tuple(values)
    return tuple(
        value if np.float32(was) == np.float32(now) else tidy(now)
        for value, was, now in zip(values, shown, new, strict=True)
    )


def position(text: str, value: Vec3, tip: str = "") -> Vec3:
    """Draw a point in metres."""
    x, y, z = numbers(text, value, 0.01, "%.3f", tip)
    return (x, y, z)


def colour(text: str, value: Vec3, tip: str = "") -> Vec3:
    """Draw a colour picker for linear components in [0, 1], shown and picked as sRGB."""
    identity = label(text, tip)
    flags = imgui.ColorEditFlags_.float | imgui.ColorEditFlags_.picker_hue_wheel
    shown = srgb_from_linear(value)
    changed, new = imgui.color_edit3(identity, list(shown), flags)
    tooltip(tip)
    if not changed:
        return value
    clamped = (min(max(new[0], 0.0), 1.0), min(max(new[1], 0.0), 1.0), min(max(new[2], 0.0), 1.0))
    picked = linear_from_srgb(clamped)
    return (tidy(picked[0]), tidy(picked[1]), tidy(picked[2]))


def checkbox(text: str, value: bool, tip: str = "") -> bool:
    """Draw a check box."""
    _, new = imgui.checkbox(label(text, tip), value)
    tooltip(tip)
    return bool(new)


def choice(text: str, value: Name, options: Sequence[Name], tip: str = "") -> Name:
    """Draw a drop-down list of names."""
    identity = label(text, tip)
    chosen = value
    if imgui.begin_combo(identity, value):
        for option in options:
            if imgui.selectable(option, option == value)[0]:
                chosen = option
            if option == value:
                imgui.set_item_default_focus()
        imgui.end_combo()
    tooltip(tip)
    return chosen


def name_field(text: str, value: str, tip: str = "") -> str:
    """Draw a line of text; what is typed counts when Enter or a click ends it."""
    identity = label(text, tip)
    changed, new = imgui.input_text(identity, value)
    tooltip(tip)
    return str(new) if changed else value


def button(text: str, tip: str = "", enabled: bool = True, width: float = 0.0) -> bool:
    """Draw a button and tell whether it was pressed."""
    imgui.begin_disabled(not enabled)
    pressed = imgui.button(text, ImVec2(width, 0.0))
    imgui.end_disabled()
    if tip and imgui.is_item_hovered(
        imgui.HoveredFlags_.for_tooltip | imgui.HoveredFlags_.allow_when_disabled
    ):
        imgui.set_tooltip(tip)
    return bool(pressed)


def half_width() -> float:
    """Return the width of one of two buttons that share a row."""
    return float((imgui.get_content_region_avail().x - imgui.get_style().item_spacing.x) / 2.0)


@contextmanager
def identity(name: str | int) -> Iterator[None]:
    """Put what is drawn inside under an id of its own."""
    imgui.push_id(str(name))
    try:
        yield
    finally:
        imgui.pop_id()


def begin_modal(title: str, width: float = 26.0, height: float = 0.0) -> bool:
    """Begin a modal in the middle of the window and tell whether it is open.

    Parameters
    ----------
    width, height : float
        Its first size in font sizes; 0 for what its content needs.
    """
    em = imgui.get_font_size()
    centre = imgui.get_main_viewport().get_center()
    imgui.set_next_window_pos(centre, imgui.Cond_.appearing, ImVec2(0.5, 0.5))
    imgui.set_next_window_size(ImVec2(width * em, height * em), imgui.Cond_.appearing)
    opened, _ = imgui.begin_popup_modal(title, None, imgui.WindowFlags_.no_saved_settings)
    return bool(opened)
