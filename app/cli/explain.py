"""``ltc-viewer explain``: what the renderer does for a scene, and what it leaves out."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Annotated

import typer

from app.cli.common import (
    DEFAULT_SIZE,
    CullOption,
    EverythingOption,
    FailureError,
    SamplesOption,
    SceneArgument,
    SizeOption,
    TechniqueOption,
    headless_renderer,
    image_size,
    messages,
    named_scene,
)
from app.render.features import Limits
from app.render.plan import make_plan
from app.render.plan_difference import difference_text
from app.render.programs import shader_roots
from app.render.techniques import AUTOMATIC, suited_technique
from app.scene import RenderSettings, Shot


def explain(
    scene: SceneArgument,
    size: SizeOption = DEFAULT_SIZE,
    samples: SamplesOption = 16,
    technique: TechniqueOption = AUTOMATIC,
    cull: CullOption = 0.0,
    everything: EverythingOption = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of text.")] = False,
) -> None:
    """Say what is compiled, allocated, loaded and run for a scene, and what is left out and why.

    --everything prints, side by side, what the scene needs and what one program for
    all scenes would take, with nothing left out: the same picture at a higher cost.

    \b
    Examples:
      ltc-viewer explain scene.json --size 1920x1080
      ltc-viewer explain scene.json --samples 1 --everything
    """
    width, height = image_size(size)
    suited_technique(technique, anisotropic=False)
    settings = RenderSettings(technique=technique, samples=samples, cull=cull)
    shot = Shot(named_scene(scene), settings, width, height)
    limits = _limits()
    plan = make_plan(shot, limits, shader_roots())
    full = make_plan(shot, limits, shader_roots(), everything=True) if everything else None
    if as_json:
        parts = {**asdict(plan), "bytes": plan.bytes}
        if full is not None:
            parts["everything"] = {**asdict(full), "bytes": full.bytes}
        typer.echo(json.dumps(parts, indent=2))
    elif full is not None:
        typer.echo(difference_text(plan, full), nl=False)
    else:
        typer.echo(plan.text(), nl=False)


def _limits() -> Limits:
    """Return this machine's limits, or those of every OpenGL 4.1 where there is no GL."""
    try:
        with headless_renderer() as (_, renderer):
            return renderer.limits
    except FailureError as error:
        messages().print(f"Planned for the least that OpenGL 4.1 allows, because {error}")
        return Limits()
