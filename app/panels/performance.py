"""The panel of times."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from imgui_bundle import ImVec2, ImVec4, imgui, implot

from app.panels.measurement import Measurement, measurement_section
from app.panels.widgets import ACCENT, hint, right_text, tooltip


@dataclass(frozen=True, slots=True)
class Report:
    """What the panel shows.

    Attributes
    ----------
    passes : (name, milliseconds) of the last picture, GPU time unless named otherwise
    history : milliseconds of recent pictures, oldest first
    gpu : name of the renderer
    size : width and height of the picture in pixels
    samples : samples gathered, and how many there will be
    """

    passes: tuple[tuple[str, float], ...] = ()
    history: Sequence[float] = field(default_factory=tuple)
    gpu: str = ""
    size: tuple[int, int] = (0, 0)
    samples: tuple[int, int] = (0, 0)


def performance_panel(report: Report, measurement: Measurement) -> Literal["", "measure", "stop"]:
    """Draw the panel; return what is asked for: to measure the techniques, or to stop that."""
    hint(f"{report.gpu}\n{report.size[0]} × {report.size[1]} pixels")
    flags = imgui.TableFlags_.row_bg | imgui.TableFlags_.sizing_stretch_prop
    if report.passes and imgui.begin_table("passes", 2, flags):
        for name, milliseconds in report.passes:
            imgui.table_next_row()
            imgui.table_next_column()
            imgui.text(name)
            imgui.table_next_column()
            right_text(f"{milliseconds:.2f} ms")
        imgui.end_table()
    if len(report.history) > 1:
        _history(np.asarray(report.history, dtype=np.float64))
    return measurement_section(measurement)


def _history(milliseconds: np.ndarray) -> None:
    size = ImVec2(-1.0, imgui.get_font_size() * 5.0)
    flags = implot.Flags_.canvas_only | implot.Flags_.no_inputs
    if implot.begin_plot("##history", size, flags):
        axis = implot.AxisFlags_.no_decorations
        implot.setup_axes("", "", axis, implot.AxisFlags_.no_grid_lines)
        implot.setup_axes_limits(
            0.0, len(milliseconds) - 1, 0.0, 1.2 * float(milliseconds.max()) + 1e-3,
            implot.Cond_.always,
        )  # fmt: skip
        area = implot.Spec(fill_color=ImVec4(1.0, 1.0, 1.0, 0.07))
        implot.plot_shaded("##area", milliseconds, spec=area)
        implot.plot_line("##line", milliseconds, spec=implot.Spec(line_color=ACCENT))
        implot.end_plot()
    tooltip("Milliseconds per picture, the last ones to the right")
