"""Names that the templates of this package use, and that `binding` binds for each combination.

The values here only say what belongs there.
"""

from __future__ import annotations

from typing import Any

WIDTH = 1
"""Models side by side in a block."""

LEARN_WIDTH = 8
"""Models side by side in the learning step."""

# Of the model.
Parameters: Any = None
State: Any = None
advance: Any = None
output: Any = None
active: Any = None
THRESHOLD = 0
"""Row of the readout's threshold among the parameters."""

# Of the rule.
USES_ERROR = False
"""Whether the log of a trial is to say in which bins the readout is above the threshold."""
USES_OUTPUT = False
"""Whether it is to hold the output of each bin."""
BIEXPONENTIAL = False
SEES_PRESENTATIONS = False
correction: Any = None
teaching_signal: Any = None
weight_change: Any = None
teach: Any = None
epsilon: Any = None
OwnNumbers: Any = None

# Templates that were bound before.
run_bins: Any = None
run_trial: Any = None
compute_change: Any = None
learn_trial: Any = None
learn_alone: Any = None
