"""The list of everything in the scene: select, show and hide, add, copy, remove."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from imgui_bundle import ImVec2, ImVec4, imgui
from imgui_bundle import icons_fontawesome_4 as icons

from app import edits
from app.editor import Selection, duplicate_selected, remove_selected
from app.panels.widgets import MUTED, button, hint, identity, tooltip
from app.presets import PRESETS
from app.scene import BUILT_IN_MESHES, AreaLight, Scene, Vec3
from app.sliders import srgb_from_linear


def scene_panel(
    scene: Scene,
    selection: Selection,
    ask_drawing: Callable[[], None] = lambda: None,
    ask_picture: Callable[[], None] = lambda: None,
) -> tuple[Scene, Selection]:
    """Draw the tree; return the scene as edited and what is selected now.

    ``ask_drawing`` asks for an SVG file to add as a light, ``ask_picture`` for a picture.
    """
    new, chosen = scene, selection
    if _section("Lights", "Add a light above what you look at", "add light"):
        imgui.open_popup("shapes")
    if imgui.begin_popup("shapes"):
        new, index = _new_light(new, ask_drawing, ask_picture)
        chosen = Selection.light(index) if index is not None else chosen
        imgui.end_popup()
    if not scene.lights:
        hint("No lights yet: press + to add one.")
    for index, light in enumerate(scene.lights):
        with identity(f"light {index}"):
            new, chosen = _light_row(new, chosen, index, light)

    if _section("Objects", "Add an object", "add object"):
        imgui.open_popup("meshes")
    if imgui.begin_popup("meshes"):
        for mesh in BUILT_IN_MESHES:
            if imgui.menu_item_simple(mesh.capitalize()):
                new, index = edits.add_object(new, mesh, mesh)
                chosen = Selection.object(index)
        imgui.end_popup()
    for index, item in enumerate(scene.objects):
        with identity(f"object {index}"):
            swatch = srgb_from_linear(_looks(scene, index))
            _swatch(swatch)
            picked = _row(item.name, chosen.kind == "object" and chosen.index == index)
            chosen = Selection.object(index) if picked else chosen
            new, chosen = _menu(new, chosen, Selection.object(index))
    return new, chosen


def _new_light(
    scene: Scene, ask_drawing: Callable[[], None], ask_picture: Callable[[], None]
) -> tuple[Scene, int | None]:
    """Draw the menu of shapes; return the scene and the index of the light if one was added."""
    if imgui.menu_item_simple("Square"):
        return edits.add_light(scene)
    for name in PRESETS:
        if imgui.menu_item_simple(name):
            return edits.add_preset(scene, name)
    imgui.separator()
    if imgui.menu_item_simple("Text…###new text"):
        return edits.add_text(scene)
    if imgui.menu_item_simple("SVG…###new drawing"):
        ask_drawing()
    if imgui.menu_item_simple("Picture…###new picture"):
        ask_picture()
    return scene, None


def _section(title: str, tip: str, add_id: str) -> bool:
    """Draw a heading with a + button at its right end and tell whether that was pressed."""
    imgui.spacing()
    size = imgui.get_frame_height()
    right = imgui.get_cursor_pos_x() + imgui.get_content_region_avail().x
    imgui.align_text_to_frame_padding()
    imgui.text_colored(MUTED, title.upper())
    imgui.same_line(right - size)
    return button(f"{icons.ICON_FA_PLUS}###{add_id}", tip, width=size)


def _light_row(
    scene: Scene, selection: Selection, index: int, light: AreaLight
) -> tuple[Scene, Selection]:
    peak = max(light.radiance)
    colour: Vec3 = (0.0, 0.0, 0.0)
    if peak > 0.0:
        r, g, b = light.radiance
        colour = srgb_from_linear((r / peak, g / peak, b / peak))
    _swatch(colour, round_=True)
    icon = icons.ICON_FA_EYE if light.visible else icons.ICON_FA_EYE_SLASH
    width = imgui.get_frame_height()
    room = imgui.get_content_region_avail().x - width - imgui.get_style().item_spacing.x
    chosen = selection
    if _row(light.name, selection.kind == "light" and selection.index == index, room):
        chosen = Selection.light(index)
    scene, chosen = _menu(scene, chosen, Selection.light(index))
    imgui.same_line()
    imgui.push_style_color(imgui.Col_.button, ImVec4(0.0, 0.0, 0.0, 0.0))
    imgui.push_style_color(imgui.Col_.text, imgui.get_style_color_vec4(imgui.Col_.text)
                           if light.visible else MUTED)  # fmt: skip
    if imgui.button(f"{icon}###visible", ImVec2(width, 0.0)):
        scene = edits.replace_light(scene, index, replace(light, visible=not light.visible))
    imgui.pop_style_color(2)
    tooltip("Show or hide the light itself; it lights the scene either way")
    return scene, chosen


def _row(name: str, is_selected: bool, width: float = 0.0) -> bool:
    """Draw a line that can be selected and tell whether it was clicked."""
    size = ImVec2(max(width, 0.0), imgui.get_frame_height())
    imgui.push_style_var(imgui.StyleVar_.selectable_text_align, ImVec2(0.0, 0.5))
    clicked, _ = imgui.selectable(name, is_selected, imgui.SelectableFlags_.none, size)
    imgui.pop_style_var()
    return bool(clicked)


def _menu(scene: Scene, selection: Selection, this: Selection) -> tuple[Scene, Selection]:
    if imgui.begin_popup_context_item("menu"):
        selection = this
        if imgui.menu_item_simple("Duplicate"):
            scene, selection = duplicate_selected(scene, this)
        if imgui.menu_item_simple("Remove"):
            scene, selection = remove_selected(scene, this)
        imgui.end_popup()
    return scene, selection


def _looks(scene: Scene, index: int) -> Vec3:
    """Return the brighter of an object's diffuse and specular colours."""
    material = scene.material_of(scene.objects[index])
    return max(material.diffuse, material.f0, key=max)


def _swatch(colour: Vec3, round_: bool = False) -> None:
    """Draw a small spot of an sRGB colour in front of a row."""
    height = imgui.get_frame_height()
    radius = 0.3 * imgui.get_font_size()
    corner = imgui.get_cursor_screen_pos()
    centre = ImVec2(corner.x + 0.5 * height, corner.y + 0.5 * height)
    fill = imgui.color_convert_float4_to_u32(ImVec4(*colour, 1.0))
    rim = imgui.color_convert_float4_to_u32(ImVec4(1.0, 1.0, 1.0, 0.25))
    draw = imgui.get_window_draw_list()
    if round_:
        draw.add_circle_filled(centre, radius, fill)
        draw.add_circle(centre, radius, rim)
    else:
        low = ImVec2(centre.x - radius, centre.y - radius)
        high = ImVec2(centre.x + radius, centre.y + radius)
        draw.add_rect_filled(low, high, fill, 2.0)
        draw.add_rect(low, high, rim, 2.0)
    imgui.dummy(ImVec2(height, height))
    imgui.same_line(0.0, 0.0)
