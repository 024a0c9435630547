"""Choosing files: the system's own dialog where there is one, else one inside the window.

portable_file_dialogs answers "cancelled" at once where Linux has neither
zenity nor kdialog, so that is checked first.
"""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from imgui_bundle import im_file_dialog, imgui
from imgui_bundle import portable_file_dialogs as system_dialogs

SCENES = ("Scenes", ("json",))
MESHES = ("Meshes", ("glb", "gltf", "obj", "ply", "stl"))
PICTURES = ("Pictures", ("png", "exr"))

_KEY = "file"
_LINUX_HELPERS = ("zenity", "kdialog", "matedialog", "qarma")

FileType = tuple[str, tuple[str, ...]]


def has_system_dialog() -> bool:
    """Tell whether the system can show a dialog of its own."""
    return not sys.platform.startswith("linux") or any(map(shutil.which, _LINUX_HELPERS))


class FileDialogs:
    """At most one file dialog at a time; `poll` it once a frame."""

    def __init__(self) -> None:
        self._system: Any = None
        self._inside = False
        self._then: Callable[[Path], None] | None = None
        self._suffix = ""

    @property
    def is_open(self) -> bool:
        return self._then is not None

    def ask_open(self, title: str, kind: FileType, then: Callable[[Path], None]) -> None:
        """Ask for an existing file; ``then`` gets it in a later `poll`, unless cancelled."""
        if self.is_open:
            return
        self._then, self._suffix = then, ""
        if has_system_dialog():
            self._system = system_dialogs.open_file(title, "", _system_filter(kind))
        else:
            self._inside = im_file_dialog.FileDialog.instance().open(
                _KEY, title, _inside_filter(kind)
            )

    def ask_save(
        self, title: str, kind: FileType, proposal: Path, then: Callable[[Path], None]
    ) -> None:
        """Ask where to write; without an ending the name gets that of ``proposal``."""
        if self.is_open:
            return
        self._then, self._suffix = then, proposal.suffix
        if has_system_dialog():
            self._system = system_dialogs.save_file(title, str(proposal), _system_filter(kind))
        else:
            self._inside = im_file_dialog.FileDialog.instance().save(
                _KEY, title, _inside_filter(kind), str(proposal.parent)
            )

    def poll(self) -> None:
        """Draw the dialog if it is inside the window, and hand over its answer if there is one."""
        if self._system is not None and self._system.ready(0):
            answer = self._system.result()
            self._finish(answer if isinstance(answer, str) else next(iter(answer), ""))
        elif self._inside:
            imgui.set_next_window_size(
                imgui.ImVec2(imgui.get_font_size() * 50.0, imgui.get_font_size() * 30.0),
                imgui.Cond_.first_use_ever,
            )
            dialog = im_file_dialog.FileDialog.instance()
            if dialog.is_done(_KEY):
                answer = dialog.get_result().path() if dialog.has_result() else ""
                dialog.close()
                self._finish(answer)

    def _finish(self, answer: str) -> None:
        then, self._then, self._system, self._inside = self._then, None, None, False
        if answer and then is not None:
            path = Path(answer)
            then(path if path.suffix or not self._suffix else path.with_suffix(self._suffix))


def _system_filter(kind: FileType) -> list[str]:
    name, endings = kind
    return [name, " ".join(f"*.{ending}" for ending in endings), "All files", "*"]


def _inside_filter(kind: FileType) -> str:
    name, endings = kind
    return f"{name} {{{','.join('.' + ending for ending in endings)}}},.*"
