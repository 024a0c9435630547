"""What is drawn over the picture: outlines, boxes, handles, the line of help."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from imgui_bundle import ImVec2, ImVec4, imgui
from numpy.typing import NDArray

from app import camera_control as control
from app import contours, lights, planes
from app.curves import pieces, subdivide
from app.gui import theme
from app.scene import AnchorKind, AreaLight, Camera, Plane, Vec2, Vec3
from app.vectors import add, length, scale, subtract

FloatArray = NDArray[np.float64]

HANDLE = 9.0
"""Half the side of the square in which a corner can be grabbed, in points."""

FLAT = 0.1
"""How far lines that stand for a curve may be from it on the screen, in points."""


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

    def project_all(self, camera: Camera, points: FloatArray) -> FloatArray:
        """Return (..., 3) screen coordinates and depths [m]; NaN behind the eye."""
        found = control.project_all(camera, points, self.width, self.height)
        return np.asarray(found + np.array([self.x, self.y, 0.0]))

    def ray(self, camera: Camera, x: float, y: float) -> Vec3:
        """Return the direction of the ray through screen coordinates."""
        return control.ray_through(camera, x - self.x, y - self.y, self.width, self.height)

    def contains(self, x: float, y: float) -> bool:
        return self.x <= x < self.x + self.width and self.y <= y < self.y + self.height


@dataclass(frozen=True, slots=True)
class Sight:
    """How the scene is seen: the picture's place, a camera, and the size of a point."""

    view: View
    camera: Camera
    unit: float

    def project(self, point: Vec3) -> tuple[float, float] | None:
        """Return screen coordinates of a world point, None behind the eye."""
        return self.view.project(self.camera, point)

    def plane_point(self, plane: Plane, x: float, y: float) -> Vec2 | None:
        """Return the plane coordinates under a place on the screen, None if it looks past."""
        eye, direction = self.camera.eye, self.view.ray(self.camera, x, y)
        hit = control.intersect_plane(eye, direction, plane.origin, planes.normal_of(plane))
        return None if hit is None else planes.coordinates_on(plane, hit)

    def piece_counts(self, curves: FloatArray, plane: Plane) -> NDArray[np.int64]:
        """Return into how many lines to cut curves (n, 4, 2) of a plane so that none is seen.

        By the depth of the nearest control point: nowhere on the curve is a
        metre longer on the screen. What is off the screen stays whole.
        """
        screen = self.view.project_all(self.camera, on_plane(plane, curves))
        focal = 0.5 * self.view.height / np.tan(0.5 * self.camera.fov_y)
        nearest = np.nan_to_num(screen[..., 2], nan=control.NEAR).min(-1)
        metric = planes.metric_from_plane(plane)
        counts = pieces(curves @ metric.T, FLAT * nearest / focal, contours.MOST_PIECES)
        low, high = screen[..., :2].min(1), screen[..., :2].max(1)
        corner = np.array([self.view.x, self.view.y])
        size = np.array([self.view.width, self.view.height])
        counts[((high < corner) | (low > corner + size)).any(-1)] = 1
        return counts


def on_plane(plane: Plane, points: FloatArray) -> FloatArray:
    """Return the world positions (..., 3) of plane coordinates (..., 2)."""
    return np.asarray(np.array(plane.origin) + points @ np.array([plane.u, plane.v]))


@dataclass(frozen=True, slots=True)
class Canvas:
    """Where to draw, seen how. ``crowded`` makes points smaller, for lights that have many."""

    draw: imgui.ImDrawList
    sight: Sight
    crowded: bool = False

    @property
    def unit(self) -> float:
        return self.sight.unit

    def segment(self, a: Vec3, b: Vec3, ink: int, thickness: float) -> None:
        """Draw what is in front of the eye of a line between two world points."""
        clipped = control.clip_to_view(self.sight.camera, a, b)
        if clipped is not None:
            ends = [self.sight.project(point) for point in clipped]
            if ends[0] is not None and ends[1] is not None:
                self.draw.add_line(ImVec2(*ends[0]), ImVec2(*ends[1]), ink, thickness)

    def outline(self, light: AreaLight, colour: ImVec4, alpha: float, thickness: float) -> None:
        """Draw a light's contours, with a dark rim that shows on bright lights."""
        rim, ink = theme.u32(theme.grey(0.0), 0.55 * alpha), theme.u32(colour, alpha)
        segments = contours.segments_of(light.outline)
        counts = self.sight.piece_counts(segments.curves, light.plane)
        world = on_plane(light.plane, subdivide(segments.curves, counts))
        screen = self.sight.view.project_all(self.sight.camera, world)
        ends = np.concatenate([[0], np.cumsum(counts)])[list(segments.starts)]
        for first, last in pairwise(ends.tolist()):
            if np.isfinite(screen[first:last]).all():
                points: list[Any] = [ImVec2(x, y) for x, y, _ in screen[first:last].tolist()]
                closed = imgui.ImDrawFlags_.closed
                self.draw.add_polyline(points, rim, thickness + 2.0, closed)
                self.draw.add_polyline(points, ink, thickness, closed)
                continue
            corners: list[Vec3] = [(x, y, z) for x, y, z in world[first:last].tolist()]
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
        at = self.sight.project(tip)
        if at is not None:
            self.draw.add_circle_filled(ImVec2(*at), 3.0, theme.u32(theme.ACCENT, 0.8))

    def pin(self, position: Vec3, normal: Vec3, tangent: Vec3) -> None:
        """Draw a surface point with its normal and, fainter, its tangent."""
        at = self.sight.project(position)
        if at is None:
            return
        reach = 0.07 * length(subtract(position, self.sight.camera.eye))
        for way, alpha in ((tangent, 0.55), (normal, 1.0)):
            tip = add(position, scale(way, reach))
            self.segment(position, tip, theme.u32(theme.grey(0.0), 0.6 * alpha), 3.6)
            self.segment(position, tip, theme.u32(theme.ACCENT, alpha), 1.6)
        centre = ImVec2(*at)
        self.draw.add_circle_filled(centre, 4.5 * self.unit, theme.u32(theme.grey(0.0), 0.7))
        self.draw.add_circle_filled(centre, 3.0 * self.unit, theme.u32(theme.ACCENT))

    def vertex(
        self,
        at: tuple[float, float],
        kind: AnchorKind,
        *,
        near: bool,
        chosen: bool,
        hidden: bool,
    ) -> None:
        """Draw a corner or anchor: a diamond, a square if smooth, a disk if symmetric.

        Larger under the pointer, ringed when selected, dim when hidden.
        """
        radius = self.unit * (6.5 if near or chosen else 3.2 if self.crowded else 5.0)
        alpha = 0.4 if hidden and not (near or chosen) else 1.0
        fill = theme.ACCENT if chosen or near else theme.grey(0.97)
        self._mark(at, kind, radius + 1.5, theme.u32(theme.grey(0.0), 0.75 * alpha))
        self._mark(at, kind, radius, theme.u32(fill, alpha))
        if chosen:
            centre = ImVec2(*at)
            self.draw.add_circle(centre, radius + 4.5, theme.u32(theme.grey(0.0), 0.6), 0, 3.0)
            self.draw.add_circle(centre, radius + 4.5, theme.u32(theme.ACCENT), 0, 1.5)

    def _mark(self, at: tuple[float, float], kind: AnchorKind, radius: float, ink: int) -> None:
        """Fill the sign of a kind, of about equal area for each."""
        x, y = at
        if kind == "symmetric":
            self.draw.add_circle_filled(ImVec2(x, y), radius, ink)
        elif kind == "smooth":
            r = 0.87 * radius
            self.draw.add_rect_filled(ImVec2(x - r, y - r), ImVec2(x + r, y + r), ink)
        else:
            r = 1.22 * radius
            self.draw.add_quad_filled(
                ImVec2(x, y - r), ImVec2(x + r, y), ImVec2(x, y + r), ImVec2(x - r, y), ink
            )

    def handle(
        self, anchor: tuple[float, float] | None, at: tuple[float, float], *, near: bool
    ) -> None:
        """Draw a handle: a ring, and the line to its anchor."""
        dark, ink = theme.u32(theme.grey(0.0), 0.6), theme.u32(theme.grey(0.95), 0.9)
        centre, radius = ImVec2(*at), self.unit * (4.5 if near else 3.4)
        if anchor is not None:
            self.draw.add_line(ImVec2(*anchor), centre, dark, 3.0)
            self.draw.add_line(ImVec2(*anchor), centre, ink, 1.2)
        self.draw.add_circle_filled(centre, radius + 2.0, dark)
        self.draw.add_circle_filled(centre, radius, theme.u32(theme.grey(0.12)))
        rim = theme.ACCENT if near else theme.grey(0.97)
        self.draw.add_circle(centre, radius, theme.u32(rim), 0, 1.8)

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
