"""``ltc-viewer lobe``: a figure of GGX's lobe beside its transformed cosine."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

from app.cli.common import Steps, whole_number
from app.errors import InputError
from app.files import check_output, replace_file
from app.images import png_bytes
from app.lobe_figure import lobe_figure, lobe_sheet
from ltc.lobe import THETA_MAX, Case, LobePair, lobe_pair
from ltc.table import ALPHA_MIN

RATIOS = (1.0, 0.5, 0.25, 0.12, 0.06)
THETAS = (0.0, 30.0, 60.0, 75.0, 85.0)
"""Rows and columns of a sheet: the smaller alpha over the larger, theta in degrees."""

LARGEST_THETA = round(math.degrees(THETA_MAX), 2)


def lobe(
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="FILE.png", help="Picture to write.")
    ],
    alpha: Annotated[
        tuple[float, float],
        typer.Option("--alpha", metavar="X Y", help="GGX's alphas along tangent and bitangent."),
    ] = (0.4, 0.05),
    theta: Annotated[
        float, typer.Option("--theta", metavar="DEGREES", help="Angle between view and normal.")
    ] = 60.0,
    phi: Annotated[
        float, typer.Option("--phi", metavar="DEGREES", help="Azimuth of the view from x.")
    ] = 30.0,
    linear: Annotated[
        bool, typer.Option("--linear", help="Colours in proportion, not by powers of ten.")
    ] = False,
    grid: Annotated[
        bool,
        typer.Option(
            "--grid", help="A sheet of many: rows of smaller second alphas, columns of theta."
        ),
    ] = False,
    pixels: Annotated[
        int | None,
        typer.Option(
            "--pixels",
            metavar="N",
            help="Width of one picture of a lobe: 300, or 96 with --grid, unless given.",
            parser=whole_number("--pixels", 32, 2048),
            show_default=False,
        ),
    ] = None,
) -> None:
    """Draw GGX's lobe, its transformed cosine, and their difference.

    The disks show the hemisphere from above, equal solid angles as equal
    areas: x, the tangent, to the right, the normal in the middle, the horizon
    as the rim. A ring marks the view, a cross its mirror direction. Small lobes
    are shown a second time, larger. Equal alphas are looked up in the
    isotropic table, others in the anisotropic one.

    \b
    Examples:
      ltc-viewer lobe --alpha 0.05 0.4 --theta 60 --phi 30 -o lobe.png
      ltc-viewer lobe --grid --alpha 0.4 0.4 -o lobes.png
    """
    check_output(output, "a picture", (".png",))
    for name, value, low, high in (
        ("alpha", alpha[0], ALPHA_MIN, 1.0),
        ("alpha", alpha[1], ALPHA_MIN, 1.0),
        ("theta", theta, 0.0, LARGEST_THETA),
        ("phi", phi, -360.0, 360.0),
    ):
        if not low <= value <= high:
            raise InputError(
                f"--{name} is {value:g}, expected a number between {low:g} and {high:g}"
            )
    if grid:
        picture = lobe_sheet(_pairs(max(alpha), phi), pixels or 96, not linear)
    else:
        picture = lobe_figure(_pair(*alpha, theta, phi), pixels or 300, not linear)
    replace_file(output, png_bytes(picture), "a picture")
    typer.echo(output)


def _pair(alpha_x: float, alpha_y: float, theta: float, phi: float) -> LobePair:
    angle = min(math.radians(theta), float(THETA_MAX))
    return lobe_pair(Case(alpha_x, alpha_y, angle, math.radians(phi)))


def _pairs(alpha: float, phi: float) -> list[list[LobePair]]:
    """Return the pairs of a sheet, row by row."""
    rows: list[list[LobePair]] = []
    with Steps("looking up lobes", len(RATIOS)) as steps:
        for ratio in RATIOS:
            smaller = max(ratio * alpha, ALPHA_MIN)
            rows.append([_pair(alpha, smaller, theta, phi) for theta in THETAS])
            steps.done(len(rows))
    return rows
