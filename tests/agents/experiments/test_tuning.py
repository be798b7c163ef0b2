"""The search: the same tries for every entry, and the best of them by what a store holds."""

from __future__ import annotations

import json

import numpy as np
import pytest
import xarray as xr

from agents.experiments import tuning
from agents.experiments.training import make_agent
from gnm_env import Task


def test_every_rule_for_a_single_neuron_takes_part_but_the_tempotron() -> None:
    from agents.registry import rules

    taking_part = {entry.setting["rule"] for entry in tuning.RULES.values()}
    shipped = {
        name
        for name, kind in rules().items()
        if kind.__module__.startswith(("agents.learning", "agents.network"))
    }
    assert shipped - taking_part == {"tempotron", "bp"}


def test_every_entry_has_as_many_tries_and_each_of_them_makes_an_agent() -> None:
    for name, entry in tuning.entries().items():
        tried = tuning.tries(entry)
        assert len(tried) == tuning.TRIES, name
        assert len({json.dumps(one) for one in tried}) == tuning.TRIES, name
        for setting in tried:
            make_agent({"pattern_seed": 0, **tuning.for_trials(setting, 100)}, Task())


def test_the_tries_lie_where_the_search_says() -> None:
    tried = tuning.tries(tuning.entries()["GNM, PeakError"])[1:]
    assert all(0.06 <= one["alpha"] <= 0.4 for one in tried)
    assert all(0.9e-3 <= one["learning_rate"] <= 60e-3 for one in tried)
    assert {one["weight_bounds"] for one in tried} == {(0.0, 1.0), (-0.4, 0.4), None}
    assert {one["start"] for one in tried} == {"matched", "wide"}
    assert sum(one["falling"] for one in tried) > sum(not one["falling"] for one in tried)
    others = tuning.tries(tuning.entries()["MST, PeakError"])[1:]
    assert [one["learning_rate"] for one in others] == [one["learning_rate"] for one in tried]
    assert all(one["tau_s"] == one["tau_m"] / 4 for one in others)


def test_a_falling_rate_falls_over_the_whole_training() -> None:
    setting = {"neuron": "gnm", "rule": "all", "weight_bounds": [-1.0, 1.0], "falling": True}
    made = tuning.for_trials(setting, 500)
    assert made == {
        "neuron": "gnm", "rule": "all", "weight_bounds": (-1.0, 1.0), "decay_trials": 500
    }  # fmt: skip
    assert "decay_trials" not in tuning.for_trials({**setting, "falling": False}, 500)


def test_rules_and_neurons_choose_rows() -> None:
    assert list(tuning.entries(["GNM"], ["critical"])) == [
        "GNM, CriticalThreshold", "GNM, CriticalThreshold, amount"
    ]  # fmt: skip
    assert list(tuning.entries(["mst", "LIF"], ["et, modulated"])) == [
        "LIF, ET, modulated", "MST, ET, modulated"
    ]  # fmt: skip
    assert tuning.NETWORK in tuning.entries() and tuning.NETWORK not in tuning.entries(["GNM"])
    with pytest.raises(ValueError, match="no rule 'hebb' in the league: choose among ALL; Crit"):
        tuning.entries(None, ["hebb"])
    with pytest.raises(ValueError, match="PolicyGradient goes with the GNM only"):
        tuning.entries(["LIF"], ["PolicyGradient"])


def made_up(scores: np.ndarray) -> xr.Dataset:
    """The store of a search: two seeds, two numbers of classes, every try, three runs."""
    bins = np.broadcast_to(scores[None, None, :, None], (2, 2, tuning.TRIES, 3)).copy()
    return xr.Dataset(
        {"survived": (("pattern_seed", "classes", "try", "run"), bins)},
        {"pattern_seed": [0, 1], "classes": [2, 3], "try": range(tuning.TRIES)},
    )


def test_the_best_mean_keeps_its_settings_and_a_file_gives_them_back(tmp_path) -> None:
    scores = np.full(tuning.TRIES, 100)
    scores[5] = 900
    found = tuning.choose("LIF, MPDAL", made_up(scores))
    assert (found["try"], found["score"], found["usual"]) == (5, 900, 100)
    assert found["pattern_seeds"] == [0, 1] and found["classes"] == [2, 3]
    kept = made_up(scores).isel({"try": [0, 3, 5]})
    assert tuning.choose("LIF, MPDAL", kept) == found
    path = tmp_path / "settings.json"
    tuning.save_choices({"LIF, MPDAL": found}, path)
    tuning.save_choices({"GNM, ALL": found}, path)
    known = tuning.chosen_settings(path)
    assert list(known) == ["GNM, ALL", "LIF, MPDAL"]  # in the order of the grid
    wanted = tuning.for_trials(tuning.tries(tuning.entries()["LIF, MPDAL"])[5], 9)
    assert tuning.for_trials(known["LIF, MPDAL"], 9) == wanted


def test_the_first_stage_keeps_the_usual_settings_and_the_best_others() -> None:
    scores = np.arange(tuning.TRIES) % 30
    kept = tuning.kept_tries("GNM, PSD", made_up(scores))
    assert kept == (0, *range(23, 30))
    second = tuning.search("GNM, PSD", tuning.SIZES["full"][1], kept)
    assert second.axes[2].values == kept and second.common["trials"] == 60_000
    assert (
        second.axes[2].setting(1)["learning_rate"]
        == tuning.tries(tuning.entries()["GNM, PSD"])[23]["learning_rate"]
    )


def test_a_seed_that_is_not_finished_does_not_count() -> None:
    results = made_up(np.arange(tuning.TRIES))
    results["survived"].loc[{"pattern_seed": 1, "try": 3, "classes": 3}] = -1
    assert tuning.choose("GNM, ALL", results)["pattern_seeds"] == [0]
    results["survived"].loc[{"pattern_seed": 0, "try": 0}] = -1
    with pytest.raises(ValueError, match="not finished one pattern seed: run it again"):
        tuning.choose("GNM, ALL", results)


def test_the_search_hears_other_pattern_seeds_than_the_league() -> None:
    from agents.experiments.ranking import SIZES

    for size, (coarse, fine) in tuning.SIZES.items():
        assert not set(coarse.seeds) & set(fine.seeds)
        assert max(*coarse.seeds, *fine.seeds) < 100 <= min(SIZES[size][0])
    experiment = tuning.search("GNM, PSD", tuning.SIZES["full"][0])
    assert experiment.cells == 8 * 2 * tuning.TRIES


def test_without_settings_it_says_how_to_make_them(tmp_path) -> None:
    with pytest.raises(ValueError, match="is not there: run `gnm league"):
        tuning.chosen_settings(tmp_path / "settings.json")


def test_the_settings_that_come_with_the_package_are_tries_of_the_search() -> None:
    known = json.loads(tuning.CHOSEN.read_text("utf-8"))
    assert known["search"] == {"tries": tuning.TRIES, "kept": tuning.KEPT}
    for name, found in known["chosen"].items():
        tried = tuning.tries(tuning.entries()[name])[found["try"]]
        assert tuning.for_trials(found["settings"], 7) == tuning.for_trials(tried, 7), name
        assert found["pattern_seeds"] == [*tuning.SIZES["full"][1].seeds]
        assert found["score"] >= found["usual"]
