"""How seldom a test is run, beyond `slow`."""

import pytest

EXHAUSTIVE = (pytest.mark.slow, pytest.mark.exhaustive)
"""Of a cross product of which the quick and the slow tests take a part: `make test-exhaustive`."""
