"""What the panels of times and of the plan show of the picture."""

from __future__ import annotations

from dataclasses import replace

from app.gui.viewport import Viewport
from app.panels.performance import Report
from app.panels.plan import PlanReport
from app.render.renderer import Renderer
from app.scene import Shot

PASS_NAMES = {
    "gbuffer": "G-buffer",
    "lighting": "Lighting",
    "display": "Display",
    "pictures": "Pictures",
    "cpu": "CPU, submitting",
}


class Reports:
    """Makes reports; plans again only when the picture needs something else."""

    def __init__(self) -> None:
        self._planned: Shot | None = None
        self._plan = PlanReport("", "", ())

    def times(self, shot: Shot, viewport: Viewport, renderer: Renderer) -> Report:
        """Return the times of the picture that shows ``shot``."""
        times = renderer.timings(wait=False).items()
        return Report(
            passes=tuple((PASS_NAMES.get(name, name), value) for name, value in times),
            history=tuple(viewport.picture.history),
            gpu=str(renderer.ctx.info["GL_RENDERER"]),
            size=(shot.width, shot.height),
            samples=viewport.picture.samples,
        )

    def plan(self, shot: Shot, viewport: Viewport, renderer: Renderer) -> PlanReport:
        """Return the plan of the picture that shows ``shot``."""
        wanted = replace(shot, settings=viewport.settings)
        if self._planned is None or _other_needs(self._planned, wanted):
            plan = renderer.plan(wanted)
            self._plan = PlanReport(plan.title, plan.summary(), plan.sections())
            self._planned = wanted
        return self._plan


def _other_needs(a: Shot, b: Shot) -> bool:
    """Tell whether a plan for ``a`` may not be true for ``b``."""
    # Every frame of a film is as large as the others.
    settings = replace(a.settings, time=b.settings.time)
    return (
        (a.width, a.height, settings) != (b.width, b.height, b.settings)
        or a.scene.lights is not b.scene.lights
        or a.scene.objects is not b.scene.objects
        or a.scene.materials is not b.scene.materials
        or a.scene.display != b.scene.display
    )
