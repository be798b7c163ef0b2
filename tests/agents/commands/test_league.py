"""The league: what a cell holds, the ends of its scale, the table and the picture."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from agents.commands import league as command
from agents.commands.terminal import parse
from agents.experiments import league, ranking, tuning
from agents.experiments.design import Block
from agents.experiments.league import (
    FINAL,
    MILESTONES,
    NEURON_LEARNERS,
    RL_LEARNERS,
    learn_and_score,
)
from agents.experiments.sweep import sweep
from agents.experiments.training import class_counts, pattern_seeds, training
from agents.experiments.workers import threads


def cell(setting: dict[str, Any], **changes: Any) -> dict[str, Any]:
    """The results of one learner on one class, first and only cell of a block."""
    full = {"classes": 1, "pattern_seed": 100, "runs": 20, "cap": 400, **setting, **changes}
    values = learn_and_score(Block(0, ((0, 1),) * 3, (full,), "a test"))
    return {name: array[0, 0, 0] for name, array in values.items()}


def test_the_oracle_scores_the_cap():
    survived = cell(NEURON_LEARNERS["oracle"], classes=2)["survived"]
    assert np.all(survived[FINAL] == 400)


def test_silence_scores_what_the_arithmetic_says():
    values = cell(NEURON_LEARNERS["silent"], runs=400, cap=10_000)
    # Standard deviation of a run 100 bins, of the mean 5; five of them: a false alarm in a million.
    assert values["survived"][FINAL].mean() == pytest.approx(148, abs=25)
    assert values["parameters"] == 0
    assert np.all(values["survived"][:FINAL] == -1)


def test_random_spikes_are_worse_than_silence():
    assert cell(NEURON_LEARNERS["random spikes"], runs=100)["survived"][FINAL].mean() < 120


def test_a_neuron_is_scored_at_the_milestones_within_its_budget_and_at_its_end():
    values = cell(NEURON_LEARNERS["GNM, ALL"], trials=2_000)
    heard = values["heard"].tolist()
    assert heard == [100_000, 200_000, 400_000, *[-1] * (FINAL - 3), 400_000]
    assert np.isfinite(values["seconds"][[0, 1, 2, FINAL]]).all()
    assert np.isnan(values["seconds"][3:FINAL]).all()
    assert values["parameters"] == 100


def test_the_last_score_is_that_of_a_neuron_trained_in_one_go():
    from agents import noisy_performance, train_many
    from agents.experiments.training import evaluation_seed, make_agent, training_seed
    from gnm_env import Patterns, Task

    setting = {**NEURON_LEARNERS["GNM, ALL"], "trials": 3_000}
    task, patterns = Task(), Patterns.draw(Task(), 100)
    agent = make_agent({**setting, "pattern_seed": 100}, task)
    train_many([agent], task, patterns, 3_000, training_seed(1, 100))
    survived = noisy_performance(agent, task, patterns, 20, 400, evaluation_seed(1, 100))
    np.testing.assert_array_equal(cell(setting)["survived"][FINAL], survived)


def test_an_rl_agent_is_scored_between_rollouts():
    pytest.importorskip("stable_baselines3")
    values = cell(RL_LEARNERS["PPO linear, cost"], most=110_000, runs=3, cap=50)
    assert values["heard"].tolist() == [114_688, *[-1] * (FINAL - 1), 114_688]
    assert values["seconds"][0] > 0
    assert values["parameters"] == 102 * 2 + 2 + 102 + 1


def test_on_more_classes_than_it_has_bins_for_a_learner_is_not_trained():
    values = cell(RL_LEARNERS["PPO linear, cost"], classes=3, runs=3, cap=50)
    assert np.all(values["survived"] == -1) and np.all(values["heard"] == -1)


def made_up(learners: dict[str, float], seeds: int = 4) -> xr.Dataset:
    """A part of the league in which each learner has a known mean score."""
    rng = np.random.default_rng(0)
    shape = (1, len(learners), seeds, FINAL + 1)
    means = np.array(list(learners.values()))[:, None, None]
    score = means + 10.0 * rng.standard_normal(shape)
    heard = np.broadcast_to([*MILESTONES, 20_000_000], shape)
    dims = ("classes", "learner", "pattern_seed", "milestone")
    return xr.Dataset(
        {
            "score": (dims, score),
            "heard": (dims, heard),
            "seconds": (dims, np.ones(shape)),
            "parameters": (dims[:3], np.full(shape[:3], 102)),
        },
        {
            "classes": [1],
            "learner": np.array(list(learners), object),
            "pattern_seed": range(seeds),
            "milestone": [*MILESTONES, -1],
        },
        {"budget": {1: MILESTONES[4]}},
    )


def test_the_table_puts_the_best_first_with_its_numbers():
    parts = [made_up({"GNM, ALL": 500.0, "silent": 148.0}), made_up({"PPO, cost": 9_000.0})]
    table = league.rows(parts)
    assert [row["learner"] for row in table] == ["PPO, cost", "GNM, ALL", "silent"]
    first = table[0]
    assert first["last"]["mean"] == pytest.approx(9_000, abs=20)
    low, high = first["last"]["ci95"]
    assert low <= first["last"]["mean"] <= high
    assert first["equal_experience"] == 1_600_000 and first["seeds"] == 4
    text = league.text_table(table)
    assert text.index("PPO, cost") < text.index("silent")
    assert len({len(line) for line in text.splitlines() if line.startswith("|")}) == 1


def test_what_is_not_finished_is_left_out_of_table_and_picture(tmp_path):
    part = made_up({"GNM, ALL": 500.0, "LIF, ALL": 700.0, "PPO, cost": 9_000.0})
    part["score"].loc[{"learner": "GNM, ALL"}] = np.nan
    part["score"].loc[{"learner": "LIF, ALL", "pattern_seed": 2}] = np.nan
    table = league.rows([part])
    assert [(row["learner"], row["seeds"]) for row in table] == [("PPO, cost", 4), ("LIF, ALL", 3)]
    assert all(path.exists() for path in league.draw([part], tmp_path))


def test_without_any_league_so_far_it_says_so(tmp_path):
    pytest.importorskip("stable_baselines3")
    with pytest.raises(ValueError, match=r"there is no league in .* leave --so-far out"):
        command.main(parse(command, ["--so-far", "--out", tmp_path]))


def test_the_picture_is_drawn_from_the_results_alone(tmp_path):
    parts = [made_up({"GNM, ALL": 500.0}), made_up({"PPO, cost": 9_000.0})]
    paths = league.draw(parts, tmp_path)
    assert [path.name for path in paths] == ["league.png", "league.pdf"]
    assert all(path.stat().st_size > 5_000 for path in paths)


def test_every_learner_that_learns_has_a_style_of_its_own():
    learning = {n for n, s in NEURON_LEARNERS.items() if "reference" not in s}
    learning |= {n for n, s in RL_LEARNERS.items() if s["bins"] != (0, 0)}
    assert learning == set(league.STYLES)
    assert len(set(league.STYLES.values())) == len(league.STYLES)


def ranked(folder: Path, name: str, bins: int) -> None:
    """The store of a learner of the part "rules" that survives so many bins throughout."""

    def survives(block: Block) -> dict[str, Any]:
        return {
            "survived": np.full((*block.shape, 100), bins),
            "error_rate": np.zeros(block.shape),
        }

    wanted = replace(ranking.ranking(name, "quick", (100, 101, 102)), compute=survives)
    with threads(1) as executor:
        sweep(wanted, folder / "rules" / tuning.folder_name(name), executor)


def test_the_part_rules_is_told_and_drawn_from_what_is_finished(tmp_path, capsys):
    ranked(tmp_path, ranking.PAPER, 700)
    told = command.main(parse(command, ["--part", "rules", "--so-far", "--out", tmp_path]))
    assert told["rules"][ranking.PAPER]["2"]["101"][0] == 700
    assert "| A | GNM, ALL as published | 3 | 700 (700 … 700)" in capsys.readouterr().out
    kept = {path.name for path in tmp_path.iterdir()}
    assert kept >= {"rules.md", "scores.json", "front.png"}


def test_all_learners_hear_one_pattern_seed_before_the_next(tmp_path):
    heard = []

    def note(block: Block) -> dict[str, Any]:
        heard.append((block.settings[0]["pattern_seed"], block.settings[0]["rule"]))
        return {"survived": np.zeros((*block.shape, 100)), "error_rate": np.zeros(block.shape)}

    rows = {
        rule: training("a toy", "", (pattern_seeds((3, 5)), class_counts(2)), rule=rule)
        for rule in ("all", "et")
    }
    rows = {name: replace(row, compute=note) for name, row in rows.items()}
    with threads(1) as executor:
        command._seed_by_seed(rows, tmp_path, executor, repair=False)
    assert heard == [(3, "all"), (3, "et"), (5, "all"), (5, "et")]


@pytest.mark.parametrize("words", [["--rules", "hebb"], ["--neurons", "pyramidal"]])
def test_a_row_that_there_is_not_is_refused_before_anything_is_trained(words, tmp_path):
    with pytest.raises(ValueError, match="in the league: choose among"):
        command.main(parse(command, [*words, "--out", tmp_path]))
    with pytest.raises(ValueError, match="belong to --part rules: add it, or leave them out"):
        command.main(parse(command, ["--rules", "all", "--part", "rl"]))
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_a_search_and_its_league_run_from_end_to_end(tmp_path, monkeypatch):
    monkeypatch.setattr(ranking, "TRIALS", 300)
    monkeypatch.setitem(ranking.SIZES, "quick", ((7,), (1,)))
    stages = (tuning.Stage((3,), 100, (1,)), tuning.Stage((4,), 300, (1,)))
    monkeypatch.setitem(tuning.SIZES, "quick", stages)
    words = ["--tune", "--rules", "all", "--neurons", "GNM", "--out", tmp_path]
    told = command.main(parse(command, words))
    assert list(told["rules"]["GNM, ALL"]["1"]) == ["7"]
    assert tuning.chosen_settings(tmp_path / "settings.json")["GNM, ALL"]["rule"] == "all"


def test_steps_shorten_the_training_of_rl_agents_alone():
    pytest.importorskip("stable_baselines3")
    assert league.league("rl", "quick", steps=5).blocks()[0].settings[0]["most"] == 5
    assert "most" not in league.league("neurons", "quick", steps=5).blocks()[0].settings[0]


@pytest.mark.parametrize("size", ["quick", "full"])
def test_the_rl_part_is_data_that_a_store_can_keep(size):
    pytest.importorskip("stable_baselines3")
    experiment = league.league("rl", size)
    assert experiment.settings()["axes"]["pattern_seed"][0] == 100
    assert len(experiment.blocks()) == experiment.cells
