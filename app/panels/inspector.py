"""The panel of one pixel: what it shows, and its numbers on both sides of a comparison."""

from __future__ import annotations

from dataclasses import dataclass

from imgui_bundle import imgui

from app.panels.parts import Parts, parts_table
from app.panels.widgets import MUTED, button, heading, hint


@dataclass(frozen=True, slots=True)
class Pixel:
    """What the panel shows.

    Attributes
    ----------
    title : what is seen there
    note : where the pixel is, and how it was chosen
    sides : names of the columns of radiance
    radiance : (name, values by side): red, green, blue and luminance, linear Rec. 709
    facts : (name, text) of the surface
    parts : Parts or None
        Of the error of A at its middle; None where no surface is.
    """

    title: str
    note: str
    sides: tuple[str, ...]
    radiance: tuple[tuple[str, tuple[str, ...]], ...]
    facts: tuple[tuple[str, str], ...]
    parts: Parts | None

    def text(self) -> str:
        """Return everything as lines, columns by tabs."""
        lines = [self.title, self.note, "\t".join(("radiance", *self.sides))]
        lines += ["\t".join((name, *values)) for name, values in self.radiance]
        lines += ["\t".join(fact) for fact in self.facts]
        if self.parts is not None and self.parts.rows:
            lines.append("\t".join(("part of the error", *self.parts.heads)))
            lines += ["\t".join((row.name, *row.cells)) for row in self.parts.rows]
        return "\n".join(lines)


def inspector_panel(pixel: Pixel | None, pin_key: str) -> bool:
    """Draw the panel; return whether the parts of the error were asked for, or given up."""
    if pixel is None:
        hint(
            f"Point at the picture to see a pixel's numbers. {pin_key} or Ctrl+click on a surface "
            "pins its point."
        )
        return False
    imgui.text_wrapped(pixel.title)
    hint(pixel.note)
    if button("Copy###copy pixel", "Copy everything here as lines of text, columns by tabs"):
        imgui.set_clipboard_text(pixel.text())
    heading("Radiance")
    flags = imgui.TableFlags_.row_bg | imgui.TableFlags_.sizing_stretch_prop
    if imgui.begin_table("radiance", 1 + len(pixel.sides), flags):
        for head in ("", *pixel.sides):
            imgui.table_setup_column(head)
        imgui.table_headers_row()
        for name, values in pixel.radiance:
            imgui.table_next_row()
            for cell in (name, *values):
                imgui.table_next_column()
                imgui.text(cell)
        imgui.end_table()
    if pixel.facts:
        heading("Surface")
        if imgui.begin_table("surface", 2, flags):
            for name, text in pixel.facts:
                imgui.table_next_row()
                imgui.table_next_column()
                imgui.text_colored(MUTED, name)
                imgui.table_next_column()
                imgui.text(text)
            imgui.end_table()
    return pixel.parts is not None and parts_table(pixel.parts, "pixel parts", "Find")
