"""Every demo scene against the picture that it made before.

Rasterisers differ in the last bits, so pictures are compared only on the one that
made the references (`PLATFORM`); elsewhere every scene is rendered all the same,
and must be finite. ``pytest tests/snapshots --update-snapshots`` writes the references
anew; the commit that does so says why. A failure leaves what it got, what was
wanted, and their difference times 16 in ``tests/snapshots/failures``.
"""

from __future__ import annotations

import json
import re
from pathlib import Path

import moderngl
import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from app.render.renderer import Renderer
from app.scene import RenderSettings, Shot
from app.scene_io import demo_scenes, load_scene

HERE = Path(__file__).parent
REFERENCES = HERE / "references"
FAILURES = HERE / "failures"
PLATFORM = REFERENCES / "platform.json"

SIZE = (160, 90)
SAMPLES = 4

LARGEST_DIFFERENCE = 24
"""Codes of 255 from the range of the wanted pixel and its eight neighbours: a sample
may fall on the other side of an edge, on a processor that orders the same operations
differently, and at a lamp's outline that is most of the range."""
DIFFERING_SHARE = 0.005
"""Of all pixels may differ by more than `NOTICEABLE`."""
NOTICEABLE = 2


def platform_of(ctx: moderngl.Context) -> dict[str, str]:
    """Return what decides the last bits: rasteriser and driver version, not GL's version."""
    version = ctx.info["GL_VERSION"]
    mesa = re.search(r"Mesa [\d.]+", version)
    renderer = re.sub(r", \d+ bits", "", ctx.info["GL_RENDERER"])
    return {"renderer": renderer, "driver": mesa.group(0) if mesa else version}


def compared_here(ctx: moderngl.Context) -> bool:
    return PLATFORM.exists() and json.loads(PLATFORM.read_text()) == platform_of(ctx)


@pytest.mark.parametrize("name", sorted(demo_scenes()))
def test_demo_scene(
    ctx: moderngl.Context, renderer: Renderer, name: str, request: pytest.FixtureRequest
) -> None:
    scene = load_scene(demo_scenes()[name])
    renderer.render(Shot(scene, RenderSettings(samples=SAMPLES), *SIZE))
    assert np.isfinite(renderer.radiance()).all()
    got = renderer.display()
    assert got.max() > 100, "a demo scene shows something bright"

    reference = REFERENCES / f"{name}.png"
    if request.config.getoption("--update-snapshots"):
        REFERENCES.mkdir(exist_ok=True)
        Image.fromarray(got).save(reference, optimize=True)
        PLATFORM.write_text(json.dumps(platform_of(ctx), indent=1) + "\n")
        return
    assert reference.exists(), f"{reference.name} is missing: run with --update-snapshots"
    if not compared_here(ctx):
        pytest.skip(f"references were made by {PLATFORM.read_text()!r}, not by this rasteriser")
    wanted = np.asarray(Image.open(reference).convert("RGB"))
    problem = difference_of(got, wanted)
    if problem:
        write_failure(name, got, wanted)
    assert not problem, f"{name}: {problem}; see {FAILURES}"


def difference_of(got: NDArray[np.uint8], wanted: NDArray[np.uint8]) -> str:
    """Return how two pictures differ by more than is allowed, or an empty string."""
    if got.shape != wanted.shape:
        return f"size {got.shape[:2]}, expected {wanted.shape[:2]}"
    difference = np.abs(got.astype(int) - wanted.astype(int)).max(axis=-1)
    padded = np.pad(wanted.astype(int), ((1, 1), (1, 1), (0, 0)), mode="edge")
    around = np.lib.stride_tricks.sliding_window_view(padded, (3, 3), axis=(0, 1))
    below, above = around.min(axis=(-2, -1)) - got, got - around.max(axis=(-2, -1))
    largest = int(np.maximum(below, above).max())
    share = float((difference > NOTICEABLE).mean())
    if largest > LARGEST_DIFFERENCE or share > DIFFERING_SHARE:
        return (
            f"largest difference {largest} of at most {LARGEST_DIFFERENCE}, "
            f"{100 * share:.2f} % of pixels of at most {100 * DIFFERING_SHARE:g} %"
        )
    return ""


def write_failure(name: str, got: NDArray[np.uint8], wanted: NDArray[np.uint8]) -> None:
    FAILURES.mkdir(exist_ok=True)
    Image.fromarray(got).save(FAILURES / f"{name}-got.png")
    Image.fromarray(wanted).save(FAILURES / f"{name}-wanted.png")
    if got.shape == wanted.shape:
        difference = 16 * np.abs(got.astype(int) - wanted.astype(int))
        picture = Image.fromarray(np.minimum(difference, 255).astype(np.uint8))
        picture.save(FAILURES / f"{name}-difference.png")


def test_references_belong_to_scenes() -> None:
    assert {path.stem for path in REFERENCES.glob("*.png")} == set(demo_scenes())


def test_the_comparison_sees_a_changed_picture() -> None:
    ramp = np.linspace(20.0, 200.0, 160)[None, :, None]
    picture = np.broadcast_to(ramp, (90, 160, 3)).astype(np.uint8).copy()
    picture[30:60, 40:80] = 230
    assert not difference_of(picture, picture)
    assert not difference_of(picture + np.uint8(2), picture), "dither"
    edge, spot, many = picture.copy(), picture.copy(), picture.copy()
    edge[30, 40:60] = 70  # twenty pixels on the other side of the lamp's edge
    assert not difference_of(edge, picture)
    spot[75, 100, 1] += 40
    assert "largest difference" in difference_of(spot, picture)
    many[:10] += 4
    assert "% of pixels" in difference_of(many, picture)
    assert "size" in difference_of(picture[1:], picture)
