"""What training many agents at once asks of a kind of agent."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Answers:
    """Responses of several agents to the same trials, learning off.

    Attributes:
        table: int64 (agents, classes, most + 1); how often each number of output spikes was given
            to each class. The last column means "that many or more".
        false_alarms: int64 (agents,), output spikes in noise.
        noise_bins: number of noise bins heard.
        wrong: int64 (agents,), trials whose sum of output spikes was not the aggregate label.
        trials: number of trials heard.
    """

    table: NDArray[np.int64]
    false_alarms: NDArray[np.int64]
    noise_bins: int
    wrong: NDArray[np.int64]
    trials: int


class LaneGroup(Protocol):
    """Agents of one kind that hear the same stream. None of the methods holds the GIL for long."""

    def train(self, rng: Generator, trials: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Draw `trials` trials from `rng` and learn each of them.

        Returns, per agent, the number of trials answered wrongly and Σ |label − emitted|.
        """

    def survive(self, rng: Generator, cap: int) -> NDArray[np.int64]:
        """Bins that each agent survives on the endless stream of `rng`, at most `cap`."""

    def answer(self, rng: Generator, trials: int) -> Answers:
        """Responses to `trials` trials drawn from `rng`, learning off."""

    def write_back(self) -> None:
        """Put what was learned into the agents."""

    def overflowed(self) -> NDArray[np.int64]:
        """Per agent the trial in which learning ended because a weight overflowed, or −1."""
