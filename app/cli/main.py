"""The ``ltc-viewer`` command: finds the sub-command, and turns errors into exit codes.

A first argument that is no command is a scene for the window, so that both
``ltc-viewer scene.json`` and ``ltc-viewer shot scene.json -o a.png`` work.

Exit codes: 0 success, 2 bad input, 1 any other failure, 130 after Ctrl+C. Results go to stdout,
everything else to stderr. Errors are one sentence; with the environment
variable LTC_VIEWER_TRACEBACK set, a traceback follows it.
"""

from __future__ import annotations

import os
import sys
import traceback
from collections.abc import Sequence
from importlib import metadata
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from app.cli.bench import bench
from app.cli.common import FailureError, messages, scene_path
from app.cli.compare import compare
from app.cli.explain import explain
from app.cli.lobe import lobe
from app.cli.probe import probe
from app.cli.report import report
from app.cli.shot import shot
from app.cli.stability import stability
from app.errors import InputError, nearest, os_reason
from app.scene import SceneError
from app.scene_io import load_scene

PROGRAM = "ltc-viewer"
INTERRUPTED = 130
TRACEBACK = "LTC_VIEWER_TRACEBACK"


class SceneOrCommandGroup(TyperGroup):
    """A group of commands whose first argument may also be a scene for the window."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Put the hidden command ``window`` before arguments that name no command."""
        first = args[0] if args else ""
        own_options = {"-h", "--help", "--version"}
        if first not in self.commands and first not in own_options:
            _refuse_misspelt_command(first, [name for name in self.commands if name != "window"])
            args = ["window", *args]
        return super().parse_args(ctx, args)


def _refuse_misspelt_command(word: str, commands: list[str]) -> None:
    is_word = word.isalpha() and not Path(word).exists()
    guess = nearest(word, commands) if is_word else None
    if guess:
        raise InputError(
            f"'{word}' is neither a command nor a scene file, "
            f"expected one of {', '.join(commands)} (did you mean '{guess}'?)"
        )


app = typer.Typer(
    cls=SceneOrCommandGroup,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _version(value: bool) -> None:
    if value:
        try:
            typer.echo(f"{PROGRAM} {metadata.version(PROGRAM)}")
        except metadata.PackageNotFoundError:
            typer.echo(f"{PROGRAM} (not installed)")
        raise typer.Exit


@app.callback(
    subcommand_metavar="[SCENE | COMMAND [ARGS]...]",
    help="""Look at, measure and take away real-time area lighting.

Without a command the window opens, with SCENE if one is given.

\b
Examples:
  ltc-viewer
  ltc-viewer scene.json
  ltc-viewer shot scene.json -o picture.png
""",
)
def root(
    version: Annotated[
        bool,
        typer.Option("--version", help="Print the version.", callback=_version, is_eager=True),
    ] = False,
) -> None:
    """Take the options that stand before any command."""
    del version


@app.command(hidden=True)
def window(
    scene: Annotated[
        str | None,
        typer.Argument(metavar="SCENE", help="Scene file, or the name of a demo scene."),
    ] = None,
) -> None:
    """Open the window.

    \b
    Example:
      ltc-viewer scene.json
    """
    path = None
    if scene is not None:
        path = scene_path(scene)
        load_scene(path)  # bad input is told before a window appears
    if sys.platform.startswith("linux") and not (
        os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    ):
        raise FailureError(
            "there is no display here (DISPLAY and WAYLAND_DISPLAY are empty): run on a desktop "
            "or through 'ssh -X', or render without a window with "
            f"'{PROGRAM} shot {scene or 'SCENE'} -o picture.png'"
        )
    try:
        from app.window import run as run_window
    except ImportError as error:  # a system library that the GUI is linked with
        from app.context import explain_failure

        raise FailureError(explain_failure(str(error))) from error
    raise typer.Exit(run_window(path))


app.command()(shot)
app.command()(probe)
app.command()(bench)
app.command()(report)
app.command()(stability)
app.command()(compare)
app.command()(lobe)
app.command()(explain)


def run(argv: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code.

    Parameters
    ----------
    argv : sequence of str, optional
        Arguments without the program's name; ``sys.argv`` by default.
    """
    try:
        code = app(args=argv, prog_name=PROGRAM, standalone_mode=False)
    except (InputError, SceneError) as error:
        return _fail(str(error), 2)
    except FailureError as error:
        return _fail(str(error), 1)
    except typer.Exit as error:
        return error.exit_code
    except (typer.Abort, KeyboardInterrupt):
        code = INTERRUPTED
    except BrokenPipeError:
        # The reader of stdout went away; leave Python nothing to flush into it.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except OSError as error:  # a full disk, say
        return _fail(f"{error.filename or 'output'}: {os_reason(error)}", 1)
    except Exception as error:
        usage = _usage_sentence(error)
        if usage is not None:
            return _fail(usage, 2)
        return _fail(f"internal error: {type(error).__name__}: {error}", 1)
    if code == INTERRUPTED:  # typer's own code for Ctrl+C
        return _fail("interrupted", INTERRUPTED)
    return code if isinstance(code, int) else 0


def _usage_sentence(error: Exception) -> str | None:
    """Return what is wrong with the arguments, or None if the error is another one."""
    # Typer brings its own copy of click or uses click itself, by version: ask for the shape.
    if not (hasattr(error, "format_message") and hasattr(error, "exit_code")):
        return None
    message = " ".join(str(error.format_message()).split()).rstrip(".")
    message = message[:1].lower() + message[1:].replace(" Did you mean", " (did you mean")
    if "(did you mean" in message:
        message = message.rstrip("?") + "?)"
    context = getattr(error, "ctx", None)
    command = context.command_path if context is not None else PROGRAM
    return f"{message}, see '{command.removesuffix(' window')} --help' for an example"


def _fail(sentence: str, code: int) -> int:
    one_line = " ".join(sentence.split())
    messages().print(f"{PROGRAM}: {one_line}", markup=False)
    if os.environ.get(TRACEBACK):
        traceback.print_exc()
    return code
