"""The direction of dependencies: window -> panels -> editor -> scene; window -> render -> ltc.

Reads the imports of every module, in functions too, and fails on an upward
arrow.
"""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
GL = {"moderngl", "moderngl_window", "glcontext", "OpenGL"}
GUI = {"imgui_bundle", "glfw", "implot", "imguizmo"}
PURE = {
    "app.scene", "app.scene_io", "app.meshes", "app.outline", "app.curves", "app.curve_arrangement",
    "app.curve_meetings", "app.monotone_pieces",
    "app.polygon_arrangement", "app.presets", "app.errors", "app.files",
    "app.images", "app.vectors", "app.edits", "app.editor", "app.sliders", "app.camera_control",
    "app.lights", "app.planes", "app.contours", "app.sources", "app.step_names", "app.gui.messages",
    "app.gui.shortcuts", "app.gui.beginning", "app.gui.documents", "app.gui.imports",
    "app.gui.file_types", "app.gui.playback",
    "app.loops", "app.text", "app.text_runs", "app.svg", "app.svg_paths", "app.svg_tree",
    "app.json_reader", "app.json_writer", "app.light_io", "app.plan_rows",
    "app.colour_maps", "app.lobe_picture", "app.lobe_figure",
    "app.caching", "app.pictures", "app.picture_files",
}  # fmt: skip
WINDOW = {
    "app.window", "app.gui.layout", "app.gui.menus", "app.gui.keyboard", "app.gui.panel_windows",
    "app.gui.viewport_window", "app.gui.viewport", "app.gui.overlays", "app.gui.placement",
    "app.gui.dialogs", "app.gui.message_list", "app.gui.exports", "app.gui.reports",
    "app.gui.theme", "app.gui.live_picture", "app.gui.grips", "app.gui.outline_tool",
    "app.gui.legend", "app.gui.measuring", "app.gui.comparison",
    "app.gui.breakdowns", "app.gui.summaries", "app.gui.inspector",
    "app.gui.lobe_window", "app.gui.lobe_point",
}  # fmt: skip
TOP = {"app.window", "app.cli", "app.__main__"}
"""What nothing below may import: each starts the program."""


def modules() -> dict[str, Path]:
    found = {}
    for package in ("ltc", "app"):
        for path in sorted((ROOT / package).rglob("*.py")):
            parts = path.relative_to(ROOT).with_suffix("").parts
            name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
            found[name] = path
    return found


MODULES = modules()


def imports(name: str) -> set[str]:
    """Return the modules that a module imports, type-checking ones left out."""
    tree = ast.parse(MODULES[name].read_text(encoding="utf-8"))
    typing_only = {
        inner
        for node in ast.walk(tree)
        if isinstance(node, ast.If) and ast.unparse(node.test).endswith("TYPE_CHECKING")
        for child in node.body
        for inner in ast.walk(child)
    }
    found: set[str] = set()
    for node in ast.walk(tree):
        if node in typing_only:
            continue
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                package = name.split(".")
                if MODULES[name].name != "__init__.py":
                    package = package[:-1]
                base = ".".join([*package[: len(package) - node.level + 1], *filter(None, [base])])
            found.add(base)
            found |= {f"{base}.{alias.name}" for alias in node.names} & set(MODULES)
    return found


def touches(found: set[str], names: set[str]) -> set[str]:
    return {
        item for item in found if any(item == name or item.startswith(name + ".") for name in names)
    }


def forbidden(name: str) -> set[str]:
    if name.split(".")[0] == "ltc":
        return {"app"} | GL | GUI
    if name in PURE:
        return {"app.render", "app.context", "app.panels"} | WINDOW | GL | GUI
    if name.startswith(("app.render", "app.measure")):
        return (
            {"app.panels", "app.editor", "app.edits", "app.gui.documents", "moderngl_window"}
            | WINDOW
            | GUI
        )
    if name.startswith("app.stability"):
        return {"app.panels", "app.editor", "app.edits", "app.cli"} | WINDOW | GUI | GL
    if name.startswith("app.panels"):
        return {"app.render", "app.context", "glfw"} | WINDOW | GL
    if name == "app.context":
        return {"app.render", "app.panels", "app.editor"} | WINDOW | GUI
    if name in WINDOW:
        return TOP
    return set()


def test_every_module_has_its_layer() -> None:
    packages = ("ltc", "app.render", "app.measure", "app.panels", "app.stability", "app.cli")
    known = PURE | WINDOW | TOP | {"app", "app.context", "app.gui"}
    homeless = {name for name in MODULES if name not in known and not name.startswith(packages)}
    assert not homeless
    assert known <= set(MODULES)


@pytest.mark.parametrize("name", sorted(MODULES))
def test_no_arrow_points_upwards(name: str) -> None:
    upward = touches(imports(name), forbidden(name))
    assert not upward, f"{name} imports {', '.join(sorted(upward))}"


def test_scene_needs_nothing_of_this_program() -> None:
    assert not touches(imports("app.scene"), {"app", "ltc"})


LTC_COMMANDS = {
    "ltc.check_command": {"rich"},  # the report as a table
    "ltc.textures_command": {"rich"},  # errors as a table
    "ltc.check_plots": {"matplotlib"},  # an extra; the command says so where it is missing
    "ltc.export": {"OpenEXR"},  # no other format needs it; imported where an EXR is written
}
"""What the command line of ``ltc`` needs beyond numpy and scipy, module by module."""


def test_ltc_needs_only_numpy_and_scipy() -> None:
    import sys

    for name in MODULES:
        if name.startswith("ltc"):
            outside = {item.split(".")[0] for item in imports(name)} - set(sys.stdlib_module_names)
            allowed = {"ltc", "numpy", "scipy"} | LTC_COMMANDS.get(name, set())
            assert outside <= allowed, name


def test_the_check_sees_an_upward_arrow(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    bad = tmp_path / "bad.py"
    bad.write_text("def f():\n    from app import window\n    import moderngl.x\n")
    monkeypatch.setitem(MODULES, "app.panels.bad", bad)
    assert touches(imports("app.panels.bad"), forbidden("app.panels.bad")) == {
        "app.window",
        "moderngl.x",
    } & (imports("app.panels.bad"))
    assert "moderngl.x" in imports("app.panels.bad")
