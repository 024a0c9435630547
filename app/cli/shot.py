"""``ltc-viewer shot``: render a scene headless to a file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from app.cli.common import (
    DEFAULT_SIZE,
    CullOption,
    SamplesOption,
    SceneArgument,
    SizeOption,
    Steps,
    TechniqueOption,
    headless_renderer,
    image_size,
    named_scene,
)
from app.errors import InputError, expected_one_of
from app.images import check_image_path, save_image
from app.render.cost import WithLegend
from app.render.techniques import AUTOMATIC, suited_technique
from app.scene import PIXEL_VIEWS, RenderSettings, Shot


def shot(
    scene: SceneArgument,
    output: Annotated[
        Path,
        typer.Option("--output", "-o", metavar="FILE", help="Picture to write: .png or .exr."),
    ],
    size: SizeOption = DEFAULT_SIZE,
    samples: SamplesOption = 16,
    technique: TechniqueOption = AUTOMATIC,
    cull: CullOption = 0.0,
    view: Annotated[
        str,
        typer.Option(
            "--view",
            metavar="VIEW",
            help=f"What pixels show: {' or '.join(PIXEL_VIEWS)}.",
        ),
    ] = "radiance",
    time: Annotated[
        float,
        typer.Option("--time", metavar="SECONDS", help="Moment that animated pictures show."),
    ] = 0.0,
) -> None:
    """Render a scene to a picture, without a window.

    A .png holds the display colours, an .exr the linear radiance in float32.
    The file appears only once it is complete; its name goes to stdout.

    --view cost shows how often each pixel evaluated the contour integral, as
    colours with a legend in a .png, as numbers in an .exr.

    --cull leaves out lights that cannot be seen: a bound of what each may add is
    certified, and all that is skipped at a pixel adds up to no more than asked for.

    \b
    Example:
      ltc-viewer shot scene.json -o picture.png --size 1920x1080 --samples 64
    """
    width, height = image_size(size)
    suited_technique(technique, anisotropic=False)
    check_image_path(output)
    if view not in PIXEL_VIEWS:
        raise InputError(f"--view is '{view}', {expected_one_of(view, PIXEL_VIEWS)}")
    settings = RenderSettings(technique, samples, view, cull=cull, time=time)
    wanted = Shot(named_scene(scene, time), settings, width, height)
    with headless_renderer() as (ctx, renderer):
        with Steps("rendering", samples) as steps:
            while (done := renderer.accumulate(wanted, samples)) < samples:
                ctx.finish()
                steps.done(done)
        save_image(WithLegend(renderer) if view == "cost" else renderer, output)
    typer.echo(output)
