"""Every rule beside its second opinion, and agents that learn by it: what its tests share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from functools import partial
from typing import Any, NamedTuple

import numpy as np

import agents
from agents import NeuronAgent, learning
from agents.learning.rule import Rule
from gnm_env import Task, Trial
from tests.agents.learning.oracles import rules, trials
from tests.agents.learning.oracles.neurons import Spec
from tests.agents.learning.oracles.rules import Lesson

LAMBDA = 0.05


class Entry(NamedTuple):
    """A rule, and what it is to agree with."""

    rule: Rule
    oracle: Callable[..., Lesson]
    binary: bool = False
    """Whether it learns from labels 0 and 1 only."""


def entry(made: Rule, oracle: Callable[..., Lesson], **options: Any) -> Entry:
    """A rule that takes the oracle's options by the same names."""
    made = type(made)(learning_rate=LAMBDA, momentum=0.2, **options)
    return Entry(made, partial(oracle, learning_rate=LAMBDA, **options), made.name == "tempotron")


RULES: dict[str, Entry] = {
    "critical": entry(learning.CriticalThreshold(), rules.critical_threshold),
    "critical-amount": entry(learning.CriticalThreshold(), rules.critical_threshold, amount=True),
    "mpdal": entry(learning.MPDAL(), rules.mpdal),
    "tempotron": entry(learning.Tempotron(), rules.tempotron),
    "peak-error": entry(learning.PeakError(), rules.peak_error),
    "peak-error-first": entry(learning.PeakError(), rules.peak_error, first_only=True),
    "surrogate": entry(learning.SurrogateGradient(), rules.surrogate_gradient),
    "surrogate-triangle": entry(
        learning.SurrogateGradient(), rules.surrogate_gradient, surrogate="triangle"
    ),
    "surrogate-count": entry(
        learning.SurrogateGradient(), rules.surrogate_gradient, on_count=True, k=3.0
    ),
    "resume": entry(learning.ReSuMe(), rules.resume),
    "resume-even": entry(learning.ReSuMe(), rules.resume, times="even", a=0.3, tau=7.0),
    "psd": entry(learning.PSD(), rules.psd),
    "psd-even": entry(learning.PSD(), rules.psd, times="even", slow=8.0, fast=3.0),
    "span": entry(learning.SPAN(), rules.span),
    "span-even": entry(learning.SPAN(), rules.span, times="even", tau=3.0),
    "chronotron": entry(learning.Chronotron(), rules.chronotron, tau_q=5.0),
    "chronotron-even": entry(
        learning.Chronotron(), rules.chronotron, times="even", tau_q=5.0, gamma_r=3.0
    ),
    "chronotron-i": entry(learning.Chronotron(), rules.chronotron, rule="I"),
    "stdp": entry(learning.STDP(), rules.stdp, tau_minus=20.0),
    "mstdpet": entry(learning.MSTDPET(), rules.mstdpet, a_minus=0.7),
}

NEURONS = trials.NEURONS
"""By name: one of each way in which a neuron can differ for a rule."""


def neuron_of(spec: Spec) -> Any:
    """The neuron of the package that a description describes."""
    return getattr(agents, type(spec).__name__)(**asdict(spec))


def cases(name: str, neuron: str, n: int, seed: int = 0) -> list[trials.Case]:
    """n random trials for a rule and a neuron."""
    made = trials.binary_cases if RULES[name].binary else trials.cases
    return made(NEURONS[neuron], n, seed)


def agent_for(case: trials.Case, rule: Rule, **options: Any) -> NeuronAgent:
    """An agent of the case's neuron and weights, with some velocity from before."""
    n_inputs = len(case.weights)
    agent = NeuronAgent(
        neuron_of(case.neuron), rule, n_inputs, **{"weight_bounds": None, **options}
    )
    agent.weights = case.weights
    agent.velocity = 0.01 * np.cos(np.arange(n_inputs))
    return agent


def trial_for(case: trials.Case) -> Trial:
    """The trial of a case, as agents hear it."""
    owed = case.trial.target[1::2]
    n_classes = max(case.classes, default=0) + 1
    targets = [0] * n_classes
    for class_, target in zip(case.classes, owed, strict=True):
        targets[class_] = target
    task = Task(
        n_inputs=len(case.weights), pattern_bins=trials.PATTERN_BINS, n_classes=n_classes,
        targets=tuple(targets),
    )  # fmt: skip
    return Trial.from_dense(case.trial.raster, case.onsets, case.classes, task)
