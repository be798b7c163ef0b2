"""Every rule beside a second opinion: one learning step, on every kind of neuron.

`teach` of a rule is plain Python as well, so it is held against the second opinion on every neuron;
compiled and in an agent, on some neurons quickly and on the others in the slow tests.
"""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2

from agents import GNM, NeuronAgent, PolicyGradient, learning, record
from agents.learning.teaching import HeardTrial
from gnm_env import Task, Trial
from tests.agents.learning.oracles import rules, trials
from tests.agents.learning.oracles.neurons import hear
from tests.agents.learning.oracles.rules import act
from tests.agents.learning.oracles.trials import Case
from tests.agents.learning.table import (
    LAMBDA,
    NEURONS,
    RULES,
    agent_for,
    cases,
    neuron_of,
    trial_for,
)
from tests.agents.worlds import play
from tests.marks import EXHAUSTIVE

CLOSE: dict[str, float] = {"rtol": 1e-11, "atol": 1e-13}

WHOLE_TRIAL = [name for name, entry in RULES.items() if type(entry.rule).teach is not None]

QUICK = {
    "critical": ("gnm", "mst"),
    "critical-amount": ("lif", "mst"),
    "mpdal": ("gnm_reads_D",),
    "tempotron": ("mst",),
    "peak-error": ("gnm_recovers",),
    "peak-error-first": ("lif_pauses",),
    "surrogate": ("gnm",),
    "surrogate-triangle": ("gnm_reads_D",),
    "surrogate-count": ("mst",),
    "resume-even": ("lif",),
    "chronotron-i": ("mst",),
}
"""Neurons that the quick tests take with each rule."""


SLOW = {
    "critical": "mst_slow",
    "critical-amount": "mst_slow",
    "mpdal": "gnm_reads_D",
    "tempotron": "mst_slow",
    "peak-error": "lif",
    "peak-error-first": "lif",
    "surrogate": "gnm_reads_D",
    "surrogate-triangle": "gnm",
    "surrogate-count": "gnm_reads_D",
    "resume": "lif",
    "resume-even": "lif_pauses",
    "psd": "gnm_recovers",
    "psd-even": "gnm_recovers",
    "span": "lif_pauses",
    "span-even": "lif",
    "chronotron": "mst_slow",
    "chronotron-even": "mst",
    "chronotron-i": "mst_slow",
    "stdp": "gnm_recovers",
    "mstdpet": "gnm_forgets",
}
"""One neuron more with each rule, mostly of a kind for which the rule is compiled elsewhere; the
exhaustive tests take all."""


def marks(rule: str, neuron: str) -> Any:
    if neuron in QUICK.get(rule, ("gnm",)):
        return ()
    return pytest.mark.slow if SLOW[rule] == neuron else EXHAUSTIVE


def cells() -> list[Any]:
    return [
        pytest.param(rule, neuron, id=f"{rule}-{neuron}", marks=marks(rule, neuron))
        for rule in RULES
        for neuron in NEURONS
    ]


def heard_by(case: Case, rule: Any) -> HeardTrial:
    """What the whole-trial rule is handed, made by the second opinion."""
    heard, trial = hear(case.neuron, case.trial.raster, case.weights), case.trial
    output, label = float(heard.spikes.sum()), float(trial.label)
    edges, target = np.array(trial.edges), np.array(trial.target)
    counts = np.array(rules.counts(trial, heard), np.float64)
    if rule.feedback != "presentations":
        edges, target, counts = np.array([0, trial.n_bins]), np.array([0]), np.array([output])
    told = {"sign": np.sign(label - output), "label": label - output, "presentations": 1.0}
    channels = np.nonzero(trial.raster)[1].astype(np.int32)
    offsets = np.concatenate([[0], trial.raster.sum(axis=1).cumsum()])
    kernel = rule.kernel(neuron_of(case.neuron))
    again: Any = None
    return HeardTrial(
        heard.V, heard.X, heard.spikes.astype(np.float64), channels, offsets, edges, target, counts,
        float(told[rule.feedback]), case.neuron.threshold, case.neuron.lag,
        kernel.slow, kernel.fast, kernel.scale, np.zeros(1), again,
    )  # fmt: skip


@pytest.mark.parametrize("neuron", NEURONS)
@pytest.mark.parametrize("name", WHOLE_TRIAL)
def test_a_rule_teaches_in_the_bins_of_the_second_opinion(name: str, neuron: str) -> None:
    rule, oracle = RULES[name].rule, RULES[name].oracle
    numbers = rule.parameters_type(*rule.own_numbers(neuron_of(NEURONS[neuron])))
    taught = 0
    for case in cases(name, neuron, n=60):
        heard = heard_by(case, rule)
        y = np.zeros(len(heard.V))
        if heard.error != 0.0:
            type(rule).teach(numbers, heard, y)
        lesson = oracle(case.trial, case.neuron, case.weights)
        np.testing.assert_allclose(y, lesson.y, **CLOSE)
        taught += lesson.teaches
    assert taught >= 20


@pytest.mark.parametrize("neuron", ["gnm", pytest.param("gnm_recovers", marks=pytest.mark.slow)])
def test_the_policy_gradient_draws_and_learns_as_the_second_opinion_does(neuron: str) -> None:
    """Trial after trial, so that the baseline and the agent's generator move on."""
    rule = PolicyGradient(learning_rate=0.02, width=0.2, baseline_rate=0.3)
    made = trials.cases(NEURONS[neuron], n=30, seed=1)
    agent = agent_for(made[0], rule, seed=7)
    rng, baseline, taught = np.random.default_rng((7, 3)), None, 0
    weights, velocity = agent.weights.copy(), agent.velocity.copy()
    for case in made:
        policy = rules.policy_gradient(
            case.trial, NEURONS[neuron], weights, rng.random, 0.02, 0.2, baseline, 0.3
        )
        spikes = play(agent, trial_for(case))
        assert np.array_equal(spikes, policy.spikes)
        weights, velocity = act(policy.lesson, weights, velocity)
        baseline = policy.baseline
        np.testing.assert_allclose(agent.rule_memory, [baseline, 1.0], **CLOSE)
        np.testing.assert_allclose(agent.velocity, velocity, **CLOSE)
        agent.weights, agent.velocity = weights, velocity
        taught += policy.lesson.teaches
    assert taught >= 20


def test_spikes_of_the_policy_gradient_are_independent_draws_in_each_bin() -> None:
    """χ² of each bin's share beside P, and of neighbouring pairs beside P(t)P(t + 1)."""
    neuron, rule, n = NEURONS["gnm"], PolicyGradient(learning_rate=0.0, width=0.5), 4_000
    case = trials.cases(neuron, n=1, seed=3)[0]
    agent = agent_for(case, rule, seed=11)
    trial = trial_for(case)
    z = np.array([play(agent, trial) for _ in range(n)], np.float64)
    P = rules.policy_gradient(case.trial, neuron, case.weights, lambda: 0.5, width=0.5).probability
    assert P.max() > 0.3
    alone = (z.mean(axis=0) - P) / np.sqrt(P * (1.0 - P) / n)
    P2 = P[:-1] * P[1:]
    paired = ((z[:, :-1] * z[:, 1:]).mean(axis=0) - P2) / np.sqrt(P2 * (1.0 - P2) / n)
    for deviations in (alone, paired):
        # Of a false alarm: 1 in 1,000, and the seed is fixed.
        assert np.sum(deviations**2) < chi2.ppf(0.999, len(deviations))


@pytest.mark.parametrize(("name", "neuron"), cells())
def test_a_learning_step_is_that_of_the_second_opinion(name: str, neuron: str) -> None:
    rule, oracle = RULES[name].rule, RULES[name].oracle
    taught = 0
    for case in cases(name, neuron, n=40, seed=1):
        agent = agent_for(case, rule)
        before = agent.velocity.copy()
        play(agent, trial_for(case))
        lesson = oracle(case.trial, case.neuron, case.weights)
        weights, velocity = act(lesson, case.weights, before)
        np.testing.assert_allclose(agent.velocity, velocity, **CLOSE)
        np.testing.assert_allclose(agent.weights, weights, **CLOSE)
        taught += lesson.teaches
    assert taught >= 10


# The trial of ten bins of test_oracles.py, worked out there by hand: GNM, α = ½, V = .5, .5, .25,
# .125, .5625, .53125, .265625, 1.3828125, .69140625, .595703125; its only spike is in bin 7.
X0, X4 = np.array([1.0, 0.0, 0.0, 0.0]), np.array([1.0625, 0.125, 0.0, 0.0])
X7 = np.array([0.1328125, 0.265625, 1.0, 0.0])
X1 = np.array([0.5, 1.0, 0.0, 0.0])
A, B = 4 / 49, 16 / 361

GOLDEN: list[tuple[Any, tuple[int, int], Any]] = [
    (learning.CriticalThreshold(1.0), (1, 1), X4),
    (learning.CriticalThreshold(1.0), (0, 0), -X7),
    (learning.CriticalThreshold(1.0, amount=True), (1, 3), X0 + X4),
    (learning.MPDAL(1.0), (1, 1), X4),
    (learning.Tempotron(1.0), (0, 0), -X7),
    (learning.PeakError(1.0), (1, 0), X0 - X7),
    (learning.PeakError(1.0, first_only=True), (1, 0), X0),
    (learning.SurrogateGradient(1.0), (1, 1), [A + A / 2 + B / 4, A + B / 2, 0.0, 0.0]),
    (learning.ReSuMe(1.0, times="even", a=0.25), (1, 1), X1 + 0.25),
    (learning.Chronotron(1.0, rule="I"), (1, 0), np.array([0.5, 0.25, 1.25, 9.0]) * (X0 - X7)),
    (
        learning.STDP(momentum=0.0),
        (1, 1),
        0.03125
        * np.array(
            [
                math.exp(-3 / 16.8),
                math.exp(-2 / 16.8) - 0.85 * math.exp(-2 / 33.7),
                1.0,
                0.0,
            ]
        ),
    ),
]


@pytest.mark.parametrize(("rule", "owed", "change"), GOLDEN)
def test_what_a_trial_of_ten_bins_teaches_is_as_by_hand(
    rule: Any, owed: tuple[int, int], change: Any
) -> None:
    raster = np.zeros((10, 4), np.bool_)
    for channel, bins in enumerate([[0, 4], [1, 5, 9], [7]]):
        raster[bins, channel] = True
    task = Task(n_inputs=4, pattern_bins=3, n_classes=2, targets=owed)
    agent = NeuronAgent(GNM(alpha=0.5), rule, 4, weight_bounds=None)
    agent.weights = [0.5, 0.25, 1.25, -9.0]
    spikes = play(agent, Trial.from_dense(raster, [0, 6], [0, 1], task))
    assert np.flatnonzero(spikes).tolist() == [7]
    np.testing.assert_allclose(agent.velocity, change, rtol=1e-13, atol=1e-16)


@pytest.mark.parametrize(
    ("name", "neuron"),
    [
        ("critical", "gnm"),
        ("critical-amount", "mst"),
        *(
            pytest.param(name, neuron, marks=EXHAUSTIVE if k % 5 else pytest.mark.slow)
            for k, (name, neuron) in enumerate(
                itertools.product(
                    ("critical", "critical-amount", "mpdal"),
                    ("lif", "gnm", "gnm_forgets", "mst", "mst_slow"),
                )
            )
            if (name, neuron) not in (("critical", "gnm"), ("critical-amount", "mst"))
        ),
    ],
)
def test_learning_moves_the_count_the_right_way_on_the_very_trial(name: str, neuron: str) -> None:
    """The lesson is repeated with ever larger steps until the count moves: where it first does.

    Other peaks rise and fall with the chosen one, so a trial may disagree; few do.
    """
    right = wrong = 0
    for case in cases(name, neuron, n=40, seed=10):
        agent, trial = agent_for(case, RULES[name].rule), trial_for(case)
        agent.velocity = 0.0
        before = int(play(agent, trial).sum())
        lesson = agent.velocity / LAMBDA
        for size in np.geomspace(1e-4, 3.0, 60) if lesson.any() else ():
            agent.weights = case.weights + size * lesson
            after = int(record(agent, trial).spikes.sum())
            if after != before:
                toward = (after - before) * (trial.label - before) > 0
                right, wrong = right + toward, wrong + (not toward)
                break
    assert right > 5 and right > 3 * wrong, (right, wrong)
