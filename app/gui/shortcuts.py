"""Which key does what: one table that keyboard, menus, tooltips and help read.

Free of the GUI, so that panels can name the keys; `app.gui.keyboard` listens to them.
"""

from __future__ import annotations

from typing import Literal, TypeAlias

Action: TypeAlias = Literal[
    "new",
    "open",
    "save",
    "save as",
    "export",
    "quit",
    "undo",
    "redo",
    "duplicate",
    "remove",
    "escape",
    "frame",
    "overlays",
    "compare",
    "flip",
    "pin",
    "move",
    "rotate",
    "corner",
    "smooth",
    "symmetric",
    "line",
    "curve",
    "reverse",
]

KEYS: dict[Action, tuple[str, ...]] = {
    "new": ("Ctrl+N",),
    "open": ("Ctrl+O",),
    "save": ("Ctrl+S",),
    "save as": ("Ctrl+Shift+S",),
    "export": ("Ctrl+E",),
    "quit": ("Ctrl+Q",),
    "undo": ("Ctrl+Z",),
    "redo": ("Ctrl+Y", "Ctrl+Shift+Z"),
    "duplicate": ("Ctrl+D",),
    "remove": ("Del",),
    "escape": ("Esc",),
    "frame": ("F",),
    "overlays": ("H",),
    "compare": ("C",),
    "flip": ("X",),
    "pin": ("P",),
    "move": ("W",),
    "rotate": ("E",),
    "corner": ("Shift+C",),
    "smooth": ("Shift+S",),
    "symmetric": ("Shift+Y",),
    "line": ("Shift+L",),
    "curve": ("Shift+U",),
    "reverse": ("Shift+R",),
}
"""The keys of every action; the first is the one that is shown. Outlines have Inkscape's."""

WHILE_TYPING: frozenset[Action] = frozenset({"new", "open", "save", "save as", "export", "quit"})
"""What keys do also while text is typed; the others belong to the text then."""


def key_of(action: Action) -> str:
    """Return the key to show for an action: "Ctrl+Shift+S"."""
    return KEYS[action][0]
