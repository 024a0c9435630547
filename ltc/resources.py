"""Where ``shaders/``, ``luts/`` and ``assets/`` are, in a checkout and in a wheel.

A wheel carries the three folders inside the package, under ``ltc/_data``; a
checkout (editable installs included) has them beside it.
"""

from __future__ import annotations

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent


def resource_path(*parts: str) -> Path:
    """Return the path of a file or folder shipped with the program.

    Parameters
    ----------
    parts : str
        Path components; the first is ``"shaders"``, ``"luts"`` or ``"assets"``.

    Raises
    ------
    FileNotFoundError
        If it is neither in the package nor beside it.
    """
    for root in (_PACKAGE / "_data", _PACKAGE.parent):
        path = root.joinpath(*parts)
        if path.exists():
            return path
    raise FileNotFoundError(f"{'/'.join(parts)} is missing from this installation of ltc-viewer")
