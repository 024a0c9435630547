"""The part of a light's panel that shows the picture on it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from imgui_bundle import icons_fontawesome_4 as icons
from imgui_bundle import imgui

from app.panels.widgets import (
    MUTED,
    button,
    choice,
    half_width,
    heading,
    label,
    numbers,
    slider,
    tooltip,
)
from app.pictures import is_sequence, sequence_of
from app.scene import COLOR_SPACES, PICTURE_FITS, AreaLight, Picture

LEAST_SCALE = 1e-3
MOST_FRAMES_PER_SECOND = 120.0
"""Of the slider; a file may have more."""


def _nothing(_time: float = 0.0) -> None: ...


@dataclass(frozen=True, slots=True)
class Player:
    """What a light's picture does at the moment, and what can be asked for.

    Attributes
    ----------
    seconds : float
        After which it begins again; 0 for a still.
    moment : float
        How far into it the picture is [s].
    is_playing : bool
    ask_file, toggle : callable
        Ask for another picture file; stop or go on.
    seek : callable
        Stop so many seconds into it.
    """

    seconds: float = 0.0
    moment: float = 0.0
    is_playing: bool = False
    ask_file: Callable[[], None] = _nothing
    toggle: Callable[[], None] = _nothing
    seek: Callable[[float], None] = _nothing


def picture_rows(light: AreaLight, player: Player) -> AreaLight:
    """Draw the rows of a light's picture and return the light as edited."""
    heading("Picture")
    picture = light.picture
    if picture is None:
        tip = "Put a picture on the light; dropping one on the window does so too"
        if button("Choose…###choose picture", tip, width=-1.0):
            player.ask_file()
        return light
    label("File", picture.file)
    imgui.text_colored(MUTED, Path(picture.file).name)
    tooltip(picture.file)
    width = half_width()
    if button("Choose…###choose picture", "Choose another picture", width=width):
        player.ask_file()
    imgui.same_line()
    if button("Remove###remove picture", "Let the light shine plain", width=width):
        return replace(light, picture=None)
    picture = _sequence_row(picture)
    picture = _place_rows(picture)
    if player.seconds > 0.0:
        picture = _playing_rows(picture, player)
    return replace(light, picture=picture) if picture != light.picture else light


def _sequence_row(picture: Picture) -> Picture:
    """Draw the button that makes one of several numbered files all of them."""
    if is_sequence(picture.file):
        return picture
    pattern = sequence_of(picture.file)
    if pattern is not None and button(
        f"Play all of {Path(pattern).name}###sequence",
        "The files with other numbers are its frames", width=-1.0,
    ):  # fmt: skip
        return replace(picture, file=pattern)
    return picture


def _place_rows(picture: Picture) -> Picture:
    space = choice(
        "Colours", picture.color_space, COLOR_SPACES,
        "How the numbers in the file stand for light; auto: linear for floating point, else sRGB",
    )  # fmt: skip
    fit = choice(
        "Fit", picture.fit, PICTURE_FITS,
        "To the box around the light: stretched, whole, without a gap, or repeated",
    )  # fmt: skip
    right, up = numbers(
        "Offset", picture.offset, 0.005, "%.3f",
        "To the right and up, in widths and heights of the box around the light",
    )  # fmt: skip
    wide, high = numbers(
        "Scale", picture.scale, 0.005, "%.3f", "Width and height relative to what fits"
    )
    degrees = math.degrees(picture.rotation)
    turned = slider(
        "Rotation", degrees, -180.0, 180.0, "%.1f°",
        "Counter-clockwise, seen from the side that shines",
    )  # fmt: skip
    return replace(
        picture,
        color_space=space,
        fit=fit,
        offset=(right, up),
        scale=(max(wide, LEAST_SCALE), max(high, LEAST_SCALE))
        if (wide, high) != picture.scale
        else picture.scale,
        rotation=math.radians(turned) if turned != degrees else picture.rotation,
        mirror=_mirror_row(picture.mirror),
    )


def _mirror_row(mirror: tuple[bool, bool]) -> tuple[bool, bool]:
    label("Mirror", "Swap left and right, or top and bottom")
    _, across = imgui.checkbox("across###mirror across", mirror[0])
    tooltip("Swap left and right")
    imgui.same_line()
    _, down = imgui.checkbox("down###mirror down", mirror[1])
    tooltip("Swap top and bottom")
    return bool(across), bool(down)


def _playing_rows(picture: Picture, player: Player) -> Picture:
    """Draw the rows of an animation: where it is, which is no edit, and how fast it plays."""
    icon = icons.ICON_FA_PAUSE if player.is_playing else icons.ICON_FA_PLAY
    word = "Pause" if player.is_playing else "Play"
    if button(f"{icon} {word}###play", "Of all pictures in the scene", width=-1.0):
        player.toggle()
    sought = slider(
        "Moment", player.moment, 0.0, player.seconds, "%.2f s", "Stops at a moment of the picture"
    )
    if sought != player.moment:
        player.seek(sought)
    speed = slider(
        "Speed", picture.frames_per_second, 0.0, MOST_FRAMES_PER_SECOND,
        "%.1f /s" if picture.frames_per_second > 0.0 else "as in the file",
        "Frames a second; 0 for what the file says",
    )  # fmt: skip
    start = slider(
        "Start", picture.start, 0.0, max(player.seconds, picture.start), "%.2f s",
        "The moment of the picture at time 0",
    )  # fmt: skip
    return replace(picture, frames_per_second=speed, start=start)
