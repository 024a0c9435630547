"""The form of the export dialog: kind, size and samples of a picture file."""

from __future__ import annotations

from dataclasses import dataclass, replace

from imgui_bundle import imgui

from app.panels.widgets import choice, hint, label, tooltip
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
