"""The window: events and frames over the same renderer as everything else.

hello_imgui owns window, docking, menus and idling (moderngl-window's imgui
integration does not work with imgui-bundle 1.93, see its issues 222 and 224).
Each frame shows the panels, takes the values they return, and stages the
difference with the editor: an edit that goes on while a control is held is
one step of the history, whichever panel it came from.
"""

from __future__ import annotations

# isort: off
import imgui_bundle  # noqa: F401  (first: glfw then takes the library that imgui-bundle carries)
import glfw
# isort: on

import re
import sys
import time
import traceback
import warnings
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import moderngl
from imgui_bundle import ImVec2, hello_imgui, imgui, immapp
from imgui_bundle import icons_fontawesome_4 as icons
from imgui_bundle.glfw_utils import glfw_window_hello_imgui
from imgui_bundle.imguizmo import im_guizmo as gizmo

from app import edits, theme
from app.camera_control import project, widened
from app.dialogs import MESHES, PICTURES, SCENES, FileDialogs
from app.editor import NOTHING, Editor, Selection, duplicate_selected, remove_selected
from app.errors import InputError
from app.images import save_image
from app.meshes import load_mesh
from app.messages import Messages
from app.panels.camera import camera_panel
from app.panels.display import display_panel
from app.panels.export import Export, export_form
from app.panels.light import light_panel, rename_field
from app.panels.material import material_panel, object_panel
from app.panels.performance import PlanLine, Report, performance_panel
from app.panels.scene_tree import scene_panel
from app.panels.status import help_line, status_bar
from app.panels.widgets import button, hint, name_field
from app.render.plan import Plan
from app.render.renderer import Renderer
from app.render.techniques import TECHNIQUES, find_technique
from app.scene import Material, RenderSettings, Scene, SceneError, SceneObject, Shot, Transform
from app.scene_io import demo_scenes, load_scene, save_scene
from app.viewport import Viewport

TITLE = "LTC Viewer"
SIZE = (1440, 900)
STILL_SAMPLES = 32
IDLE_FPS = 10.0
PASS_NAMES = {
    "gbuffer": "G-buffer",
    "lighting": "Lighting",
    "display": "Display",
    "cpu": "CPU, submitting",
}
EXPORT_SECONDS = 0.05
"""How long one frame may spend on an export before the window is shown again."""

_KEY = imgui.Key
_CTRL = _KEY.mod_ctrl
_SHIFT = _KEY.mod_shift


class Window:
    """The application: an editor, a renderer, and what joins them on the screen.

    Parameters
    ----------
    scene : Scene
        What to show first.
    path : Path or None
        Its file, None for a scene that has none yet.
    """

    def __init__(self, scene: Scene, path: Path | None = None) -> None:
        self.editor = Editor(scene, path)
        self.settings = RenderSettings(samples=STILL_SAMPLES)
        self.messages = Messages()
        self.renderer: Renderer
        self.viewport: Viewport
        self._dialogs = FileDialogs()
        self._light = 0
        self._material = _first_material(scene)
        self._export = Export()
        self._exporting: _Export | None = None
        self._ask_export = False
        self._after_question: Callable[[], None] | None = None
        self._ask_unsaved = False
        self._title = ""
        self._plan_of: Shot | None = None
        self._plan: tuple[PlanLine, ...] = ()
        self._dropped: list[str] = []
        self.params = self._params()
        self._select_first()

    # --- set-up -----------------------------------------------------------------

    def _params(self) -> hello_imgui.RunnerParams:
        params = hello_imgui.RunnerParams()
        params.app_window_params.window_title = TITLE
        params.app_window_params.window_geometry.size = SIZE
        params.app_window_params.restore_previous_geometry = True
        params.ini_folder_type = hello_imgui.IniFolderType.app_user_config_folder
        params.ini_filename = "ltc-viewer/window.ini"
        params.fps_idling.fps_idle = IDLE_FPS
        params.fps_idling.time_active_after_last_event = 0.5

        options = hello_imgui.OpenGlOptions()
        options.major_version, options.minor_version = 4, 1
        options.use_core_profile = options.use_forward_compat = True
        options.glsl_version = "410"
        options.anti_aliasing_samples = 0
        params.renderer_backend_options.open_gl_options = options

        window = params.imgui_window_params
        window.default_imgui_window_type = (
            hello_imgui.DefaultImGuiWindowType.provide_full_screen_dock_space
        )
        window.show_menu_bar = window.show_status_bar = True
        window.show_menu_app = window.show_menu_view = window.show_status_fps = False
        window.remember_theme = window.remember_status_bar_settings = False

        calls = params.callbacks
        calls.load_additional_fonts = theme.load_fonts
        calls.setup_imgui_style = theme.apply
        calls.post_init = self._start
        calls.post_new_frame = gizmo.begin_frame
        calls.show_menus = self._menus
        calls.show_status = self._status
        calls.show_gui = self._each_frame
        calls.confirm_exit = self._may_exit
        calls.before_exit = self._stop

        params.docking_params = _layout(
            {
                "Viewport": partial(self._guarded, self._viewport_window),
                "Scene": partial(self._guarded, self._scene_window),
                "Light": partial(self._guarded, self._light_window),
                "Material": partial(self._guarded, self._material_window),
                "Object": partial(self._guarded, self._object_window),
                "Display": partial(self._guarded, self._display_window),
                "Camera": partial(self._guarded, self._camera_window),
                "Performance": partial(self._guarded, self._performance_window),
            }
        )
        return params

    def _start(self) -> None:
        """Create what needs the GL context; hello_imgui calls this when it is there."""
        self.renderer = Renderer(moderngl.create_context())
        self.viewport = Viewport(self.renderer, self.messages)
        glfw.set_drop_callback(glfw_window_hello_imgui(), self._on_drop)

    def _on_drop(self, _window: Any, paths: Any, *_: Any) -> None:
        self._dropped.extend(map(str, paths))

    def _stop(self) -> None:
        if self._exporting is not None:
            self._exporting.renderer.release()
        self.renderer.release()

    # --- one frame ----------------------------------------------------------------

    def _each_frame(self) -> None:
        """What is not inside a docked window: shortcuts, dialogs, messages, the end of drags."""
        editor = self.editor
        self._shortcuts()
        self._dialogs.poll()
        self._take_dropped()
        self._question()
        self._export_dialog()
        if editor.is_dragging and not (imgui.is_any_item_active() or self.viewport.is_busy):
            editor.commit()
        if editor.selection.kind == "light":
            self._light = editor.selection.index
        view = self.viewport.view
        above_help = 2.4 * imgui.get_font_size() if self.viewport.show_overlays else 0.0
        self.messages.draw(view.x + view.width, view.y + view.height - above_help)
        self._update_title()
        if not self.viewport.is_idle or self._exporting is not None:
            hello_imgui.request_refresh()

    def _guarded(self, action: Callable[[], None]) -> None:
        """Do something for the user; say what did not work instead of ending the program."""
        try:
            action()
        except (InputError, SceneError, OSError) as failure:
            self.messages.failure(str(failure))
        except Exception as failure:
            traceback.print_exc()
            self.messages.failure(f"Something went wrong: {failure}")

    def _stage(self, scene: Scene) -> None:
        """Make a panel's scene the current one, as part of one step per held control."""
        if scene is not self.editor.scene and scene != self.editor.scene:
            self.editor.stage(edits.describe(self.editor.scene, scene), scene)

    def _update_title(self) -> None:
        editor = self.editor
        name = editor.path.name if editor.path else "Untitled"
        title = f"{name}{' •' if editor.is_modified else ''} — {TITLE}"
        if title != self._title:
            self._title = title
            glfw.set_window_title(glfw_window_hello_imgui(), title)

    @property
    def title(self) -> str:
        """The window's title: file, unsaved mark, program."""
        return self._title

    # --- docked windows -------------------------------------------------------------

    def _viewport_window(self) -> None:
        editor = self.editor
        self.viewport.help = help_line(editor.scene, editor.selection, self.viewport.tool)
        imgui.push_style_var(imgui.StyleVar_.window_padding, ImVec2(0.0, 0.0))
        flags = imgui.WindowFlags_.no_scrollbar | imgui.WindowFlags_.no_scroll_with_mouse
        bare = imgui.WindowClass()
        bare.dock_node_flags_override_set = imgui.internal.DockNodeFlagsPrivate_.no_tab_bar
        imgui.set_next_window_class(bare)
        imgui.begin("Viewport", None, flags)
        imgui.pop_style_var()
        self._guarded(lambda: self.viewport.draw(self.editor, self.settings))
        if self.viewport.show_overlays:
            self._tools()
        imgui.end()

    def _tools(self) -> None:
        """Draw the tool buttons in the upper left corner of the picture."""
        view, em = self.viewport.view, imgui.get_font_size()
        imgui.set_cursor_screen_pos(ImVec2(view.x + 0.7 * em, view.y + 0.7 * em))
        tools = (
            ("move", icons.ICON_FA_ARROWS_ALT, "Move what is selected (W)"),
            ("rotate", icons.ICON_FA_SYNC, "Turn what is selected (E)"),
        )
        for name, icon, tip in tools:
            chosen = self.viewport.tool == name
            colour = theme.ACCENT if chosen else theme.grey(0.85)
            imgui.push_style_color(imgui.Col_.text, colour)
            imgui.push_style_color(imgui.Col_.button, theme.grey(0.1, 0.78))
            if button(f"{icon}###{name}", tip, width=2.1 * em):
                self.viewport.tool = name
            imgui.pop_style_color(2)
            imgui.same_line(0.0, 0.3 * em)
        imgui.push_style_color(imgui.Col_.button, theme.grey(0.1, 0.78))
        if button(f"{icons.ICON_FA_CROSSHAIRS}###frame", "Look at what is selected (F)"):
            self._frame()
        imgui.pop_style_color()

    def _scene_window(self) -> None:
        editor = self.editor
        scene, selection = scene_panel(editor.scene, editor.selection)
        self._stage(scene)
        editor.selection = selection

    def _light_window(self) -> None:
        scene = self.editor.scene
        if not scene.lights:
            hint("The scene has no light. Add one with + in the Scene panel.")
            return
        index = min(self._light, len(scene.lights) - 1)
        light = scene.lights[index]
        selection = self.editor.selection
        chosen = selection.kind == "light" and selection.index == index
        named = edits.rename_light(scene, index, rename_field(light.name))

        def edit() -> None:
            vertex = selection.vertex if chosen else None
            new = light_panel(light, vertex, scene.camera.target)
            if new != light:
                self._stage(edits.replace_light(scene, index, new))
            else:
                self._stage(named)

        self._guarded(edit)

    def _material_window(self) -> None:
        editor = self.editor
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
        self._guarded(lambda: self._material_rows(scene, material, item))

    def _material_rows(self, scene: Scene, material: Material, item: SceneObject | None) -> None:
        changed = scene
        name = name_field("Name", material.name, "The material's name; objects share materials")
        new = material_panel(material, find_technique(self.settings.technique).anisotropic)
        if new != material:
            changed = edits.replace_material(scene, material.name, new)
        elif name != material.name:
            changed = edits.rename_material(scene, material.name, name)
            renamed = [m.name for m in changed.materials]
            self._material = renamed[[m.name for m in scene.materials].index(material.name)]
        users = [other.name for other in scene.objects if other.material == material.name]
        if item is None:
            hint(f"Used by {', '.join(users) or 'nothing'}. Click an object to see its material.")
        elif len(users) > 1:
            hint(f"Shared by {', '.join(users)}.")
            if button("Make a copy of its own", f"So that only '{item.name}' changes"):
                changed = edits.own_material(scene, self.editor.selection.index)
        self._stage(changed)

    def _object_window(self) -> None:
        item = self.editor.selected_object
        if item is None:
            hint("Click an object to place it.")
            return
        scene, index = self.editor.scene, self.editor.selection.index

        def edit() -> None:
            typed = name_field("Name", item.name, "What the object is called")
            new = object_panel(item, [material.name for material in scene.materials])
            if new != item:
                self._stage(edits.replace_object(scene, index, new))
            else:
                self._stage(edits.rename_object(scene, index, typed))

        self._guarded(edit)

    def _display_window(self) -> None:
        editor = self.editor
        display, self.settings = display_panel(
            editor.scene.display, self.settings, tuple(TECHNIQUES)
        )
        self._stage(replace(editor.scene, display=display))

    def _camera_window(self) -> None:
        def edit() -> None:
            camera = camera_panel(self.editor.scene.camera)
            if camera is not self.editor.scene.camera:
                self.editor.look(camera)

        self._guarded(edit)

    def _performance_window(self) -> None:
        viewport, shot = self.viewport, self.viewport.shot
        if shot is None:
            return
        if self._plan_of is None or _other_needs(self._plan_of, shot):
            self._plan_of = shot
            self._plan = _plan_lines(self.renderer.plan(replace(shot, settings=self.settings)))
        report = Report(
            passes=tuple(
                (PASS_NAMES.get(name, name), value)
                for name, value in self.renderer.timings(wait=False).items()
            ),
            history=tuple(viewport.history),
            gpu=str(self.renderer.ctx.info["GL_RENDERER"]),
            size=(shot.width, shot.height),
            samples=viewport.samples,
            plan=self._plan,
        )
        performance_panel(report)

    def _status(self) -> None:
        step = self.editor.undo_name
        shot = self.viewport.shot
        size = (shot.width, shot.height) if shot is not None else (0, 0)
        text = f"Last edit: {step}" if step else "Drag the picture to look around"
        status_bar(text, self.viewport.samples, size, self.settings.technique)

    # --- menus and keys ----------------------------------------------------------------

    def _menus(self) -> None:
        editor = self.editor
        if imgui.begin_menu("File"):
            if imgui.menu_item_simple("New", "Ctrl+N"):
                self.new()
            if imgui.menu_item_simple("Open…###open", "Ctrl+O"):
                self.ask_open()
            if imgui.begin_menu("Open demo"):
                for name, path in demo_scenes().items():
                    if imgui.menu_item_simple(f"{spoken(name)}###{name}"):
                        self._unless_unsaved(partial(self.open, path))
                imgui.end_menu()
            imgui.separator()
            if imgui.menu_item_simple("Save", "Ctrl+S"):
                self.save()
            if imgui.menu_item_simple("Save as…###save as", "Ctrl+Shift+S"):
                self.ask_save()
            imgui.separator()
            if imgui.menu_item_simple("Export picture…###export", "Ctrl+E"):
                self._ask_export = True
            imgui.separator()
            if imgui.menu_item_simple("Quit", "Ctrl+Q"):
                self.quit()
            imgui.end_menu()
        if imgui.begin_menu("Edit"):
            undo, redo = editor.undo_name, editor.redo_name
            if imgui.menu_item_simple(f"Undo {undo or ''}###undo", "Ctrl+Z", False, bool(undo)):
                self.undo()
            if imgui.menu_item_simple(f"Redo {redo or ''}###redo", "Ctrl+Y", False, bool(redo)):
                self.redo()
            imgui.separator()
            chosen = editor.selection.kind != "none"
            if imgui.menu_item_simple("Duplicate", "Ctrl+D", False, chosen):
                self._apply("Duplicate", duplicate_selected)
            if imgui.menu_item_simple("Remove", "Del", False, chosen):
                self._apply("Remove", remove_selected)
            imgui.separator()
            if imgui.begin_menu("History", len(editor.steps) > 1):
                for position, name in enumerate(editor.steps):
                    label = f"{name}###{position}"
                    if imgui.menu_item_simple(label, "", position == editor.position):
                        editor.go_to(position)
                imgui.end_menu()
            imgui.end_menu()
        if imgui.begin_menu("View"):
            if imgui.menu_item_simple("Look at selection", "F"):
                self._frame()
            shown = self.viewport.show_overlays
            if imgui.menu_item_simple("Outlines and handles", "H", shown):
                self.viewport.show_overlays = not shown
            imgui.separator()
            for window in self.params.docking_params.dockable_windows:
                if window.label != "Viewport" and imgui.menu_item_simple(
                    window.label, "", window.is_visible
                ):
                    window.is_visible = not window.is_visible
            imgui.separator()
            if imgui.menu_item_simple("Reset layout"):
                self.params.docking_params.layout_reset = True
            imgui.end_menu()

    def _shortcuts(self) -> None:
        """Act on keys; single letters only while nothing is typed."""
        typing = imgui.get_io().want_text_input
        pressed = imgui.is_key_chord_pressed
        table: tuple[tuple[int, bool, Callable[[], None]], ...] = (
            (_CTRL | _SHIFT | _KEY.z, False, self.redo),
            (_CTRL | _KEY.z, False, self.undo),
            (_CTRL | _KEY.y, False, self.redo),
            (_CTRL | _SHIFT | _KEY.s, True, self.ask_save),
            (_CTRL | _KEY.s, True, self.save),
            (_CTRL | _KEY.o, True, self.ask_open),
            (_CTRL | _KEY.n, True, self.new),
            (_CTRL | _KEY.d, False, lambda: self._apply("Duplicate", duplicate_selected)),
            (_CTRL | _KEY.e, True, self._open_export),
            (_CTRL | _KEY.q, True, self.quit),
            (_KEY.delete, False, lambda: self._apply("Remove", remove_selected)),
            (_KEY.escape, False, self._escape),
            (_KEY.f, False, self._frame),
            (_KEY.h, False, self._toggle_overlays),
            (_KEY.w, False, lambda: setattr(self.viewport, "tool", "move")),
            (_KEY.e, False, lambda: setattr(self.viewport, "tool", "rotate")),
        )
        if imgui.is_popup_open("", imgui.PopupFlags_.any_popup):
            return
        for chord, also_typing, action in table:
            if (also_typing or not typing) and pressed(chord):
                self._guarded(action)
                return

    def _escape(self) -> None:
        if self.editor.is_dragging:
            self.editor.cancel()
        else:
            self.editor.selection = NOTHING

    def _toggle_overlays(self) -> None:
        self.viewport.show_overlays = not self.viewport.show_overlays

    def _frame(self) -> None:
        self._guarded(lambda: self.viewport.frame(self.editor))

    def _open_export(self) -> None:
        self._ask_export = True

    def undo(self) -> None:
        """Take back the last step."""
        self.editor.undo()

    def redo(self) -> None:
        """Do the last undone step again."""
        self.editor.redo()

    def _apply(
        self, verb: str, edit: Callable[[Scene, Selection], tuple[Scene, Selection]]
    ) -> None:
        """Do one edit to what is selected."""
        editor = self.editor

        def do() -> None:
            scene, selection = edit(editor.scene, editor.selection)
            if scene != editor.scene:
                corner = editor.selection.vertex is not None
                name = f"{verb} corner" if corner else edits.describe(editor.scene, scene)
                editor.apply(name, scene)
                editor.selection = selection

        self._guarded(do)

    # --- files ---------------------------------------------------------------------

    def show(self, scene: Scene, path: Path | None) -> None:
        """Show another scene with a fresh history."""
        self.editor.open(scene, path)
        self.messages.clear()
        self._light = 0
        self._material = _first_material(scene)
        self._select_first()

    def _select_first(self) -> None:
        """Select the light with the fewest corners amid the picture: the one to try first."""
        scene = self.editor.scene
        shown = []
        for index, light in enumerate(scene.lights):
            at = project(scene.camera, edits.centre_of(light), 16.0, 9.0)
            if light.visible and at is not None and 1.0 < at[0] < 15.0 and 1.0 < at[1] < 8.0:
                shown.append((len(edits.vertices_of(light)), index))
        if shown:
            self.editor.selection = Selection.light(min(shown)[1])

    def new(self) -> None:
        """Start a scene of a floor and one light, after asking about unsaved edits."""
        self._unless_unsaved(lambda: self.show(new_scene(), None))

    def open(self, path: Path) -> None:
        """Open a scene file; a failure becomes a message."""

        def do() -> None:
            scene = load_scene(path)
            own = path.resolve() not in {demo.resolve() for demo in demo_scenes().values()}
            self.show(scene, path if own else None)

        self._guarded(do)

    def ask_open(self) -> None:
        """Ask for a scene file and open it."""
        folder = self.editor.path.parent if self.editor.path else Path.home()
        self._unless_unsaved(
            lambda: self._dialogs.ask_open("Open a scene", SCENES, folder, self.open)
        )

    def save(self, then: Callable[[], None] | None = None) -> None:
        """Save to the scene's file, ask for one if it has none; go on with ``then`` if saved."""
        if self.editor.path is None:
            self.ask_save(then)
        else:
            self.save_as(self.editor.path, then)

    def save_as(self, path: Path, then: Callable[[], None] | None = None) -> None:
        """Save to a file and go on with ``then``; a failure becomes a message."""

        def do() -> None:
            self.editor.commit()
            save_scene(self.editor.scene, path)
            self.editor.mark_saved(path)
            self.messages.note(f"Saved {path.name}")
            if then is not None:
                then()

        self._guarded(do)

    def ask_save(self, then: Callable[[], None] | None = None) -> None:
        """Ask where to save, and go on with ``then`` once it is done."""
        proposal = self.editor.path or Path.home() / "scene.json"
        self._dialogs.ask_save(
            "Save the scene", SCENES, proposal, lambda path: self.save_as(path, then)
        )

    def _take_dropped(self) -> None:
        """Open dropped scenes, add dropped meshes."""
        dropped, self._dropped = self._dropped, []
        for name in dropped:
            path = Path(name)
            if path.suffix.lower() == ".json":
                self._unless_unsaved(partial(self.open, path))
            elif path.suffix.lower().lstrip(".") in MESHES[1]:
                self.add_mesh(path)
            else:
                self.messages.failure(
                    f"{path.name}: found '{path.suffix}', expected a scene (.json) or "
                    f"a mesh ({', '.join('.' + ending for ending in MESHES[1])})"
                )

    def add_mesh(self, path: Path) -> None:
        """Add a mesh file as an object, scaled to a metre if it is far from that."""

        def do() -> None:
            low, high = load_mesh(str(path.resolve())).bounds.astype(float)
            extent = float((high - low).max())
            factor = 1.0 if 0.1 <= extent <= 10.0 else 1.0 / max(extent, 1e-9)
            place = Transform((0.0, -factor * float(low[1]), 0.0), scale=(factor,) * 3)
            scene, index = edits.add_object(
                self.editor.scene, str(path.resolve()), path.stem, place
            )
            self.editor.apply(f"Add '{path.stem}'", scene)
            self.editor.selection = Selection.object(index)

        self._guarded(do)

    # --- questions ---------------------------------------------------------------------

    def quit(self) -> None:
        """End the program, after asking about unsaved edits."""
        self._unless_unsaved(self._exit)

    def _exit(self) -> None:
        self.params.app_shall_exit = True

    def _may_exit(self) -> bool:
        if self.editor.is_modified:
            self.quit()
            return False
        return True

    def _unless_unsaved(self, action: Callable[[], None]) -> None:
        """Do something that would lose unsaved edits, after asking if there are any."""
        if self.editor.is_modified:
            self._after_question, self._ask_unsaved = action, True
        else:
            self._guarded(action)

    def _question(self) -> None:
        if self._ask_unsaved:
            imgui.open_popup("Unsaved changes")
            self._ask_unsaved = False
        if not _begin_modal("Unsaved changes"):
            return
        name = self.editor.path.name if self.editor.path else "this scene"
        imgui.text(f"Save the changes to {name} first?")
        imgui.spacing()
        width = 7.0 * imgui.get_font_size()
        action = self._after_question
        if button("Save###save first", width=width):
            imgui.close_current_popup()
            self.save(action)
        imgui.same_line()
        if button("Discard###discard", width=width):
            imgui.close_current_popup()
            if action is not None:
                self._guarded(action)
        imgui.same_line()
        if button("Cancel###cancel", width=width):
            imgui.close_current_popup()
        imgui.end_popup()

    # --- export ------------------------------------------------------------------------

    def _export_dialog(self) -> None:
        if self._ask_export:
            self._ask_export = False
            imgui.open_popup("Export picture")
        if _begin_modal("Export picture"):
            if self._exporting is None:
                self._export = export_form(self._export, self.viewport.view.pixels)
                imgui.spacing()
                width = 7.0 * imgui.get_font_size()
                if button("Export…###choose file", width=width):
                    proposal = self._proposal(self._export.kind)
                    self._dialogs.ask_save("Export a picture", PICTURES, proposal, self.export)
                    imgui.close_current_popup()
                imgui.same_line()
                if button("Cancel###cancel export", width=width):
                    imgui.close_current_popup()
            imgui.end_popup()
        if self._exporting is not None:
            self._go_on_exporting(self._exporting)

    def _proposal(self, kind: str) -> Path:
        path = self.editor.path
        return path.with_suffix(f".{kind}") if path else Path.home() / f"picture.{kind}"

    def export(self, path: Path, export: Export | None = None) -> None:
        """Start to render a picture file, framed as in the window; `is_exporting` until written."""
        chosen = export or self._export
        settings = replace(self.settings, samples=chosen.samples)

        def do() -> None:
            scene = self.editor.scene
            camera = widened(scene.camera, chosen.width / chosen.height)
            shot = Shot(replace(scene, camera=camera), settings, chosen.width, chosen.height)
            self._exporting = _Export(path, shot, Renderer(self.renderer.ctx))

        self._guarded(do)

    @property
    def is_exporting(self) -> bool:
        return self._exporting is not None

    def _go_on_exporting(self, export: _Export) -> None:
        """Add samples for a moment, show how far it is, and write the file at the end."""
        imgui.open_popup("Exporting")
        stopped = False
        if _begin_modal("Exporting"):
            imgui.text(export.path.name)
            total = export.shot.settings.samples
            size = ImVec2(20.0 * imgui.get_font_size(), 0.0)
            imgui.progress_bar(export.done / total, size, f"{export.done} of {total} samples")
            stopped = button("Stop###stop export")
            imgui.end_popup()

        def do() -> None:
            nonlocal stopped
            end = time.perf_counter() + EXPORT_SECONDS
            while not stopped and export.step() and time.perf_counter() < end:
                pass
            if export.is_done:
                save_image(export.renderer, export.path)
                self.messages.note(f"Wrote {export.path.name}")

        try:
            do()
        except Exception as failure:
            stopped = True
            self.messages.failure(str(failure) or type(failure).__name__)
        if stopped or export.is_done:
            export.renderer.release()
            self._exporting = None
        self.renderer.ctx.screen.use()


class _Export:
    """A picture on its way to a file, with a renderer of its own."""

    def __init__(self, path: Path, shot: Shot, renderer: Renderer) -> None:
        self.path, self.shot, self.renderer = path, shot, renderer
        self.done = 0

    @property
    def is_done(self) -> bool:
        return self.done >= self.shot.settings.samples

    def step(self) -> bool:
        """Add a sample; return whether more are wanted."""
        self.done = self.renderer.accumulate(self.shot, self.shot.settings.samples)
        return not self.is_done


def _begin_modal(name: str) -> bool:
    """Begin a modal in the middle of the window and tell whether it is open."""
    centre = imgui.get_main_viewport().get_center()
    imgui.set_next_window_pos(centre, imgui.Cond_.appearing, ImVec2(0.5, 0.5))
    imgui.set_next_window_size(ImVec2(26.0 * imgui.get_font_size(), 0.0), imgui.Cond_.appearing)
    opened, _ = imgui.begin_popup_modal(name, None, imgui.WindowFlags_.no_saved_settings)
    return bool(opened)


def _layout(windows: dict[str, Callable[[], None]]) -> hello_imgui.DockingParams:
    """Return the docking layout: scene and display left, picture, light and material right."""
    docking = hello_imgui.DockingParams()
    centre = "MainDockSpace"
    docking.docking_splits = [
        hello_imgui.DockingSplit(centre, "Left", imgui.Dir.left, 0.18),
        hello_imgui.DockingSplit(centre, "Right", imgui.Dir.right, 0.26),
        hello_imgui.DockingSplit("Left", "LeftLow", imgui.Dir.down, 0.52),
        hello_imgui.DockingSplit("Right", "RightLow", imgui.Dir.down, 0.41),
    ]
    spaces = {
        "Viewport": centre,
        "Scene": "Left",
        "Display": "LeftLow",
        "Camera": "LeftLow",
        "Performance": "LeftLow",
        "Light": "Right",
        "Material": "RightLow",
        "Object": "RightLow",
    }
    docking.dockable_windows = [
        hello_imgui.DockableWindow(name, spaces[name], function, can_be_closed_=False)
        for name, function in windows.items()
    ]
    for window in docking.dockable_windows:
        window.call_begin_end = window.label != "Viewport"
    return docking


def _other_needs(a: Shot, b: Shot) -> bool:
    """Tell whether a plan for ``a`` may not be true for ``b``."""
    return (
        (a.width, a.height) != (b.width, b.height)
        or a.scene.lights is not b.scene.lights
        or a.scene.objects is not b.scene.objects
        or a.scene.materials is not b.scene.materials
    )


def _plan_lines(plan: Plan) -> tuple[PlanLine, ...]:
    lines = [
        PlanLine("Programs", program.name, f"{program.lines} lines") for program in plan.programs
    ]
    lines += [
        PlanLine(kind, resource.name, f"{resource.bytes / 1024.0:,.0f} KB")
        for kind, resources in (
            ("Attachments", plan.attachments),
            ("Tables", plan.tables),
            ("Buffers", plan.buffers),
        )
        for resource in resources
    ]
    lines += [PlanLine("Left out", left.what, left.why, used=False) for left in plan.left_out]
    return tuple(lines)


def _first_material(scene: Scene) -> str:
    """Return the material to show first: that of a real thing, not of floor or wall, if any."""
    things = [item for item in scene.objects if item.mesh not in ("plane", "box")]
    return next((item.material for item in (*things, *scene.objects)), "")


def spoken(name: str) -> str:
    """Return a file's stem as a title: "01-still-life" becomes "Still life"."""
    return re.sub(r"^\d+[-_]", "", name).replace("-", " ").replace("_", " ").capitalize()


def new_scene() -> Scene:
    """Return what "New" shows: a glossy floor and one light over it."""
    floor = Material("floor", (0.25, 0.25, 0.25), (0.05, 0.05, 0.05), (0.0225, 0.0225))
    ground = SceneObject("floor", "plane", "floor", Transform(scale=(6.0, 6.0, 6.0)))
    return edits.add_light(Scene(materials=(floor,), objects=(ground,)))[0]


def first_scene(path: Path | None) -> tuple[Scene, Path | None]:
    """Return the scene to begin with and its file: the one asked for, a demo, or a new one.

    Raises
    ------
    InputError
        If the file that was asked for cannot be read.
    """
    if path is not None:
        return load_scene(path), path
    demo = next(iter(demo_scenes().values()), None)
    return (load_scene(demo) if demo is not None else new_scene()), None


def missing_display() -> str | None:
    """Return the sentence for a machine on which no window can be opened, None if one can."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            started = bool(glfw.init())
        except glfw.GLFWError:
            started = False
    if started:
        return None
    return (
        "No window can be opened here: there is no display (neither DISPLAY nor WAYLAND_DISPLAY "
        "leads to one). To render without a window: ltc-viewer shot SCENE.json -o picture.png"
    )


def run(scene_path: Path | None) -> int:
    """Open the window and return the exit code when it is closed.

    Parameters
    ----------
    scene_path : Path or None
        The scene to show; None shows the first demo scene.

    Returns
    -------
    int
        0, or 1 if no window can be opened; the reason is on stderr.

    Raises
    ------
    InputError
        If the scene cannot be read.
    """
    scene, path = first_scene(scene_path)
    problem = missing_display()
    if problem is not None:
        print(problem, file=sys.stderr)
        return 1
    window = Window(scene, path)
    add_ons: Any = immapp.AddOnsParams(with_implot=True)
    try:
        immapp.run(window.params, add_ons)
    except RuntimeError as failure:
        print(f"The window could not be opened: {failure}. "
              "To render without one: ltc-viewer shot SCENE.json -o picture.png",
              file=sys.stderr)  # fmt: skip
        return 1
    return 0
