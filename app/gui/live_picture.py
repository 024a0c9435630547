"""The picture of the scene as it is now: when a sample is rendered, and at what size.

While something moves, each frame shows one fresh sample, smaller where a
full-size one takes longer than `SLOW`. When nothing moves, samples gather up to
the wanted number, and then no pass runs at all. Slow ones wait while the user
moves the mouse or types: the window answers at once, the picture has time.
"""

from __future__ import annotations

import math
import time
import traceback
from collections import deque
from dataclasses import replace
from typing import Protocol

import moderngl
from imgui_bundle import ImVec2, imgui

from app.errors import InputError
from app.gui import theme
from app.gui.overlays import View
from app.render.noise import Noise
from app.render.renderer import Renderer
from app.scene import Camera, RenderSettings, Scene, Shot

SLOW = 0.045
"""Seconds for a full-size sample from which on moving pictures are smaller."""
SETTLE = 0.2
"""Seconds without movement after which a smaller picture becomes full-size; more, up to
`LONGEST_SETTLE`, where a full-size sample takes longer than that."""
LONGEST_SETTLE = 1.0

KEYS = tuple(key for key in imgui.Key if imgui.Key.tab <= key < imgui.Key.gamepad_start)
"""Those of the keyboard."""

LOOK_AGAIN = 1.25
"""Noise is estimated anew after this many times as many samples: it waits for the GPU."""

SMALLEST = 4
"""Most that width and height of a moving picture are divided by."""


class Reporter(Protocol):
    """Where sentences for the user go."""

    def failure(self, text: str) -> None: ...


class LivePicture:
    """Renders the scene sample by sample and shows the result.

    Parameters
    ----------
    renderer : Renderer
        This class alone decides when it renders.
    reporter : Reporter
        Gets the failures of rendering.

    Attributes
    ----------
    shot : Shot or None
        What the picture shows.
    samples : (done, wanted)
    history : deque of float
        Milliseconds of the last samples.
    noise : Noise or None
        The estimated error of a picture made of random samples, as it was when they last were
        `LOOK_AGAIN` times as many.
    seconds : float
        What its samples took so far.
    """

    def __init__(self, renderer: Renderer, reporter: Reporter) -> None:
        self.shot: Shot | None = None
        self.samples = (0, 0)
        self.history: deque[float] = deque(maxlen=120)
        self.noise: Noise | None = None
        self.seconds = 0.0
        self._renderer = renderer
        self._reporter = reporter
        self._wanted: tuple[Scene, float] | None = None
        self._shown: tuple[Scene, Camera, Scene] | None = None
        self._failed: Shot | None = None
        self._full_size_seconds = 0.0
        self._divisor = 1
        self._changed_at = 0.0
        self._touched_at = 0.0

    @property
    def full_size_seconds(self) -> float:
        """About how long a sample at full size takes."""
        return self._full_size_seconds

    @property
    def has_failed(self) -> bool:
        """Whether the present scene could not be rendered."""
        return self._failed is not None

    def is_settled(self, pixels: tuple[int, int]) -> bool:
        """Return whether it has all its samples at full size, or never will."""
        if self.has_failed:
            return True
        shot = self.shot
        return (
            shot is not None
            and self.samples[0] >= self.samples[1]
            and (shot.width, shot.height) == pixels
        )

    def render(
        self, scene: Scene, camera: Camera, settings: RenderSettings, pixels: tuple[int, int]
    ) -> None:
        """Add a sample unless the picture has all of them; never let a failure out.

        Parameters
        ----------
        camera : Camera
            What the scene is seen with, instead of its own.
        pixels : (width, height)
            Of the picture at full size.
        """
        now = time.monotonic()
        if _is_touched():
            self._touched_at = now
        wanted = self._wanted
        if wanted is None or wanted[1] != settings.time or _other_radiance(wanted[0], scene):
            self._changed_at = now
        self._wanted = (scene, settings.time)
        patience = min(max(SETTLE, self._full_size_seconds), LONGEST_SETTLE)
        moving = now - self._changed_at < patience
        width, height = pixels
        divisor = 1
        if moving and self._full_size_seconds > SLOW:
            divisor = min(math.ceil(math.sqrt(self._full_size_seconds / SLOW)), SMALLEST)
        width, height = math.ceil(width / divisor), math.ceil(height / divisor)
        if self._shown is None or self._shown[0] is not scene or self._shown[1] != camera:
            self._shown = (scene, camera, replace(scene, camera=camera))
        shot = Shot(self._shown[2], replace(settings, samples=1), width, height)
        if shot == self._failed:
            return
        is_slow = self._full_size_seconds > SLOW
        waits = is_slow and now - self._touched_at < SETTLE and self.samples[0] > 0
        if shot == self.shot:
            # Whoever now wants fewer samples than there are has all of them.
            done = self.samples[0]
            self.samples = (done, max(done, settings.samples))
            if waits or done >= settings.samples:
                return
        try:
            began = time.perf_counter()
            samples = self._renderer.accumulate(shot, settings.samples)
            seconds = time.perf_counter() - began
            self._look_at_noise(samples, settings.samples)
        except Exception as failure:
            if not isinstance(failure, InputError):
                traceback.print_exc()
            self._failed, self.samples = shot, (0, settings.samples)
            self._reporter.failure(str(failure) or type(failure).__name__)
            return
        finally:
            self._renderer.ctx.screen.use()
        self._failed, self.shot, self.samples = None, shot, (samples, settings.samples)
        timings = self._renderer.timings(wait=False)
        gpu = sum(value for name, value in timings.items() if name != "cpu") / 1e3
        self.history.append(1e3 * max(seconds, gpu))
        self.seconds = max(seconds, gpu) + (self.seconds if samples > 1 else 0.0)
        # The GPU's figures are those of the sample before, the size of which counts.
        self._full_size_seconds = seconds + gpu * self._divisor**2
        self._divisor = divisor

    def begin_again(self) -> None:
        """Render everything anew: a file that the scene names has changed."""
        self._failed, self.samples = None, (0, self.samples[1])
        self._renderer.begin_again()

    def _look_at_noise(self, samples: int, wanted: int) -> None:
        if samples == 1:
            self.noise = None
        before = self.noise.samples if self.noise is not None else 1
        is_last = samples >= wanted - wanted % 2
        if samples % 2 == 0 and (is_last or samples >= LOOK_AGAIN * before):
            self.noise = self._renderer.noise()

    def draw(self, view: View) -> None:
        """Draw the picture, or its absence, into the current Dear ImGui window."""
        draw = imgui.get_window_draw_list()
        low, high = ImVec2(view.x, view.y), ImVec2(view.x + view.width, view.y + view.height)
        if self.shot is None or self.has_failed:
            draw.add_rect_filled(low, high, theme.u32(theme.grey(0.07)))
            return
        texture = self._renderer.texture
        self._renderer.ctx.screen.use()
        draw_texture(texture, view)


def draw_texture(texture: moderngl.Texture, view: View) -> None:
    """Draw a picture with row 0 at the bottom over the whole view, smooth if it is smaller."""
    kind = moderngl.NEAREST if texture.size == view.pixels else moderngl.LINEAR
    if texture.filter != (kind, kind):
        texture.filter = (kind, kind)
    low, high = ImVec2(view.x, view.y), ImVec2(view.x + view.width, view.y + view.height)
    reference = imgui.ImTextureRef(texture.glo)
    draw = imgui.get_window_draw_list()
    draw.add_image(reference, low, high, ImVec2(0.0, 1.0), ImVec2(1.0, 0.0))


def _is_touched() -> bool:
    """Tell whether the user does something in this frame: mouse, wheel or any key."""
    io = imgui.get_io()
    moved = io.mouse_delta.x or io.mouse_delta.y or io.mouse_wheel or io.mouse_wheel_h
    return bool(moved) or imgui.is_any_mouse_down() or any(map(imgui.is_key_down, KEYS))


def _other_radiance(a: Scene, b: Scene) -> bool:
    """Tell whether two scenes may differ in more than exposure and tone map."""
    return not (
        a.camera is b.camera
        and a.lights is b.lights
        and a.objects is b.objects
        and a.materials is b.materials
    )
