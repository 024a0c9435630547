"""Scenarios of setting the techniques' errors against their times in the view."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
from PIL import Image

from app import edits
from app.gui import measuring as measuring_module
from tests.gui.application import Application

FEW = ("ltc", "ggx", "ggx:4", "reference:4", "reference:64", "representative-point")


@contextmanager
def fewer() -> Iterator[None]:
    """Measure fewer techniques, and those less often: a frame of the whole window takes long."""
    before = measuring_module.TECHNIQUES, measuring_module.REPEATS
    measuring_module.TECHNIQUES, measuring_module.REPEATS = FEW, 1  # type: ignore[misc]
    try:
        yield
    finally:
        measuring_module.TECHNIQUES, measuring_module.REPEATS = before  # type: ignore[misc]


def measure_the_techniques(app: Application, out: Path) -> None:
    """Bit by bit: no frame renders more than a picture, and the view stays as it is."""
    with fewer():
        _measure(app, out)


def _measure(app: Application, out: Path) -> None:
    window, measuring = app.window, app.window.measuring
    before, passes = app.picture(), window.renderer.lighting_passes
    held = window.renderer.allocated()
    app.act(lambda ctx: ctx.window_focus("//Performance"))
    app.click("###Measure")
    assert measuring.is_busy
    seen, frames = set(), 0

    def is_done() -> bool:
        nonlocal frames
        frames += 1
        shown = measuring.state(window.viewport.picture.shot)
        seen.add(shown.doing.split()[0] if shown.doing else "")
        return not measuring.is_busy

    app.until(is_done)
    assert {"timing", "integrating", "comparing"} <= seen
    assert frames > 4 * len(FEW), "one picture a frame, two of each technique"
    shot = window.viewport.picture.shot
    assert shot is not None
    state = measuring.state(shot)
    points = {point.name: point for point in state.points}
    assert set(points) == set(FEW)
    assert all(point.milliseconds > 0.0 for point in points.values())
    assert all(math.isfinite(point.error) for point in points.values())
    # Errors depend on no clock.
    assert points["ggx:4"].error < points["ggx"].error < points["ltc"].error < 0.01
    assert points["representative-point"].error > 5.0 * points["ltc"].error
    assert points["reference:64"].error < 0.5 * points["reference:4"].error
    assert points["ggx:4"].on_front
    assert "earlier" not in state.about
    app.settle()
    Image.fromarray(app.pixels()).save(out / "measured.png")
    # Nothing else has changed, and nothing is left of it.
    assert np.array_equal(app.picture(), before)
    assert window.renderer.lighting_passes == passes
    assert window.renderer.allocated() == held
    app.window.editor.apply("Dim", edits.replace_light(app.scene, 0, _dimmer(app)))
    app.settle()
    shot = window.viewport.picture.shot
    assert shot is not None
    assert measuring.state(shot).about.startswith("Of an earlier view.")
    app.act(lambda ctx: ctx.window_focus("//Light"))


def _dimmer(app: Application):
    return replace(app.scene.lights[0], radiance=(1.0, 1.0, 1.0))


def stop_measuring(app: Application, out: Path) -> None:
    """By its button, and by measuring again; what fails becomes a message."""
    window, measuring = app.window, app.window.measuring
    measuring.stop()
    app.act(lambda ctx: ctx.window_focus("//Performance"))
    app.click("###Measure")
    for _ in range(6):
        app.frame()
    assert measuring.is_busy
    app.click("###Stop measuring")
    assert not measuring.is_busy
    app.settle()
    shot = window.viewport.picture.shot
    assert shot is not None
    measuring.begin(window.renderer.ctx, shot, 0.0)
    measuring.begin(window.renderer.ctx, shot, 0.0)
    app.frame()
    assert measuring.is_busy

    def broken() -> None:
        raise RuntimeError("the driver gave up")

    measuring._work = (broken() for _ in range(1))  # type: ignore[assignment]
    app.frame()
    assert not measuring.is_busy
    assert any("the driver gave up" in message.text for message in window.messages.shown)
    window.messages.clear()
    app.act(lambda ctx: ctx.window_focus("//Light"))


SCENARIOS = (measure_the_techniques, stop_measuring)
