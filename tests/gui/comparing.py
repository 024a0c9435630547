"""Scenarios of comparing the picture with another technique's, and of asking its pixels."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
from imgui_bundle import imgui

from app.colour_maps import BERLIN, MAGMA
from app.panels.compare import Comparing
from app.render.difference import Scale, colours_of, numbers, values_of
from app.render.flip import flip
from tests.gui.application import Application


@contextmanager
def comparing(app: Application, **changes: object) -> Iterator[None]:
    """Compare ltc with ggx:4, four nodes an edge; in the end nothing is compared."""
    viewport = app.window.viewport
    before = viewport.settings
    viewport.settings = replace(before, technique="ltc")
    viewport.comparison.form = replace(Comparing(against="ggx:4"), **changes)  # type: ignore[arg-type]
    try:
        app.settle()
        yield
    finally:
        viewport.comparison.form = Comparing()
        viewport.settings = before
        app.act(lambda ctx: ctx.window_focus("//Light"))
        app.settle()


@contextmanager
def copying() -> Iterator[list[str]]:
    """Gather what goes to the clipboard, which a window without a display does not have."""
    copied: list[str] = []
    before = imgui.set_clipboard_text
    imgui.set_clipboard_text = copied.append
    try:
        yield copied
    finally:
        imgui.set_clipboard_text = before


def choose(app: Application, row: str, option: str) -> None:
    """Choose in a list of the Compare panel."""
    app.act(lambda ctx: ctx.window_focus("//Compare"))
    app.act(lambda ctx: ctx.item_click(f"//Compare/{row}"))
    app.act(lambda ctx: ctx.item_click(f"//$FOCUSED/{option}"))
    app.settle()


def both(app: Application) -> tuple[np.ndarray, np.ndarray]:
    """Return A's and B's radiance."""
    other = app.window.viewport.comparison.renderer
    assert other is not None
    pictures = app.window.renderer.radiance(), other.radiance()
    app.window.renderer.ctx.screen.use()
    return pictures


def alone(app: Application, technique: str) -> np.ndarray:
    """Return the picture of a technique without any comparison."""
    viewport = app.window.viewport
    before = viewport.settings
    viewport.settings = replace(before, technique=technique)
    picture = app.picture()
    viewport.settings = before
    return picture


def flip_between_two_techniques(app: Application, out: Path) -> None:
    """X shows B, X again A, C ends it; neither costs anything afterwards."""
    a, b = alone(app, "ltc"), alone(app, "ggx:4")
    assert not np.array_equal(a, b)
    comparison = app.window.viewport.comparison
    assert comparison.renderer is None
    with comparing(app, show="off"):
        app.key(imgui.Key.x)
        assert comparison.form.show == "B"
        # Below the names.
        assert np.array_equal(app.picture()[50:], b[50:])
        app.key(imgui.Key.x)
        assert comparison.form.show == "A"
        assert np.array_equal(app.picture()[50:], a[50:])
        app.key(imgui.Key.c)
        assert not comparison.is_on
        assert np.array_equal(app.picture(), a)
        assert comparison.renderer is None, "B is gone"


def drag_the_divider(app: Application, out: Path) -> None:
    a, b = alone(app, "ltc"), alone(app, "ggx:4")
    app.click("###compare")
    comparison = app.window.viewport.comparison
    assert comparison.form.show == "split"
    with comparing(app, show="split"):
        view = app.window.viewport.view
        middle = view.x + 0.5 * view.width
        cursors = []

        def drag(ctx) -> None:
            ctx.mouse_move_to_pos(imgui.ImVec2(middle, view.y + 0.8 * view.height))
            ctx.yield_(2)
            cursors.append(imgui.get_mouse_cursor())
            ctx.mouse_drag_with_delta(imgui.ImVec2(-0.25 * view.width, 30.0))

        camera = app.scene.camera
        app.act(drag)
        assert cursors == [imgui.MouseCursor_.resize_ew]
        assert app.scene.camera == camera, "the divider moves, not the camera"
        assert abs(comparison.form.divider - 0.25) < 0.01
        seen = app.picture()
        line = round(comparison.form.divider * view.width)
        rows = slice(50, round(0.5 * view.height) - 20)
        assert np.array_equal(seen[rows, : line - 3], a[rows, : line - 3])
        assert np.array_equal(seen[rows, line + 4 :], b[rows, line + 4 :])
        assert (seen[rows, line].min(-1) > 150).all(), "there is a line"
        # Beyond the picture's edge it stops.
        x = view.x + comparison.form.divider * view.width
        app.drag_at(x, view.y + 0.8 * view.height, -view.width, 0.0)
        assert comparison.form.divider == 0.0


def differences_in_false_colours(app: Application, out: Path) -> None:
    with comparing(app, show="signed", automatic=False, high=0.05):
        comparison = app.window.viewport.comparison
        a, b = both(app)
        signed = app.picture()
        wanted = colours_of(values_of("signed", a, b, "luminance", 1.0), Scale("signed", 0.05))
        # Above the legend and the line of help.
        above = slice(0, -120)
        assert np.abs(signed[above].astype(int) - wanted[above]).max() <= 1
        legend = app.pixels()[-200:].reshape(-1, 3)
        for colour in (BERLIN[0], BERLIN[-1]):
            assert np.abs(legend - np.array(colour, float)).max(axis=1).min() <= 8.0

        choose(app, "##show", "absolute")
        choose(app, "##of", "largest channel")
        app.click("##fit range")
        app.settle()
        scale = comparison.scale
        assert (scale.view, scale.measure) == ("absolute", "largest channel")
        wanted = colours_of(values_of("absolute", a, b, "largest channel", 1.0), scale)
        seen = app.picture()
        assert np.abs(seen[above].astype(int) - wanted[above]).max() <= 1
        values = values_of("absolute", a, b, "largest channel", 1.0)
        assert (values > scale.high).mean() < 0.01
        assert values.max() > 0.2 * scale.high

        choose(app, "##show", "relative")
        summary = comparison.summary
        assert summary is not None
        floor = summary.numbers.floor
        wanted = colours_of(values_of("relative", a, b, "largest channel", floor), comparison.scale)
        assert np.abs(app.picture()[above].astype(int) - wanted[above]).max() <= 1

        choose(app, "##show", "FLIP")
        summary = comparison.summary
        assert summary is not None
        assert summary.flip is not None
        other = comparison.renderer
        assert other is not None
        wanted = flip(app.window.renderer.display(), other.display())
        app.window.renderer.ctx.screen.use()
        assert np.allclose(summary.flip, wanted)
        assert 0.0 < wanted.max() < 1.0
        colours = colours_of(wanted, Scale("flip", 1.0))
        assert np.abs(app.picture()[above].astype(int) - colours[above]).max() <= 1
        assert tuple(colours[0, 0]) == MAGMA[0]


def numbers_of_the_view(app: Application, out: Path) -> None:
    with comparing(app, show="split"):
        comparison = app.window.viewport.comparison
        summary = comparison.summary
        assert summary is not None
        assert comparison.is_summed
        wanted = numbers(*both(app), "luminance", app.scene.lights)
        assert summary.numbers == wanted
        assert wanted.mean > 0.0
        with copying() as copied:
            app.act(lambda ctx: ctx.window_focus("//Compare"))
            app.act(lambda ctx: ctx.item_click("//Compare/###copy numbers"))
        lines = copied[0].splitlines()
        assert lines[0] == "ltc compared with ggx:4"
        assert lines[1].split("\t")[:2] == ["mean", f"{wanted.mean:.3g}"]
        # An edit makes them old, then they are renewed.
        app.window.editor.apply("Turn off", replace(app.scene, lights=()))
        app.frame()
        assert not comparison.is_summed
        app.settle()
        assert comparison.summary.numbers.max == 0.0


def comparing_costs_nothing_at_rest(app: Application, out: Path) -> None:
    """No pass runs while nothing changes, and the divider renders nothing."""
    with comparing(app, show="split"):
        comparison = app.window.viewport.comparison
        other = comparison.renderer
        assert other is not None
        settled = app.window.renderer.lighting_passes, other.lighting_passes
        drawn = comparison.summary
        for _ in range(5):
            app.frame()
        view = app.window.viewport.view
        app.drag_at(view.x + 0.5 * view.width, view.y + 0.8 * view.height, 40.0, 0.0)
        app.settle()
        assert (app.window.renderer.lighting_passes, other.lighting_passes) == settled
        assert comparison.summary is drawn
        # Both see an edit, and both stop again.
        app.drag("vertex 0.2", 20.0, -10.0)
        app.settle()
        now = app.window.renderer.lighting_passes, other.lighting_passes
        assert all(after > before for after, before in zip(now, settled, strict=True))
        a, b = both(app)
        assert a.shape == b.shape
        assert app.window.viewport.picture.samples[0] == comparison.picture.samples[0]


SCENARIOS = (
    flip_between_two_techniques,
    drag_the_divider,
    differences_in_false_colours,
    numbers_of_the_view,
    comparing_costs_nothing_at_rest,
)
