"""Figure 1c and d: a neuron under constant input."""

from __future__ import annotations

from matplotlib.figure import Figure

import hysteresis
from experiments.constant_input import recordings
from experiments.verdict import Results


def traces(results: Results) -> Figure:
    """V over time under weak and strong input, and D over V."""
    return hysteresis.draw(*recordings(results["F1"]))
