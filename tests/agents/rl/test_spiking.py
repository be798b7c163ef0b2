"""Policies made of GNMs: potentials and spikes are the neuron's, and so is what the policy does."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

import torch

from agents import GNM, AggregateLabel, NeuronAgent, noisy_performance, record
from agents.rl import SB3Agent, make_rl_agent, training_env
from agents.rl.spiking import NeuronLayer, Spike
from gnm_env import Patterns, Task, Trials

TASK = Task()
PATTERNS = Patterns.draw(TASK, 1)


def small(kind: str, **settings: Any) -> Any:
    env = training_env(TASK, PATTERNS, kind, feedback="dense", n_envs=16)
    return make_rl_agent(kind, env, n_steps=64, batch_size=256, **settings)


def test_potentials_and_spikes_are_those_of_the_neurons() -> None:
    torch.manual_seed(0)
    layer = NeuronLayer(TASK.n_inputs, 3, 0.2, 0.4, spikes=True)
    trial = Trials.draw(TASK, PATTERNS, 1, seed=4)[0]
    bits = torch.as_tensor(trial.dense(), dtype=torch.float32)[:, None]
    outputs, _ = layer(bits, (torch.zeros(1, 1, 6), torch.zeros(1, 1, 6)))
    for k, weights in enumerate(layer.weight.detach().double().numpy()):
        agent = NeuronAgent(
            GNM(alpha=0.2), AggregateLabel(), n_inputs=TASK.n_inputs, weight_bounds=None
        )
        agent.weights[:] = weights
        course = record(agent, trial)
        assert course.spikes.any()
        np.testing.assert_allclose(outputs[:, 0, k].detach(), course.V, atol=1e-5)
        np.testing.assert_array_equal(outputs[:, 0, 3 + k].detach() > 0, course.spikes)


def test_two_halves_are_the_whole() -> None:
    torch.manual_seed(0)
    layer = NeuronLayer(5, 2, 0.3, 1.0, spikes=True)
    bits = (torch.rand(20, 3, 5) < 0.3).float()
    begin = (torch.zeros(1, 3, 4), torch.zeros(1, 3, 4))
    whole, last = layer(bits, begin)
    first, between = layer(bits[:9], begin)
    second, after = layer(bits[9:], between)
    torch.testing.assert_close(torch.cat([first, second]), whole)
    torch.testing.assert_close(after[0], last[0])


def test_the_derivative_of_a_spike_is_a_triangle_where_the_potential_was_below() -> None:
    V = torch.tensor([0.5, 1.0, 1.25, 2.5, 1.25], requires_grad=True)
    before = torch.tensor([0.0, 0.0, 0.0, 0.0, 1.5])
    z = Spike.apply(V, before)
    assert z.tolist() == [0, 1, 1, 1, 0]
    z.sum().backward()
    assert V.grad is not None and V.grad.tolist() == [0.5, 1.0, 0.75, 0.0, 0.0]


def test_without_chance_the_policy_is_the_neuron() -> None:
    model = small("gnm-ppo")
    with torch.no_grad():
        model.policy.lstm_actor.weight.mul_(3.0)  # lively
    neuron = model.policy.neuron_agent()
    assert neuron.neuron == GNM(alpha=0.3)
    scores = [
        noisy_performance(agent, TASK, PATTERNS, runs=20, cap=500, seed=3)
        for agent in (SB3Agent(model, TASK), neuron)
    ]
    np.testing.assert_array_equal(*scores)
    assert len(set(scores[0].tolist())) > 5


def test_the_neuron_learns_by_its_weights_and_nothing_else() -> None:
    model = small("gnm-ppo")
    before = {name: p.detach().clone() for name, p in model.policy.named_parameters()}
    model.learn(2 * 16 * 64)
    changed = {n for n, p in model.policy.named_parameters() if not torch.equal(p, before[n])}
    assert {n for n in changed if not n.startswith("value_net")} == {"lstm_actor.weight"}
    moved = model.policy.lstm_actor.weight - before["lstm_actor.weight"]
    # A channel with hardly a spike in these few bins teaches nothing.
    assert moved.shape == (1, TASK.n_inputs) and (moved != 0).float().mean() > 0.85


def test_every_weight_of_a_layer_is_trained() -> None:
    model = small("spiking-ppo", spike_probability=0.1)
    before = model.policy.lstm_actor.weight.detach().clone()
    model.learn(2 * 16 * 64)
    moved = model.policy.lstm_actor.weight != before
    assert moved.float().mean() > 0.85 and bool(moved.any(dim=1).all())
