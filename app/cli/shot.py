"""``ltc-viewer shot``: render a scene headless to a file."""

from __future__ import annotations

import math
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Annotated

import typer

from app.cli.common import (
    DEFAULT_SIZE,
    CullOption,
    SceneArgument,
    SizeOption,
    Steps,
    TechniqueOption,
    headless_renderer,
    image_size,
    messages,
    named_scene,
    whole_number,
)
from app.errors import InputError, expected_one_of
from app.images import check_image_path, save_image
from app.render.cost import WithLegend
from app.render.noise import Noise
from app.render.techniques import AUTOMATIC, TECHNIQUES, find_technique, suited_technique
from app.scene import MAX_SAMPLES, PIXEL_VIEWS, RenderSettings, Shot

if TYPE_CHECKING:
    import moderngl

    from app.render.renderer import Renderer

SAMPLES = 16
FIRST_LOOK = 16
"""Samples before the estimated error is trusted to stop."""
LOOK_AGAIN = 1.1
"""After this many times as many samples: the next look costs less than the samples between."""


def _share(value: str | float) -> float:
    """Read --until-error: a share of the mean, or a percentage."""
    text = str(value).strip()
    try:
        share = float(text[:-1]) / 100.0 if text.endswith("%") else float(text)
    except ValueError:
        share = math.nan
    if not 0.0 < share < 1.0:
        raise InputError(
            f"--until-error is '{value}', expected a share of the picture's mean between 0 and 1, "
            "such as 0.01 or 1%"
        )
    return share


def shot(
    scene: SceneArgument,
    output: Annotated[
        Path,
        typer.Option("--output", "-o", metavar="FILE", help="Picture to write: .png or .exr."),
    ],
    size: SizeOption = DEFAULT_SIZE,
    samples: Annotated[
        int | None,
        typer.Option(
            "--samples",
            metavar="N",
            help="Samples per pixel; 1 is exactly the pixel centre.",
            parser=whole_number("--samples", 1, MAX_SAMPLES),
            show_default=f"{SAMPLES}, or as many as --until-error takes",
        ),
    ] = None,
    technique: TechniqueOption = AUTOMATIC,
    until_error: Annotated[
        float | None,
        typer.Option(
            "--until-error",
            metavar="SHARE",
            help="Stop where the estimated error falls below this share of the picture's mean.",
            parser=_share,
        ),
    ] = None,
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

    Of techniques that sample at random stderr tells the time and the estimated
    error: the standard error of a pixel's reflected luminance, as a share of the
    mean. --until-error goes on until that is small enough.

    --cull leaves out lights that cannot be seen: a bound of what each may add is
    certified, and all that is skipped at a pixel adds up to no more than asked for.

    \b
    Example:
      ltc-viewer shot scene.json -o picture.png --size 1920x1080 --samples 64
    """
    width, height = image_size(size)
    suited_technique(technique, anisotropic=False)
    if until_error is not None:
        _check_noisy(technique, view)
    check_image_path(output)
    if view not in PIXEL_VIEWS:
        raise InputError(f"--view is '{view}', {expected_one_of(view, PIXEL_VIEWS)}")
    if samples is None:
        samples = SAMPLES if until_error is None else MAX_SAMPLES
    settings = RenderSettings(technique, samples, view, cull=cull, time=time)
    wanted = Shot(named_scene(scene, time), settings, width, height)
    with headless_renderer() as (ctx, renderer):
        start = perf_counter()
        done, noise = _gather(ctx, renderer, wanted, samples, until_error)
        if noise is not None:
            seconds = perf_counter() - start
            messages().print(
                f"{done} samples in {seconds:.1f} s, "
                f"estimated error {100.0 * noise.relative:.2g} % of the mean"
            )
        save_image(WithLegend(renderer) if view == "cost" else renderer, output)
    typer.echo(output)


def _check_noisy(technique: str, view: str) -> None:
    if technique == AUTOMATIC or not find_technique(technique).is_sampled or view == "cost":
        what = f"--view {view}" if view == "cost" else f"technique {technique}"
        sampled = " or ".join(name for name, known in TECHNIQUES.items() if known.is_sampled)
        raise InputError(
            f"--until-error: {what} has no noise that would fall, expected --technique {sampled}"
        )


def _gather(
    ctx: moderngl.Context, renderer: Renderer, wanted: Shot, samples: int, until: float | None
) -> tuple[int, Noise | None]:
    """Render up to ``samples``; return how many, and the noise that was estimated last, if any."""
    found: Noise | None = None
    look = FIRST_LOOK
    with Steps("rendering", samples) as steps:
        done = 0
        while done < samples:
            done = renderer.accumulate(wanted, samples)
            ctx.finish()
            steps.done(done)
            is_last = done >= samples - samples % 2
            if done % 2 == 0 and (is_last or (until is not None and done >= look)):
                found = renderer.noise()
                look = math.ceil(LOOK_AGAIN * done)
                if until is not None and (found is None or found.relative <= until):
                    break
    return done, found
