"""Listens to the keys of `app.gui.shortcuts`."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from imgui_bundle import imgui

from app.gui.shortcuts import KEYS, WHILE_TYPING, Action

_KEY = imgui.Key
_NAMED = {"Ctrl": _KEY.mod_ctrl, "Shift": _KEY.mod_shift, "Del": _KEY.delete, "Esc": _KEY.escape}


def chord_of(keys: str) -> int:
    """Return the Dear ImGui key chord of a text such as "Ctrl+Shift+S".

    Raises
    ------
    AttributeError
        If there is no such key.
    """
    chord = 0
    for name in keys.split("+"):
        chord |= int(_NAMED[name] if name in _NAMED else getattr(_KEY, name.lower()))
    return chord


_CHORDS = {action: tuple(map(chord_of, keys)) for action, keys in KEYS.items()}


def pressed_action() -> Action | None:
    """Return the action whose key was pressed in this frame, None if none was.

    Keys do nothing while a dialog or a menu is open, and single letters and
    editing keys nothing while text is typed.
    """
    if imgui.is_popup_open("", imgui.PopupFlags_.any_popup):
        return None
    typing = imgui.get_io().want_text_input
    for action, chords in _CHORDS.items():
        if (action in WHILE_TYPING or not typing) and any(map(imgui.is_key_chord_pressed, chords)):
            return action
    return None


def act_on_keys(actions: Mapping[Action, Callable[[], None]]) -> None:
    """Do what the key pressed in this frame is for."""
    action = pressed_action()
    if action is not None:
        actions[action]()
