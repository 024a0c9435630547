"""The part of a light's panel that shows what its outline was made from: text or a drawing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from imgui_bundle import ImVec2, imgui

from app.errors import InputError
from app.panels.widgets import (
    MUTED,
    button,
    choice,
    half_width,
    heading,
    hint,
    label,
    slider,
    tooltip,
)
from app.scene import TEXT_ALIGNS, AreaLight, OutlineSource, SvgSource, TextSource
from app.sources import remade, resized

TEXT_LINES = 3
"""Lines of text to be seen at once; more scroll."""

SIZES = (0.01, 100.0)
"""Bounds of the sliders for sizes, in units of the light's plane."""


def source_rows(
    light: AreaLight, ask_file: Callable[[], None], focus: bool = False
) -> tuple[AreaLight, InputError | None]:
    """Draw the rows of a light's source and return the light, made again if the source changed.

    Parameters
    ----------
    ask_file : callable
        Asks for another font or drawing.
    focus : bool
        Put the keyboard into the text.

    Returns
    -------
    light : AreaLight
        As it was if it cannot be made from the new source.
    failure : InputError or None
        Why it cannot.
    """
    source, again = light.source, False
    if source is None:
        return light, None
    new: OutlineSource
    if isinstance(source, TextSource):
        new = _text_rows(source, ask_file, focus)
    else:
        new, again = _drawing_rows(source, ask_file)
    kind = "text" if isinstance(source, TextSource) else "drawing"
    hint(f"Editing the shape itself makes it a shape like any other, without the {kind}.")
    if isinstance(new, TextSource) and not new.text.strip():
        return light, None  # on the way to another text
    if again or new != source:
        if not again and new == replace(source, size=new.size):
            return resized(light, new.size), None
        try:
            return remade(light, new), None
        except InputError as failure:
            return light, failure
    return light, None


def _text_rows(source: TextSource, ask_file: Callable[[], None], focus: bool) -> TextSource:
    heading("Text")
    if focus:
        imgui.set_keyboard_focus_here()
    height = TEXT_LINES * imgui.get_text_line_height() + 2.0 * imgui.get_style().frame_padding.y
    _, text = imgui.input_text_multiline("##text", source.text, ImVec2(-1.0, height))
    tooltip("What the light spells; Enter begins another line")
    font = source.font
    if _file_row("Font", font, "The program's own", "font", ask_file) and font:
        font = ""
    size = slider(
        "Size", source.size, *SIZES, "%.3f", "Height of the em, in units of the light's plane",
        logarithmic=True,
    )  # fmt: skip
    align = choice("Align", source.align, TEXT_ALIGNS, "How lines of unequal length are placed")
    spacing = slider(
        "Spacing", source.spacing, -0.2, 1.0, "%.3f em", "What is added between letters, in ems"
    )
    line_height = slider(
        "Line height", source.line_height, 0.5, 3.0, "%.2f em", "From line to line, in ems"
    )
    # Ctrl+Enter and pasted text may carry the line ends of other systems.
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    return replace(
        source, text=text, font=font, size=size, align=align, spacing=spacing,
        line_height=line_height,
    )  # fmt: skip


def _drawing_rows(source: SvgSource, ask_file: Callable[[], None]) -> tuple[SvgSource, bool]:
    heading("Drawing")
    again = _file_row("File", source.path, "", "drawing", ask_file)
    size = slider(
        "Size", source.size, *SIZES, "%.3f", "Longer side, in units of the light's plane",
        logarithmic=True,
    )  # fmt: skip
    return replace(source, size=size), again


def _file_row(text: str, path: str, without: str, kind: str, ask_file: Callable[[], None]) -> bool:
    """Draw a file's name and two buttons; tell whether the second one was pressed.

    The second one takes back the font, or reads the drawing again.
    """
    label(text, path or without)
    imgui.text_colored(MUTED, Path(path).name if path else without)
    tooltip(path)
    width = half_width()
    if button(f"Choose…###choose {kind}", f"Choose another {kind}", width=width):
        ask_file()
    imgui.same_line()
    if kind == "font":
        return button("Own font", "Use the program's own font", enabled=bool(path), width=width)
    return button("Reload", "Read the file again", width=width)
