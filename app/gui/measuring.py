"""Measures every technique in the present view, a little in each frame.

What the panel of times plots: the time of each technique's lighting pass, and its error to exact
integrals at random pixels. It has a renderer of its own in the same context, gives it at most
one picture or one program to compile in a frame, and a thread the integrals; nothing of it
exists before somebody asks, and of it only the numbers when it is done.
"""

from __future__ import annotations

import math
from collections.abc import Generator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import moderngl
import numpy as np

from app.measure.entries import Entry, entries_of
from app.measure.errors import (
    choose_points,
    exact_truth,
    has_exact_truth,
    lit_evenly,
    probe_errors,
    sampled_truth,
)
from app.measure.front import pareto_front
from app.panels.measurement import MeasuredPoint, Measurement
from app.render.pack import has_curves
from app.render.renderer import Renderer
from app.render.timers import is_software
from app.scene import RenderSettings, Scene, Shot

TECHNIQUES = (
    "ltc", "ggx:1", "ggx", "ggx:4", "representative-point", "ltc+residual:16",
    "reference:1", "reference:4", "reference:16", "reference:64",
)  # fmt: skip
CURVED = ("ltc:2", "adaptive", "uniform")
"""What differs from ``ltc`` in scenes with curves."""

TRUTH_SAMPLES = 2048
"""Of ``reference`` at a point, where lights have pictures and so no exact integrals."""

POINTS = 96
REPEATS = 3
"""Timed pictures a technique, after one that compiles."""

PATIENCE = 0.02
"""Seconds that the present technique may take for the pictures that are timed: where it takes
longer they are smaller, since others take up to ten times as long."""

SMALLEST = 64
"""Pixels of their shorter side at least."""


class StoppedError(Exception):
    """Tells the thread that nobody waits for it any more."""


class Measuring:
    """One measurement at a time.

    Attributes
    ----------
    shot : Shot or None
        The view that was measured last, or is being measured.
    """

    def __init__(self) -> None:
        self.shot: Shot | None = None
        self._points: tuple[MeasuredPoint, ...] = ()
        self._doing = ""
        self._progress = 0.0
        self._size = (0, 0)
        self._work: Generator[None] | None = None

    @property
    def is_busy(self) -> bool:
        return self._work is not None

    def state(self, shown: Shot) -> Measurement:
        """Return what the panel shows beside the picture of a shot."""
        about = ""
        if self._points and self.shot is not None:
            exact = has_exact_truth(self.shot.scene)
            truth = "exact integrals" if exact else f"{TRUTH_SAMPLES} samples of reference"
            about = f"At {self._size[0]} × {self._size[1]} pixels, by {truth} at {POINTS} pixels "
            about += "for lights of radiance 1 on white."
            if self.shot.scene is not shown.scene:
                about = f"Of an earlier view. {about}"
        return Measurement(self._points, self._doing, self._progress, about)

    def begin(self, ctx: moderngl.Context, shot: Shot, seconds: float) -> None:
        """Start to measure a shot of whose pictures one takes ``seconds``."""
        self.stop()
        share = min(1.0, math.sqrt(PATIENCE / seconds)) if seconds > 0.0 else 1.0
        share = max(share, min(1.0, SMALLEST / min(shot.width, shot.height)))
        self._size = (max(round(share * shot.width), 1), max(round(share * shot.height), 1))
        self.shot, self._points = shot, ()
        self._work = self._measure(ctx, shot.scene)

    def step(self, ctx: moderngl.Context) -> None:
        """Do the next bit, if there is any; raises what rendering raises, and then is over."""
        if self._work is None:
            return
        try:
            next(self._work)
        except StopIteration:
            self._end()
        except Exception:
            self._end()
            raise
        finally:
            ctx.screen.use()

    def stop(self) -> None:
        """Give up; what is known so far stays."""
        if self._work is not None:
            self._work.close()
            self._end()

    def _end(self) -> None:
        self._work, self._doing, self._progress = None, "", 0.0

    def _measure(self, ctx: moderngl.Context, scene: Scene) -> Generator[None]:
        """Do a frame's worth of work between one ``yield`` and the next."""
        names = (*TECHNIQUES, *(CURVED if has_curves(scene.lights) else ()))
        entries = entries_of(scene, names)
        steps = 1 + len(entries) * (2 + REPEATS) + POINTS
        done = 0
        is_wanted = True

        def advance(doing: str) -> None:
            nonlocal done
            done += 1
            self._doing, self._progress = doing, min(done / steps, 1.0)

        def more(count: int) -> None:  # called in the thread
            nonlocal done
            done += count
            if not is_wanted:
                raise StoppedError

        renderer = Renderer(ctx)
        if is_software(str(ctx.info["GL_RENDERER"])):
            renderer.use_clock("wall clock")
        pool = ThreadPoolExecutor(1, "exact integrals")
        try:
            advance("choosing pixels")
            yield
            renderer.render(Shot(scene, RenderSettings("ltc"), *self._size))
            lit = lit_evenly(scene)
            points = choose_points(renderer, lit, POINTS)
            times: dict[Entry, float] = {}
            for entry in entries:
                shot = Shot(scene, replace(entry.settings(), samples=1), *self._size)
                found = []
                for index in range(1 + REPEATS):
                    advance(f"timing {entry}")
                    yield
                    renderer.render(shot)
                    yield  # the GPU has a frame's time to finish
                    if index > 0:
                        found.append(renderer.timings().get("lighting", 0.0))
                times[entry] = entry.samples * float(np.median(found))
            # Not before: while something is timed nothing else runs.
            if has_exact_truth(lit):
                future = pool.submit(lambda: exact_truth(lit, points, "ggx", on_done=more))
                while not future.done():
                    self._doing, self._progress = "integrating exactly", min(done / steps, 1.0)
                    yield
                truth = future.result()
            else:
                self._doing = "sampling the truth"
                yield
                truth = sampled_truth(renderer, lit, points, TRUTH_SAMPLES)
            for entry in entries:
                advance(f"comparing {entry}")
                yield
                errors = probe_errors(renderer, lit, entry, points, truth)
                if errors and times[entry] > 0.0:
                    self._add(str(entry), times[entry], errors["specular"].mean)
        finally:
            is_wanted = False
            pool.shutdown(wait=False, cancel_futures=True)
            renderer.release()

    def _add(self, name: str, milliseconds: float, error: float) -> None:
        points = [*self._points, MeasuredPoint(name, milliseconds, error, False)]
        fronts = pareto_front([(point.milliseconds, point.error) for point in points])
        self._points = tuple(
            replace(point, on_front=on) for point, on in zip(points, fronts, strict=True)
        )
