"""Errors that are the input's fault, each one sentence for the user.

The command line prints an `InputError` to stderr without a traceback and exits
with 2; the window shows it as a message. The sentence names the file, the
place in it, what was found there and what was expected.
"""

from __future__ import annotations

import difflib
import json
from collections.abc import Iterable
from pathlib import Path

LONGEST_QUOTE = 60
"""Characters of a found value that a sentence quotes before it is cut."""


class InputError(Exception):
    """Bad input. The message is one sentence on one line, without a full stop."""

    def __init__(self, message: str) -> None:
        super().__init__(" ".join(message.split()))


def nearest(word: str, known: Iterable[str]) -> str | None:
    """Return the member of ``known`` that ``word`` most probably means, or None."""
    names = list(known)
    folded = {name.casefold(): name for name in names}
    matches = difflib.get_close_matches(word.casefold(), folded, n=1, cutoff=0.6)
    return folded[matches[0]] if matches else None


def expected_one_of(word: str, known: Iterable[str]) -> str:
    """Return "expected one of a, b, c", and the nearest match of ``word`` if there is one."""
    names = list(known)
    guess = nearest(word, names)
    meant = f" (did you mean '{guess}'?)" if guess else ""
    return f"expected one of {', '.join(names) or 'none'}{meant}"


def quote(text: str) -> str:
    """Return ``text`` in double quotes, on one line, cut to `LONGEST_QUOTE` characters."""
    if len(text) > LONGEST_QUOTE:
        text = text[: LONGEST_QUOTE - 3] + "..."
    return json.dumps(text, ensure_ascii=not text.isprintable())


def describe(value: object) -> str:
    """Return a JSON value in words: its kind, and the value itself if it is short."""
    if value is None:
        return "null"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return f"the text {quote(value)}"
    if isinstance(value, list | tuple):
        return f"a list of {len(value)}" if value else "an empty list"
    if isinstance(value, dict):
        return "an object" if value else "an empty object"
    text = str(value)
    if len(text) > LONGEST_QUOTE:
        text = text[: LONGEST_QUOTE - 3] + "..."
    return f"the number {text}"


def os_reason(error: OSError) -> str:
    """Return the operating system's reason in lower case, such as "permission denied"."""
    return (error.strerror or type(error).__name__).lower()


def require_file(path: Path, kind: str) -> None:
    """Raise `InputError` unless ``path`` is an existing regular file.

    ``kind`` says what the file should be, such as "a scene file".
    """
    try:
        if path.is_file():
            return
        if path.is_dir():
            found = "this is a folder"
        elif path.exists():
            found = "this is not a regular file"
        else:
            found = "there is no such file"
    except (OSError, ValueError) as error:
        found = os_reason(error) if isinstance(error, OSError) else "this is not a possible path"
    raise InputError(f"{path}: {found}, expected {kind}")
