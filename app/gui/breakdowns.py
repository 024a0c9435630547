"""Finds out whose an error is while the window goes on: points a few a frame, the rest aside."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor

from app.errors import InputError
from app.gui.live_picture import LivePicture
from app.render.breakdown import Breakdown, break_down
from app.render.gathering import Gathering, Points, check_breakdown
from app.render.renderer import Renderer
from app.scene import Shot

GATHERING = 0.008
"""Seconds of a frame for asking the GPU about points."""


class BreakdownWork:
    """One breakdown at a time, and the last one that came out.

    Parameters
    ----------
    renderer : Renderer
        Of the picture whose error it is.

    Attributes
    ----------
    result : Breakdown or None
    of : Shot or None
        What ``result`` is of.
    problem : str
        Why there is none, empty where there is no reason.
    """

    def __init__(self, renderer: Renderer) -> None:
        self.result: Breakdown | None = None
        self.of: Shot | None = None
        self.problem = ""
        self._renderer = renderer
        self._gathering: Gathering | None = None
        self._wanted = 0
        self._subject: Shot | None = None
        self._future: Future[Breakdown] | None = None
        self._steps = (0, 0)
        self._stop = threading.Event()

    @property
    def is_busy(self) -> bool:
        return self._gathering is not None or self._future is not None

    @property
    def needs_frames(self) -> bool:
        """Whether it goes on with every frame; the rest is computed aside."""
        return self._gathering is not None

    @property
    def progress(self) -> str:
        """What is being done, empty if nothing is."""
        if self._gathering is not None:
            return f"Looking at points: {self._gathering.done} of {self._wanted}"
        if self._future is not None:
            done, total = self._steps
            return f"Computing in float64: {done} of {total}" if total else "Computing in float64"
        return ""

    def is_of(self, picture: LivePicture) -> bool:
        """Tell whether the result belongs to what a picture shows."""
        return self.of is not None and _shows(picture, self.of)

    def start(
        self, picture: LivePicture, places: Iterator[tuple[float, float]], wanted: int
    ) -> None:
        """Begin with points at ``places`` of a picture, or give up what is under way."""
        if self.is_busy:
            self.cancel()
            return
        shot = picture.shot
        if shot is None or picture.has_failed:
            return
        self.result, self.of, self.problem = None, None, ""
        self._subject, self._wanted = shot, wanted
        self._gathering = Gathering(self._renderer, shot, places, wanted)

    def step(self, picture: LivePicture) -> None:
        """Go on for a few milliseconds; call once a frame."""
        if self._gathering is not None:
            if self._subject is None or not _shows(picture, self._subject):
                self.cancel()  # the picture is another one now
                return
            end = time.perf_counter() + GATHERING
            is_last = False
            while not is_last and time.perf_counter() < end:
                is_last = self._gathering.step()
            if is_last:
                self._compute(self._gathering.points(), self._subject)
                self._gathering = None
            self._renderer.ctx.screen.use()
        if self._future is not None and self._future.done():
            future, self._future = self._future, None
            try:
                self.result, self.of = future.result(), self._subject
            except CancelledError:
                return

    def _compute(self, points: Points, shot: Shot) -> None:
        if not points.count:
            self.problem = "No surface was found."
            return
        stop = self._stop = threading.Event()
        self._steps = (0, 0)

        def progress(done: int, total: int) -> None:
            self._steps = (done, total)
            if stop.is_set():
                raise CancelledError

        worker = ThreadPoolExecutor(1, thread_name_prefix="breakdown")
        self._future = worker.submit(
            break_down, points, shot.scene, shot.settings.technique, progress
        )
        worker.shutdown(wait=False)

    def cancel(self) -> None:
        """Give up what is under way."""
        self._stop.set()
        self._gathering = self._future = None


def _shows(picture: LivePicture, shot: Shot) -> bool:
    """Tell whether a picture shows what ``shot`` does, in whatever size."""
    shown = picture.shot
    return shown is not None and shown.scene is shot.scene and shown.settings == shot.settings


def refusal(picture: LivePicture) -> str:
    """Return why the parts of a picture's error cannot be told, empty if they can."""
    shot = picture.shot
    if shot is None or picture.has_failed:
        return "There is no picture."
    try:
        check_breakdown(shot.settings.technique, shot.scene)
    except InputError as reason:
        return str(reason)
    return ""
