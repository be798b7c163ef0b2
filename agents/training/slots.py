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
READS_V = True
"""Whether the readout is V itself; else it is kept beside V where the rule asks for it."""
LAG = 0
"""Bins by which the readout is behind the potential that it shows."""

# Of the rule.
USES_ERROR = False
"""Whether the log of a trial is to say in which bins the readout is above the threshold."""
USES_OUTPUT = False
"""Whether it is to hold the output of each bin."""
USES_READOUT = False
"""Whether it is to hold the readout, which is not V, or what takes its place."""
BIEXPONENTIAL = False
SEES_PRESENTATIONS = False
TOLD_REWARD = False
"""Whether the correction is the reward, less 1."""
WEIGHS = False
"""Whether the rule has its own `weigh`."""
AVERAGES = False
"""Whether the rule averages weights over some of the trials."""
EXPLORES = False
"""Whether the rule draws the output while it learns."""
BY_BIN = False
"""Whether the rule has a `bin_signal` or `side_by_side` instead of a `teaching_signal`."""
correction: Any = None
weigh: Any = None
spike_probability: Any = None
Memory: Any = None
teaching_signal: Any = None
bin_signal: Any = None
side_by_side: Any = None
weight_change: Any = None
teach: Any = None
accumulate: Any = None
epsilon: Any = None
OwnNumbers: Any = None

# Templates that were bound before.
run_bins: Any = None
run_trial: Any = None
compute_change: Any = None
learn_trial: Any = None
weighed: Any = None
explore_trial: Any = None
learn_alone: Any = None
