"""What the performance panel shows: the renderer's times, and its plan in lines."""

from __future__ import annotations

from dataclasses import replace

from app.gui.viewport import Viewport
from app.panels.performance import PlanLine, Report
from app.render.plan import Plan
from app.render.renderer import Renderer
from app.scene import Shot

PASS_NAMES = {
    "gbuffer": "G-buffer",
    "lighting": "Lighting",
    "display": "Display",
    "cpu": "CPU, submitting",
}


class Reports:
    """Makes reports; plans again only when the picture needs something else."""

    def __init__(self) -> None:
        self._planned: Shot | None = None
        self._plan: tuple[PlanLine, ...] = ()

    def of(self, shot: Shot, viewport: Viewport, renderer: Renderer) -> Report:
        """Return the report on the picture that shows ``shot``."""
        wanted = replace(shot, settings=viewport.settings)
        if self._planned is None or _other_needs(self._planned, wanted):
            self._planned = wanted
            self._plan = plan_lines(renderer.plan(wanted))
        times = renderer.timings(wait=False).items()
        return Report(
            passes=tuple((PASS_NAMES.get(name, name), value) for name, value in times),
            history=tuple(viewport.picture.history),
            gpu=str(renderer.ctx.info["GL_RENDERER"]),
            size=(shot.width, shot.height),
            samples=viewport.picture.samples,
            plan=self._plan,
        )


def plan_lines(plan: Plan) -> tuple[PlanLine, ...]:
    """Return a plan as lines: programs, memory, and what is left out."""
    lines = [
        PlanLine("Programs", program.name, f"{program.lines} lines") for program in plan.programs
    ]
    lines += [
        PlanLine(kind, resource.name, f"{resource.bytes / 1024.0:,.0f} KB")
        for kind, resources in (
            ("Attachments", plan.attachments),
            ("Tables", plan.tables),
            ("Buffers", plan.buffers),
        )
        for resource in resources
    ]
    lines += [PlanLine("Left out", left.what, left.why, used=False) for left in plan.left_out]
    return tuple(lines)


def _other_needs(a: Shot, b: Shot) -> bool:
    """Tell whether a plan for ``a`` may not be true for ``b``."""
    return (
        (a.width, a.height, a.settings) != (b.width, b.height, b.settings)
        or a.scene.lights is not b.scene.lights
        or a.scene.objects is not b.scene.objects
        or a.scene.materials is not b.scene.materials
    )
