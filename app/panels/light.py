"""The panel of one light: its radiance, its shape and where it is."""

from __future__ import annotations

import math
from dataclasses import replace

from imgui_bundle import imgui

from app import contours, lights, planes
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
)
from app.scene import FILL_RULES, AreaLight, SceneError, Vec3
from app.vectors import add, cross, length, normalize, scale, subtract

RADIANCE_MAX = 1000.0


def light_panel(
    light: AreaLight, vertex: tuple[int, int] | None = None, target: Vec3 = (0.0, 0.0, 0.0)
) -> AreaLight:
    """Draw the panel and return the light as edited.

    Parameters
    ----------
    vertex : (contour, point), optional
        The selected corner, whose coordinates are shown.
    target : Vec3
        Where "Aim" aims: what the camera looks at.

    Raises
    ------
    SceneError
        If a button asks for what the light cannot do, after drawing.
    """
    with identity(f"light {light.name}"):
        new = _emission(light)
        new, failure = _shape(new, vertex)
        new, failed_aim = _placement(new, target)
    failure = failure or failed_aim
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
    loops_now = light.outline.contours
    corners = sum(map(contours.size_of, loops_now))
    heading("Shape")
    loops = "1 outline" if len(loops_now) == 1 else f"{len(loops_now)} outlines"
    hint(f"{corners} corners in {loops}")
    failure = None
    width = half_width()
    if button("Add hole", "Cut a square hole into the widest part", width=width):
        try:
            light = lights.add_hole(light)
        except SceneError as error:
            failure = error
    imgui.same_line()
    last = len(loops_now) - 1
    if button("Remove hole", "Remove the outline added last", enabled=last > 0, width=width):
        light = lights.remove_contour(light, last)
    if len(loops_now) > 1:
        rule = choice(
            "Fill rule", light.outline.fill_rule, FILL_RULES,
            "How overlapping outlines combine: even-odd alternates, "
            "nonzero fills wherever they wind",
        )  # fmt: skip
        if rule != light.outline.fill_rule:
            light = replace(light, outline=replace(light.outline, fill_rule=rule))
    if vertex is not None and vertex[0] < len(light.outline.contours):
        contour, point = vertex
        at = contours.points_of(light.outline.contours[contour])[point]
        s, t = numbers(
            "Corner", at, 0.01, "%.3f", f"Corner {contour}.{point} in the light's own coordinates"
        )
        if (s, t) != at:
            light = lights.move_vertex(light, vertex, (s, t))
    return light, failure


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
