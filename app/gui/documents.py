"""Scene files: new, open, save, what is dropped on the window, and the question before a loss.

Free of the GUI: what asks for file names is passed in, and the question about
unsaved edits is data here, drawn by `app.panels.question`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Literal, TypeAlias

from app.editor import Editor
from app.gui.beginning import new_scene
from app.gui.file_types import DRAWING_FILES, LIGHT_PICTURES, SCENE_FILES, FileChooser
from app.gui.imports import Imports
from app.gui.messages import Messages
from app.meshes import MESH_SUFFIXES
from app.scene import Scene
from app.scene_io import demo_scenes, load_scene, save_scene
from app.sources import font_suffixes

Answer: TypeAlias = Literal["save", "discard", "cancel"]


class Documents:
    """The file of the scene under edit.

    Parameters
    ----------
    editor : Editor
        Holds the scene and its path.
    messages : Messages
        Gets what was done and what failed.
    chooser : FileChooser
        Asks for file names.
    imports : Imports
        Adds dropped files that are no scenes.
    show : callable
        Shows another scene, from a file or from None.
    """

    def __init__(
        self,
        editor: Editor,
        messages: Messages,
        chooser: FileChooser,
        imports: Imports,
        show: Callable[[Scene, Path | None], None],
    ) -> None:
        self._editor = editor
        self._messages = messages
        self._chooser = chooser
        self._imports = imports
        self._show = show
        self._postponed: Callable[[], None] | None = None

    # --- new and open ---------------------------------------------------------

    def new(self) -> None:
        """Start a scene of a floor and one light, after asking about unsaved edits."""
        self.unless_unsaved(lambda: self._show(new_scene(), None))

    def open(self, path: Path) -> None:
        """Open a scene file, after asking about unsaved edits."""
        self.unless_unsaved(lambda: self.load(path))

    def ask_open(self) -> None:
        """Ask for a scene file and open it, after asking about unsaved edits."""
        path = self._editor.path
        folder = path.parent if path else Path.home()
        self.unless_unsaved(
            lambda: self._chooser.ask_open("Open a scene", SCENE_FILES, folder, self.load)
        )

    def load(self, path: Path) -> None:
        """Open a scene file without asking; a failure becomes a message.

        A demo scene opens as one that has no file yet.
        """
        with self._messages.guard():
            scene = load_scene(path)
            own = path.resolve() not in {demo.resolve() for demo in demo_scenes().values()}
            self._show(scene, path if own else None)

    # --- save -----------------------------------------------------------------

    def save(self, then: Callable[[], None] | None = None) -> None:
        """Save to the scene's file, ask for one if it has none; go on with ``then`` if saved."""
        if self._editor.path is None:
            self.ask_save(then)
        else:
            self.save_as(self._editor.path, then)

    def save_as(self, path: Path, then: Callable[[], None] | None = None) -> None:
        """Save to a file and go on with ``then``; a failure becomes a message."""
        with self._messages.guard():
            self._editor.commit()
            save_scene(self._editor.scene, path)
            self._editor.mark_saved(path)
            self._messages.note(f"Saved {path.name}")
            if then is not None:
                then()

    def ask_save(self, then: Callable[[], None] | None = None) -> None:
        """Ask where to save, and go on with ``then`` once it is done."""
        proposal = self._editor.path or Path.home() / "scene.json"
        self._chooser.ask_save(
            "Save the scene", SCENE_FILES, proposal, lambda path: self.save_as(path, then)
        )

    # --- the question ---------------------------------------------------------

    def unless_unsaved(self, action: Callable[[], None]) -> None:
        """Do something that would lose unsaved edits; first ask about them if there are any."""
        if self._editor.is_modified:
            self._postponed = action
        else:
            with self._messages.guard():
                action()

    @property
    def question(self) -> str | None:
        """What is asked about unsaved edits at the moment, None if nothing is."""
        if self._postponed is None:
            return None
        name = self._editor.path.name if self._editor.path else "this scene"
        return f"Save the changes to {name} first?"

    def answer(self, answer: Answer) -> None:
        """Answer the question and go on with what was asked for, unless cancelled."""
        action, self._postponed = self._postponed, None
        if action is None or answer == "cancel":
            return
        if answer == "save":
            self.save(action)
        else:
            with self._messages.guard():
                action()

    # --- dropped files --------------------------------------------------------

    def drop(self, names: Sequence[str]) -> None:
        """Open dropped scenes, add dropped meshes, drawings, fonts and pictures.

        Of several pictures the first goes on the selected light, each other on a new one.
        """
        pictures = 0
        for path in map(Path, names):
            if path.suffix.lower() in LIGHT_PICTURES[1]:
                pictures += 1
                if pictures > 1:
                    self._imports.add_picture(path)
                    continue
            if path.suffix.lower() == ".json":
                self.open(path)
            elif not self._imports.take(path):
                kinds = ", ".join(
                    (*MESH_SUFFIXES, *DRAWING_FILES[1], *font_suffixes(), *LIGHT_PICTURES[1])
                )
                self._messages.failure(
                    f"{path.name}: found '{path.suffix}', expected a scene (.json), or a mesh, "
                    f"a drawing, a font or a picture ({kinds})"
                )
