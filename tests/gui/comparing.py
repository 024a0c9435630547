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
from tests.gui.application import Application

CTRL = imgui.Key.mod_ctrl


@contextmanager
def comparing(app: Application, **changes: object) -> Iterator[None]:
    """Compare ltc with ggx:4, four nodes an edge; in the end nothing is compared."""
    viewport = app.window.viewport
    before = viewport.settings
    viewport.settings = replace(before, technique="ltc", samples=1)
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
    viewport.settings = replace(before, technique=technique, samples=1)
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
        app.click("##fit range")
        assert comparison.form.automatic
        comparison.form = replace(comparison.form, measure="largest channel")
        app.settle()
        scale = comparison.scale
        assert (scale.view, scale.measure) == ("absolute", "largest channel")
        wanted = colours_of(values_of("absolute", a, b, "largest channel", 1.0), scale)
        seen = app.picture()
        assert np.abs(seen[above].astype(int) - wanted[above]).max() <= 1
        values = values_of("absolute", a, b, "largest channel", 1.0)
        assert (values > scale.high).mean() < 0.01
        assert values.max() > 0.2 * scale.high

        comparison.form = replace(comparison.form, show="relative")
        app.settle()
        summary = comparison.summary
        assert summary is not None
        floor = summary.numbers.floor
        wanted = colours_of(values_of("relative", a, b, "largest channel", floor), comparison.scale)
        assert np.abs(app.picture()[above].astype(int) - wanted[above]).max() <= 1

        comparison.form = replace(comparison.form, show="FLIP")
        app.settle()
        summary = comparison.summary
        assert summary is not None
        assert summary.flip is not None
        wanted = summary.flip
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
        assert wanted.noise == (None, None)
        # A random estimate knows how much of the difference is its own.
        form = comparison.form
        comparison.form = replace(form, against="reference", estimates=4)
        app.settle()
        assert comparison.picture.samples == (4, 4)
        found = comparison.summary.numbers
        assert found.noise[0] is None
        assert found.noise[1] is not None
        assert 0.3 * found.rmse < found.noise[1] < 3.0 * found.rmse
        comparison.form = form
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


def move_to(app: Application, x: float, y: float) -> None:
    def action(ctx) -> None:
        ctx.mouse_move_to_pos(imgui.ImVec2(x - 6.0, y))
        ctx.yield_(2)
        ctx.mouse_move_to_pos(imgui.ImVec2(x, y))
        ctx.yield_(2)

    app.act(action)
    app.frame()


def inspect_a_pixel(app: Application, out: Path) -> None:
    """The panel tells what is under the pointer, keeps it for copying, and follows a pin."""
    inspector, viewport = app.window.inspector, app.window.viewport
    with comparing(app, show="split"):
        app.act(lambda ctx: ctx.window_focus("//Inspector"))
        x, y = app.on_screen((0.3, 0.0, 1.0))
        move_to(app, x, y)
        app.settle()
        numbers = inspector.numbers
        assert numbers is not None
        assert numbers.hit is not None
        assert (numbers.hit.kind, numbers.hit.index) == ("object", 0)
        column, row = (int(at) for at in numbers.key.place)
        assert (column, row) == (int(x - viewport.view.x), int(y - viewport.view.y))
        a, b = both(app)
        assert numbers.radiance == tuple(tuple(p[row, column].tolist()) for p in (a, b))
        assert numbers.radiance[0] != numbers.radiance[1]
        assert min(numbers.evaluations) > 0
        # On the way to the button the pointer leaves the picture: the numbers stay.
        with copying() as copied:
            app.act(lambda ctx: ctx.item_click("//Inspector/###copy pixel"))
        lines = [line.split("\t") for line in copied[0].splitlines()]
        assert lines[0] == ["Object 'floor', material 'floor'"]
        table = {line[0]: line[1:] for line in lines}
        assert table["radiance"] == ["A ltc", "B ggx:4", "A − B"]
        assert table["red"][0] == f"{a[row, column, 0]:.6g}"
        assert table["blue"][1] == f"{b[row, column, 2]:.6g}"
        assert table["α x, y"] == ["0.09, 0.09"]
        eye = np.array(app.scene.camera.eye)
        away = eye - numbers.hit.position_ws
        theta = np.degrees(np.arccos(away[1] / np.linalg.norm(away)))
        assert abs(float(table["θ of the view"][0].rstrip("°")) - theta) < 0.01
        assert table["normal"] == ["0, 1, 0"]

        # A light has its radiance and no parts of an error.
        at = app.on_screen((-0.4, 1.1, -1.0))
        move_to(app, at[0] + 25.0, at[1] + 20.0)
        app.settle()
        assert inspector.numbers is not None
        assert inspector.numbers.hit is not None
        assert inspector.numbers.hit.kind == "light"
        assert np.allclose(inspector.numbers.radiance[0], app.scene.lights[0].radiance)

        # Ctrl+click pins the point: the pixel goes along with it.
        def pin(ctx) -> None:
            ctx.mouse_move_to_pos(imgui.ImVec2(x, y))
            ctx.key_down(CTRL)
            ctx.mouse_click(0)
            ctx.key_up(CTRL)

        selection = app.window.editor.selection
        app.act(pin)
        app.settle()
        assert app.window.lobe.is_pinned
        assert app.window.editor.selection == selection
        camera = app.scene.camera
        app.window.editor.look(replace(camera, eye=(0.4, 1.3, 4.4)))
        app.settle()
        app.frame()
        assert viewport.pin is not None
        assert np.linalg.norm(np.subtract(viewport.pin[0], numbers.hit.position_ws)) < 0.02
        moved, view = app.on_screen(viewport.pin[0]), viewport.view
        wanted = int(moved[0] - view.x) + 0.5, int(moved[1] - view.y) + 0.5
        assert inspector.numbers.key.place == wanted
        app.key(imgui.Key.p)
        assert not app.window.lobe.is_pinned
        app.window.editor.look(camera)


def parts_of_the_error(app: Application, out: Path) -> None:
    """For the pixel and for the view, while frames go on; the picture stays as it is."""
    inspector, viewport = app.window.inspector, app.window.viewport
    with comparing(app, show="off", points=4):
        picture = app.window.renderer.radiance()
        app.act(lambda ctx: ctx.window_focus("//Inspector"))
        move_to(app, *app.on_screen((0.3, 0.0, 1.0)))
        app.act(lambda ctx: ctx.item_click("//Inspector/###pixel parts"))
        app.until(lambda: not inspector.is_busy)
        app.frame()
        found = inspector.parts.result
        assert found is not None
        assert found.parts == ("Fresnel", "lobe", "table", "textures", "outline", "float32")
        assert found.exact.shape == (1, 3)
        assert np.abs(found.shares[-1]).max() < 1e-5
        app.act(lambda ctx: ctx.window_focus("//Compare"))
        app.act(lambda ctx: ctx.item_click("//Compare/###view parts"))
        work = viewport.comparison.parts
        assert not viewport.is_idle
        app.until(lambda: not work.is_busy)
        app.settle()
        assert work.result is not None
        assert work.result.exact.shape == (4, 3)
        assert work.is_of(viewport.picture)
        assert np.array_equal(app.window.renderer.radiance(), picture)
        app.window.renderer.ctx.screen.use()
        # Of another picture it is no longer; what is under way then is given up.
        app.act(lambda ctx: ctx.item_click("//Compare/###view parts"))
        app.window.editor.look(replace(app.scene.camera, eye=(0.2, 1.3, 4.4)))
        app.settle()
        assert not work.is_busy
        assert not work.is_of(viewport.picture)


SCENARIOS = (
    flip_between_two_techniques,
    drag_the_divider,
    differences_in_false_colours,
    numbers_of_the_view,
    comparing_costs_nothing_at_rest,
    inspect_a_pixel,
    parts_of_the_error,
)
