"""NeuronAgent: its weights, its answers bin by bin, and Stable-Baselines3's `predict`."""

from __future__ import annotations

import copy
import pickle
from dataclasses import replace
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from agents import GNM, LIF, MST, AggregateLabel, ErrorTrace, NeuronAgent, record
from agents.continuous import ContinuousAgent, ContinuousGNM
from agents.learning.rule import Rule
from agents.network import BackPropagation, Network, NetworkAgent
from agents.neurons.neuron import Neuron
from gnm_env import Task, Trial, draw_trial
from tests.agents.worlds import BUSY, BUSY_PATTERNS, BUSY_WEIGHT, play

N = BUSY.n_inputs
NEURONS = [GNM(), GNM(readout="D", theta_r=0.3), GNM(eta=0.5), LIF(refractory=2), MST()]


def busy_agent(neuron: Neuron | None = None, seed: int = 0) -> NeuronAgent:
    neuron = neuron or GNM()
    return NeuronAgent(neuron, AggregateLabel(0.01), N, seed, BUSY_WEIGHT[neuron.name])


def some_trial(seed: int = 0) -> Trial:
    return draw_trial(BUSY, BUSY_PATTERNS, np.random.default_rng(seed))


def rows(trial: Trial) -> Any:
    return trial.dense().view(np.int8)


# --- weights -------------------------------------------------------------------------------------


@pytest.mark.parametrize(("neuron", "w0"), [(GNM(), 0.1), (LIF(), 0.1), (MST(), 0.02)], ids=str)
def test_initial_weights_are_those_that_the_protocol_pins(neuron: Neuron, w0: float) -> None:
    for seed in (0, 5):
        agent = NeuronAgent(neuron, AggregateLabel(), 100, seed=seed)
        expected = np.random.default_rng((seed, 2)).random(100) * w0
        assert np.array_equal(agent.weights, expected)
    agent = NeuronAgent(neuron, AggregateLabel(), 100, seed=3, initial_weight=0.5)
    assert np.array_equal(agent.weights, np.random.default_rng((3, 2)).random(100) * 0.5)


def test_initial_weights_lie_within_the_bounds() -> None:
    agent = NeuronAgent(GNM(), AggregateLabel(), 100, initial_weight=2.0, weight_bounds=(0.5, 1.0))
    expected = np.clip(np.random.default_rng((0, 2)).random(100) * 2.0, 0.5, 1.0)
    assert np.array_equal(agent.weights, expected)


def test_the_weights_are_the_agents_own_writable_array() -> None:
    agent = busy_agent()
    weights = agent.weights
    assert weights.dtype == np.float64 and weights.shape == (N,) and weights.flags.writeable
    trial = some_trial()
    weights[:] = 0.0  # writing to it changes the agent …
    assert not play(agent, trial).any()
    weights[:] = 0.2
    play(agent, trial)
    assert weights is agent.weights and not (weights == 0.2).all()  # … and learning changes it
    agent.weights = np.linspace(0, 1, N)  # assigning copies into it
    assert weights is agent.weights
    assert np.array_equal(weights, np.linspace(0, 1, N))
    agent.weights += 1.0
    assert np.array_equal(weights, np.linspace(0, 1, N) + 1.0)


def test_an_array_that_was_assigned_stays_the_users() -> None:
    agent, mine = busy_agent(), np.full(N, 0.25)
    agent.weights = mine
    play(agent, some_trial())
    assert (mine == 0.25).all()


@pytest.mark.parametrize(
    ("weights", "message"),
    [
        (np.zeros(N + 1), rf"weights must have shape \({N},\), got \({N + 1},\)"),
        (np.zeros((N, 1)), rf"weights must have shape \({N},\), got \({N}, 1\)"),
        (np.where(np.arange(N) == 4, np.nan, 0.1), "weights must be finite, got nan for input 4"),
        (np.where(np.arange(N) == 2, -np.inf, 0.1), "weights must be finite, got -inf for input 2"),
        (np.inf, "weights must be finite, got inf"),
    ],
)
def test_bad_weights_are_refused_and_the_old_ones_kept(weights: Any, message: str) -> None:
    agent = busy_agent()
    before = agent.weights.copy()
    with pytest.raises(ValueError, match=message):
        agent.weights = weights
    assert np.array_equal(agent.weights, before)


def test_weights_that_were_written_to_are_checked_at_the_next_trial() -> None:
    agent = busy_agent()
    agent.weights[1] = np.nan
    with pytest.raises(ValueError, match="weights must be finite, got nan for input 1"):
        agent.begin_trial()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"neuron": "gnm"}, "neuron must be one of .*GNM.*got 'gnm'"),
        ({"neuron": GNM}, "neuron must be an instance, got the class GNM; write GNM"),
        ({"rule": GNM()}, "rule must be one of .*AggregateLabel.*got GNM"),
        ({"n_inputs": 0}, "n_inputs must be >= 1, got 0"),
        ({"n_inputs": 2.5}, "n_inputs must be a whole number, got 2.5"),
        ({"seed": -1}, "seed must be >= 0, got -1"),
        ({"seed": None}, "seed must be a whole number, got None"),
        ({"initial_weight": float("nan")}, "initial_weight must be finite, got nan"),
        ({"initial_weight": "big"}, "initial_weight must be a number, got 'big'"),
    ],
)
def test_bad_arguments_are_refused_by_name_value_and_remedy(
    arguments: dict[str, Any], message: str
) -> None:
    sound = {"neuron": GNM(), "rule": AggregateLabel(), "n_inputs": 10}
    with pytest.raises(ValueError, match=message):
        NeuronAgent(**{**sound, **arguments})


def test_a_copy_with_other_parameters_has_weights_of_its_own() -> None:
    agent = busy_agent()
    agent.velocity[:] = 0.5
    other = agent.replaced(alpha=0.1)
    assert other.neuron == replace(agent.neuron, alpha=0.1)  # type: ignore[type-var]
    assert np.array_equal(other.weights, agent.weights)
    assert np.array_equal(other.velocity, agent.velocity)
    other.weights[:] = 0.0
    assert agent.weights.any()


# --- act -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("neuron", NEURONS, ids=str)
def test_what_it_does_bin_by_bin_is_what_recording_shows(neuron: Neuron) -> None:
    agent = busy_agent(neuron)
    emitted = 0
    for seed in range(5):
        trial = some_trial(seed)
        agent.begin_trial()
        actions = [agent.act(row) for row in rows(trial)]
        assert all(type(action) is int for action in actions)
        spikes = record(agent, trial).spikes
        assert actions == spikes.astype(int).tolist()
        emitted += sum(actions)
    assert emitted > 5


def test_recording_changes_nothing_even_in_the_middle_of_a_trial() -> None:
    agent, undisturbed = busy_agent(), busy_agent()
    for each in (agent, undisturbed):
        each.begin_trial()
    for row in rows(some_trial()):
        record(agent, some_trial(1))
        assert agent.act(row) == undisturbed.act(row)
    assert np.array_equal(agent.weights, undisturbed.weights)


def test_a_trial_begins_from_rest_whatever_came_before() -> None:
    agent, fresh = busy_agent(), busy_agent()
    agent.begin_trial()
    for _ in range(7):
        agent.act(np.ones(N, np.int8))
    for each in (agent, fresh):
        play(each, some_trial())
    assert np.array_equal(agent.weights, fresh.weights)
    assert np.array_equal(agent.velocity, fresh.velocity)


def test_a_trial_may_be_much_longer_and_denser_than_any_before() -> None:
    """The record of a trial grows; what was heard before it grew is kept."""
    task = Task(n_inputs=N, pattern_bins=8, rate=0.5, background_bins=2_000)
    patterns = np.random.default_rng(0).random((2_000, N)) < 0.5
    trial = Trial.from_dense(patterns, [100], [0], task)
    agent, other = (
        NeuronAgent(GNM(), ErrorTrace(1e-4), N, initial_weight=0.1, weight_bounds=None)
        for _ in range(2)
    )
    expected = record(agent, trial).spikes
    assert np.array_equal(play(agent, trial), expected)
    play(other, Trial.from_dense(np.zeros((5_000, N), np.bool_), [], [], task))  # it has grown now
    play(other, trial)
    assert np.array_equal(other.velocity, agent.velocity)
    assert agent.velocity.all()


@pytest.mark.parametrize("dtype", [np.int8, np.uint8, np.bool_, np.int64, np.float32])
def test_observations_may_be_of_any_number_type_and_layout(dtype: Any) -> None:
    agent, usual = busy_agent(), busy_agent()
    raster = rows(some_trial())
    columns = np.asfortranarray(raster.astype(dtype))  # its rows are not contiguous
    for each in (agent, usual):
        each.begin_trial()
    assert [agent.act(row) for row in columns] == [usual.act(row) for row in raster]
    assert usual.act(list(raster[0])) in (0, 1)  # type: ignore[arg-type]


@pytest.mark.parametrize("shape", [(N + 1,), (1, N), (N, 1), ()])
def test_an_observation_of_another_shape_is_refused(shape: tuple[int, ...]) -> None:
    agent = busy_agent()
    agent.begin_trial()
    with pytest.raises(ValueError, match=rf"an observation must have shape \({N},\)"):
        agent.act(np.zeros(shape, np.int8))


def test_a_trial_with_other_channels_cannot_be_recorded() -> None:
    agent = busy_agent()
    trial = Trial.from_dense(np.zeros((5, 7), np.bool_), [], [], Task(n_inputs=7))
    with pytest.raises(ValueError, match=f"as many channels as the agent has inputs, {N}, got 7"):
        record(agent, trial)


# --- predict -------------------------------------------------------------------------------------


@pytest.mark.parametrize("neuron", [GNM(), LIF(refractory=2), MST()], ids=lambda n: n.name)
def test_predict_answers_as_act_does_for_one_stream_and_for_many(neuron: Neuron) -> None:
    agent = busy_agent(neuron)
    rasters = [rows(some_trial(seed))[:30] for seed in range(3)]
    expected = []
    for raster in rasters:
        agent.begin_trial()
        expected.append([agent.act(row) for row in raster])

    state, one = None, []
    for row in rasters[0]:
        action, state = agent.predict(row, state)
        assert action.shape == () and np.issubdtype(action.dtype, np.integer)
        one.append(int(action))
    assert one == expected[0]

    state, many = None, []
    for t in range(30):
        actions, state = agent.predict(np.stack([r[t] for r in rasters]), state)
        assert actions.shape == (3,)
        many.append(actions)
    assert np.transpose(many).tolist() == expected
    assert np.sum(many) > 0


def test_episode_start_forgets_the_past_of_the_streams_that_it_names() -> None:
    agent = NeuronAgent(GNM(alpha=0.0), AggregateLabel(fraction=1.0), 1)
    agent.weights = 0.6
    bits = np.ones((3, 1), np.int8)
    _, state = agent.predict(bits)
    actions, state = agent.predict(bits, state, episode_start=np.array([False, True, False]))
    assert actions.tolist() == [1, 0, 1]
    actions, _ = agent.predict(bits, state, episode_start=np.array([True, False, False]))
    assert actions.tolist() == [0, 1, 0]
    # For one stream too, as a plain bool or an array of one.
    _, state = agent.predict(bits[0])
    assert agent.predict(bits[0], state)[0] == 1
    assert agent.predict(bits[0], state, episode_start=np.array([True]))[0] == 0
    assert agent.predict(bits[0], state, episode_start=True)[0] == 0  # type: ignore[arg-type]


def test_predict_changes_nothing_neither_the_agent_nor_the_state_that_it_is_given() -> None:
    agent, undisturbed = busy_agent(), busy_agent()
    trial = some_trial()
    for each in (agent, undisturbed):
        each.begin_trial()
    _, state = agent.predict(np.ones((2, N), np.int8))
    kept = [part.copy() for part in state]
    for row in rows(trial):
        again = agent.predict(np.stack([row, row]), state, deterministic=False)
        assert np.array_equal(again[0], agent.predict(np.stack([row, row]), state)[0])
        assert agent.act(row) == undisturbed.act(row)
    assert all(np.array_equal(a, b) for a, b in zip(kept, state, strict=True))
    assert np.array_equal(agent.weights, undisturbed.weights)


@pytest.mark.parametrize("shape", [(N + 1,), (2, N + 1), (2, 3, N)])
def test_predict_refuses_observations_of_another_shape(shape: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match="an observation must have shape"):
        busy_agent().predict(np.zeros(shape, np.int8))


def test_stable_baselines_can_evaluate_it_as_a_policy() -> None:
    """Its mean episode return on the stream is the noisy performance."""
    evaluation = pytest.importorskip("stable_baselines3.common.evaluation")
    env = gym.make("gnm/PatternStream-v0", task=BUSY, patterns=BUSY_PATTERNS)
    env.reset(seed=5)
    returns, lengths = evaluation.evaluate_policy(
        busy_agent(), env, n_eval_episodes=10, return_episode_rewards=True, warn=False
    )
    # Episodes go on in one stream, each from rest: by hand, on the same stream.
    env = gym.make("gnm/PatternStream-v0", task=BUSY, patterns=BUSY_PATTERNS)
    env.reset(seed=5)
    agent, by_hand = busy_agent(), []
    for _ in range(10):
        (obs, _), total, ended = env.reset(), 0.0, False
        agent.begin_trial()
        while not ended:
            obs, reward, terminated, truncated, _ = env.step(agent.act(obs))
            total, ended = total + float(reward), terminated or truncated
        by_hand.append(total)
    assert returns == by_hand
    assert [length - 1 for length in lengths] == returns  # the bin of the mistake earns nothing
    assert max(returns) > 3


@pytest.mark.parametrize("begins", ["x", [0.5, 1], [float("nan"), 1], [[True], [False]], [True], 3])
def test_predict_asks_for_one_truth_per_stream(begins: Any) -> None:
    with pytest.raises(ValueError, match="episode_start must"):
        busy_agent().predict(np.zeros((2, N), np.int8), None, begins)


def test_predict_refuses_a_state_of_nan_and_rows_of_unequal_length() -> None:
    agent = busy_agent()
    _, (state,) = agent.predict(np.zeros((2, N), np.int8))
    with pytest.raises(ValueError, match="state must hold numbers, got NaN"):
        agent.predict(np.zeros((2, N), np.int8), (np.full_like(state, np.nan),))
    with pytest.raises(ValueError, match="an observation must hold the bits of a bin"):
        agent.predict([[0], [1, 0]])  # type: ignore[arg-type]


# --- learn ---------------------------------------------------------------------------------------


def heard(rule: Rule, bins: int = 9) -> NeuronAgent:
    agent = NeuronAgent(GNM(), rule, N)
    for _ in range(bins):
        agent.act(np.ones(N, np.int8))
    return agent


SOUND = {"label": 1, "onsets": [2], "ends": [5], "classes": [0], "targets": [1]}


@pytest.mark.parametrize("rule", [AggregateLabel(0.01), ErrorTrace(0.01)], ids=lambda r: r.name)
@pytest.mark.parametrize(
    ("info", "message"),
    [
        (None, "info must be the terminal info of the trial, a dict, got None"),
        (3, "info must be the terminal info"),
        ({**SOUND, "label": 1.7}, "label must be a whole number, got 1.7"),
        ({**SOUND, "label": 2**62}, "label must be at most"),
        ({**SOUND, "onsets": [7]}, "presentations must follow one another within the 9 bins"),
        ({**SOUND, "ends": [10]}, "presentations must follow one another within the 9 bins"),
        ({**SOUND, "onsets": [2, 2]}, "must have one entry per presentation each"),
        ({**SOUND, "onsets": [0.5]}, "onsets must be whole numbers"),
        ({**SOUND, "targets": [-1]}, "targets must lie in 0 …"),
        ({**SOUND, "targets": [2**62]}, "targets must lie in 0 …"),
        ({**SOUND, "emitted": 40}, "the environment counted 40 of output"),
        ({**SOUND, "emitted": "x"}, "emitted must be a number"),
    ],
)
def test_an_info_that_cannot_be_of_this_trial_is_refused_and_teaches_nothing(
    rule: Rule, info: Any, message: str
) -> None:
    agent = heard(rule)
    before = agent.weights.copy()
    with pytest.raises(ValueError, match=message):
        agent.learn(-1.0, info)
    assert np.array_equal(agent.weights, before) and agent.trials == 0


def test_targets_and_label_must_agree_for_a_rule_that_sees_both() -> None:
    with pytest.raises(ValueError, match="label must be the sum of the targets, 1, got 5"):
        heard(ErrorTrace(0.01)).learn(-1.0, {**SOUND, "label": 5})


def test_nothing_is_learned_before_a_bin_was_heard() -> None:
    agent = busy_agent()
    with pytest.raises(ValueError, match="a trial must be heard before it can be learned from"):
        agent.learn(-1.0, SOUND)
    assert agent.trials == 0


def test_a_velocity_that_was_written_to_is_checked_at_the_next_trial() -> None:
    agent = busy_agent()
    agent.velocity[1] = np.nan
    with pytest.raises(ValueError, match="velocity must be finite, got nan for input 1"):
        agent.begin_trial()


def test_momentum_is_the_former_name_of_the_velocity_with_the_same_checks() -> None:
    agent = busy_agent()
    agent.momentum = np.arange(N)
    assert agent.momentum is agent.velocity and agent.velocity.tolist() == list(range(N))
    with pytest.raises(ValueError, match="velocity must have shape"):
        agent.momentum = np.zeros(N + 1)


def test_a_copy_with_a_parameter_that_is_not_there_is_refused() -> None:
    with pytest.raises(ValueError, match=r"a GNM has the parameters alpha, eta, .*got 'bogus'"):
        busy_agent().replaced(bogus=1)


# --- copies --------------------------------------------------------------------------------------

KINDS: dict[str, Any] = {
    "neuron": lambda: NeuronAgent(GNM(eta=0.5), AggregateLabel(0.01, fraction=0.25), N),
    "continuous": lambda: ContinuousAgent(ContinuousGNM(), AggregateLabel(0.01, fraction=0.25), N),
    "network": lambda: NetworkAgent(Network(hidden=3), BackPropagation(), N),
}


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda a: pickle.loads(pickle.dumps(a))])
@pytest.mark.parametrize("kind", KINDS)
def test_a_copy_goes_on_where_the_agent_stands_even_amid_a_trial(kind: str, copied: Any) -> None:
    agent = KINDS[kind]()
    agent.weights = np.linspace(0.1, 0.9, agent.weights.size)
    agent.velocity = 0.01
    agent.note = "my own"
    trial = some_trial()
    bits = rows(trial)
    agent.begin_trial()
    first = [agent.act(row) for row in bits[:20]]
    other = copied(agent)
    assert other.note == "my own"
    info = {
        "label": trial.label, "onsets": trial.onsets, "ends": trial.ends, "targets": trial.targets,
    }  # fmt: skip
    given = []
    for each in (agent, other):
        given.append(first + [each.act(row) for row in bits[20:]])
        each.learn(-1.0, info)
    assert given[0] == given[1] and sum(given[0]) > 0
    assert np.array_equal(agent.weights, other.weights)
    assert np.array_equal(agent.velocity, other.velocity) and (agent.velocity != 0.01).any()
    assert other.trials == agent.trials == 1
    other.weights[:] = 0.0
    assert agent.weights.any()
