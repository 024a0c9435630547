"""What a smaller table costs: `error_bytes.csv`, `error_bins.csv` and their two pictures.

    .venv/bin/pip install "matplotlib>=3.9"
    .venv/bin/python -m docs.figures.error_bytes [--measure FOLDER]

``--measure`` fits nine tables and three formulas into a folder, those that are not there yet,
and measures them all on the same rectangles, which no fit has seen (half an hour on two cores;
the shipped tables are measured as they are). Without it the figures are only drawn.

A formula here is X of ``M = M0 (I + X)`` as polynomials of the table's four coordinates, up to
a total degree, fitted to the same cases with the same loss; 'degree none' is M0 itself. Formulas
have no albedo, so theirs is exact; tables err by their own.
"""

from __future__ import annotations

import csv
import hashlib
import itertools
import os
import pickle
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray

from docs.figures.formula import Formula, fit_formula
from ltc import anisotropic_fit, fit, objective
from ltc.anisotropic import (
    CHANNELS,
    AnisotropicTable,
    entry_basis,
    load_anisotropic,
)
from ltc.objective import Configurations, LobeVariation, ShadingError
from ltc.polygon import ltc_specular
from ltc.table import (
    IsotropicTable,
    load_isotropic,
    sample_textures,
)

FloatArray = NDArray[np.float64]

HERE = Path(__file__).parent
SIZES, BINS = HERE / "error_bytes.csv", HERE / "error_bins.csv"
IMAGES = HERE.parent / "images"
PICTURES = IMAGES / "error-bytes.png", IMAGES / "error-bins.png"

SEED = 20_000
"""Of the rectangles that everything is measured on."""
RECTANGLES = 12_000
CONFIGURATIONS = 40_000
"""What formulas are fitted to; tables are fitted with their commands' defaults."""

ANISOTROPIC = (
    ((2, 2, 2, 2), (2, 3, 4, 6)),
    ((2, 2, 4, 4), (3, 4, 6, 10)),
    ((3, 3, 4, 5), (3, 4, 8, 14)),
    ((3, 3, 6, 6), (4, 5, 8, 16)),
    ((5, 5, 8, 10), (5, 8, 13, 26)),
    ((6, 6, 10, 10), (6, 9, 18, 36)),
)
"""Nodes of X and of albedo and Fresnel term, from 0.8 to 200 KB."""
ISOTROPIC = ((4, 6), (6, 12), (8, 16), (16, 32))
"""Nodes an axis of X, and of albedo and Fresnel term; the shipped table has 8 and 32."""
DEGREES = (2, 3, 4)

VARIATION, LOBES, DIRECTIONS, LOWEST = 0.15, 4000, 64, 1e-5
"""Of the total variation in the loss of formulas: as `ltc.anisotropic_fit` has them."""

QUOTED = (
    ("isotropic", "Heitz et al. 2016, 64²", 81_920, 0.0064, 0.086),
    ("anisotropic", "KT et al. 2022, 8⁴", 180_224, 0.0089, 0.103),
)
"""Published tables as read by their demos: kind, name, bytes, mean, p99 over 400 rectangles of
the same kind, measured once and quoted."""

NOTHING = 200.0
"""Where 0 bytes are drawn, left of the least."""

AXIS_NAMES = {
    "larger alpha": "larger alpha",
    "lambda": "λ, smaller over larger alpha",
    "theta": "θ [degrees]",
}

COLUMNS = ("kind", "name", "bytes", "mean", "p95", "p99", "max", "mean, exact albedo")


class Remembering(Executor):
    """Passes calls on and keeps their results in a folder: fits of several sizes share most."""

    def __init__(self, executor: Executor, folder: Path) -> None:
        self._executor, self._folder = executor, folder
        folder.mkdir(exist_ok=True)

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        key = hashlib.sha256(pickle.dumps((fn.__qualname__, args, kwargs))).hexdigest()
        path = self._folder / f"{key}.npy"
        if path.exists():
            known: Future[Any] = Future()
            known.set_result(np.load(path))
            return known
        future = self._executor.submit(fn, *args, **kwargs)
        future.add_done_callback(lambda done: done.cancelled() or np.save(path, done.result()))
        return future


def _formulas(folder: Path, executor: Executor) -> list[Formula]:
    """Return the formulas, those fitted before from the folder."""
    found = [Formula(0, np.zeros((1, CHANNELS)))]
    missing = [d for d in DEGREES if not (folder / f"degree-{d}.npy").exists()]
    if missing:
        rng = np.random.default_rng([SEED, 1])
        cases = anisotropic_fit.random_configurations(rng, CONFIGURATIONS, training=True)
        exact, albedo = _exact(cases, executor)
        basis = entry_basis(cases.alpha_x, cases.alpha_y, cases.wo)
        shading = ShadingError(cases, exact, albedo, basis)
        views = anisotropic_fit.random_views(rng, LOBES, True, 0.5, LOWEST)
        lobes = LobeVariation(rng, *views, DIRECTIONS, entry_basis(*views), VARIATION)
        for degree in missing:
            formula = fit_formula(degree, shading, cases, lobes, views)
            np.save(folder / f"degree-{degree}.npy", formula.coefficients)
    return found + [Formula(d, np.load(folder / f"degree-{d}.npy")) for d in DEGREES]


def _exact(cases: Configurations, executor: Executor) -> tuple[FloatArray, FloatArray]:
    """Return exact integrals and albedos, (n,) each."""
    parts = [cases[i : i + 512] for i in range(0, cases.count, 512)]
    integrals = [executor.submit(objective.exact_integrals, part) for part in parts]
    terms = [
        executor.submit(anisotropic_fit.exact_terms, part.alpha_x, part.alpha_y, part.wo)
        for part in parts
    ]
    exact = np.concatenate([future.result() for future in integrals])
    return exact, np.concatenate([future.result() for future in terms])[:, 0]


def _tables(folder: Path, executor: Executor) -> tuple[list[Any], list[Any]]:
    """Return anisotropic and isotropic tables by size, those fitted before from the folder."""
    anisotropic: list[AnisotropicTable] = [load_anisotropic()]
    for shape, albedo_shape in ANISOTROPIC:
        path = folder / f"anisotropic-{'-'.join(map(str, (*shape, *albedo_shape)))}.npz"
        if not path.exists():
            print(path.stem, flush=True)
            anisotropic_fit.fit_anisotropic(path, shape, albedo_shape, executor=executor)
        anisotropic.append(load_anisotropic(path))
    isotropic: list[IsotropicTable] = [load_isotropic()]
    for size, albedo_size in ISOTROPIC:
        path = folder / f"isotropic-{size}.npz"
        if not path.exists() and size != fit.SIZE:
            print(path.stem, flush=True)
            fit.fit_isotropic(path, size)
        fitted = isotropic[0] if size == fit.SIZE else load_isotropic(path)
        isotropic.append(IsotropicTable(fitted.residual, *fit.albedo_tables(albedo_size)))
    return (
        sorted(anisotropic, key=lambda table: table.payload),
        sorted(isotropic, key=lambda table: table.payload),
    )


def measure(folder: Path) -> None:
    """Fit what is not in the folder, measure everything, write both files of figures."""
    folder.mkdir(parents=True, exist_ok=True)
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        executor = Remembering(pool, folder / "pieces")
        formulas = _formulas(folder, executor)
        anisotropic, isotropic = _tables(folder, executor)
        cases = anisotropic_fit.random_configurations(np.random.default_rng([SEED, 0]), RECTANGLES)
        exact, albedo = _exact(cases, executor)
        equal = fit.random_configurations(np.random.default_rng([SEED, 2]), RECTANGLES)
        equal_exact, equal_albedo = _exact(equal, executor)

    rows: list[Sequence[Any]] = []
    binned: dict[str, FloatArray] = {}

    def add(kind: str, name: str, payload: int, error: FloatArray, without: FloatArray) -> None:
        figures = [np.mean(error), *np.percentile(error, (95, 99)), np.max(error), np.mean(without)]
        rows.append((kind, name, payload, *(objective.rounded(value) for value in figures)))

    for formula in formulas:
        M = formula.matrix(cases)
        error = np.abs(ltc_specular(M, [cases.corners], albedo) - exact)
        numbers = np.count_nonzero(formula.coefficients)
        name = f"degree {formula.degree}" if formula.degree else "degree none"
        add("formula", name, 4 * numbers, error, error)
        binned[name] = error
    for table in anisotropic:
        M = table.matrix_of_view(cases.alpha_x, cases.alpha_y, cases.wo)
        A, _ = table.albedo_terms_of_view(cases.alpha_x, cases.alpha_y, cases.wo)
        error, without = (np.abs(ltc_specular(M, [cases.corners], a) - exact) for a in (A, albedo))
        name = f"{_shape(table.residual.shape[:4])}, {_shape(table.albedo.shape)}"
        add("anisotropic", name, table.payload, error, without)
        binned[name] = error
    for table in isotropic:
        M, A, _ = sample_textures(table.textures(), equal.alpha, equal.cos_theta)
        error, without = (
            np.abs(ltc_specular(M, [equal.corners], a) - equal_exact) for a in (A, equal_albedo)
        )
        name = f"{_shape(table.residual.shape[:2])}, {_shape(table.albedo.shape)}"
        add("isotropic", name, table.payload, error, without)
    _write(SIZES, COLUMNS, rows)
    _write(BINS, ("name", "axis", "low", "high", "mean", "p99"), _bins(cases, binned))


def _shape(shape: Sequence[int]) -> str:
    return "·".join(str(n) for n in shape)


AXIS_BOUNDS = {
    "larger alpha": (0.001, 0.003, 0.01, 0.03, 0.1, 0.2, 0.3, 0.45, 0.6, 0.8, 1.0),
    "lambda": (0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.45, 0.6, 0.8, 1.0),
    "theta": (0.0, 15.0, 30.0, 45.0, 60.0, 70.0, 75.0, 80.0, 85.0, 87.0, 89.0, 89.9),
}
"""lambda is the smaller alpha over the larger one; theta in degrees."""


def _bins(cases: Configurations, binned: dict[str, FloatArray]) -> Iterator[Sequence[Any]]:
    places = {
        "larger alpha": cases.alpha,
        "lambda": cases.ratio,
        "theta": np.degrees(np.arccos(cases.cos_theta)),
    }
    for name, error in binned.items():
        for axis, bounds in AXIS_BOUNDS.items():
            for low, high in itertools.pairwise(bounds):
                inside = error[(places[axis] >= low) & (places[axis] < high)]
                mean, high_error = np.mean(inside), np.percentile(inside, 99)
                figures = (objective.rounded(mean), objective.rounded(high_error))
                yield name, axis, low, high, *figures


def _write(path: Path, columns: Sequence[str], rows: Sequence[Any] | Iterator[Any]) -> None:
    with path.open("w", newline="", encoding="utf-8") as stream:
        table = csv.writer(stream, lineterminator="\n")
        table.writerow(columns)
        table.writerows(rows)


INK = {"anisotropic": "#1b6ca8", "isotropic": "#2a8f5b", "formula": "#d95f02"}
GREY, PALE = "#7f7f7f", "#e6e6e6"


def _style() -> None:
    plt.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False})


def draw_sizes() -> None:
    """Draw mean and 99th percentile of the error against bytes."""
    with SIZES.open(newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    shipped = {
        "anisotropic": load_anisotropic().payload,
        "isotropic": load_isotropic().payload,
    }
    _style()
    figure, axes = plt.subplots(1, 2, figsize=(9.6, 4.3), layout="constrained", sharex=True)
    for axis, column, title in zip(
        axes, ("mean", "p99"), ("mean error", "99th percentile"), strict=True
    ):
        for kind, ink in INK.items():
            mine = [row for row in rows if row["kind"] == kind]
            x = np.array([max(float(row["bytes"]), NOTHING) for row in mine])
            y = np.array([float(row[column]) for row in mine])
            axis.plot(
                x, y, {"formula": "s--"}.get(kind, "o-"), color=ink, linewidth=1.6, markersize=4.5,
                label={"formula": "anisotropic, formulas with exact albedo"}.get(
                    kind, f"{kind} tables"
                ),
            )  # fmt: skip
            if kind in shipped:
                i = int(np.flatnonzero(x == shipped[kind])[0])
                axis.plot(x[i], y[i], "o", color="white", markersize=11, zorder=3)
                axis.plot(x[i], y[i], "o", color=ink, markersize=8, zorder=4)
                axis.annotate(
                    "shipped", (x[i], y[i]), (0, -13), textcoords="offset points", ha="center",
                    va="top", color=ink, fontsize=8,
                )  # fmt: skip
        for row in rows:
            if row["kind"] == "formula":
                text = "M0 alone" if row["name"] == "degree none" else row["name"]
                at = (max(float(row["bytes"]), NOTHING), float(row[column]))
                first = row["name"] == "degree none"
                axis.annotate(
                    text, at, (6, 3) if first else (-5, -10), textcoords="offset points",
                    color=INK["formula"], fontsize=8, ha="left" if first else "right",
                )  # fmt: skip
        for kind, name, size, mean, p99 in QUOTED:
            at = (size, mean if column == "mean" else p99)
            axis.plot(*at, "x", color=INK[kind], markersize=7, markeredgewidth=1.8)
            axis.annotate(
                f"{name}\n(quoted)", at, (-7, 0), textcoords="offset points", ha="right",
                va="center", color=GREY, fontsize=8,
            )  # fmt: skip
        axis.set(xscale="log", yscale="log", xlabel="bytes of tables", title=title)
        axis.set_xticks([NOTHING, 1e3, 1e4, 1e5], ["0", "1 KB", "10 KB", "100 KB"])
        ticks = (0.002, 0.005, 0.01) if column == "mean" else (0.02, 0.05, 0.1)
        axis.set_ylim(0.75 * ticks[0], 1.5 * ticks[-1])
        axis.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
        axis.minorticks_off()
        axis.grid(True, color=PALE, linewidth=0.6)
    axes[0].set_ylabel("shading integral, radiance 1")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=3,
                  frameon=False)  # fmt: skip
    figure.savefig(PICTURES[0], dpi=110)
    plt.close(figure)


def draw_bins() -> None:
    """Draw the mean error by ranges of alpha, lambda and theta, of some tables."""
    with BINS.open(newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    with SIZES.open(newline="", encoding="utf-8") as stream:
        sizes = {row["name"]: float(row["bytes"]) for row in csv.DictReader(stream)
                 if row["kind"] == "anisotropic"}  # fmt: skip
    shipped = next(name for name, size in sizes.items() if size == load_anisotropic().payload)
    by_size = sorted(sizes, key=lambda name: sizes[name])
    shown = {
        "degree none": ("M0 alone, no table", INK["formula"], ":"),
        f"degree {DEGREES[-1]}": (f"formula of degree {DEGREES[-1]}", INK["formula"], "-"),
        by_size[0]: (f"table, {sizes[by_size[0]] / 1e3:.1f} KB", "#7fb3d8", "-"),
        by_size[1]: (f"table, {sizes[by_size[1]] / 1e3:.1f} KB", "#4b91c2", "-"),
        shipped: (f"table, {sizes[shipped] / 1e3:.0f} KB, shipped", "#0b3c61", "-"),
    }
    _style()
    figure, axes = plt.subplots(1, 3, figsize=(9.6, 3.9), layout="constrained", sharey=True)
    for axis, (name, bounds) in zip(axes, AXIS_BOUNDS.items(), strict=True):
        for table, (label, ink, style) in shown.items():
            mine = [row for row in rows if (row["name"], row["axis"]) == (table, name)]
            values = [float(row["mean"]) for row in mine]
            axis.stairs(
                values,
                bounds,
                baseline=None,
                color=ink,
                linestyle=style,
                linewidth=1.7,
                label=label,
            )
            if table == shipped:
                high = [float(row["p99"]) for row in mine]
                axis.stairs(
                    high, bounds, baseline=None, color=ink, linestyle="--", linewidth=1.1,
                    label="its 99th percentile",
                )  # fmt: skip
        axis.set(yscale="log", xlabel=AXIS_NAMES[name])
        axis.grid(True, color=PALE, linewidth=0.6)
        if name != "theta":
            axis.set_xscale("log")
            ticks = [0.001, 0.01, 0.1, 1.0] if name == "larger alpha" else [0.01, 0.1, 1.0]
            axis.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
        else:
            axis.set_xticks([0, 30, 60, 75, 90])
    axes[0].set_ylabel("mean error, radiance 1")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=3,
                  frameon=False)  # fmt: skip
    figure.savefig(PICTURES[1], dpi=110)
    plt.close(figure)


if __name__ == "__main__":
    if "--measure" in sys.argv[1:]:
        measure(Path(sys.argv[sys.argv.index("--measure") + 1]))
    draw_sizes()
    draw_bins()
