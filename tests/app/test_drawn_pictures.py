"""The pictures of the demo scenes are what their script draws."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from PIL import Image

from app.pictures import duration
from app.scene import Picture

FOLDER = Path(__file__).resolve().parents[2] / "assets" / "pictures"


@pytest.fixture(scope="module")
def draw() -> ModuleType:
    spec = importlib.util.spec_from_file_location("draw", FOLDER / "draw.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    "name", ["sunset.webp", "stained-glass.webp", "disk.png", "swirl.webp", "embers.webp"]
)
def test_stills(draw: ModuleType, name: str) -> None:
    wanted = 255.0 * np.clip(draw.PICTURES[name]()[0], 0.0, 1.0)
    with Image.open(FOLDER / name) as image:
        found = np.asarray(image).astype(float)
    assert found.shape == wanted.shape
    # Lossy at quality 88, with colours at half the resolution: errors sit at the edges.
    assert np.abs(found - wanted).mean() < 6.0


def test_the_film(draw: ModuleType) -> None:
    with Image.open(FOLDER / "television.webp") as film:
        assert film.n_frames == draw.STEPS
        for step in (0, 17, 30):
            film.seek(step)
            wanted = 255.0 * np.clip(draw.night_train(step), 0.0, 1.0)
            assert np.abs(np.asarray(film.convert("RGB")) - wanted).mean() < 6.0
    seconds = draw.STEPS * draw.FRAME_MILLISECONDS / 1e3
    assert duration(Picture(str(FOLDER / "television.webp"))) == pytest.approx(seconds)


def test_every_picture_is_named(draw: ModuleType) -> None:
    files = {path.name for path in FOLDER.iterdir() if path.suffix not in (".py", ".md")}
    assert files == set(draw.PICTURES)
    page = (FOLDER / "README.md").read_text("utf-8")
    assert all(f"`{name}`" in page for name in files)
