"""Exporting pictures: from the dialog to the file, a few samples in each frame."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from pathlib import Path

from app.camera_control import widened
from app.editor import Editor
from app.gui.dialogs import FileDialogs
from app.gui.messages import Messages
from app.gui.viewport import Viewport
from app.images import IMAGE_SUFFIXES, save_image
from app.panels.export import Export, export_dialog, export_progress
from app.render.cost import WithLegend
from app.render.renderer import Renderer
from app.scene import RenderSettings, Scene, Shot

PICTURE_FILES = ("Pictures", IMAGE_SUFFIXES)
FRAME_SECONDS = 0.05
"""How long one frame may spend on an export before the window is shown again."""


def shot_of(scene: Scene, settings: RenderSettings, export: Export) -> Shot:
    """Return the shot of a picture file, framed as in the window."""
    camera = widened(scene.camera, export.width / export.height)
    settings = replace(settings, samples=export.samples)
    return Shot(replace(scene, camera=camera), settings, export.width, export.height)


@dataclass
class Job:
    """A picture on its way to a file, with a renderer of its own and the samples done."""

    path: Path
    shot: Shot
    renderer: Renderer
    done: int = 0

    @property
    def total(self) -> int:
        return self.shot.settings.samples

    @property
    def is_done(self) -> bool:
        return self.done >= self.total

    def step(self) -> None:
        """Add a sample."""
        self.done = self.renderer.accumulate(self.shot, self.total)


class Exports:
    """The export dialog, and the picture under way if there is one.

    Parameters
    ----------
    editor, viewport
        What to export: the scene, and the settings with which it is shown.
    renderer : Renderer
        Each picture gets another one in this one's context.
    messages, dialogs
        Get what to say, and ask where to write.
    """

    def __init__(
        self,
        editor: Editor,
        viewport: Viewport,
        renderer: Renderer,
        messages: Messages,
        dialogs: FileDialogs,
    ) -> None:
        self.form = Export()
        self._editor, self._viewport, self._renderer = editor, viewport, renderer
        self._messages, self._dialogs = messages, dialogs
        self._is_asked = False
        self._job: Job | None = None

    @property
    def is_busy(self) -> bool:
        """Whether a picture is under way."""
        return self._job is not None

    def ask(self) -> None:
        """Open the dialog in the next frame."""
        self._is_asked = True

    def start(self, path: Path, export: Export | None = None) -> None:
        """Start to render a picture file, as the dialog says unless told; see `is_busy`."""
        with self._messages.guard():
            scene = self._viewport.playback.readable(self._editor.scene)
            shot = shot_of(scene, self._viewport.settings, export or self.form)
            self._job = Job(path, shot, Renderer(self._renderer.ctx))

    def draw(self) -> None:
        """Draw the dialog or the progress, and go on with the picture under way."""
        if self._job is None:
            pixels = self._viewport.view.pixels
            self.form, goes_on = export_dialog(self.form, pixels, self._is_asked)
            self._is_asked = False
            if goes_on:
                path = self._editor.path or Path.home() / "picture"
                proposal = path.with_suffix(f".{self.form.kind}")
                self._dialogs.ask_save("Export a picture", PICTURE_FILES, proposal, self.start)
        else:
            self._go_on(self._job)

    def _go_on(self, job: Job) -> None:
        """Add samples for a moment, show how far it is, and write the file at the end."""
        stopped = export_progress(job.path.name, job.done, job.total)
        end = time.perf_counter() + FRAME_SECONDS
        try:
            while not stopped and not job.is_done and time.perf_counter() < end:
                job.step()
            if job.is_done:
                shows_cost = job.shot.settings.view == "cost"
                save_image(WithLegend(job.renderer) if shows_cost else job.renderer, job.path)
                self._messages.note(f"Wrote {job.path.name}")
        except Exception as failure:
            stopped = True
            self._messages.failure(str(failure) or type(failure).__name__)
        if stopped or job.is_done:
            self.release()
        self._renderer.ctx.screen.use()

    def release(self) -> None:
        """Give up the picture under way."""
        if self._job is not None:
            self._job.renderer.release()
            self._job = None
