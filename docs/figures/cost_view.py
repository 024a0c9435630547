"""What pixels cost: ``docs/images/curves-cost-view.png``, two demo scenes by three techniques.

.venv/bin/python -m docs.figures.cost_view
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from app.colour_maps import draw_legend
from app.context import headless_context
from app.render.cost import LEGEND
from app.render.renderer import Renderer
from app.scene import RenderSettings, Shot
from app.scene_io import load_scene
from ltc.resources import resource_path

PICTURE = Path(__file__).parents[1] / "images" / "curves-cost-view.png"

SCENES = ("12-letter", "13-word")
TECHNIQUES = ("adaptive", "uniform:18", "ltc")
SIZE = (448, 280)
GAP = 4


def main() -> None:
    """Render and put side by side."""
    width, height = SIZE
    sheet = Image.new(
        "RGB",
        (len(TECHNIQUES) * (width + GAP) - GAP, len(SCENES) * (height + GAP) - GAP),
        "white",
    )
    context = headless_context()
    with context:
        renderer = Renderer(context)
        for row, name in enumerate(SCENES):
            scene = load_scene(resource_path("assets", "scenes", f"{name}.json"))
            for column, technique in enumerate(TECHNIQUES):
                renderer.render(Shot(scene, RenderSettings(technique, 1, "cost"), *SIZE))
                counts = renderer.radiance()[..., 0]
                mean = counts[counts > 0.0].mean()
                print(f"{name} {technique}: mean {mean:.0f}, most {counts.max():.0f}")
                colours = renderer.display()
                if (row, column) == (len(SCENES) - 1, 0):
                    colours = draw_legend(colours, LEGEND)
                picture = _labelled(Image.fromarray(np.ascontiguousarray(colours)),
                                    f"{technique}: {mean:.0f} on average")  # fmt: skip
                sheet.paste(picture, (column * (width + GAP), row * (height + GAP)))
        renderer.release()
    sheet.save(PICTURE, optimize=True)


def _labelled(picture: Image.Image, text: str) -> Image.Image:
    draw = ImageDraw.Draw(picture)
    font = ImageFont.load_default(14)
    right, bottom = draw.textbbox((0, 0), text, font=font)[2:]
    draw.rectangle((0, 0, right + 12, bottom + 8), fill=(20, 20, 20))
    draw.text((6, 4), text, fill=(240, 240, 240), font=font)
    return picture


if __name__ == "__main__":
    main()
