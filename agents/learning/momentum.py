"""The last step of every rule: add momentum, apply the change, stay within the bounds."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.learning.rule import RuleParameters
from agents.simd import load, store, where
from gnm_env.compiled import inlined


@inlined
def clipped(p: RuleParameters, weight: Any) -> Any:
    """The weight, or the bound that it has passed."""
    weight = where(weight > p.lowest, weight, p.lowest)
    return where(weight < p.highest, weight, p.highest)


@inlined
def apply_change(
    p: RuleParameters,
    learns: Any,
    change: NDArray[np.float64],
    weights: NDArray[np.float64],
    velocity: NDArray[np.float64],
) -> Any:
    """Δ_i <- Δ_i + μ·Δ_i(previous step); w_i <- clip(w_i + Δ_i), in the lanes that `learns` names.

    The three arrays have one row per input; `velocity` holds the Δ of the previous learning step,
    momentum included and unclipped. A weight that would overflow keeps its last finite value.
    Returns the lanes in which none would have.
    """
    zero = p.momentum * 0.0
    probe = zero
    for i in range(len(change)):
        old, before = load(weights, i, zero), load(velocity, i, zero)
        delta = load(change, i, zero) + p.momentum * before
        new = old + delta
        overflow = new * 0.0  # 0 for finite numbers, else NaN
        probe = probe + overflow
        taken = learns & (overflow == 0.0)
        store(weights, i, where(taken, clipped(p, new), old))
        store(velocity, i, where(taken, delta, before))
    return probe == 0.0
