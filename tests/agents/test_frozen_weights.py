"""What training gives is frozen: weights and velocities are these bits whatever changes inside.

The digests are of weights and velocities that the first published code trained; a change of the
house must not move them. Neurons with a readout, a reset, a Hill function of every kind.
"""

from __future__ import annotations

import hashlib
from typing import Any

import numpy as np
import pytest

from agents import GNM, LIF, MST, AggregateLabel, ErrorTrace, NeuronAgent, train_many
from agents.learning.rule import Rule
from agents.neurons.neuron import Neuron
from gnm_env import Patterns, Task
from tests.marks import EXHAUSTIVE

TASK = Task(
    n_inputs=37, pattern_bins=13, rate=0.03, n_classes=3, targets=(2, 0, 3), background_bins=40,
    mean_occurrences=1.3,
)  # fmt: skip

NEURONS: dict[str, Neuron] = {
    "V": GNM(),
    "D": GNM(readout="D", theta_r=0.3),
    "whole exponent": GNM(eta=0.5),
    "infinite exponent": GNM(eta=0.4, h=np.inf),
    "real exponent": GNM(eta=0.4, h=7.3, theta_b=0.6),
    "LIF": LIF(),
    "LIF refractory": LIF(refractory=5),
    "MST": MST(),
}
RULES: dict[str, Rule] = {
    "ALL": AggregateLabel(1e-3),
    "ET": ErrorTrace(1e-4),
    "ET modulated": ErrorTrace(1e-3, modulate=True),
}
DIGESTS = {
    "V": ("8ee255dfc24e9eeb", "ce78eff68ed35850", "1758428933bc7ae6"),
    "D": ("538bb3731180bef5", "1014af1d02323887", "63c3806845bca73f"),
    "whole exponent": ("06c5fbf7dbd0999d", "5fd1d7edcda9fb51", "b4a22c23cc656943"),
    "infinite exponent": ("0a32b6dda4f5bfa2", "691c74464dcaaf81", "3305c031b45b20d6"),
    "real exponent": ("eff6d42348b93793", "2f1f943b34ea29b7", "429f8ee8a0580fef"),
    "LIF": ("3a1ce25ca387ab8e", "64b545d6fb028099", "31b20abdacfd3c2f"),
    "LIF refractory": ("24cad416cb3bafd6", "2fdf866738213f6a", "bb4798cc2921db2a"),
    "MST": ("035392a5990c5b00", "6313064246e07117", "ff1845bfe53988ba"),
}
QUICK = {("V", "ALL"), ("D", "ET"), ("whole exponent", "ALL"), ("LIF", "ET modulated")}
SLOW = {("infinite exponent", "ALL"), ("real exponent", "ET"), ("MST", "ET modulated")}
"""With the quick ones every kind of neuron and every rule; the exhaustive tests take every pair."""


def marks(neuron: str, rule: str) -> Any:
    if (neuron, rule) in QUICK:
        return ()
    return pytest.mark.slow if (neuron, rule) in SLOW else EXHAUSTIVE


CELLS = [
    pytest.param(neuron, rule, digest, marks=marks(neuron, rule))
    for neuron, digests in DIGESTS.items()
    for rule, digest in zip(RULES, digests, strict=True)
]


@pytest.mark.parametrize(("neuron", "rule", "digest"), CELLS)
def test_nine_side_by_side_end_with_the_bits_that_they_have_always_had(
    neuron: str, rule: str, digest: str
) -> None:
    agents = [
        NeuronAgent(
            NEURONS[neuron], RULES[rule], TASK.n_inputs, seed, 0.3, None if seed % 2 else (0.0, 1.0)
        )
        for seed in range(9)
    ]
    train_many(agents, TASK, Patterns.draw(TASK, 3), trials=400, seed=5, threads=1)
    weights = np.array([agent.weights for agent in agents])
    velocity = np.array([agent.velocity for agent in agents])
    assert hashlib.sha256(weights.tobytes() + velocity.tobytes()).hexdigest()[:16] == digest
