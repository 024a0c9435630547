"""Which part of a technique's error is whose: the lobe's, the table's, the outline's, float32's.

At points of a picture the radiance is computed in float64 several times, each time with one
more of the technique's approximations, from exact GGX and Lambert to what the GPU made of it.
A part is the step from one to the next, so the parts add up to the whole error, with
their signs. Of techniques that look lobes up:

Fresnel
    Schlick's term leaves the integral: its directional albedo takes its place.
lobe
    GGX becomes the linearly transformed cosine that suits this view best (`ltc.point_fit`).
table
    That lobe and the albedo come from the table of full resolution, between its nodes.
textures
    They come from what the GPU samples bilinearly (of the anisotropic table the same thing).
horizon
    Only of ``ltc``'s variants that do otherwise: light below the surface is not cut off, or what
    is cut off of the lobe is not made up for.
outline
    The outline is integrated as the technique does it: edges exactly, curves by quadrature,
    as edges or by subdivision. Of ``ltc``'s own quadrature there is no twin in float64; its
    share is how much six nodes instead of its own number change on the GPU.
float32
    What is left: single precision, and what six nodes leave of curves, 1e-5 and less.

Of ``ggx``, without curves, there are the quadrature of its lobe along the outline, and float32.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from app.render.difference import LUMINANCE
from app.render.gathering import Points, check_breakdown, shades_anisotropic
from app.render.pack import has_curves
from app.render.tables import anisotropic_table, isotropic_textures
from app.render.techniques import find_technique, parse_technique, suited_technique
from app.render.truth import shading_contours, shading_frames, tangent_frames
from app.scene import Scene
from ltc import adaptive, curved_outline, transform
from ltc.curved_reference import curve_specular_integral_batch
from ltc.ggx import ggx_specular
from ltc.point_fit import fit_points
from ltc.table import load_isotropic, sample_textures

FloatArray = NDArray[np.float64]
Progress = Callable[[int, int], None]
"""Takes how many of how many steps are done."""


@dataclass(frozen=True, eq=False)
class Breakdown:
    """The parts of a technique's error at some points.

    Attributes
    ----------
    technique : str
    parts : names, in the order of the steps
    exact : (n, 3) float64
        GGX and Lambert, radiance.
    shares : (parts, n, 3) float64
        What each part adds; the exact radiance and all of them are the GPU's.
    """

    technique: str
    parts: tuple[str, ...]
    exact: FloatArray
    shares: FloatArray

    @property
    def total(self) -> FloatArray:
        """The whole error, (n, 3)."""
        return np.asarray(self.shares.sum(axis=0))

    def rows(self) -> list[tuple[str, float, float, float, float]]:
        """Return (name, mean, p95, largest, mean with sign) of each part and of all.

        They are of the luminance; all but the last of its absolute value.
        """
        named = [*zip(self.parts, self.shares, strict=True), ("all", self.total)]
        rows = []
        for name, share in named:
            signed = share @ np.array(LUMINANCE)
            size = np.abs(signed) if signed.size else np.zeros(1)
            p95 = float(np.quantile(size, 0.95))
            bias = float(signed.mean()) if signed.size else 0.0
            rows.append((name, float(size.mean()), p95, float(size.max()), bias))
        return rows


def break_down(
    points: Points,
    scene: Scene,
    technique: str,
    progress: Progress = lambda done, total: None,
) -> Breakdown:
    """Return the parts of a technique's error at points.

    Parameters
    ----------
    points : Points
        Of a picture of ``scene`` by ``technique``.
    progress : callable
        Called now and then, from whichever thread runs this; may raise to end it.

    Raises
    ------
    InputError
        If the technique samples.
    """
    check_breakdown(technique)
    return _Steps(points, scene, technique, progress).breakdown()


class _Steps:
    """The radiance of some points, with one more approximation at a time."""

    def __init__(self, points: Points, scene: Scene, technique: str, progress: Progress) -> None:
        self.points, self.scene = points, scene
        self.anisotropic = shades_anisotropic(scene, technique)
        self.technique = suited_technique(technique, self.anisotropic)
        self.choice = parse_technique(self.technique)
        self.progress = progress
        self.f0 = self._of_materials("f0")
        self.has_lobe = np.any(self.f0 > 0.0, axis=1, keepdims=True)
        alpha = np.array([m.alpha for m in points.materials]).reshape(-1, 2)
        if self.anisotropic:
            self.ax, self.ay = alpha.T
            self.frames = tangent_frames(points.normal, points.tangent)
        else:
            self.ax = self.ay = np.sqrt(alpha[:, 0] * alpha[:, 1])
            self.frames = shading_frames(points.normal, points.view)
        local = np.einsum("nij,nj->ni", self.frames, points.view)
        local[:, 2] = np.maximum(local[:, 2], 0.0)
        self.local = local
        self.lights = [light for light in scene.lights if any(light.radiance)]
        self.contours = [
            shading_contours(light, points.position, self.frames) for light in self.lights
        ]
        self.signs = []
        for light in self.lights:
            away = np.cross(light.plane.u, light.plane.v)
            front = (points.position - np.array(light.plane.origin)) @ away > 0.0
            self.signs.append(np.where(front, 1.0, -1.0) * (front | light.two_sided))

    def _of_materials(self, name: str) -> FloatArray:
        values = [getattr(material, name) for material in self.points.materials]
        return np.array(values, dtype=np.float64).reshape(-1, 3)

    def breakdown(self) -> Breakdown:
        diffuse = self._diffuse([curved_outline.form_factor(c).value for c in self.contours])
        exact = self._exact_lobes()
        first = self._sum([self._schlick(one, fresnel) for one, fresnel in exact]) + diffuse
        if find_technique(self.technique).has_tables:
            steps = self._table_steps(exact, diffuse)
        elif self.choice.name == "ggx":
            steps = self._ggx_steps(diffuse)
        else:
            steps = [("technique", self.points.radiance)]
        states = [first, *(state for _, state in steps)]
        shares = np.array([after - before for before, after in pairwise(states)])
        names = tuple(name for name, _ in steps)
        if self.points.skips:
            names = (*names[:-1], f"{names[-1]}, skipped lights")
        return Breakdown(self.technique, names, first, shares)

    # --- sums over the lights ------------------------------------------------------------

    def _sum(self, factors: Sequence[FloatArray]) -> FloatArray:
        """Return the radiance of factors (n, 3), one a light, seen from the right side."""
        total = np.zeros((self.points.count, 3))
        for light, sign, factor in zip(self.lights, self.signs, factors, strict=True):
            total += np.maximum(sign[:, None] * factor, 0.0) * light.radiance
        return total

    def _diffuse(self, factors: Sequence[FloatArray]) -> FloatArray:
        albedo = self._of_materials("diffuse")
        return self._sum([albedo * factor[:, None] for factor in factors])

    def _schlick(self, one: FloatArray, fresnel: FloatArray) -> FloatArray:
        """Return (n, 3) from the terms (n,) for F = 1 and under (1 - wo.h)^5."""
        lobe = self.f0 * (one - fresnel)[:, None] + fresnel[:, None]
        return np.asarray(np.where(self.has_lobe, lobe, 0.0))

    def _exact_lobes(self) -> list[tuple[FloatArray, FloatArray]]:
        """Return GGX's integral with F = 1 and its Fresnel part, of each light."""
        found = []
        for index, contours in enumerate(self.contours):
            if contours and self.points.count:
                found.append(curve_specular_integral_batch(contours, self.local, self.ax, self.ay))
            else:
                found.append((np.zeros(self.points.count), np.zeros(self.points.count)))
            self.progress(index + 1, len(self.contours) + self.points.count)
        return found

    # --- techniques that look lobes up ---------------------------------------------------

    def _table_steps(
        self, exact: Sequence[tuple[FloatArray, FloatArray]], diffuse: FloatArray
    ) -> list[tuple[str, FloatArray]]:
        before = len(self.contours)
        best = fit_points(
            self.ax, self.ay, self.local,
            lambda done: self.progress(before + done, before + self.points.count),
        )  # fmt: skip
        share = best.fresnel / best.albedo
        steps = [
            ("Fresnel", self._sum([self._schlick(one, share * one) for one, _ in exact]) + diffuse),
            ("lobe", self._looked_up(*best) + diffuse),
        ]
        if self.anisotropic:
            table = anisotropic_table()
            views = (self.ax, self.ay, self.local)
            last = table.matrix_of_view(*views), *table.albedo_terms_of_view(*views)
            steps.append(("table", self._looked_up(*last) + diffuse))
        else:
            whole, cosine = load_isotropic(), np.minimum(self.local[:, 2], 1.0)
            terms = whole.matrix(self.ax, cosine), *whole.albedo_terms(self.ax, cosine)
            steps.append(("table", self._looked_up(*terms) + diffuse))
            texels = isotropic_textures(self.choice.changes.residual)
            last = sample_textures(texels, self.ax, cosine)
            steps.append(("textures", self._looked_up(*last) + diffuse))
        if not self.choice.changes.divides:
            steps.append(("horizon", self._looked_up(*last, divides=False) + diffuse))
        outline = self._outline(last, steps[-1][1])
        if outline is None:
            return [*steps, ("outline and float32", self.points.radiance)]
        return [*steps, ("outline", outline), ("float32", self.points.radiance)]

    def _looked_up(
        self,
        matrix: FloatArray,
        albedo: FloatArray,
        fresnel: FloatArray,
        integral: Callable[[FloatArray, list[FloatArray]], FloatArray] | None = None,
        divides: bool = True,
    ) -> FloatArray:
        """Return the specular radiance of lobes (n, 3, 3), albedo (n,) and its Fresnel part.

        Without ``divides`` light is cut as the technique's variant does it.
        """
        inverse = transform.invert(matrix)
        above = 1.0 - transform.leak(matrix) if divides else np.ones(len(matrix))
        factors = []
        for contours in self.contours:
            if not divides and self.choice.changes.cuts_at_lobe:
                moved = [np.einsum("nij,nkcj->nkci", inverse, contour) for contour in contours]
                share = curved_outline.form_factor(moved).value
            elif integral is None:
                share = curved_outline.ltc_form_factor(inverse, contours).value
            else:
                share = integral(inverse, contours)
            share = share / above
            factors.append(self._schlick(albedo * share, fresnel * share))
        return self._sum(factors)

    def _outline(
        self, lobes: tuple[FloatArray, FloatArray, FloatArray], looked_up: FloatArray
    ) -> FloatArray | None:
        """Return the radiance with outlines integrated as the technique does, None if unknown."""
        if not has_curves(self.scene.lights):
            return looked_up
        name, number = self.choice.name, self.choice.number
        identity = np.broadcast_to(np.eye(3), lobes[0].shape)
        if name == "uniform":
            assert number is not None

            def edges(inverse: FloatArray, contours: list[FloatArray]) -> FloatArray:
                return adaptive.uniform(inverse, contours, number).value

            lambert = [edges(identity, contours) for contours in self.contours]
            return self._looked_up(*lobes, edges) + self._diffuse(lambert)
        if name.startswith("adaptive"):
            extrapolated = name.endswith("extrapolated")
            threshold = adaptive.specular_epsilon(np.sqrt(self.ax * self.ay))

            def halved(inverse: FloatArray, contours: list[FloatArray]) -> FloatArray:
                return adaptive.adaptive(
                    inverse, contours, np.maximum(threshold, 1e-6), extrapolated=extrapolated
                ).value

            lambert = [
                adaptive.adaptive(
                    identity, contours, adaptive.DIFFUSE_EPSILON, extrapolated=extrapolated
                ).value
                for contours in self.contours
            ]
            return self._looked_up(*lobes, halved) + self._diffuse(lambert)
        if self.points.finer is None:
            return None
        specular, diffuse = self.points.finer
        _, albedo, fresnel = lobes
        reflectance = self._schlick(albedo, fresnel) / albedo[:, None]
        lambert = self._of_materials("diffuse") * diffuse
        return np.asarray(looked_up + reflectance * specular + lambert)

    # --- ggx -----------------------------------------------------------------------------

    def _ggx_steps(self, diffuse: FloatArray) -> list[tuple[str, FloatArray]]:
        if has_curves(self.scene.lights):
            return [("quadrature and float32", self.points.radiance)]
        assert self.choice.number is not None
        factors = []
        nodes = self.choice.number
        for contours in self.contours:
            # As the shader walks them, against `shading_contours`: where an edge needs several
            # panels, the rest of it is at the other end.
            loops = [np.flip(curves[:, :, 0], axis=1) for curves in contours]
            one, fresnel = ggx_specular(loops, self.local, self.ax, self.ay, nodes)
            factors.append(self._schlick(-one, -fresnel))
        return [
            ("quadrature", self._sum(factors) + diffuse),
            ("float32", self.points.radiance),
        ]
