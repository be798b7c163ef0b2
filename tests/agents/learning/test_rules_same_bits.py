"""Every rule in the standard loop, alone, side by side, over threads, in pieces: the same bits.

And that no rule sees more of a trial than its feedback says.
"""

from __future__ import annotations

import pickle
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import gnm_env
from agents import (
    GNM,
    LIF,
    MST,
    NeuronAgent,
    PolicyGradient,
    load_checkpoint,
    train,
    train_many,
)
from agents.learning.rule import Rule
from agents.training.source import Source, source_of
from gnm_env import Patterns, Task, Trials, draw_trial
from tests.agents.learning.table import RULES
from tests.agents.worlds import BUSY, BUSY_PATTERNS, play, trial_env
from tests.marks import EXHAUSTIVE

TRIALS = 120

MADE: dict[str, Rule] = {name: entry.rule for name, entry in RULES.items()}
MADE["policy-gradient"] = PolicyGradient(learning_rate=0.01, width=0.2)

NEURONS: dict[str, Any] = {
    "gnm": lambda a: GNM(alpha=a),
    "gnm-h200": lambda a: GNM(alpha=a, eta=0.25 + a),
    "gnm-d": lambda a: GNM(alpha=0.2 + a, readout="D", theta_r=0.4),
    "lif": lambda a: LIF(alpha=a, refractory=round(10 * a) - 1),
    "mst": lambda a: MST(tau_m=10.0 + 20 * a),
}
"""Neurons of one kind, by a number that varies from lane to lane."""

START = {"gnm": 0.6, "lif": 0.9, "mst": 0.2}

QUICK = {
    ("critical", "gnm"),
    ("critical-amount", "mst"),
    ("peak-error", "lif"),
    ("surrogate", "gnm-d"),
    ("resume-even", "gnm"),
    ("stdp", "gnm"),
    ("mstdpet", "gnm"),
    ("policy-gradient", "gnm"),
}


SLOW = {
    "mpdal": "gnm-d",
    "tempotron": "mst",
    "peak-error-first": "lif",
    "surrogate-triangle": "gnm-d",
    "surrogate-count": "mst",
    "resume": "lif",
    "psd": "gnm-h200",
    "span": "lif",
    "chronotron": "gnm",
    "chronotron-i": "gnm-h200",
}
"""The neuron on which the slow tests take a rule that the quick ones leave out; the exhaustive
tests take all."""


def marks(rule: str, neuron: str) -> Any:
    if (rule, neuron) in QUICK:
        return ()
    return pytest.mark.slow if SLOW.get(rule) == neuron else EXHAUSTIVE


def cells() -> list[Any]:
    """One test parameter per rule and neuron."""
    return [
        pytest.param(rule, neuron, id=f"{rule}-{neuron}", marks=marks(rule, neuron))
        for rule in MADE
        for neuron in NEURONS
        if rule != "policy-gradient" or neuron in ("gnm", "gnm-h200")
    ]


@cache
def binary_trials() -> Trials:
    """Trials with one presentation of a pattern or none."""
    task = Task(n_inputs=12, pattern_bins=8, rate=0.1, background_bins=30, mean_occurrences=0.7)
    patterns, rng = Patterns.draw(task, seed=0), np.random.default_rng(1)
    drawn = (draw_trial(task, patterns, rng) for _ in range(100))
    return Trials([trial for trial in drawn if trial.label <= 1])


def source(rule: str) -> Source:
    return source_of(binary_trials()) if MADE[rule].binary else source_of(BUSY, BUSY_PATTERNS)


def env_of(rule: str, **keywords: Any) -> gym.Env[Any, Any]:
    if not MADE[rule].binary:
        return trial_env(**keywords)
    return gym.make("gnm/PatternTrial-v0", trials=binary_trials(), **keywords)


def agent_of(rule: str, neuron: str, lane: int = 0) -> NeuronAgent:
    """Agents of different lanes differ in weights, neuron and rule."""
    a = 0.1 + 0.4 * (lane * 0.618 % 1.0)
    made = NEURONS[neuron](a)
    learns = replace(MADE[rule], learning_rate=MADE[rule].learning_rate * (0.3 + a), momentum=a)
    weight = START[made.name] * (0.6 + a)
    return NeuronAgent(made, learns, 12, lane, weight, None if lane % 2 else (-0.5, 0.5 + a))


@cache
def alone(rule: str, neuron: str, lane: int = 0) -> NeuronAgent:
    agent = agent_of(rule, neuron, lane)
    train_many([agent], source(rule), None, TRIALS, seed=9)
    return agent


def assert_same(one: NeuronAgent, other: NeuronAgent) -> None:
    assert one.weights.tobytes() == other.weights.tobytes()
    assert one.velocity.tobytes() == other.velocity.tobytes()
    assert one.rule_memory.tobytes() == other.rule_memory.tobytes()
    assert one.overflowed == other.overflowed
    assert (one.rng is None) == (other.rng is None)
    if one.rng is not None and other.rng is not None:
        assert one.rng.bit_generator.state == other.rng.bit_generator.state


@pytest.mark.parametrize(("rule", "neuron"), cells())
def test_the_loop_and_train_many_end_with_the_same_bits(rule: str, neuron: str) -> None:
    looped = agent_of(rule, neuron)
    before = looped.weights.copy()
    train(looped, env_of(rule), TRIALS, seed=9)
    assert not np.array_equal(looped.weights, before)
    assert_same(looped, alone(rule, neuron))


@pytest.mark.parametrize(("rule", "neuron"), cells())
def test_side_by_side_each_ends_with_the_bits_that_it_has_alone(rule: str, neuron: str) -> None:
    agents = [agent_of(rule, neuron, lane) for lane in range(7)]
    train_many(agents, source(rule), None, TRIALS, seed=9, threads=1)
    for lane, agent in enumerate(agents):
        assert_same(agent, alone(rule, neuron, lane))


@pytest.mark.parametrize(
    ("rule", "neuron"),
    [
        ("critical", "gnm"),
        *(pytest.param(*cell.values, marks=EXHAUSTIVE) for cell in cells()[1:]),
    ],
)
def test_over_threads_and_in_blocks_of_lanes_too(rule: str, neuron: str) -> None:
    agents = [agent_of(rule, neuron, lane) for lane in range(70)]
    train_many(agents, source(rule), None, TRIALS, seed=9, threads=2)
    for lane in (0, 31, 32, 69):
        assert_same(agents[lane], alone(rule, neuron, lane))


@pytest.mark.parametrize(
    ("rule", "neuron"), [("critical", "gnm"), ("policy-gradient", "gnm"), ("stdp", "gnm")]
)
def test_in_pieces_from_checkpoints_and_pickles(rule: str, neuron: str, tmp_path: Path) -> None:
    rng = np.random.default_rng(9)
    agent = agent_of(rule, neuron)
    train_many([agent], source(rule), None, 50, seed=rng)
    agent.save(tmp_path / "half", rng=rng)
    loaded = load_checkpoint(tmp_path / "half")
    assert_same(loaded.agent, agent)
    agent = pickle.loads(pickle.dumps(loaded.agent))
    train(agent, env_of(rule), 30, loaded.rng)
    train_many([agent], source(rule), None, TRIALS - 80, seed=loaded.rng)
    assert_same(agent, alone(rule, neuron))


# --- feedback ------------------------------------------------------------------------------------


class Telling:
    """An environment whose terminal info is made over by `alter`."""

    def __init__(self, env: gym.Env[Any, Any], alter: Any) -> None:
        self.unwrapped, self.reset, self._env, self._alter = env.unwrapped, env.reset, env, alter

    def step(self, action: int) -> Any:
        obs, reward, terminated, truncated, info = self._env.step(action)
        if terminated:
            reward, info = self._alter(reward, info)
        return obs, reward, terminated, truncated, info


def without_places(reward: float, info: dict[str, Any]) -> Any:
    """The label alone: where the presentations were is a lie."""
    lie = {"onsets": [0], "classes": [0], "targets": [0], "pattern_bins": 1}
    return reward, {**info, **lie}


def reward_alone(reward: float, info: dict[str, Any]) -> Any:
    return reward, {"label": 12_345, "emitted": info["emitted"]}


def loop_with(rule: str, env: Any) -> NeuronAgent:
    agent = agent_of(rule, "gnm")
    train(agent, env, TRIALS, seed=9)
    return agent


@pytest.mark.parametrize("rule", ["critical", "mpdal"])
def test_the_sign_alone_trains_a_rule_of_class_A_to_the_same_bits(rule: str) -> None:
    told = loop_with(rule, env_of(rule))
    signed = Telling(
        env_of(rule, feedback="sign"), lambda r, info: (r, {"label": 0, "emitted": info["emitted"]})
    )
    assert_same(loop_with(rule, signed), told)


@pytest.mark.parametrize("rule", ["critical-amount", "surrogate-count"])
def test_the_label_alone_trains_a_rule_of_class_A_prime_to_the_same_bits(rule: str) -> None:
    assert_same(
        loop_with(rule, Telling(env_of(rule), without_places)), loop_with(rule, env_of(rule))
    )


@pytest.mark.parametrize("rule", ["mstdpet", "policy-gradient"])
def test_the_reward_alone_trains_a_rule_that_asks_for_it_to_the_same_bits(rule: str) -> None:
    assert_same(loop_with(rule, Telling(env_of(rule), reward_alone)), loop_with(rule, env_of(rule)))


def test_nothing_at_all_trains_STDP_to_the_same_bits() -> None:
    silent = Telling(
        env_of("stdp"), lambda r, info: (0.0, {"label": 0, "emitted": info["emitted"]})
    )
    assert_same(loop_with("stdp", silent), loop_with("stdp", env_of("stdp")))


def test_the_class_of_a_presentation_is_not_looked_at() -> None:
    def scrambled(reward: float, info: dict[str, Any]) -> Any:
        return reward, {**info, "classes": [9] * len(info["classes"])}

    told = loop_with("peak-error", env_of("peak-error"))
    assert_same(loop_with("peak-error", Telling(env_of("peak-error"), scrambled)), told)


NEED_MORE_THAN_THE_SIGN = [
    name for name, rule in MADE.items() if rule.feedback not in ("sign", "none")
]


@pytest.mark.parametrize("rule", NEED_MORE_THAN_THE_SIGN)
def test_a_rule_that_needs_more_than_the_sign_says_so(rule: str) -> None:
    agent = agent_of(rule, "gnm")
    with pytest.raises(ValueError, match=r"tells the sign of the error only: use feedback="):
        train(agent, env_of(rule, feedback="sign"), 3, seed=0)


@pytest.mark.parametrize("rule", ["mstdpet", "policy-gradient"])
def test_a_reward_that_comes_on_the_way_is_refused(rule: str) -> None:
    with pytest.raises(ValueError, match=r'rewards on the way: use feedback="cost"'):
        train(agent_of(rule, "gnm"), env_of(rule, feedback="dense"), 3, seed=0)


def test_labels_without_places_are_refused_by_rules_that_need_places() -> None:
    trial = gnm_env.Trial.from_times([np.array([0.001])] * 12, n_bins=30, bin_width=0.001, label=1)
    for rule in ("peak-error", "resume", "surrogate"):
        with pytest.raises(ValueError, match="needs to know where the presentations were"):
            train_many([agent_of(rule, "gnm")], Trials([trial]), trials=1, seed=0)


def test_a_tempotron_refuses_labels_above_1_in_both_loops() -> None:
    agent = agent_of("tempotron", "gnm")
    with pytest.raises(ValueError, match="labelled 0 or 1, and of these some"):
        train_many([agent], BUSY, BUSY_PATTERNS, trials=1, seed=0)
    trial = next(
        trial
        for trial in (draw_trial(BUSY, BUSY_PATTERNS, np.random.default_rng(s)) for s in range(99))
        if trial.label > 1
    )
    with pytest.raises(ValueError, match="labelled 0 or 1, got label"):
        play(agent, trial)
