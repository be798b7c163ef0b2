"""What train_many refuses, and what it leaves behind when it is interrupted."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from agents import GNM, AggregateLabel, NeuronAgent, train, train_many
from agents.memory import bytes_needed
from agents.policy import as_agent
from agents.training.many import lane_groups
from agents.training.source import Source, TaskSource
from gnm_env import Patterns, Task
from tests.agents.worlds import BUSY, BUSY_PATTERNS, trial_env


def busy_agent(seed: int = 0) -> NeuronAgent:
    return NeuronAgent(GNM(), AggregateLabel(1e-3), BUSY.n_inputs, seed, 0.6)


@pytest.mark.parametrize("agents", [[], (), None, busy_agent])
def test_a_list_of_agents_is_needed(agents: Any) -> None:
    with pytest.raises(ValueError, match="agents must be a list of at least one agent"):
        train_many(agents, BUSY, BUSY_PATTERNS, 10)


def test_an_agent_that_does_not_fit_the_task_is_refused() -> None:
    agents = [busy_agent(), NeuronAgent(GNM(), AggregateLabel(), 20)]
    with pytest.raises(ValueError, match=r"n_inputs = 12, got 20"):
        train_many(agents, BUSY, BUSY_PATTERNS, 10)


def test_patterns_that_do_not_fit_the_task_are_refused() -> None:
    other = Patterns.draw(Task(n_inputs=12), 0)
    with pytest.raises(ValueError, match=r"patterns must have shape .* = \(2, 8, 12\)"):
        train_many([busy_agent()], BUSY, other, 10)


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"threads": 0}, "threads must be in 1 … 1024, got 0"),
        ({"threads": 1.5}, "threads must be a whole number, got 1.5"),
        ({"trials": -1}, "trials must be >= 0, got -1"),
        ({"block": 0}, "block must be >= 1, got 0"),
        ({"seed": -1}, "seed must be >= 0, got -1"),
        ({"seed": "one"}, "seed must be a whole number, got 'one'"),
    ],
)
def test_numbers_out_of_range_are_refused(keywords: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        train_many([busy_agent()], BUSY, BUSY_PATTERNS, **{"trials": 10, **keywords})


@pytest.mark.parametrize(
    ("keywords", "message"),
    [({"trials": -1}, "trials must be >= 0, got -1"), ({"block": 0}, "block must be >= 1, got 0")],
)
def test_the_loop_refuses_numbers_out_of_range_too(keywords: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        train(busy_agent(), trial_env(), **{"trials": 10, **keywords})


def test_agents_that_would_not_fit_into_memory_are_refused_before_anything_is_allocated() -> None:
    weights = np.broadcast_to(0.1, 50_000_000)  # takes no room
    agents = [SimpleNamespace(weights=weights, group_key=None)] * 10_000
    with pytest.raises(ValueError, match=r"need 26,[\d,.]+ GiB, this machine has [\d,.]+"):
        lane_groups(agents, TaskSource(BUSY, BUSY_PATTERNS), 1)


def test_trials_that_would_not_fit_into_memory_are_refused_before_they_are_drawn(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("agents.memory.bytes_there", lambda: 2.0**33)
    task = Task(n_inputs=12, background_bins=10**8 - 200)
    with pytest.raises(ValueError, match="take fewer agents at a time, shorter trials or fewer"):
        train_many([busy_agent()], task, Patterns.draw(task, 0), 1)


def test_every_thread_counts_with_a_trial_of_its_own() -> None:
    task = Task(background_bins=10**6)
    source = TaskSource(task, Patterns.draw(task, 0))
    one, two = (bytes_needed(0, 64, source, threads) for threads in (1, 2))
    assert one == pytest.approx(64 * 16_500 + 532 * 1_000_100 + 2**22)
    assert two - one == pytest.approx(532 * 1_000_100)


class Silent:
    """A policy: it can be scored, and cannot learn."""

    def predict(self, observation: Any, *_: Any, **__: Any) -> tuple[Any, None]:
        return np.zeros(len(observation), int), None


@pytest.mark.parametrize(
    ("agent", "why"),
    [
        (1, "agents must be agents, such as NeuronAgent makes, got 1 as agent 1"),
        (Silent(), "agents must be agents, such as NeuronAgent makes"),
        (as_agent(Silent()), "agents must be able to learn, but agent 1 is a .*only be scored"),
    ],
    ids=["a number", "a policy", "a policy that can be scored"],
)
def test_what_cannot_learn_is_refused(agent: Any, why: str) -> None:
    with pytest.raises(ValueError, match=why):
        train_many([busy_agent(), agent], BUSY, BUSY_PATTERNS, 1)


@pytest.mark.parametrize("n_agents", [1, 63, 64, 400, 1_100])
def test_threads_get_equally_many_units_and_every_agent_is_in_one(n_agents: int) -> None:
    agents = [busy_agent(seed) for seed in range(n_agents)]
    for threads in (1, 2, 3):
        units = lane_groups(agents, TaskSource(BUSY, BUSY_PATTERNS), threads)
        places = [place for _, part in units for place in part]
        assert places == list(range(n_agents))
        assert len(units) < threads or len(units) % threads == 0


def test_more_units_than_threads_change_no_bits() -> None:
    agents = [busy_agent(seed) for seed in range(1_100)]
    assert len(lane_groups(agents, TaskSource(BUSY, BUSY_PATTERNS), threads=2)) > 2
    history = train_many(agents, BUSY, BUSY_PATTERNS, 40, seed=0, threads=2, block=20)
    together = [busy_agent(seed) for seed in range(1_100)]
    expected = train_many(together, BUSY, BUSY_PATTERNS, 40, seed=0, threads=1)
    assert np.array_equal([a.weights for a in agents], [a.weights for a in together])
    assert np.allclose(history.error_rate.mean(axis=0), expected.error_rate[0])


@pytest.mark.parametrize("run", ["loop", "lanes"])
def test_weights_that_are_not_finite_are_refused_before_they_spread(run: str) -> None:
    agent = busy_agent()
    agent.weights[3] = np.nan
    with pytest.raises(ValueError, match="weights must be finite"):
        if run == "loop":
            train(agent, trial_env(), 1, seed=0)
        else:
            train_many([agent], BUSY, BUSY_PATTERNS, 1, seed=0)


def test_no_trials_change_nothing() -> None:
    agent = busy_agent()
    before = agent.weights.copy()
    history = train_many([agent], BUSY, BUSY_PATTERNS, 0)
    assert len(history) == 0
    assert np.array_equal(agent.weights, before)


class FakeAgent:
    """An agent whose batch notes what is done to it."""

    n_inputs = BUSY.n_inputs

    def __init__(self, name: str, train: Any) -> None:
        self.name, self.train_ = name, train
        self.trained = 0
        self.written = 0

    def group_key(self) -> str:
        return self.name

    @staticmethod
    def batch(agents: Any, source: Source) -> Any:
        agent = agents[0]

        class Batch:
            def train(self, rng: Any, ahead: Any, trials: int) -> Any:
                agent.train_()
                agent.trained += trials
                return np.zeros(1, np.int64), np.zeros(1)

            def write_back(self) -> None:
                agent.written = agent.trained

            def overflowed(self) -> Any:
                return np.full(1, -1)

        return Batch()


@pytest.fixture
def interruptible() -> Iterator[None]:
    """Processes that run tests side by side ignore interrupts; here they come."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("interruptible")
@pytest.mark.parametrize("interrupts", [1, 3])
def test_interrupts_wait_until_every_agent_stands_at_the_same_trial(interrupts: int) -> None:
    def interrupt() -> None:
        for _ in range(interrupts):
            signal.raise_signal(signal.SIGINT)

    agents = [FakeAgent("quick", lambda: None), FakeAgent("slow", interrupt)]
    histories: list[Any] = []
    with pytest.raises(KeyboardInterrupt):
        train_many(
            agents, BUSY, BUSY_PATTERNS, 100, seed=0, block=10, threads=1,
            callback=lambda done, history: histories.append(history),
        )  # fmt: skip
    assert [agent.written for agent in agents] == [10, 10]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_one_agent_twice_is_refused() -> None:
    agent = busy_agent()
    with pytest.raises(ValueError, match="agent 2 is agent 0 again"):
        train_many([agent, busy_agent(1), agent], BUSY, BUSY_PATTERNS, 10)


def test_an_exception_in_a_callback_keeps_what_was_learned() -> None:
    agent, expected = busy_agent(), busy_agent()

    def stop(done: int, history: Any) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train_many([agent], BUSY, BUSY_PATTERNS, 500, seed=3, callback=stop, block=100)
    train_many([expected], BUSY, BUSY_PATTERNS, 100, seed=3)
    assert np.array_equal(agent.weights, expected.weights)
