"""The editor: the current scene, what is selected in it, and how it came to be.

Undo is a list of whole scenes with a name for each step, as in goxel
(``src/image.c``): unchanged parts are shared, edits that change nothing are
dropped, and the camera is spared, so undoing never moves the view. A drag is
one step however many scenes it passes through: `begin`, `update` ...,
`commit`. Free of GL and of the GUI; files come and go through the caller.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, TypeAlias

from app import contours, edits, lights, step_names
from app.scene import AreaLight, Camera, Scene, SceneObject

Kind: TypeAlias = Literal["none", "light", "object"]


@dataclass(frozen=True, slots=True)
class Selection:
    """One light or object by index, and perhaps one vertex (contour, point) of the light."""

    kind: Kind = "none"
    index: int = -1
    vertex: tuple[int, int] | None = None

    @classmethod
    def light(cls, index: int, vertex: tuple[int, int] | None = None) -> Selection:
        return cls("light", index, vertex)

    @classmethod
    def object(cls, index: int) -> Selection:
        return cls("object", index)

    def within(self, scene: Scene) -> Selection:
        """Return what of the selection exists in ``scene``."""
        if self.kind == "object":
            return self if self.index < len(scene.objects) else NOTHING
        if self.kind == "light":
            if self.index >= len(scene.lights):
                return NOTHING
            if self.vertex is not None:
                contour, point = self.vertex
                own = scene.lights[self.index].outline.contours
                if contour >= len(own) or point >= contours.size_of(own[contour]):
                    return replace(self, vertex=None)
        return self


NOTHING = Selection()


@dataclass(frozen=True, slots=True)
class Step:
    """A scene of the history and the name of the edit that led to it."""

    name: str
    scene: Scene


def same_but_camera(a: Scene, b: Scene) -> bool:
    """Tell whether two scenes are equal apart from the camera."""
    return (
        a.lights == b.lights
        and a.objects == b.objects
        and a.materials == b.materials
        and a.display == b.display
    )


def duplicate_selected(scene: Scene, selection: Selection) -> tuple[Scene, Selection]:
    """Copy what is selected and select the copy."""
    if selection.kind == "light":
        scene, index = edits.duplicate_light(scene, selection.index)
        return scene, Selection.light(index)
    if selection.kind == "object":
        scene, index = edits.duplicate_object(scene, selection.index)
        return scene, Selection.object(index)
    return scene, selection


def remove_selected(scene: Scene, selection: Selection) -> tuple[Scene, Selection]:
    """Remove the selected corner or anchor, light or object.

    Raises
    ------
    SceneError
        If nothing with an inside would remain of a light.
    """
    if selection.kind == "object":
        return edits.remove_object(scene, selection.index), NOTHING
    if selection.kind != "light":
        return scene, selection
    if selection.vertex is None:
        return edits.remove_light(scene, selection.index), NOTHING
    light = lights.remove_vertex(scene.lights[selection.index], selection.vertex)
    return edits.replace_light(scene, selection.index, light), replace(selection, vertex=None)


class Editor:
    """A scene under edit.

    Parameters
    ----------
    scene : Scene
        Where the history starts.
    path : Path or None
        The file it came from.
    """

    def __init__(self, scene: Scene, path: Path | None = None) -> None:
        self.open(scene, path)

    def open(self, scene: Scene, path: Path | None = None) -> None:
        """Start over with another scene: empty history, nothing selected, nothing unsaved."""
        self._scene = scene
        self._saved = scene
        self._history = [Step("Open", scene)]
        self._position = 0
        self._drag: Step | None = None
        self._selection = NOTHING
        self.path = path

    # --- what is ----------------------------------------------------------

    @property
    def scene(self) -> Scene:
        """The current scene, a drag in progress included."""
        return self._scene

    @property
    def selection(self) -> Selection:
        """What is selected and still there."""
        return self._selection

    @selection.setter
    def selection(self, selection: Selection) -> None:
        self._selection = selection.within(self._scene)

    @property
    def selected_light(self) -> AreaLight | None:
        chosen = self._selection
        return self._scene.lights[chosen.index] if chosen.kind == "light" else None

    @property
    def selected_object(self) -> SceneObject | None:
        chosen = self._selection
        return self._scene.objects[chosen.index] if chosen.kind == "object" else None

    @property
    def is_modified(self) -> bool:
        """Whether anything but the view differs from the last saved scene."""
        return not same_but_camera(self._scene, self._saved)

    # --- edits ------------------------------------------------------------

    def apply(self, name: str, scene: Scene) -> bool:
        """Make ``scene`` the current one, as one named step. Return False if nothing changed.

        A drag in progress is committed first.
        """
        self.commit()
        self._show(scene)
        return self._record(name)

    def look(self, camera: Camera) -> None:
        """Change the view; no step, no unsaved mark."""
        self._scene = replace(self._scene, camera=camera)

    @property
    def is_dragging(self) -> bool:
        return self._drag is not None

    def begin(self, name: str) -> None:
        """Start a drag: what follows until `commit` will be one step called ``name``."""
        self.commit()
        self._drag = Step(name, self._scene)

    def update(self, scene: Scene) -> None:
        """Show the scene of the moment, within a drag.

        Raises
        ------
        RuntimeError
            If no drag was begun.
        """
        if self._drag is None:
            raise RuntimeError("update without begin")
        self._show(scene)

    def stage(self, name: str, scene: Scene) -> None:
        """Begin a drag called ``name`` unless it is under way already, and update it."""
        if self._drag is None or self._drag.name != name:
            self.begin(name)
        self.update(scene)

    def commit(self) -> bool:
        """End a drag and record its step. Return False if there was none or nothing changed."""
        if self._drag is None:
            return False
        name, self._drag = self._drag.name, None
        return self._record(name)

    def cancel(self) -> None:
        """End a drag and go back to where it began; the view stays."""
        if self._drag is not None:
            scene, self._drag = self._drag.scene, None
            self._show(replace(scene, camera=self._scene.camera))

    def duplicate(self) -> None:
        """Copy the selected light or object, as one step."""
        scene, selection = duplicate_selected(self._scene, self._selection)
        self._apply_to_selected(step_names.describe(self._scene, scene), scene, selection)

    def remove(self) -> None:
        """Remove the selected corner or anchor, light or object, as one step.

        Raises
        ------
        SceneError
            If nothing with an inside would remain of a light.
        """
        scene, selection = remove_selected(self._scene, self._selection)
        name = step_names.describe(self._scene, scene)
        light = self.selected_light
        if light is not None and self._selection.vertex is not None:
            contour = light.outline.contours[self._selection.vertex[0]]
            name = f"Remove {lights.word_for_vertex(contour)} of '{light.name}'"
        self._apply_to_selected(name, scene, selection)

    def escape(self) -> None:
        """Cancel a drag if there is one, else select nothing."""
        if self._drag is not None:
            self.cancel()
        else:
            self.selection = NOTHING

    # --- history ----------------------------------------------------------

    @property
    def steps(self) -> tuple[str, ...]:
        """Names of all steps, undone ones included; the first is how the scene began."""
        return tuple(step.name for step in self._history)

    @property
    def position(self) -> int:
        """Index of the current step among `steps`."""
        return self._position

    @property
    def undo_name(self) -> str | None:
        """Name of the step that `undo` would take back, None if there is none."""
        return self._history[self._position].name if self._position else None

    @property
    def redo_name(self) -> str | None:
        """Name of the step that `redo` would do again, None if there is none."""
        following = self._position + 1
        return self._history[following].name if following < len(self._history) else None

    def undo(self) -> str | None:
        """Take back one step and return its name. During a drag, cancel the drag instead."""
        if self._drag is not None:
            cancelled = self._drag.name
            self.cancel()
            return cancelled
        name = self.undo_name
        if name is not None:
            self.go_to(self._position - 1)
        return name

    def redo(self) -> str | None:
        """Do the last undone step again and return its name."""
        name = None if self._drag is not None else self.redo_name
        if name is not None:
            self.go_to(self._position + 1)
        return name

    def go_to(self, position: int) -> None:
        """Show the scene of any step; the view stays.

        Raises
        ------
        IndexError
            If there is no such step.
        """
        self.commit()
        if not 0 <= position < len(self._history):
            raise IndexError(f"step {position} of {len(self._history)}")
        self._position = position
        self._show(replace(self._history[position].scene, camera=self._scene.camera))

    def mark_saved(self, path: Path) -> None:
        """Remember that the current scene is in the file ``path``."""
        self._saved = self._scene
        self.path = path

    # --- inside -----------------------------------------------------------

    def _show(self, scene: Scene) -> None:
        self._scene = scene
        self._selection = self._selection.within(scene)

    def _apply_to_selected(self, name: str, scene: Scene, selection: Selection) -> None:
        if scene != self._scene:
            self.apply(name, scene)
            self.selection = selection

    def _record(self, name: str) -> bool:
        if same_but_camera(self._scene, self._history[self._position].scene):
            return False
        del self._history[self._position + 1 :]
        self._history.append(Step(name, self._scene))
        self._position += 1
        return True
