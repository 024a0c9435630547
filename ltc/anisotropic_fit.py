"""Fit the anisotropic table to GGX: ``python -m ltc fit anisotropic``.

What is minimised
    As for the isotropic table (`ltc.fit`), the error of the technique as rendered on
    random rectangles, plus total variation (here with a weight of .15) and a little
    smoothness, by all nodes of X at once and through the interpolation that a
    GPU does. Nodes that meet are one unknown, so there are no seams. Half of the views that
    total variation looks at are uniform along the table's view axis, up to grazing:
    without them the last nodes of thin lobes are determined by nothing.

    The 5,500 unknowns have sparse normal equations, since a case touches 16 nodes:
    blocks per cell, conjugate gradients, Levenberg-Marquardt, about 15 steps. A penalty
    keeps the determinant of I + X away from 0 at nodes and halfway between.

Albedo and Fresnel term
    Exact integrals (`ltc.brdf.directional_albedo`) at every node and at every
    training view; a node gets the value that interpolates best to those around it.

Measured (`random_configurations`: larger alpha .001 to 1, ratio uniform from .01 to 1, theta to
89.9 degrees, any azimuth; 4,000 rectangles, 2,000 octagons, and 4,000 rectangles with
equal alphas; seeds of their own; absolute error, radiance 1)

    ==========  ======  =====  =====  =====
    lights      mean    p95    p99    max
    ==========  ======  =====  =====  =====
    rectangles  .00371  .0154  .0397  .137
    octagons    .00352  .0150  .0377  .092
    diagonal    .00216  .0090  .0207  .054
    ==========  ======  =====  =====  =====

    Rectangles by theta 0-30, 30-60, 60-75, 75-87, 87-89.9 degrees: .0014, .0028, .0049,
    .0078, .0148;
    by larger alpha .001-.01-.1-.3-.6-1: .0004, .0020, .0047, .0054, .0036; by ratio
    .01-.05-.1-.3-.6-1: .0112, .0089, .0049, .0031, .0022. Mean total variation
    .079: by ratio .337, .168, .110, .058, .043.
    The isotropic table errs .00195 on the last row's like.
    What is left is the shape of the lobes: long lunes, which no transform of a cosine
    has, at small ratios and grazing views.

Compared, error against bytes (two textures of X with 16 bytes a node, one of A and u with 4;
mean, p99, mean total variation; weights slightly different from the default's)

    =============  ==============  ==========  ======  =====  =====  ========
    nodes of X     of A            bytes       mean    p99    TV     diagonal
    =============  ==============  ==========  ======  =====  =====  ========
    none (M0)      4, 7, 12, 24       32,256   .0136   .109   .146   .0110
    2, 2, 4, 4     3, 4, 6, 12         4,480   .0047   .045   .084   .0034
    3, 3, 6, 6     4, 5, 8, 16        15,424   .0039   .040   .080   .0024
    3, 4, 6, 6     4, 6, 10, 18       24,192   .0037   .040   .079   .0022
    3, 5, 8, 8     4, 7, 12, 24       47,616   .0037   .040   .079   .0021
    4, 4, 8, 8     4, 7, 12, 24       48,640   .0037   .040   .079   .0021
    4, 5, 8, 7     4, 7, 12, 24       50,176   .0036   .039   .079   .0021
    6, 6, 8, 8     6, 8, 14, 32      122,880   .0037   .040   .079   .0021
    =============  ==============  ==========  ======  =====  =====  ========

    Axes hardly matter to X (one set of views with more small ratios, mean): azimuth by
    |v_b| / (|v_a| + |v_b|), by angle or by sin^2 .0052, all three; ratio by its root .0051,
    itself .0052; view with the alpha along it, the larger alpha or their geometric mean .0052,
    uniform in theta .0056. A ratio axis from 0 instead of .01 .0041 instead of .0037,
    with negative determinants at its end. To A the azimuth by sin^2 costs a tenth, and the
    nodes' own exact values instead of the best ones double the error (.0016 instead
    of .0007 in the mean). Weights of total variation .03, .06, .12, .3 give means of
    .0037, .0037, .0037, .0038 and total variations of .0805, .0800, .0794, .0784.

Time: 107 s on two idle cores (60 s exact integrals and albedos, 30 s the steps, 12 s the error
figures), 290 s on two cores with other work. The result depends on the seed and the library
versions alone.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sparse
from numpy.typing import NDArray
from scipy.sparse.linalg import LinearOperator, cg

from ltc import brdf, fit, fitting, objective
from ltc.anisotropic import (
    AXES,
    CHANNELS,
    AnisotropicTable,
    Shape,
    eliminated,
    entry_basis,
    halfway_points,
    interpolate,
    multilinear,
    node_views,
    save_anisotropic,
    stretched_length,
    table_coordinates,
    tied,
    view_direction,
)
from ltc.fitting import Report
from ltc.objective import (
    ALPHA_BOUNDS,
    CHUNK,
    THETA_BOUNDS,
    THETA_MAX,
    Configurations,
    Equations,
    FitState,
    LobeVariation,
    ShadingError,
    Term,
    exact_integrals,
    random_lights,
    rounded,
)
from ltc.polygon import ltc_specular
from ltc.table import ALPHA_MIN

FloatArray = NDArray[np.float64]

SHAPE: Shape = (4, 4, 8, 8)
"""Default nodes of the residual along `ltc.anisotropic.AXES`."""
ALBEDO_SHAPE: Shape = (4, 7, 12, 24)
"""Default nodes of albedo and Fresnel term."""
CONFIGURATIONS = 40_000
"""Default number of rectangles fitted to."""
RATIO_BOUNDS = (0.01, 0.05, 0.1, 0.3, 0.6, 1.0)
"""Bounds of the error figures' ranges of the smaller alpha over the larger."""

_RATIO_MIN = 0.01  # smallest ratio of alphas in the error figures
_ALBEDO_STEP = 0.2  # of the quadrature; errs less than half floats by far
_ALBEDO_COSINE = 1e-7  # in units of the smaller alpha; stands for a view in the surface
_ALBEDO_TIE = 0.1  # weight of a node's own exact value beside the values read between nodes
_VARIATION = 0.15  # weight of the total variation
_SMOOTHNESS = 1e-5  # weight of squared second differences of the residual
_LOBES, _DIRECTIONS = 4000, 64  # views, and directions each, in the total variation
_LOBE_COSINE = 1e-5  # of their views to the normal, at least: the last nodes are seen too
_FIGURE_LOBES, _FIGURE_DIRECTIONS = 2000, 512  # the same in the figures
_DETERMINANT_MARGIN = 0.15  # determinants of I + X below this are penalised, by squares
_DETERMINANT_WEIGHT = 0.02
_DAMPING_FLOOR = 0.1  # damping of unknowns that little depends on, in mean curvatures
_STEPS = 30  # at most
_SOLVER_STEPS, _SOLVER_ACCURACY = 400, 1e-3  # of conjugate gradients

_TRAIN, _TEST, _OCTAGONS, _VARIATION_STREAM, _DIAGONAL, _LOBE_FIGURES = range(6)


def random_views(
    rng: np.random.Generator,
    count: int,
    training: bool = False,
    by_nodes: float = 0.2,
    cos_min: float = float(np.cos(THETA_MAX)),
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return random (alpha_x, alpha_y, wo), (n,), (n,) and (n, 3).

    Parameters
    ----------
    rng : numpy.random.Generator
        Source of all randomness.
    count : int
        How many.
    training : bool
        Spread over the whole table instead of the range of the error figures.
    by_nodes : float
        For training, the share of views that are uniform along the table's view axis.
    cos_min : float
        Their smallest cosine to the normal.

    Notes
    -----
    The square root of the larger alpha is uniform from sqrt(.001) to 1, the ratio from .01 to
    1, which of them is the larger is a coin's, theta is uniform from 0 to 89.9 degrees and
    the azimuth over the circle. For training the square root of alpha begins at .01; the ratio
    or, by a coin, its square root is uniform. No alpha is below ALPHA_MIN.
    """
    a = rng.uniform(0.01 if training else np.sqrt(1e-3), 1.0, count) ** 2
    if training:
        root = rng.uniform(np.sqrt(_RATIO_MIN), 1.0, count)
        uniform = rng.uniform(_RATIO_MIN, 1.0, count)
        ratio = np.where(rng.random(count) < 0.5, uniform, root * root)
    else:
        ratio = rng.uniform(_RATIO_MIN, 1.0, count)
    b = np.maximum(ratio * a, ALPHA_MIN)
    coin = rng.random(count) < 0.5
    ax, ay = np.where(coin, a, b), np.where(coin, b, a)
    c, phi = np.cos(rng.uniform(0.0, THETA_MAX, count)), rng.uniform(0.0, 2.0 * np.pi, count)
    if training:
        along = np.hypot(ax * np.cos(phi), ay * np.sin(phi))
        view = rng.uniform(0.0, 1.0, count)
        p, r = view * view * (1.0 + along), along * np.square(1.0 - view)
        c = np.where(rng.random(count) < by_nodes, np.maximum(r / (p + r), cos_min), c)
    return ax, ay, view_direction(c, phi)


def random_configurations(
    rng: np.random.Generator, count: int, corners: int = 4, training: bool = False
) -> Configurations:
    """Return `random_views` with one light each, see `ltc.objective.random_lights`."""
    return random_lights(rng, *random_views(rng, count, training), corners)


def shading_errors(
    table: AnisotropicTable, configurations: Configurations, exact: FloatArray
) -> FloatArray:
    """Return the technique's absolute errors, (n,).

    Parameters
    ----------
    table : AnisotropicTable
    configurations, exact
        The cases and their `ltc.objective.exact_integrals`.
    """
    c = configurations
    M = table.matrix_of_view(c.alpha_x, c.alpha_y, c.wo)
    A, _ = table.albedo_terms_of_view(c.alpha_x, c.alpha_y, c.wo)
    return np.abs(ltc_specular(M, [c.corners], A) - exact)


def lobe_variations(
    table: AnisotropicTable,
    views: tuple[FloatArray, FloatArray, FloatArray],
    rng: np.random.Generator,
    directions: int = _FIGURE_DIRECTIONS,
) -> FloatArray:
    """Return the total variation between GGX and the table's lobe at each view, (n,).

    Parameters
    ----------
    table : AnisotropicTable
    views : (n,), (n,) and (n, 3) float64
        alpha_x, alpha_y and wo.
    rng : numpy.random.Generator
        Source of the directions of the Monte Carlo estimate.
    directions : int
        For each view.
    """
    lobes = LobeVariation(rng, *views, directions, entry_basis(*views))
    entries = interpolate(table.residual, table_coordinates(*views))
    result = np.zeros(lobes.count)
    for first in range(0, lobes.count, CHUNK // 4):
        part = slice(first, first + CHUNK // 4)
        result[part] = np.sum(np.abs(lobes.differences(entries[part], part)[0]), axis=1)
    return result


def exact_terms(alpha_x: FloatArray, alpha_y: FloatArray, wo: FloatArray) -> FloatArray:
    """Return exact albedo A and its Fresnel part B, (n, 2) float64."""
    return np.stack(brdf.directional_albedo(wo, alpha_x, alpha_y, _ALBEDO_STEP), axis=-1)


def _albedo_nodes(shape: Sequence[int]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return (alpha_x, alpha_y, v) at the nodes, flat, with views above the surface."""
    ax, ay, v = (values.reshape(-1, *values.shape[4:]) for values in node_views(shape))
    v[:, 2] = np.maximum(v[:, 2], _ALBEDO_COSINE * ay)
    return ax, ay, v


def albedo_tables(
    shape: Sequence[int],
    node_terms: FloatArray,
    views: tuple[FloatArray, FloatArray, FloatArray],
    terms: FloatArray,
) -> tuple[NDArray[np.float16], NDArray[np.float16]]:
    """Return A and the Fresnel cosine u at the nodes, (*shape) each.

    Parameters
    ----------
    shape : four ints
    node_terms : (nodes, 2) float64
        `exact_terms` at the nodes.
    views, terms
        Views between the nodes and their `exact_terms`.

    Notes
    -----
    A node gets the value that interpolates best to the exact values around it, by
    least squares, with a slight pull to its own exact value: where A bends,
    the exact values at the nodes would all err to one side between them. For u the errors
    count as they change B, to first order.
    """
    size = int(np.prod(shape))
    numbers = tied(np.arange(size).reshape(shape), residual=False).ravel()
    owners, owner = np.unique(numbers, return_inverse=True)
    spread = sparse.csr_array((np.ones(size), (np.arange(size), owner)))
    index, weight = multilinear(table_coordinates(*views), shape)
    rows = np.repeat(np.arange(len(index)), index.shape[1])
    W = sparse.csr_array((weight.ravel(), (rows, index.ravel())), shape=(len(index), size))
    W = W @ spread

    q = np.concatenate([stretched_length(*_albedo_nodes(shape)), stretched_length(*views)])
    both = np.concatenate([node_terms, terms])
    A = np.minimum(both[:, 0], 1.0)
    root = np.minimum(both[:, 1] / A, 1.0) ** 0.2
    u = (1.0 - root) / q
    steepness = 5.0 * A * q * root**4
    result = []
    for values, importance in ((A, np.ones(len(A))), (u, steepness)):
        own, seen = values[:size][owners], values[size:]
        here, there = _ALBEDO_TIE * (1.0 + importance[:size][owners]), importance[size:]
        equations = W.T @ sparse.diags_array(there**2) @ W + sparse.diags_array(here**2)
        solution, _ = cg(
            equations.tocsr(), W.T @ (there**2 * seen) + here**2 * own, x0=own, rtol=1e-8
        )
        result.append(np.maximum(spread @ solution, 0.0).reshape(shape))
    return _halves(np.minimum(result[0], 1.0)), _halves(result[1])


def _halves(values: FloatArray) -> NDArray[np.float16]:
    """Return half floats; numbers too small for them are as good as zero."""
    with np.errstate(under="ignore"):
        return values.astype(np.float16)


class _Cases:
    """A term of the loss at points of the grid."""

    def __init__(self, term: Term, coordinates: FloatArray, shape: Sequence[int]) -> None:
        self.term = term
        self.index, self.weight = multilinear(coordinates, shape)
        cells = np.stack(np.unravel_index(self.index[:, 0], shape))
        cell = np.ravel_multi_index(tuple(cells), tuple(n - 1 for n in shape))
        self.order = np.argsort(cell, kind="stable")
        starts = np.flatnonzero(np.diff(cell[self.order], prepend=-1))
        self.cells = cell[self.order][starts]
        self.groups = np.split(self.order, starts[1:])


class _Determinants:
    """A penalty on small determinants of I + X, which no step may turn negative."""

    def __init__(self, basis: FloatArray) -> None:
        self.basis, self.count = basis, len(basis)

    def normal_equations(
        self, entries: FloatArray, part: slice
    ) -> tuple[float, FloatArray, FloatArray]:
        basis = self.basis[part]
        matrix = np.einsum("np,npij->nij", entries, basis) + np.eye(3)
        determinant = np.linalg.det(matrix)
        if np.min(eliminated(matrix - np.eye(3))) <= 0.0:
            return np.inf, np.zeros((*entries.shape, CHANNELS)), np.zeros(entries.shape)
        short = np.minimum(determinant - _DETERMINANT_MARGIN, 0.0)
        slope = np.einsum("nij,npji->np", np.linalg.inv(matrix), basis)
        slope *= np.where(short < 0.0, determinant, 0.0)[:, None]
        loss = 0.5 * _DETERMINANT_WEIGHT * float(np.sum(short * short))
        weighted = _DETERMINANT_WEIGHT * slope
        return loss, weighted[:, :, None] * slope[:, None, :], short[:, None] * weighted


class _Equations:
    """The sparse normal equations at one point."""

    def __init__(self, loss: float, curvature: Any, slope: FloatArray) -> None:
        self.loss, self._H, self._g = loss, curvature, slope

    def step(self, damping: float) -> FloatArray:
        diagonal = self._H.diagonal()
        extra = damping * (diagonal + _DAMPING_FLOOR * np.mean(diagonal))
        damped = (self._H + sparse.diags_array(extra)).tocsr()
        scale = 1.0 / (diagonal + extra)
        scaling = LinearOperator(damped.shape, matvec=lambda x: scale * x, dtype=np.float64)
        step, _ = cg(damped, -self._g, rtol=_SOLVER_ACCURACY, maxiter=_SOLVER_STEPS, M=scaling)
        return np.asarray(step)


class GridFit:
    """All nodes of a residual at once: how the loss depends on them.

    Parameters
    ----------
    shape : four ints
        Nodes of the residual.
    terms : sequence of (term, coordinates)
        What is minimised, with the coordinates (n, 4) of each term's cases.
    """

    def __init__(self, shape: Sequence[int], terms: Sequence[tuple[Term, FloatArray]]) -> None:
        self.shape = (*shape, CHANNELS)
        guard = halfway_points(shape).reshape(-1, 4)
        views = (
            values.reshape(-1, *values.shape[4:])
            for values in node_views([2 * n - 1 for n in shape])
        )
        determinants = _Determinants(entry_basis(*views))
        self.cases = [_Cases(term, t, shape) for term, t in ((determinants, guard), *terms)]

        # Unknown of each node's channel; -1 for the zeros.
        size = int(np.prod(self.shape))
        numbers = tied(np.arange(1, size + 1).reshape(self.shape), residual=True)
        owners, owner = np.unique(numbers, return_inverse=True)
        self.owner = owner.reshape(-1, CHANNELS) - 1
        self.first = owners[1:] - 1  # where in the nodes each unknown stands first
        self.unknowns = self.first.size

        bends = []
        for axis in range(4):
            parts: list[Any] = [sparse.eye_array(n) for n in self.shape]
            parts[axis] = sparse.csr_array(np.diff(np.eye(shape[axis]), n=2, axis=0))
            bend = parts[0]
            for part in parts[1:]:
                bend = sparse.kron(bend, part)
            bends.append(bend)
        free = self.owner.ravel() >= 0
        spread = sparse.csr_array(
            (np.ones(int(np.sum(free))), (np.flatnonzero(free), self.owner.ravel()[free])),
            shape=(size, self.unknowns),
        )
        bending = (sparse.vstack(bends) @ spread).tocsr()
        self.smoothness: Any = (_SMOOTHNESS * (bending.T @ bending)).tocsr()

        # Where each entry of a cell's block of curvature goes in the sparse whole.
        cells = [n - 1 for n in shape]
        self.cell_count = int(np.prod(cells))
        low = np.stack(np.unravel_index(np.arange(self.cell_count), cells), axis=-1)
        corners, _ = multilinear((low + 0.5) / np.array(cells), shape)
        unknown = self.owner[corners].reshape(self.cell_count, -1)
        row = np.repeat(unknown[:, :, None], unknown.shape[1], axis=2).ravel()
        column = np.repeat(unknown[:, None, :], unknown.shape[1], axis=1).ravel()
        self.present = (row >= 0) & (column >= 0)
        key = row[self.present] * self.unknowns + column[self.present]
        keys, self.target = np.unique(key, return_inverse=True)
        self.columns = keys % self.unknowns
        self.row_starts = np.searchsorted(keys // self.unknowns, np.arange(self.unknowns + 1))

    def nodes(self, z: FloatArray) -> FloatArray:
        """Return the residual (*shape, 7) of the unknowns."""
        values = np.append(z, 0.0)[self.owner]
        return np.asarray(values.reshape(self.shape))

    def free(self, residual: FloatArray) -> FloatArray:
        """Return the unknowns of a residual."""
        return np.asarray(residual.ravel()[self.first])

    def equations(self, z: FloatArray) -> Equations:
        """Return the loss at z and what a step from there needs."""
        p = self.nodes(z).reshape(-1, CHANNELS)
        bent = self.smoothness @ z
        loss, slope = 0.5 * float(z @ bent), np.zeros(p.shape)
        blocks = np.zeros((self.cell_count, 16 * 16, CHANNELS * CHANNELS))
        for cases in self.cases:
            count = cases.term.count
            curvature = np.zeros((count, CHANNELS * CHANNELS))
            for first in range(0, count, CHUNK):
                part = slice(first, first + CHUNK)
                index, weight = cases.index[part], cases.weight[part]
                entries = np.einsum("nk,nkp->np", weight, p[index])
                value, square, g = cases.term.normal_equations(entries, part)
                if not np.isfinite(value):
                    return _Equations(np.inf, self.smoothness, z)
                loss += value
                curvature[part] = square.reshape(len(square), -1)
                for channel in range(CHANNELS):
                    slope[:, channel] += np.bincount(
                        index.ravel(), (weight * g[:, channel, None]).ravel(), len(p)
                    )
            for cell, group in zip(cases.cells, cases.groups, strict=True):
                w = cases.weight[group]
                pairs = (w[:, :, None] * w[:, None, :]).reshape(len(group), -1)
                blocks[cell] += pairs.T @ curvature[group]
        blocks = blocks.reshape(-1, 16, 16, CHANNELS, CHANNELS).swapaxes(2, 3)
        data = np.bincount(self.target, blocks.ravel()[self.present], self.columns.size)
        H: Any = sparse.csr_array(
            (data, self.columns, self.row_starts), shape=(self.unknowns, self.unknowns)
        )
        # The last bin takes the slopes of the zeros.
        owner = np.where(self.owner < 0, self.unknowns, self.owner).ravel()
        g = np.bincount(owner, slope.ravel(), self.unknowns + 1)[:-1] + bent
        return _Equations(loss, (H + self.smoothness).tocsr(), g)

    def steps(self, state: FitState) -> Iterator[FitState]:
        """Yield ever better states, see `ltc.objective.descend`."""
        yield from objective.descend(
            state, self.free(state.residual), self.equations, self.nodes, _STEPS
        )


def fit_anisotropic(
    output: str | Path,
    shape: Sequence[int] = SHAPE,
    albedo_shape: Sequence[int] = ALBEDO_SHAPE,
    seed: int = 1,
    configurations: int = CONFIGURATIONS,
    resume: bool | None = None,
    report: Report = lambda message: None,
    executor: Executor | None = None,
) -> AnisotropicTable:
    """Fit the anisotropic table, write it, and return it.

    Parameters
    ----------
    output : str or Path
        The npz file to write, atomically, at the end. Until then a checkpoint lies
        beside it, brought up to date every second or so.
    shape, albedo_shape : four ints, 2 to 64
        Nodes of the residual, and of albedo and Fresnel term, along `ltc.anisotropic.AXES`.
    seed : int, >= 0
        Determines everything random.
    configurations : int, >= 16
        Rectangles fitted to.
    resume : bool, optional
        True: continue from the checkpoint, which must exist; False: discard it;
        by default continue if there is one.
    report : callable
        Takes lines of progress.
    executor : concurrent.futures.Executor, optional
        Computes the exact integrals, most of the work, piece by piece; by default they are
        computed here. The result does not depend on it.

    Raises
    ------
    ValueError
        If an argument is out of range, or (CheckpointError) a checkpoint is missing,
        damaged, or of a fit with other settings.
    OSError
        If a file cannot be written.
    """
    output = Path(output)
    for name, nodes in (("shape", shape), ("albedo_shape", albedo_shape)):
        if len(nodes) != len(AXES) or not all(2 <= n <= 64 for n in nodes):
            raise ValueError(f"{name} is {tuple(nodes)}, expected four numbers from 2 to 64")
    for name, value, low, high in (
        ("seed", seed, 0, 2**32 - 1),
        ("configurations", configurations, 16, 10**7),
    ):
        if not low <= value <= high:
            raise ValueError(f"{name} is {value}, expected {low} to {high}")
    settings = {
        "shape": [int(n) for n in shape],
        "albedo_shape": [int(n) for n in albedo_shape],
        "seed": seed,
        "configurations": configurations,
    }
    work = fitting.begin(output, settings, resume, report)

    def complete(name: str, count: int, function: Any, arguments: Any) -> FloatArray:
        fitting.complete(work, name, count, function, arguments, report, executor)
        return work.arrays[name]

    cases = random_configurations(
        np.random.default_rng([seed, _TRAIN]), configurations, training=True
    )
    views = (cases.alpha_x, cases.alpha_y, cases.wo)
    at_nodes = _albedo_nodes(albedo_shape)
    node_terms = complete(
        "albedo at nodes",
        at_nodes[0].size,
        exact_terms,
        lambda part: tuple(values[part] for values in at_nodes),
    )
    terms = complete(
        "albedo between nodes",
        cases.count,
        exact_terms,
        lambda part: tuple(values[part] for values in views),
    )
    exact = complete("exact integrals", cases.count, exact_integrals, lambda part: (cases[part],))
    albedo, fresnel = albedo_tables(albedo_shape, node_terms, views, terms)

    A = interpolate(albedo, table_coordinates(*views))
    shading = ShadingError(cases, exact, A, entry_basis(*views))
    rng = np.random.default_rng([seed, _VARIATION_STREAM])
    lobe_views = random_views(rng, min(_LOBES, configurations), True, 0.5, _LOBE_COSINE)
    lobes = LobeVariation(rng, *lobe_views, _DIRECTIONS, entry_basis(*lobe_views), _VARIATION)
    grid = GridFit(
        shape,
        [(shading, table_coordinates(*views)), (lobes, table_coordinates(*lobe_views))],
    )
    start = work.state or FitState(np.zeros(grid.shape))
    state = fitting.follow(work, grid.steps(start), _STEPS, report)
    table = AnisotropicTable(_halves(state.residual), albedo, fresnel)
    report("error: lights and views that were not fitted to")
    figures = measure(table, seed)
    provenance = {
        "what": "anisotropic GGX, height-correlated Smith; axes and layout: ltc.anisotropic",
        "how": "python -m ltc fit anisotropic; objective: ltc.anisotropic_fit",
        "settings": settings,
        "versions": fitting.versions(),
        "loss": rounded(np.float64(state.loss)),
        "steps": state.steps,
        "error": figures,
    }
    table = AnisotropicTable(table.residual, table.albedo, table.fresnel, provenance)
    save_anisotropic(table, output)
    work.path.unlink(missing_ok=True)
    return table


def error_figures(errors: FloatArray, configurations: Configurations) -> dict[str, Any]:
    """Return `ltc.objective.error_figures` by theta in degrees, larger alpha and ratio."""
    theta = np.degrees(np.arccos(configurations.cos_theta))
    axes = {
        "theta": (theta, THETA_BOUNDS),
        "alpha": (configurations.alpha, ALPHA_BOUNDS),
        "ratio": (configurations.ratio, RATIO_BOUNDS),
    }
    return objective.error_figures(errors, axes)


def measure(
    table: AnisotropicTable, seed: int, rectangles: int = 4000, octagons: int = 2000
) -> dict[str, Any]:
    """Return error figures on lights and views that no fit with this seed has seen.

    Keys ``rectangles``, ``octagons`` and, for equal alphas (the configurations of the
    isotropic table's figures), ``diagonal``: `error_figures`; and ``variation``: mean
    and maximum of the total variation between GGX and lobe over random views.
    """
    result: dict[str, Any] = {}
    for name, stream, count, corners in (
        ("rectangles", _TEST, rectangles, 4),
        ("octagons", _OCTAGONS, octagons, 8),
    ):
        cases = random_configurations(np.random.default_rng([seed, stream]), count, corners)
        result[name] = error_figures(shading_errors(table, cases, exact_integrals(cases)), cases)
    cases = fit.random_configurations(np.random.default_rng([seed, _DIAGONAL]), rectangles)
    result["diagonal"] = fit.error_figures(
        shading_errors(table, cases, exact_integrals(cases)), cases
    )
    rng = np.random.default_rng([seed, _LOBE_FIGURES])
    views = random_views(rng, _FIGURE_LOBES)
    variation = lobe_variations(table, views, rng)
    result["variation"] = {
        "mean": rounded(np.mean(variation)),
        "max": rounded(np.max(variation)),
    }
    return result
