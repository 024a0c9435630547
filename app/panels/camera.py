"""The panel of the camera."""

from __future__ import annotations

import math
from dataclasses import replace

from imgui_bundle import imgui

from app.camera_control import distance_of
from app.panels.widgets import button, heading, position, slider
from app.scene import Camera, Vec3
from app.vectors import add, scale

VIEWS: tuple[tuple[str, Vec3], ...] = (
    ("Front", (0.0, 0.0, 1.0)),
    ("Right", (1.0, 0.0, 0.0)),
    ("Top", (0.0, 1.0, 1e-2)),
)
"""Name of the view and the direction from target to eye; Top stays off the pole."""


def camera_panel(camera: Camera) -> Camera:
    """Draw the panel and return the camera as edited.

    Raises
    ------
    SceneError
        If eye and target meet or the view runs along ``up``, after drawing.
    """
    eye = position("Eye", camera.eye, "Where one looks from [m]")
    target = position("Target", camera.target, "What one looks at and orbits around [m]")
    fov = math.degrees(camera.fov_y)
    degrees = slider("Field of view", fov, 5.0, 120.0, "%.1f°", "Full vertical angle [degrees]")
    heading("Look from")
    spacing = imgui.get_style().item_spacing.x
    width = (imgui.get_content_region_avail().x - 2.0 * spacing) / 3.0
    for i, (name, direction) in enumerate(VIEWS):
        if i:
            imgui.same_line()
        if button(name, f"Look at the target from the {name.lower()}", width=width):
            eye = add(target, scale(direction, distance_of(camera)))
    fov_y = math.radians(degrees) if degrees != fov else camera.fov_y
    if (eye, target, fov_y) == (camera.eye, camera.target, camera.fov_y):
        return camera
    return replace(camera, eye=eye, target=target, fov_y=fov_y)
