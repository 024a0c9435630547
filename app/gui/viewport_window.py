"""The docked window of the picture: no margin, no tab, and tool buttons in its corner."""

from __future__ import annotations

from collections.abc import Callable

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_4 as icons

from app.editor import Editor
from app.gui import theme
from app.gui.messages import Messages
from app.gui.shortcuts import key_of
from app.gui.viewport import Viewport
from app.panels.status import help_line
from app.panels.widgets import button


def viewport_window(
    viewport: Viewport, editor: Editor, messages: Messages, frame: Callable[[], None]
) -> None:
    """Draw the window; ``frame`` looks at what is selected."""
    viewport.help = help_line(editor.scene, editor.selection, viewport.tool)
    imgui.push_style_var(imgui.StyleVar_.window_padding, ImVec2(0.0, 0.0))
    flags = imgui.WindowFlags_.no_scrollbar | imgui.WindowFlags_.no_scroll_with_mouse
    bare = imgui.WindowClass()
    bare.dock_node_flags_override_set = imgui.internal.DockNodeFlagsPrivate_.no_tab_bar
    imgui.set_next_window_class(bare)
    imgui.begin("Viewport", None, flags)
    imgui.pop_style_var()
    with messages.guard():
        viewport.draw(editor)
    if viewport.show_overlays:
        _tools(viewport, frame)
    imgui.end()


def _tools(viewport: Viewport, frame: Callable[[], None]) -> None:
    """Draw the tool buttons in the upper left corner of the picture."""
    view, em = viewport.view, imgui.get_font_size()
    imgui.set_cursor_screen_pos(ImVec2(view.x + 0.7 * em, view.y + 0.7 * em))
    tools = (
        ("move", icons.ICON_FA_ARROWS_ALT, f"Move what is selected ({key_of('move')})"),
        ("rotate", icons.ICON_FA_SYNC, f"Turn what is selected ({key_of('rotate')})"),
    )
    for name, icon, tip in tools:
        colour = theme.ACCENT if viewport.tool == name else theme.grey(0.85)
        imgui.push_style_color(imgui.Col_.text, colour)
        imgui.push_style_color(imgui.Col_.button, theme.grey(0.1, 0.78))
        if button(f"{icon}###{name}", tip, width=2.1 * em):
            viewport.tool = name
        imgui.pop_style_color(2)
        imgui.same_line(0.0, 0.3 * em)
    imgui.push_style_color(imgui.Col_.button, theme.grey(0.1, 0.78))
    if button(
        f"{icons.ICON_FA_CROSSHAIRS}###frame", f"Look at what is selected ({key_of('frame')})"
    ):
        frame()
    imgui.same_line(0.0, 0.3 * em)
    on = viewport.comparison.is_on
    imgui.push_style_color(imgui.Col_.text, theme.ACCENT if on else theme.grey(0.85))
    tip = f"Compare with another technique ({key_of('compare')}); {key_of('flip')} flips"
    if button(f"{icons.ICON_FA_ADJUST}###compare", tip, width=2.1 * em):
        viewport.comparison.toggle()
    imgui.pop_style_color(2)
