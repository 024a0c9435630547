"""The fitted tables as the GPU samples them."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.render.techniques import VARIANTS
from ltc.anisotropic import AnisotropicTable, load_anisotropic
from ltc.table import load_isotropic

Texels = NDArray[np.float32]


@lru_cache(maxsize=len(VARIANTS) + 1)
def isotropic_textures(residual: int | None = None) -> tuple[Texels, Texels]:
    """Return the two textures (rows: view, columns: alpha) of technique ``ltc``.

    Names and channels as ``shaders/ltc/table.glsl`` reads them:
    ``table_residual`` (X00, X02 / s, X11, X20 / s), ``table_albedo`` (A, u). ``residual`` is the
    first one's texels on each axis, 0 for a residual of 0, by default what errs least for its size.

    Raises
    ------
    FileNotFoundError, ValueError
        If the table is missing from the installation, or damaged.
    """
    table = load_isotropic()
    if residual is None:
        return table.textures()
    _, albedo = table.textures()
    if residual == 0:
        return np.zeros((2, 2, 4), np.float32), albedo
    return table.textures(residual)[0], albedo


@lru_cache(maxsize=1)
def anisotropic_table() -> AnisotropicTable:
    """Return the table of `anisotropic_textures`, in the form that Python looks up; raises so."""
    return load_anisotropic()


@lru_cache(maxsize=1)
def anisotropic_textures() -> tuple[NDArray[np.float16], NDArray[np.float16], NDArray[np.float16]]:
    """Return the three array textures (layers: azimuth and ratio, rows: view, columns: alpha).

    Channels as ``shaders/ltc/anisotropic.glsl`` reads them: `AnisotropicTable.textures`.

    Raises
    ------
    FileNotFoundError, ValueError
        If the table is missing from the installation, or damaged.
    """
    return anisotropic_table().textures()


def table_textures(anisotropic: bool, residual: int | None = None) -> Mapping[str, NDArray[Any]]:
    """Return the textures that lobes are looked up in, by the names of the samplers.

    Shapes are (rows, columns, channels) float32, or (layers, rows, columns, channels) float16 of
    the anisotropic table, which has one size; ``residual`` is as for `isotropic_textures`. Raises
    as `isotropic_textures` and `anisotropic_textures`.
    """
    if anisotropic:
        names = ("table_residual", "table_residual_2", "table_albedo")
        return dict(zip(names, anisotropic_textures(), strict=True))
    return dict(zip(("table_residual", "table_albedo"), isotropic_textures(residual), strict=True))


def anisotropic_azimuths() -> tuple[int, int]:
    """Return how many azimuths the residual's and the albedo's layers stand for."""
    table = anisotropic_table()
    return table.residual.shape[0], table.albedo.shape[0]
