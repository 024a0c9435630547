"""Renders pickled shots without a window: python -m tests.gui.headless SHOT.pickle OUT.npz ..."""

from __future__ import annotations

import pickle
import sys
from pathlib import Path

import numpy as np

from app.context import headless_context
from app.render.renderer import Renderer


def main(arguments: list[str]) -> None:
    renderer = Renderer(headless_context())
    for shot, out in zip(arguments[::2], arguments[1::2], strict=True):
        renderer.render(pickle.loads(Path(shot).read_bytes()))
        np.savez(out, display=renderer.display(), radiance=renderer.radiance())


if __name__ == "__main__":
    main(sys.argv[1:])
