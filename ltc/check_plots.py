"""Pictures of what the doctor found; needs matplotlib, which is optional."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ltc.check import Report

FloatArray = NDArray[np.float64]


def available() -> bool:
    """Return whether matplotlib can be imported."""
    try:
        import matplotlib  # noqa: F401
    except ImportError:
        return False
    return True


def write_plots(report: Report, folder: Path) -> list[Path]:
    """Write ``errors.png``, ``determinant.png`` and ``leak.png`` into a folder.

    Parameters
    ----------
    report : Report
        From `ltc.check.check`.
    folder : Path
        Made if it does not exist.

    Returns
    -------
    list of Path
        The files.

    Raises
    ------
    ImportError
        If matplotlib is not installed.
    OSError
        If a file cannot be written.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    folder.mkdir(parents=True, exist_ok=True)
    written = []

    def save(figure: Any, name: str) -> None:
        canvas: Any = FigureCanvasAgg(figure)
        canvas.print_png(str(folder / name))
        written.append(folder / name)

    if report.cases is not None and report.errors is not None:
        save(_errors(Figure, report, report.cases, report.errors), "errors.png")
    for name, values in report.maps.items():
        save(_map(Figure, report, name, values), f"{name}.png")
    return written


def _errors(figure_type: Any, report: Report, cases: Any, errors: FloatArray) -> Any:
    figure = figure_type(figsize=(12.0, 3.6), layout="constrained")
    panels = figure.subplots(1, 3)
    theta = np.degrees(np.arccos(np.clip(cases.cos_theta, 0.0, 1.0)))
    shown = np.maximum(errors, 1e-6)
    for panel, x, label in (
        (panels[0], theta, "theta [degrees]"),
        (panels[1], cases.alpha, "larger alpha"),
    ):
        panel.scatter(x, shown, s=4, alpha=0.5, linewidths=0)
        panel.set(xlabel=label, ylabel="absolute error", yscale="log")
    panels[2].plot(np.sort(shown), np.linspace(0.0, 100.0, shown.size))
    panels[2].set(xlabel="absolute error", ylabel="percentile", xscale="log")
    figure.suptitle(f"Shading integral against exact GGX: {report.layout}")
    return figure


def _map(figure_type: Any, report: Report, name: str, values: FloatArray) -> Any:
    """Draw values over two axes: the first that says alpha, and the view; worst of the others."""
    view = next(i for i, axis in enumerate(report.axes) if "theta" in axis or axis == "view")
    alpha = next(i for i, axis in enumerate(report.axes) if "alpha" in axis)
    others = tuple(i for i in range(values.ndim) if i not in (view, alpha))
    worth = np.abs(np.log10(np.maximum(values, 1e-12))) if name == "determinant" else values
    filled = np.where(np.isfinite(worth), worth, -np.inf)
    flat = np.max(filled, axis=others) if others else filled
    if view > alpha:
        flat = flat.T
    figure = figure_type(figsize=(5.6, 4.4), layout="constrained")
    panel = figure.subplots()
    shown = np.ma.masked_invalid(flat)
    mesh = panel.imshow(shown, origin="lower", extent=(0.0, 1.0, 0.0, 1.0), aspect="auto")
    panel.set(xlabel=report.axes[alpha], ylabel=report.axes[view])
    panel.set_facecolor("lightgrey")  # nodes without a lobe
    label = {
        "determinant": "|log10(determinant / closed form's)|",
        "leak": "share below the surface",
    }[name]
    figure.colorbar(mesh, label=label + (", largest" if others else ""))
    return figure
