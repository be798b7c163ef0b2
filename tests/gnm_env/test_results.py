"""Results: recorded from any loop, whole or not there, and refused where they do not belong."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from gnm_env import suite
from gnm_env.results import Recorder, Result, Score, read_result, read_results

RUNS = suite().runs
SURVIVED = tuple(range(100, 100 + RUNS))


def recorder(folder: Path, level: str = "1class", seed: int = 100, **more: Any) -> Recorder:
    return Recorder(folder, level, seed, more.pop("learner", "Mine"), **more)


def test_what_is_recorded_is_read_back(tmp_path: Path) -> None:
    record = recorder(tmp_path / "new", parameters=7, command="python mine.py")
    record.enter(SURVIVED, heard=10)
    path = record.enter(np.array(SURVIVED) + 1, heard=20)
    result = read_result(path)
    assert (result.learner, result.level, result.pattern_seed) == ("Mine", "1class", 100)
    assert (result.parameters, result.command) == (7, "python mine.py")
    assert [score.heard for score in result.scores] == [10, 20]
    assert result.last.survived == tuple(s + 1 for s in SURVIVED)
    assert read_results(tmp_path / "new") == [result]


def test_a_second_score_at_the_same_experience_takes_the_firsts_place(tmp_path: Path) -> None:
    record = recorder(tmp_path)
    record.enter(SURVIVED, heard=10)
    result = read_result(record.enter(SURVIVED[::-1], heard=10))
    assert [score.survived for score in result.scores] == [SURVIVED[::-1]]


def test_bins_of_a_single_environment_are_counted(tmp_path: Path) -> None:
    record = recorder(tmp_path)
    env = record.watch(suite()["1class"].trial_env(100))
    env.reset(seed=0)
    bins = 1
    while not env.step(0)[2]:
        bins += 1
    assert record.heard == bins
    env.reset()
    assert record.heard == bins
    env.step(0)
    env.reset()  # before the end of the trial
    assert record.heard == bins + 1


@pytest.mark.parametrize("mode", [AutoresetMode.SAME_STEP, AutoresetMode.NEXT_STEP])
def test_bins_of_many_environments_are_counted(tmp_path: Path, mode: AutoresetMode) -> None:
    record = recorder(tmp_path)
    envs = record.watch(suite()["1class"].trial_envs(4, 100, autoreset_mode=mode))
    envs.reset(seed=0)
    resets = ended = 0
    for _ in range(700):
        resets += ended if mode == AutoresetMode.NEXT_STEP else 0
        _, _, terminated, _, _ = envs.step(np.zeros(4, np.int64))
        ended = int(terminated.sum())
    assert record.heard == 4 * 700 - resets
    assert mode == AutoresetMode.SAME_STEP or resets > 0


def test_the_watched_environment_behaves_as_the_bare_one(tmp_path: Path) -> None:
    level = suite()["2class"]
    bare = level.trial_env(100)
    watched = recorder(tmp_path, "2class").watch(level.trial_env(100))
    np.testing.assert_array_equal(bare.reset(seed=1)[0], watched.reset(seed=1)[0])
    for _ in range(50):
        one, other = bare.step(0), watched.step(0)
        np.testing.assert_array_equal(one[0], other[0])
        assert one[1:] == other[1:]


def test_an_environment_of_another_task_or_other_patterns_is_not_watched(tmp_path: Path) -> None:
    record = recorder(tmp_path)
    for env in (
        suite()["2class"].trial_env(100),
        suite()["1class"].trial_env(101),
        suite()["1class"].stream_env(100),
        gym.make("gnm/PatternTrial-1class-v0", pattern_seed=100, rate=0.1),
    ):
        with pytest.raises(ValueError, match="must be gnm/PatternTrial-1class-v0 with pattern_se"):
            record.watch(env)


def test_any_loop_over_the_streams_is_a_score(tmp_path: Path) -> None:
    record = recorder(tmp_path)
    env = record.streams()
    survived = []
    for _ in range(RUNS):
        env.reset(seed=0)  # whatever seed
        bins = 0
        while not env.step(0)[2]:
            bins += 1
        survived.append(bins)
    (result,) = read_results(tmp_path)
    assert result.last.survived == tuple(survived)
    bare = suite()["1class"].stream_env(100)
    bare.reset(seed=record.seed + 1)
    for _ in range(survived[1]):
        assert not bare.step(0)[2]
    assert bare.step(0)[2]


def test_a_stream_that_is_left_early_is_refused(tmp_path: Path) -> None:
    env = recorder(tmp_path).streams()
    env.reset()
    env.step(0)
    with pytest.raises(ValueError, match="stream 0 has not come to its end"):
        env.reset()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"level": "9class"}, "there is no level '9class'"),
        ({"pattern_seed": -1}, "pattern seed must be >= 0"),
        ({"learner": ""}, "learner must be a line of 1 … 60"),
        ({"learner": "a\nb"}, "learner must be a line"),
        ({"parameters": -3}, "parameters must be >= 0"),
    ],
)
def test_a_bad_recorder_is_refused_before_the_training(
    tmp_path: Path, arguments: dict[str, Any], message: str
) -> None:
    given = {"level": "1class", "pattern_seed": 100, "learner": "x", **arguments}
    with pytest.raises(ValueError, match=message):
        Recorder(tmp_path, **given)


@pytest.mark.parametrize(
    ("survived", "message"),
    [
        (SURVIVED[:-1], "one number for each of 100 streams, got 99"),
        ((10_001, *SURVIVED[1:]), "must lie in 0 … 10000"),
        ((-1, *SURVIVED[1:]), "must lie in 0 … 10000"),
        (np.full(RUNS, 0.5), "whole numbers"),
        ("x", "survived"),
    ],
)
def test_a_score_of_other_numbers_is_refused(tmp_path: Path, survived: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        recorder(tmp_path).enter(survived, heard=1)
    assert not list(tmp_path.iterdir())


def changed(path: Path, change: Callable[[dict[str, Any]], Any]) -> None:
    contents = json.loads(path.read_text())
    change(contents)
    path.write_text(json.dumps(contents))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda c: c.update(format_version=2), "format version 2, and this gnm-env reads 1"),
        (lambda c: c.update(level_version=1), "level version 1, and this gnm-env reads 0"),
        (lambda c: c.update(format="x"), "is not a result: give files that"),
        (lambda c: c["task"].update(rate=0.1), "its task is another than that of level 1class"),
        (lambda c: c.update(level="2class"), "its task is another than that of level 2class"),
        (lambda c: c.update(level="9class"), "there is no level '9class'"),
        (lambda c: c.update(evaluation_seed=5), "its evaluation seed is another"),
        (lambda c: c.update(pattern_seed=101), "its evaluation seed is another"),
        (lambda c: c.update(cap=5), "its cap is another"),
        (lambda c: c["scores"][0]["survived"].pop(), "one number for each of 100 streams"),
        (lambda c: c["scores"][0].update(more=1), "more"),
        (lambda c: c.update(scores=[]), "scores must be 1 … 1000"),
        (lambda c: c.update(scores=3), "not iterable"),
        (lambda c: c.pop("learner"), "'learner' is missing"),
        (lambda c: c.update(more=1), "'more' does not belong there"),
        (lambda c: c["scores"][0].update(seconds=float("nan")), "seconds must be finite"),
    ],
)
def test_a_file_of_anything_else_is_refused_in_one_sentence(
    tmp_path: Path, change: Callable[[dict[str, Any]], Any], message: str
) -> None:
    path = recorder(tmp_path).enter(SURVIVED, heard=1)
    changed(path, change)
    with pytest.raises(ValueError, match=message) as refused:
        read_result(path)
    assert "\n" not in str(refused.value)
    assert path.name in str(refused.value)


@pytest.mark.parametrize("damage", [b"", b"{", b"[1]", b"\xff\xfe", b"[" * 100_000])
def test_a_damaged_file_is_refused(tmp_path: Path, damage: bytes) -> None:
    path = tmp_path / "x.json"
    path.write_bytes(damage)
    with pytest.raises(ValueError, match=r"x\.json is not a"):
        read_result(path)


def test_folders_without_results_or_with_the_same_twice_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="there is no folder"):
        read_results(tmp_path / "none")
    with pytest.raises(ValueError, match="there is no result in"):
        read_results(tmp_path)
    path = recorder(tmp_path).enter(SURVIVED, heard=1)
    (tmp_path / "copy.json").write_bytes(path.read_bytes())
    with pytest.raises(ValueError, match="two results of 'Mine' on level 1class, pattern seed 100"):
        read_results(tmp_path)


def test_scores_come_by_experience() -> None:
    first, second = (Score(heard, 0.0, SURVIVED) for heard in (1, 2))
    with pytest.raises(ValueError, match="by bins heard, ascending"):
        Result("1class", 100, "x", (second, first))
