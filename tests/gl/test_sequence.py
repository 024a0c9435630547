"""The pixels' low-discrepancy points on the GPU: those of `ltc.sequence`, to the bit."""

from __future__ import annotations

import re

import numpy as np

from ltc.resources import resource_path
from ltc.sequence import pcg4d, sequence_point
from tests.gl.evaluate import evaluate

FILE = "common/sequence.glsl"


def test_points_are_the_twins_to_the_bit(ctx, tmp_path):
    rng = np.random.default_rng(0)
    count = 20_000
    pixel = rng.integers(0, 16384, (count, 2))
    # Inputs go through float32, which has whole numbers up to 2^24.
    sample = np.where(rng.random(count) < 0.5, rng.integers(0, 64, count),
                      rng.integers(0, 2**24, count))  # fmt: skip
    purpose = rng.integers(0, 4, count)
    got = evaluate(
        ctx,
        tmp_path,
        [FILE],
        "result.xy = sequence_point(uvec3(uvec2(pixel), uint(index)), uint(purpose));",
        {"pixel": pixel, "index": sample, "purpose": purpose},
    )
    np.testing.assert_array_equal(got[:, :2], sequence_point(pixel, sample, purpose))


def test_large_samples_too(ctx, tmp_path):
    """Beyond 2^24, where hours of samples end."""
    low = np.arange(4096)
    body = "uint i = 0xfff00000u + uint(low); result.xy = sequence_point(uvec3(3u, 5u, i), 1u);"
    got = evaluate(ctx, tmp_path, [FILE], body, {"low": low})
    want = sequence_point((3, 5), 0xFFF00000 + low, 1)
    np.testing.assert_array_equal(got[:, :2], want)


def test_hash(ctx, tmp_path):
    low = np.arange(4096)
    body = "uvec4 h = pcg4d(uvec4(uint(low), 1u, 2u, 3u)); result = vec4(h >> 8u);"
    got = evaluate(ctx, tmp_path, [FILE], body, {"low": low})
    ones = np.ones_like(low)
    want = pcg4d(np.stack([low, ones, 2 * ones, 3 * ones], axis=-1)) >> np.uint32(8)
    np.testing.assert_array_equal(got, want)


def test_every_function_is_tested_here():
    """The two steps in between are, whole, by the points."""
    text = resource_path("shaders", *FILE.split("/")).read_text(encoding="utf-8")
    found = set(re.findall(r"^\w+ (\w+)\(", text, flags=re.M))
    assert found == {"pcg4d", "scrambled_reversed", "pascal_digits", "sequence_point"}
