"""The last step of every rule: add momentum, apply the change, stay within the bounds."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.lanes import load, store, where
from agents.learning.rule import RuleParameters
from gnm_env.compiled import compiled


@compiled
def apply_change(
    p: RuleParameters,
    learns: Any,
    change: NDArray[np.float64],
    weights: NDArray[np.float64],
    previous: NDArray[np.float64],
) -> Any:
    """Δ_i <- Δ_i + μ·Δ_i(previous step); w_i <- clip(w_i + Δ_i), in the lanes that `learns` names.

    `change`, `weights` and `previous` have shape (N, p.momentum); `previous` holds the Δ of the previous
    learning step, momentum included and unclipped. A step that would make a weight overflow is not
    taken. Returns the lanes in which it was taken.
    """
    probe = load(change, 0, p.momentum) * 0.0
    for i in range(len(change)):
        delta = load(change, i, p.momentum) + p.momentum * load(previous, i, p.momentum)
        store(change, i, delta)
        weight = load(weights, i, p.momentum) + delta
        weight = where(weight < p.lowest, p.lowest, where(weight > p.highest, p.highest, weight))
        probe = probe + (weight - weight)  # 0, or NaN once a weight is infinite or NaN
    taken = learns & (probe == 0.0)
    for i in range(len(change)):
        delta = load(change, i, p.momentum)
        old = load(weights, i, p.momentum)
        weight = old + delta
        weight = where(weight < p.lowest, p.lowest, where(weight > p.highest, p.highest, weight))
        store(weights, i, where(taken, weight, old))
        store(previous, i, where(taken, delta, load(previous, i, p.momentum)))
    return taken
