"""Whether a neuron or a rule of one's own works at every width: tried, and told in plain words."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from agents.learning.aggregate_label import AggregateLabel
from agents.learning.rule import Rule
from agents.neuron_agent import NeuronAgent
from agents.neurons.gnm import GNM
from agents.neurons.neuron import Neuron
from agents.training.agent import Agent
from agents.training.loop import train
from agents.training.many import train_many
from gnm_env.checks import shown
from gnm_env.task import Patterns, Task
from gnm_env.trial import Trial
from gnm_env.trial_task.env import PatternTrialEnv

WIDTHS = (1, 8, 32)
"""Numbers of neurons side by side for which loops are compiled."""

_TASK = Task(n_inputs=12, pattern_bins=8, rate=0.15, background_bins=20, n_classes=2)
_TRIALS = 60


def check_neuron(neuron: Any) -> None:
    """Try `neuron` alone and side by side, at widths 1, 8 and 32; returns if all is well.

    Raises:
        ValueError: in a sentence that says what is wrong: a line that cannot serve neurons side by
            side, other bits at another width, or a state of zeros that is not rest.
    """
    _require_neuron(neuron)
    _check_parameters(neuron)
    _check_rest(neuron)
    _check_widths(neuron, AggregateLabel(1e-2, fraction=0.25))


def check_rule(rule: Any, neuron: Any = None) -> None:
    """Try `rule` on `neuron` (None: a GNM) as `check_neuron` does; returns if all is well.

    Raises ValueError as that does, and if no weight changes in some dozens of trials.
    """
    if not isinstance(rule, Rule):
        raise ValueError(f"rule must be an instance of a class derived from Rule, got {_got(rule)}")
    if neuron is not None:
        _require_neuron(neuron)
    _check_teaching(GNM() if neuron is None else neuron, rule)
    _check_widths(GNM() if neuron is None else neuron, rule)


def _require_neuron(neuron: Any) -> None:
    if not isinstance(neuron, Neuron):
        raise ValueError(
            f"neuron must be an instance of a class derived from Neuron, got {_got(neuron)}"
        )


def _got(value: Any) -> str:
    if isinstance(value, type):
        return f"the class {value.__name__}; write {value.__name__}()"
    return shown(value)


def _check_parameters(neuron: Neuron) -> None:
    names, numbers = neuron.parameters_type._fields, neuron.parameters()
    if len(names) != len(numbers):
        raise ValueError(
            f"parameters() of {type(neuron).__name__} must give one number for each of "
            f"{', '.join(names)}, got {len(numbers)}"
        )
    if not np.isfinite([n for n in numbers if not np.isinf(n)]).all():
        raise ValueError(f"parameters() of {type(neuron).__name__} must be numbers, got {numbers}")
    if not dataclasses.is_dataclass(neuron):
        raise ValueError(
            f"{type(neuron).__name__} must be a frozen dataclass: @dataclass(frozen=True)"
        )


def _check_rest(neuron: Neuron) -> None:
    """A neuron that hears nothing stays at rest: V = 0 and no spikes."""
    silence = Trial.from_dense(np.zeros((20, _TASK.n_inputs), bool), [], [], _TASK)
    agent = NeuronAgent(neuron, AggregateLabel(fraction=0.25), _TASK.n_inputs)
    recording = agent.record(silence)
    if recording.spikes.any() or recording.V.any():
        raise ValueError(
            f"a {type(neuron).__name__} that hears nothing must stay at rest, V = 0 and no spikes, "
            "since every trial begins with a state of zeros; count what is not 0 at rest as the "
            "distance from there"
        )


def _agents(neuron: Neuron, rule: Rule, n: int) -> list[Agent]:
    weight = 3 * neuron.default_initial_weight
    return [NeuronAgent(neuron, rule, _TASK.n_inputs, k, weight) for k in range(n)]


def _alone(neuron: Neuron, rule: Rule, patterns: Patterns) -> Agent:
    """One agent, trained by the standard loop."""
    alone = _agents(neuron, rule, 1)[0]
    train(alone, PatternTrialEnv(_TASK, patterns), _TRIALS, seed=1)
    return alone


def _check_teaching(neuron: Neuron, rule: Rule) -> None:
    before = _agents(neuron, rule, 1)[0].weights
    if np.array_equal(_alone(neuron, rule, Patterns.draw(_TASK, 0)).weights, before):
        raise ValueError(
            f"{shown(rule)} changed no weight in {_TRIALS} trials: a teaching signal that is 0 "
            "throughout teaches nothing, and so does a learning rate of 0; teach(p, trial, y) must "
            "write into y, what it returns is not read"
        )


def _check_widths(neuron: Neuron, rule: Rule) -> None:
    patterns = Patterns.draw(_TASK, 0)
    alone = _alone(neuron, rule, patterns)
    for width in WIDTHS:
        group = _agents(neuron, rule, width)
        train_many(group, _TASK, patterns, _TRIALS, seed=1, threads=1)
        same = np.array_equal(group[0].weights, alone.weights, equal_nan=True)
        if not same:
            raise ValueError(
                f"{type(neuron).__name__} with {type(rule).__name__} ends with other weights "
                f"among {width} side by side than in the standard loop: everything that passes "
                "from bin to bin must be in its State, and nothing in a global"
            )
