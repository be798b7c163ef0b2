"""A network learns at full size; what it comes back from, and what it does not."""

from __future__ import annotations

import time

import numpy as np
import pytest
from numpy.typing import NDArray

from agents import GNM, ErrorTrace, NeuronAgent, noisy_performance, train_many
from agents.network import BackPropagation, Network, NetworkAgent
from gnm_env import Patterns, Task
from tests.marks import timed

TRIALS = 60_000
HELD_OUT = 1_000_000
"""Seed of the streams for scoring, far from those of training."""

SILENCE = Task().silent_score


def world(n_classes: int, seed: int) -> tuple[Task, Patterns]:
    task = Task(n_classes=n_classes)
    return task, Patterns.draw(task, seed)


def score(agent: NetworkAgent, n_classes: int, seed: int, trials: int = TRIALS) -> float:
    """Mean noisy performance after training."""
    task, patterns = world(n_classes, seed)
    train_many([agent], task, patterns, trials, seed=seed)
    return float(noisy_performance(agent, task, patterns, 50, seed=HELD_OUT).mean())


def test_a_network_learns_one_pattern() -> None:
    assert score(NetworkAgent(), 1, 0, trials=15_000) > 10 * SILENCE
    assert score(NetworkAgent(), 1, 0, trials=0) < 2 * SILENCE


@pytest.mark.slow
def test_two_classes_are_learned_better_than_by_one_neuron_and_on_every_seed() -> None:
    """Every seed but two at most, by this test; what was measured stands in docs/network.md."""
    scores: list[NDArray[np.float64]] = []
    for seed in range(24):
        task, patterns = world(2, seed)
        agents = [
            NetworkAgent(seed=seed),
            NeuronAgent(GNM(), ErrorTrace(modulate=True), task.n_inputs, seed),
        ]
        train_many(agents, task, patterns, TRIALS, seed=1_000 * seed + 1)
        scores.append(
            noisy_performance(agents, task, patterns, seed=HELD_OUT + 1_000 * seed).mean(axis=1)
        )
    network, neuron = np.transpose(scores)
    assert network.mean() >= neuron.mean()
    assert np.sum(network <= SILENCE) <= 2


@timed
def test_sixty_thousand_trials_of_one_class_take_at_most_six_seconds_of_one_core() -> None:
    """Measured: 2.1 s."""
    task, patterns = world(1, 0)
    train_many([NetworkAgent()], task, patterns, 10, seed=0)  # compile
    began = time.process_time()
    train_many([NetworkAgent()], task, patterns, TRIALS, seed=0, threads=1)
    assert time.process_time() - began <= 6.0


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.parametrize("start", [0.02, 0.1, 1.0], ids="start {}".format)
@pytest.mark.parametrize("n_classes", [1, 2])
def test_it_comes_back_from_small_weights_and_from_saturation(
    n_classes: int, start: float, seed: int
) -> None:
    """Weights uniform on [0, start): from 1 on the readout is above threshold nearly for ever."""
    agent = NetworkAgent(seed=seed, initial_weight=start)
    assert score(agent, n_classes, seed) > 2 * SILENCE


@pytest.mark.slow
@pytest.mark.parametrize("n_classes", [1, 2])
def test_it_mostly_comes_back_from_far_above_saturation(n_classes: int) -> None:
    """Weights uniform on [0, 3): on two classes one of these seeds ends all but silent, at 180."""
    scores = [
        score(NetworkAgent(seed=seed, initial_weight=3.0), n_classes, seed) for seed in range(3)
    ]
    assert np.median(scores) > 20 * SILENCE
    assert min(scores) > SILENCE


@pytest.mark.slow
def test_lifting_bins_that_are_above_threshold_keeps_them_there_for_ever() -> None:
    """Why `lift_above` is off: saturated, two patterns pull up harder than noise pulls down."""
    agent = NetworkAgent(rule=BackPropagation(lift_above=True), initial_weight=3.0)
    assert score(agent, 2, 0) < SILENCE
    assert agent.output_weights.min() > 100.0


def test_equal_hidden_neurons_stay_equal() -> None:
    agent = NetworkAgent()
    agent.weights = 1.0
    score(agent, 1, 0, trials=2_000)
    W, u = agent.hidden_weights, agent.output_weights
    assert (W == W[:, :1]).all()
    assert (u == u[0]).all()
    assert not (W == 1.0).all()


@pytest.mark.parametrize("start", [0.0, -0.1], ids="weights {}".format)
def test_a_silent_hidden_layer_stays_silent(start: float) -> None:
    """Without any potential above 0 every slope of the Hill function is 0."""
    agent = NetworkAgent()
    agent.hidden_weights, agent.output_weights = start, 0.3
    assert 100 < score(agent, 1, 0, trials=2_000) < 200
    assert (agent.hidden_weights == start).all()
    assert (agent.output_weights == 0.3).all()


@pytest.mark.slow
def test_weights_so_small_that_the_slopes_vanish_do_not_grow_in_time() -> None:
    """H' falls with the third power of the potential."""
    agent = NetworkAgent(Network(), initial_weight=0.01)
    assert score(agent, 1, 0) < 2 * SILENCE
    assert agent.weights.max() < 0.02
