"""Draws the messages to the user over a corner of the picture."""

from __future__ import annotations

from imgui_bundle import ImVec2, ImVec4, imgui
from imgui_bundle import icons_fontawesome_4 as icons

from app.gui import theme
from app.gui.messages import Messages


def draw_messages(messages: Messages, right: float, bottom: float) -> None:
    """Draw the messages upwards from a corner in screen coordinates; a click takes one away."""
    messages.expire()
    em = imgui.get_font_size()
    bottom -= em
    for message in reversed(messages.shown):
        imgui.set_next_window_pos(ImVec2(right - em, bottom), imgui.Cond_.always, ImVec2(1.0, 1.0))
        imgui.set_next_window_bg_alpha(0.94)
        imgui.push_style_color(imgui.Col_.window_bg, theme.grey(0.17))
        imgui.push_style_var(imgui.StyleVar_.window_rounding, 6.0)
        flags = (
            imgui.WindowFlags_.no_decoration
            | imgui.WindowFlags_.always_auto_resize
            | imgui.WindowFlags_.no_saved_settings
            | imgui.WindowFlags_.no_focus_on_appearing
            | imgui.WindowFlags_.no_nav
            | imgui.WindowFlags_.no_docking
        )
        imgui.begin(f"##message {message.text}", None, flags)
        imgui.push_text_wrap_pos(em * 26.0)
        icon = icons.ICON_FA_EXCLAMATION_TRIANGLE if message.is_failure else icons.ICON_FA_CHECK
        colour: ImVec4 = theme.WARNING if message.is_failure else theme.ACCENT
        imgui.text_colored(colour, icon)
        imgui.same_line()
        imgui.text_unformatted(message.text)
        imgui.pop_text_wrap_pos()
        if imgui.is_window_hovered() and imgui.is_mouse_clicked(imgui.MouseButton_.left):
            messages.dismiss(message)
        bottom -= imgui.get_window_height() + 0.4 * em
        imgui.end()
        imgui.pop_style_var()
        imgui.pop_style_color()
