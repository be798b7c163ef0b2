"""Everything that a neuron does in one trial, bin by bin: what every picture is drawn from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gnm_env.trial import Trial


@dataclass(frozen=True, eq=False)
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


def record(agent: Any, trial: Trial) -> Recording:
    """What `agent` does in `trial`, starting from rest, learning off. Changes nothing."""
    if trial.n_inputs != agent.n_inputs:
        raise ValueError(
            f"the trial must have as many channels as the agent has inputs, {agent.n_inputs}, "
            f"got {trial.n_inputs}"
        )
    recording: Recording = agent.record(trial)
    return recording
