"""Shared by the tests of ``ltc``: floating-point warnings are bugs."""

from collections.abc import Iterator

import hypothesis
import numpy as np
import pytest

hypothesis.settings.register_profile("ltc", derandomize=True, deadline=None, max_examples=60)
hypothesis.settings.load_profile("ltc")


@pytest.fixture(autouse=True)
def _floating_point_errors_raise() -> Iterator[None]:
    with np.errstate(all="raise"):
        yield


@pytest.fixture
def rng() -> np.random.Generator:
    """Return a generator with a fixed seed."""
    return np.random.default_rng(20160711)
