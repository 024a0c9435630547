"""Files that become part of the scene: meshes, drawings, fonts, pictures, dropped or chosen.

Free of the GUI, as `app.gui.documents` is, which owns the scene's own file.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from app import edits, step_names
from app.editor import Editor, Selection
from app.gui.file_types import DRAWING_FILES, LIGHT_PICTURES, FileChooser, font_files
from app.gui.messages import Messages
from app.meshes import MESH_SUFFIXES, load_mesh
from app.pictures import load_frame
from app.scene import AreaLight, OutlineSource, Picture, Scene, SvgSource, TextSource, Transform
from app.sources import font_suffixes, left_out, remade


class Imports:
    """Adds files to the scene under edit, each as one step; failures become messages.

    Parameters
    ----------
    editor : Editor
        Holds the scene.
    messages : Messages
        Gets what failed.
    chooser : FileChooser
        Asks for file names.
    """

    def __init__(self, editor: Editor, messages: Messages, chooser: FileChooser) -> None:
        self._editor = editor
        self._messages = messages
        self._chooser = chooser

    def take(self, path: Path) -> bool:
        """Add a file by its ending; return False if it is of no kind that can be added."""
        suffix = path.suffix.lower()
        if suffix in MESH_SUFFIXES:
            self.add_mesh(path)
        elif suffix in DRAWING_FILES[1]:
            self.add_drawing(path)
        elif suffix in LIGHT_PICTURES[1]:
            self.use_picture(path)
        elif suffix in font_suffixes():
            self.use_font(path)
        else:
            return False
        return True

    def add_mesh(self, path: Path) -> None:
        """Add a mesh file as an object, scaled to a metre if it is far from that."""
        with self._messages.guard():
            low, high = load_mesh(str(path.resolve())).bounds.astype(float)
            extent = float((high - low).max())
            factor = 1.0 if 0.1 <= extent <= 10.0 else 1.0 / max(extent, 1e-9)
            place = Transform((0.0, -factor * float(low[1]), 0.0), scale=(factor,) * 3)
            scene, index = edits.add_object(
                self._editor.scene, str(path.resolve()), path.stem, place
            )
            self._editor.apply(f"Add '{path.stem}'", scene)
            self._editor.selection = Selection.object(index)

    # --- lights -----------------------------------------------------------------

    def add_text(self, font: str = "") -> None:
        """Add a text light, to be typed in its panel."""
        with self._messages.guard():
            self._add_light(*edits.add_text(self._editor.scene, font=font))

    def add_drawing(self, path: Path) -> None:
        """Add an SVG file as a light, and say what of it is not to be seen."""
        with self._messages.guard():
            absolute = str(path.resolve())
            self._add_light(*edits.add_drawing(self._editor.scene, absolute))
            missing = left_out(SvgSource(absolute))
            if missing:
                self._messages.failure(f"{path.name}: left out {', '.join(missing)}")

    def ask_drawing(self) -> None:
        """Ask for an SVG file and add it as a light."""
        title = "Add a drawing as a light"
        self._chooser.ask_open(title, DRAWING_FILES, self._folder(), self.add_drawing)

    def use_font(self, path: Path) -> None:
        """Set the selected text in another font; without one, add a new text."""
        light = self._editor.selected_light
        if light is not None and isinstance(light.source, TextSource):
            self._make_again(light, replace(light.source, font=str(path.resolve())))
        else:
            self.add_text(str(path.resolve()))

    def use_picture(self, path: Path) -> None:
        """Put a picture file on the selected light; without one, add a light of its shape."""
        light = self._editor.selected_light
        if light is not None:
            self._put_picture(light, path)
        else:
            self.add_picture(path)

    def add_picture(self, path: Path) -> None:
        """Add a light that has the shape of a picture file, with the picture."""
        with self._messages.guard():
            picture = Picture(str(path.resolve()))
            load_frame(picture, 0.0)  # one that cannot be read changes nothing
            self._add_light(*edits.add_picture(self._editor.scene, picture))

    def ask_picture(self, light: AreaLight | None = None) -> None:
        """Ask for a picture file for a light, or for a new one."""
        folder = self._folder(light.picture.file if light is not None and light.picture else "")
        if light is None:
            self._chooser.ask_open(
                "Add a picture as a light", LIGHT_PICTURES, folder, self.add_picture
            )
        else:
            self._chooser.ask_open(
                f"Choose a picture for '{light.name}'", LIGHT_PICTURES, folder,
                lambda path: self._put_picture(light, path),
            )  # fmt: skip

    def _put_picture(self, light: AreaLight, path: Path) -> None:
        """Put a picture on a light, placed as the one before it."""
        with self._messages.guard():
            picture = Picture(str(path.resolve()))
            load_frame(picture, 0.0)
            self._change(
                light,
                lambda old: replace(
                    old,
                    picture=replace(old.picture, file=picture.file) if old.picture else picture,
                ),
            )

    def ask_source(self, light: AreaLight) -> None:
        """Ask for another font or drawing for a light that was made from one."""
        source = light.source
        if isinstance(source, TextSource):
            text, folder = source, self._folder(source.font)
            self._chooser.ask_open(
                "Choose a font", font_files(), folder,
                lambda path: self._make_again(light, replace(text, font=str(path.resolve()))),
            )  # fmt: skip
        elif source is not None:
            drawing, folder = source, self._folder(source.path)
            self._chooser.ask_open(
                "Choose a drawing", DRAWING_FILES, folder,
                lambda path: self._make_again(light, replace(drawing, path=str(path.resolve()))),
            )  # fmt: skip

    def _add_light(self, scene: Scene, index: int) -> None:
        self._editor.apply(step_names.describe(self._editor.scene, scene), scene)
        self._editor.selection = Selection.light(index)

    def _make_again(self, light: AreaLight, source: OutlineSource) -> None:
        """Make a light from another source."""
        with self._messages.guard():
            self._change(light, lambda old: remade(old, source))

    def _change(self, light: AreaLight, change: Callable[[AreaLight], AreaLight]) -> None:
        """Change a light, found by its name, if it is still there."""
        before = self._editor.scene
        names = [other.name for other in before.lights]
        if light.name in names:
            index = names.index(light.name)
            after = edits.replace_light(before, index, change(before.lights[index]))
            self._editor.apply(step_names.describe(before, after), after)

    def _folder(self, beside: str = "") -> Path:
        """Return where to begin looking for a file: beside another one, else beside the scene."""
        scene = self._editor.path
        return Path(beside).parent if beside else scene.parent if scene else Path.home()
