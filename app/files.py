"""Paths in files, reading what is not too large, and writing in one step.

After writing the old or the whole new file is there, never half.
"""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Sequence
from pathlib import Path

from app.errors import InputError, expected_one_of, os_reason, require_file


def check_output(path: Path, kind: str, suffixes: Sequence[str] = ()) -> None:
    """Raise `InputError` unless a file can be written at ``path``.

    Parameters
    ----------
    path : Path
        Where the file shall be; an existing file may be replaced.
    kind : str
        What will be written, such as "a picture".
    suffixes : sequence of str
        Allowed suffixes in lower case, such as ".png"; any if empty.
    """
    if path.is_dir():
        raise InputError(f"{path}: this is a folder, expected the name of {kind}")
    if suffixes and path.suffix.lower() not in suffixes:
        found = f"the suffix '{path.suffix}'" if path.suffix else "no suffix"
        raise InputError(
            f"{path}: found {found} for {kind}, {expected_one_of(path.suffix, suffixes)}"
        )
    folder = path.parent
    if not folder.exists():
        raise InputError(f"{path}: the folder {folder} does not exist, expected one that does")
    if not folder.is_dir():
        raise InputError(f"{path}: {folder} is not a folder, expected one")
    if not os.access(folder, os.W_OK) or (path.exists() and not os.access(path, os.W_OK)):
        raise InputError(f"{path}: permission denied, expected a writable place for {kind}")


def replace_file(path: Path, data: bytes, kind: str) -> None:
    """Write ``data`` beside ``path``, then rename it over ``path``.

    Raises
    ------
    InputError
        If the place cannot be written.
    """
    check_output(path, kind)
    temporary = None
    try:
        mode = path.stat().st_mode & 0o777 if path.exists() else _default_mode()
        handle, temporary = tempfile.mkstemp(prefix=f".{path.name[:100]}.", dir=path.parent)
        with os.fdopen(handle, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        Path(temporary).chmod(mode)
        Path(temporary).replace(path)
    except OSError as error:
        if temporary is not None:
            with contextlib.suppress(OSError):
                Path(temporary).unlink()
        raise InputError(
            f"{path}: cannot be written ({os_reason(error)}), expected a writable place for {kind}"
        ) from error


def _default_mode() -> int:
    """Return the permissions that a newly created file would get."""
    mask = os.umask(0)
    os.umask(mask)
    return 0o666 & ~mask


def absolute_path(path: str | Path) -> str:
    """Return an absolute path without "..", links kept: the inverse of `os.path.relpath`."""
    return os.path.abspath(path)  # noqa: PTH100 (Path.resolve would follow links)


def relative_path(path: str, base: Path | None) -> str:
    """Return a path as a file in the folder ``base`` refers to it; absolute if that is None."""
    if base is None:
        return absolute_path(path)
    try:
        return Path(os.path.relpath(absolute_path(path), base.resolve())).as_posix()
    except ValueError:  # another drive
        return absolute_path(path)


def read_file(path: Path, kind: str, suffix: str, most_bytes: int) -> bytes:
    """Return what is in a file.

    Parameters
    ----------
    path : Path
        The file.
    kind, suffix : str
        What it shall be, such as "a scene file" and ".json", for messages.
    most_bytes : int
        A larger file is not read.

    Raises
    ------
    InputError
        If it is missing, not a file, too large or cannot be read.
    """
    require_file(path, f"{kind} ({suffix})")
    try:
        size = path.stat().st_size
        if size > most_bytes:
            raise InputError(f"{path}: the file has {size} bytes, expected at most {most_bytes}")
        return path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({os_reason(error)}), expected {kind}") from error
