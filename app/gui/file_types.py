"""Kinds of files by name and ending, and what asks for the name of one."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Protocol, TypeAlias

from app.picture_files import PICTURE_SUFFIXES
from app.sources import font_suffixes

FileType: TypeAlias = tuple[str, tuple[str, ...]]
"""A name for people, and the suffixes, such as ".json"."""

SCENE_FILES: FileType = ("Scenes", (".json",))
DRAWING_FILES: FileType = ("Drawings", (".svg",))
LIGHT_PICTURES: FileType = ("Pictures", PICTURE_SUFFIXES)


def font_files() -> FileType:
    """Return the kind of fonts."""
    return ("Fonts", font_suffixes())


class FileChooser(Protocol):
    """Asks for the name of a file, and goes on with ``then`` unless cancelled."""

    def ask_open(
        self, title: str, kind: FileType, folder: Path, then: Callable[[Path], None]
    ) -> None: ...

    def ask_save(
        self, title: str, kind: FileType, proposal: Path, then: Callable[[Path], None]
    ) -> None: ...
