"""What is drawn over the picture: outlines, boxes, handles, the line of help."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from imgui_bundle import ImVec2, ImVec4, imgui

from app import camera_control as control
from app import contours, lights, planes
from app.gui import theme
from app.scene import AreaLight, Camera, Vec3
from app.vectors import add, scale

HANDLE = 9.0
"""Half the side of the square in which a corner can be grabbed, in points."""
SHORTEST_EDGE = 56.0
"""Length in points from which on an edge offers a point to add a corner."""


@dataclass(frozen=True, slots=True)
class View:
    """The picture's place on the screen: corner and size in points, size in pixels."""

    x: float
    y: float
    width: float
    height: float
    pixels: tuple[int, int]

    def project(self, camera: Camera, point: Vec3) -> tuple[float, float] | None:
        """Return screen coordinates of a world point, None behind the eye."""
        found = control.project(camera, point, self.width, self.height)
        return None if found is None else (self.x + found[0], self.y + found[1])

    def ray(self, camera: Camera, x: float, y: float) -> Vec3:
        """Return the direction of the ray through screen coordinates."""
        return control.ray_through(camera, x - self.x, y - self.y, self.width, self.height)

    def contains(self, x: float, y: float) -> bool:
        return self.x <= x < self.x + self.width and self.y <= y < self.y + self.height


@dataclass(frozen=True, slots=True)
class Middle:
    """The middle of an edge on the screen, and whether there is room for a handle."""

    contour: int
    edge: int
    at: tuple[float, float]
    has_room: bool


@dataclass(frozen=True, slots=True)
class Canvas:
    """Where to draw, seen how: a draw list, the picture's place, a camera, the size of a point.

    ``crowded`` makes corners smaller, for lights that have many.
    """

    draw: imgui.ImDrawList
    view: View
    camera: Camera
    unit: float
    crowded: bool = False

    def segment(self, a: Vec3, b: Vec3, ink: int, thickness: float) -> None:
        """Draw what is in front of the eye of a line between two world points."""
        clipped = control.clip_to_view(self.camera, a, b)
        if clipped is not None:
            ends = [self.view.project(self.camera, point) for point in clipped]
            if ends[0] is not None and ends[1] is not None:
                self.draw.add_line(ImVec2(*ends[0]), ImVec2(*ends[1]), ink, thickness)

    def outline(self, light: AreaLight, colour: ImVec4, alpha: float, thickness: float) -> None:
        """Draw a light's contours, with a dark rim that shows on bright lights."""
        rim, ink = theme.u32(theme.grey(0.0), 0.35 * alpha), theme.u32(colour, alpha)
        plane = light.plane
        axes = np.array([plane.u, plane.v])
        for contour in light.outline.contours:
            world = np.array(plane.origin) + contours.flatten(contour, 1e-3) @ axes
            screen = control.project_all(self.camera, world, self.view.width, self.view.height)
            if screen is not None:
                points: list[Any] = [
                    ImVec2(self.view.x + x, self.view.y + y) for x, y in screen.tolist()
                ]
                closed = imgui.ImDrawFlags_.closed
                self.draw.add_polyline(points, rim, thickness + 2.0, closed)
                self.draw.add_polyline(points, ink, thickness, closed)
                continue
            corners: list[Vec3] = [(x, y, z) for x, y, z in world.tolist()]
            for a, b in zip(corners, corners[1:] + corners[:1], strict=True):
                self.segment(a, b, ink, thickness)

    def box(self, corners: list[Vec3]) -> None:
        """Draw the edges of a box; bits 1, 2, 4 of a corner's index are x, y, z."""
        ink = theme.u32(theme.ACCENT, 0.45)
        for a in range(8):
            for axis in (1, 2, 4):
                if not a & axis:
                    self.segment(corners[a], corners[a | axis], ink, 1.0)

    def direction(self, light: AreaLight) -> None:
        """Draw a short line from a light's centre to where it shines."""
        centre, radius = lights.bounds_of(light)
        tip = add(centre, scale(planes.normal_of(light.plane), 0.6 * radius))
        self.segment(centre, tip, theme.u32(theme.ACCENT, 0.5), 1.5)
        at = self.view.project(self.camera, tip)
        if at is not None:
            self.draw.add_circle_filled(ImVec2(*at), 3.0, theme.u32(theme.ACCENT, 0.8))

    def corner(self, at: tuple[float, float], *, near: bool, chosen: bool, hidden: bool) -> None:
        """Draw a corner: larger under the pointer, ringed when selected, dim when hidden."""
        centre = ImVec2(*at)
        radius = self.unit * (6.5 if near or chosen else 3.2 if self.crowded else 5.0)
        alpha = 0.4 if hidden and not (near or chosen) else 1.0
        fill = theme.ACCENT if chosen or near else theme.grey(0.97)
        self.draw.add_circle_filled(centre, radius + 1.5, theme.u32(theme.grey(0.0), 0.6 * alpha))
        self.draw.add_circle_filled(centre, radius, theme.u32(fill, alpha))
        if chosen:
            self.draw.add_circle(centre, radius + 3.0, theme.u32(theme.ACCENT), 0, 1.5)

    def middle(self, at: tuple[float, float], *, near: bool) -> None:
        """Draw the dot that adds a corner, a plus under the pointer."""
        draw, (x, y), arm = self.draw, at, 3.0 * self.unit
        radius, alpha = (5.0, 1.0) if near else (2.5, 0.6)
        radius *= self.unit
        draw.add_circle_filled(ImVec2(x, y), radius + 1.0, theme.u32(theme.grey(0.0), 0.5))
        draw.add_circle_filled(ImVec2(x, y), radius, theme.u32(theme.grey(0.95), alpha))
        if near:
            ink = theme.u32(theme.grey(0.1))
            draw.add_line(ImVec2(x - arm, y), ImVec2(x + arm, y), ink, 1.5)
            draw.add_line(ImVec2(x, y - arm), ImVec2(x, y + arm), ink, 1.5)


def middles_of(view: View, camera: Camera, light: AreaLight) -> list[Middle]:
    """Return the middles of a light's edges that are in front of the eye."""
    found = []
    for c, contour in enumerate(light.outline.contours):
        world = [planes.point_on(light.plane, point) for point in contours.points_of(contour)]
        for e, (a, b) in enumerate(zip(world, world[1:] + world[:1], strict=True)):
            first, last = view.project(camera, a), view.project(camera, b)
            at = view.project(camera, scale(add(a, b), 0.5))
            if first is not None and last is not None and at is not None:
                span = float(np.hypot(last[0] - first[0], last[1] - first[1]))
                found.append(Middle(c, e, at, span >= SHORTEST_EDGE))
    return found


def is_near(at: tuple[float, float], mouse: ImVec2, unit: float) -> bool:
    """Tell whether the pointer is where a handle can be grabbed."""
    return max(abs(at[0] - mouse.x), abs(at[1] - mouse.y)) <= unit * HANDLE


def help_line(view: View, text: str) -> None:
    """Write a line of help over the lower edge of the picture, if there is room."""
    draw = imgui.get_window_draw_list()
    size, pad = imgui.calc_text_size(text), 0.7 * imgui.get_font_size()
    if not text or size.x + 4.0 * pad > view.width:
        return
    x = view.x + 0.5 * (view.width - size.x)
    y = view.y + view.height - size.y - 2.0 * pad
    low, high = ImVec2(x - pad, y - 0.5 * pad), ImVec2(x + size.x + pad, y + size.y + 0.5 * pad)
    draw.add_rect_filled(low, high, theme.u32(theme.grey(0.06), 0.72), 6.0)
    draw.add_text(ImVec2(x, y), theme.u32(theme.grey(0.86)), text)
