"""Small worlds and shorthands that the tests of the agents share."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import ArrayLike, NDArray

import gnm_env  # noqa: F401  (registers the environments)
from agents import AggregateLabel, NeuronAgent, Recording, record
from agents.neurons.neuron import Neuron
from gnm_env import Patterns, Task, Trial

BUSY = Task(
    n_inputs=12, pattern_bins=8, rate=0.1, n_classes=2, background_bins=30, mean_occurrences=1.0
)
"""Trials of some 46 bins with about one input spike in each."""

BUSY_PATTERNS = Patterns.draw(BUSY, seed=0)

BUSY_WEIGHT = {"gnm": 0.6, "lif": 0.9, "mst": 0.15}
"""Initial weights, by neuron, that make a neuron spike now and then in the busy world."""


def trial_env(
    task: Task = BUSY, patterns: Patterns = BUSY_PATTERNS, **keywords: Any
) -> gym.Env[Any, Any]:
    return gym.make("gnm/PatternTrial-v0", task=task, patterns=patterns, **keywords)


def respond(neuron: Neuron, raster: NDArray[np.bool_], weights: ArrayLike) -> Recording:
    """What a neuron does with a raster (T, N); weights as they are, without bounds."""
    n_inputs = raster.shape[1]
    agent = NeuronAgent(neuron, AggregateLabel(fraction=1.0), n_inputs, weight_bounds=None)
    agent.weights = weights
    return record(agent, Trial.from_dense(raster, [], [], Task(n_inputs=n_inputs)))


def play(agent: Any, trial: Trial, **altered: Any) -> NDArray[np.bool_]:
    """One trial of the standard loop, learning at its end; the spikes that the agent gave.

    `altered` replaces entries of the terminal info, or `reward` and `sign_only`.
    """
    agent.begin_trial()
    spikes = np.array([agent.act(row) for row in trial.dense().view(np.int8)]) == 1
    info = {
        "label": trial.label,
        "emitted": int(spikes.sum()),
        "onsets": trial.onsets.tolist(),
        "classes": trial.classes.tolist(),
        "targets": trial.targets.tolist(),
        "pattern_bins": trial.pattern_bins,
    }
    reward = altered.pop("reward", -abs(trial.label - info["emitted"]))
    sign_only = altered.pop("sign_only", False)
    agent.learn(reward, {**info, **altered}, sign_only)
    return spikes
