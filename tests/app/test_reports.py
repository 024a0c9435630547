"""What the panels of times and of the plan are given."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

from app.gui.reports import Reports
from app.render.plan import Plan
from app.scene import Camera, RenderSettings, Scene, Shot

SHOT = Shot(Scene(), RenderSettings(), 16, 9)
EMPTY = Plan("a plan", "", (), (), (), (), (), ())


def test_a_plan_is_made_anew_when_something_else_is_needed_and_only_then() -> None:
    planned: list[Shot] = []

    def plan(shot: Shot) -> Plan:
        planned.append(shot)
        return EMPTY

    renderer: Any = SimpleNamespace(
        plan=plan,
        timings=lambda wait: {"gbuffer": 0.5},
        ctx=SimpleNamespace(info={"GL_RENDERER": "none"}),
    )
    viewport: Any = SimpleNamespace(
        settings=RenderSettings(), picture=SimpleNamespace(history=[], samples=(1, 4))
    )
    reports = Reports()

    def report(shot: Shot) -> int:
        assert reports.times(shot, viewport, renderer).passes == (("G-buffer", 0.5),)
        assert reports.plan(shot, viewport, renderer).title == "a plan"
        return len(planned)

    assert report(SHOT) == 1
    assert report(SHOT) == 1
    moved = replace(SHOT, scene=replace(SHOT.scene, camera=Camera((0.0, 1.0, 9.0))))
    assert report(moved) == 1, "another view needs nothing else"
    assert report(replace(moved, width=32)) == 2
    viewport.settings = replace(viewport.settings, time=3.5)
    assert report(replace(moved, width=32)) == 2, "the next frame of a film needs nothing else"
    viewport.settings = replace(viewport.settings, technique="ggx")
    assert report(replace(moved, width=32)) == 3
    assert planned[-1].settings.technique == "ggx"
