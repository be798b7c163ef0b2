"""Levels: ids of fixed difficulty, and the loader that makes them."""

from __future__ import annotations

import json
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import check_env

from agents.experiments.training import evaluation_seed
from gnm_env import Patterns, Task, suite
from gnm_env.levels import LEVELS, PATTERN_SEEDS, TUNING_SEEDS, Level

each_level = pytest.mark.parametrize("level", LEVELS, ids=lambda level: level.name)


@each_level
def test_both_ids_of_a_level_are_its_task(level: Level) -> None:
    for id in (level.trial_id, level.stream_id):
        env = gym.make(id, pattern_seed=7).unwrapped
        assert env.task == level.task
        assert env.patterns == Patterns.draw(level.task, 7) == level.patterns(7)
        assert EnvSpec.from_json(gym.spec(id).to_json()).kwargs.keys() == level.fields.keys()


@each_level
def test_a_level_is_an_environment_as_gymnasium_wants_it(level: Level) -> None:
    check_env(level.trial_env(1).unwrapped, skip_render_check=True)
    check_env(level.stream_env(1).unwrapped, skip_render_check=True)


@each_level
def test_a_level_has_its_native_vector_environment(level: Level) -> None:
    envs = level.trial_envs(3, pattern_seed=2, feedback="dense")
    assert envs.unwrapped.task == level.task
    single = [level.trial_env(2, feedback="dense") for _ in range(3)]
    bits, _ = envs.reset(seed=5)
    for k, env in enumerate(single):
        np.testing.assert_array_equal(bits[k], env.reset(seed=5 + k)[0])


def test_levels_differ_and_the_first_is_the_default_task() -> None:
    assert len({level.task for level in LEVELS}) == len({level.name for level in LEVELS})
    assert suite()["1class"].task == Task()


def test_levels_are_found_by_name_and_by_either_id() -> None:
    for level in LEVELS:
        assert suite()[level.name] is suite()[level.trial_id] is suite()[level.stream_id] is level
    assert list(suite()) == [level.name for level in LEVELS]
    assert "2class" in suite() and "5class" not in suite()


@pytest.mark.parametrize(
    ("name", "near"),
    [("2clas", "2class"), ("gnm/PatternTrial-2clss-v0", "gnm/PatternTrial-2class-v0")],
)
def test_a_level_that_is_not_there_is_refused_with_the_near_ones(name: str, near: str) -> None:
    with pytest.raises(ValueError, match=f"no level .*near it are .*'{near}'.*the levels are 1cl"):
        suite()[name]


@pytest.mark.parametrize("name", [None, 3, "", "no such thing at all", ["1class"]])
def test_what_is_near_nothing_is_refused_with_all_levels(name: object) -> None:
    with pytest.raises(ValueError, match="the levels are 1class, 2class"):
        suite()[name]  # type: ignore[index]


def test_gymnasium_refuses_an_id_that_is_not_there_with_the_near_ones() -> None:
    with pytest.raises(gym.error.NameNotFound, match="Did you mean"):
        gym.make("gnm/PatternTrial-2clas-v0")


def test_scores_are_taken_on_the_leagues_streams_and_seeds_to_tune_on_are_others() -> None:
    level = suite()["3class"]
    assert level.evaluation_seed(104) == evaluation_seed(3, 104) == 30_104_000
    assert not set(PATTERN_SEEDS) & set(TUNING_SEEDS)
    streams = {suite()[name].evaluation_seed(s) for name in ("1class", "4class") for s in range(9)}
    assert np.diff(sorted(streams)).min() >= suite().runs


def test_the_streams_of_the_league_are_its_own() -> None:
    from agents.experiments.league import FIRST_SEED, SEEDS

    assert PATTERN_SEEDS[0] == FIRST_SEED
    assert len(PATTERN_SEEDS) == SEEDS["full"][0]


def test_the_fields_of_a_level_go_into_a_file() -> None:
    for level in LEVELS:
        assert Task(**json.loads(json.dumps(dict(level.fields)))) == level.task


def test_the_page_lists_every_level_with_its_fields() -> None:
    page = (Path(__file__).parents[2] / "docs" / "environments" / "suite.md").read_text("utf-8")
    for level in LEVELS:
        fields = ", ".join(f"`{name}={value!r}`" for name, value in level.fields.items())
        assert f"| `{level.name}` | {level.about} | {fields} |" in page
