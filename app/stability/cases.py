"""The cases of a sweep: a light each, and points that see it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.stats import qmc

from app.render.techniques import TECHNIQUES, parse_technique
from app.scene import AreaLight, PolygonContour, Scene
from app.stability.clouds import DIMENSIONS, Placing
from app.stability.points import FloatArray, Points
from app.stability.sweeps import Sweep

LEAST_POINTS = 8
"""Of a cloud, however few are asked for."""

FEW_SETTINGS = 8
"""Of a technique with as many settings, or fewer, each is measured; of others the usual one."""


@dataclass(frozen=True, slots=True)
class Sampling:
    """How many points: of all clouds of a sweep, of each series, and of those compared with GGX.

    ``samples`` are a sampled technique's estimates of a point, a multiple of `BATCHES`.
    """

    points: int = 800
    steps: int = 160
    compared: int = 100
    samples: int = 512
    seed: int = 0


@dataclass(frozen=True, slots=True)
class Case:
    """Points that see one light: a cloud, or neighbours along a series at places ``t``."""

    sweep: str
    name: str
    light: AreaLight
    points: Points
    defined: bool = True
    place: Placing | None = None
    t: FloatArray | None = None

    @property
    def scene(self) -> Scene:
        """The light alone."""
        return Scene(lights=(self.light,))

    @property
    def is_series(self) -> bool:
        """Whether points are neighbours."""
        return self.t is not None

    @property
    def curved(self) -> bool:
        """Whether the light has curves."""
        return not all(isinstance(c, PolygonContour) for c in self.light.outline.contours)

    def between(self, t: FloatArray) -> Case:
        """Return the same series at other places."""
        assert self.place is not None
        return Case(
            self.sweep, self.name, self.light, self.place(t), self.defined, self.place, t
        )  # fmt: skip


def cases_of(sweep: Sweep, sampling: Sampling) -> list[Case]:
    """Return the cases of a sweep; the same for the same sampling."""
    cases = []
    count = max(LEAST_POINTS, math.ceil(sampling.points / len(sweep.clouds)))
    for index, cloud in enumerate(sweep.clouds):
        sobol = qmc.Sobol(DIMENSIONS, rng=np.random.default_rng((sampling.seed, index)))
        u = sobol.random(1 << (count - 1).bit_length())[:count]
        cases.append(Case(sweep.name, cloud.name, cloud.light, cloud.place(u), cloud.defined))
    t = np.linspace(0.0, 1.0, sampling.steps)
    for series in sweep.series:
        start = Case(sweep.name, series.name, series.light, series.place(t), place=series.place)
        cases.append(start.between(t))
    return cases


def compared_techniques() -> list[str]:
    """Return every technique of the registry; of those with few settings, each of them."""
    names = []
    for name, technique in TECHNIQUES.items():
        parameter = technique.parameter
        if parameter is None or parameter.most - parameter.least > FEW_SETTINGS:
            names.append(name)
            continue
        numbers = range(parameter.least, parameter.most + 1)
        ordered = sorted(numbers, key=lambda n: (n != parameter.default, n))
        names += [str(parse_technique(f"{name}:{number}")) for number in ordered]
    return names


def applies(technique: str, case: Case) -> bool:
    """Whether a technique is meant for a case: brushed metal is not for all."""
    return parse_technique(technique).technique.anisotropic or not case.points.anisotropic
