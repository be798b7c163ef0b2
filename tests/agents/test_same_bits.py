"""The standard loop, train_many alone, side by side, on threads, in pieces: one and the same bits.

Compiling every neuron × rule × width takes tens of minutes; the quick tests take each neuron, each
rule and each width at least once, the slow ones some pairs of a neuron and a rule more, and the
exhaustive ones all that is left.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from agents import (
    GNM,
    LIF,
    MST,
    AggregateLabel,
    ErrorTrace,
    History,
    NeuronAgent,
    load_checkpoint,
    train,
    train_many,
)
from agents.learning.rule import Rule
from agents.neurons.neuron import Neuron
from gnm_env import Patterns, Task
from tests.agents.worlds import BUSY, BUSY_PATTERNS, BUSY_WEIGHT, trial_env
from tests.marks import EXHAUSTIVE

TRIALS = 150
"""About 7,000 bins: compiled code draws them in more than one batch."""

RATE = 1e-3

NEURONS: dict[str, Callable[[float], Neuron]] = {
    "gnm": lambda a: GNM(alpha=a),
    "gnm-h200": lambda a: GNM(alpha=a, eta=0.25 + a),
    "gnm-step": lambda a: GNM(alpha=a, eta=0.2 + a, h=np.inf, beta=a / 2),
    "gnm-h7.3": lambda a: GNM(alpha=a, eta=0.4 + a, h=7.3, theta_b=0.5 + a),
    "gnm-d": lambda a: GNM(alpha=0.2 + a, readout="D", theta_r=0.4),
    "lif": lambda a: LIF(alpha=a, refractory=round(10 * a) - 1),
    "mst": lambda a: MST(tau_m=10.0 + 20 * a),
}
"""Neurons of one kind, by a number that varies from lane to lane."""

RULES: dict[str, Callable[[float], Rule]] = {
    "all": lambda a: AggregateLabel(3 * RATE * (0.5 + a), fraction=0.25),
    "et": lambda a: ErrorTrace(RATE * (0.5 + a), momentum=a),
    "et-modulated": lambda a: ErrorTrace(RATE * (0.5 + a), modulate=True),
}

CELLS = [(neuron, rule) for neuron in NEURONS for rule in RULES]

QUICK = {
    ("gnm", "all"): (1, 2, 7, 64),
    ("gnm", "et"): (1, 2, 7),
    ("gnm", "et-modulated"): (1, 2, 7),
    ("gnm-d", "all"): (1, 2, 7, 64),
    ("gnm-d", "et"): (1, 2, 7),
    ("gnm-d", "et-modulated"): (1, 2, 7),
    ("gnm-h200", "all"): (1, 2, 64),
    ("gnm-step", "et"): (1, 2),
    ("gnm-h7.3", "all"): (7,),
    ("lif", "et"): (1, 2, 64),
    ("lif", "et-modulated"): (1, 2, 64),
    ("mst", "all"): (1, 2, 7),
}
"""Numbers of lanes that the quick tests take; they share kernels with tests elsewhere."""

SLOW = {
    ("lif", "all"): 2,
    ("gnm-h7.3", "et"): 7,
    ("gnm-step", "all"): 64,
    ("mst", "et-modulated"): 64,
}
"""The number of lanes that the slow tests take for some pairs more; exhaustive ones take all."""


def marks(neuron: str, rule: str, lanes: int) -> Any:
    if lanes in QUICK.get((neuron, rule), ()):
        return ()
    return pytest.mark.slow if SLOW.get((neuron, rule)) == lanes else EXHAUSTIVE


def cells(lanes: tuple[int, ...]) -> list[Any]:
    """One test parameter per neuron, rule and number of lanes."""
    return [
        pytest.param(
            neuron,
            rule,
            n,
            id=f"{neuron}-{rule}-{n}",
            marks=marks(neuron, rule, n),
        )
        for neuron, rule in CELLS
        for n in lanes
    ]


def agent_of(neuron: str, rule: str, lane: int = 0) -> NeuronAgent:
    """Agents of different lanes differ in weights, neuron and rule."""
    a = 0.1 + 0.4 * (lane * 0.618 % 1.0)
    made = NEURONS[neuron](a)
    weight = BUSY_WEIGHT[made.name] * (0.6 + a)
    bounds = None if neuron == "gnm-d" else (0.0, 0.5 + a)
    return NeuronAgent(made, RULES[rule](a), BUSY.n_inputs, lane, weight, bounds)


def alone(neuron: str, rule: str, lane: int = 0, seed: int = 9) -> tuple[NeuronAgent, History]:
    agent = agent_of(neuron, rule, lane)
    history = train_many([agent], BUSY, BUSY_PATTERNS, TRIALS, seed=seed, block=40)
    return agent, history.of(0)


def assert_same(one: NeuronAgent, other: NeuronAgent) -> None:
    assert np.array_equal(one.weights, other.weights)
    assert np.array_equal(one.velocity, other.velocity)
    assert one.overflowed == other.overflowed


def assert_same_history(one: History, other: History) -> None:
    for name in ("trials", "error_rate", "mean_error", "overflowed"):
        assert np.array_equal(getattr(one, name), getattr(other, name)), name


@pytest.mark.parametrize(("neuron", "rule", "lanes"), cells((1,)))
def test_the_loop_and_train_many_end_with_the_same_bits(neuron: str, rule: str, lanes: int) -> None:
    looped, lane = agent_of(neuron, rule), agent_of(neuron, rule)
    before = looped.weights.copy()
    by_loop = train(looped, trial_env(), TRIALS, seed=9, block=40)
    by_lanes = train_many([lane], BUSY, BUSY_PATTERNS, TRIALS, seed=9, block=40)
    assert_same(looped, lane)
    assert_same_history(by_loop, by_lanes.of(0))
    assert by_loop.trials.tolist() == [40, 80, 120, 150]
    assert not np.array_equal(looped.weights, before)
    assert 0 < by_loop.error_rate.min() < 1 or by_loop.mean_error.std() > 0


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize(("neuron", "rule", "lanes"), cells((1, 2, 7, 64)))
def test_each_lane_ends_with_the_bits_that_it_ends_with_alone(
    neuron: str, rule: str, lanes: int, threads: int
) -> None:
    agents = [agent_of(neuron, rule, lane) for lane in range(lanes)]
    history = train_many(agents, BUSY, BUSY_PATTERNS, TRIALS, seed=9, threads=threads, block=40)
    for lane, agent in enumerate(agents):
        by_itself, its_history = alone(neuron, rule, lane)
        assert_same(agent, by_itself)
        assert_same_history(history.of(lane), its_history)
    assert len({agent.weights.tobytes() for agent in agents}) > lanes / 2, "too many have died"


@pytest.mark.parametrize("threads", [1, 2])
def test_agents_of_different_kinds_keep_their_places_and_their_bits(threads: int) -> None:
    mixed = [
        ("gnm", "all"),
        ("mst", "all"),
        ("gnm", "et"),
        ("gnm-d", "all"),
        ("gnm", "all"),
        ("gnm", "et-modulated"),
        ("lif", "et"),
        ("gnm", "et"),
        ("gnm-h200", "all"),
    ]
    agents = [agent_of(neuron, rule, lane) for lane, (neuron, rule) in enumerate(mixed)]
    history = train_many(agents, BUSY, BUSY_PATTERNS, TRIALS, seed=9, threads=threads, block=40)
    for lane, (neuron, rule) in enumerate(mixed):
        by_itself, its_history = alone(neuron, rule, lane)
        assert_same(agents[lane], by_itself)
        assert_same_history(history.of(lane), its_history)


# --- in pieces -----------------------------------------------------------------------------------


def loop_on(agent: NeuronAgent, trials: int, seed: Any) -> None:
    train(agent, trial_env(), trials, seed)


def lane_on(agent: NeuronAgent, trials: int, seed: Any) -> None:
    train_many([agent], BUSY, BUSY_PATTERNS, trials, seed)


QUICK_ALONE = [cell.values[:2] for cell in cells((1,)) if not cell.marks]


@pytest.mark.parametrize("go_on", [loop_on, lane_on])
@pytest.mark.parametrize("begin", [loop_on, lane_on])
@pytest.mark.parametrize(("neuron", "rule"), QUICK_ALONE)
def test_going_on_from_a_checkpoint_ends_where_one_uninterrupted_run_ends(
    neuron: str, rule: str, begin: Any, go_on: Any, tmp_path: Path
) -> None:
    rng = np.random.default_rng(9)
    first = agent_of(neuron, rule)
    begin(first, 60, rng)
    first.save(tmp_path / "half", task=BUSY, patterns=BUSY_PATTERNS, rng=rng)
    loaded = load_checkpoint(tmp_path / "half")
    go_on(loaded.agent, TRIALS - 60, loaded.rng)
    uninterrupted, _ = alone(neuron, rule)
    assert_same(loaded.agent, uninterrupted)


def test_going_on_with_the_environments_own_generator_is_one_run() -> None:
    agent, env = agent_of("gnm", "all"), trial_env()
    train(agent, env, 60, seed=9)
    train(agent, env, TRIALS - 60)
    assert_same(agent, alone("gnm", "all")[0])


@pytest.mark.parametrize("run", [loop_on, lane_on])
def test_a_seed_and_the_generator_of_that_seed_are_the_same(run: Any) -> None:
    agent = agent_of("gnm", "all")
    run(agent, TRIALS, np.random.default_rng(9))
    assert_same(agent, alone("gnm", "all")[0])


@pytest.mark.parametrize("run", [loop_on, lane_on])
def test_a_generator_is_left_where_its_last_trial_ended(run: Any) -> None:
    """Both loops leave it at the same place, whatever was drawn ahead in between."""
    one, other = np.random.default_rng(9), np.random.default_rng(9)
    run(agent_of("gnm", "all"), 77, one)
    loop_on(agent_of("gnm", "et"), 77, other)
    assert one.bit_generator.state == other.bit_generator.state


@pytest.mark.parametrize("block", [1, 7, 1_000])
def test_the_size_of_a_block_changes_nothing_but_the_history(block: int) -> None:
    agents = [agent_of("gnm", "all", lane) for lane in range(7)]
    history = train_many(agents, BUSY, BUSY_PATTERNS, TRIALS, seed=9, block=block)
    for lane, agent in enumerate(agents):
        assert_same(agent, alone("gnm", "all", lane)[0])
    assert len(history) == -(-TRIALS // block)
    sizes = np.diff(np.append(0, history.trials))
    wrong = (history.error_rate * sizes[:, None]).sum(axis=0)
    by_forty = alone("gnm", "all")[1]
    assert wrong[0] == pytest.approx((by_forty.error_rate * [40, 40, 40, 30]).sum())


@pytest.mark.parametrize(
    "task",
    [
        Task(n_inputs=12, rate=0.1, background_bins=1, pattern_bins=1, mean_occurrences=0.3),
        Task(n_inputs=12, rate=0.1, background_bins=6_000, pattern_bins=200),
        Task(n_inputs=12, rate=0.1, background_bins=20, mean_occurrences=0.0),
        Task(n_inputs=12, rate=0.0),
        Task(
            n_inputs=12, rate=0.1, n_classes=3, targets=(0, 5, 1), jitter_bins=3, deletion=0.2,
            mean_occurrences=20.0,
        ),
    ],
    ids=["one bin", "longer than a batch", "noise alone", "silence", "many noisy occurrences"],
)  # fmt: skip
def test_unusual_worlds_too(task: Task) -> None:
    patterns = Patterns.draw(task, seed=1)
    looped, lane = agent_of("gnm", "et"), agent_of("gnm", "et")
    trials = 5 if task.background_bins > 1_000 else 60
    by_loop = train(looped, trial_env(task, patterns), trials, seed=9)
    by_lane = train_many([lane], task, patterns, trials, seed=9)
    assert_same(looped, lane)
    assert_same_history(by_loop, by_lane.of(0))


# --- callbacks -----------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["loop", "lanes"])
def test_a_callback_sees_the_agent_up_to_date_and_can_end_training(kind: str) -> None:
    agent = agent_of("gnm", "all")
    seen: list[tuple[int, int, bytes]] = []

    def watch(done: int, history: History) -> bool:
        seen.append((done, len(history), agent.weights.tobytes()))
        return done < 80

    if kind == "loop":
        train(agent, trial_env(), TRIALS, seed=9, callback=watch, block=40)
    else:
        train_many([agent], BUSY, BUSY_PATTERNS, TRIALS, seed=9, callback=watch, block=40)
    assert [(done, blocks) for done, blocks, _ in seen] == [(40, 1), (80, 2)]
    for done, _, weights in seen:
        partly = agent_of("gnm", "all")
        train_many([partly], BUSY, BUSY_PATTERNS, done, seed=9)
        assert partly.weights.tobytes() == weights
