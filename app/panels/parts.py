"""The table of an error's parts, and the button that asks for it."""

from __future__ import annotations

from dataclasses import dataclass

from imgui_bundle import imgui

from app.panels.widgets import button, heading, hint, tooltip

WHAT = {
    "Fresnel": "Schlick's term leaves the integral: its directional albedo takes its place",
    "lobe": "GGX becomes the linearly transformed cosine that suits the view best",
    "table": "That lobe is read from the table, between its nodes",
    "textures": "The table is read as the GPU samples it, bilinearly",
    "horizon": "Light below the surface is not cut off, or what is cut off is not made up for",
    "outline": "Curves are integrated by quadrature or as edges; edges exactly",
    "float32": "Single precision",
    "outline and float32": "Quadrature of curves, and single precision",
    "quadrature": "The mean of GGX's weight over the light, by a few nodes an edge",
    "quadrature and float32": "The mean of GGX's weight over the light, and single precision",
    "technique": "All that the technique approximates",
}
"""What the steps are; `app.render.breakdown` defines them."""


@dataclass(frozen=True, slots=True)
class PartRow:
    """A part's name, and texts under the table's heads."""

    name: str
    cells: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Parts:
    """What is known of an error's parts.

    Attributes
    ----------
    about : str
        What the error is of.
    heads : columns besides the name
    rows : tuple of PartRow
        Empty until asked for.
    is_current : bool
        Whether they belong to the picture as it is.
    progress : str
        What is being done about them, empty if nothing is.
    refusal : str
        Why they cannot be asked for, empty if they can.
    """

    about: str = ""
    heads: tuple[str, ...] = ()
    rows: tuple[PartRow, ...] = ()
    is_current: bool = True
    progress: str = ""
    refusal: str = ""


def parts_table(parts: Parts, identity: str, asks: str) -> bool:
    """Draw the group; return whether the button, which says ``asks``, was pressed."""
    heading("Parts of the error")
    if parts.progress:
        hint(parts.progress)
        return button(f"Stop###{identity}", "Give up")
    pressed = button(
        f"{asks}###{identity}",
        parts.refusal or "Compute in float64 what each approximation adds to the error of A",
        enabled=not parts.refusal,
    )
    if not parts.rows:
        return pressed
    hint(parts.about)
    imgui.begin_disabled(not parts.is_current)
    flags = imgui.TableFlags_.row_bg | imgui.TableFlags_.sizing_stretch_prop
    if imgui.begin_table(identity, 1 + len(parts.heads), flags):
        for head in ("", *parts.heads):
            imgui.table_setup_column(head)
        imgui.table_headers_row()
        for row in parts.rows:
            imgui.table_next_row()
            imgui.table_next_column()
            imgui.text(row.name)
            tooltip(WHAT.get(row.name, ""))
            for cell in row.cells:
                imgui.table_next_column()
                imgui.text(cell)
        imgui.end_table()
    imgui.end_disabled()
    return pressed
