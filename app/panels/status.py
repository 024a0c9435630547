"""The status bar and the line of help in the picture."""

from __future__ import annotations

from imgui_bundle import imgui

from app.editor import Selection
from app.gui.shortcuts import key_of
from app.panels.widgets import MUTED
from app.scene import BezierContour, Scene, TextSource


def help_line(scene: Scene, selection: Selection, tool: str) -> str:
    """Return what a newcomer may do next, for what is selected and the tool in hand."""
    if not scene.lights:
        return "Add a light with + in the Scene panel"
    if selection.kind == "light" and selection.vertex is not None:
        contour = scene.lights[selection.index].outline.contours[selection.vertex[0]]
        removes = f"{key_of('remove')} removes it"
        if isinstance(contour, BezierContour):
            kinds = f"{key_of('smooth')} smooth, {key_of('corner')} corner"
            return f"Drag anchor and handles, Alt frees one · {kinds} · {removes}"
        return f"Drag the corner · {removes} · drag a dot between corners to add one"
    source = scene.lights[selection.index].source if selection.kind == "light" else None
    if isinstance(source, TextSource):
        return "Type in the Light panel · drop a font file here · drag the arrows to move it"
    if source is not None:
        return "Its file and size are in the Light panel · drag the arrows to move it"
    if selection.kind == "light":
        if tool == "move":
            use = f"drag the arrows to move the light · {key_of('rotate')} to rotate"
        else:
            use = f"drag the rings to turn it · {key_of('move')} to move"
        return f"Drag corners to reshape · {use} · drag elsewhere to look around"
    if selection.kind == "object":
        return f"Change its look under Material · drag to look around · {key_of('frame')} frames it"
    return "Click a light to shape it, an object to change its material · drag to look around"


def noise_text(relative: float | None, seconds: float) -> str:
    """Return what there is to say of a picture made of random samples, nothing of others.

    Parameters
    ----------
    relative : float or None
        Its estimated error as a share of its mean.
    seconds : float
        What its samples took.
    """
    return "" if relative is None else f" in {seconds:.1f} s, error {100.0 * relative:.2g} %"


def status_bar(
    text: str, samples: tuple[int, int], size: tuple[int, int], technique: str, noise: str = ""
) -> None:
    """Draw help on the left, the state of the picture on the right.

    Parameters
    ----------
    text : str
        See `help_line`.
    samples : (int, int)
        Samples per pixel gathered, and how many there will be.
    size : (int, int)
        Pixels.
    noise : str
        See `noise_text`.
    """
    imgui.text_colored(MUTED, text)
    done, total = samples
    state = f"{technique}    {size[0]} × {size[1]}    {done} of {total} samples{noise}"
    width = imgui.calc_text_size(state).x
    imgui.same_line(imgui.get_window_width() - width - imgui.get_font_size())
    imgui.text_colored(MUTED, state)
