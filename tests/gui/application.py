"""The real window without a display, driven by the ImGui Test Engine.

GLFW's null platform and EGL stand in for the screen. One application per
process (a second one crashes), so `driver` runs all scenarios in one. A
scenario runs on the main thread, where the GL context is; `act` hands single
actions to the test engine, which runs them on a thread of its own.
"""

from __future__ import annotations

# isort: off
import imgui_bundle  # noqa: F401  (first: glfw then takes the library that imgui-bundle carries)
import glfw
# isort: on

import time
from collections.abc import Callable
from typing import Any

import numpy as np
from imgui_bundle import ImVec2, hello_imgui, imgui, immapp

from app import contours, planes
from app.gui import dialogs
from app.scene import Scene, Vec3
from app.window import Window

test_engine = imgui.test_engine
PATIENCE = 30.0
"""Seconds after which something waited for counts as not happening."""


class Application:
    """The program's window under test."""

    def __init__(self, scene: Scene, size: tuple[int, int] = (1100, 700)) -> None:
        glfw.init_hint(glfw.PLATFORM, glfw.PLATFORM_NULL)
        if not glfw.init():
            raise RuntimeError("GLFW has no null platform")
        glfw.window_hint(glfw.CONTEXT_CREATION_API, glfw.EGL_CONTEXT_API)
        dialogs.has_system_dialog = lambda: False
        self.window = Window(scene)
        params = self.window.params
        params.ini_disable = True
        params.use_imgui_test_engine = True
        params.fps_idling.enable_idling = False
        params.fps_idling.vsync_to_monitor = False
        params.app_window_params.window_geometry.size = size
        params.app_window_params.restore_previous_geometry = False
        params.callbacks.before_swap = self._before_swap
        self._wants_pixels = False
        self._pixels = np.zeros((0, 0, 3), np.uint8)
        self._tests = 0
        immapp.manual_render.setup_from_runner_params(params, immapp.AddOnsParams(with_implot=True))
        self._engine = hello_imgui.get_imgui_test_engine()
        io = test_engine.get_io(self._engine)
        io.config_run_speed = test_engine.TestRunSpeed.fast
        io.config_mouse_draw_cursor = False
        io.config_restore_focus_after_tests = False
        for _ in range(3):
            self.frame()

    def close(self) -> None:
        immapp.manual_render.tear_down()

    # --- frames -----------------------------------------------------------------

    def frame(self) -> None:
        """Run one frame of the program."""
        immapp.manual_render.render()

    def settle(self) -> None:
        """Run frames until nothing is left to do."""
        self.frame()
        self.until(lambda: self.window.viewport.is_idle)

    def until(self, condition: Callable[[], bool]) -> None:
        """Run frames until something is so."""
        end = time.monotonic() + PATIENCE
        while not condition():
            assert time.monotonic() < end, f"it does not happen within {PATIENCE:g} s"
            self.frame()

    def pixels(self) -> np.ndarray:
        """Return the window's picture after one more frame, (h, w, 3) uint8, row 0 at the top."""
        self._wants_pixels = True
        self.frame()
        return self._pixels

    def picture(self) -> np.ndarray:
        """Return the viewport's part of the window, settled, without anything drawn over it."""
        viewport = self.window.viewport
        viewport.show_overlays = False
        self.window.messages.clear()
        self.settle()
        pixels = self.pixels()
        viewport.show_overlays = True
        view = viewport.view
        x, y, (width, height) = round(view.x), round(view.y), view.pixels
        return pixels[y : y + height, x : x + width]

    def _before_swap(self) -> None:
        if self._wants_pixels:
            self._wants_pixels = False
            ctx = self.window.renderer.ctx
            width, height = map(int, imgui.get_io().display_size)
            raw = ctx.screen.read(viewport=(0, 0, width, height), components=3, alignment=1)
            self._pixels = np.frombuffer(raw, np.uint8).reshape(height, width, 3)[::-1].copy()

    # --- actions ----------------------------------------------------------------

    def act(self, action: Callable[[Any], object]) -> None:
        """Let the test engine do something, and run frames until it is done."""
        self._tests += 1
        failures: list[BaseException] = []

        def guarded(ctx: Any) -> None:
            try:
                action(ctx)
            except Exception as failure:
                failures.append(failure)

        test = test_engine.register_test(self._engine, "gui", f"action {self._tests}")
        test.test_func = guarded
        test_engine.queue_test(self._engine, test)
        self.frame()
        self.until(lambda: test_engine.is_test_queue_empty(self._engine))
        if failures:
            raise failures[0]
        status = test.output.status
        assert status == test_engine.TestStatus.success, f"the action ended with {status!r}"

    def click(self, item: str) -> None:
        self.act(lambda ctx: ctx.item_click(f"//**/{item}"))

    def key(self, chord: int) -> None:
        self.act(lambda ctx: ctx.key_press(chord))

    def enter(self, item: str, value: float | str) -> None:
        self.act(lambda ctx: ctx.item_input_value(f"//**/{item}", value))

    def drag(self, item: str, dx: float, dy: float) -> None:
        """Drag a named item with the left button."""

        def action(ctx: Any) -> None:
            ctx.mouse_move(f"//**/{item}")
            ctx.mouse_drag_with_delta(ImVec2(dx, dy))

        self.act(action)

    def drag_at(self, x: float, y: float, dx: float, dy: float, button: int = 0) -> None:
        """Drag from a place on the screen."""

        def action(ctx: Any) -> None:
            ctx.mouse_move_to_pos(ImVec2(x, y))
            ctx.yield_(2)
            ctx.mouse_drag_with_delta(ImVec2(dx, dy), button)

        self.act(action)

    def click_at(self, x: float, y: float) -> None:
        """Click a place on the screen."""

        def action(ctx: Any) -> None:
            ctx.mouse_move_to_pos(ImVec2(x, y))
            ctx.yield_(2)
            ctx.mouse_click(0)

        self.act(action)

    # --- questions --------------------------------------------------------------

    @property
    def scene(self) -> Scene:
        return self.window.editor.scene

    def on_screen(self, point: Vec3) -> tuple[float, float]:
        """Return where a world point is on the screen."""
        viewport = self.window.viewport
        at = viewport.view.project(viewport.camera_of(self.scene), point)
        assert at is not None
        return at

    def corner(self, vertex: tuple[int, int], light: int = 0) -> tuple[float, float]:
        """Return where a light's corner is on the screen."""
        chosen = self.scene.lights[light]
        point = contours.points_of(chosen.outline.contours[vertex[0]])[vertex[1]]
        return self.on_screen(planes.point_on(chosen.plane, point))
