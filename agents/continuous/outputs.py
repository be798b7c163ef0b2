"""How much S a continuous neuron gives to each pattern, alone and within trials."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from agents.continuous.agent import ContinuousAgent
from agents.continuous.simulate import InputSpikes, Trajectory, simulate
from gnm_env.task import Patterns, Task
from gnm_env.trial import Trial, draw_trial


def pattern_alone(agent: ContinuousAgent, patterns: Patterns, class_: int) -> InputSpikes:
    """Pattern `class_` by itself, each spike at the beginning of its bin."""
    bins, channels = np.nonzero(patterns.dense()[class_])
    return InputSpikes(bins.astype(np.float64), channels, float(patterns.shape[1]), agent.n_inputs)


def course_alone(
    agent: ContinuousAgent, patterns: Patterns, class_: int, points_per_bin: int = 50
) -> Trajectory:
    """The neuron's course under pattern `class_` alone, from rest."""
    spikes = pattern_alone(agent, patterns, class_)
    at = np.arange(int(spikes.duration) * points_per_bin + 1) / points_per_bin
    # Each spike twice, the first time just before it, so that a drawn line rises upright.
    before = np.nextafter(spikes.times[spikes.times > 0.0], -np.inf)
    return simulate(agent.neuron, agent.weights, spikes, np.union1d(at, before))


def outputs_alone(agent: ContinuousAgent, patterns: Patterns) -> NDArray[np.float64]:
    """S of each pattern presented alone, from rest; float64 (C,)."""
    courses = [course_alone(agent, patterns, c, 1) for c in range(patterns.shape[0])]
    return np.array([course.S[-1] for course in courses])


def occurrence_outputs(agent: ContinuousAgent, trial: Trial) -> NDArray[np.float64]:
    """S of each occurrence in a trial, (K,): what has been there before plays a part."""
    edges = np.stack([trial.onsets, trial.onsets + trial.pattern_bins]).astype(np.float64)
    at, place = np.unique(edges, return_inverse=True)
    S = simulate(agent.neuron, agent.weights, InputSpikes.from_trial(trial), at).S
    return np.diff(S[place.reshape(edges.shape)], axis=0)[0]


def outputs_in_trials(
    agent: ContinuousAgent, task: Task, patterns: Patterns, trials: int = 500, seed: int = 0
) -> list[NDArray[np.float64]]:
    """S of every occurrence in `trials` trials drawn from `seed`, one array for each class."""
    rng = np.random.default_rng(seed)
    heard = [draw_trial(task, patterns, rng) for _ in range(trials)]
    S = np.concatenate([occurrence_outputs(agent, trial) for trial in heard])
    classes = np.concatenate([trial.classes for trial in heard])
    return [S[classes == c] for c in range(task.n_classes)]
