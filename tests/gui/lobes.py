"""Scenarios of the lobe panel: the point under the pointer, pinned points, sliders."""

from __future__ import annotations

# isort: off
import imgui_bundle  # noqa: F401  (first: glfw then takes the library that imgui-bundle carries)
# isort: on

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
from imgui_bundle import ImVec2, imgui

from app.gui.lobe_window import FINE
from app.panels.lobe import LobeState
from app.scene import Vec3
from ltc.lobe import LobePair
from tests.gui.application import Application

ON_THE_FLOOR, FURTHER, ON_THE_BALL = (-0.6, 0.0, 1.2), (-1.2, 0.0, 1.0), (1.3, 0.6, 0.79)


def show(app: Application) -> None:
    """Brush the floor and bring the panel to the front."""
    floor, red = app.scene.materials
    brushed = replace(floor, alpha=(0.3, 0.05))
    app.window.show(replace(app.scene, materials=(brushed, red)), None)
    app.window.viewport.settings = replace(app.window.viewport.settings, samples=1)
    app.window.lobe.state = LobeState()
    app.act(lambda ctx: ctx.window_focus("//Lobe"))
    app.settle()


def hover(app: Application, point: Vec3) -> None:
    """Rest the pointer on a point of the scene."""
    x, y = app.on_screen(point)

    def action(ctx) -> None:
        ctx.mouse_move_to_pos(ImVec2(x - 6.0, y))
        ctx.yield_(2)
        ctx.mouse_move_to_pos(ImVec2(x, y))
        ctx.yield_(3)

    app.act(action)
    app.frame()
    app.until(lambda: app.window.lobe.is_settled)


def pair_of(app: Application) -> LobePair:
    pair = app.window.lobe.pair
    assert pair is not None
    return pair


def lobe_under_the_pointer(app: Application, out: Path) -> None:
    show(app)
    hover(app, ON_THE_FLOOR)
    pair = pair_of(app)
    assert pair.table == "ltc_anisotropic.npz"
    assert (pair.case.alpha_x, pair.case.alpha_y) == (0.3, 0.05)
    away = np.subtract(app.scene.camera.eye, ON_THE_FLOOR)
    assert math.isclose(pair.case.theta, math.acos(away[1] / np.linalg.norm(away)), abs_tol=0.02)
    drawn = app.window.lobe._drawn
    assert drawn is not None
    assert drawn[3] == FINE
    app.frame()
    assert app.window.lobe._drawn is drawn, "nothing is computed while nothing changes"
    texture = app.window.lobe._textures[0]
    shown = np.frombuffer(texture.read(), np.uint8).reshape(FINE, FINE, 4)
    assert shown[..., :3].max() > 180, "the lobe is in its picture"

    shares = app.window.lobe._shares
    assert shares is not None
    (share,) = shares[2]
    assert share.name == "key"
    assert 0.0 < share.ggx < pair.exact_albedo
    assert abs(share.ltc - share.ggx) < 0.1 * pair.exact_albedo

    hover(app, ON_THE_BALL)
    assert pair_of(app).table == "ltc_isotropic.npz"
    assert pair_of(app).case.alpha_x == app.scene.materials[1].alpha[0]
    app.act(lambda ctx: ctx.mouse_move_to_pos(ImVec2(5.0, 695.0)))
    assert pair_of(app).table == "ltc_isotropic.npz", "the last point stays"


def pinned_lobe(app: Application, out: Path) -> None:
    show(app)
    hover(app, ON_THE_FLOOR)
    case = pair_of(app).case
    app.key(imgui.Key.p)
    assert app.window.lobe.is_pinned
    hover(app, ON_THE_BALL)
    assert pair_of(app).case == case, "whatever the pointer does"
    pin = app.window.viewport.pin
    assert pin is not None
    assert np.allclose(pin[0], ON_THE_FLOOR, atol=0.02)
    assert np.allclose(pin[1], (0.0, 1.0, 0.0), atol=1e-6)

    floor, red = app.scene.materials
    app.window.editor.apply("Brush", replace(app.scene, materials=(
        replace(floor, alpha=(0.1, 0.2)), red)))  # fmt: skip
    app.settle()
    assert (pair_of(app).case.alpha_x, pair_of(app).case.alpha_y) == (0.1, 0.2)
    assert pair_of(app).case.theta == case.theta
    app.window.editor.undo()
    app.settle()
    assert pair_of(app).case == case

    app.click("###lobe pointer")
    hover(app, FURTHER)
    assert pair_of(app).case.theta != case.theta
    app.click("###lobe pinned")
    assert app.window.lobe.is_pinned
    app.window.editor.apply("Clear", replace(app.scene, objects=()))
    app.settle()
    assert not app.window.lobe.is_pinned, "its object is gone"


def lobe_by_hand(app: Application, out: Path) -> None:
    show(app)
    hover(app, ON_THE_BALL)
    scene = app.scene
    app.act(lambda ctx: ctx.item_input_value("//Lobe/##theta", 45.0))
    state = app.window.lobe.state
    assert (state.mode, state.theta) == ("free", 45.0)
    assert math.isclose(pair_of(app).case.theta, math.radians(45.0))
    assert pair_of(app).table == "ltc_isotropic.npz"
    app.act(lambda ctx: ctx.item_input_value("//Lobe/##ratio", 0.25))
    assert pair_of(app).table == "ltc_anisotropic.npz"
    case = pair_of(app).case
    assert math.isclose(case.alpha_y, 0.25 * case.alpha_x)
    hover(app, ON_THE_FLOOR)
    assert pair_of(app).case == case
    app.click("###log scale")
    app.click("###zoom lobe")
    assert not (app.window.lobe.state.logarithmic or app.window.lobe.state.follows)
    app.settle()
    assert app.scene == scene, "the panel edits nothing"


SCENARIOS = (lobe_under_the_pointer, pinned_lobe, lobe_by_hand)
