"""The panel of one light: its radiance, its picture, its shape and where it is."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

from imgui_bundle import imgui

from app import contours, lights, planes
from app.panels.picture import Player, picture_rows
from app.panels.source import source_rows
from app.panels.widgets import (
    button,
    checkbox,
    choice,
    colour,
    half_width,
    heading,
    hint,
    identity,
    name_field,
    numbers,
    position,
    slider,
    tooltip,
)
from app.scene import (
    ANCHOR_KINDS,
    FILL_RULES,
    AreaLight,
    BezierContour,
    Contour,
    SceneError,
    Vec3,
)
from app.vectors import add, cross, length, normalize, scale, subtract

RADIANCE_MAX = 1000.0
NO_PLAYER = Player()


def light_panel(
    light: AreaLight,
    vertex: tuple[int, int] | None = None,
    target: Vec3 = (0.0, 0.0, 0.0),
    ask_file: Callable[[], None] = lambda: None,
    focus_text: bool = False,
    player: Player = NO_PLAYER,
) -> AreaLight:
    """Draw the panel and return the light as edited.

    Parameters
    ----------
    vertex : (contour, point), optional
        The selected corner or anchor, whose coordinates are shown.
    target : Vec3
        Where "Aim" aims: what the camera looks at.
    ask_file : callable
        Asks for another font or drawing for a light that is made from one.
    focus_text : bool
        Put the keyboard into the text of a text light.
    player : Player
        What the light's picture does, and what can be asked for.

    Raises
    ------
    SceneError, InputError
        If the light cannot do what a control asks for, after drawing.
    """
    with identity(f"light {light.name}"):
        new = picture_rows(_emission(light), player)
        new, failed_source = source_rows(new, ask_file, focus_text)
        new, failed_shape = _shape(new, vertex)
        new, failed_aim = _placement(new, target)
    failure = failed_source or failed_shape or failed_aim
    if failure is not None:
        raise failure
    return new


def rename_field(name: str) -> str:
    """Draw the name's row and return what was typed; the caller keeps names unique."""
    return name_field("Name", name, "What the light is called in lists and files")


def _emission(light: AreaLight) -> AreaLight:
    strength = max(light.radiance)
    hue: Vec3 = scale(light.radiance, 1.0 / strength) if strength > 0.0 else (1.0, 1.0, 1.0)
    picked = colour("Colour", hue, "Colour of the light; its strength is set below")
    new_strength = slider(
        "Radiance", strength, 0.0, RADIANCE_MAX, "%.3g W/m²sr",
        "Emitted radiance of the strongest channel, 0 to 1000 W m⁻² sr⁻¹", logarithmic=True,
    )  # fmt: skip
    two_sided = checkbox("Two-sided", light.two_sided, "Emit to both sides of the plane")
    visible = checkbox("Visible", light.visible, "Show the light itself, not only its light")
    radiance = light.radiance
    if picked != hue or new_strength != strength:
        peak = max(picked)
        radiance = scale(picked, new_strength / peak if peak > 0.0 else 0.0)
    return replace(light, radiance=radiance, two_sided=two_sided, visible=visible)


def _shape(light: AreaLight, vertex: tuple[int, int] | None) -> tuple[AreaLight, SceneError | None]:
    own = light.outline.contours
    heading("Shape")
    loops = "1 outline" if len(own) == 1 else f"{len(own)} outlines"
    imgui.align_text_to_frame_padding()
    hint(f"{_points_in_words(own)} in {loops}")
    light = _conversion(light)
    width = half_width()
    if button("Add hole…###add hole", "Cut a hole into the widest part", width=width):
        imgui.open_popup("holes")
    light, failure = _new_hole(light)
    imgui.same_line()
    last = len(own) - 1
    if button("Remove hole", "Remove the outline added last", enabled=last > 0, width=width):
        light = lights.remove_contour(light, last)
    if len(own) > 1:
        rule = choice(
            "Fill rule", light.outline.fill_rule, FILL_RULES,
            "How overlapping outlines combine: even-odd alternates, "
            "nonzero fills wherever they wind",
        )  # fmt: skip
        if rule != light.outline.fill_rule:
            light = lights.set_fill_rule(light, rule)
    if vertex is not None and vertex[0] < len(light.outline.contours):
        light = _vertex(light, vertex)
    return light, failure


def _points_in_words(own: Sequence[Contour]) -> str:
    """Return how many corners and anchors there are: "4 corners, 12 anchors"."""
    counts = {"corner": 0, "anchor": 0}
    for contour in own:
        counts[lights.word_for_vertex(contour)] += contours.size_of(contour)
    named = (f"{n} {word}{'' if n == 1 else 's'}" for word, n in counts.items() if n)
    return ", ".join(named)


def _conversion(light: AreaLight) -> AreaLight:
    """Draw a button at the end of the row, and the menu that it opens."""
    text = "Convert…"
    width = imgui.calc_text_size(text).x + 2.0 * imgui.get_style().frame_padding.x
    imgui.same_line()
    right = imgui.get_cursor_pos_x() + imgui.get_content_region_avail().x
    imgui.set_cursor_pos_x(right - width)
    if button(f"{text}###convert", "Make curves of corners, or corners of curves"):
        imgui.open_popup("convert")
    if imgui.begin_popup("convert"):
        if imgui.menu_item_simple("To curves"):
            light = lights.to_bezier(light)
        for name, fineness in lights.FINENESS.items():
            tip = f"Within {100.0 * fineness:g} % of the light's size"
            if imgui.menu_item_simple(f"To polygon, {name}", "", False, lights.is_curved(light)):
                light = lights.to_polygon(light, fineness)
            tooltip(tip)
        imgui.end_popup()
    return light


def _new_hole(light: AreaLight) -> tuple[AreaLight, SceneError | None]:
    """Draw the menu of holes."""
    failure = None
    if imgui.begin_popup("holes"):
        try:
            if imgui.menu_item_simple("Square hole"):
                light = lights.add_hole(light, "square")
            if imgui.menu_item_simple("Round hole"):
                light = lights.add_hole(light, "round")
        except SceneError as error:
            failure = error
        imgui.end_popup()
    return light, failure


def _vertex(light: AreaLight, vertex: tuple[int, int]) -> AreaLight:
    """Draw the rows of the selected corner or anchor."""
    number, point = vertex
    contour = light.outline.contours[number]
    at, kind = contours.points_of(contour)[point], contours.kinds_of(contour)[point]
    word = lights.word_for_vertex(contour).capitalize()
    place = f"{word} {number}.{point} in the light's own coordinates"
    s, t = numbers(word, at, 0.01, "%.3f", place)
    if (s, t) != at:
        light = lights.move_vertex(light, vertex, (s, t))
    if isinstance(contour, BezierContour):
        before = (point - 1) % contours.size_of(contour)
        for name, segment, which in (("Handle in", before, 2), ("Handle out", point, 1)):
            handle = contours.handle_of(contour, segment, which)
            s, t = numbers(
                name, handle, 0.01, "%.3f", "Where the handle is, in the light's own coordinates"
            )
            if (s, t) != handle:
                light = lights.move_handle(light, number, segment, which, (s, t))
    chosen = choice(
        "Kind", kind, ANCHOR_KINDS,
        "How handles hang together: each for itself, in line, or in line and equally long",
    )  # fmt: skip
    return lights.set_kind(light, vertex, chosen) if chosen != kind else light


def _placement(light: AreaLight, target: Vec3) -> tuple[AreaLight, SceneError | None]:
    heading("Placement")
    centre = lights.centre_of(light)
    moved = position("Centre", centre, "Centre of the light in the world [m]")
    light = lights.move_light(light, subtract(moved, centre)) if moved != centre else light

    normal = planes.normal_of(light.plane)
    azimuth = math.degrees(math.atan2(normal[0], normal[2]))
    elevation = math.degrees(math.asin(max(-1.0, min(1.0, normal[1]))))
    azimuth, elevation = (round(angle, 9) + 0.0 for angle in (azimuth, elevation))
    turned = slider(
        "Azimuth", azimuth, -180.0, 180.0, "%.1f°", "Direction it faces, around the vertical"
    )
    raised = slider("Elevation", elevation, -90.0, 90.0, "%.1f°", "Direction it faces, upwards")
    if turned != azimuth:
        light = lights.rotate_light(light, (0.0, 1.0, 0.0), math.radians(turned - azimuth))
    if raised != elevation:
        flat = cross((0.0, 1.0, 0.0), normal)
        axis = normalize(flat) if length(flat) > 1e-6 else normalize(light.plane.u)
        light = lights.rotate_light(light, axis, -math.radians(raised - elevation))

    size = _size(light)
    w, h = numbers("Size", size, 0.01, "%.3f", "Width and height of the outline [m]")
    if (w, h) != size and min(w, h) > 1e-4 and min(size) > 0.0:
        light = _resized(light, w / size[0], h / size[1])

    failure = None
    width = half_width()
    if button("Aim at centre", "Face the point that the camera looks at", width=width):
        try:
            light = lights.aim(light, target)
        except SceneError as error:
            failure = error
    imgui.same_line()
    if button("Flip side", "Emit to the other side", width=width):
        light = lights.flip_light(light)
    return light, failure


def _size(light: AreaLight) -> tuple[float, float]:
    (s0, t0), (s1, t1) = lights.extent_of(light)
    return (s1 - s0) * length(light.plane.u), (t1 - t0) * length(light.plane.v)


def _resized(light: AreaLight, across: float, along: float) -> AreaLight:
    """Return the light with plane axes scaled, its centre in place."""
    before = lights.centre_of(light)
    plane = replace(light.plane, u=scale(light.plane.u, across), v=scale(light.plane.v, along))
    light = replace(light, plane=plane)
    shift = subtract(before, lights.centre_of(light))
    return replace(light, plane=replace(plane, origin=add(plane.origin, shift)))
