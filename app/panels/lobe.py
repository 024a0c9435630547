"""The panel of the lobe at a surface point: GGX, its transformed cosine, their difference."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

from imgui_bundle import imgui

from app.panels.lobe_pictures import LobeView, lobe_pictures
from app.panels.widgets import ACCENT, MUTED, button, heading, hint, right_text, slider, tooltip
from ltc.lobe import THETA_MAX, Case, LobePair
from ltc.table import ALPHA_MIN

Mode: TypeAlias = Literal["pointer", "pinned", "free"]

SNAP = 0.03
"""Ratios of alphas that are closer to 1 than this become 1: there the table is another."""
RATIO_MIN = 0.01
LEAST_SHARE = 1e-4
"""Share of a light from which on its error is told in relation to it."""


@dataclass(frozen=True, slots=True)
class LobeState:
    """What the user chose.

    Attributes
    ----------
    mode : whether the lobe is that under the pointer, at a pinned point, or set by the sliders
    alpha : the larger of the alphas, of the sliders' lobe; the rest likewise
    ratio : alpha_y / alpha_x
    theta, phi : degrees
    logarithmic : the scale of the pictures
    follows : whether pictures show the part of the disk where the lobes are, or all of it
    """

    mode: Mode = "pointer"
    alpha: float = 0.4
    ratio: float = 0.125
    theta: float = 60.0
    phi: float = 30.0
    logarithmic: bool = True
    follows: bool = True

    @property
    def case(self) -> Case:
        """The material and view that the sliders say."""
        larger = min(max(self.alpha, ALPHA_MIN), 1.0)
        ax = larger / max(self.ratio, 1.0)
        ay = larger * min(self.ratio, 1.0)
        theta = min(math.radians(self.theta), THETA_MAX)
        return Case(max(ax, ALPHA_MIN), max(ay, ALPHA_MIN), theta, math.radians(self.phi))

    def at(self, case: Case) -> LobeState:
        """Return the state whose sliders say this case."""
        phi = math.degrees(math.remainder(case.phi, 2.0 * math.pi))
        larger = max(case.alpha_x, case.alpha_y)
        ratio = case.alpha_y / case.alpha_x
        return replace(self, alpha=larger, ratio=ratio, theta=math.degrees(case.theta), phi=phi)


@dataclass(frozen=True, slots=True)
class LightShare:
    """What a light of radiance 1 adds to the point for F = 1: by GGX, and by its LTC."""

    name: str
    ggx: float
    ltc: float


def lobe_panel(
    state: LobeState,
    view: LobeView | None,
    shares: Sequence[LightShare],
    can_pin: bool,
    pin_key: str,
) -> LobeState:
    """Draw the panel and return what the user chose.

    Parameters
    ----------
    view : LobeView or None
        None while no point was hovered yet.
    shares : sequence of LightShare
        Of the lights as far as they are known, the most important first.
    can_pin : bool
        Whether there is a point that could be pinned.
    pin_key : str
        The key that pins.
    """
    new = _modes(state, view, can_pin, pin_key)
    if view is None:
        hint("Rest the pointer on a surface in the picture to see its lobe.")
        return new
    hint(f"{view.title}. {view.note}" if view.note else f"{view.title}.")
    lobe_pictures(view)
    new = _toggles(new)
    _numbers(view.pair)
    if shares:
        _shares(shares)
    heading("By hand")
    shown = _sliders(new.at(view.pair.case))
    if shown != new.at(view.pair.case):
        new = replace(shown, mode="free")
    heading("Transform")
    _matrix(view.pair)
    return new


def _toggles(state: LobeState) -> LobeState:
    """Draw what the pictures' scale and place may be."""
    _, logarithmic = imgui.checkbox("Log scale###log scale", state.logarithmic)
    tooltip("Powers of ten below the peak: four, of the difference two")
    imgui.same_line(0.5 * imgui.get_content_region_avail().x)
    _, follows = imgui.checkbox("Zoom###zoom lobe", state.follows)
    tooltip("Show the part of the disk where the lobes are, not all of it")
    return replace(state, logarithmic=logarithmic, follows=follows)


def _modes(state: LobeState, view: LobeView | None, can_pin: bool, pin_key: str) -> LobeState:
    """Draw the row of modes, one of them pressed."""
    modes: tuple[tuple[Mode, str, str, bool], ...] = (
        ("pointer", "Pointer", "The lobe of the surface under the pointer", True),
        ("pinned", "Pinned", f"Keep the last point, whatever the pointer does ({pin_key})",
         can_pin or state.mode == "pinned"),
        ("free", "Free", "Set material and view by the sliders", True),
    )  # fmt: skip
    spacing = imgui.get_style().item_spacing.x
    width = (imgui.get_content_region_avail().x - 2.0 * spacing) / 3.0
    new = state
    for i, (mode, text, tip, enabled) in enumerate(modes):
        if i:
            imgui.same_line()
        pressed = state.mode == mode
        if pressed:
            imgui.push_style_color(imgui.Col_.text, ACCENT)
        if button(f"{text}###lobe {mode}", tip, enabled, width):
            new = replace(state, mode=mode)
            if mode == "free" and view is not None:
                new = new.at(view.pair.case)
        if pressed:
            imgui.pop_style_color()
    return new


def _sliders(state: LobeState) -> LobeState:
    """Draw alpha, ratio, and the view's angles."""
    alpha = slider(
        "Alpha", state.alpha, ALPHA_MIN, 1.0, "%.4f", "GGX's alpha; of the two, the larger",
        logarithmic=True,
    )  # fmt: skip
    ratio = slider(
        "Ratio", state.ratio, RATIO_MIN, 1.0 / RATIO_MIN, "%.3f",
        "αy / αx. 1: isotropic, looked up in the isotropic table", logarithmic=True,
    )  # fmt: skip
    if ratio != state.ratio and abs(math.log(ratio)) < SNAP:
        ratio = 1.0
    theta = slider("Theta", state.theta, 0.0, 89.9, "%.2f°", "Angle between view and normal")
    phi = slider("Phi", state.phi, -180.0, 180.0, "%.1f°", "Azimuth of the view from the tangent")
    return replace(state, alpha=alpha, ratio=ratio, theta=theta, phi=phi)


def _numbers(pair: LobePair) -> None:
    """Draw the figures of both lobes."""
    case, flags = pair.case, imgui.TableFlags_.row_bg | imgui.TableFlags_.sizing_stretch_prop
    rows = (
        ("αx, αy", f"{case.alpha_x:.4g}, {case.alpha_y:.4g}", "GGX parameters along x and y"),
        ("Albedo", f"{pair.exact_albedo:.4f} exact, {pair.albedo:.4f} table",
         "Share of a white sky's light that is reflected, F = 1"),
        ("Total variation", f"{pair.variation:.3f}",
         "Half the difference of both lobes' shapes, over all directions: 0 equal, 1 disjoint"),
        ("Below horizon", f"{100.0 * pair.leak:.1f} %",
         "Of the transformed cosine; the part above is divided by the rest"),
        ("Table", pair.table, "Where the transform comes from"),
    )  # fmt: skip
    if imgui.begin_table("figures", 2, flags):
        for name, text, tip in rows:
            imgui.table_next_row()
            imgui.table_next_column()
            imgui.text_colored(MUTED, name)
            tooltip(tip)
            imgui.table_next_column()
            imgui.text_unformatted(text)
            tooltip(tip)
        imgui.end_table()


def _matrix(pair: LobePair) -> None:
    """Draw M, row by row."""
    flags = imgui.TableFlags_.row_bg | imgui.TableFlags_.sizing_stretch_prop
    if imgui.begin_table("M", 4, flags):
        for row, label in zip(pair.M.tolist(), ("M", "", ""), strict=True):
            imgui.table_next_row()
            imgui.table_next_column()
            imgui.text_colored(MUTED, label)
            tooltip("Turns a cosine lobe about the normal into this one; x is the tangent")
            for value in row:
                imgui.table_next_column()
                right_text(f"{value:.4f}")
        imgui.end_table()


def _shares(shares: Sequence[LightShare]) -> None:
    """Draw what the lights add."""
    flags = imgui.TableFlags_.row_bg | imgui.TableFlags_.sizing_stretch_prop
    if not imgui.begin_table("shares", 4, flags):
        return
    tip = "What the light adds here for radiance 1 and F = 1: exact, and by the table"
    for text in ("Light", "GGX", "LTC", "Error"):
        imgui.table_next_column()
        imgui.text_colored(MUTED, text)
        tooltip(tip)
    for share in shares:
        imgui.table_next_row()
        imgui.table_next_column()
        imgui.text_unformatted(share.name)
        off = share.ltc - share.ggx
        relative = f"{100.0 * off / share.ggx:+.1f} %" if share.ggx > LEAST_SHARE else "–"
        for text in (f"{share.ggx:.4f}", f"{share.ltc:.4f}", relative):
            imgui.table_next_column()
            imgui.text_unformatted(text)
    imgui.end_table()
