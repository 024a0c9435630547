"""Shader code that the docs show, compiled as it stands there."""

from __future__ import annotations

import re
from pathlib import Path

import moderngl
import numpy as np
import pytest

from tests.gl.evaluate import evaluate

PAGE = Path(__file__).resolve().parents[2] / "docs" / "curves.md"

pytestmark = pytest.mark.skipif(not PAGE.is_file(), reason="needs the source tree")


def test_panel_of_a_curve(ctx: moderngl.Context, tmp_path: Path) -> None:
    """Its value is the integrand, and a straight line has its pole where |r| would vanish."""
    (code,) = re.findall(r"^```glsl\n(.*?)^```", PAGE.read_text("utf-8"), re.MULTILINE | re.DOTALL)
    rng = np.random.default_rng(1)
    given = {name: rng.normal(size=(500, 3)) for name in "cuv"}
    given |= {name: rng.normal(size=(500, 2)) for name in "pq"}
    body = code + "result = vec4(value, pole, r.z);"
    got = evaluate(ctx, tmp_path, [], body, given)

    c, u, v, p, q = (a.astype(np.float32).astype(np.float64) for a in given.values())
    r = c + p[:, :1] * u + p[:, 1:] * v
    d = q[:, :1] * u + q[:, 1:] * v
    x, y, z = r.T
    want = (x * d[:, 1] - y * d[:, 0]) / (x * x + y * y + np.maximum(z, 0.0) ** 2)
    np.testing.assert_allclose(got[:, 0], want, rtol=1e-5, atol=1e-5)
    above = z > 0.0
    pole = (got[:, 1] + 1j * got[:, 2])[above, None]
    there = r[above] + pole * d[above]
    size = np.sum(np.abs(there) ** 2, axis=-1)
    assert np.all(np.abs(np.sum(there * there, axis=-1)) < 1e-4 * size)
