"""How seldom a test is run, beyond `slow`."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import pytest

Test = TypeVar("Test", bound=Callable[..., None])

EXHAUSTIVE = (pytest.mark.slow, pytest.mark.exhaustive)
"""Of a cross product of which the quick and the slow tests take a part: `make test-exhaustive`."""


def timed(test: Test) -> Test:
    """A test that promises a speed: it may fail on a machine that has other things to do."""
    return pytest.mark.slow(pytest.mark.timed(test))
