"""How the application's window is set up: its size, its OpenGL, where panels are docked."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from imgui_bundle import hello_imgui, imgui

TITLE = "LTC Viewer"
SIZE = (1440, 900)
IDLE_FPS = 10.0

_CENTRE = "MainDockSpace"
_SPACES = {
    "Viewport": _CENTRE,
    "Scene": "Left",
    "Display": "LeftLow",
    "Camera": "LeftLow",
    "Performance": "LeftLow",
    "Light": "Right",
    "Compare": "Right",
    "Lobe": "Right",
    "Material": "RightLow",
    "Object": "RightLow",
    "Inspector": "RightLow",
    "Plan": "Right",
}
"""The docked windows and their places; those that share one are tabs."""


def runner_params() -> hello_imgui.RunnerParams:
    """Return hello_imgui's settings, callbacks and docked windows left out."""
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
    return params


def docking(windows: Mapping[str, Callable[[], None]]) -> hello_imgui.DockingParams:
    """Return the docking layout: scene and display left, picture, light and material right.

    Parameters
    ----------
    windows : mapping
        What draws the inside of each docked window, by its title; "Viewport"
        begins and ends its window itself.
    """
    params = hello_imgui.DockingParams()
    params.docking_splits = [
        hello_imgui.DockingSplit(_CENTRE, "Left", imgui.Dir.left, 0.18),
        hello_imgui.DockingSplit(_CENTRE, "Right", imgui.Dir.right, 0.26),
        hello_imgui.DockingSplit("Left", "LeftLow", imgui.Dir.down, 0.52),
        hello_imgui.DockingSplit("Right", "RightLow", imgui.Dir.down, 0.41),
    ]
    params.dockable_windows = [
        hello_imgui.DockableWindow(name, _SPACES[name], function, can_be_closed_=False)
        for name, function in windows.items()
    ]
    for window in params.dockable_windows:
        window.call_begin_end = window.label != "Viewport"
    return params
