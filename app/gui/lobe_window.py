"""The lobe of the point under the pointer: which point, its pictures as textures, when anew.

While point or sliders move, pictures are coarse; once they rest they become fine. Nothing is
computed while nothing changes, or while the panel is hidden.
"""

from __future__ import annotations

from dataclasses import replace

import moderngl
import numpy as np
from numpy.typing import NDArray

from app.editor import Editor
from app.gui.lobe_point import Subject, SurfacePoint, light_lines, subject_of
from app.gui.shortcuts import key_of
from app.lobe_picture import Scale, lobe_images
from app.panels.lobe import LobeState, lobe_panel
from app.panels.lobe_pictures import LightLine, LobeView
from app.render.picking import Hit
from app.scene import Camera, Vec3
from ltc.lobe import WHOLE, Case, LobePair, Window, lobe_pair

COARSE, FINE = 96, 256
"""Pixels on each side of the pictures while something moves, and after."""


class LobeWindow:
    """Draws the docked window of the lobe.

    Parameters
    ----------
    ctx : moderngl.Context
        Textures are made in it when the window is first shown.

    Attributes
    ----------
    state : LobeState
    is_settled : bool
        Whether the pictures are as fine as they get.
    """

    def __init__(self, ctx: moderngl.Context) -> None:
        self.state = LobeState()
        self.is_settled = True
        self._ctx = ctx
        self._point: SurfacePoint | None = None
        self._hit: Hit | None = None
        self._pair: LobePair | None = None
        self._drawn: tuple[Case, Window, bool, int] | None = None
        self._textures: list[moderngl.Texture] = []

    @property
    def pair(self) -> LobePair | None:
        """What the panel showed last."""
        return self._pair

    @property
    def is_pinned(self) -> bool:
        """Whether a point is kept, whatever the pointer does."""
        return self.state.mode == "pinned"

    def pin(self, editor: Editor, camera: Camera) -> tuple[Vec3, Vec3, Vec3] | None:
        """Return the pinned point with its normal and tangent, all in world space."""
        subject = self._subject(editor, camera) if self.is_pinned else None
        if subject is None:
            return None
        position, normal, tangent = (
            _vec3(v) for v in (subject.position, subject.frame[2], subject.frame[0])
        )
        return position, normal, tangent

    def begin(self) -> None:
        """Forget the point: another scene is shown now."""
        self._point = self._hit = None
        if self.is_pinned:
            self.state = replace(self.state, mode="pointer")

    def toggle_pin(self) -> None:
        """Pin the last point, or let it go."""
        if self.is_pinned:
            self.state = replace(self.state, mode="pointer")
        elif self._point is not None:
            self.state = replace(self.state, mode="pinned")

    def point_at(self, hit: Hit | None, editor: Editor) -> None:
        """Take note of what is under the pointer."""
        if hit is None or hit is self._hit or self.state.mode != "pointer":
            return
        self._hit = hit
        self._point = SurfacePoint.of(hit, editor.scene) or self._point

    def draw(self, editor: Editor, camera: Camera) -> None:
        """Draw the inside of the window."""
        subject = self._subject(editor, camera)
        view = self._view(editor, subject)
        self.state = lobe_panel(self.state, view, self._point is not None, key_of("pin"))

    def _subject(self, editor: Editor, camera: Camera) -> Subject | None:
        if self._point is None:
            return None
        found = subject_of(self._point, editor.scene, camera)
        if found is None:  # its object is gone
            self.begin()
        return found

    def _view(self, editor: Editor, subject: Subject | None) -> LobeView | None:
        """Return what to show, its pictures drawn anew where something changed."""
        free = self.state.mode == "free"
        if subject is None and not free:
            self.is_settled = True
            return None
        case = self.state.case if free or subject is None else subject.case
        if self._pair is None or self._pair.case != case:
            self._pair = lobe_pair(case)
        pair = self._pair
        window = pair.window if self.state.follows else WHOLE
        scale = Scale(pair.peak, self.state.logarithmic)
        self._paint(pair, window, scale)
        first, second, third = (texture.glo for texture in self._textures)
        title, note = "Set by hand", ""
        lights: tuple[LightLine, ...] = ()
        if subject is not None and not free:
            title, note = subject.title, subject.note
            selection = editor.selection
            chosen = selection.index if selection.kind == "light" else None
            lights = light_lines(editor.scene.lights, chosen, subject)
        return LobeView(title, note, pair, window, scale, (first, second, third), lights)

    def _paint(self, pair: LobePair, window: Window, scale: Scale) -> None:
        """Bring the textures up to date, first coarsely, in the next frame finely."""
        wanted = (pair.case, window, scale.logarithmic)
        if self._drawn is not None and self._drawn[:3] == wanted:
            if self._drawn[3] == FINE:
                self.is_settled = True
                return
            size = FINE
        else:
            size = COARSE
        self._upload(lobe_images(pair, size, window, scale), size)
        self._drawn = (*wanted, size)
        self.is_settled = size == FINE

    def _upload(self, images: tuple[NDArray[np.uint8], ...], size: int) -> None:
        if not self._textures or self._textures[0].width != size:
            self._drop()
            self._textures = [self._ctx.texture((size, size), 4) for _ in images]
        for texture, image in zip(self._textures, images, strict=True):
            texture.write(np.ascontiguousarray(image).tobytes())

    def _drop(self) -> None:
        for texture in self._textures:
            texture.release()
        self._textures = []

    def release(self) -> None:
        """Release every GPU object."""
        self._drop()
        self._drawn = None


def _vec3(values: NDArray[np.float64]) -> Vec3:
    x, y, z = values.tolist()
    return (x, y, z)
