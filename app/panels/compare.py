"""The panel that sets the picture beside another technique's: what is shown, and numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias, get_args

from imgui_bundle import imgui

from app.gui.shortcuts import key_of
from app.panels.parts import Parts, parts_table
from app.panels.widgets import button, checkbox, choice, heading, hint, label, slider, tooltip

Shown: TypeAlias = Literal["off", "A", "B", "split", "signed", "absolute", "relative", "FLIP"]
SHOWN: tuple[Shown, ...] = get_args(Shown)
Measured: TypeAlias = Literal["luminance", "largest channel"]
Colours: TypeAlias = Literal["magma", "viridis", "cividis"]

ESTIMATES = (16, 64, 256, 1024, 4096, 16384)
POINTS = (16, 64, 256, 1024)
LEAST_HIGH, MOST_HIGH = 1e-6, 1e3

_SHOW_TIP = (
    "off: no comparison; A: the technique of the Display panel; B: the other one; split: A left, "
    "B right of a line to drag; signed, absolute, relative: A − B in false colours; FLIP: how "
    "much somebody sees who flips between the two"
)


@dataclass(frozen=True, slots=True)
class Comparing:
    """What is compared and how it is shown.

    Attributes
    ----------
    show : Shown
    against : str
        B's technique.
    estimates : int
        Least samples of a technique that is a random estimate.
    measure, colours
        What of a pixel is compared, and the map of differences without a sign.
    automatic : bool
        Whether the range of colours follows the picture.
    high : float
        Its end where it does not, positive.
    divider : float
        Where the line of the split view is, 0 left to 1 right.
    points : int
        Random pixels at which A's error is broken down.
    """

    show: Shown = "off"
    against: str = "reference"
    estimates: int = 256
    measure: Measured = "luminance"
    colours: Colours = "magma"
    automatic: bool = True
    high: float = 0.1
    divider: float = 0.5
    points: int = 64

    @property
    def is_on(self) -> bool:
        return self.show != "off"

    def flipped(self) -> Comparing:
        """Return what the key that flips leads to: B, and from there A."""
        return replace(self, show="A" if self.show == "B" else "B")

    def toggled(self) -> Comparing:
        """Return the comparison switched off, or on as a split view."""
        return replace(self, show="off" if self.is_on else "split")


@dataclass(frozen=True, slots=True)
class NumberRow:
    """A line of the table: a radiance, and its share of B's mean and of the brightest light."""

    name: str
    value: str
    of_b: str = ""
    of_light: str = ""


@dataclass(frozen=True, slots=True)
class Comparison:
    """What the panel shows of a comparison that is on.

    Attributes
    ----------
    names : (str, str)
        The techniques of A and B.
    samples : pair of (done, wanted)
    rows : numbers, empty until there are some
    is_current : bool
        Whether the numbers belong to the picture as it is.
    sampled : bool
        Whether one of the two is a random estimate.
    high : float
        The end of the range of colours.
    progress : str
        What is still being computed, empty if nothing is.
    """

    names: tuple[str, str] = ("", "")
    samples: tuple[tuple[int, int], tuple[int, int]] = ((0, 0), (0, 0))
    rows: tuple[NumberRow, ...] = ()
    is_current: bool = True
    sampled: bool = False
    high: float = 1.0
    progress: str = ""


def compare_panel(
    value: Comparing, techniques: Sequence[str], found: Comparison | None, parts: Parts
) -> tuple[Comparing, bool]:
    """Draw the panel; return the settings as edited, and whether ``parts`` were asked for.

    ``techniques`` are the names to choose from; ``found`` is None while nothing is compared.
    """
    value = _choices(value, techniques, found)
    if found is not None:
        _numbers(found)
    asked = parts_table(parts, "view parts", f"Find at {value.points} points")
    if not parts.progress:
        tip = "How many random pixels to look at; each takes a fraction of a second"
        value = replace(value, points=_count("Points", value.points, POINTS, tip))
    return value, asked


def _choices(value: Comparing, techniques: Sequence[str], found: Comparison | None) -> Comparing:
    """Draw what can be chosen."""
    show = choice("Show", value.show, SHOWN, _SHOW_TIP)
    value = replace(value, show=show)
    tip = "The technique that A, the Display panel's, is measured by"
    value = replace(value, against=choice("Against", value.against, techniques, tip))
    if found is None:
        hint(
            f"{key_of('compare')} sets another technique's picture beside this one, "
            f"{key_of('flip')} flips between the two."
        )
        return value
    if found.sampled:
        tip = "Least samples per pixel of a technique that is a random estimate"
        value = replace(value, estimates=_count("Estimates", value.estimates, ESTIMATES, tip))
    tip = "What of a pixel is compared: its luminance, or the channel that differs most"
    value = replace(value, measure=choice("Of", value.measure, get_args(Measured), tip))
    if value.show in ("signed", "absolute", "relative"):
        value = _range(value, found.high)
    return value


def _count(name: str, value: int, counts: Sequence[int], tip: str) -> int:
    if imgui.begin_combo(label(name, tip), str(value)):
        for count in counts:
            if imgui.selectable(str(count), count == value)[0]:
                value = count
        imgui.end_combo()
    tooltip(tip)
    return value


def _range(value: Comparing, high: float) -> Comparing:
    tip = "Let the colours end near the largest differences; off keeps a range to compare by"
    automatic = checkbox("Fit range", value.automatic, tip)
    # What was fitted last is where a range of one's own begins.
    own = high if automatic or value.automatic else value.high
    if not automatic:
        own = slider(
            "Range", own, LEAST_HIGH, MOST_HIGH, "%.3g", "The value at the end of the colours", True
        )
    value = replace(value, automatic=automatic, high=min(max(own, LEAST_HIGH), MOST_HIGH))
    if value.show != "signed":
        tip = "Colours that read the same with any colour vision"
        value = replace(value, colours=choice("Colours", value.colours, get_args(Colours), tip))
    return value


def _numbers(found: Comparison) -> None:
    a, b = found.names
    heading(f"{a} compared with {b}")
    (a_done, a_wanted), (b_done, b_wanted) = found.samples
    hint(f"{a_done} of {a_wanted} and {b_done} of {b_wanted} samples")
    if found.progress:
        hint(found.progress)
    if not found.rows:
        return
    has_light = any(row.of_light for row in found.rows)
    flags = imgui.TableFlags_.row_bg | imgui.TableFlags_.sizing_stretch_prop
    imgui.begin_disabled(not found.is_current)
    if imgui.begin_table("numbers", 4 if has_light else 3, flags):
        for head in ("", "radiance", "of B", *(["of light"] if has_light else [])):
            imgui.table_setup_column(head)
        imgui.table_headers_row()
        for row in found.rows:
            imgui.table_next_row()
            for cell in (row.name, row.value, row.of_b, *([row.of_light] if has_light else [])):
                imgui.table_next_column()
                imgui.text(cell)
        imgui.end_table()
    imgui.end_disabled()
    hint("Over all pixels; shares are of B's mean and of the brightest light's radiance.")
    if button("Copy###copy numbers", "Copy the numbers as lines of text, columns by tabs"):
        lines = ["\t".join((r.name, r.value, r.of_b, r.of_light)) for r in found.rows]
        imgui.set_clipboard_text("\n".join([f"{a} compared with {b}", *lines]))
