"""Random input in continuous time, shared by the tests."""

from __future__ import annotations

import numpy as np

from agents.continuous import InputSpikes


def random_input(
    seed: int, n_inputs: int = 20, duration: float = 40.0, rate: float = 1.0
) -> tuple[InputSpikes, np.ndarray]:
    """Spikes at random real-valued times, and weights a few of which are negative."""
    rng = np.random.default_rng(seed)
    times = np.sort(rng.uniform(0.0, duration, rng.poisson(rate * duration)))
    spikes = InputSpikes(times, rng.integers(0, n_inputs, times.size), duration, n_inputs)
    return spikes, rng.uniform(-0.1, 0.6, n_inputs)
