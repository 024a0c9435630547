"""What several commands share: arguments, progress, and the headless renderer."""

from __future__ import annotations

import math
import re
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TaskID,
    TextColumn,
    TimeRemainingColumn,
)

from app.errors import InputError, nearest
from app.meshes import load_mesh
from app.pictures import load_frame
from app.render.techniques import technique_lines
from app.scene import MAX_IMAGE_SIDE, MAX_SAMPLES, Scene
from app.scene_io import demo_scenes, load_scene

if TYPE_CHECKING:
    import moderngl

    from app.render.renderer import Renderer

DEFAULT_SIZE = "1280x720"

PROGRESS_AFTER = 1.0
"""Seconds of work before a progress bar appears."""


class FailureError(Exception):
    """Something failed that is not the input's fault: one sentence, exit code 1."""


def messages() -> Console:
    """Return a console on today's stderr: everything that is not a result goes there."""
    return Console(file=sys.stderr, stderr=True, highlight=False, soft_wrap=True)


def results() -> Console:
    """Return a console on today's stdout, for tables; without a terminal it is never folded."""
    console = Console(file=sys.stdout, highlight=False)
    if not console.is_terminal:
        console.width = 160
    return console


def whole_number(option: str, least: int, most: int) -> Callable[[str | int], int]:
    """Return a reader of an option's whole number that names the option in its errors."""

    def read(value: str | int) -> int:
        expected = f"expected a whole number from {least} to {most}"
        try:
            number = int(value)
        except ValueError:
            raise InputError(f"{option} is '{value}', {expected}") from None
        if not least <= number <= most:
            raise InputError(f"{option} is {number}, {expected}")
        return number

    return read


def share_of_white(value: str | float) -> float:
    """Read ``--cull``: a number from 0 to 1, or a fraction such as 1/1024."""
    try:
        share = float(Fraction(value))
    except (ValueError, ZeroDivisionError):
        share = math.nan
    if not 0.0 <= share <= 1.0:
        raise InputError(
            f"--cull is '{value}', expected a number from 0 to 1 or a fraction such as 1/4096"
        )
    return share


def list_techniques(value: list[str] | str | None) -> list[str] | str | None:
    """Print the techniques and leave, if one of those asked for is ``help``."""
    names = [value] if isinstance(value, str) else value or []
    if "help" in names:
        for line in technique_lines():
            typer.echo(line)
        raise typer.Exit
    return value


SceneArgument = Annotated[
    str, typer.Argument(metavar="SCENE", help="Scene file, or the name of a demo scene.")
]
SizeOption = Annotated[
    str, typer.Option("--size", metavar="WxH", help="Width and height in pixels.")
]
SamplesOption = Annotated[
    int,
    typer.Option(
        "--samples",
        metavar="N",
        help="Samples per pixel; 1 is exactly the pixel centre.",
        parser=whole_number("--samples", 1, MAX_SAMPLES),
    ),
]
TechniqueOption = Annotated[
    str,
    typer.Option(
        "--technique",
        metavar="NAME[:N]",
        help="How to shade; 'help' lists the techniques.",
        callback=list_techniques,
        is_eager=True,
    ),
]
CullOption = Annotated[
    float,
    typer.Option(
        "--cull",
        metavar="SHARE",
        help="Skip lights while all skipped at a pixel stay below this share of display white, "
        "such as 1/4096.",
        parser=share_of_white,
        show_default="off",
    ),
]
EverythingOption = Annotated[
    bool,
    typer.Option("--everything", help="Compare with one program for all scenes, all left in."),
]
TechniquesOption = Annotated[
    list[str],
    typer.Option(
        "--technique",
        metavar="NAME[:N]",
        help="How to shade; repeat for several, 'help' lists them.",
        callback=list_techniques,
        is_eager=True,
    ),
]


def scene_path(name: str) -> Path:
    """Return the file that a SCENE argument means: a path, or the name of a demo scene."""
    path = Path(name)
    if path.suffix or path.exists() or path.parent != Path():
        return path
    demos = demo_scenes()
    if name in demos:
        return demos[name]
    guess = nearest(name, demos)
    meant = f" (did you mean '{guess}'?)" if guess else ""
    raise InputError(
        f"{name}: there is no such file, expected a scene file (.json) "
        f"or a demo scene ({', '.join(demos) or 'none here'}){meant}"
    )


def named_scene(name: str, time: float = 0.0) -> Scene:
    """Load the scene that a SCENE argument means, its meshes and pictures.

    Both are cached, so reading them here costs nothing later, and a damaged
    one is told with its place before anything is drawn. ``time`` [s] is the
    moment of animated pictures. What was changed in a picture goes to stderr.
    """
    path = scene_path(name)
    scene = load_scene(path)
    for index, item in enumerate(scene.objects):
        try:
            load_mesh(item.mesh)
        except InputError as error:
            raise InputError(f"{path}: objects[{index}].mesh: {error}") from None
    told: set[str] = set()
    for index, light in enumerate(scene.lights):
        if light.picture is not None:
            try:
                told |= set(load_frame(light.picture, time).reports)
            except InputError as error:
                raise InputError(f"{path}: lights[{index}].picture: {error}") from None
    for report in sorted(told):
        messages().print(report, markup=False)
    return scene


def image_size(text: str) -> tuple[int, int]:
    """Return width and height from text such as "1280x720"."""
    match = re.fullmatch(r"\s*(\d{1,9})\s*[xX×]\s*(\d{1,9})\s*", text)
    if not match:
        raise InputError(f"--size is '{text}', expected WIDTHxHEIGHT such as {DEFAULT_SIZE}")
    width, height = int(match[1]), int(match[2])
    if not (1 <= width <= MAX_IMAGE_SIDE and 1 <= height <= MAX_IMAGE_SIDE):
        raise InputError(
            f"--size is '{text}', expected width and height from 1 to {MAX_IMAGE_SIDE}"
        )
    return width, height


@contextmanager
def headless_renderer() -> Iterator[tuple[moderngl.Context, Renderer]]:
    """Open a context without a window, and a renderer in it.

    Raises
    ------
    FailureError
        If there is no OpenGL: that is not the input's fault.
    """
    from app.context import ContextError, headless_context
    from app.render.renderer import Renderer

    try:
        ctx = headless_context()
    except ContextError as error:
        raise FailureError(str(error)) from error
    renderer = Renderer(ctx)
    try:
        yield ctx, renderer
    finally:
        renderer.release()


class Steps:
    """A progress bar on stderr that appears once the work takes longer than a second."""

    def __init__(self, label: str, total: int) -> None:
        self.count = 0
        self._label = label
        self._total = total
        self._start = time.monotonic()
        self._progress: Progress | None = None
        self._task = TaskID(0)

    def __enter__(self) -> Steps:
        return self

    def __exit__(self, *_: object) -> None:
        if self._progress is not None:
            self._progress.stop()

    def done(self, count: int) -> None:
        """Say how many of the steps are done."""
        self.count = count
        late = time.monotonic() - self._start > PROGRESS_AFTER
        # Elsewhere than on a terminal rich would leave a blank line for the bar.
        if self._progress is None and late and messages().is_terminal:
            self._progress = Progress(
                TextColumn("{task.description}"),
                BarColumn(),
                MofNCompleteColumn(),
                TimeRemainingColumn(),
                console=messages(),
                transient=True,
            )
            self._task = self._progress.add_task(self._label, total=self._total)
            self._progress.start()
        if self._progress is not None:
            self._progress.update(self._task, completed=count)
