"""Low-discrepancy points, each pixel its own: Sobol's first two dimensions, Owen-scrambled.

Points that fill the unit square evenly leave less noise than random ones: every 2^m
consecutive points, from a multiple of that on, put exactly one into each of the 2^m boxes of
any shape 2^-a x 2^-(m-a), a (0, 2) sequence. Owen's scrambling keeps that property and
makes every point uniformly distributed, so estimates stay without bias, and so that the
scrambled points of two pixels, or of two purposes in one, know nothing of each other.

Three numbers would be needed where a light is chosen and a place on it; the shader uses the
first for both, the light's share of the interval being the place's. So two dimensions suffice,
and they need no table: the first is the index's bits reversed, the second Pascal's
triangle modulo 2 applied to them, in five steps.

Hashes instead of stored permutations: Laine and Karras 2011, "Stratified sampling for
stochastic transparency"; Burley 2020, "Practical hash-based Owen scrambling", which also
shuffles the order of the points by scrambling their index. The constants are Vegdahl's (2021,
"Building a better LK hash"), the keys' hash is PCG in four dimensions (Jarzynski and Olano
2020, "Hash functions for GPU rendering"). Twin, to the bit: ``shaders/common/sequence.glsl``.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
UintArray = npt.NDArray[np.uint32]


def pcg4d(v: npt.ArrayLike) -> UintArray:
    """Return four hashed numbers, (..., 4) uint32, of four numbers each."""
    with np.errstate(over="ignore"):
        n: UintArray = np.array(v, dtype=np.uint32) * np.uint32(1664525) + np.uint32(1013904223)
        for final in (False, True):
            for i, j, k in ((0, 1, 3), (1, 2, 0), (2, 0, 1), (3, 1, 2)):
                n[..., i] += n[..., j] * n[..., k]
            if not final:
                n ^= n >> np.uint32(16)
    return n


def reversed_bits(x: npt.ArrayLike) -> UintArray:
    """Return numbers with their 32 bits in reverse order."""
    bits: UintArray = np.asarray(x, dtype=np.uint32)
    for step, mask in ((1, 0x55555555), (2, 0x33333333), (4, 0x0F0F0F0F), (8, 0x00FF00FF)):
        s, m = np.uint32(step), np.uint32(mask)
        bits = ((bits >> s) & m) | ((bits & m) << s)
    return np.asarray((bits >> np.uint32(16)) | (bits << np.uint32(16)))


def scrambled_reversed(x: npt.ArrayLike, key: npt.ArrayLike) -> UintArray:
    """Return Owen's scrambling of numbers whose bits are reversed, before and after.

    Every bit is flipped or not by a hash of ``key`` and of the bits below it: below, because
    products and sums carry upwards only.
    """
    with np.errstate(over="ignore"):
        bits: UintArray = np.asarray(x, dtype=np.uint32)
        k: UintArray = np.asarray(key, dtype=np.uint32)
        bits = bits ^ (bits * np.uint32(0x3D20ADEA))
        bits = bits + k
        bits = bits * ((k >> np.uint32(16)) | np.uint32(1))
        bits = bits ^ (bits * np.uint32(0x05526C56))
        return np.asarray(bits ^ (bits * np.uint32(0x53A22864)))


def pascal_digits(x: npt.ArrayLike) -> UintArray:
    """Return Sobol's second dimension of an index, its bits reversed.

    Bit i of the result is the sum modulo 2 of binomial(j, i) times bit j of the index. By
    Lucas' theorem that matrix is the fivefold Kronecker power of ((1, 1), (0, 1)).
    """
    bits: UintArray = np.asarray(x, dtype=np.uint32)
    for step, mask in (
        (1, 0x55555555), (2, 0x33333333), (4, 0x0F0F0F0F), (8, 0x00FF00FF), (16, 0x0000FFFF),
    ):  # fmt: skip
        bits = bits ^ ((bits >> np.uint32(step)) & np.uint32(mask))
    return bits


def point_bits(pixel: npt.ArrayLike, sample: npt.ArrayLike, purpose: npt.ArrayLike) -> UintArray:
    """Return the points of `sequence_point` as whole numbers, (..., 2) uint32."""
    at: UintArray = np.asarray(pixel, dtype=np.uint32)
    which: UintArray = np.asarray(sample, dtype=np.uint32)
    use: UintArray = np.asarray(purpose, dtype=np.uint32)
    one = np.uint32(1)
    x, y, use, half = np.broadcast_arrays(at[..., 0], at[..., 1], use, which & one)
    key = pcg4d(np.stack([x, y, use, half], axis=-1))
    index = reversed_bits(scrambled_reversed(reversed_bits(which >> one), key[..., 0]))
    return np.stack(
        [
            reversed_bits(scrambled_reversed(index, key[..., 1])),
            reversed_bits(scrambled_reversed(pascal_digits(index), key[..., 2])),
        ],
        axis=-1,
    )


def sequence_point(
    pixel: npt.ArrayLike, sample: npt.ArrayLike, purpose: npt.ArrayLike
) -> FloatArray:
    """Return the point of a pixel's sample.

    Parameters
    ----------
    pixel : (..., 2) uint32
        Which pixel.
    sample : (...) uint32
        Counts from 0. Even and odd samples run through two sequences that are scrambled
        apart: what their means differ by says how far off both are.
    purpose : (...) uint32
        Tells apart the points of one sample.

    Returns
    -------
    (..., 2) float64
        In [0, 1), multiples of 2^-24.
    """
    bits = point_bits(pixel, sample, purpose) >> np.uint32(8)
    return bits.astype(np.float64) * 2.0**-24
