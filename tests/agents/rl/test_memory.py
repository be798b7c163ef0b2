"""Policies with a memory: the sums and gradients of the integrators, resets, files, learning."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

import torch
from sb3_contrib.common.recurrent.policies import RecurrentActorCriticPolicy

from agents import noisy_performance
from agents.rl import SB3Agent, load, make_rl_agent, save, training_env
from agents.rl.memory import LeakyIntegrators, LeakySum
from gnm_env import Patterns, Task

TASK = Task()
PATTERNS = Patterns.draw(TASK, 1)
KINDS = ("recurrent-ppo", "leaky-ppo")
each_kind = pytest.mark.parametrize("kind", KINDS)


def test_a_leaky_sum_is_its_definition() -> None:
    torch.manual_seed(0)
    drive, before, kept = torch.randn(7, 3, 4), torch.randn(3, 4), torch.rand(4)
    sums = LeakySum.apply(drive, before, kept)
    now = before
    for t in range(7):
        now = kept * now + drive[t]
        torch.testing.assert_close(sums[t], now)


def test_the_gradient_of_a_leaky_sum_is_that_of_finite_differences() -> None:
    torch.manual_seed(0)
    shapes = ((5, 3, 4), (3, 4), (4,))
    inputs = [torch.rand(*shape, dtype=torch.double, requires_grad=True) for shape in shapes]
    assert torch.autograd.gradcheck(LeakySum.apply, inputs)


def test_integrators_begin_with_the_time_constants_that_are_asked_for() -> None:
    kept = torch.sigmoid(LeakyIntegrators(10, 5, (0.5, 0.99), 1.0).logit)
    assert kept[0].item() == pytest.approx(0.5, rel=1e-5)
    assert kept[-1].item() == pytest.approx(0.99, rel=1e-5)
    constants = -1.0 / torch.log(kept)
    torch.testing.assert_close(
        constants[1:] / constants[:-1], (constants[1] / constants[0]).repeat(4), rtol=1e-4, atol=0.0
    )


@each_kind
def test_a_sequence_at_once_is_what_sb3_computes_bin_by_bin(kind: str) -> None:
    model = make_rl_agent(kind, training_env(TASK, PATTERNS, kind, n_envs=2))
    policy = model.policy
    torch.manual_seed(0)
    bits = (torch.rand(3 * 20, 101) < 0.05).float()
    size = policy.lstm_actor.hidden_size
    states = (torch.randn(1, 3, size), torch.randn(1, 3, size))
    starts = torch.zeros(3, 20)
    starts[0, 0] = starts[2, 0] = 1.0
    for within in (False, True):
        starts[1, 7] = float(within)
        arguments = (bits, states, starts.flatten(), policy.lstm_actor)
        ours, after = policy._process_sequence(*arguments)
        theirs, after_theirs = RecurrentActorCriticPolicy._process_sequence(*arguments)
        torch.testing.assert_close(ours, theirs)
        torch.testing.assert_close(after[0], after_theirs[0])


@each_kind
def test_a_fresh_policy_is_near_silence_and_hears_its_inputs(kind: str) -> None:
    env = training_env(TASK, PATTERNS, kind, n_envs=64)
    policy = make_rl_agent(kind, env).policy
    size = policy.lstm_actor.hidden_size
    states = (torch.zeros(1, 64, size), torch.zeros(1, 64, size))
    bits, starts = torch.as_tensor(env.reset()), torch.zeros(64)
    answers, _ = policy.get_distribution(bits, states, starts)
    assert answers.distribution.probs[:, 1].mean().item() == pytest.approx(0.01, rel=0.3)
    outputs, _ = policy._process_sequence(bits, states, starts, policy.lstm_actor)
    silent, _ = policy._process_sequence(bits * 0, states, starts, policy.lstm_actor)
    heard = bits.any(1)
    assert (outputs - silent).abs()[heard].mean() > 0.2  # of outputs within −1 … 1
    assert torch.equal(outputs[~heard], silent[~heard])


@pytest.mark.parametrize("kind", (*KINDS, "gnm-ppo", "spiking-ppo"))
def test_a_saved_policy_answers_as_before(kind: str, tmp_path: Path) -> None:
    model = make_rl_agent(
        kind, training_env(TASK, PATTERNS, kind, n_envs=4), n_steps=32, batch_size=64
    )
    model.learn(256)
    save(tmp_path, model, kind, TASK, PATTERNS)
    agent, task, patterns = load(tmp_path)
    scores = [
        noisy_performance(one, task, patterns, runs=5, cap=400, seed=3)
        for one in (SB3Agent(model, TASK), agent)
    ]
    np.testing.assert_array_equal(*scores)


@each_kind
def test_both_weights_and_memory_are_trained(kind: str) -> None:
    env = training_env(TASK, PATTERNS, kind, feedback="dense", n_envs=16)
    model = make_rl_agent(kind, env, n_steps=128, batch_size=512, spike_probability=0.1)
    before = {name: p.detach().clone() for name, p in model.policy.named_parameters()}
    model.learn(2 * 16 * 128)  # the last of which teaches nothing: the rate is 0 by then
    still = [n for n, p in model.policy.named_parameters() if torch.equal(p, before[n])]
    assert still == []


@pytest.mark.slow
@each_kind
def test_a_policy_with_a_memory_learns_one_class_from_raw_bits(kind: str) -> None:
    torch.set_num_threads(1)
    model = make_rl_agent(kind, training_env(TASK, PATTERNS, kind, feedback="dense"), seed=0)
    model.learn(1_200_000)
    agent = SB3Agent(model, TASK)
    assert noisy_performance(agent, TASK, PATTERNS, runs=50, seed=500).mean() > 4_000
