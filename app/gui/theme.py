"""The look of the window: fonts, colours and spacing, in one place."""

from __future__ import annotations

from imgui_bundle import ImVec2, ImVec4, hello_imgui, imgui, implot
from imgui_bundle import imguizmo as _imguizmo

FONT_SIZE = 15.0

ACCENT = ImVec4(1.0, 0.72, 0.36, 1.0)
"""Warm, as a lamp: selection and handles. Everything else is grey."""

WARNING = ImVec4(0.98, 0.47, 0.36, 1.0)


def grey(value: float, alpha: float = 1.0) -> ImVec4:
    """Return a slightly bluish grey of an sRGB value in [0, 1]."""
    return ImVec4(value * 0.97, value, value * 1.05, alpha)


def u32(colour: ImVec4, alpha: float = 1.0) -> int:
    """Return a colour as draw lists take it, its opacity times ``alpha``."""
    faded = ImVec4(colour.x, colour.y, colour.z, colour.w * alpha)
    return int(imgui.color_convert_float4_to_u32(faded))


def load_fonts() -> None:
    """Load Roboto with the icons of Font Awesome 4, both part of imgui-bundle."""
    hello_imgui.load_font_ttf_with_font_awesome_icons("fonts/Roboto/Roboto-Regular.ttf", FONT_SIZE)


def apply() -> None:
    """Set colours, spacing and rounding; called once when Dear ImGui is ready."""
    style = imgui.get_style()
    imgui.style_colors_dark()
    style.window_padding = ImVec2(12.0, 10.0)
    style.frame_padding = ImVec2(8.0, 4.0)
    style.item_spacing = ImVec2(8.0, 6.0)
    style.item_inner_spacing = ImVec2(6.0, 4.0)
    style.cell_padding = ImVec2(4.0, 3.0)
    style.scrollbar_size = 11.0
    style.grab_min_size = 5.0
    style.window_rounding = 6.0
    style.child_rounding = style.frame_rounding = style.grab_rounding = 4.0
    style.popup_rounding = 6.0
    style.tab_rounding = 4.0
    style.scrollbar_rounding = 6.0
    style.window_border_size = style.child_border_size = 0.0
    style.popup_border_size = 1.0
    style.frame_border_size = 0.0
    style.tab_bar_border_size = 0.0
    style.docking_separator_size = 2.0
    style.separator_text_border_size = 1.0
    style.separator_text_padding = ImVec2(0.0, 6.0)
    style.disabled_alpha = 0.4
    style.window_menu_button_position = imgui.Dir.none
    for name, colour in _COLOURS.items():
        style.set_color_(getattr(imgui.Col_, name), colour)
    _style_plots()
    _style_gizmo()


_COLOURS = {
    "text": grey(0.87),
    "text_disabled": grey(0.48),
    "window_bg": grey(0.125),
    "child_bg": grey(0.125, 0.0),
    "popup_bg": grey(0.155, 0.98),
    "border": grey(1.0, 0.08),
    "frame_bg": grey(0.185),
    "frame_bg_hovered": grey(0.225),
    "frame_bg_active": grey(0.26),
    "title_bg": grey(0.095),
    "title_bg_active": grey(0.095),
    "title_bg_collapsed": grey(0.095),
    "menu_bar_bg": grey(0.095),
    "scrollbar_bg": grey(0.1, 0.0),
    "scrollbar_grab": grey(0.28),
    "scrollbar_grab_hovered": grey(0.34),
    "scrollbar_grab_active": grey(0.4),
    "check_mark": ACCENT,
    "checkbox_selected_bg": grey(0.185),
    "slider_grab": grey(0.55),
    "slider_grab_active": ACCENT,
    "button": grey(0.215),
    "button_hovered": grey(0.27),
    "button_active": grey(0.33),
    "header": ImVec4(1.0, 0.72, 0.36, 0.2),
    "header_hovered": grey(1.0, 0.07),
    "header_active": ImVec4(1.0, 0.72, 0.36, 0.28),
    "separator": grey(1.0, 0.09),
    "separator_hovered": grey(1.0, 0.2),
    "separator_active": ACCENT,
    "resize_grip": grey(1.0, 0.0),
    "resize_grip_hovered": grey(1.0, 0.2),
    "resize_grip_active": ACCENT,
    "tab": grey(0.095),
    "tab_hovered": grey(0.2),
    "tab_selected": grey(0.125),
    "tab_selected_overline": ACCENT,
    "tab_dimmed": grey(0.095),
    "tab_dimmed_selected": grey(0.125),
    "tab_dimmed_selected_overline": grey(0.3),
    "docking_preview": ImVec4(1.0, 0.72, 0.36, 0.3),
    "docking_empty_bg": grey(0.07),
    "table_header_bg": grey(0.16),
    "table_row_bg": grey(1.0, 0.0),
    "table_row_bg_alt": grey(1.0, 0.025),
    "text_selected_bg": ImVec4(1.0, 0.72, 0.36, 0.3),
    "drag_drop_target": ACCENT,
    "nav_cursor": ACCENT,
    "modal_window_dim_bg": ImVec4(0.0, 0.0, 0.0, 0.55),
}


def _style_plots() -> None:
    style = implot.get_style()
    style.plot_padding = ImVec2(0.0, 4.0)
    style.plot_border_size = 0.0
    style.set_color_(implot.Col_.plot_bg, grey(1.0, 0.0))
    style.set_color_(implot.Col_.frame_bg, grey(1.0, 0.0))


def _style_gizmo() -> None:
    style = _imguizmo.im_guizmo.get_style()
    style.translation_line_thickness = 3.0
    style.translation_line_arrow_size = 7.0
    style.rotation_line_thickness = 3.0
    style.rotation_outer_line_thickness = 2.0
    style.center_circle_size = 5.0
