"""Fit the isotropic table to GGX: ``python -m ltc fit isotropic``.

What is minimised
    M = M0 (I + X), X bicubic between nodes (`ltc.table`). The unknowns are the nodes,
    all at once, so a node gets the value that interpolates best rather than
    the one that fits best where it stands. The loss is the mean error of the
    technique as rendered (light clipped at the surface, transformed, clipped, form
    factor, times A / (1 - leak)) over random rectangles, absolute above 1e-3
    and with the square added at weight 50; plus .03 of the mean total
    variation between lobe and GGX, which holds where few rectangles look; plus a
    little smoothness. Targets are exact (`ltc.reference`), derivatives
    analytic, steps Levenberg-Marquardt on reweighted normal equations.

Measured (`random_configurations`, 4,000 rectangles and 2,000 octagons with seeds
of their own, read through the GPU's textures; absolute error, radiance 1)

    ==========  ======  =====  =====  =====
    lights      mean    p95    p99    max
    ==========  ======  =====  =====  =====
    rectangles  .00195  .0087  .0202  .076
    octagons    .00192  .0086  .0200  .050
    ==========  ======  =====  =====  =====

    Rectangles by theta 0-30, 30-60, 60-75, 75-87, 87-89.9 degrees: .00064, .00101,
    .00254, .0052, .0098; by alpha .001-.01-.1-.3-.6-1: .0003, .0016, .0033,
    .0023, .0010. At alpha 1e-4 to 1e-3 with an edge through every lobe: .0003.
    Above 87 degrees one lobe has not the shape of GGX: at the views of the three
    largest errors, lights with an edge in the lobe are in error by .0135 to .0163
    in the mean, and a lobe refitted to that view alone by .0133 to .0155.

Compared (mean, p99, max on the same rectangles)

    ===============================  ======  =====  ====
    M0 alone                         .0111   .094   .192
    bicubic 4^2 nodes (256 bytes)    .00226  .0224  .068
    bicubic 6^2                      .00197  .0191  .080
    bicubic 8^2 (1 KB), the default  .00195  .0202  .076
    bicubic 10^2                     .00195  .0203  .073
    bicubic 16^2                     .00195  .0202  .076
    bilinear 8^2                     .00197  .0200  .084
    bilinear 16^2                    .00195  .0198  .080
    bilinear 24^2                    .00198  .0206  .084
    8^2 without / (1 - leak)         .00214  .0236  .054
    8^2, no squared error            .00194  .0201  .076
    8^2, total variation at .3       .0025   .028   .072
    ===============================  ======  =====  ====

    Differences under .0001 are noise: what is left is the lobe's shape, not the
    table. The last two rows were taken with a slightly weaker smoothness.

Time: 44 to 57 s on two busy cores (25 s the exact integrals of 40,000 rectangles, 10 s
nine steps, 5 s the error figures). The result depends on the seed and the library
versions alone; a checkpoint beside the output lets an interrupted fit go on.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from ltc import brdf, fitting, objective
from ltc.fitting import Report
from ltc.objective import (
    ALPHA_BOUNDS,
    CHUNK,
    THETA_BOUNDS,
    THETA_MAX,
    Configurations,
    FitState,
    LobeVariation,
    ShadingError,
    Term,
    exact_integrals,
    random_lights,
    rounded,
)
from ltc.polygon import ltc_specular
from ltc.table import (
    RESIDUAL_SIZE,
    IsotropicTable,
    alpha_and_cosine,
    bicubic_weights,
    node_grid,
    sample_textures,
    save_isotropic,
    stretched_length,
    table_coordinates,
)

FloatArray = NDArray[np.float64]

SIZE = 8
"""Default nodes on each axis of the residual."""
CONFIGURATIONS = 40_000
"""Default number of rectangles fitted to."""
ALBEDO_NODES = 32
"""Nodes on each axis of the albedo and Fresnel tables."""

_ENTRIES = ((0, 0), (0, 2), (1, 1), (2, 0))  # of X, in the order of the table's channels
_ALBEDO_COSINE = 1e-7  # in units of alpha; stands for a view exactly in the surface
_VARIATION = 0.03  # weight of the total variation
_SMOOTHNESS = 1e-5  # weight of squared second differences of the residual
_LOBES, _DIRECTIONS = 2000, 64  # views, and directions each, in the total variation
_FACTOR_MARGIN = 0.15  # factors of det(I + X) smaller than this are penalised, by squares
_DAMPING_FLOOR = 0.1  # damping of unknowns that little depends on, in mean curvatures
_STEPS = 40  # at most

_TRAIN, _TEST, _OCTAGONS, _VARIATION_STREAM = range(4)  # independent streams of one seed


def random_configurations(
    rng: np.random.Generator, count: int, corners: int = 4, training: bool = False
) -> Configurations:
    """Return random isotropic materials, views and polygon lights.

    Parameters
    ----------
    rng : numpy.random.Generator
        Source of all randomness.
    count : int
        Number of configurations.
    corners : int, >= 3
        4 gives rectangles, 8 stretched octagons.
    training : bool
        Spread over the whole table instead of the range of the error figures.

    Notes
    -----
    sqrt(alpha) is uniform from sqrt(.001) to 1 and theta from 0 to 89.9 degrees; for
    training sqrt(alpha) from .01 to 1 and, for a fifth of the views, the
    table's row uniform instead of theta. The view lies in the xz half-plane x >= 0;
    the lights are those of `ltc.objective.random_lights`.
    """
    low = 0.01 if training else np.sqrt(1e-3)
    x = rng.uniform(low, 1.0, count)
    alpha = x * x
    c = np.cos(rng.uniform(0.0, THETA_MAX, count))
    if training:
        by_row = alpha_and_cosine(x, rng.uniform(0.0, 1.0, count))[1]
        c = np.where(rng.random(count) < 0.2, np.maximum(by_row, np.cos(THETA_MAX)), c)
    return random_lights(rng, alpha, alpha, _views(c), corners)


def _views(c: FloatArray) -> FloatArray:
    return np.stack([np.sqrt(1.0 - c * c), np.zeros_like(c), c], axis=-1)


def shading_errors(
    table: IsotropicTable, configurations: Configurations, exact: FloatArray
) -> FloatArray:
    """Return the technique's absolute errors, (n,), read from the GPU's textures.

    Parameters
    ----------
    table : IsotropicTable
        Sampled as `ltc.table.sample_textures` does.
    configurations, exact
        The cases and their `exact_integrals`.
    """
    M, A, _ = sample_textures(table.textures(), configurations.alpha, configurations.cos_theta)
    return np.abs(ltc_specular(M, [configurations.corners], A) - exact)


def error_figures(errors: FloatArray, configurations: Configurations) -> dict[str, Any]:
    """Return `ltc.objective.error_figures` by theta in degrees and by alpha."""
    theta = np.degrees(np.arccos(configurations.cos_theta))
    axes = {"theta": (theta, THETA_BOUNDS), "alpha": (configurations.alpha, ALPHA_BOUNDS)}
    return objective.error_figures(errors, axes)


def albedo_tables(size: int = ALBEDO_NODES) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return A and the Fresnel cosine u at the nodes of a table, (size, size) each.

    Exact to float32 (`ltc.brdf.directional_albedo`), 2 ms a node.
    """
    alpha, c = node_grid(size)
    c = np.maximum(c, _ALBEDO_COSINE * alpha)
    A, B = brdf.directional_albedo(_views(c), alpha, alpha)
    A = np.minimum(A, 1.0)
    u = (1.0 - (B / A) ** 0.2) / stretched_length(alpha, c)
    return A.astype(np.float32), u.astype(np.float32)


def entry_basis(sine: FloatArray) -> FloatArray:
    """Return the matrices that X's entries multiply, (n, 4, 3, 3), for views of this sine."""
    basis = np.zeros((*sine.shape, 4, 3, 3))
    for k, (i, j) in enumerate(_ENTRIES):
        basis[..., k, i, j] = 1.0 if i == j else sine
    return basis


def random_variation(rng: np.random.Generator, views: int) -> tuple[LobeVariation, FloatArray]:
    """Return the total variation at random views over the table.

    Returns
    -------
    LobeVariation
    coordinates : (2, views) float64
        x and y of the views.
    """
    x = rng.uniform(0.01, 1.0, views)
    c = np.where(
        np.arange(views) % 2 == 0,
        np.cos(rng.uniform(0.0, THETA_MAX, views)),
        np.maximum(alpha_and_cosine(x, rng.random(views))[1], np.cos(THETA_MAX)),
    )
    alpha = x * x
    basis = entry_basis(np.sqrt(1.0 - c * c))
    lobes = LobeVariation(rng, alpha, alpha, _views(c), _DIRECTIONS, basis, _VARIATION)
    return lobes, np.stack(table_coordinates(alpha, c))


class _Equations:
    """The dense normal equations at one point."""

    def __init__(self, loss: float, curvature: FloatArray, slope: FloatArray) -> None:
        self.loss, self._H, self._g = loss, curvature, slope

    def step(self, damping: float) -> FloatArray:
        diagonal = np.diag(self._H) + _DAMPING_FLOOR * np.mean(np.diag(self._H))
        return np.asarray(-cho_solve(cho_factor(self._H + np.diag(damping * diagonal)), self._g))


def fit_steps(
    state: FitState,
    shading: ShadingError,
    lobes: LobeVariation,
    coordinates: tuple[FloatArray, FloatArray],
) -> Iterator[FitState]:
    """Yield ever better states until nothing is gained, see `ltc.objective.descend`.

    Parameters
    ----------
    state : FitState
        With a residual (n, n, 4).
    shading, lobes
        The two errors that are minimised.
    coordinates : pair of (2, m) float64
        Table coordinates (x, y) of the one's cases and of the other's.
    """
    size = state.residual.shape[0]
    tie = _tie(size)
    bending = _bending(size) @ tie
    smoothness = _SMOOTHNESS * bending.T @ bending
    nodes = np.linspace(0.0, 1.0, max(RESIDUAL_SIZE, 4 * size))
    guard = [g.ravel() for g in np.broadcast_arrays(nodes[None, :], nodes[:, None])]
    guard_weights = bicubic_weights(guard[0], guard[1], size)
    guard_cosine = alpha_and_cosine(guard[0], guard[1])[1]

    def equations(z: FloatArray) -> _Equations:
        p = (tie @ z).reshape(size * size, 4)
        loss = 0.5 * float(z @ smoothness @ z)
        H = np.zeros((size * size, 4, size * size, 4))
        g = np.zeros((size * size, 4))
        X00, X02, X11, X20 = (guard_weights @ p).T
        s2 = 1.0 - guard_cosine**2
        for factor, change in (
            (1.0 + X00 - s2 * X02 * X20, (np.ones_like(s2), -s2 * X20, 0.0 * s2, -s2 * X02)),
            (1.0 + X11, (0.0 * s2, 0.0 * s2, np.ones_like(s2), 0.0 * s2)),
        ):
            if np.min(factor) <= 0.0:
                return _Equations(np.inf, smoothness, z)
            near = factor < _FACTOR_MARGIN
            short = factor[near] - _FACTOR_MARGIN
            loss += 0.5 * float(short @ short)
            J = np.stack(change, axis=-1)[near][:, None, :] * guard_weights[near][:, :, None]
            flat = J.reshape(-1, 4 * size * size)
            H += (flat.T @ flat).reshape(H.shape)
            g += (short @ flat).reshape(g.shape)
        terms: tuple[Term, Term] = (shading, lobes)
        for term, (x, y) in zip(terms, coordinates, strict=True):
            for first in range(0, term.count, CHUNK):
                part = slice(first, first + CHUNK)
                W = bicubic_weights(x[part], y[part], size)
                value, curvature, slope = term.normal_equations(W @ p, part)
                loss += value
                g += W.T @ slope
                for i in range(4):
                    for j in range(i, 4):
                        block = W.T @ (W * curvature[:, i, j, None])
                        H[:, i, :, j] += block
                        if i != j:
                            H[:, j, :, i] += block
        full = tie.T @ H.reshape(4 * size * size, -1) @ tie + smoothness
        return _Equations(loss, full, tie.T @ g.ravel() + smoothness @ z)

    yield from objective.descend(
        state,
        tie.T @ state.residual.ravel() / np.sum(tie, axis=0),
        equations,
        lambda z: (tie @ z).reshape(size, size, 4),
        _STEPS,
    )


def _tie(size: int) -> FloatArray:
    """Return the map from free unknowns to nodes: X00 = X11 on the row of normal incidence."""
    tie = np.eye(4 * size * size)
    twins = 4 * np.arange(size)
    tie[twins + 2, twins] = 1.0
    return np.delete(tie, twins + 2, axis=1)


def _bending(size: int) -> FloatArray:
    """Return second differences along both axes of every channel."""
    d = np.diff(np.eye(size), n=2, axis=0)
    both = np.concatenate([np.kron(d, np.eye(size)), np.kron(np.eye(size), d)])
    return np.kron(both, np.eye(4))


def fit_isotropic(
    output: str | Path,
    size: int = SIZE,
    seed: int = 1,
    configurations: int = CONFIGURATIONS,
    resume: bool | None = None,
    report: Report = lambda message: None,
) -> IsotropicTable:
    """Fit the isotropic table, write it, and return it.

    Parameters
    ----------
    output : str or Path
        The npz file to write, atomically, at the end. Until then a checkpoint lies
        beside it, brought up to date every second or so.
    size : int, 4 to 32
        Nodes on each axis of the residual.
    seed : int, >= 0
        Determines everything random.
    configurations : int, >= 16
        Rectangles fitted to.
    resume : bool, optional
        True: continue from the checkpoint, which must exist; False: discard it;
        by default continue if there is one.
    report : callable
        Takes lines of progress.

    Raises
    ------
    ValueError
        If an argument is out of range, or (CheckpointError) a checkpoint is missing,
        damaged, or of a fit with other settings.
    OSError
        If a file cannot be written.
    """
    output = Path(output)
    for name, value, low, high in (
        ("size", size, 4, 32),
        ("seed", seed, 0, 2**32 - 1),
        ("configurations", configurations, 16, 10**7),
    ):
        if not low <= value <= high:
            raise ValueError(f"{name} is {value}, expected {low} to {high}")
    settings = {"size": size, "seed": seed, "configurations": configurations}
    work = fitting.begin(output, settings, resume, report)

    if "albedo" not in work.arrays:
        report(f"albedo: {ALBEDO_NODES}^2 nodes")
        work.arrays["albedo"], work.arrays["fresnel"] = albedo_tables()
        work.save()
    albedo, fresnel = work.arrays["albedo"], work.arrays["fresnel"]
    cases = random_configurations(
        np.random.default_rng([seed, _TRAIN]), configurations, training=True
    )
    fitting.complete(
        work,
        "exact integrals",
        cases.count,
        exact_integrals,
        lambda part: (cases[part],),
        report,
    )
    table = IsotropicTable(np.zeros((size, size, 4), np.float32), albedo, fresnel)
    A, _ = table.albedo_terms(cases.alpha, cases.cos_theta)
    shading = ShadingError(cases, work.arrays["exact integrals"], A, entry_basis(cases.wo[:, 0]))
    lobes, lobe_coordinates = random_variation(
        np.random.default_rng([seed, _VARIATION_STREAM]), min(_LOBES, configurations)
    )
    coordinates = (np.stack(table_coordinates(cases.alpha, cases.cos_theta)), lobe_coordinates)
    start = work.state or FitState(np.zeros((size, size, 4)))
    steps = fit_steps(start, shading, lobes, coordinates)
    state = fitting.follow(work, steps, _STEPS, report)
    table = IsotropicTable(state.residual.astype(np.float32), albedo, fresnel)
    report("error: 4000 rectangles and 2000 octagons that were not fitted to")
    figures = measure(table, seed)
    provenance = {
        "what": "isotropic GGX, height-correlated Smith; axes and layout: ltc.table",
        "how": "python -m ltc fit isotropic; objective: ltc.fit",
        "settings": settings,
        "versions": fitting.versions(),
        "loss": rounded(np.float64(state.loss)),
        "steps": state.steps,
        "error": figures,
    }
    table = IsotropicTable(table.residual, table.albedo, table.fresnel, provenance)
    save_isotropic(table, output)
    work.path.unlink(missing_ok=True)
    return table


def measure(
    table: IsotropicTable, seed: int, rectangles: int = 4000, octagons: int = 2000
) -> dict[str, Any]:
    """Return `error_figures` on lights that no fit with this seed has seen.

    Keys ``rectangles`` and ``octagons``.
    """
    result = {}
    for name, stream, count, corners in (
        ("rectangles", _TEST, rectangles, 4),
        ("octagons", _OCTAGONS, octagons, 8),
    ):
        cases = random_configurations(np.random.default_rng([seed, stream]), count, corners)
        result[name] = error_figures(shading_errors(table, cases, exact_integrals(cases)), cases)
    return result
