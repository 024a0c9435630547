"""What a technique should give, in float64: its own definition, and the integral behind it.

Everything follows from what `app.render.techniques` says of a technique, but for lobes that are
not tabulated, which `LOBES` knows by name.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from app.render.tables import anisotropic_table, isotropic_textures
from app.render.techniques import Choice
from app.stability.points import FloatArray, Seen
from ltc import adaptive, curved_outline, ggx, polygon, transform
from ltc.curved_reference import curve_specular_integral_batch
from ltc.reference import specular_integral_batch
from ltc.table import sample_textures


class Value(NamedTuple):
    """Radiance (n) of a white material under a light of radiance 1, by lobe."""

    specular: FloatArray
    diffuse: FloatArray


Integral = Callable[[Seen], Value]


@dataclass(frozen=True, slots=True)
class Definition:
    """What a technique computes.

    Attributes
    ----------
    key : str
        Equal for equal definitions.
    own : callable
        The float64 definition.
    smooth : callable
        The integral it approximates, which has no jumps where the exact value has none.
    """

    key: str
    own: Integral
    smooth: Integral


def definition_of(choice: Choice, seen: Seen) -> Definition | None:
    """Return what a technique should give for lights as ``seen``; None if it is not known here."""
    technique = choice.technique
    if technique.is_sampled:
        return Definition("ggx exact", exact, exact)
    if technique.has_tables:
        table = _Table(technique.anisotropic and seen.anisotropic, choice)
        if seen.straight or technique.curves == "tree":
            way = _exact_ltc(table)
            return Definition(table.key, way, way)
        if technique.curves == "edges":
            assert choice.number is not None
            own = _divided_ltc(table, choice.number)
        else:
            own = _adaptive_ltc(table, technique.curve_rule == 2)
        return Definition(f"{table.key} {choice}", own, _exact_ltc(table))
    make = LOBES.get(choice.name)
    return make(choice, seen) if make else None


def _ggx(choice: Choice, seen: Seen) -> Definition:
    """The fan's nodes have a float64 twin along edges only; along curves it is the integral."""
    if not seen.straight:
        return Definition("ggx exact", exact, exact)
    nodes = choice.number or 2

    def own(seen: Seen) -> Value:
        # The way the GPU goes, from where it begins: so it meets the horizon and closes the rest.
        loops = [np.roll(loop[:, ::-1], 1, axis=1) for loop in seen.loops]
        one, _ = ggx.ggx_specular(loops, seen.wo, seen.alpha[:, 0], seen.alpha[:, 1], nodes)
        return _lit(seen, -one, _lambert(seen))

    return Definition(f"ggx {nodes}", own, exact)


LOBES: dict[str, Callable[[Choice, Seen], Definition]] = {"ggx": _ggx}
"""Definitions of techniques without tables, by bare name."""


def _lit(seen: Seen, specular: FloatArray, diffuse: FloatArray) -> Value:
    return Value(np.maximum(seen.sign * specular, 0.0), np.maximum(seen.sign * diffuse, 0.0))


def _none(seen: Seen) -> FloatArray:
    return np.zeros(len(seen))


def _lambert(seen: Seen) -> FloatArray:
    if not seen.contours:
        return _none(seen)
    if seen.straight:
        return polygon.loops_form_factor(seen.loops)
    return curved_outline.form_factor(seen.contours).value


def exact(seen: Seen) -> Value:
    """Return GGX and Lambert integrated along the very outline."""
    if not seen.contours:
        return Value(_none(seen), _none(seen))
    ax, ay = seen.alpha.T
    if seen.straight and len(seen.contours) == 1:
        one, _ = specular_integral_batch(seen.loops[0], seen.wo, ax, ay)
    else:
        one, _ = curve_specular_integral_batch(seen.contours, seen.wo, ax, ay)
    return _lit(seen, one, _lambert(seen))


class _Table(NamedTuple):
    """Which lobes are looked up: anisotropic ones or not, and the variant of ``ltc``."""

    tangents: bool
    choice: Choice

    @property
    def key(self) -> str:
        """Equal for equal lobes."""
        return f"{'anisotropic ' if self.tangents else ''}ltc/{self.choice.variant}"


class _Lobe(NamedTuple):
    """Tabulated lobes, looked up as the GPU does."""

    seen: Seen  # in the lobes' frames
    inverse: FloatArray
    gain: FloatArray  # albedo over the share above the surface

    @classmethod
    def of(cls, seen: Seen, table: _Table) -> _Lobe:
        ax, ay = seen.alpha.T
        if table.tangents:
            tables = anisotropic_table()
            matrix = tables.matrix_of_view(ax, ay, seen.wo)
            albedo, _ = tables.albedo_terms_of_view(ax, ay, seen.wo)
        else:
            seen = seen.facing_view()
            # An isotropic lobe of the same area stands for an anisotropic one.
            textures = isotropic_textures(table.choice.changes.residual)
            cosine = np.clip(seen.wo[:, 2], 0.0, 1.0)
            matrix, albedo, _ = sample_textures(textures, np.sqrt(ax * ay), cosine)
        above = 1.0 - transform.leak(matrix) if table.choice.changes.divides else 1.0
        return cls(seen, transform.invert(matrix), albedo / above)


def _exact_ltc(table: _Table) -> Integral:
    def integral(seen: Seen) -> Value:
        if not seen.contours:
            return Value(_none(seen), _none(seen))
        lobe = _Lobe.of(seen, table)
        contours = lobe.seen.contours
        if table.choice.changes.cuts_at_lobe:
            bent = [transform.apply(lobe.inverse[:, None, None], c) for c in contours]
            share = _lambert(replace(lobe.seen, contours=tuple(bent)))
        elif seen.straight:
            share = polygon.ltc_polygon_form_factor(lobe.inverse, lobe.seen.loops)
        else:
            share = curved_outline.ltc_form_factor(lobe.inverse, contours).value
        return _lit(seen, lobe.gain * share, _lambert(seen))

    return integral


def _adaptive_ltc(table: _Table, extrapolated: bool) -> Integral:
    def integral(seen: Seen) -> Value:
        lobe = _Lobe.of(seen, table)
        alpha = np.sqrt(np.prod(seen.alpha, axis=1))
        # Below 1e-6 the triangles of float32 edges are noise (shaders/ltc/adaptive.glsl).
        threshold = np.maximum(adaptive.specular_epsilon(alpha), 1e-6)
        share = adaptive.adaptive(
            lobe.inverse, lobe.seen.contours, threshold, extrapolated=extrapolated
        ).value
        diffuse = adaptive.adaptive(
            np.eye(3), seen.contours, adaptive.DIFFUSE_EPSILON, extrapolated=extrapolated
        ).value
        return _lit(seen, lobe.gain * share, diffuse)

    return integral


def _divided_ltc(table: _Table, edges: int) -> Integral:
    def integral(seen: Seen) -> Value:
        lobe = _Lobe.of(seen, table)
        share = adaptive.uniform(lobe.inverse, lobe.seen.contours, edges).value
        diffuse = adaptive.uniform(np.eye(3), seen.contours, edges).value
        return _lit(seen, lobe.gain * share, diffuse)

    return integral
