"""Lights with pictures: where to fetch a prefiltered picture, and how wide.

The radiance that a lobe gathers from a light with a picture is the light's form factor times the
mean of the picture under the lobe (Heitz et al. 2016, section 5.2). The form factor has a
closed form. The mean is fetched from a pyramid (`ltc.prefilter`), here.

*The footprint.* In cosine space, where the lobe is a clamped cosine about z, let the light's
plane have the unit normal n, away from the origin, and the distance h, and let c = n_z. A point p
of the plane counts by

    K(p) = max(p_z, 0)/|p|^4.

Straight below, c = 1, that is T = 1/(1 + r^2/h^2)^2, the pyramid's own filter. A tilted
plane sees the same shape, nearly: about the half vector of n and z, at

    p = h/(1 + c) (n + z),  with the radius |p|.

In the picture's coordinates this circle is the ellipse D = |p|^2/N^2 [W.W, -U.W; -U.W, U.U] with
N = |U x W|: the picture's stretch and shear in cosine space. (The foot of the
perpendicular, h n, which the paper takes, is off by the angle's half.)

*The nearest place.* Where the centre is beside the light, what counts is T's tail, which is
highest at the light's place x that is nearest in the metric of D: about it T is again
like T, with D (1 + e D^-1 e), e = x - centre. This is a quadratic over the light's rectangle.

*Taps.* The pyramid's filters are round in its texels. An ellipse with the semi-axes a > b there
is a row of round taps along the major axis. T summed across the axis leaves
(1 + t^2)^(-3/2), whose integral is y = t/sqrt(1 + t^2); taps stand at the middles of
equal parts of y. What of the axis is beyond the light (and MARGIN b beyond, since the ellipse is
not a line) is cut off first: without that, most taps of a long footprint would be spent in the
dark. A tap's radius is b, growing with |t| like T's own width, and what its part of the axis asks
for. All of it is continuous in the configuration, and for a = b all taps are one.

*The weights.* Each tap counts by K over the T it stands for, at its place: what the
tilt adds, and the horizon of cosine space.

GGX itself takes the footprint of a transformed cosine that resembles it (`ggx_mean_radiance`).
Twin: ``shaders/ltc/picture.glsl``. Errors and the alternatives tried are in `docs/textures.md`.
"""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from ltc import transform
from ltc.ggx_boundary import dot
from ltc.picture_cells import bilinear
from ltc.prefilter import PAD, RADIUS, Pyramid
from ltc.table import closed_form_guess

FloatArray: TypeAlias = npt.NDArray[np.float64]

MARGIN = 0.7
"""Of b, how far beyond the light's rectangle taps may stand."""

REACH, NARROW = 0.97, 0.65
"""Of their quantiles, how far out taps stand; of b, the radius of a tap among several."""

SPREAD = {1: 0.75, 3: 0.65, 5: 0.8, 9: 0.75}
"""By number of taps: of half a tap's part of the axis, the radius that fills it.

.58, .52 and .46, with a NARROW of .78, have the least mean error, by up to a twentieth; but there
each tap of a long footprint shows a sharp picture of its own.
"""

_LEAST = 1e-4  # share of a tap that is below the horizon


class Footprint(NamedTuple):
    """Where on a picture a lobe looks: T about a centre, (...) of them."""

    centre: FloatArray
    """(..., 2): in picture coordinates, anywhere."""
    shape: FloatArray
    """(..., 2, 2): D; the filter is 1/(1 + e D^-1 e)^2 at e from the centre."""


class Taps(NamedTuple):
    """Fetches that make a footprint: (..., n) of them."""

    place: FloatArray
    """(..., n, 2): in picture coordinates."""
    radius: FloatArray
    """(..., n): d of the filter, in texels of the pyramid's level 0."""
    weight: FloatArray
    """(..., n)."""


def _frames(frames: npt.ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
    f = np.asarray(frames, dtype=np.float64)
    if f.ndim < 2 or f.shape[-2:] != (3, 3):
        raise ValueError(f"frames have shape {f.shape}, expected (..., 3, 3)")
    return f[..., 0, :], f[..., 1, :], f[..., 2, :]


def cosine_footprint(frames: npt.ArrayLike) -> Footprint:
    """Return the footprint of a clamped cosine about z.

    Parameters
    ----------
    frames : (..., 3, 3) float64
        Rows o, U, W in cosine space: the light's point (u, v) is at o + u U + v W.

    Returns
    -------
    Footprint
        Finite for lights seen edge on and for those behind, which have no form factor.

    Raises
    ------
    ValueError
        If the shape does not fit.
    """
    o, U, W = _frames(frames)
    N = np.cross(U, W)
    N2 = np.maximum(dot(N, N), 1e-60)
    h = dot(N, o) / np.sqrt(N2)
    n = N * (np.where(h < 0.0, -1.0, 1.0) / np.sqrt(N2))[..., None]
    p = n + np.array([0.0, 0.0, 1.0])
    p = p * (np.abs(h) / np.maximum(1.0 + n[..., 2], 1e-3))[..., None]
    away = p - o
    u, v = dot(np.cross(away, W), N) / N2, dot(np.cross(U, away), N) / N2
    # Edge on, |p| is 0; the least ellipse keeps its inverse finite.
    scale = np.maximum(dot(p, p), 1e-18 * dot(o, o) + 1e-60) / N2
    cross = -dot(U, W)
    rows = [np.stack([dot(W, W), cross], axis=-1), np.stack([cross, dot(U, U)], axis=-1)]
    return Footprint(np.stack([u, v], axis=-1), np.stack(rows, axis=-2) * scale[..., None, None])


def cosine_density(frames: npt.ArrayLike, place: npt.ArrayLike) -> FloatArray:
    """Return K, a clamped cosine's density on a light up to a factor, (..., n).

    Parameters
    ----------
    frames : (..., 3, 3) float64
        As for `cosine_footprint`.
    place : (..., n, 2) float64
        Picture coordinates.
    """
    o, U, W = _frames(frames)
    at = np.asarray(place, dtype=np.float64)
    p = o[..., None, :] + at[..., :1] * U[..., None, :] + at[..., 1:] * W[..., None, :]
    return np.asarray(np.maximum(p[..., 2], 0.0) / np.maximum(dot(p, p), 1e-60) ** 2)


def nearest_on_light(footprint: Footprint) -> tuple[Footprint, FloatArray]:
    """Return the footprint about the light's nearest place, and e D^-1 e, (...).

    The nearest place of [0, 1]^2 in the metric of D^-1. Where the centre is on it, nothing changes.

    Notes
    -----
    A coordinate that is outside is clamped; the other then has its optimum on that line, and is
    clamped; then the first once more, which ends it. Beside a corner both orders are
    tried.
    """
    centre, D = footprint
    best, least = centre, np.full(centre.shape[:-1], np.inf)
    for first, other in ((0, 1), (1, 0)):
        x = centre.copy()
        x[..., first] = np.clip(centre[..., first], 0.0, 1.0)
        for i, j in ((other, first), (first, other)):
            slope = D[..., 0, 1] / np.maximum(D[..., j, j], 1e-200)
            x[..., i] = np.clip(centre[..., i] + slope * (x[..., j] - centre[..., j]), 0.0, 1.0)
        far = _square(D, x - centre)
        nearer = far < least
        best = np.where(nearer[..., None], x, best)
        least = np.where(nearer, far, least)
    return Footprint(best, D * (1.0 + least)[..., None, None]), least


def _square(D: FloatArray, e: FloatArray) -> FloatArray:
    """Return e D^-1 e, (...), at most 1e30."""
    det = np.maximum(D[..., 0, 0] * D[..., 1, 1] - D[..., 0, 1] ** 2, 1e-200)
    x, y = e[..., 0], e[..., 1]
    square = D[..., 1, 1] * x * x - 2.0 * D[..., 0, 1] * x * y + D[..., 0, 0] * y * y
    # Before the quotient, which may overflow where the light has no area.
    return np.clip(square, 0.0, 1e30 * np.minimum(det, 1e270)) / det


def _axes(D: FloatArray, size: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the semi-axes a >= b in texels, (...), and the major one in the picture, (..., 2)."""
    x, y = D[..., 0, 0] * size[0] ** 2, D[..., 1, 1] * size[1] ** 2
    xy = D[..., 0, 1] * (size[0] * size[1])
    middle, half = 0.5 * (x + y), 0.5 * (x - y)
    radius = np.hypot(half, xy)
    a2 = np.maximum(middle + radius, 1e-60)
    b2 = np.maximum((x * y - xy * xy) / a2, 1e-60)
    # The eigenvector from the row that does not cancel.
    right = half >= 0.0
    ex, ey = np.where(right, half + radius, xy), np.where(right, xy, radius - half)
    length = np.hypot(ex, ey)
    ex, ey = np.where(length > 0.0, ex, 1.0), np.where(length > 0.0, ey, 0.0)
    length = np.where(length > 0.0, length, 1.0)
    a = np.sqrt(a2)
    axis = np.stack([a * ex / (length * size[0]), a * ey / (length * size[1])], axis=-1)
    return a, np.sqrt(np.minimum(b2, a2)), axis


def row_of_taps(footprint: Footprint, size: npt.ArrayLike, n: int) -> Taps:
    """Return taps of equal weight along a footprint's major axis, cut at the light.

    Parameters
    ----------
    footprint : Footprint
        (...) of them, as from `nearest_on_light`: centres in [0, 1]^2.
    size : (2) float64
        Texels of level 0 for 1 of (u, v), `Pyramid.size`.
    n : int
        1, 3, 5 or 9.

    Returns
    -------
    Taps

    Raises
    ------
    ValueError
        For another number.
    """
    if n not in SPREAD:
        raise ValueError(f"there are no {n} taps, expected {', '.join(map(str, SPREAD))}")
    texels = np.asarray(size, dtype=np.float64)
    centre, D = footprint
    a, b, axis = _axes(D, texels)
    ratio = a / b
    long = np.sqrt(np.maximum(1.0 - 1.0 / ratio**2, 0.0))
    low, high = np.full(a.shape, -1.0), np.full(a.shape, 1.0)
    for k in range(2):
        margin = MARGIN * b / texels[k]
        step = np.abs(axis[..., k])
        away = np.where(axis[..., k] < 0.0, 1.0 - centre[..., k], centre[..., k])
        left, right = away + margin, 1.0 - away + margin
        low = np.maximum(low, -left / np.hypot(left, step))
        high = np.minimum(high, right / np.hypot(right, step))
    part = (high - low) / n
    y = low[..., None] + part[..., None] * (np.arange(n) + 0.5)
    t = y / np.sqrt(np.maximum(1.0 - y * y, 1e-8))
    tau = REACH * long[..., None] * t
    place = centre[..., None, :] + tau[..., None] * axis[..., None, :]
    narrow = 1.0 + (NARROW - 1.0) * long**2
    fill = SPREAD[n] * 0.5 * REACH * part * long * ratio
    radius = b[..., None] * np.sqrt(
        narrow[..., None] ** 2 * (1.0 + tau * tau) + (fill[..., None] * (1.0 + t * t) ** 1.5) ** 2
    )
    return Taps(place, radius, np.full(radius.shape, 1.0 / n))


def cosine_taps(frames: npt.ArrayLike, size: npt.ArrayLike, n: int) -> Taps:
    """Return the taps of a clamped cosine about z on lights, weighted by what they stand for.

    Parameters
    ----------
    frames : (..., 3, 3) float64
        As for `cosine_footprint`.
    size : (2) float64
        As for `row_of_taps`.
    n : int
        1, 3, 5 or 9.

    Returns
    -------
    Taps

    Raises
    ------
    ValueError
        If a shape does not fit or for another number.
    """
    footprint = cosine_footprint(frames)
    near, _ = nearest_on_light(footprint)
    taps = row_of_taps(near, size, n)
    if n == 1:
        return taps
    return taps._replace(weight=_weights(footprint, taps.place, cosine_density(frames, taps.place)))


def _weights(footprint: Footprint, place: FloatArray, density: FloatArray) -> FloatArray:
    """Return weights (..., n) of 1 in sum: density (..., n) over the footprint's T at places."""
    far = _square(footprint.shape[..., None, :, :], place - footprint.centre[..., None, :])
    value = density * (1.0 + far) ** 2
    value = value + _LEAST * np.max(value, axis=-1, keepdims=True) + 1e-300
    return np.asarray(value / np.sum(value, axis=-1, keepdims=True))


def fetch(pyramid: Pyramid, place: npt.ArrayLike, radius: npt.ArrayLike) -> FloatArray:
    """Return premultiplied radiance and coverage under T, (..., C + 1).

    Parameters
    ----------
    pyramid : Pyramid
        Of `ltc.prefilter`.
    place : (..., 2) float64
        Picture coordinates.
    radius : (...) float64
        d of the filter in texels of level 0.

    Notes
    -----
    Trilinear at the level log2(radius/RADIUS). Below level 0 the picture itself comes in,
    linearly with the radius. Outside of what is stored the nearest place is taken,
    with a radius that reaches as far.
    """
    at = np.asarray(place, dtype=np.float64)
    inside = np.clip(at, -PAD, 1.0 + PAD)
    out = (at - inside) * pyramid.size
    r = np.sqrt(np.asarray(radius, dtype=np.float64) ** 2 + dot(out, out))
    last = len(pyramid.levels) - 1
    level = np.clip(np.log2(np.maximum(r, 1e-30) / RADIUS), 0.0, last)
    first = np.minimum(level.astype(np.intp), max(last - 1, 0))
    blend = level - first
    stored = (inside + PAD) / (1.0 + 2.0 * PAD)
    value = np.zeros((*r.shape, pyramid.picture.shape[2]))
    for k, image in enumerate(pyramid.levels):
        share = np.where(first == k, 1.0 - blend, np.where(first + 1 == k, blend, 0.0))
        used = share > 0.0
        value[used] += share[used][:, None] * bilinear(image, stored[used])
    sharp = np.clip(1.0 - r / RADIUS, 0.0, 1.0)
    used = sharp > 0.0
    texels = bilinear(pyramid.picture, np.clip(inside[used], 0.0, 1.0))
    value[used] += sharp[used][:, None] * (texels - value[used])
    return value


def mean_radiance(pyramid: Pyramid, taps: Taps) -> FloatArray:
    """Return the mean radiance (..., C) that taps fetch: summed premultiplied, divided once.

    Zero where they find no coverage at all, far outside of tiny outlines.
    """
    value = np.sum(taps.weight[..., None] * fetch(pyramid, taps.place, taps.radius), axis=-2)
    cover = value[..., -1:]
    return np.asarray(
        np.where(cover > 0.0, value[..., :-1] / np.where(cover > 0.0, cover, 1.0), 0.0)
    )


def cosine_mean_radiance(pyramid: Pyramid, frames: npt.ArrayLike, n: int) -> FloatArray:
    """Return the mean radiance of lights under a clamped cosine about z.

    Parameters
    ----------
    pyramid : Pyramid
        Of the light's picture and outline.
    frames : (..., 3, 3) float64
        Rows o, U, W in cosine space: M^-1 times those in the shading frame, for
        linearly transformed cosines, or as they are, for diffuse reflection.
    n : int
        Taps: 1, 3, 5 or 9.

    Returns
    -------
    (..., C) float64
        Times the form factor it is the shading integral. The very radiance for a constant picture.

    Raises
    ------
    ValueError
        If a shape does not fit or for another number.
    """
    return mean_radiance(pyramid, cosine_taps(frames, pyramid.size, n))


def ggx_mean_radiance(
    pyramid: Pyramid,
    frames: npt.ArrayLike,
    wo: npt.ArrayLike,
    alpha_x: npt.ArrayLike,
    alpha_y: npt.ArrayLike,
    n: int,
) -> FloatArray:
    """Return the mean radiance of lights under GGX, without a table.

    Parameters
    ----------
    pyramid : Pyramid
        Of the light's picture and outline.
    frames : (..., 3, 3) float64
        Rows o, U, W in the tangent frame.
    wo : (..., 3) float64
        Unit directions to the viewer, wo_z >= 0.
    alpha_x, alpha_y : (...) float64
        GGX parameters, positive.
    n : int
        Taps: 1, 3, 5 or 9.

    Returns
    -------
    (..., C) float64
        To be multiplied with the exact integral of `ltc.ggx`.

    Raises
    ------
    ValueError
        If a shape does not fit, an alpha is not positive, wo is below the surface, or for
        another number of taps.

    Notes
    -----
    The footprint is that of the lobe's closed-form guess (`ltc.table.closed_form_guess`): a
    mean forgives what an integral does not. Mean error of the shading integral x 1000 with 5
    taps: 4.3, with the table's lobe instead 3.9, weighted by GGX itself 4.1
    (`docs/textures.md`).
    """
    cosine_from_shading = transform.invert(closed_form_guess(alpha_x, alpha_y, wo))
    space = transform.apply(cosine_from_shading[..., None, :, :], frames)
    return cosine_mean_radiance(pyramid, space, n)
