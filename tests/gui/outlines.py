"""Scenarios of curved outlines: anchors and handles, presets, text, drawings, fonts."""

from __future__ import annotations

# isort: off
import imgui_bundle  # noqa: F401  (first: glfw then takes the library that imgui-bundle carries)
# isort: on

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from imgui_bundle import imgui

from app import contours, lights, planes, presets
from app.editor import Selection
from app.scene import BezierContour, Outline, SvgSource, TextSource
from ltc.resources import resource_path
from tests.gui.application import Application

CTRL, SHIFT, ALT = imgui.Key.mod_ctrl, imgui.Key.mod_shift, imgui.Key.mod_alt
HEART = presets.heart(1.6)
FONT = resource_path("assets", "fonts", "SourceSans3-Bold.otf")
DRAWING = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 20 10">'
    '<rect width="20" height="10"/><circle cx="30" cy="5" r="5"/></svg>'
)


def show(app: Application, outline: Outline) -> None:
    """Show one light alone, selected: with nothing to shine on, frames cost little."""
    light = replace(app.scene.lights[0], outline=outline)
    app.window.show(replace(app.scene, objects=(), lights=(light,)), None)
    app.window.viewport.settings = replace(app.window.viewport.settings, samples=1)
    app.window.editor.selection = Selection.light(0)
    app.frame()


def heart(app: Application) -> BezierContour:
    contour = app.scene.lights[0].outline.contours[0]
    assert isinstance(contour, BezierContour)
    return contour


def steps(app: Application) -> tuple[str, ...]:
    return app.window.editor.steps[1:]


def undo_all(app: Application) -> None:
    app.act(lambda ctx: ctx.mouse_move("//**/###frame"))
    app.key(CTRL | imgui.Key.z)
    while app.window.editor.undo_name is not None:
        app.window.editor.undo()
    app.frame()


def pressed_at(app: Application, segment: int, along: float, press: Callable) -> None:
    """Do something with the pointer on the outline of the first light."""
    light = app.scene.lights[0]
    place = lights.point_along(light, 0, segment, along)
    x, y = app.on_screen(planes.point_on(light.plane, place))

    def action(ctx) -> None:
        ctx.mouse_move_to_pos(imgui.ImVec2(x, y))
        ctx.yield_(2)
        press(ctx)

    app.act(action)


def menu_of(app: Application, item: str, choice: str) -> None:
    """Choose from the menu of an anchor or a handle."""

    def action(ctx) -> None:
        ctx.item_click(f"//**/{item}", 1)
        ctx.item_click(f"//$FOCUSED/{choice}")

    app.act(action)


def menu_on_curve(app: Application, segment: int, along: float, choice: str) -> None:
    """Choose from the menu of a place on the outline."""

    def press(ctx) -> None:
        ctx.mouse_click(1)
        ctx.item_click(f"//$FOCUSED/{choice}")

    pressed_at(app, segment, along, press)


def drag_an_anchor(app: Application, out: Path) -> None:
    show(app, HEART)
    before, old = app.scene, heart(app)
    x, y = app.corner((0, 1))
    app.drag("vertex 0.1", 40.0, -25.0)
    new = heart(app)
    assert np.allclose(app.corner((0, 1)), (x + 40.0, y - 25.0), atol=1.0)
    shift = np.subtract(new.anchors[1], old.anchors[1])
    for segment, which in ((1, 1), (0, 2)):
        moved = np.subtract(new.curves[segment][which], old.curves[segment][which])
        assert np.allclose(moved, shift, atol=1e-12)
    assert new.curves[2:5] == old.curves[2:5]
    assert new.kinds == old.kinds
    assert steps(app) == ("Move anchor of 'key'",)
    assert app.window.editor.selection == Selection.light(0, (0, 1))
    app.key(CTRL | imgui.Key.z)
    assert app.scene == before
    app.key(CTRL | imgui.Key.y)
    assert heart(app) == new


def drag_handles_of_each_kind(app: Application, out: Path) -> None:
    show(app, HEART)
    before = app.scene
    app.click("vertex 0.1")
    for key, kind in ((imgui.Key.y, "symmetric"), (imgui.Key.s, "smooth"), (imgui.Key.c, "corner")):
        app.key(SHIFT | key)
        old = heart(app)
        assert contours.kinds_of(old)[1] == kind
        app.drag("handle 0.1.1", 30.0, 12.0)
        new = heart(app)
        assert contours.kinds_of(new)[1] == kind
        assert new.curves[1][1] != old.curves[1][1]
        anchor = np.array(new.anchors[1])
        out_, into = np.array(new.curves[1][1]) - anchor, np.array(new.curves[0][2]) - anchor
        if kind == "corner":
            assert new.curves[0] == old.curves[0]
            continue
        assert abs(np.cross(out_, into)) < 1e-9, "in line"
        length = np.linalg.norm(out_ if kind == "symmetric" else old.curves[0][2] - anchor)
        assert np.isclose(np.linalg.norm(into), length)
    assert steps(app).count("Move handle of 'key'") == 3

    app.key(SHIFT | imgui.Key.s)
    old = heart(app)

    def with_alt(ctx) -> None:
        ctx.mouse_move("//**/handle 0.0.2")
        ctx.key_down(ALT)
        ctx.mouse_drag_with_delta(imgui.ImVec2(-20.0, 15.0))
        ctx.key_up(ALT)

    app.act(with_alt)
    assert contours.kinds_of(heart(app))[1] == "corner", "Alt breaks"
    assert heart(app).curves[1] == old.curves[1]
    menu_of(app, "handle 0.1.1", "Retract handle")
    assert heart(app).curves[1][1] == heart(app).anchors[1]

    def with_shift(ctx) -> None:
        ctx.mouse_move("//**/vertex 0.1")
        ctx.key_down(SHIFT)
        ctx.mouse_drag_with_delta(imgui.ImVec2(25.0, -15.0))
        ctx.key_up(SHIFT)

    retracted = heart(app)
    app.act(with_shift)
    assert heart(app).anchors == retracted.anchors
    assert heart(app).curves[1][1] != heart(app).anchors[1], "Shift pulls it out"
    undo_all(app)
    assert app.scene == before


def insert_and_remove_on_a_curve(app: Application, out: Path) -> None:
    show(app, HEART)
    before, old = app.scene, heart(app)
    pressed_at(app, 0, 0.4, lambda ctx: ctx.mouse_double_click(0))
    grown = heart(app)
    assert len(grown.curves) == 7
    assert app.window.editor.selection.vertex == (0, 1)
    samples = contours.flatten(grown, 1e-3)
    assert max(contours.nearest(old, (s, t))[0] for s, t in samples) < 1e-12
    app.key(imgui.Key.delete)
    assert np.allclose(heart(app).curves, old.curves, atol=1e-9)
    assert steps(app) == ("Add anchor to 'key'", "Remove anchor of 'key'")
    menu_on_curve(app, 5, 0.6, "Add point here")
    assert len(heart(app).curves) == 7
    menu_of(app, "vertex 0.6", "Remove anchor")
    assert len(heart(app).curves) == 6
    app.drag("edge 0.0", 0.0, 30.0)
    assert len(heart(app).curves) == 7
    assert steps(app)[-1] == "Add anchor to 'key'"
    undo_all(app)
    assert app.scene == before


def lines_kinds_and_splits_by_menu(app: Application, out: Path) -> None:
    show(app, HEART)
    before = app.scene
    menu_on_curve(app, 0, 0.5, "Make line")
    assert contours.straight_segments(heart(app)).tolist() == [True] + 5 * [False]
    menu_on_curve(app, 0, 0.5, "Make curve")
    assert not contours.straight_segments(heart(app)).any()
    menu_of(app, "vertex 0.0", "Symmetric")
    assert heart(app).kinds[0] == "symmetric"
    app.key(SHIFT | imgui.Key.r)
    assert app.window.editor.steps[-1] == "Reverse 'key'"
    app.click("vertex 0.0")
    menu_of(app, "vertex 0.3", "Split outline from selected point")
    assert len(app.scene.lights[0].outline.contours) == 2
    menu_of(app, "vertex 1.1", "Remove outline")
    assert len(app.scene.lights[0].outline.contours) == 1
    assert [name.split()[0] for name in steps(app)] == [
        "Straighten", "Bend", "Make", "Reverse", "Split", "Remove",
    ]  # fmt: skip
    undo_all(app)
    assert app.scene == before


def convert_and_mix(app: Application, out: Path) -> None:
    """A polygon gets a round hole, becomes curves by smoothing a corner, and a polygon again."""
    show(app, app.scene.lights[0].outline)
    before = app.scene
    app.click("###add hole")
    app.click("Round hole")
    own = app.scene.lights[0].outline.contours
    assert isinstance(own[1], BezierContour)
    app.click("vertex 0.2")
    app.act(lambda ctx: ctx.item_click("//Light/light key/##kind"))
    app.act(lambda ctx: ctx.item_click("//$FOCUSED/smooth"))
    assert heart(app).kinds[2] == "smooth"
    app.click("###convert")
    app.click("To polygon, coarse")
    assert not lights.is_curved(app.scene.lights[0])
    app.click("###convert")
    app.click("To curves")
    assert all(isinstance(c, BezierContour) for c in app.scene.lights[0].outline.contours)
    assert len(steps(app)) == 4
    undo_all(app)
    assert app.scene == before


def presets_from_the_menu(app: Application, out: Path) -> None:
    show(app, app.scene.lights[0].outline)
    before = app.scene
    for name in ("Heart", "Ring"):
        app.click("###add light")
        app.click(name)
    assert [light.name for light in app.scene.lights] == ["key", "heart", "ring"]
    assert app.window.editor.selection == Selection.light(2)
    assert steps(app) == ("Add light 'heart'", "Add light 'ring'")
    undo_all(app)
    assert app.scene == before


def type_a_text(app: Application, out: Path) -> None:
    show(app, app.scene.lights[0].outline)
    before = app.scene
    app.click("###add light")
    app.click("###new text")
    app.frame()

    def typed(text: str) -> None:
        def action(ctx) -> None:
            # Text of several lines is a window of its own, in which the item is not found.
            field = ctx.item_info("//Light/light text/##text").rect_full
            ctx.mouse_move_to_pos(field.get_center())
            ctx.mouse_click(0)
            ctx.key_chars_replace(text)
            ctx.mouse_move("//**/###frame")

        app.act(action)

    def source() -> TextSource:
        found = app.scene.lights[1].source
        assert isinstance(found, TextSource)
        return found

    typed("Io")
    assert source().text == "Io"
    assert len(app.scene.lights[1].outline.contours) == 3, "a stem, and an o with its hole"
    app.act(lambda ctx: ctx.item_click("//Light/light text/##align"))
    app.act(lambda ctx: ctx.item_click("//$FOCUSED/left"))
    app.act(lambda ctx: ctx.item_input_value("//Light/light text/##spacing", 0.25))
    assert (source().align, source().spacing) == ("left", 0.25)
    assert steps(app) == (
        "Add light 'text'", "Change text of 'text'", "Change alignment of 'text'",
        "Change spacing of 'text'",
    )  # fmt: skip

    good = app.scene
    typed("\u4e2d")
    assert any("no glyph" in message.text for message in app.window.messages.shown)
    assert app.scene == good, "what cannot be set leaves the light as it is"
    app.act(lambda ctx: ctx.item_click("//Light/light text/###convert"))
    app.click("To polygon, coarse")
    assert app.scene.lights[1].source is None, "the shape itself was edited"
    undo_all(app)
    assert app.scene == before


def drop_a_drawing_and_a_font(app: Application, out: Path) -> None:
    show(app, app.scene.lights[0].outline)
    before = app.scene
    logo, font = out / "logo.svg", out / "own.otf"
    logo.write_text(DRAWING)
    font.write_bytes(FONT.read_bytes())
    app.window.dropped.append(str(logo))
    app.frame()
    light = app.scene.lights[1]
    assert light.name == "logo"
    assert isinstance(light.source, SvgSource)
    logo.write_text(DRAWING.replace("<circle", "<ellipse rx='3' ry='1' cx='9' cy='20'/><circle"))
    app.click("Reload")
    assert len(app.scene.lights[1].outline.contours) == len(light.outline.contours) + 1
    for _ in range(2):  # a new text, then another font for it
        app.window.dropped.append(str(font))
        app.frame()
    source = app.scene.lights[2].source
    assert isinstance(source, TextSource)
    assert source.font == str(font)
    app.click("Own font")
    app.window.dropped.append(str(font))
    app.frame()
    assert app.scene.lights[2].source == source
    assert steps(app) == (
        "Add light 'logo'", "Reload 'logo'", "Add light 'text'", "Change font of 'text'",
        "Change font of 'text'",
    )  # fmt: skip
    broken = out / "broken.ttf"
    broken.write_text("no font")
    app.window.dropped.append(str(broken))
    app.frame()
    assert any("broken.ttf" in message.text for message in app.window.messages.shown)
    undo_all(app)
    assert app.scene == before


SCENARIOS = (
    drag_an_anchor,
    drag_handles_of_each_kind,
    insert_and_remove_on_a_curve,
    lines_kinds_and_splits_by_menu,
    convert_and_mix,
    presets_from_the_menu,
    type_a_text,
    drop_a_drawing_and_a_font,
)
