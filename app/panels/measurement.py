"""The part of the panel of times that sets techniques' errors against their times."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from imgui_bundle import ImVec2, ImVec4, imgui, implot

from app.panels.widgets import ACCENT, MUTED, button, heading, hint, tooltip

LEAST_ERROR = 1e-9
"""What has no error is shown here: zero has no logarithm, and float32 can tell no less."""

NEAR = 12.0
"""Points from a mark within which the pointer asks for it."""


@dataclass(frozen=True, slots=True)
class MeasuredPoint:
    """One technique: time of its lighting pass [ms], and mean specular error, absolute."""

    name: str
    milliseconds: float
    error: float
    on_front: bool


@dataclass(frozen=True, slots=True)
class Measurement:
    """What is known of the view.

    Attributes
    ----------
    points : of the techniques that are done
    doing : what is going on now, empty when nothing is
    progress : 0 to 1
    about : what was measured, in words
    """

    points: tuple[MeasuredPoint, ...] = ()
    doing: str = ""
    progress: float = 0.0
    about: str = ""


def measurement_section(measurement: Measurement) -> Literal["", "measure", "stop"]:
    """Draw the section; return what the user asks for."""
    heading("Error against time")
    asked: Literal["", "measure", "stop"] = ""
    if measurement.doing:
        imgui.progress_bar(measurement.progress, ImVec2(-1.0, 0.0), measurement.doing)
        if button("Stop measuring"):
            asked = "stop"
    elif button("Measure", "Time every technique in this view, and compare it with the truth"):
        asked = "measure"
    if measurement.points:
        _plot(measurement.points)
        _table(measurement.points)
    if measurement.about:
        hint(measurement.about)
    return asked


def _plot(points: Sequence[MeasuredPoint]) -> None:
    em = imgui.get_font_size()
    x = np.array([point.milliseconds for point in points])
    y = np.array([max(point.error, LEAST_ERROR) for point in points])
    front = np.array([point.on_front for point in points])
    flags = implot.Flags_.no_legend | implot.Flags_.no_menus | implot.Flags_.no_mouse_text
    size = ImVec2(-1.0, 15.0 * em)
    if not implot.begin_plot("##error against time", size, flags | implot.Flags_.no_inputs):
        return
    implot.setup_axes("lighting pass [ms]", "mean specular error")
    for axis in (implot.ImAxis_.x1, implot.ImAxis_.y1):
        implot.setup_axis_scale(axis, implot.Scale_.log10)
    x0, x1, y0, y1 = x.min() / 2.5, x.max() * 2.5, y.min() / 3.0, y.max() * 3.0
    implot.setup_axes_limits(x0, x1, y0, y1, implot.Cond_.always)
    order = np.argsort(x[front])
    line = implot.Spec(line_color=MUTED)
    implot.plot_line("##front", x[front][order], y[front][order], spec=line)
    for name, some, colour in (("##others", ~front, MUTED), ("##best", front, ACCENT)):
        if some.any():
            spec = implot.Spec(
                line_color=colour, marker=implot.Marker_.circle, marker_size=0.28 * em,
                marker_line_color=colour, marker_fill_color=colour,
            )  # fmt: skip
            implot.plot_scatter(name, x[some].copy(), y[some].copy(), spec=spec)
    near = _nearest(x, y) if implot.is_plot_hovered() else None
    for index, point in enumerate(points):
        if index == near or (near is None and point.on_front):
            is_left = x[index] ** 2 < x0 * x1  # of the middle of the axis
            beside = 0.5 * imgui.calc_text_size(point.name).x + 0.6 * em
            place = ImVec2(beside if is_left else -beside, 0.0)
            implot.plot_text(point.name, float(x[index]), float(y[index]), place)
    implot.end_plot()
    if near is not None:
        point = points[near]
        imgui.set_tooltip(f"{point.name}: {point.milliseconds:.3g} ms, error {point.error:.1e}")


def _nearest(x: np.ndarray, y: np.ndarray) -> int | None:
    """Return the mark under the pointer."""
    pointer = imgui.get_mouse_pos()
    places = [implot.plot_to_pixels(float(a), float(b)) for a, b in zip(x, y, strict=True)]
    distances = [abs(p.x - pointer.x) + abs(p.y - pointer.y) for p in places]
    nearest = int(np.argmin(distances))
    return nearest if distances[nearest] <= NEAR else None


def _table(points: Sequence[MeasuredPoint]) -> None:
    flags = imgui.TableFlags_.row_bg | imgui.TableFlags_.sizing_stretch_prop
    if not imgui.begin_table("measured", 3, flags):
        return
    for point in points:
        colour = ACCENT if point.on_front else ImVec4(*imgui.get_style_color_vec4(imgui.Col_.text))
        imgui.table_next_row()
        imgui.table_next_column()
        imgui.text_colored(colour, point.name)
        if point.on_front:
            tooltip("No other is both faster and more exact")
        for text in (f"{point.milliseconds:.3g} ms", f"{point.error:.1e}"):
            imgui.table_next_column()
            imgui.text(text)
    imgui.end_table()
