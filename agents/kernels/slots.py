"""Names that the templates of this package use, and that `binding` binds for each combination.

The values here only say what belongs there; but WRONG_BEYOND holds wherever nobody binds it.
"""

from __future__ import annotations

from typing import Any

WIDTH = 1
"""Neurons side by side in a block."""

LEARN_WIDTH = 8
"""Neurons side by side in the learning step."""

WRONG_BEYOND = 0.0
"""A trial counts as wrong if its sum is further than this from the label; ½ for graded output, as
`agents.continuous` binds it."""

# Of the neuron.
Parameters: Any = None
State: Any = None
step: Any = None

# Of the rule.
correction: Any = None
teaching_signal: Any = None
weight_change: Any = None
USES_ERROR = False
DOUBLE_TRACE = False

# Templates that were bound before.
run_bins: Any = None
run_trial: Any = None
sum_eligibility: Any = None
learn_trial: Any = None
