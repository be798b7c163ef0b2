"""Everything that a neuron does in one trial, bin by bin: what every picture is drawn from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gnm_env.checks import shown
from gnm_env.trial import Trial


@dataclass(frozen=True, eq=False, repr=False)
class Recording:
    """Variables of a neuron in each of the T bins of a trial; all arrays have shape (T,).

    Attributes:
        V: membrane potential, before any reset that the bin's spike causes.
        D: what the bin took away from the membrane potential, by decay or soft reset.
        R: the neuron's own reset variable: R of the GNM, the refractory bins left of the LIF, the
            sum of decaying resets of the MST.
        X: readout, compared with the threshold.
        spikes: bool, the output spikes.
    """

    V: NDArray[np.float64]
    D: NDArray[np.float64]
    R: NDArray[np.float64]
    X: NDArray[np.float64]
    spikes: NDArray[np.bool_]

    def __repr__(self) -> str:
        given = int(self.spikes.sum())
        return f"Recording({len(self.V):,} bins, {given:,} output spike{'s' * (given != 1)})"


def record(agent: Any, trial: Trial) -> Recording:
    """What `agent` does in `trial`, starting from rest, learning off. Changes nothing.

    Raises ValueError if `agent` is none whose variables can be recorded, or `trial` is no trial
    that it can hear.
    """
    if not callable(getattr(agent, "record", None)) or isinstance(agent, type):
        raise ValueError(
            f"agent must be an agent, such as NeuronAgent makes, got {shown(agent)}; "
            "give a neuron weights and a rule first: NeuronAgent(neuron, rule, n_inputs)"
        )
    if not isinstance(trial, Trial):
        raise ValueError(
            f"trial must be a gnm_env.Trial, got {shown(trial)}; "
            "make one with draw_trial, or of your own data with Trial.from_dense"
        )
    if trial.n_inputs != agent.n_inputs:
        raise ValueError(
            f"the trial must have as many channels as the agent has inputs, {agent.n_inputs}, "
            f"got {trial.n_inputs}"
        )
    recording: Recording = agent.record(trial)
    return recording
