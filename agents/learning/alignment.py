"""How output spikes become target spikes at the least cost, and what that teaches."""

from __future__ import annotations

import numpy as np

from agents.learning.peaks import Bins, Floats, mark
from gnm_env.compiled import compiled


@compiled
def move_cost(output: int, target: int, tau_q: float) -> float:
    """½(Δ/τ_q)²."""
    distance = abs(output - target) / tau_q
    return distance * distance / 2.0


@compiled
def cost_table(outputs: Bins, targets: Bins, tau_q: float) -> Floats:
    """Cost of the first i outputs becoming the first j targets, (outputs + 1, targets + 1)."""
    cost = np.zeros((len(outputs) + 1, len(targets) + 1))
    for i in range(len(outputs) + 1):
        for j in range(len(targets) + 1):
            best = np.inf if i + j > 0 else 0.0
            if i > 0:
                best = min(best, cost[i - 1, j] + 1.0)
            if j > 0:
                best = min(best, cost[i, j - 1] + 1.0)
            if i > 0 and j > 0:
                moved = move_cost(outputs[i - 1], targets[j - 1], tau_q)
                best = min(best, cost[i - 1, j - 1] + moved)
            cost[i, j] = best
    return cost


@compiled
def teach_alignment(
    outputs: Bins, targets: Bins, tau_q: float, gamma_r: float, lag: int, y: Floats
) -> None:
    """Add to y what E-learning of the chronotron says; both trains ascending.

    Victor–Purpura alignment. Of equal costs removing goes before adding and adding before moving,
    decided from the last spikes backward.
    """
    cost = cost_table(outputs, targets, tau_q)
    i, j = len(outputs), len(targets)
    while i > 0 or j > 0:
        if i > 0 and cost[i, j] == cost[i - 1, j] + 1.0:
            i -= 1
            mark(y, outputs[i], -1.0, lag)
        elif j > 0 and cost[i, j] == cost[i, j - 1] + 1.0:
            j -= 1
            mark(y, targets[j], 1.0, lag)
        else:
            i, j = i - 1, j - 1
            mark(y, outputs[i], gamma_r / tau_q**2 * (outputs[i] - targets[j]), lag)
