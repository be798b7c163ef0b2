"""The critical thresholds of the multi-spike tempotron, searched for exactly, event by event.

With U the potential without resets and S(t) = Σ_(t_s<t) e^(−(t−t_s)/τ_m) over the output spikes so
far, the neuron with threshold θ is at or above it where

    ρ(t) = U(t) / (1 + S(t)) >= θ.

As long as the spike train stays what it is, so does ρ, and the train changes only where θ passes a
value of ρ: on the way down at the highest ρ below θ that opens, joins or advances an excursion, on
the way up at the lowest that closes, delays or splits one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from agents.model import Model
from agents.neurons.mst import MST
from gnm_env.compiled import compiled

Floats = NDArray[np.float64]


def membrane_decay(model: Model) -> float:
    """e^(−1/τ_m) of a multi-spike tempotron, −1 for other neurons: not all have its soft reset."""
    return model.psp_kernel().slow if isinstance(model, MST) else -1.0


@compiled
def spike_train(U: Floats, decay: float, theta: float, strict: bool, rho: Floats, S: Floats) -> int:
    """What the neuron does at threshold θ: writes ρ and S, returns the number of spikes.

    `strict` asks for ρ > θ instead of ρ >= θ: the train just above θ.
    """
    count = 0
    reset = 0.0
    before = False
    for t in range(len(U)):
        S[t] = reset
        ratio = U[t] / (1.0 + reset)
        rho[t] = ratio
        above = ratio > theta or (ratio == theta and not strict)
        if above and not before:
            count += 1
            reset += 1.0
        reset *= decay
        before = above
    return count


@compiled
def event_below(rho: Floats, theta: float) -> tuple[float, int]:
    """The highest θ' < θ, > 0, at which the train changes, and the bin that reaches it or −1."""
    value, bin_ = 0.0, -1
    previous = 0.0
    for t in range(len(rho)):
        ratio = rho[t]
        if ratio >= theta:
            if previous < theta and previous > value:
                value, bin_ = previous, t - 1  # the bin before joins the excursion
        elif ratio > value and ratio > previous:
            value, bin_ = ratio, t  # a new excursion opens
        previous = ratio
    return value, bin_


@compiled
def event_above(rho: Floats, theta: float, strict: bool) -> tuple[float, int]:
    """The lowest θ' >= θ (> θ if strict) just above which the train changes, and the bin or −1."""
    value, bin_ = np.inf, -1
    previous = 0.0
    below = True  # whether the bin before is
    for t in range(len(rho)):
        ratio = rho[t]
        above = ratio > theta or (ratio == theta and not strict)
        if above and below:
            if ratio < value:
                value, bin_ = ratio, t  # the spike's own bin falls below
        elif not below and ratio > previous and previous < value:
            value, bin_ = previous, t - 1  # the excursion splits before a rise
        previous, below = ratio, not above
    return value, bin_


@compiled
def teach_critical(
    V: Floats,
    spikes: Floats,
    threshold: float,
    decay: float,
    count: float,
    n: int,
    sign: float,
    y: Floats,
) -> None:
    """Add sign/C to y in the bins of the `n` nearest critical thresholds, `count` spikes given.

    A change of the train that brings or takes two spikes counts for two of them.
    """
    U, rho, S = np.empty(len(V)), np.empty(len(V)), np.empty(len(V))
    reset = 0.0
    for t in range(len(V)):
        S[t] = reset
        U[t] = V[t] + threshold * reset
        rho[t] = U[t] / (1.0 + reset)
        reset = decay * (reset + spikes[t])
    down = sign > 0.0
    wanted = count + 1.0 if down else count
    theta, strict = threshold, False
    found = 0
    while found < n:
        theta, bin_ = event_below(rho, theta) if down else event_above(rho, theta, strict)
        if bin_ < 0:
            return
        C = 1.0 + S[bin_]
        strict = not down
        now = spike_train(U, decay, theta, strict, rho, S)
        while found < n and (now >= wanted if down else now < wanted):
            y[bin_] += sign / C
            found += 1
            wanted += sign
