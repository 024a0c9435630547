"""Stained glass over a floor: ``docs/images/textures-fetch.png``, exact, the paper's fetch, ours.

.venv/bin/python -m docs.figures.textured_fetch

The technique ``ltc`` in float64, without the renderer: a light of 3 m x 2 m with panes in three
colours stands behind a floor, alpha .03 above and .2 below. About two minutes, nearly all of
them for the exact integrals.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ltc import transform
from ltc.polygon import ltc_polygon_form_factor
from ltc.prefilter import prefilter
from ltc.published_prefilter import gaussian_levels, published_mean_radiance
from ltc.table import load_isotropic
from ltc.textured import cosine_mean_radiance
from ltc.textured_check import RECTANGLE, stained_glass
from ltc.textured_reference import CosineLobe, textured_integrals

FloatArray = NDArray[np.float64]

PICTURE = Path(__file__).parents[1] / "images" / "textures-fetch.png"
WIDTH, HEIGHT, TEXELS = 150, 81, 32
EYE = np.array([0.0, -1.5, 1.0])
ALPHAS = (0.03, 0.2)


def floor(alpha: float) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return which pixels see the floor, lights and M^-1 in their frames, and form factors."""
    x = (np.arange(WIDTH) + 0.5) / WIDTH * 2.0 - 1.0
    y = 1.0 - (np.arange(HEIGHT) + 0.5) / HEIGHT * 2.0
    X, Y = np.meshgrid(x, y)
    d = np.stack([0.75 * X, np.ones_like(X), 0.38 * Y - 0.54], axis=-1)
    t = -EYE[2] / np.minimum(d[..., 2], -1e-6)
    seen = (d[..., 2] < 0.0) & (EYE[1] + t * d[..., 1] < 1.99)
    p = (EYE + t[..., None] * d)[seen]
    v = EYE - p
    v /= np.linalg.norm(v, axis=-1, keepdims=True)
    tangent = v * [1.0, 1.0, 0.0]
    tangent /= np.linalg.norm(tangent, axis=-1, keepdims=True)
    up = np.broadcast_to([0.0, 0.0, 1.0], v.shape)
    rotation = np.stack([tangent, np.cross(up, tangent), up], axis=1)
    o, U, W = np.array([-1.5, 2.0, 0.1]), np.array([3.0, 0.0, 0.0]), np.array([0.0, 0.0, 2.0])
    frames = np.stack(
        [np.einsum("nij,nj->ni", rotation, o - p), rotation @ U, rotation @ W], axis=1
    )
    M = load_isotropic().matrix(np.full(len(p), alpha), v[:, 2])
    a, u, w = (frames[:, k] for k in range(3))
    inverse = transform.invert(M)
    corners = np.stack([a, a + u, a + u + w, a + w], axis=1)
    return seen, frames, inverse, np.abs(ltc_polygon_form_factor(inverse, [corners]))


def main() -> None:
    """Compute and put side by side."""
    rng = np.random.default_rng(6)
    panes = stained_glass(rng, TEXELS)
    tint = np.random.default_rng(2).random((512, 3))
    # One colour for each pane's shade.
    picture = 3.0 * panes[..., None] * tint[(panes * 511.0).astype(np.intp)]
    pyramid, levels = prefilter(picture), gaussian_levels(picture)
    rows = []
    for alpha in ALPHAS:
        seen, frames, inverse, form_factor = floor(alpha)
        space = transform.apply(inverse[:, None], frames)
        exact = textured_integrals(picture, RECTANGLE, frames, CosineLobe(inverse), 1e-4).value
        fetches: list[Callable[[], FloatArray]] = [
            lambda space=space: published_mean_radiance(levels, space),
            lambda space=space: cosine_mean_radiance(pyramid, space, 1),
            lambda space=space: cosine_mean_radiance(pyramid, space, 5),
        ]
        row = []
        for value in (exact, *(fetch() * form_factor[:, None] for fetch in fetches)):
            image = np.zeros((HEIGHT, WIDTH, 3))
            image[seen] = value
            row.append(np.clip(image / np.percentile(exact, 99.7), 0.0, 1.0) ** (1.0 / 2.2))
        rows.append(np.concatenate(row, axis=1))
    sheet = np.concatenate(rows, axis=0)
    Image.fromarray((sheet * 255.0 + 0.5).astype(np.uint8)).save(PICTURE)


if __name__ == "__main__":
    main()
