"""The fitted tables as the GPU samples them."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ltc.table import load_isotropic

Texels = NDArray[np.float32]


@lru_cache(maxsize=1)
def isotropic_textures() -> tuple[Texels, Texels]:
    """Return the two textures (rows: view, columns: alpha) of technique ``ltc``.

    Names and channels as ``shaders/ltc/table.glsl`` reads them:
    ``table_residual`` (X00, X02 / s, X11, X20 / s), ``table_albedo`` (A, u).

    Raises
    ------
    FileNotFoundError, ValueError
        If the table is missing from the installation, or damaged.
    """
    return load_isotropic().textures()
