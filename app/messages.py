"""Messages in the window: short notes that pass, and failures that stay until read."""

from __future__ import annotations

import time
from dataclasses import dataclass

from imgui_bundle import ImVec2, ImVec4, imgui
from imgui_bundle import icons_fontawesome_4 as icons

from app import theme

NOTE_SECONDS, FAILURE_SECONDS = 4.0, 12.0
MOST = 4
"""How many messages are shown at once; the oldest go first."""


@dataclass(frozen=True, slots=True)
class Message:
    """A sentence, whether it is a failure, and when it goes [s, monotonic clock]."""

    text: str
    is_failure: bool
    until: float


class Messages:
    """The messages shown at the moment."""

    def __init__(self) -> None:
        self._shown: list[Message] = []

    @property
    def shown(self) -> tuple[Message, ...]:
        return tuple(self._shown)

    def clear(self) -> None:
        """Take all messages away."""
        self._shown.clear()

    def note(self, text: str) -> None:
        """Say something that went well."""
        self._add(text, False, NOTE_SECONDS)

    def failure(self, text: str) -> None:
        """Say what did not work; a click takes it away."""
        self._add(text, True, FAILURE_SECONDS)

    def _add(self, text: str, is_failure: bool, seconds: float) -> None:
        kept = [message for message in self._shown if message.text != text]
        kept.append(Message(text, is_failure, time.monotonic() + seconds))
        self._shown = kept[-MOST:]

    def draw(self, right: float, bottom: float) -> None:
        """Draw the messages upwards from a corner in screen coordinates."""
        now = time.monotonic()
        self._shown = [message for message in self._shown if message.until > now]
        em = imgui.get_font_size()
        bottom -= em
        for message in reversed(self.shown):
            imgui.set_next_window_pos(
                ImVec2(right - em, bottom), imgui.Cond_.always, ImVec2(1.0, 1.0)
            )
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
                self._shown.remove(message)
            bottom -= imgui.get_window_height() + 0.4 * em
            imgui.end()
            imgui.pop_style_var()
            imgui.pop_style_color()
