"""Scenarios of pictures on lights: dropped, placed, played, changed and missing."""

from __future__ import annotations

# isort: off
import imgui_bundle  # noqa: F401  (first: glfw then takes the library that imgui-bundle carries)
# isort: on

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
from imgui_bundle import imgui
from PIL import Image

from app import contours, lights
from app.editor import NOTHING, Selection
from app.scene import Picture
from tests.gui.application import Application

CTRL = imgui.Key.mod_ctrl
PANEL = "//Light/light key"


def drawn(path: Path, colour: str = "red", size: tuple[int, int] = (30, 10)) -> Path:
    Image.new("RGB", size, colour).save(path)
    return path


def animated(path: Path) -> Path:
    frames = [Image.new("RGB", (16, 12), colour) for colour in ("red", "lime", "blue")]
    frames[0].save(path, save_all=True, append_images=frames[1:], duration=[200, 200, 400])
    return path


def dropped(app: Application, *paths: Path) -> None:
    app.window.dropped.extend(map(str, paths))
    app.frame()


def press(app: Application, item: str) -> None:
    app.act(lambda ctx: ctx.item_click(f"{PANEL}/{item}"))


def enter(app: Application, item: str, value: float) -> None:
    app.act(lambda ctx: ctx.item_input_value(f"{PANEL}/{item}", value))


def steps(app: Application) -> tuple[str, ...]:
    return app.window.editor.steps[1:]


def alone(app: Application, picture: Picture | None = None) -> None:
    """Show one light with nothing to shine on, selected: frames cost little."""
    light = replace(app.scene.lights[0], picture=picture)
    app.window.show(replace(app.scene, objects=(), lights=(light,)), None)
    app.window.viewport.settings = replace(app.window.viewport.settings, samples=1)
    app.window.editor.selection = Selection.light(0)
    app.frame()


def shown_picture(app: Application) -> Picture | None:
    shot = app.window.viewport.picture.shot
    assert shot is not None
    return shot.scene.lights[0].picture


def told(app: Application) -> str:
    return "\n".join(message.text for message in app.window.messages.shown)


def middle(app: Application) -> str:
    """Return the colour in the middle of the first light, as it is seen: grey, red, ..."""
    x, y = app.on_screen(lights.centre_of(app.scene.lights[0]))
    view = app.window.viewport.view
    colour = app.picture()[round(y - view.y), round(x - view.x)].astype(int)
    if colour.max() - colour.min() < 40:
        return "grey"
    return ("red", "lime", "blue")[int(colour.argmax())]


def drop_pictures(app: Application, out: Path) -> None:
    alone(app)
    before = app.scene
    wide, tall = drawn(out / "wide.png"), drawn(out / "tall.webp", "lime", (10, 30))
    assert middle(app) == "grey"
    dropped(app, wide)
    assert app.scene.lights[0].picture == Picture(str(wide))
    assert middle(app) == "red"
    dropped(app, tall, wide)
    assert app.scene.lights[0].picture == Picture(str(tall))
    assert [light.name for light in app.scene.lights] == ["key", "wide"]
    app.window.editor.selection = NOTHING
    dropped(app, tall)
    light = app.scene.lights[2]
    (s0, t0), (s1, t1) = contours.bounds(light.outline)
    assert math.isclose((t1 - t0) / (s1 - s0), 3.0), "it has the picture's shape"
    assert app.window.editor.selection == Selection.light(2)
    assert steps(app) == (
        "Put picture on 'key'", "Change file of the picture on 'key'", "Add light 'wide'",
        "Add light 'tall'",
    )  # fmt: skip
    broken = out / "broken.png"
    broken.write_bytes(wide.read_bytes()[:40])
    dropped(app, broken)
    assert "broken.png: this is no picture" in told(app)
    assert len(steps(app)) == 4
    app.act(lambda ctx: ctx.mouse_move("//**/###frame"))
    for _ in range(4):
        app.key(CTRL | imgui.Key.z)
    assert app.scene.lights == before.lights


def place_a_picture(app: Application, out: Path) -> None:
    alone(app)
    assert app.window.editor.undo_name is None
    press(app, "###choose picture")
    assert app.window.dialogs.is_open
    app.click("###cancel file")
    dropped(app, drawn(out / "placed_01.png"))

    def picture() -> Picture:
        found = app.scene.lights[0].picture
        assert found is not None
        return found

    for row, choice in (("fit", "fill"), ("colours", "linear")):
        press(app, f"##{row}")
        app.act(lambda ctx, choice=choice: ctx.item_click(f"//$FOCUSED/{choice}"))
    enter(app, "##rotation", 90.0)
    enter(app, "##offset/$$0", 0.25)
    enter(app, "##scale/$$1", 2.0)
    press(app, "###mirror across")
    assert picture() == Picture(
        str(out / "placed_01.png"), "linear", "fill", (0.25, 0.0), (1.0, 2.0), math.pi / 2,
        (True, False),
    )  # fmt: skip
    enter(app, "##scale/$$0", 0.0)
    assert picture().scale == (1e-3, 2.0), "a picture without a size is nothing to see"
    drawn(out / "placed_02.png")
    app.frame()
    press(app, "###sequence")
    assert picture().file == str(out / "placed_%02d.png")
    press(app, "###remove picture")
    assert app.scene.lights[0].picture is None
    assert steps(app) == (
        "Put picture on 'key'",
        *(
            f"Change {what} of the picture on 'key'"
            for what in ("fit", "colours", "rotation", "position", "size", "mirroring", "size",
                         "file")
        ),
        "Remove picture of 'key'",
    )  # fmt: skip


def play_a_picture(app: Application, out: Path) -> None:
    alone(app, Picture(str(animated(out / "film.gif"))))
    playback, editor = app.window.viewport.playback, app.window.editor
    assert playback.is_moving
    app.until(lambda: playback.time > 0.2)
    assert app.window.viewport.settings.time == playback.time
    press(app, "###play")
    assert not playback.is_moving
    stopped = playback.time
    app.settle()
    assert playback.time == stopped
    shot = app.window.viewport.picture.shot
    assert shot is not None
    assert shot.settings.time == stopped
    for moment, colour in ((0.3, "lime"), (0.1, "red"), (0.7, "blue")):
        enter(app, "##moment", moment)
        assert np.isclose(playback.time, moment)
        assert middle(app) == colour
    press(app, "###play")
    app.until(lambda: playback.time > 0.9)
    assert editor.undo_name is None, "playing is no edit"
    enter(app, "##speed", 10.0)
    assert np.isclose(playback.seconds(app.scene.lights[0].picture), 0.3)
    assert steps(app) == ("Change speed of the picture on 'key'",)


def pictures_change_and_go_missing(app: Application, out: Path) -> None:
    path = drawn(out / "changing.png")
    picture = Picture(str(path))
    alone(app, picture)
    app.settle()
    assert shown_picture(app) == picture
    changes = app.window.viewport.playback.changes
    drawn(path, "lime", (20, 20))
    app.until(lambda: app.window.viewport.playback.changes > changes)
    app.settle()
    assert shown_picture(app) == picture
    assert middle(app) == "lime"
    path.unlink()
    app.until(lambda: "there is no such file" in told(app))
    app.settle()
    assert shown_picture(app) is None
    assert middle(app) == "grey", "its light shines plain"
    assert app.scene.lights[0].picture == picture
    assert not app.window.viewport.picture.has_failed
    app.window.messages.clear()
    drawn(path)
    app.until(lambda: shown_picture(app) == picture)
    assert not told(app)
    assert app.window.editor.undo_name is None


def a_scene_without_its_picture(app: Application, out: Path) -> None:
    path = out / "lost.json"
    path.write_text('{"format": "ltc-scene/1", "lights": [{"picture": "lost.png"}]}')
    app.window.documents.load(path)
    app.settle()
    assert app.window.editor.path == path
    assert "lost.png: there is no such file" in told(app)
    assert shown_picture(app) is None


SCENARIOS = (
    drop_pictures,
    place_a_picture,
    play_a_picture,
    pictures_change_and_go_missing,
    a_scene_without_its_picture,
)
