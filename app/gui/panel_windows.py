"""What joins the panels with the editor: each method draws the inside of a docked window.

A panel takes a value and returns a new one; here the difference is staged, so
that what goes on while a control is held is one step of the history. What a
panel refuses is raised; the window makes a message of it.
"""

from __future__ import annotations

from dataclasses import replace

from app import edits, step_names
from app.editor import Editor
from app.gui.beginning import first_material
from app.gui.comparison import Comparison
from app.gui.imports import Imports
from app.gui.live_picture import LivePicture
from app.gui.playback import Playback
from app.gui.summaries import view_parts
from app.panels.camera import camera_panel
from app.panels.compare import compare_panel
from app.panels.display import display_panel
from app.panels.light import light_panel, rename_field
from app.panels.material import material_panel, object_panel
from app.panels.picture import Player
from app.panels.scene_tree import scene_panel
from app.panels.widgets import button, hint, name_field
from app.render.techniques import AUTOMATIC, TECHNIQUES, find_technique, suited_technique
from app.scene import AreaLight, Material, RenderSettings, Scene, SceneObject, TextSource

MEASURES = ("reference", "ggx:4", "ltc:6")
"""What to compare with first: what is exact, or nearly, in the limit or at once."""


class PanelWindows:
    """The docked windows that show and change the scene.

    Remembers which light and which material were looked at last, so that
    their panels stay when something else is selected.
    """

    def __init__(self, editor: Editor, imports: Imports) -> None:
        self._editor = editor
        self._imports = imports
        self.begin(editor.scene)

    def begin(self, scene: Scene) -> None:
        """Forget what was looked at: another scene is shown now."""
        self._light = 0
        self._is_new_text = False
        self._material = first_material(scene)

    def _stage(self, scene: Scene) -> None:
        """Make a panel's scene the current one, as part of one step per held control."""
        if scene is not self._editor.scene and scene != self._editor.scene:
            self._editor.stage(step_names.describe(self._editor.scene, scene), scene)

    def scene(self) -> None:
        """Draw the list of everything."""
        editor = self._editor
        scene, selection = scene_panel(
            editor.scene, editor.selection, self._imports.ask_drawing, self._imports.ask_picture
        )
        if len(scene.lights) > len(editor.scene.lights):
            self._is_new_text = selection.kind == "light" and isinstance(
                scene.lights[selection.index].source, TextSource
            )
        self._stage(scene)
        editor.selection = selection

    def light(self, playback: Playback) -> None:
        """Draw the panel of the light that was selected last; ``playback`` plays its picture."""
        scene, selection = self._editor.scene, self._editor.selection
        if not scene.lights:
            hint("The scene has no light. Add one with + in the Scene panel.")
            return
        if selection.kind == "light":
            self._light = selection.index
        index = min(self._light, len(scene.lights) - 1)
        light = scene.lights[index]
        chosen = selection.kind == "light" and selection.index == index
        named = edits.rename_light(scene, index, rename_field(light.name))
        focus, self._is_new_text = self._is_new_text, False
        new = light_panel(
            light, selection.vertex if chosen else None, scene.camera.target,
            lambda: self._imports.ask_source(light), focus, self._player(light, playback),
        )  # fmt: skip
        self._stage(edits.replace_light(scene, index, new) if new != light else named)

    def _player(self, light: AreaLight, playback: Playback) -> Player:
        picture = light.picture
        seconds = playback.seconds(picture) if picture is not None else 0.0

        def ask_file() -> None:
            self._imports.ask_picture(light)

        if picture is None or seconds == 0.0:
            return Player(ask_file=ask_file)
        start = picture.start
        return Player(
            seconds, (playback.time + start) % seconds, playback.is_playing, ask_file,
            playback.toggle, lambda moment: playback.seek(moment - start),
        )  # fmt: skip

    def material(self, settings: RenderSettings) -> None:
        """Draw the panel of the material that was selected last."""
        editor = self._editor
        scene = editor.scene
        item = editor.selected_object
        if item is not None:
            self._material = item.material
        material = next((m for m in scene.materials if m.name == self._material), None)
        if material is None:
            if not scene.materials:
                hint("The scene has no material. Add an object with + in the Scene panel.")
                return
            material = scene.materials[0]
            self._material = material.name
        technique = suited_technique(settings.technique, anisotropic=True)
        anisotropic = find_technique(technique).anisotropic
        self._stage(self._material_rows(scene, material, item, anisotropic))

    def _material_rows(
        self, scene: Scene, material: Material, item: SceneObject | None, anisotropic: bool
    ) -> Scene:
        """Draw a material's rows, the selected object among its users; return the new scene."""
        changed = scene
        name = name_field("Name", material.name, "The material's name; objects share materials")
        new = material_panel(material, anisotropic)
        if new != material:
            changed = edits.replace_material(scene, material.name, new)
        elif name != material.name:
            changed = edits.rename_material(scene, material.name, name)
            self._material = changed.materials[scene.materials.index(material)].name
        users = [other.name for other in scene.objects if other.material == material.name]
        if item is None:
            hint(f"Used by {', '.join(users) or 'nothing'}. Click an object to see its material.")
        elif len(users) > 1:
            hint(f"Shared by {', '.join(users)}.")
            if button("Make a copy of its own", f"So that only '{item.name}' changes"):
                changed = edits.own_material(scene, self._editor.selection.index)
        return changed

    def object(self) -> None:
        """Draw the panel of the selected object."""
        item = self._editor.selected_object
        if item is None:
            hint("Click an object to place it.")
            return
        scene, index = self._editor.scene, self._editor.selection.index
        typed = name_field("Name", item.name, "What the object is called")
        new = object_panel(item, [material.name for material in scene.materials])
        if new != item:
            self._stage(edits.replace_object(scene, index, new))
        else:
            self._stage(edits.rename_object(scene, index, typed))

    def display(self, settings: RenderSettings) -> RenderSettings:
        """Draw the panel of exposure, tone map and quality; return the settings as edited."""
        scene = self._editor.scene
        display, settings = display_panel(scene.display, settings, (AUTOMATIC, *TECHNIQUES))
        self._stage(replace(scene, display=display))
        return settings

    def compare(self, comparison: Comparison, picture: LivePicture) -> None:
        """Draw the panel of what the picture is compared with."""
        names = (*MEASURES, AUTOMATIC, *(name for name in TECHNIQUES if name not in MEASURES))
        comparison.form, asked = compare_panel(
            comparison.form, names, comparison.report(), view_parts(comparison.parts, picture)
        )
        if asked:
            comparison.ask_parts(picture)

    def camera(self) -> None:
        """Draw the panel of the view, which is no step of the history."""
        camera = camera_panel(self._editor.scene.camera)
        if camera is not self._editor.scene.camera:
            self._editor.look(camera)
