"""The lobe of the point under the pointer: which point, its pictures as textures, when anew.

While point or sliders move, pictures are coarse (7 ms of one core, transform and figures
included); once they rest they become fine (25 ms, once). Nothing is computed while nothing
changes, or while the panel is hidden.
"""

from __future__ import annotations

from dataclasses import replace

import moderngl
import numpy as np
from imgui_bundle import imgui
from numpy.typing import NDArray

from app.editor import Editor
from app.gui.lobe_point import Subject, SurfacePoint, light_lines, light_share, subject_of
from app.gui.shortcuts import key_of
from app.lobe_picture import Scale, lobe_images
from app.panels.lobe import LightShare, LobeState, lobe_panel
from app.panels.lobe_pictures import LightLine, LobeView
from app.render.picking import Hit
from app.scene import Camera, Scene, Vec3
from ltc.lobe import WHOLE, Case, LobePair, Window, lobe_pair

COARSE, FINE = 96, 256
"""Pixels on each side of the pictures while something moves, and after."""
MOST_SHARES = 6
"""How many lights are listed with what they add."""


class LobeWindow:
    """Draws the docked window of the lobe.

    Parameters
    ----------
    ctx : moderngl.Context
        Textures are made in it when the window is first shown.

    Attributes
    ----------
    state : LobeState
    """

    def __init__(self, ctx: moderngl.Context) -> None:
        self.state = LobeState()
        self._ctx = ctx
        self._working = -2
        self._point: SurfacePoint | None = None
        self._seen: tuple[SurfacePoint, Scene, Camera, Subject] | None = None
        self._lights: tuple[Subject, object, int | None, tuple[LightLine, ...]] | None = None
        self._hit: Hit | None = None
        self._pair: LobePair | None = None
        self._drawn: tuple[Case, Window, bool, int] | None = None
        self._shares: tuple[Subject, object, list[LightShare]] | None = None
        self._textures: list[moderngl.Texture] = []

    @property
    def is_settled(self) -> bool:
        """Whether the pictures are as fine as they get, and all that lights add is known.

        Nothing is waited for while the panel is hidden.
        """
        return imgui.get_frame_count() - self._working > 1

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
        self._point = self._hit = self._seen = self._lights = self._shares = None
        if self.is_pinned:
            self.state = replace(self.state, mode="pointer")

    def toggle_pin(self) -> None:
        """Pin the last point, or let it go."""
        if self.is_pinned:
            self.state = replace(self.state, mode="pointer")
        elif self._point is not None:
            self.state = replace(self.state, mode="pinned")

    def pin_at(self, hit: Hit, editor: Editor) -> None:
        """Pin the point that was hit, unless it is a light's."""
        point = SurfacePoint.of(hit, editor.scene)
        if point is not None:
            self._hit, self._point = hit, point
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
        shares: list[LightShare] = []
        if view is not None and subject is not None and self.state.mode != "free":
            shares = self._shares_of(editor, subject, view.pair)
        can_pin = self._point is not None
        self.state = lobe_panel(self.state, view, shares, can_pin, key_of("pin"))

    def _subject(self, editor: Editor, camera: Camera) -> Subject | None:
        """Return the point as it is seen now; the same object while nothing changes."""
        point, scene, seen = self._point, editor.scene, self._seen
        if point is None:
            return None
        if seen is not None and seen[0] is point and seen[1] is scene and seen[2] == camera:
            return seen[3]
        found = subject_of(point, scene, camera)
        if found is None:  # its object is gone
            self.begin()
            return None
        self._seen = (point, scene, camera, found)
        return found

    def _light_lines(self, editor: Editor, subject: Subject) -> tuple[LightLine, ...]:
        selection, lights, held = editor.selection, editor.scene.lights, self._lights
        chosen = selection.index if selection.kind == "light" else None
        if held is None or held[0] is not subject or held[1] is not lights or held[2] != chosen:
            held = (subject, lights, chosen, light_lines(lights, chosen, subject))
            self._lights = held
        return held[3]

    def _shares_of(self, editor: Editor, subject: Subject, pair: LobePair) -> list[LightShare]:
        """Return what the strongest lights add; once the pictures are fine, one more a frame."""
        lights, held = editor.scene.lights, self._shares
        if held is None or held[0] is not subject or held[1] is not lights:
            held = self._shares = (subject, lights, [])
        known = held[2]
        is_fine = self._drawn is not None and self._drawn[3] == FINE
        if is_fine and len(known) < len(lights):
            light = lights[len(known)]
            known.append(LightShare(light.name, *light_share(light, subject, pair)))
            self._working = imgui.get_frame_count()
        strongest = sorted(known, key=lambda share: -max(share.ggx, share.ltc))
        return strongest[:MOST_SHARES]

    def _view(self, editor: Editor, subject: Subject | None) -> LobeView | None:
        """Return what to show, its pictures drawn anew where something changed."""
        free = self.state.mode == "free"
        if subject is None and not free:
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
            lights = self._light_lines(editor, subject)
        return LobeView(title, note, pair, window, scale, (first, second, third), lights)

    def _paint(self, pair: LobePair, window: Window, scale: Scale) -> None:
        """Bring the textures up to date, first coarsely, in the next frame finely."""
        wanted = (pair.case, window, scale.logarithmic)
        if self._drawn is not None and self._drawn[:3] == wanted:
            if self._drawn[3] == FINE:
                return
            size = FINE
        else:
            size = COARSE
        self._upload(lobe_images(pair, size, window, scale), size)
        self._drawn = (*wanted, size)
        self._working = imgui.get_frame_count()

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
