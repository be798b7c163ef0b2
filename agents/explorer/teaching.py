"""The teaching signal y(t) of any rule in one trial.

A rule says y(t), and learning is Δw_i = λ Σ_t x_i(t) y(t). Rules compute it in compiled code, each
in its own way, and hand out the sum only. So y(t) is read off the sum: an agent with one channel a
bin, which spikes in its own bin and whose weight is the input current of that bin, has the very
potential of the agent in question. What the rule would add to the weight of channel t is then
λ Σ_s x(s − t) y(s), from which y follows by undoing the presynaptic trace.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.learning.rule import in_proportion
from agents.model import PSPKernel
from gnm_env import Trial
from gnm_env.compiled import compiled
from gnm_env.trial_task.info import info_of

MOST_BINS = 4_000
"""Longest trial that this serves: the twin's input has T · T bits."""


def teaching_signal(agent: Any, trial: Trial) -> NDArray[np.float64] | None:
    """y(t), (T,), in units of the rule; None where there is none, or the trial is too long.

    Where only the sign of the sum counts, as for ALL, it has the sign of the correction: y = ±V.
    """
    if agent.model.psp_kernel() is None or trial.n_bins > MOST_BINS:
        return None
    rule = dataclasses.replace(agent.rule, learning_rate=1.0, momentum=0.0, decay_trials=None)
    if type(rule).weight_change is not in_proportion:
        return _of_potential(agent, rule, trial)
    return undone(_sums(agent, rule, trial), rule.kernel(agent.model))


def _of_potential(agent: Any, rule: Any, trial: Trial) -> NDArray[np.float64] | None:
    """Of a rule that does more with the sum than to add it: sign of the error times y(V)."""
    signal = type(rule).teaching_signal
    if rule.uses_error or signal is None:
        return None
    function, static = getattr(signal, "py_func", signal), rule.static(agent.n_inputs)
    y = [function(static, v, 0.0) for v in agent.record(trial).V.tolist()]
    return np.sign(trial.label - emitted(agent, trial.dense())) * np.array(y)


def emitted(agent: Any, bits: NDArray[np.bool_]) -> float:
    """The agent's output in a trial of these bits, (T, N): spikes, or an amount."""
    agent.begin_trial()
    return float(sum(agent.act(row) for row in bits.view(np.int8)))


def _sums(agent: Any, rule: Any, trial: Trial) -> NDArray[np.float64]:
    """Σ_s x(s − t) y(s) for each bin t, (T,): what a channel that spikes in bin t would learn."""
    twin = type(agent)(agent.model, rule, trial.n_bins, weight_bounds=None)
    twin.weights = currents(agent.weights, trial.arrays.channels, trial.arrays.offsets)
    given = emitted(twin, np.eye(trial.n_bins, dtype=np.bool_))
    twin.learn(-abs(trial.label - given), info_of(trial, given))
    return np.array(twin.velocity)


@compiled
def currents(
    weights: NDArray[np.float64], channels: NDArray[np.int32], offsets: NDArray[np.int64]
) -> NDArray[np.float64]:
    """I(t) = Σ_i w_i s_i(t), (T,), summed as the neurons sum it."""
    result = np.zeros(len(offsets) - 1)
    for t in range(len(result)):
        for e in range(offsets[t], offsets[t + 1]):
            result[t] += weights[channels[e]]
    return result


def undone(sums: NDArray[np.float64], kernel: PSPKernel) -> NDArray[np.float64]:
    """y, (T,), from g(t) = Σ_{s>=t} x(s − t) y(s), x the presynaptic trace.

    A biexponential trace is 0 at once, so that y of the first bin teaches nothing, and is 0 here.
    """
    later = np.append(sums[1:], 0.0)
    if not kernel.biexponential:
        return sums - kernel.slow * later
    latest = np.append(sums[2:], (0.0, 0.0))
    slow, fast = kernel.slow, kernel.fast
    earlier = (sums - (slow + fast) * later + slow * fast * latest)[:-1]
    return np.append(0.0, earlier / (kernel.scale * (slow - fast)))
