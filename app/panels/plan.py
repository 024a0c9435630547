"""The panel of what the renderer makes for the scene, why, and what it leaves out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from imgui_bundle import imgui

from app.panels.widgets import MUTED, heading, hint, tooltip
from app.plan_rows import PlanRow, PlanSection


@dataclass(frozen=True, slots=True)
class PlanReport:
    """What the panel shows: ``title`` says of which picture, ``summary`` has the sums."""

    title: str
    summary: str
    sections: tuple[PlanSection, ...]


def plan_panel(report: PlanReport) -> None:
    """Draw the panel."""
    hint(f"{report.title}\n{report.summary}")
    for section in report.sections:
        heading(section.title)
        if not section.rows:
            hint("nothing")
        for row in section.rows:
            _plan_row(row)


def _plan_row(row: PlanRow) -> None:
    """Draw name and size on a line, the reason beneath, everything else in the tooltip."""
    imgui.begin_group()
    imgui.text_wrapped(row.name)
    if row.figure:
        room = imgui.get_content_region_avail().x
        wide = imgui.calc_text_size(row.figure).x
        if imgui.calc_text_size(row.name).x + wide + imgui.get_font_size() < room:
            imgui.same_line(room - wide)  # from where the group starts
        else:
            imgui.set_cursor_pos_x(imgui.get_cursor_pos_x() + room - wide)
        imgui.text_colored(MUTED, row.figure)
    if row.why:
        em = imgui.get_font_size()
        imgui.indent(em)
        hint(row.why)
        imgui.unindent(em)
    imgui.end_group()
    tooltip(_more(row.form, row.more))


def _more(form: str, more: Sequence[str]) -> str:
    return "\n".join([*([form] if form else []), *more])
