"""The ranking: what its table, its contrasts and its pictures say of scores that are known."""

from __future__ import annotations

import json

import numpy as np
import pytest
import xarray as xr

from agents.experiments import ranking, tuning
from agents.experiments.ranking import PAPER, Scores


def scores(mean: float, seeds: int = 6, first: int = 100) -> Scores:
    bins = mean + np.arange(seeds, dtype=float)
    return Scores(np.arange(first, first + seeds), bins, 1_000.0 / bins)


def made_up() -> ranking.Table:
    return {
        "GNM, CriticalThreshold": {1: scores(9_000), 2: scores(8_000)},
        "GNM, ALL": {1: scores(7_000), 2: scores(3_000)},
        "MST, ALL": {1: scores(7_500), 2: scores(2_000, first=103)},
        "GNM, PeakError": {1: scores(9_100), 2: scores(8_500)},
        "GNM, STDP": {1: scores(100), 2: scores(90)},
        PAPER: {1: scores(7_000), 2: scores(2_500)},
        tuning.NETWORK: {1: scores(8_900), 2: scores(8_100)},
    }


def test_contrasts_are_paired_on_the_seeds_that_both_have() -> None:
    found = {(c.first, c.second, c.classes): c for c in ranking.contrasts(made_up())}
    critical = found["GNM, CriticalThreshold", "GNM, ALL", 2]
    assert critical.difference == pytest.approx((5_000, 5_000, 5_000))
    assert (critical.seeds, critical.wins.wins, critical.improvement.value) == (6, 6, 1.0)
    # Of MST, ALL the seeds 103 … 108 are there: three in common, the MST's bins counted from 103.
    neurons = found["GNM, ALL", "MST, ALL", 2]
    assert neurons.seeds == 3 and neurons.difference.value == pytest.approx(1_003)
    assert ("GNM, PeakError", "GNM, ET", 2) not in found


def test_the_tables_are_markdown_split_by_feedback() -> None:
    lines = ranking.score_table(made_up()).splitlines()
    assert len({line.count("|") for line in lines}) == 1
    told = [line.split("|")[1].strip() for line in lines[2:]]
    assert told == sorted(told, key=[*ranking.FEEDBACK].index)
    assert "| A | GNM, CriticalThreshold | 6 | 9,002" in lines[2]
    assert "+5,000 (+5,000 … +5,000) | 1.00" in ranking.contrast_table(made_up())


def test_scores_are_means_over_copies_and_runs_of_what_is_finished() -> None:
    bins = np.full((2, 1, 3, 4), 500)
    bins[0, 0, 0] = 1_000
    bins[1, 0, 2, 3] = -1
    results = xr.Dataset(
        {"survived": (("pattern_seed", "classes", "copy", "run"), bins)},
        {"pattern_seed": [100, 101], "classes": [2], "copy": range(3), "run": range(4)},
        {"settings": {"common": {"cap": 1_000}}},
    )
    found = ranking.scores_of(results)[2]
    assert found.seeds.tolist() == [100]
    assert found.bins == pytest.approx([(4 * 1_000 + 8 * 500) / 12])
    # Eight mistakes; the four runs that reached the cap made none, but were heard.
    assert found.mistakes == pytest.approx([1_000 * 8 / (4 * 1_000 + 8 * 501)])


def test_rows_measured_elsewhere_join_with_their_own_seeds(tmp_path) -> None:
    path = tmp_path / "others.json"
    path.write_text('{"source": "", "scores": {"PPO, cost": {"2": {"105": 7000, "106": 8000}}}}')
    table = ranking.with_others(made_up(), path)
    assert table["PPO, cost"][2].seeds.tolist() == [105, 106]
    assert "| A′ | PPO, cost | 2 |" in ranking.score_table(table)
    assert ranking.with_others({})["PPO, cost"][2].seeds.tolist() == [*range(105, 110)]


def test_what_is_saved_is_plain_and_by_pattern_seed() -> None:
    found = json.loads(tuning.as_json(ranking.saved(made_up())))
    assert found["GNM, STDP"]["2"]["101"] == [91.0, round(1_000 / 91, 4)]


def test_a_learner_is_an_experiment_of_its_own(tmp_path) -> None:
    path = tmp_path / "settings.json"
    setting = tuning.tries(tuning.entries()["LIF, MPDAL"])[1]
    tuning.save_choices({"LIF, MPDAL": {"settings": setting}}, path)
    experiment = ranking.ranking("LIF, MPDAL", "full", (100, 101), path)
    assert experiment.shape == (2, 4, ranking.COPIES)
    first = experiment.blocks()[0]
    assert first.settings[2]["alpha"] == setting["alpha"]
    assert first.settings[2]["trials"] == ranking.TRIALS
    wanted = [*map(ranking.on_seed(experiment, 101), experiment.blocks())]
    assert wanted == [False] * 4 + [True] * 4
    assert "decay_trials" not in ranking.ranking(PAPER, "quick", None, path).common
    with pytest.raises(ValueError, match="has no settings for GNM, ALL: run `gnm league --tune`"):
        ranking.ranking("GNM, ALL", "full", None, path)


def test_the_pictures_are_drawn_from_the_scores_alone(tmp_path) -> None:
    pytest.importorskip("matplotlib")
    paths = ranking.draw(made_up(), tmp_path)
    names = {f"{name}.{ending}" for name in ("ranking", "front") for ending in ("png", "pdf")}
    assert {path.name for path in paths} == names
    assert all(path.stat().st_size > 5_000 for path in paths)


def test_folders_of_entries_are_plain_words_and_differ() -> None:
    names = [*tuning.entries(), *ranking.FIXED]
    folders = [tuning.folder_name(name) for name in names]
    assert len(set(folders)) == len(names)
    assert all(folder.replace("-", "").isascii() and " " not in folder for folder in folders)
