"""The pictures of a scene as the window shows them: clock, frames, changed and missing files."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from PIL import Image

from app import step_names
from app.gui.playback import POLL_SECONDS, Playback
from app.scene import AreaLight, Camera, Outline, Picture, PolygonContour, Scene

SQUARE = Outline((PolygonContour(((-1, -1), (1, -1), (1, 1), (-1, 1))),))


class Told(list[str]):
    """A reporter that remembers."""

    failure = list.append


def film(path: Path, milliseconds: int = 100, frames: int = 4) -> Picture:
    images = [Image.new("L", (4, 4), 60 * i) for i in range(frames)]
    images[0].save(path, save_all=True, append_images=images[1:], duration=milliseconds)
    return Picture(str(path))


def scene_of(*pictures: Picture | None) -> Scene:
    return Scene(
        lights=tuple(AreaLight(f"light {i}", SQUARE, picture=p) for i, p in enumerate(pictures))
    )


@pytest.fixture
def told() -> Told:
    return Told()


@pytest.fixture
def playback(told: Told) -> Playback:
    return Playback(told)


def test_time_is_that_of_the_last_new_frame(tmp_path: Path, playback: Playback) -> None:
    scene = scene_of(film(tmp_path / "a.gif"), None)
    seen = []
    for i in range(40):  # frames last ten steps
        assert playback.step(scene, 100.0 + 0.01 * i) is scene
        seen.append(playback.time)
    assert playback.is_moving
    assert sorted(set(seen)) == pytest.approx([0.0, 0.1, 0.2, 0.3], abs=0.0101)
    playback.toggle()
    playback.step(scene, 200.0)
    assert playback.time == seen[-1]
    assert not playback.is_moving
    playback.toggle()
    playback.step(scene, 200.11)
    assert playback.time == pytest.approx(0.39 + 0.11), "no jump over the pause"
    playback.seek(0.25)
    assert (playback.time, playback.is_playing) == (0.25, False)


def test_stills_and_plain_lights_do_not_move(tmp_path: Path, playback: Playback) -> None:
    Image.new("L", (2, 2)).save(tmp_path / "a.png")
    for scene in (Scene(), scene_of(None), scene_of(Picture(str(tmp_path / "a.png")))):
        playback.begin()
        for now in (0.0, 1.0, 2.0):
            assert playback.step(scene, now) is scene
        assert not playback.is_moving
        assert playback.time == 0.0


def test_two_films_at_their_own_speeds(tmp_path: Path, playback: Playback) -> None:
    a, b = film(tmp_path / "a.gif", 100), replace(film(tmp_path / "b.gif"), frames_per_second=3.0)
    scene = scene_of(a, b)
    times = set()
    for i in range(101):
        playback.step(scene, 0.01 * i)
        times.add(round(playback.time, 6))
    changes = {0.1 * k for k in range(11)} | {1 / 3, 2 / 3}
    assert len(times) == len(changes)
    for time, change in zip(sorted(times), sorted(changes), strict=True):
        assert change - 1e-5 <= time < change + 0.0101


def test_a_missing_picture_is_told_once_and_its_light_is_plain(
    tmp_path: Path, playback: Playback, told: Told
) -> None:
    path = tmp_path / "a.png"
    scene = scene_of(Picture(str(path)), None)
    shown = playback.step(scene, 0.0)
    assert shown == scene_of(None, None)
    assert told == [f"{path}: there is no such file, expected a picture ({KINDS})"]
    turned = replace(scene, camera=Camera(eye=(9.0, 0.0, 0.0)))
    after = playback.step(turned, 0.1)
    assert after.camera == turned.camera
    assert after.lights is shown.lights, "what did not change is the same object"
    assert playback.step(turned, 9.0) is after
    assert len(told) == 1
    Image.new("L", (2, 2)).save(path)
    assert playback.step(turned, 9.0 + 0.5 * POLL_SECONDS) is after, "not looked at so soon"
    assert playback.step(turned, 10.0) is turned
    assert playback.changes == 1
    path.write_text("no picture any more")
    assert playback.step(turned, 11.0).lights[0].picture is None
    assert len(told) == 2
    assert "this is no picture" in told[1]


KINDS = ".png, .jpg, .jpeg, .webp, .gif, .tif, .tiff, .exr, .hdr"


def test_a_film_that_goes_missing_while_it_plays(tmp_path: Path, playback: Playback) -> None:
    scene = scene_of(film(tmp_path / "a.gif"))
    playback.step(scene, 0.0)
    (tmp_path / "a.gif").unlink()
    assert playback.step(scene, 0.2) is scene
    assert playback.step(scene, 1.0) == scene_of(None)
    assert not playback.is_moving


def test_steps_of_the_history_have_names() -> None:
    picture = Picture("/a.png")
    before, after = scene_of(None), scene_of(picture)
    assert step_names.describe(before, after) == "Put picture on 'light 0'"
    assert step_names.describe(after, before) == "Remove picture of 'light 0'"
    for field, value, name in (
        ("file", "/b.png", "file"), ("color_space", "srgb", "colours"), ("fit", "tile", "fit"),
        ("offset", (1.0, 0.0), "position"), ("scale", (2.0, 1.0), "size"),
        ("rotation", 1.0, "rotation"), ("mirror", (True, False), "mirroring"),
        ("frames_per_second", 5.0, "speed"), ("start", 1.0, "start"),
    ):  # fmt: skip
        changed = scene_of(replace(picture, **{field: value}))
        assert step_names.describe(after, changed) == f"Change {name} of the picture on 'light 0'"
