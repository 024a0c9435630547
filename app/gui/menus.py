"""The menu bar. Each item shows the key that `app.gui.shortcuts` has for it."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TypeAlias

from imgui_bundle import hello_imgui, imgui

from app.editor import Editor
from app.gui.shortcuts import Action, key_of
from app.scene_io import demo_scenes

Actions: TypeAlias = Mapping[Action, Callable[[], None]]


def file_menu(actions: Actions, open_scene: Callable[[Path], None]) -> None:
    """Draw the menu of files; ``open_scene`` opens a demo."""
    if not imgui.begin_menu("File"):
        return
    _item(actions, "new", "New")
    _item(actions, "open", "Open…###open")
    if imgui.begin_menu("Open demo"):
        for name, path in demo_scenes().items():
            if imgui.menu_item_simple(f"{spoken(name)}###{name}"):
                open_scene(path)
        imgui.end_menu()
    imgui.separator()
    _item(actions, "save", "Save")
    _item(actions, "save as", "Save as…###save as")
    imgui.separator()
    _item(actions, "export", "Export picture…###export")
    imgui.separator()
    _item(actions, "quit", "Quit")
    imgui.end_menu()


def edit_menu(actions: Actions, editor: Editor) -> None:
    """Draw the menu of the history, and of what can be done to what is selected."""
    if not imgui.begin_menu("Edit"):
        return
    undo, redo = editor.undo_name, editor.redo_name
    _item(actions, "undo", f"Undo {undo or ''}###undo", enabled=bool(undo))
    _item(actions, "redo", f"Redo {redo or ''}###redo", enabled=bool(redo))
    imgui.separator()
    chosen = editor.selection.kind != "none"
    _item(actions, "duplicate", "Duplicate", enabled=chosen)
    _item(actions, "remove", "Remove", enabled=chosen)
    imgui.separator()
    if imgui.begin_menu("History", len(editor.steps) > 1):
        for position, name in enumerate(editor.steps):
            if imgui.menu_item_simple(f"{name}###{position}", "", position == editor.position):
                editor.go_to(position)
        imgui.end_menu()
    imgui.end_menu()


def view_menu(
    actions: Actions,
    overlays_shown: bool,
    compares: bool,
    is_pinned: bool,
    docking: hello_imgui.DockingParams,
) -> None:
    """Draw the menu of what is shown, the docked windows among it."""
    if not imgui.begin_menu("View"):
        return
    _item(actions, "frame", "Look at selection")
    _item(actions, "overlays", "Outlines and handles", checked=overlays_shown)
    _item(actions, "compare", "Compare with another technique", checked=compares)
    _item(actions, "flip", "Flip to the other technique and back")
    _item(actions, "pin", "Pin the point", checked=is_pinned)
    imgui.separator()
    for window in docking.dockable_windows:
        if window.label != "Viewport" and imgui.menu_item_simple(
            window.label, "", window.is_visible
        ):
            window.is_visible = not window.is_visible
    imgui.separator()
    if imgui.menu_item_simple("Reset layout"):
        docking.layout_reset = True
    imgui.end_menu()


def spoken(name: str) -> str:
    """Return a file's stem as a title: "01-still-life" becomes "Still life"."""
    return re.sub(r"^\d+[-_]", "", name).replace("-", " ").replace("_", " ").capitalize()


def _item(
    actions: Actions, action: Action, label: str, *, checked: bool = False, enabled: bool = True
) -> None:
    if imgui.menu_item_simple(label, key_of(action), checked, enabled):
        actions[action]()
