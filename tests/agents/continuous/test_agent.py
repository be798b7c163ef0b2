"""ContinuousAgent in the standard loop, compiled, saved, and scored."""

from __future__ import annotations

import time
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

from agents import (
    GNM,
    AggregateLabel,
    ErrorTrace,
    answers,
    load_checkpoint,
    noisy_performance,
    record,
    train,
    train_many,
)
from agents.continuous import ContinuousAgent, ContinuousGNM, InputSpikes, simulate
from agents.continuous.outputs import (
    at_edges,
    in_noise,
    in_presentations,
    outputs_alone,
    outputs_in_trials,
    wrong_outputs,
)
from agents.learning.rule import Rule
from gnm_env import Patterns, Task, Trial, draw_trial
from gnm_env.sampling import append_piece
from gnm_env.task import task_arrays
from tests.marks import timed

TASK = Task(n_inputs=30, n_classes=2, rate=0.02, pattern_bins=20, background_bins=40)
PATTERNS = Patterns.draw(TASK, seed=4)
RULES = (AggregateLabel(), ErrorTrace(), ErrorTrace(modulate=True))


def make(rule: Rule = RULES[0], seed: int = 0, **neuron: float) -> ContinuousAgent:
    return ContinuousAgent(ContinuousGNM(**neuron), rule, TASK.n_inputs, seed, initial_weight=0.5)


def graded(**options: object) -> gym.Env:
    return gym.make("gnm/PatternTrial-v0", task=TASK, patterns=PATTERNS, output="graded", **options)


@pytest.mark.parametrize(
    ("rule", "eta"),
    [*((rule, 0.0) for rule in RULES), (RULES[0], 0.5)],
    ids=["all", "et", "et modulated", "all with eta"],
)
def test_the_loop_and_the_compiled_trainer_end_with_the_same_bits(rule: Rule, eta: float) -> None:
    looped, others = make(rule, eta=eta), [make(rule, seed, eta=eta) for seed in (5, 0, 6)]
    slow = train(looped, graded(), trials=12, seed=3)
    fast = train_many(others, TASK, PATTERNS, trials=12, seed=3)
    assert np.array_equal(looped.weights, others[1].weights)
    assert np.array_equal(looped.velocity, others[1].velocity)
    assert not np.array_equal(looped.weights, make(rule, eta=eta).weights)
    np.testing.assert_allclose(slow.mean_error, fast.mean_error[:, 1], rtol=1e-12)
    assert slow.error_rate.tolist() == fast.error_rate[:, 1].tolist()


def test_the_sign_alone_teaches_the_aggregate_label_rule_the_same() -> None:
    told, signed = make(), make()
    train(told, graded(), trials=8, seed=3)
    train(signed, graded(feedback="sign"), trials=8, seed=3)
    assert np.array_equal(told.weights, signed.weights)


@pytest.mark.parametrize("eta", [0.0, 0.5])
def test_amounts_handed_out_bin_by_bin_are_those_of_the_whole_course(eta: float) -> None:
    env, agent = graded(), make(eta=eta)
    obs, _ = env.reset(seed=7)
    agent.begin_trial()
    amounts, ended = [], False
    while not ended:
        action = agent.act(obs)
        assert np.array([action], env.action_space.dtype) in env.action_space
        amounts.append(action)
        obs, _, ended, _, info = env.step(action)
    trial = draw_trial(TASK, PATTERNS, np.random.default_rng(7))
    S = at_edges(agent, trial)
    assert S[-1] > 1.0
    np.testing.assert_allclose(np.cumsum(amounts), S[1:], rtol=1e-9, atol=1e-12)
    assert info["emitted"] == pytest.approx(S[-1], rel=1e-9)


def test_error_trace_learning_follows_its_equation() -> None:
    """Δ_i = λ Σ_t x_i(t) E(t): x decays by e^−α; E is target − S over a pattern, and in noise −1 in
    every bin with V above the threshold."""
    rate, alpha = 1e-3, 0.3
    agent = make(ErrorTrace(learning_rate=rate), alpha=alpha)
    before = agent.weights.copy()
    trial = draw_trial(TASK, PATTERNS, np.random.default_rng(7))
    S = at_edges(agent, trial)
    E = -(np.diff(S) > 0.0).astype(float)
    assert E.any()
    for k, onset in enumerate(trial.onsets):
        E[onset : onset + trial.pattern_bins] = trial.targets[k] - in_presentations(trial, S)[k]
    x = np.zeros((trial.n_bins, TASK.n_inputs))
    for t, bits in enumerate(trial.dense()):
        x[t] = (x[t - 1] * np.exp(-alpha) if t else 0.0) + bits
    train_many([agent], TASK, PATTERNS, trials=1, seed=7)
    expected = np.clip(before + rate * (x * E[:, None]).sum(0), 0.0, 1.0)
    np.testing.assert_allclose(agent.weights, expected, rtol=1e-10)


def test_aggregate_label_learning_teaches_the_most_eligible() -> None:
    """ε_i = Σ_t x_i(t) V(t) with V right after a bin's input; the top three of 30 are changed."""
    agent = make(AggregateLabel(learning_rate=1e-3), alpha=0.3)
    before = agent.weights.copy()
    trial = draw_trial(TASK, PATTERNS, np.random.default_rng(7))
    at = np.arange(trial.n_bins, dtype=float)
    V = simulate(agent.neuron, before, InputSpikes.from_trial(trial), at).V
    x = np.zeros((trial.n_bins, TASK.n_inputs))
    for t, bits in enumerate(trial.dense()):
        x[t] = (x[t - 1] * np.exp(-0.3) if t else 0.0) + bits
    eligible = np.argsort(x.T @ V)[-3:]
    sign = np.sign(trial.label - at_edges(agent, trial)[-1])
    train_many([agent], TASK, PATTERNS, trials=1, seed=7)
    expected = before.copy()
    expected[eligible] += sign * 1e-3
    np.testing.assert_allclose(agent.weights, expected, rtol=1e-12)


def test_the_potential_on_record_is_that_of_the_course() -> None:
    agent = make()
    trial = draw_trial(TASK, PATTERNS, np.random.default_rng(7))
    noted = record(agent, trial)
    at = np.arange(trial.n_bins, dtype=float)
    course = simulate(agent.neuron, agent.weights, InputSpikes.from_trial(trial), at)
    np.testing.assert_allclose(noted.V, course.V, rtol=1e-12)
    rises = (noted.V >= 1.0) & (np.concatenate([[0.0], noted.V[:-1] - noted.D[:-1]]) < 1.0)
    assert np.array_equal(noted.spikes, rises)


def test_predict_gives_actions_as_the_space_has_them_and_changes_nothing() -> None:
    agent, twin = make(), make()
    trial = draw_trial(TASK, PATTERNS, np.random.default_rng(7))
    rows = trial.dense().astype(np.int8)
    state = states = None
    for row in rows:
        expected = twin.act(row)
        action, state = agent.predict(row, state)
        both, states = agent.predict(np.stack([row, row]), states)
        assert action.shape == (1,)
        assert both.shape == (2, 1)
        assert action[0] == both[0, 0] == both[1, 0] == expected
    assert state is not None


def test_output_is_cut_off_at_max_output() -> None:
    agent = make(max_output=0.25)
    agent.weights = 1.0
    spikes = np.ones(TASK.n_inputs, np.int8)
    assert agent.act(spikes) == 0.25


def test_checkpoints_keep_everything_and_training_goes_on_with_the_same_bits(
    tmp_path: Path,
) -> None:
    rng = np.random.default_rng(3)
    agent, whole = make(eta=0.25, h=np.inf), make(eta=0.25, h=np.inf)
    train_many([agent], TASK, PATTERNS, 5, rng)
    agent.save(tmp_path / "agent.npz", task=TASK, patterns=PATTERNS, rng=rng)
    saved = load_checkpoint(tmp_path / "agent.npz")
    assert isinstance(saved.agent, ContinuousAgent)
    assert saved.agent.neuron == agent.neuron
    assert saved.patterns == PATTERNS
    train_many([saved.agent], TASK, PATTERNS, 5, saved.rng)
    train_many([whole], TASK, PATTERNS, 10, 3)
    assert np.array_equal(saved.agent.weights, whole.weights)
    assert isinstance(ContinuousAgent.load(tmp_path / "agent.npz"), ContinuousAgent)


def test_a_copy_with_another_alpha_keeps_the_weights() -> None:
    agent = make()
    copy = agent.replaced(alpha=0.2)
    assert copy.neuron.alpha == 0.2
    assert np.array_equal(copy.weights, agent.weights)


def test_spiking_neurons_are_refused() -> None:
    with pytest.raises(
        ValueError, match=r"neuron must be one of ContinuousGNM.*NeuronAgent is the agent for it"
    ):
        ContinuousAgent(GNM(), RULES[0], TASK.n_inputs)


def mistakes_by_hand(agent: ContinuousAgent, seed: int, cap: int) -> int:
    """Bins survived on the stream of `seed`, one bin after the other in plain Python."""
    rng = np.random.default_rng(seed)
    channels, offsets = np.empty(256, np.int32), np.zeros(512, np.int64)
    left, bins, S = -1.0, 0, 0.0
    agent.begin_trial()
    while True:
        channels, offsets, n_noise, class_, left = append_piece(
            rng, task_arrays(TASK, PATTERNS), left, channels, offsets, 0
        )
        length = n_noise + (TASK.pattern_bins if class_ >= 0 else 0)
        for t in range(length):
            if bins == cap:
                return bins
            if t in (0, n_noise):
                S = 0.0
            row = np.zeros(TASK.n_inputs, np.int8)
            row[channels[offsets[t] : offsets[t + 1]]] = 1
            S += agent.act(row)
            if t < n_noise and S > 0.5:
                return bins
            if t >= n_noise:
                given, owed = int(np.floor(S + 0.5)), TASK.owed[class_]
                if given > owed or (t == length - 1 and given < owed):
                    return bins
            bins += 1


def test_graded_noisy_performance_counts_bins_up_to_the_first_wrong_sum() -> None:
    agents = [make(RULES[2], seed=seed) for seed in (0, 1)]
    train_many(agents, TASK, PATTERNS, 3_000, seed=1)
    survived = noisy_performance(agents, TASK, PATTERNS, runs=12, cap=400, seed=10)
    expected = [[mistakes_by_hand(a, 10 + k, 400) for k in range(12)] for a in agents]
    assert survived.tolist() == expected
    assert len(np.unique(survived)) > 4


def test_a_silent_neuron_survives_until_the_first_pattern_ends() -> None:
    agent = make()
    agent.weights = 0.0
    survived = noisy_performance(agent, TASK, PATTERNS, runs=200, seed=0)
    # Waiting times spread by 1/q = 100 around the mean: five standard errors of 200 runs.
    assert survived.mean() == pytest.approx(TASK.silent_score, abs=5 * 100 / np.sqrt(200))


def test_answers_are_rounded_sums() -> None:
    agent = make(RULES[2])
    train_many([agent], TASK, PATTERNS, 1_000, seed=1)
    found = answers(agent, TASK, PATTERNS, trials=40, seed=5)
    rng = np.random.default_rng(5)
    trials = [draw_trial(TASK, PATTERNS, rng) for _ in range(40)]
    table = np.zeros_like(found.table[0])
    wrong = false_alarms = 0
    for trial in trials:
        S = at_edges(agent, trial)
        np.add.at(table, (trial.classes, np.rint(in_presentations(trial, S)).astype(int)), 1)
        wrong += np.rint(S[-1]) != trial.label
        false_alarms += np.rint(in_noise(trial, S)).sum()
    assert np.array_equal(found.table[0], table)
    assert found.wrong[0] == wrong
    assert found.false_positives[0] == false_alarms


def test_wrong_outputs_are_segments_with_more_or_less_than_owed_and_half_is_too_much() -> None:
    task = Task(n_inputs=2, n_classes=2, pattern_bins=2)
    trial = Trial.from_dense(np.zeros((8, 2)), [1, 4], [0, 1], task)
    steps = np.array([
        [0.0, 0.5, 0.6, 0.0, 1.0, 1.0, 0.2, 0.2],  # right everywhere
        [0.6, 0.5, 0.6, 0.0, 1.0, 1.0, 0.2, 0.2],  # noise before the first
        [0.5, 0.5, 0.6, 0.0, 1.0, 1.0, 0.2, 0.2],  # exactly ½ in noise, a mistake as in a stream
        [0.0, 0.2, 0.2, 0.0, 1.0, 1.6, 0.2, 0.4],  # too few, too many, noise at the end
    ])  # fmt: skip
    S = np.concatenate([np.zeros((4, 1)), np.cumsum(steps, axis=1)], axis=1)
    assert wrong_outputs(trial, S).tolist() == [0, 1, 1, 3]


def test_training_brings_the_sum_near_what_is_owed() -> None:
    agent = make(RULES[2])
    history = train_many([agent], TASK, PATTERNS, 4_000, seed=1)
    assert history.mean_error[-1, 0] < 0.5 * history.mean_error[0, 0]
    assert 0.0 < history.error_rate[-1, 0] < history.error_rate[0, 0] < 1.0


@pytest.mark.slow
def test_two_classes_come_to_give_one_and_two() -> None:
    """The defaults of the task, aggregate label, α 0.3, 60,000 trials, 8 seeds."""
    task = Task(n_classes=2)
    alone, within = [], []
    for seed in range(8):
        patterns = Patterns.draw(task, seed)
        agent = ContinuousAgent(ContinuousGNM(alpha=0.3), AggregateLabel(), 100, seed)
        train_many([agent], task, patterns, 60_000, seed)
        alone.append(np.abs(outputs_alone(agent, patterns) - task.owed))
        in_trials = outputs_in_trials(agent, task, patterns, 100, seed=1_000 + seed)
        within.append([np.median(np.abs(S - c - 1)) for c, S in enumerate(in_trials)])
    assert np.median(alone, axis=0).max() <= 0.15
    assert np.median(within, axis=0).max() <= 0.15


@timed
@pytest.mark.parametrize("rule", RULES, ids=["all", "et", "et modulated"])
def test_sixty_thousand_trials_take_a_second_at_most(rule: Rule) -> None:
    task = Task(n_classes=2)
    patterns = Patterns.draw(task, 0)
    train_many([ContinuousAgent(ContinuousGNM(), rule, 100)], task, patterns, 1, 0, threads=1)
    agent = ContinuousAgent(ContinuousGNM(), rule, 100)
    began = time.process_time()
    train_many([agent], task, patterns, 60_000, 0, threads=1)
    assert time.process_time() - began < 1.0
