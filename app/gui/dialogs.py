"""Choosing files: the system's own dialog where there is one, else one inside the window.

portable_file_dialogs answers "cancelled" at once where Linux has neither
zenity nor kdialog, so that is checked first. The dialog inside the window is
our own: the bundled one shows hidden files, senseless sizes, and proposes no
name.
"""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_4 as icons
from imgui_bundle import portable_file_dialogs as system_dialogs

from app.gui.file_types import FileType
from app.panels.widgets import MUTED, begin_modal, button, hint, label

_LINUX_HELPERS = ("zenity", "kdialog", "matedialog", "qarma")


def has_system_dialog() -> bool:
    """Tell whether the system can show a dialog of its own."""
    return not sys.platform.startswith("linux") or any(map(shutil.which, _LINUX_HELPERS))


class FileDialogs:
    """At most one file dialog at a time; `poll` it once a frame."""

    def __init__(self) -> None:
        self._system: Any = None
        self._inside: _Browser | None = None
        self._then: Callable[[Path], None] | None = None
        self._suffix = ""

    @property
    def is_open(self) -> bool:
        return self._then is not None

    def ask_open(
        self, title: str, kind: FileType, folder: Path, then: Callable[[Path], None]
    ) -> None:
        """Ask for an existing file; ``then`` gets it in a later `poll`, unless cancelled."""
        if self.is_open:
            return
        self._then, self._suffix = then, ""
        if has_system_dialog():
            self._system = system_dialogs.open_file(title, str(folder), _system_filter(kind))
        else:
            self._inside = _Browser(title, kind, folder, "", saving=False)

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
            self._inside = _Browser(title, kind, proposal.parent, proposal.name, saving=True)

    def poll(self) -> None:
        """Draw the dialog if it is inside the window, and hand over its answer if there is one."""
        if self._system is not None and self._system.ready(0):
            answer = self._system.result()
            self._finish(answer if isinstance(answer, str) else next(iter(answer), ""))
        elif self._inside is not None:
            self._inside.draw()
            if self._inside.answer is not None:
                self._finish(self._inside.answer)

    def _finish(self, answer: str) -> None:
        then, self._then, self._system, self._inside = self._then, None, None, None
        if answer and then is not None:
            path = Path(answer)
            then(path if path.suffix or not self._suffix else path.with_suffix(self._suffix))


def _system_filter(kind: FileType) -> list[str]:
    name, suffixes = kind
    return [name, " ".join(f"*{suffix}" for suffix in suffixes), "All files", "*"]


class _Browser:
    """A file dialog inside the window. ``answer`` is a path, "" if cancelled, None meanwhile."""

    def __init__(
        self, title: str, kind: FileType, folder: Path, name: str, *, saving: bool
    ) -> None:
        self.answer: str | None = None
        self._title, self._kind, self._name, self._saving = title, kind, name, saving
        self._is_new = True
        self._go(folder.resolve())

    def _go(self, folder: Path) -> None:
        """Show another folder; one that cannot be read says so and stays empty."""
        self._folder, self._problem = folder, ""
        self._folders: list[Path] = []
        self._files: list[Path] = []
        try:
            for path in sorted(folder.iterdir(), key=lambda path: path.name.lower()):
                if path.name.startswith("."):
                    continue
                if path.is_dir():
                    self._folders.append(path)
                elif path.suffix.lower() in self._kind[1]:
                    self._files.append(path)
        except OSError as failure:
            self._problem = failure.strerror or str(failure)

    def draw(self) -> None:
        em = imgui.get_font_size()
        if self._is_new:
            imgui.open_popup(self._title)
            self._is_new = False
        if not begin_modal(self._title, 40.0, 30.0):
            self.answer = ""  # something else was opened in its place
            return
        self._places()
        below = 2.0 * imgui.get_frame_height_with_spacing() + 2.8 * em
        imgui.begin_child("files", ImVec2(0.0, -below))
        accepted = self._list()
        imgui.end_child()
        imgui.spacing()
        entered, self._name = imgui.input_text(
            label("Name", "Name of the file, or a whole path"), self._name,
            imgui.InputTextFlags_.enter_returns_true,
        )  # fmt: skip
        path = self._folder / Path(self._name).expanduser()
        replaces = self._saving and path.is_file()
        imgui.text_colored(MUTED, "Replaces the file of this name." if replaces else "")
        verb = "Replace" if replaces else "Save" if self._saving else "Open"
        usable = bool(self._name) and (self._saving or path.exists())
        if button(f"{verb}###accept file", enabled=usable, width=7.0 * em) or entered:
            accepted = usable
        imgui.same_line()
        if button("Cancel###cancel file", width=7.0 * em) or imgui.is_key_pressed(imgui.Key.escape):
            self.answer = ""
        if accepted and path.is_dir():
            self._name = ""
            self._go(path)
        elif accepted:
            self.answer = str(path)
        if self.answer is not None:
            imgui.close_current_popup()
        imgui.end_popup()

    def _places(self) -> None:
        """Draw the folders on the way to this one, each a button, and home."""
        if button(f"{icons.ICON_FA_HOME}###home", "Your home folder"):
            self._go(Path.home())
        parts = [*reversed(self._folder.parents), self._folder]
        shown = parts[-4:]
        if len(shown) < len(parts):
            imgui.same_line()
            imgui.text_colored(MUTED, "…")
        for part in shown:
            imgui.same_line()
            if button(f"{part.name or part.anchor}###{part}"):
                self._go(part)

    def _list(self) -> bool:
        """Draw folders and files; return whether a file was double-clicked."""
        accepted = False
        if self._problem:
            hint(self._problem)
        elif not self._folders and not self._files:
            hint(f"No folders and no {self._kind[0].lower()} here.")
        flags = imgui.SelectableFlags_.allow_double_click
        for folder in self._folders:
            imgui.text_colored(MUTED, icons.ICON_FA_FOLDER)
            imgui.same_line()
            if imgui.selectable(folder.name, False)[0]:
                self._go(folder)
                return False
        for file in self._files:
            imgui.text_colored(MUTED, icons.ICON_FA_FILE)
            imgui.same_line()
            if imgui.selectable(file.name, file.name == self._name, flags)[0]:
                self._name = file.name
                accepted = imgui.is_mouse_double_clicked(imgui.MouseButton_.left)
        return accepted
