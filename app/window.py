"""The window: events and frames over the same renderer as everything else.

hello_imgui owns window, docking, menus and idling (moderngl-window's imgui
integration does not work with imgui-bundle 1.93, see its issues 222 and 224).
It calls back: once when OpenGL is there, then for each frame and each docked
window, and before the end. Here the parts of the application meet; each has a
module of its own.
"""

from __future__ import annotations

# isort: off
import imgui_bundle  # noqa: F401  (first: glfw then takes the library that imgui-bundle carries)
import glfw
# isort: on

import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import moderngl
from imgui_bundle import hello_imgui, imgui, immapp
from imgui_bundle.glfw_utils import glfw_window_hello_imgui
from imgui_bundle.imguizmo import im_guizmo as gizmo

from app.editor import Editor
from app.gui import theme
from app.gui.beginning import first_scene, first_selection
from app.gui.dialogs import FileDialogs
from app.gui.documents import Documents
from app.gui.exports import Exports
from app.gui.imports import Imports
from app.gui.inspector import Inspector
from app.gui.keyboard import act_on_keys
from app.gui.layout import TITLE, docking, runner_params
from app.gui.lobe_window import LobeWindow
from app.gui.measuring import Measuring
from app.gui.menus import edit_menu, file_menu, view_menu
from app.gui.message_list import draw_messages
from app.gui.messages import Messages
from app.gui.panel_windows import PanelWindows
from app.gui.reports import Reports
from app.gui.shortcuts import Action
from app.gui.viewport import Viewport
from app.gui.viewport_window import viewport_window
from app.panels.performance import performance_panel
from app.panels.plan import plan_panel
from app.panels.question import unsaved_question
from app.panels.status import noise_text, status_bar
from app.render.renderer import Renderer
from app.render.techniques import technique_of
from app.scene import Scene


class Window:
    """The application: an editor, a renderer, and what joins them on the screen.

    Renderer, viewport, exports, lobe and inspector need OpenGL; they are there once it is.

    Parameters
    ----------
    scene : Scene
        What to show first.
    path : Path or None
        Its file, None for a scene that has none yet.
    """

    renderer: Renderer
    viewport: Viewport
    exports: Exports
    lobe: LobeWindow
    inspector: Inspector

    def __init__(self, scene: Scene, path: Path | None = None) -> None:
        self.editor = Editor(scene, path)
        self.editor.selection = first_selection(scene)
        self.messages = Messages()
        self.dialogs = FileDialogs()
        self.imports = Imports(self.editor, self.messages, self.dialogs)
        self.documents = Documents(
            self.editor, self.messages, self.dialogs, self.imports, self.show
        )
        self.dropped: list[str] = []
        self.title = ""
        self._panels = PanelWindows(self.editor, self.imports)
        self._reports = Reports()
        self.measuring = Measuring()
        self._actions = self._what_actions_do()
        self.params = runner_params()
        self.params.docking_params = docking(self._docked_windows())
        self._set_callbacks()

    def show(self, scene: Scene, path: Path | None) -> None:
        """Show another scene with a fresh history."""
        self.editor.open(scene, path)
        self.editor.selection = first_selection(scene)
        self.messages.clear()
        self._panels.begin(scene)
        self.viewport.playback.begin()
        self.lobe.begin()

    # --- set-up -------------------------------------------------------------------

    def _set_callbacks(self) -> None:
        calls = self.params.callbacks
        calls.load_additional_fonts = theme.load_fonts
        calls.setup_imgui_style = theme.apply
        calls.post_init = self._start
        calls.post_new_frame = gizmo.begin_frame
        calls.show_menus = self._menus
        calls.show_status = self._status
        calls.show_gui = self._each_frame
        calls.confirm_exit = self._may_exit
        calls.before_exit = self._stop

    def _docked_windows(self) -> dict[str, Callable[[], None]]:
        """Return what draws each docked window, by its title."""
        windows: dict[str, Callable[[], None]] = {
            "Viewport": self._viewport_window,
            "Scene": self._panels.scene,
            "Light": lambda: self._panels.light(self.viewport.playback),
            "Lobe": self._lobe_window,
            "Material": lambda: self._panels.material(self.viewport.settings),
            "Object": self._panels.object,
            "Inspector": lambda: self.inspector.draw(),
            "Display": self._display_window,
            "Camera": self._panels.camera,
            "Performance": self._performance_window,
            "Compare": self._compare_window,
            "Plan": self._plan_window,
        }
        return {name: self._guarded(draw) for name, draw in windows.items()}

    def _what_actions_do(self) -> dict[Action, Callable[[], None]]:
        """Return what the items of menus and the keys do."""
        actions: dict[Action, Callable[[], object]] = {
            "new": self.documents.new,
            "open": self.documents.ask_open,
            "save": self.documents.save,
            "save as": self.documents.ask_save,
            "export": lambda: self.exports.ask(),
            "quit": self.quit,
            "undo": self.editor.undo,
            "redo": self.editor.redo,
            "duplicate": self.editor.duplicate,
            "remove": self.editor.remove,
            "escape": self.editor.escape,
            "frame": lambda: self.viewport.frame(self.editor),
            "overlays": lambda: self.viewport.toggle_overlays(),
            "compare": lambda: self.viewport.comparison.toggle(),
            "flip": lambda: self.viewport.comparison.flip(),
            "pin": lambda: self.lobe.toggle_pin(),
            "move": lambda: self.viewport.take("move"),
            "rotate": lambda: self.viewport.take("rotate"),
            "corner": lambda: self.viewport.outline.set_kind(self.editor, "corner"),
            "smooth": lambda: self.viewport.outline.set_kind(self.editor, "smooth"),
            "symmetric": lambda: self.viewport.outline.set_kind(self.editor, "symmetric"),
            "line": lambda: self.viewport.outline.straighten(self.editor),
            "curve": lambda: self.viewport.outline.bend(self.editor),
            "reverse": lambda: self.viewport.outline.reverse(self.editor),
        }
        return {name: self._guarded(action) for name, action in actions.items()}

    def _guarded(self, action: Callable[[], object]) -> Callable[[], None]:
        """Return a function that does ``action``; a failure becomes a message."""

        def guarded() -> None:
            with self.messages.guard():
                action()

        return guarded

    def _start(self) -> None:
        """Create what needs the GL context; hello_imgui calls this when it is there."""
        self.renderer = Renderer(moderngl.create_context())
        self.viewport = Viewport(self.renderer, self.messages)
        self.lobe = LobeWindow(self.renderer.ctx)
        self.inspector = Inspector(self.viewport, self.renderer)
        self.exports = Exports(
            self.editor, self.viewport, self.renderer, self.messages, self.dialogs
        )
        glfw.set_drop_callback(glfw_window_hello_imgui(), self._on_drop)

    def _on_drop(self, _window: Any, paths: Any, *_: Any) -> None:
        self.dropped.extend(map(str, paths))

    def _stop(self) -> None:
        self.exports.release()
        self.measuring.stop()
        self.inspector.release()
        self.viewport.comparison.close()
        self.lobe.release()
        self.renderer.release()

    # --- one frame ----------------------------------------------------------------

    def _each_frame(self) -> None:
        """What is not inside a docked window: keys, dialogs, messages, the end of drags."""
        act_on_keys(self._actions)
        self.lobe.point_at(self.viewport.hovered, self.editor)
        asked, self.viewport.asked_pin = self.viewport.asked_pin, None
        if asked is not None:
            self.lobe.pin_at(asked, self.editor)
        self.inspector.step()
        self.viewport.pin = self.lobe.pin(self.editor, self.viewport.camera_of(self.editor.scene))
        self.dialogs.poll()
        dropped, self.dropped = self.dropped, []
        self.documents.drop(dropped)
        self._ask_about_unsaved()
        self.exports.draw()
        if self.editor.is_dragging and not (imgui.is_any_item_active() or self.viewport.is_busy):
            self.editor.commit()
        view = self.viewport.view
        above_help = 2.4 * imgui.get_font_size() if self.viewport.show_overlays else 0.0
        draw_messages(self.messages, view.x + view.width, view.y + view.height - above_help)
        self._update_title()
        with self.messages.guard():
            self.measuring.step(self.renderer.ctx)
        others = (self.measuring, self.exports)
        is_busy = any(work.is_busy for work in others) or self.viewport.playback.is_moving
        works = (self.viewport, self.inspector)
        if is_busy or not self.lobe.is_settled or any(work.needs_frames for work in works):
            hello_imgui.request_refresh()

    def _ask_about_unsaved(self) -> None:
        question = self.documents.question
        if question is not None and not self.exports.is_busy:
            answer = unsaved_question(question)
            if answer is not None:
                self.documents.answer(answer)

    def _update_title(self) -> None:
        """Show file, unsaved mark and program."""
        editor = self.editor
        name = editor.path.name if editor.path else "Untitled"
        title = f"{name}{' •' if editor.is_modified else ''} — {TITLE}"
        if title != self.title:
            self.title = title
            glfw.set_window_title(glfw_window_hello_imgui(), title)

    def _menus(self) -> None:
        file_menu(self._actions, self.documents.open)
        edit_menu(self._actions, self.editor)
        view, windows = self.viewport, self.params.docking_params
        compares, pinned = view.comparison.is_on, self.lobe.is_pinned
        view_menu(self._actions, view.show_overlays, compares, pinned, windows)

    def _status(self) -> None:
        step, shot = self.editor.undo_name, self.viewport.picture.shot
        size = (shot.width, shot.height) if shot is not None else (0, 0)
        text = f"Last edit: {step}" if step else "Drag the picture to look around"
        technique = technique_of(self.editor.scene, self.viewport.settings.technique)
        picture = self.viewport.picture
        noise = None if picture.noise is None else picture.noise.relative
        status_bar(text, picture.samples, size, technique, noise_text(noise, picture.seconds))

    # --- docked windows -------------------------------------------------------------

    def _viewport_window(self) -> None:
        frame = self._actions["frame"]
        viewport_window(self.viewport, self.editor, self.messages, frame)

    def _display_window(self) -> None:
        self.viewport.settings = self._panels.display(self.viewport.settings)

    def _compare_window(self) -> None:
        self._panels.compare(self.viewport.comparison, self.viewport.picture)

    def _lobe_window(self) -> None:
        self.lobe.draw(self.editor, self.viewport.camera_of(self.editor.scene))

    def _performance_window(self) -> None:
        shot = self.viewport.picture.shot
        if shot is None:
            return
        times = self._reports.times(shot, self.viewport, self.renderer)
        asked = performance_panel(times, self.measuring.state(shot))
        if asked == "measure":
            seconds = self.viewport.picture.full_size_seconds
            self.measuring.begin(self.renderer.ctx, shot, seconds)
        elif asked == "stop":
            self.measuring.stop()

    def _plan_window(self) -> None:
        shot = self.viewport.picture.shot
        if shot is not None:
            plan_panel(self._reports.plan(shot, self.viewport, self.renderer))

    # --- the end ------------------------------------------------------------------------

    def quit(self) -> None:
        """End the program, after asking about unsaved edits."""
        self.documents.unless_unsaved(self._exit)

    def _exit(self) -> None:
        self.params.app_shall_exit = True

    def _may_exit(self) -> bool:
        if self.editor.is_modified:
            self.quit()
            return False
        return True


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
