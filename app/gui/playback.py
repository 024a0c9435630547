"""The pictures on lights while the window shows them: they play, change and go missing.

Free of the GUI and of OpenGL. Playing advances a time of its own and makes no step of the
history. Files are looked at twice a second; one that changed is read again, and one that cannot
be read is told once while its light shines plain.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Protocol

from app import pictures
from app.errors import InputError
from app.scene import AreaLight, Picture, Scene

POLL_SECONDS = 0.5


class Reporter(Protocol):
    """Where sentences for the user go."""

    def failure(self, text: str) -> None: ...


class Playback:
    """What the pictures of a scene show at the moment.

    Parameters
    ----------
    reporter : Reporter
        Gets what cannot be read, and what was changed in what could.

    Attributes
    ----------
    is_playing : bool
        Whether time goes on.
    time : float
        For `app.scene.RenderSettings`; it only changes when a picture shows another frame.
    changes : int
        How often a file has changed since the scene was opened.
    """

    def __init__(self, reporter: Reporter) -> None:
        self._reporter = reporter
        self.begin()

    def begin(self) -> None:
        """Start over: another scene is shown now."""
        self.is_playing = True
        self.time = 0.0
        self.changes = 0
        self._clock = 0.0
        self._last_step: float | None = None
        self._next_poll = 0.0
        self._lights: tuple[AreaLight, ...] = ()
        self._readable: tuple[AreaLight, ...] = ()
        self._states: dict[str, object] = {}
        self._durations: dict[tuple[str, float], float] = {}
        self._frames: tuple[object, ...] = ()
        self._scenes: tuple[Scene, Scene] | None = None
        self._told: set[str] = set()

    @property
    def is_moving(self) -> bool:
        """Whether a picture plays, so that there is always something to do."""
        return self.is_playing and any(self.seconds(p) > 0.0 for p in _pictures(self._readable))

    def seconds(self, picture: Picture) -> float:
        """Return the seconds after which a picture begins again, 0 for a still or none at all."""
        key = (picture.file, picture.frames_per_second)
        if key not in self._durations:
            try:
                self._durations[key] = pictures.duration(picture)
            except InputError:
                self._durations[key] = 0.0
        return self._durations[key]

    def toggle(self) -> None:
        """Stop, or go on."""
        self.is_playing = not self.is_playing

    def seek(self, time: float) -> None:
        """Stop at a moment [s]."""
        self.is_playing = False
        self._clock = self.time = time

    def step(self, scene: Scene, now: float) -> Scene:
        """Go on to the present moment, and return the scene as it can be shown.

        Parameters
        ----------
        scene : Scene
            As edited.
        now : float
            A clock that only goes forwards [s].

        Returns
        -------
        Scene
            ``scene`` itself unless a picture cannot be read; its light has none then. The same
            object for the same scene.
        """
        passed = now - self._last_step if self._last_step is not None else 0.0
        self._last_step = now
        if self.is_moving:
            self._clock += passed
        edited = scene.lights is not self._lights
        if edited or now >= self._next_poll:
            self._next_poll = now + POLL_SECONDS
            self._look(scene.lights, edited)
        self._show_frames()
        return self.readable(scene)

    def readable(self, scene: Scene) -> Scene:
        """Return the scene of the last `step` as it can be shown; another one as it is."""
        if scene.lights is not self._lights or self._readable == scene.lights:
            return scene
        if self._scenes is None or self._scenes[0] is not scene:
            self._scenes = (scene, replace(scene, lights=self._readable))
        return self._scenes[1]

    def _look(self, lights: tuple[AreaLight, ...], edited: bool) -> None:
        """Look at the files, and keep pictures that can be read."""
        states = {p.file: pictures.file_state(p) for p in _pictures(lights)}
        changed = {f for f, state in states.items() if self._states.get(f, state) != state}
        if not (edited or changed):
            return
        self._lights, self._states = lights, states
        self._told -= changed
        self._durations = {k: v for k, v in self._durations.items() if k[0] not in changed}
        self.changes += bool(changed)
        readable = tuple(
            light
            if light.picture is None or self._can_read(light)
            else replace(light, picture=None)
            for light in lights
        )
        if readable != self._readable or not changed:
            self._readable, self._scenes = readable, None

    def _can_read(self, light: AreaLight) -> bool:
        """Read a light's picture, and tell the user once what is to tell."""
        assert light.picture is not None
        try:
            reports = pictures.load_frame(light.picture, self.time).reports
            pictures.picture_map(light)
        except InputError as error:
            self._tell(light.picture.file, (str(error),))
            return False
        self._tell(light.picture.file, reports)
        return True

    def _tell(self, file: str, reports: tuple[str, ...]) -> None:
        if reports and file not in self._told:
            self._told.add(file)
            for report in reports:
                self._reporter.failure(report)

    def _show_frames(self) -> None:
        """Take the clock's time once a picture shows another frame at it than at the last."""
        moving = [p for p in _pictures(self._readable) if self.seconds(p) > 0.0]
        try:
            frames = tuple(pictures.frame_at(picture, self._clock) for picture in moving)
        except InputError:  # gone since the last look; the next one tells
            return
        if frames != self._frames:
            self._frames, self.time = frames, self._clock


def _pictures(lights: tuple[AreaLight, ...]) -> list[Picture]:
    return [light.picture for light in lights if light.picture is not None]
