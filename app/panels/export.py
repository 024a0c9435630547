"""The export dialog: kind, size and samples of a picture file, and how far it is."""

from __future__ import annotations

from dataclasses import dataclass, replace

from imgui_bundle import ImVec2, imgui

from app.panels.widgets import begin_modal, button, choice, hint, label, tooltip
from app.scene import MAX_IMAGE_SIDE

SIZES: tuple[tuple[str, tuple[int, int]], ...] = (
    ("1280 × 720", (1280, 720)),
    ("1920 × 1080", (1920, 1080)),
    ("2560 × 1440", (2560, 1440)),
    ("3840 × 2160", (3840, 2160)),
    ("1024 × 1024", (1024, 1024)),
)
SAMPLE_COUNTS = (1, 16, 64, 256, 1024)
KINDS = ("png", "exr")
_WHAT = {
    "png": "What the screen shows: tone-mapped, 8 bits, sRGB",
    "exr": "Linear radiance in W m⁻² sr⁻¹, 32-bit float, for compositing and measuring",
}


@dataclass(frozen=True, slots=True)
class Export:
    """What to write: a picture of ``width`` x ``height`` pixels as ``kind``, png or exr."""

    kind: str = "png"
    width: int = 1920
    height: int = 1080
    samples: int = 64


def export_dialog(export: Export, viewport: tuple[int, int], is_asked: bool) -> tuple[Export, bool]:
    """Draw the dialog while it is open; return what was chosen and whether to go on with it.

    Parameters
    ----------
    viewport : (int, int)
        The picture's size on screen.
    is_asked : bool
        Open the dialog now.
    """
    title = "Export picture"
    if is_asked:
        imgui.open_popup(title)
    if not begin_modal(title):
        return export, False
    export = export_form(export, viewport)
    imgui.spacing()
    width = 7.0 * imgui.get_font_size()
    goes_on = button("Export…###choose file", width=width)
    imgui.same_line()
    if button("Cancel###cancel export", width=width) or goes_on:
        imgui.close_current_popup()
    imgui.end_popup()
    return export, goes_on


def export_progress(name: str, done: int, total: int) -> bool:
    """Draw how many samples of a file are done and return whether to stop."""
    stopped = False
    imgui.open_popup("Exporting")
    if begin_modal("Exporting"):
        imgui.text(name)
        size = ImVec2(20.0 * imgui.get_font_size(), 0.0)
        imgui.progress_bar(done / total, size, f"{done} of {total} samples")
        stopped = button("Stop###stop export")
        imgui.end_popup()
    return stopped


def export_form(export: Export, viewport: tuple[int, int]) -> Export:
    """Draw the form and return what was chosen; ``viewport`` is the picture's size on screen."""
    kind = choice("Format", export.kind, KINDS, "PNG for looking, EXR for measuring")
    hint(_WHAT[kind])
    width, height = export.width, export.height
    if imgui.begin_combo(label("Preset", "Common sizes"), f"{width} × {height}"):
        for name, size in (("As in the window", viewport), *SIZES):
            if imgui.selectable(name, size == (width, height))[0]:
                width, height = size
        imgui.end_combo()
    changed, typed = imgui.input_int2(label("Size", "Width and height [pixels]"), [width, height])
    tooltip(f"Width and height in pixels, 1 to {MAX_IMAGE_SIDE}")
    if changed:
        width, height = (min(max(side, 1), MAX_IMAGE_SIDE) for side in typed)
    samples = export.samples
    tip = "More samples make smoother edges and take longer; 1 is exactly the pixel centres"
    if imgui.begin_combo(label("Samples", tip), f"{samples} per pixel"):
        for count in SAMPLE_COUNTS:
            if imgui.selectable(f"{count} per pixel", count == samples)[0]:
                samples = count
        imgui.end_combo()
    return replace(export, kind=kind, width=width, height=height, samples=samples)
