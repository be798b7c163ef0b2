"""Traces, rising edges and episode seeds: right by the formula, equal in single and vector form."""

from __future__ import annotations

import pickle
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode, SyncVectorEnv, VectorEnv
from numpy.typing import NDArray

import gnm_env  # noqa: F401  registers the environments
from gnm_env import PatternStreamEnv
from gnm_env.wrappers import (
    RisingEdge,
    SeededEpisodes,
    SynapticTrace,
    VectorRisingEdge,
    VectorSynapticTrace,
)

STREAM, TRIAL = "gnm/PatternStream-v0", "gnm/PatternTrial-v0"
EVERYTHING: dict[str, Any] = {
    "decays": (0.3, 0.05),
    "scale": 0.5,
    "previous_action": True,
    "own_decay": 0.1,
}
MODES = [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP]


def play(env: gym.Env, actions: NDArray[Any], seed: int | None = 3) -> NDArray[Any]:
    """Observations (1 + steps, width) of one episode, at most as long as `actions`."""
    rows = [env.reset(seed=seed)[0]]
    for action in actions:
        observation, _, terminated, truncated, _ = env.step(int(action))
        rows.append(observation)
        if terminated or truncated:
            break
    return np.array(rows)


def some_actions(steps: int, probability: float = 0.05) -> NDArray[Any]:
    return (np.random.default_rng(8).random(steps) < probability).astype(np.int64)


@pytest.mark.parametrize("decays", [(0.3,), (1.0, 0.05), 0.1])
def test_traces_follow_the_recursion_and_are_scaled_by_their_standard_deviation(decays):
    actions = some_actions(80)
    bits = play(gym.make(TRIAL), actions).astype(float)
    traces = play(SynapticTrace(gym.make(TRIAL), decays=decays, scale=0.5), actions)
    p, alphas = 0.005, np.atleast_1d(decays)
    x = np.zeros((len(alphas), 100))
    for t, row in enumerate(bits):
        x = (1 - alphas)[:, None] * x + row
        deviation = np.sqrt(p * (1 - p) / (1 - (1 - alphas) ** 2))
        np.testing.assert_allclose(traces[t], (0.5 * x / deviation[:, None]).ravel(), rtol=1e-5)


@pytest.mark.parametrize(("arguments", "scale"), [({}, 1 / 3), ({"scale": 1.0}, 1.0)], ids=str)
def test_a_trace_of_noise_has_the_standard_deviation_that_scale_says(arguments, scale):
    bare = gym.make(STREAM, onset_probability=0.0, rate=0.02)
    traces = play(SynapticTrace(bare, decays=(0.3, 1.0), **arguments), np.zeros(3000, np.int64))[
        50:
    ]
    # 300,000 correlated values in each half; the estimate's own spread is about 1 %.
    assert traces[:, :100].var() == pytest.approx(scale**2, rel=0.1)
    assert traces[:, 100:].var() == pytest.approx(scale**2, rel=0.1)


def test_previous_action_and_own_spike_trace_follow_the_inputs():
    actions = np.array([1, 1, 0, 0, 1, 0])
    env = SynapticTrace(gym.make(TRIAL), previous_action=True, own_decay=0.1)
    own = play(env, actions)[:, 100:]
    assert own[:, 0].tolist() == [0, 1, 1, 0, 0, 1, 0]
    expected = [0.0]
    for action in actions:
        expected.append(0.9 * expected[-1] + action)
    np.testing.assert_allclose(own[:, 1], expected, rtol=1e-6)


def test_traces_and_levels_begin_anew_in_every_episode():
    env = SynapticTrace(RisingEdge(gym.make(TRIAL, background_bins=3)), **EVERYTHING)
    first = play(env, np.ones(1000, np.int64))
    again = play(env, np.ones(1000, np.int64))
    np.testing.assert_array_equal(first, again)
    assert first[0, -2:].tolist() == [0, 0]
    assert len(first) > 3


def test_observations_handed_out_are_never_altered():
    env = SynapticTrace(gym.make(TRIAL), **EVERYTHING)
    kept = [env.reset(seed=1)[0]]
    copies = [kept[0].copy()]
    for action in some_actions(50, 0.5):
        kept.append(env.step(int(action))[0])
        copies.append(kept[-1].copy())
    np.testing.assert_array_equal(kept, copies)


@pytest.mark.filterwarnings("ignore:.*is different from the unwrapped version")
@pytest.mark.parametrize("id_", [TRIAL, STREAM])
@pytest.mark.parametrize("wrap", [SynapticTrace, RisingEdge], ids=lambda w: w.__name__)
def test_wrapped_environments_pass_the_checker(id_, wrap):
    arguments = EVERYTHING if wrap is SynapticTrace else {}
    check_env(wrap(gym.make(id_).unwrapped, **arguments))


def test_wrapped_environments_pass_the_checker_of_stable_baselines():
    checker = pytest.importorskip("stable_baselines3.common.env_checker")
    checker.check_env(SynapticTrace(RisingEdge(gym.make(TRIAL)), **EVERYTHING))


def test_specs_rebuild_the_wrapped_environment():
    env = SeededEpisodes(SynapticTrace(RisingEdge(gym.make(STREAM, n_classes=2)), **EVERYTHING), 5)
    assert env.spec is not None
    twin = gym.make(gym.envs.registration.EnvSpec.from_json(env.spec.to_json()))
    actions = some_actions(300)
    np.testing.assert_array_equal(play(env, actions), play(twin, actions))
    assert isinstance(twin, SeededEpisodes)


def test_wrapped_environments_pickle():
    env = SynapticTrace(RisingEdge(PatternStreamEnv()), **EVERYTHING)
    env.reset(seed=2)
    twin = pickle.loads(pickle.dumps(env))
    np.testing.assert_array_equal(env.step(0)[0], twin.step(0)[0])


def test_a_level_that_stays_up_spikes_once():
    env = RisingEdge(gym.make(TRIAL, feedback="dense", mean_occurrences=0.0))
    env.reset(seed=0)
    # Every spike into noise costs 1.
    costs = [-env.step(level)[1] for level in (0, 1, 1, 1, 0, 1)]
    assert costs == [0, 1, 0, 0, 0, 1]


def vector(
    mode: AutoresetMode, wrap: Any, twin: Any, **arguments: Any
) -> tuple[VectorEnv, VectorEnv]:
    """Wrapped inside each environment, and wrapped as a vector."""
    makers = [PatternStreamEnv] * 4
    inside = SyncVectorEnv([lambda: wrap(PatternStreamEnv(), **arguments)] * 4, autoreset_mode=mode)
    return inside, twin(SyncVectorEnv(makers, autoreset_mode=mode), **arguments)


@pytest.mark.parametrize("mode", MODES, ids=lambda mode: mode.name)
@pytest.mark.parametrize(
    ("wrap", "twin", "arguments"),
    [(SynapticTrace, VectorSynapticTrace, EVERYTHING), (RisingEdge, VectorRisingEdge, {})],
    ids=["trace", "edge"],
)
def test_vector_twins_equal_the_single_wrappers_bit_by_bit(mode, wrap, twin, arguments):
    single, vectorised = vector(mode, wrap, twin, **arguments)
    assert vectorised.single_observation_space == single.single_observation_space
    np.testing.assert_array_equal(single.reset(seed=4)[0], vectorised.reset(seed=4)[0])
    rng, episodes = np.random.default_rng(1), 0
    for _ in range(400):
        actions = (rng.random(4) < 0.1).astype(np.int64)
        ours, theirs = single.step(actions), vectorised.step(actions)
        for ours_part, theirs_part in zip(ours[:4], theirs[:4], strict=True):
            np.testing.assert_array_equal(ours_part, theirs_part)
        over = ours[2] | ours[3]
        episodes += over.sum()
        if mode is AutoresetMode.SAME_STEP:
            for env in np.flatnonzero(over):
                np.testing.assert_array_equal(
                    ours[4]["final_obs"][env], theirs[4]["final_obs"][env]
                )
    assert episodes > 20


def test_vector_twins_follow_partial_resets():
    single, vectorised = vector(
        AutoresetMode.DISABLED, SynapticTrace, VectorSynapticTrace, **EVERYTHING
    )
    for env in (single, vectorised):
        env.reset(seed=4)
        env.step(np.ones(4, np.int64))
    mask = np.array([True, False, True, False])
    again = [
        env.reset(seed=9, options={"reset_mask": mask.copy()})[0] for env in (single, vectorised)
    ]
    np.testing.assert_array_equal(*again)
    assert again[0][0, -1] == 0 and again[0][1, -1] == 1


def test_vector_observations_are_copies():
    env = VectorSynapticTrace(SyncVectorEnv([PatternStreamEnv] * 3))
    first, _ = env.reset(seed=1)
    kept = first.copy()
    env.step(np.zeros(3, np.int64))
    np.testing.assert_array_equal(first, kept)


def test_the_kth_reset_is_seeded_with_seed_plus_k():
    env = SeededEpisodes(gym.make(STREAM), seed=20)
    plain = gym.make(STREAM)
    for k in range(3):
        observations = [
            play(e, np.zeros(50, np.int64), seed=s) for e, s in ((env, None), (plain, 20 + k))
        ]
        np.testing.assert_array_equal(*observations)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"decays": (0.3, 0.0)}, "decays must be > 0"),
        ({"decays": (1.5,)}, "decays must be in 0 … 1"),
        ({"decays": ()}, "at least one decay, must be in 1 … 1000, got 0"),
        ({"decays": "0.3"}, "decays must be a number or a row of numbers, got '0.3'"),
        ({"decays": True}, "decays must be a number"),
        ({"decays": (0.3, True)}, "decays must be a number"),
        ({"decays": {0.3: 1}}, "decays must be a number or a row of numbers"),
        ({"decays": (0.3,) * 1001}, "must be in 1 … 1000, got 1001"),
        ({"scale": 0.0}, "scale must be > 0"),
        ({"scale": 1e300}, "traces must fit into float32.*choose a scale nearer to 1"),
        ({"scale": 5e-324}, "traces must fit into float32"),
        ({"previous_action": "no"}, "previous_action must be True or False"),
        ({"own_decay": 2.0}, "own_decay must be in 0 … 1"),
        ({"rate": -0.1}, "rate must be in 0 … 1"),
    ],
)
def test_bad_arguments_name_the_field_and_the_value(arguments, message):
    with pytest.raises(ValueError, match=message):
        SynapticTrace(gym.make(TRIAL), **arguments)


def test_environments_that_cannot_be_wrapped_are_refused_with_a_reason():
    with pytest.raises(ValueError, match="give rate="):
        SynapticTrace(gym.make("CartPole-v1"))
    with pytest.raises(ValueError, match="Box of shape"):
        SynapticTrace(gym.make("FrozenLake-v1"), rate=0.1)
    with pytest.raises(ValueError, match=r"Discrete\(2\)"):
        RisingEdge(gym.make(TRIAL, output="graded"))
    with pytest.raises(ValueError, match="seed must be a whole number"):
        SeededEpisodes(gym.make(STREAM), seed=0.5)
    with pytest.raises(ValueError, match="env must be a gymnasium VectorEnv"):
        VectorSynapticTrace(gym.make(STREAM))


@pytest.mark.parametrize("action", [2, 0.5, "1", None, float("nan"), np.array([0, 1])], ids=repr)
def test_a_level_is_0_or_1_and_nothing_that_becomes_it(action):
    env = RisingEdge(gym.make(STREAM))
    env.reset()
    with pytest.raises(ValueError, match=r"action must be 0 .silent. or 1"):
        env.step(action)
    many = VectorRisingEdge(gym.make_vec(STREAM, 2))
    many.reset()
    for actions in ([0, action], [[0], [1]], "01"):
        with pytest.raises(ValueError, match="actions must be 2 levels of 0 or 1"):
            many.step(actions)


@pytest.mark.parametrize("extra", [{"previous_action": True}, {"own_decay": 0.1}], ids=str)
def test_own_spikes_are_not_traced_where_actions_are_amounts(extra):
    SynapticTrace(gym.make(TRIAL, output="graded"))
    with pytest.raises(ValueError, match=r"the actions must be Discrete\(2\), got Box"):
        SynapticTrace(gym.make(TRIAL, output="graded"), **extra)
    many = gym.make_vec(TRIAL, 2, vectorization_mode="vector_entry_point", output="graded")
    with pytest.raises(ValueError, match=r"the actions must be Discrete\(2\), got Box"):
        VectorSynapticTrace(many, **extra)
