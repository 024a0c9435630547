"""The panel of everything between radiance and screen: exposure, tone map, samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from imgui_bundle import imgui

from app.panels.widgets import choice, heading, label, slider, tooltip
from app.plan_rows import share_text
from app.scene import PIXEL_VIEWS, TONE_MAPS, Display, RenderSettings

SAMPLE_COUNTS = (1, 4, 8, 16, 32, 64, 128, 256, 1024, 4096, 16384, 65536)

_TONE_MAP_TIP = (
    "agx: gentle, keeps bright colours from clipping; aces: contrasty, as film; "
    "reinhard: soft; none: clips above 1"
)
_VIEW_TIP = (
    "radiance: the picture; cost: how often each pixel evaluates the integral along the "
    "lights' outlines, in colours"
)


CULL_SHARES = (0.0, 1 / 4096, 1 / 1024, 1 / 256)

_CULL_TIP = (
    "Lights too faint to see: what is skipped at a pixel never adds up to more than this, at the "
    "scene's exposure. Many lights take less time; techniques ltc and ggx"
)


def display_panel(
    display: Display, settings: RenderSettings, techniques: Sequence[str]
) -> tuple[Display, RenderSettings]:
    """Draw the panel and return display and settings as edited.

    ``settings.samples`` is how many samples per pixel a still picture gathers;
    ``techniques`` are the names to choose from.
    """
    exposure = slider(
        "Exposure", display.exposure, -10.0, 10.0, "%+.2f stops",
        "Brightens (+) or darkens (−) the picture by powers of two",
    )  # fmt: skip
    tone_map = choice("Tone map", display.tone_map, TONE_MAPS, _TONE_MAP_TIP)
    heading("Quality")
    tip = "Samples per pixel that a still picture gathers; 1 is exactly the pixel centre"
    identity = label("Samples", tip)
    samples = settings.samples
    if imgui.begin_combo(identity, f"{samples} per pixel"):
        for count in SAMPLE_COUNTS:
            if imgui.selectable(f"{count} per pixel", count == samples)[0]:
                samples = count
        imgui.end_combo()
    tooltip(tip)
    technique = settings.technique
    if len(techniques) > 1:
        technique = choice("Technique", technique, techniques, "How lights are integrated")
    cull = _cull_choice(settings.cull)
    view = choice("View", settings.view, PIXEL_VIEWS, _VIEW_TIP)
    return (
        replace(display, exposure=exposure, tone_map=tone_map),
        replace(settings, samples=samples, technique=technique, view=view, cull=cull),
    )


def _cull_choice(cull: float) -> float:
    """Draw the list of how much light may be skipped; return the share of display white."""
    names = {share: f"up to {share_text(share)} of white" if share else "nothing"
             for share in (*CULL_SHARES, cull)}  # fmt: skip
    chosen = choice("Skip", names[cull], tuple(dict.fromkeys(names.values())), _CULL_TIP)
    return next(share for share, name in names.items() if name == chosen)
