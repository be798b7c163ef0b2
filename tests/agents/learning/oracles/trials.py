"""Random small trials for the tests of the rules: presentations of two patterns between noise.

    for case in cases(GNM(alpha=0.2), n=50):
        lesson = rules.critical_threshold(case.trial, case.neuron, case.weights)

Weights vary from case to case, signed as after unbounded learning, so that too many, too few and
just as many spikes as owed come up; `kinds` tells how often.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
from numpy.random import Generator

from tests.agents.learning.oracles.neurons import GNM, LIF, MST, Floats, Spec, hear
from tests.agents.learning.oracles.rules import Trial

N_INPUTS = 12
PATTERN_BINS = 8
TARGETS = (1, 2)
"""Output spikes owed per class."""

NEURONS: dict[str, Spec] = {
    "gnm": GNM(alpha=0.2),
    "gnm_forgets": GNM(alpha=1.0),
    "gnm_recovers": GNM(alpha=0.2, eta=0.4),
    "gnm_reads_D": GNM(alpha=0.4, theta_r=0.3, readout="D"),
    "lif": LIF(alpha=0.15),
    "lif_pauses": LIF(alpha=0.15, refractory=3),
    "mst": MST(tau_m=8.0, tau_s=2.0),
    "mst_slow": MST(tau_m=20.0, tau_s=5.0),
}
"""One of each way in which a neuron can differ for a rule; by name."""

SCALE = {"gnm": 0.5, "lif": 0.4, "mst": 0.35}
"""Weights at which a neuron's counts lie about what is owed; by the neuron's kind."""


class Case(NamedTuple):
    """A trial, a neuron that hears it and the neuron's weights."""

    trial: Trial
    neuron: Spec
    weights: Floats
    onsets: list[int]
    """First bin of each presentation …"""
    classes: list[int]
    """… and its class: what `Trial.from_dense` of the package asks for."""


def draw_trial(
    rng: Generator,
    noise_bins: int = 20,
    presentations: int = 3,
    rate: float = 0.12,
    targets: tuple[int, ...] = TARGETS,
) -> tuple[Trial, list[int], list[int]]:
    """A trial with its onsets and classes. Patterns are drawn anew for every trial.

    Presentations may lie side by side, open the trial, or end it.
    """
    patterns = rng.random((len(targets), PATTERN_BINS, N_INPUTS)) < rate
    classes = [int(c) for c in rng.integers(0, len(targets), presentations)]
    before = sorted(int(b) for b in rng.integers(0, noise_bins + 1, presentations))
    noise = rng.random((noise_bins, N_INPUTS)) < rate
    parts: list[Any] = []
    edges, target, onsets, used, t = [0], [], [], 0, 0
    for b, c in zip(before, classes, strict=True):
        parts += [noise[used:b], patterns[c]]
        t += b - used
        onsets.append(t)
        edges += [t, t + PATTERN_BINS]
        target += [0, targets[c]]
        t += PATTERN_BINS
        used = b
    raster = np.concatenate([*parts, noise[used:]])
    return Trial(raster, [*edges, len(raster)], [*target, 0]), onsets, classes


def cases(neuron: Spec, n: int = 40, seed: int = 0, **drawing: Any) -> list[Case]:
    """n trials of one neuron with weights of varying size and sign."""
    rng = np.random.default_rng((seed, 14))
    scale = SCALE[type(neuron).__name__.lower()]
    made = []
    for _ in range(n):
        trial, onsets, classes = draw_trial(rng, **drawing)
        size = scale * rng.choice([0.5, 1.0, 1.0, 2.0])
        weights = size * (rng.random(N_INPUTS) - rng.choice([0.0, 0.25]))
        made.append(Case(trial, neuron, weights, onsets, classes))
    return made


def binary_cases(neuron: Spec, n: int = 40, seed: int = 0) -> list[Case]:
    """n trials with one presentation, labelled 0 or 1: what a tempotron can learn from."""
    rng = np.random.default_rng((seed, 15))
    halves = [
        cases(neuron, n - n // 2, seed, noise_bins=6, presentations=1, targets=(0,)),
        cases(neuron, n // 2, seed + 1, noise_bins=6, presentations=1, targets=(1,)),
    ]
    together = [case for half in halves for case in half]
    return [together[int(i)] for i in rng.permutation(len(together))]


def kinds(made: Iterable[Case]) -> Counter[str]:
    """How many of the cases have too few, too many or as many spikes as owed."""
    found: Counter[str] = Counter()
    for case in made:
        output = len(hear(case.neuron, case.trial.raster, case.weights).times)
        d = case.trial.label
        found["few" if output < d else "many" if output > d else "right"] += 1
    return found
