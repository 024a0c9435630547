"""The doctor: what is wrong with a table of transforms, named.

`check` examines any `ltc.formats.Grid`. Every node is held against GGX by way of
`ltc.table.closed_form_guess`, whose determinant is within a factor of 20 of a
fitted lobe's everywhere, then against its neighbours, then the whole table against
exact integrals. Names go from cause to effect: a node with a fault is
left out of later checks, a wrong reading of an axis is put right before the
rest is checked, and what follows from a broken node (a larger shading error, a
sign that changes beside it) is shown but not named again. So one fault
gives one name.

Limits were chosen between what good tables of any published layout reach and what
the published ones were found to have; each stands beside its constant.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ltc import brdf, transform
from ltc.formats import Grid, IsotropicGrid, Samples, nodes
from ltc.objective import (
    ALPHA_BOUNDS,
    THETA_BOUNDS,
    THETA_MAX,
    Configurations,
    error_figures,
    exact_integrals,
    random_lights,
)
from ltc.polygon import loops_form_factor, ltc_specular
from ltc.table import closed_form_guess, load_isotropic

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


class Fault(StrEnum):
    """What a table can be broken by."""

    ROUGHNESS = "roughness taken for alpha"
    UNSET = "entries not set"
    CIRCLE = "entry at phi = 2 pi not set"
    DECIMALS = "matrices made singular by fixed-point decimals"
    SINGULAR = "singular matrices"
    NEGATIVE = "negative determinants"
    COLLAPSED = "last theta column collapses"
    FAR = "lobes far from GGX"
    BETWEEN = "singular or of changing sign between neighbours"
    LEAK = "mass below the horizon"
    NO_ALBEDO = "no amplitude"
    AMPLITUDE_AXES = "amplitude stored over other axes than it is read by"
    ALBEDO = "amplitude off"
    NO_FRESNEL = "no Fresnel term"
    FRESNEL = "Fresnel term off"
    SEAM = "lobes differ across a seam"
    ISOTROPY = "not isotropic at alpha_x = alpha_y"
    SHADING = "shading integral off"


SINGULAR = 1e-6
"""Determinants below this share of GGX's count as zero: no lobe is that thin."""
FAR = 60.0
"""Largest ratio, either way, between determinants; fitted lobes stay within 3.5 where the
alphas are equal and 20 where they are not."""
FAR_ANGLE = 0.8
"""Largest angle between a lobe's axis and the closed form's [rad]; fitted lobes stay within .55."""
BETWEEN = 1e-4
"""Smallest share of GGX's determinant between nodes; linear interpolation of M^-1 reaches .05."""
LEAK = 0.05
"""Largest share of a lobe below the surface where lights are not clipped there."""
ALBEDO_MEAN, ALBEDO_MAX = 0.02, 0.05
"""Largest errors of amplitude and Fresnel part; 32^2 samples, as published, reach .01."""
SEAM = 0.05
"""Largest total variation between the two sides of a seam."""
ISOTROPY = 0.25
"""Largest mean total variation against the isotropic table; two good fits differ by .1."""
SHADING_MEAN, SHADING_P99 = 0.05, 0.5
"""Largest errors of the shading integral; the published tables reach .0089 and .106, the
closed form untouched on a grid of 6 5 6 5, interpolated linearly, .028 and .24."""

_HALF_FACTOR = 2.0  # a determinant that half floats change by more has not survived them
_DIRECTIONS = 32  # for the total variation between two lobes, from each
_LOBES = 400  # random lobes compared with GGX, with _MANY directions each
_MANY = 128
_WORST = 5


@dataclass(frozen=True)
class Finding:
    """One line of the report; ``fault`` is set where the table is broken."""

    what: str
    figure: str
    note: str = ""
    fault: Fault | None = None
    warning: bool = False


@dataclass(frozen=True)
class Case:
    """One shading integral: angles in degrees, radiance of the light 1."""

    alpha_x: float
    alpha_y: float
    theta: float
    phi: float
    got: float
    exact: float


@dataclass(frozen=True, eq=False)
class Report:
    """What `check` found.

    Attributes
    ----------
    findings : tuple of Finding
    figures : dict
        `ltc.objective.error_figures` of the shading integral.
    worst : tuple of Case
        Largest error first.
    maps : dict of str to (*shape) float64
        Per node, for plots: ``determinant`` over GGX's, ``leak``; NaN where a node has
        a fault.
    cases, errors
        The shading integrals and their absolute errors, for plots.
    """

    layout: str
    axes: tuple[str, ...]
    findings: tuple[Finding, ...]
    figures: dict[str, Any]
    worst: tuple[Case, ...]
    maps: dict[str, FloatArray] = field(default_factory=dict)
    cases: Configurations | None = None
    errors: FloatArray | None = None

    @property
    def faults(self) -> tuple[Fault, ...]:
        """The table's faults; none if it is sound."""
        return tuple(f.fault for f in self.findings if f.fault is not None)


def check(grid: Grid, seed: int = 1, rectangles: int = 2000, albedo_views: int = 300) -> Report:
    """Examine a table.

    Parameters
    ----------
    grid : Grid
        From `ltc.formats.read`.
    seed : int
        Of all randomness.
    rectangles : int, >= 10
        Shading integrals to compare with exact ones.
    albedo_views : int, >= 10
        Nodes whose amplitude is compared with the exact albedo, 2 ms each.

    Raises
    ------
    ValueError
        If a number is out of range.
    """
    for name, value in (("rectangles", rectangles), ("albedo_views", albedo_views)):
        if not 10 <= value <= 10**6:
            raise ValueError(f"{name} is {value}, expected 10 to 1000000")
    return _Doctor(grid, np.random.default_rng(seed)).examine(rectangles, albedo_views)


def variation(a: FloatArray, b: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Return an estimate of the total variation between pairs of lobes, in [0, 1].

    Parameters
    ----------
    a, b : (n, 3, 3) float64
        Regular ``shading_from_cosine``.

    Returns
    -------
    (n,) float64
        The mean of |p - q| / (p + q) over directions drawn from both; exactly
        0 for equal lobes, standard error about .05 for others.
    """
    u = rng.random((a.shape[0], 2 * _DIRECTIONS, 2))
    w = np.concatenate(
        [
            transform.sample(u[:, :_DIRECTIONS], a[:, None]),
            transform.sample(u[:, _DIRECTIONS:], b[:, None]),
        ],
        axis=1,
    )
    with np.errstate(under="ignore"):
        p, q = transform.evaluate(w, a[:, None]), transform.evaluate(w, b[:, None])
        total = p + q
        return np.asarray(np.mean(np.abs(p - q) / np.where(total > 0.0, total, 1.0), axis=1))


def variation_from_ggx(
    matrix: FloatArray,
    alpha_x: FloatArray,
    alpha_y: FloatArray,
    wo: FloatArray,
    albedo: FloatArray,
    rng: np.random.Generator,
) -> FloatArray:
    """Return an estimate of the total variation between lobes and GGX, (n,).

    ``albedo`` (n,) normalises GGX. Half the directions come from the lobe, half are
    visible normals' reflections; what the lobe has below the surface counts whole.
    """
    n = matrix.shape[0]
    ax, ay, v = alpha_x[:, None], alpha_y[:, None], wo[:, None]
    h = brdf.sample_visible_normals(v, rng.random((n, _MANY, 2)), ax, ay)
    own = transform.sample(rng.random((n, _MANY, 2)), matrix[:, None])
    w = np.concatenate([own, brdf.reflect(v, h)], axis=1)
    with np.errstate(under="ignore"):
        p = transform.evaluate(w, matrix[:, None])
        ggx = brdf.evaluate(v, w, ax, ay) / albedo[:, None]
        density = 0.5 * (p + brdf.pdf(v, w, ax, ay))
        above = (w[..., 2] > 0.0) & (density > 0.0)
        apart = np.where(above, np.abs(p - ggx) / np.where(above, density, 1.0), 0.0)
    return np.asarray(0.5 * (np.mean(apart, axis=1) + transform.leak(matrix)))


def _rotation(phi: FloatArray) -> FloatArray:
    R = np.zeros((*phi.shape, 3, 3))
    R[..., 0, 0] = R[..., 1, 1] = np.cos(phi)
    R[..., 1, 0] = np.sin(phi)
    R[..., 0, 1] = -R[..., 1, 0]
    R[..., 2, 2] = 1.0
    return R


_SWAP = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


class _Doctor:
    """One examination; arrays over nodes are flat."""

    def __init__(self, grid: Grid, rng: np.random.Generator) -> None:
        self.grid = grid
        self.rng = rng
        self.findings: list[Finding] = []
        self.u = nodes(grid).reshape(-1, len(grid.axes))
        self.samples = grid.at(self.u)
        self.alpha_x, self.alpha_y, self.wo = grid.configuration(self.u)
        self.guess = closed_form_guess(self.alpha_x, self.alpha_y, self.wo)
        self.good = np.ones(self.u.shape[0], dtype=np.bool_)
        self.broken_nodes = False
        self.last_view = self.u[:, grid.view_axis] == 1.0

    def add(
        self,
        what: str,
        figure: str,
        note: str = "",
        fault: Fault | None = None,
        warning: bool = False,
    ) -> None:
        self.findings.append(Finding(what, figure, note, fault, warning))

    def place(self, index: int) -> str:
        """Return what a node stands for."""
        theta, phi = _angles(self.wo[index])
        text = f"alpha {self.alpha_x[index]:.4g}"
        if self.grid.anisotropic:
            text += f" x {self.alpha_y[index]:.4g}, theta {theta:.4g}, phi {phi:.4g}"
        else:
            text += f", theta {theta:.4g}"
        where = np.unravel_index(index, self.grid.shape)
        return f"[{', '.join(str(int(i)) for i in where)}] ({text})"

    def name_nodes(self, what: str, bad: BoolArray, fault: Fault, note: str) -> None:
        """Name nodes that are bad and have no name yet."""
        bad = bad & self.good
        count = int(np.count_nonzero(bad))
        if count:
            first = self.place(int(np.argmax(bad)))
            self.add(what, f"{count} of {bad.size}", f"{note}; first at {first}", fault)
            self.good = self.good & ~bad
            self.broken_nodes = True

    def examine(self, rectangles: int, albedo_views: int) -> Report:
        if self.grid.power != 1.0:
            self.add(
                "alpha axis",
                f"alpha^{self.grid.power:g}",
                "the lobes are those of this power of the alpha that the axes say; read so below",
                Fault.ROUGHNESS,
            )
        determinant = self.matrices()
        self.between(determinant)
        leak = self.leak()
        exact_albedo = self.albedo(albedo_views)
        self.half()
        self.seams()
        self.isotropy()
        figures, worst, cases, errors = self.shading(rectangles, exact_albedo)
        shape = self.grid.shape
        return Report(
            self.grid.layout,
            self.grid.axes,
            tuple(self.findings),
            figures,
            worst,
            {"determinant": determinant.reshape(shape), "leak": leak.reshape(shape)},
            cases,
            errors,
        )

    def matrices(self) -> FloatArray:
        """Name broken nodes; return determinants over the closed form's, NaN where broken."""
        m = self.samples.matrix
        entries = self.grid.entries
        stored = m if entries is None else entries.reshape(-1, 3, 3)
        unset = ~np.all(np.isfinite(stored), axis=(1, 2))
        # An inverse is stored without its middle entry, which is 1.
        outer = np.abs(np.delete(stored.reshape(-1, 9), 4, axis=1))
        unset |= np.all(outer == 0.0, axis=1)
        if self.grid.circle_axis is not None:
            full = self.u[:, self.grid.circle_axis] == 1.0
            note = "zero or not a number where phi closes"
            self.name_nodes("phi = 2 pi", unset & full, Fault.CIRCLE, note)
        self.name_nodes("entries", unset, Fault.UNSET, "zero or not a number")

        decimals = self.grid.decimals
        if decimals is None and entries is not None:
            decimals = fixed_decimals(entries)
        if decimals is not None:
            safe = np.where(unset[:, None, None], 0.0, stored)
            cofactors = np.cross(safe[:, [1, 2, 0]], safe[:, [2, 0, 1]])
            doubt = 0.5 * 10.0**-decimals * np.sum(np.abs(cofactors), axis=(1, 2))
            note = f"{decimals} decimals leave the sign of the determinant open"
            hidden = np.abs(np.linalg.det(safe)) <= doubt
            self.name_nodes("decimals", hidden, Fault.DECIMALS, note)

        with np.errstate(all="ignore"):
            length = np.linalg.norm(m[..., 2], axis=-1)
            axis = m[..., 2] / length[:, None]
            ratio = np.linalg.det(m) / length**3 / np.linalg.det(self.guess)
            angle = np.arccos(np.clip(np.sum(axis * self.guess[..., 2], axis=-1), -1.0, 1.0))
            singular = ~(np.abs(ratio) >= SINGULAR)
            far = ~((np.abs(ratio) <= FAR) & (np.abs(ratio) >= 1.0 / FAR) & (angle <= FAR_ANGLE))
        note = "GGX's lobes here have other widths or directions by far"
        self.name_nodes("last theta column", far & self.last_view, Fault.COLLAPSED, note)
        self.name_nodes("determinants", singular, Fault.SINGULAR, "no inverse")
        self.name_nodes(
            "determinants",
            ratio < 0.0,
            Fault.NEGATIVE,
            "the lobe is mirrored, lights turn negative",
        )
        self.name_nodes("lobes", far, Fault.FAR, note)

        good = self.good
        kept = np.where(good, ratio, np.nan)
        if np.any(good):
            self.add(
                "determinants",
                f"{np.min(ratio[good]):.3g} to {np.max(ratio[good]):.3g}",
                "times the closed form's; 1 is typical",
            )
            condition = np.linalg.cond(m[good])
            self.add(
                "condition numbers",
                f"{np.median(condition):.3g}, at most {np.max(condition):.3g}",
                "of M: about 1/alpha, and 1/alpha^2 at grazing views",
            )
        return kept

    def between(self, determinant: FloatArray) -> None:
        """Look at determinants halfway between neighbours, and in the middle of cells."""
        shape = self.grid.shape
        good = self.good.reshape(shape)
        u = self.u.reshape(*shape, -1)
        k = len(shape)
        lowest, bad, seen, first = np.inf, 0, 0, ""
        for steps in [*np.eye(k, dtype=int), np.ones(k, dtype=int)]:
            corners = [c for c in np.ndindex(*(2,) * k) if np.all(np.array(c) <= steps)]
            parts = [
                tuple(
                    slice(corner, n - step + corner)
                    for corner, step, n in zip(c, steps, shape, strict=True)
                )
                for c in corners
            ]
            usable = np.logical_and.reduce([good[p] for p in parts])
            middle = np.mean([u[p] for p in parts], axis=0)[usable]
            if middle.shape[0] == 0:
                continue
            ax, ay, wo = self.grid.configuration(middle)
            m = self.grid.at(middle).matrix
            with np.errstate(all="ignore"):
                m = m / np.linalg.norm(m[..., 2], axis=-1)[:, None, None]
                ratio = np.linalg.det(m) / np.linalg.det(closed_form_guess(ax, ay, wo))
            ratio = np.where(np.isfinite(ratio), ratio, -np.inf)
            lowest = min(lowest, float(np.min(ratio)))
            wrong = ~(ratio > BETWEEN)
            seen += wrong.size
            bad += int(np.count_nonzero(wrong))
            if np.any(wrong) and not first:
                i = int(np.argmax(wrong))
                theta, phi = _angles(wo[i])
                first = f"alpha {ax[i]:.4g} x {ay[i]:.4g}, theta {theta:.4g}, phi {phi:.4g}"
        if bad:
            self.broken_nodes = True
            note = f"first at {first}"
            self.add("between neighbours", f"{bad} of {seen}", note, Fault.BETWEEN)
        elif seen:
            self.add(
                "between neighbours",
                f"{lowest:.3g}",
                "smallest determinant halfway, over the closed form's",
            )

    def leak(self) -> FloatArray:
        result = np.full(self.good.shape, np.nan)
        if not np.any(self.good):
            return result
        result[self.good] = transform.leak(self.samples.matrix[self.good])
        # Below 0 is rounding.
        worst = int(np.nanargmax(result))
        figure = f"{result[worst]:.1%} at most"
        if self.grid.clips:
            self.add("mass below the horizon", figure, "lights are clipped, the rest renormalised")
        elif result[worst] > LEAK:
            share = np.count_nonzero(result[self.good] > LEAK) / np.count_nonzero(self.good)
            note = f"over {LEAK:.0%} in {share:.1%} of the nodes, most at {self.place(worst)}"
            self.add("mass below the horizon", figure, note, Fault.LEAK)
        else:
            self.add("mass below the horizon", figure)
        return result

    def albedo(self, views: int) -> bool:
        """Compare amplitude and Fresnel part; return whether the amplitude can be used."""
        A, B = self.samples.albedo, self.samples.fresnel
        if A is None:
            note = "the file has none; below, the exact one is used"
            self.add("amplitude", "missing", note, Fault.NO_ALBEDO)
        if B is None:
            note = "nothing but F = 1 can be shaded"
            self.add("Fresnel term", "missing", note, Fault.NO_FRESNEL)
        candidates = np.flatnonzero(self.good & (self.wo[:, 2] > 0.0))
        chosen = self.rng.permutation(candidates)[:views]
        if chosen.size == 0 or (A is None and B is None):
            return A is None
        exact = brdf.directional_albedo(self.wo[chosen], self.alpha_x[chosen], self.alpha_y[chosen])
        other = self.grid.amplitude_misread()
        moved = None
        usable = A is not None
        for what, stored, row, fault in (
            ("amplitude", A, 0, Fault.ALBEDO),
            ("Fresnel term", B, 1, Fault.FRESNEL),
        ):
            if stored is None:
                continue
            values = stored.reshape(-1)[chosen]
            error = np.where(np.isfinite(values), np.abs(values - exact[row]), np.inf)
            mean, worst = float(np.mean(error)), int(np.argmax(error))
            figure = f"mean error {mean:.2g}, at most {error[worst]:.2g}"
            if mean <= ALBEDO_MEAN and error[worst] <= ALBEDO_MAX:
                self.add(what, figure, f"against {chosen.size} exact values")
                continue
            if moved is None and other is not None:
                ax, ay, wo = (x.reshape(-1, *x.shape[len(self.grid.shape) :]) for x in other)
                moved = brdf.directional_albedo(wo[chosen], ax[chosen], ay[chosen])
            if moved is not None:
                elsewhere = float(np.mean(np.abs(values - moved[row])))
                if elsewhere < 0.25 * mean:
                    axes = (
                        "(alpha_x, alpha_y)"
                        if self.grid.axes[0] == "alpha"
                        else ("(alpha, lambda)")
                    )
                    note = (
                        f"stored over {axes}, mean error {elsewhere:.2g} there, but read by"
                        f" ({self.grid.axes[0]}, {self.grid.axes[1]})"
                    )
                    if row == 0 or usable:
                        self.add(what, figure, note, Fault.AMPLITUDE_AXES)
                    usable = usable and row != 0
                    continue
            note = f"largest at {self.place(int(chosen[worst]))}"
            self.add(what, figure, note, fault)
            usable = usable and row != 0
        return not usable

    def half(self) -> None:
        """See what half floats leave of the nodes."""
        if not np.any(self.good):
            return
        u, m = self.u[self.good], self.samples.matrix[self.good]
        h = self.grid.halved().at(u).matrix
        with np.errstate(all="ignore"):
            change = np.linalg.det(h / np.linalg.norm(h[..., 2], axis=-1)[:, None, None])
            change /= np.linalg.det(m / np.linalg.norm(m[..., 2], axis=-1)[:, None, None])
            lost = ~((change < _HALF_FACTOR) & (change > 1.0 / _HALF_FACTOR))
        some = self.rng.permutation(np.flatnonzero(~lost))[:_LOBES]
        apart = variation(m[some], h[some], self.rng) if some.size else np.ones(1)
        figure = _variation_figure(apart)
        if np.any(lost):
            first = self.place(int(np.flatnonzero(self.good)[np.argmax(lost)]))
            note = f"{np.count_nonzero(lost)} lobes do not survive, first {first}"
            self.add("half floats", figure, note, warning=True)
        else:
            self.add("half floats", figure, "all lobes survive")

    def seams(self) -> None:
        """Compare lobes with their mirror images where the view lies in a plane of symmetry."""
        m, wo = _finite(self.samples.matrix), self.wo
        s = np.hypot(wo[:, 0], wo[:, 1])
        grid = self.grid
        flat = (np.abs(wo[:, 1]) < 1e-9 * s, np.abs(wo[:, 0]) < 1e-9 * s)
        sets: list[tuple[str, BoolArray, FloatArray, FloatArray]] = []
        theta_zero = s < 1e-12
        for name, in_plane, flip in (
            ("phi = 0, pi, 2 pi", flat[0], np.diag([1.0, -1.0, 1.0])),
            ("phi = pi/2, 3 pi/2", flat[1], np.diag([-1.0, 1.0, 1.0])),
        ):
            use = in_plane & self.good
            sets.append((name, use, m, flip @ m))
        # Seen from above a lobe has both symmetries, and every one where the alphas are equal.
        turn = np.diag([1.0, -1.0, 1.0]) if grid.anisotropic else _rotation(np.array(0.5 * np.pi))
        sets.append(("normal incidence", theta_zero & self.good, m, turn @ m))
        if grid.circle_axis is not None:
            closed = m.reshape(*grid.shape, 3, 3)
            start = np.broadcast_to(np.take(closed, [0], axis=grid.circle_axis), closed.shape)
            closing = (self.u[:, grid.circle_axis] == 1.0) & self.good
            sets.append(("phi = 2 pi against 0", closing, m, start.reshape(-1, 3, 3)))
        if grid.anisotropic:
            equal = (np.abs(self.alpha_x - self.alpha_y) < 1e-9 * self.alpha_x) & self.good
            # Both sides by lookup, which at alphas below the first node is not the node itself.
            found = _finite(grid.lookup(self.alpha_x, self.alpha_y, wo).matrix)
            swapped = _finite(grid.lookup(self.alpha_y, self.alpha_x, wo[:, [1, 0, 2]]).matrix)
            sets.append(("alpha_x = alpha_y", equal, found, _SWAP @ swapped))
        with np.errstate(all="ignore"):
            for name, use, a, b in sets:
                regular = use & (np.linalg.det(a) != 0.0) & (np.linalg.det(b) != 0.0)
                if not np.any(regular):
                    continue
                chosen = self.rng.permutation(np.flatnonzero(regular))[:2000]
                apart = variation(a[chosen], b[chosen], self.rng)
                worst = int(np.argmax(apart))
                figure = _variation_figure(apart)
                # Lookups may meet broken nodes, which have their names already.
                if apart[worst] > SEAM and not (name == "alpha_x = alpha_y" and self.broken_nodes):
                    note = f"largest at {self.place(int(chosen[worst]))}"
                    self.add(f"seam {name}", figure, note, Fault.SEAM)
                else:
                    self.add(f"seam {name}", figure, warning=bool(apart[worst] > SEAM))

    def isotropy(self) -> None:
        """Compare lobes of equal alphas with this project's isotropic table."""
        reference = IsotropicGrid.of(load_isotropic())
        equal = np.abs(self.alpha_x - self.alpha_y) < 1e-9 * self.alpha_x
        use = np.flatnonzero(equal & self.good & (self.alpha_x >= 1e-3))  # sharper ones are mirrors
        if use.size == 0 or (not self.grid.anisotropic and self.grid.clips):
            return
        use = self.rng.permutation(use)[:_LOBES]
        alpha, wo = self.alpha_x[use], self.wo[use]
        phi = np.arctan2(wo[:, 1], wo[:, 0])
        s = np.hypot(wo[:, 0], wo[:, 1])
        view = np.stack([s, np.zeros_like(s), wo[:, 2]], axis=-1)
        known = _rotation(phi) @ reference.lookup(alpha, alpha, view).matrix
        apart = variation(self.samples.matrix[use], known, self.rng)
        mean = float(np.mean(apart))
        what = "isotropic at lambda = 1" if self.grid.anisotropic else "against the isotropic table"
        figure = f"total variation {mean:.2g}, at most {np.max(apart):.2g}"
        wrong = mean > ISOTROPY
        self.add(what, figure, "", Fault.ISOTROPY if wrong else None)

    def shading(
        self, count: int, exact_albedo: bool
    ) -> tuple[dict[str, Any], tuple[Case, ...], Configurations, FloatArray]:
        """Compare shading integrals of random rectangles, and lobes with GGX."""
        rng = self.rng
        if exact_albedo:
            count = min(count, 600)  # 2 ms each
        x = rng.uniform(np.sqrt(1e-3), 1.0, count)
        ax = ay = x * x
        theta, phi = rng.uniform(0.0, THETA_MAX, count), np.zeros(count)
        if self.grid.anisotropic:
            ay = ax * rng.uniform(0.05, 1.0, count)
            swap = rng.random(count) < 0.5
            ax, ay = np.where(swap, ay, ax), np.where(swap, ax, ay)
            phi = rng.uniform(0.0, 2.0 * np.pi, count)
        s = np.sin(theta)
        wo = np.stack([s * np.cos(phi), s * np.sin(phi), np.cos(theta)], axis=-1)
        cases = random_lights(rng, ax, ay, wo)
        exact = exact_integrals(cases)
        found = self.grid.lookup(ax, ay, wo)
        if exact_albedo or found.albedo is None:
            A = brdf.directional_albedo(wo, ax, ay)[0]
        else:
            A = found.albedo
        got = _integrals(self.grid, found, cases, A)
        error = np.abs(got - exact)
        axes: dict[str, tuple[FloatArray, tuple[float, ...]]] = {
            "theta": (np.degrees(theta), THETA_BOUNDS),
            "alpha": (cases.alpha, ALPHA_BOUNDS),
        }
        if self.grid.anisotropic:
            axes["lambda"] = (cases.ratio, (0.0, 0.25, 0.5, 0.75, 1.0))
        figures = error_figures(error, axes)
        order = np.argsort(-error)[:_WORST]
        worst = tuple(
            Case(
                float(ax[i]),
                float(ay[i]),
                float(np.degrees(theta[i])),
                float(np.degrees(phi[i])),
                float(got[i]),
                float(exact[i]),
            )
            for i in order
        )
        regular = np.isfinite(got) & (np.abs(got) < np.inf)
        some = np.flatnonzero(regular & (np.linalg.det(_finite(found.matrix)) != 0.0))[:_LOBES]
        if some.size:
            albedo = A[some]
            if not exact_albedo:
                albedo = np.maximum(albedo, 1e-3)
            apart = variation_from_ggx(
                found.matrix[some], ax[some], ay[some], wo[some], albedo, rng
            )
            self.add("lobes against GGX", f"total variation {np.mean(apart):.3f} in the mean")
        figure = "  ".join(f"{key} {figures[key]:.4f}" for key in ("mean", "p95", "p99", "max"))
        wrong = figures["mean"] > SHADING_MEAN or figures["p99"] > SHADING_P99
        caused = self.broken_nodes or any(f.fault is not None for f in self.findings)
        note = f"{count} random rectangles, radiance 1, F = 1"
        if exact_albedo:
            note += ", exact amplitude"
        fault = Fault.SHADING if wrong and not caused else None
        self.add("shading integral", figure, note, fault, warning=wrong and caused)
        return figures, worst, cases, error


def _variation_figure(apart: FloatArray) -> str:
    mean, most = (0.0 if x < 1e-8 else x for x in (np.mean(apart), np.max(apart)))  # rounding
    return f"total variation {mean:.2g}, at most {most:.2g}"


def _angles(wo: FloatArray) -> tuple[float, float]:
    """Return theta and phi [degrees] of a direction."""
    theta = np.degrees(np.arctan2(np.hypot(wo[0], wo[1]), wo[2]))
    return float(theta), float(np.degrees(np.arctan2(wo[1], wo[0])))


def _finite(m: FloatArray) -> FloatArray:
    return np.where(np.isfinite(m), m, 0.0)


def _integrals(grid: Grid, found: Samples, cases: Configurations, A: FloatArray) -> FloatArray:
    """Return shading integrals the way the table is used; 0 where it holds no lobe."""
    m = _finite(found.matrix)
    with np.errstate(all="ignore"):
        determinant = np.linalg.det(m)
    regular = determinant != 0.0
    result = np.zeros(A.shape)
    if not np.any(regular):
        return result
    m, lights = m[regular], cases.corners[regular]
    with np.errstate(over="ignore", under="ignore", invalid="ignore", divide="ignore"):
        if grid.clips:
            result[regular] = ltc_specular(m, [lights], A[regular])
        else:
            # A mirrored lobe turns the light's winding with it.
            sign = np.sign(determinant[regular])
            inside = transform.apply(transform.invert(m)[:, None], lights)
            result[regular] = A[regular] * sign * loops_form_factor([inside])
    return np.nan_to_num(result, nan=0.0, posinf=1e6, neginf=-1e6)


def fixed_decimals(values: FloatArray) -> int | None:
    """Return how many decimals all numbers were rounded to, None if they were not.

    Looks at small numbers, which single precision holds to far more decimals.
    """
    finite = values[np.isfinite(values)]
    small = np.abs(finite[(np.abs(finite) > 0.0) & (np.abs(finite) < 1e-2)])
    if small.size < 20:
        return None
    for decimals in range(3, 9):
        scaled = small * 10.0**decimals
        if np.all(np.abs(scaled - np.round(scaled)) < 1e-3 + scaled * 1e-6):
            return decimals
    return None
