"""Pictures of ``docs/comparing.md``: differences by the command line, the window and its panels.

.venv/bin/python -m docs.figures.comparing [differences] [window] [inspector]
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import replace
from pathlib import Path

from PIL import Image

from app.cli.main import run
from app.scene_io import demo_scenes, load_scene

IMAGES = Path(__file__).parents[1] / "images"
SCENE = "06-grazing"
GAP = 4


def differences() -> None:
    """Four views of one difference, as files have them."""
    width, height = 480, 270
    sheet = Image.new("RGB", (2 * width + GAP, 2 * height + GAP), "white")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "view.png"
        for place, view in enumerate(("signed", "absolute", "relative", "flip")):
            arguments = [
                "compare", SCENE, "--technique", "ltc", "--against", "ggx:4",
                "--size", f"{width}x{height}", "--view", view, "-o", str(path),
            ]  # fmt: skip
            assert run(arguments) == 0
            with Image.open(path) as picture:
                column, row = place % 2, place // 2
                sheet.paste(picture, (column * (width + GAP), row * (height + GAP)))
    sheet.save(IMAGES / "compare-differences.png", optimize=True)


def window(what: str) -> None:
    """The window in a split view, or its inspector with the parts of an error."""
    # The window that the tests drive without a display.
    from tests.gui import application
    from tests.gui.comparing import move_to

    application.PATIENCE = 600.0
    size = (1200, 750) if what == "window" else (1300, 1000)
    app = application.Application(load_scene(demo_scenes()[SCENE]), size)
    view = app.window.viewport
    app.window.editor.selection = type(app.window.editor.selection)()
    view.settings = replace(view.settings, technique="ltc", samples=1)
    for panel in ("Compare", "Inspector")[: 1 if what == "window" else 2]:
        app.act(lambda ctx, panel=panel: ctx.window_focus(f"//{panel}"))
    view.settings = replace(view.settings, samples=4)
    compared = view.comparison
    show = "split" if what == "window" else "signed"
    compared.form = replace(compared.form, show=show, against="ggx:4", divider=0.52, points=16)
    app.settle()
    if what == "inspector":
        place = view.view.x + 0.195 * view.view.width, view.view.y + 0.66 * view.view.height
        app.act(lambda ctx: ctx.item_click("//Compare/###view parts"))
        app.until(lambda: not compared.parts.is_busy)
        move_to(app, *place)
        app.act(lambda ctx: ctx.item_click("//Inspector/###pixel parts"))
        app.until(lambda: not app.window.inspector.is_busy)
        app.act(lambda ctx: ctx.scroll_to_bottom("//Inspector"))
        app.act(lambda ctx: ctx.scroll_to_bottom("//Compare"))
        move_to(app, *place)
    app.settle()
    picture = Image.fromarray(app.pixels())
    app.close()
    if what == "inspector":
        picture = picture.crop((round(view.view.x + view.view.width), 0, *picture.size))
    picture.save(IMAGES / f"compare-{what}.png", optimize=True)


def main(wanted: list[str]) -> None:
    for what in wanted or ["differences", "window", "inspector"]:
        if what == "differences":
            differences()
        else:
            window(what)


if __name__ == "__main__":
    main(sys.argv[1:])
