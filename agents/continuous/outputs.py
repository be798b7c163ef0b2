"""How much S a continuous neuron gives, to each pattern alone and within trials, and what is wrong.

The functions of a whole trial take S at the bins' edges, the integral from 0 to 0, 1, … T, so that
they serve the neuron and its chemical counterpart alike.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from agents.continuous.agent import ContinuousAgent
from agents.continuous.simulate import InputSpikes, Trajectory, simulate
from gnm_env.rules import too_few, too_many
from gnm_env.task import Patterns, Task
from gnm_env.trial import Trial, draw_trial

Amounts = NDArray[np.float64]


def course(agent: ContinuousAgent, spikes: InputSpikes, points_per_bin: int = 50) -> Trajectory:
    """The neuron's course, from rest, for drawing: each input spike shows as an upright line."""
    grid = np.arange(int(spikes.duration * points_per_bin) + 1) / points_per_bin
    before = np.nextafter(spikes.times[spikes.times > 0.0], -np.inf)
    at = np.unique(np.concatenate([grid, before, spikes.times]))
    return simulate(agent.neuron, agent.weights, spikes, at)


def pattern_spikes(patterns: Patterns, class_: int) -> InputSpikes:
    """Pattern `class_` by itself, each spike at the beginning of its bin."""
    _, n_bins, n_inputs = patterns.shape
    bins, channels = np.nonzero(patterns.dense()[class_])
    return InputSpikes(bins.astype(np.float64), channels, float(n_bins), n_inputs)


def outputs_alone(agent: ContinuousAgent, patterns: Patterns) -> Amounts:
    """S of each pattern presented alone, from rest; (C,)."""
    alone = [pattern_spikes(patterns, c) for c in range(patterns.shape[0])]
    return np.array([simulate(agent.neuron, agent.weights, spikes).S[-1] for spikes in alone])


def at_edges(agent: ContinuousAgent, trial: Trial) -> Amounts:
    """S of the neuron at the edges of a trial's bins, (T + 1,)."""
    at = np.arange(trial.n_bins + 1, dtype=np.float64)
    return simulate(agent.neuron, agent.weights, InputSpikes.from_trial(trial), at).S


def in_presentations(trial: Trial, S: Amounts) -> Amounts:
    """S given in each presentation, (…, K), from S at the edges, (…, T + 1)."""
    return S[..., trial.ends] - S[..., trial.onsets]


def in_noise(trial: Trial, S: Amounts) -> Amounts:
    """S given in each stretch of noise, (…, K + 1), some of them empty; `S` as above."""
    begins = np.concatenate([[0], trial.ends])
    ends = np.concatenate([trial.onsets, [trial.n_bins]])
    return S[..., ends] - S[..., begins]


def wrong_outputs(trial: Trial, S: Amounts) -> NDArray[np.int64]:
    """Wrong outputs in a trial, (…): segments that have more or less than they are owed."""
    given, noise = in_presentations(trial, S), in_noise(trial, S)
    wrong = too_many(given, trial.targets) | too_few(given, trial.targets)
    false_positives = too_many(noise, 0)
    return wrong.sum(-1) + false_positives.sum(-1)


def outputs_in_trials(
    agent: ContinuousAgent, task: Task, patterns: Patterns, trials: int = 500, seed: int = 0
) -> list[Amounts]:
    """S of every presentation in `trials` trials drawn from `seed`, one array for each class."""
    rng = np.random.default_rng(seed)
    heard = [draw_trial(task, patterns, rng) for _ in range(trials)]
    S = np.concatenate([in_presentations(trial, at_edges(agent, trial)) for trial in heard])
    classes = np.concatenate([trial.classes for trial in heard])
    return [S[classes == c] for c in range(task.n_classes)]
