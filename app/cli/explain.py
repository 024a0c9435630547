"""``ltc-viewer explain``: what the renderer does for a scene, and what it leaves out."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer

from app.cli.common import (
    DEFAULT_SIZE,
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
from app.render.techniques import AUTOMATIC, suited_technique
from app.scene import RenderSettings, Shot

if TYPE_CHECKING:
    from app.render.plan import Plan


def explain(
    scene: SceneArgument,
    size: SizeOption = DEFAULT_SIZE,
    samples: SamplesOption = 16,
    technique: TechniqueOption = AUTOMATIC,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of text.")] = False,
) -> None:
    """Say what is compiled, allocated, loaded and run for a scene, and what is left out and why.

    \b
    Example:
      ltc-viewer explain scene.json --size 1920x1080
    """
    width, height = image_size(size)
    suited_technique(technique, anisotropic=False)
    settings = RenderSettings(technique=technique, samples=samples)
    plan = _plan(Shot(named_scene(scene), settings, width, height))
    if as_json:
        typer.echo(json.dumps({**asdict(plan), "bytes": plan.bytes}, indent=2))
    else:
        typer.echo(plan.text(), nl=False)


def _plan(shot: Shot) -> Plan:
    """Plan for this machine's limits, or for those of every OpenGL 4.1 where there is no GL."""
    try:
        with headless_renderer() as (_, renderer):
            return renderer.plan(shot)
    except FailureError as error:
        from app.render.features import Limits
        from app.render.plan import make_plan
        from app.render.programs import shader_roots

        messages().print(f"Planned for the least that OpenGL 4.1 allows, because {error}")
        return make_plan(shot, Limits(), shader_roots())
