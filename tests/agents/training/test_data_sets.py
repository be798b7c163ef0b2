"""A data set of trials is as good as a task: heard by every loop, with the same bits."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import gnm_env  # noqa: F401  (registers the environments)
from agents import (
    GNM,
    LIF,
    MST,
    AggregateLabel,
    CriticalThreshold,
    ErrorTrace,
    History,
    NeuronAgent,
    answers,
    load_checkpoint,
    plot,
    record,
    train,
    train_many,
)
from agents.learning.rule import Rule
from agents.training.source import DataSource
from gnm_env import Trial, Trials
from tests.agents.worlds import BUSY, BUSY_PATTERNS, BUSY_WEIGHT

KNOWN = Trials.draw(BUSY, BUSY_PATTERNS, 40, seed=4)
"""Presentations are known."""

LABELS = Trials([Trial(t.channels, t.offsets, [], None, [], 12, 1, label=t.label) for t in KNOWN])
"""The same trials; of them only the labels are known."""

TRIALS = 110
"""Nearly three epochs, the last one broken off."""

NEURONS = {"gnm": GNM(alpha=0.2), "lif": LIF(alpha=0.2, refractory=2), "mst": MST()}
RULES: dict[str, Callable[[float], Rule]] = {
    "all": lambda a: AggregateLabel(1e-3 * (1 + a), fraction=0.25),
    "et": lambda a: ErrorTrace(1e-3 * (1 + a)),
}


def agent_of(neuron: str, rule: str, lane: int = 0) -> NeuronAgent:
    """Agents of different lanes differ in their weights and rates."""
    weight = BUSY_WEIGHT[neuron] * (1 + lane / 10)
    return NeuronAgent(NEURONS[neuron], RULES[rule](lane / 10), 12, lane, weight)


def env_of(data: Trials, **keywords: Any) -> gym.Env[Any, Any]:
    return gym.make("gnm/PatternTrial-v0", trials=data, **keywords)


def assert_same(one: NeuronAgent, other: NeuronAgent) -> None:
    assert one.weights.tobytes() == other.weights.tobytes()
    assert one.velocity.tobytes() == other.velocity.tobytes()
    assert one.trials == other.trials


def assert_same_history(one: History, other: History) -> None:
    assert one.trials.tolist() == other.trials.tolist()
    assert one.error_rate.tolist() == other.error_rate.tolist()
    assert one.mean_error.tolist() == other.mean_error.tolist()


# --- the same bits -------------------------------------------------------------------------------


@pytest.mark.parametrize("feedback", ["cost", "sign"])
@pytest.mark.parametrize("data", [KNOWN, LABELS], ids=["known", "labels"])
@pytest.mark.parametrize(("neuron", "rule"), [("gnm", "all"), ("gnm", "et"), ("mst", "all")])
def test_the_loop_and_train_many_end_with_the_same_bits(
    neuron: str, rule: str, data: Trials, feedback: str
) -> None:
    if rule == "et" and (data is LABELS or feedback == "sign"):
        pytest.skip("ET needs to know the presentations")
    looped, lane = agent_of(neuron, rule), agent_of(neuron, rule)
    by_loop = train(looped, env_of(data, feedback=feedback), TRIALS, seed=9, block=30)
    by_lane = train_many([lane], data, trials=TRIALS, seed=9, block=30)
    assert_same(looped, lane)
    assert_same_history(by_loop, by_lane.of(0))
    assert not np.array_equal(looped.weights, agent_of(neuron, rule).weights)


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("lanes", [2, 7, 70])
def test_lanes_and_threads_change_no_bits(lanes: int, threads: int) -> None:
    agents = [agent_of("gnm", "all", lane) for lane in range(lanes)]
    together = train_many(agents, KNOWN, trials=TRIALS, seed=9, threads=threads, block=30)
    for lane in (0, lanes // 2, lanes - 1):
        alone = agent_of("gnm", "all", lane)
        history = train_many([alone], KNOWN, trials=TRIALS, seed=9, block=30)
        assert_same(agents[lane], alone)
        assert_same_history(together.of(lane), history.of(0))


@pytest.mark.parametrize("threads", [1, 2])
def test_agents_of_different_kinds_hear_the_same_order(threads: int) -> None:
    kinds = [("gnm", "all"), ("mst", "all"), ("gnm", "et"), ("gnm", "all")]
    agents = [agent_of(*kind, lane) for lane, kind in enumerate(kinds)]
    train_many(agents, KNOWN, trials=TRIALS, seed=9, threads=threads)
    for lane, kind in enumerate(kinds):
        alone = agent_of(*kind, lane)
        train_many([alone], KNOWN, trials=TRIALS, seed=9)
        assert_same(agents[lane], alone)


def test_a_falling_rate_ends_with_the_same_bits() -> None:
    rule = AggregateLabel(1e-2, fraction=0.25, decay_trials=80)
    looped, lane = (NeuronAgent(GNM(alpha=0.2), rule, 12, 0, 0.6) for _ in range(2))
    train(looped, env_of(LABELS), TRIALS, seed=9)
    train_many([lane], LABELS, trials=TRIALS, seed=9)
    assert_same(looped, lane)


@pytest.mark.parametrize("how", ["loop", "lanes"])
def test_a_generator_in_pieces_begins_an_epoch_with_each_piece(how: str) -> None:
    """Pieces of whole epochs are one uninterrupted run; both loops cut them the same way."""

    def go_on(agent: NeuronAgent, trials: int, rng: Any) -> None:
        if how == "loop":
            train(agent, env_of(KNOWN), trials, rng)
        else:
            train_many([agent], KNOWN, trials=trials, seed=rng)

    whole, pieces = agent_of("gnm", "all"), agent_of("gnm", "all")
    train_many([whole], KNOWN, trials=120, seed=9)
    rng = np.random.default_rng(9)
    for trials in (40, 80):
        go_on(pieces, trials, rng)
    assert_same(whole, pieces)
    rng, other_rng = np.random.default_rng(9), np.random.default_rng(9)
    odd, other = agent_of("gnm", "all"), agent_of("gnm", "all")
    for trials in (17, 50):
        go_on(odd, trials, rng)
        train_many([other], KNOWN, trials=trials, seed=other_rng)
    assert_same(odd, other)
    assert rng.bit_generator.state == other_rng.bit_generator.state


def test_every_trial_is_heard_once_an_epoch_and_each_epoch_has_an_order_of_its_own() -> None:
    source = DataSource(KNOWN)
    order = source.order(np.random.default_rng(0), 3 * len(KNOWN))
    epochs = order.reshape(3, -1)
    assert (np.sort(epochs, axis=1) == np.arange(len(KNOWN))).all()
    assert len({epoch.tobytes() for epoch in epochs}) == 3


def test_training_goes_on_from_a_checkpoint(tmp_path: Any) -> None:
    rng = np.random.default_rng(9)
    first, whole = agent_of("gnm", "all"), agent_of("gnm", "all")
    train_many([first], KNOWN, trials=40, seed=rng)
    first.save(tmp_path / "half", rng=rng)
    loaded = load_checkpoint(tmp_path / "half")
    train_many([loaded.agent], KNOWN, trials=40, seed=loaded.rng)
    train_many([whole], KNOWN, trials=80, seed=9)
    assert_same(loaded.agent, whole)


# --- labels alone --------------------------------------------------------------------------------


def counted_trials(n: int = 300) -> Trials:
    """Made data: of 10 channels, the first four fire together as often as the label says."""
    rng = np.random.default_rng(5)
    trials = []
    for _ in range(n):
        raster = rng.random((60, 10)) < 0.02
        label = int(rng.integers(0, 4))
        for onset in rng.choice(4, label, replace=False):
            raster[15 * onset + 5, :4] = True
        trials.append(Trial.from_dense(raster, label=label))
    return Trials(trials)


def test_all_learns_from_labels_alone() -> None:
    """Silence errs by 1.5 spikes a trial; the trained neuron by less than a third of that."""
    heard, held_out = counted_trials().split(0.7, seed=0)
    agent = NeuronAgent(GNM(alpha=0.3), AggregateLabel(1e-3, fraction=0.4), 10, 0, 0.1)
    assert answers(agent, held_out).absolute[0] > 1.2 * len(held_out)
    train_many([agent], heard, trials=6_000, seed=1)
    assert answers(agent, held_out).absolute[0] < 0.5 * len(held_out)


@pytest.mark.parametrize("neuron", [GNM(alpha=0.3), MST(10.0, 2.5)], ids=["gnm", "mst"])
def test_critical_threshold_learns_from_labels_alone(neuron: Any) -> None:
    heard, held_out = counted_trials().split(0.7, seed=0)
    agent = NeuronAgent(neuron, CriticalThreshold(3e-3), 10, 0, 0.02, weight_bounds=None)
    train_many([agent], heard, trials=6_000, seed=1)
    assert answers(agent, held_out).absolute[0] < 0.3 * len(held_out)


@pytest.mark.parametrize("mixed", [False, True], ids=["labels alone", "some labels alone"])
@pytest.mark.parametrize("how", ["loop", "lanes"])
def test_error_trace_refuses_labels_alone_in_one_sentence(how: str, mixed: bool) -> None:
    agent, data = agent_of("gnm", "et"), LABELS + KNOWN if mixed else LABELS
    with pytest.raises(ValueError, match="ErrorTrace needs to know where the presentations were"):
        if how == "loop":
            train(agent, env_of(data), 40, seed=0)
        else:
            train_many([agent], data, trials=40, seed=0)


# --- answers -------------------------------------------------------------------------------------


def counted(agent: NeuronAgent, data: Trials) -> tuple[Any, int, int, int, int]:
    """Answers as `record` gives them: table, spikes and bins of noise, wrong, Σ |error|."""
    table = np.zeros((data.n_classes, 11), np.int64)
    false_positives = noise_bins = wrong = absolute = 0
    for trial in data:
        spikes = record(agent, trial).spikes
        error = abs(int(spikes.sum()) - trial.label)
        wrong, absolute = wrong + (error > 0), absolute + error
        if trial.label_only:
            continue
        owner = trial.owner()
        false_positives += int(spikes[owner < 0].sum())
        noise_bins += int((owner < 0).sum())
        for k, class_ in enumerate(trial.classes):
            table[class_, min(10, spikes[owner == k].sum())] += 1
    return table, false_positives, noise_bins, wrong, absolute


@pytest.mark.parametrize("data", [KNOWN, LABELS, KNOWN + LABELS], ids=["known", "labels", "both"])
@pytest.mark.parametrize("lanes", [1, 7])
def test_answers_are_what_record_counts(data: Trials, lanes: int) -> None:
    """Where only the label of a trial is known, nobody can say which of its spikes were false."""
    agents = [agent_of("gnm", "all", lane) for lane in range(lanes)]
    result = answers(agents, data)
    assert result.trials == len(data)
    for lane, agent in enumerate(agents):
        table, false_positives, noise_bins, wrong, absolute = counted(agent, data)
        assert result.table[lane].tolist() == table.tolist()
        assert result.false_positives[lane] == false_positives
        assert result.noise_bins == noise_bins
        assert (result.wrong[lane], result.absolute[lane]) == (wrong, absolute)
    assert 0 < result.wrong[0] < len(data)


def test_answers_to_some_trials_are_those_of_a_part_of_the_data() -> None:
    agent = agent_of("gnm", "all")
    some = answers(agent, KNOWN, trials=15, seed=3)
    order = DataSource(KNOWN).order(np.random.default_rng(3), 15)
    part = answers(agent, KNOWN[order])
    assert (some.wrong[0], some.absolute[0]) == (part.wrong[0], part.absolute[0])


# --- parts, pictures -----------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(5))
def test_splits_never_share_a_trial(seed: int) -> None:
    numbered = Trials(
        list(KNOWN), columns={"number": range(40), "voice": [k % 7 for k in range(40)]}
    )
    for by in (None, "voice"):
        first, second = numbered.split(0.6, seed, by=by)
        here, there = (set(part.columns["number"]) for part in (first, second))
        assert not here & there and here | there == set(range(40))
        if by:
            assert not set(first.columns["voice"]) & set(second.columns["voice"])


def test_record_hears_a_trial_of_a_data_set_as_the_environment_plays_it() -> None:
    agent = agent_of("mst", "all")
    trial = LABELS[3]
    env = env_of(LABELS)
    obs, _ = env.reset(options={"trial": trial})
    agent.begin_trial()
    given, ended = [], False
    while not ended:
        given.append(agent.act(obs))
        obs, _, ended, _, info = env.step(given[-1])
    assert given == record(agent, trial).spikes.astype(int).tolist()
    assert info["label"] == trial.label and info["emitted"] == sum(given)


@pytest.mark.parametrize("data", [KNOWN, LABELS], ids=["known", "labels"])
def test_plot_draws_a_trial_of_a_data_set(data: Trials) -> None:
    pytest.importorskip("matplotlib")
    figure = plot(agent_of("gnm", "all"), data, history=None)
    assert len(figure.axes) == 2
    shown = figure.axes[0].lines[0].get_xydata()
    spikes = {len(trial.channels) for trial in data}
    assert len(shown) in spikes
