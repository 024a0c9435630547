"""What the techniques converge to, in float64: the measure of all that approximate it.

For ``ltc`` and its kin it is the same table, looked up as the shaders do, and the same lights,
but their curves integrated to rounding (`ltc.curved_outline`). The difference to a picture is
then what a way of integrating costs, and nothing else: not what the fitted lobe itself errs.
For ``ggx`` it is GGX itself (`ltc.curved_reference`).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from app.outline import boundary
from app.render.tables import anisotropic_table, isotropic_textures
from app.render.techniques import parse_technique
from app.scene import AreaLight
from ltc import curved_outline, transform
from ltc.curved_reference import curve_specular_integral_batch
from ltc.table import sample_textures

FloatArray = NDArray[np.float64]
Lobe: TypeAlias = str
"""``ggx``, GGX itself; or ``ltc``, the fitted lobe, or one of its variants, ``ltc/table-8``."""

FINER = (12, 1e-8)
"""Nodes and tolerance of `ltc.reference.specular_integral_batch`."""

BATCH = 512
"""Points at once: thousands of them with hundreds of curves would fill the memory."""


def shading_frames(normal: FloatArray, view: FloatArray) -> FloatArray:
    """Return shading_from_world, (n, 3, 3), of unit normals and directions to the viewer."""
    x = view - normal * np.sum(normal * view, axis=-1, keepdims=True)
    # Any tangent will do where the view is the normal.
    axis = np.where(np.abs(normal[:, :1]) < 0.5, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    degenerate = np.sum(x * x, axis=-1) < 1e-14
    x = np.where(degenerate[:, None], np.cross(normal, axis), x)
    return _frames(normal, x)


def tangent_frames(normal: FloatArray, tangent: FloatArray) -> FloatArray:
    """Return tangent_from_world, (n, 3, 3), of unit normals and tangents not along them."""
    return _frames(normal, tangent - normal * np.sum(normal * tangent, axis=-1, keepdims=True))


def _frames(normal: FloatArray, x: FloatArray) -> FloatArray:
    x = x / np.sqrt(np.sum(x * x, axis=-1, keepdims=True))
    return np.stack([x, np.cross(normal, x), normal], axis=-2)


def shading_contours(
    light: AreaLight, position: FloatArray, frames: FloatArray
) -> list[FloatArray]:
    """Return a light's contours, (n, k, 4, 3) each, in the frames of points.

    Those that see its face count them positive, those behind it negative.
    """
    origin, u, v = (np.array(a) for a in (light.plane.origin, light.plane.u, light.plane.v))
    contours = []
    for loop in boundary(light.outline):
        world = curved_outline.positive_winding(origin + loop[..., :1] * u + loop[..., 1:] * v)
        local = np.einsum("nij,nkcj->nkci", frames, world - position[:, None, None])
        contours.append(local)
    return contours


def exact_radiance(
    lights: Sequence[AreaLight],
    position: ArrayLike,
    normal: ArrayLike,
    view: ArrayLike,
    alpha: ArrayLike,
    lobe: Lobe = "ltc",
    tangent: ArrayLike | None = None,
    finer: bool = False,
) -> tuple[FloatArray, FloatArray]:
    """Return what points of a white material send to their viewers.

    Parameters
    ----------
    position, normal, view : (n, 3) float
        World space, as for `app.render.renderer.Renderer.probe`; views above the surface.
    alpha : (n,) or (n, 2) float
        GGX parameters; (n, 2) with ``tangent``.
    lobe : str
        ``ltc``, the fitted lobe, one of its variants, or ``ggx``, GGX itself.
    tangent : (n, 3) float, optional
        Along which the first alpha acts. With it the fitted lobe is that of the anisotropic table.
    finer : bool
        Whether GGX is integrated with more nodes and a smaller tolerance, to see what those
        otherwise used err.

    Returns
    -------
    specular, diffuse : (n, 3) float64
        Radiance for F = 1 and albedo 1, summed over the lights.
    """
    p, n, wo = (np.asarray(a, dtype=np.float64) for a in (position, normal, view))
    a = np.asarray(alpha, dtype=np.float64)
    changes = None if lobe == "ggx" else parse_technique(lobe).changes
    specular, diffuse = np.zeros((2, len(p), 3))
    for start in range(0, len(p), BATCH):
        part = slice(start, start + BATCH)
        if tangent is None:
            frames = shading_frames(n[part], wo[part])
            ax = ay = a[part]
        else:
            frames = tangent_frames(n[part], np.asarray(tangent, dtype=np.float64)[part])
            ax, ay = a[part].T
        local = np.einsum("nij,nj->ni", frames, wo[part])
        local[:, 2] = np.maximum(local[:, 2], 0.0)
        if changes is not None:
            if tangent is None:
                cosine = np.minimum(local[:, 2], 1.0)
                matrix, albedo, _ = sample_textures(
                    isotropic_textures(changes.residual), ax, cosine
                )
            else:
                table = anisotropic_table()
                matrix = table.matrix_of_view(ax, ay, local)
                albedo, _ = table.albedo_terms_of_view(ax, ay, local)
            inverse = transform.invert(matrix)
            gain = albedo / (1.0 - transform.leak(matrix)) if changes.divides else albedo
        for light in lights:
            if not any(light.radiance):
                continue
            contours = shading_contours(light, p[part], frames)
            away = np.cross(light.plane.u, light.plane.v)
            front = (p[part] - np.array(light.plane.origin)) @ away > 0.0
            sign = np.where(front, 1.0, -1.0) * (front | light.two_sided)
            if changes is not None and changes.cuts_at_lobe:
                moved = [np.einsum("nij,nkcj->nkci", inverse, contour) for contour in contours]
                share = gain * curved_outline.form_factor(moved).value
            elif changes is not None:
                share = gain * curved_outline.ltc_form_factor(inverse, contours).value
            else:
                share, _ = curve_specular_integral_batch(
                    contours, local, ax, ay, *(FINER if finer else ())
                )
            lambert = curved_outline.form_factor(contours).value
            specular[part] += np.maximum(sign * share, 0.0)[:, None] * light.radiance
            diffuse[part] += np.maximum(sign * lambert, 0.0)[:, None] * light.radiance
    return specular, diffuse
