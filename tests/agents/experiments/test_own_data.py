"""The league on a data set: trained on a part, scored on the rest, what cannot learn it is told."""

from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from agents import answers
from agents.commands import league
from agents.commands.terminal import parse
from agents.experiments import Axis, own_data
from agents.experiments.training import make_agent
from agents.experiments.tuning import chosen_settings, for_trials
from agents.training.many import train_many
from gnm_env import Patterns, Task, Trials

TASK = Task(onset_probability=0.05)
KNOWN = Trials.draw(TASK, Patterns.draw(TASK, 3), 200, seed=5)


def labels_only(trials: Trials) -> Trials:
    a = trials.arrays
    return Trials.from_arrays(
        a.n_inputs, trials.n_bins, trials.n_spikes, a.channels, a.bins, labels=trials.labels
    )


def by_name(rows: list[own_data.Row]) -> dict[str, own_data.Row]:
    return {row.name: row for row in rows}


def test_a_row_is_what_training_by_hand_gives() -> None:
    row = by_name(own_data.rank(KNOWN, ["GNM"], ["ALL"], epochs=3, copies=2))["GNM, ALL"]
    train, test = KNOWN.split(0.8, seed=0)
    setting = for_trials(chosen_settings()["GNM, ALL"], 3 * len(train))
    agents = [make_agent({**setting, "pattern_seed": 0, "copy": k}, train) for k in range(2)]
    train_many(agents, train, trials=3 * len(train), seed=0)
    result = answers(agents, test)
    assert row.exact == tuple((1 - result.wrong / len(test)).tolist())
    assert row.mean_error == pytest.approx(result.absolute.mean() / len(test))


def test_silence_and_the_commonest_label_stand_beside_them_best_first() -> None:
    rows = own_data.rank(KNOWN, ["GNM"], ["ALL"], epochs=1, copies=1)
    train, test = KNOWN.split(0.8, seed=0)
    assert by_name(rows)["silence"].exact == (np.mean(test.labels == 0),)
    commonest = int(np.bincount(train.labels).argmax())
    name = f"always {commonest}, the commonest label"
    assert by_name(rows)[name].exact == (np.mean(test.labels == commonest),)
    exact = [float(np.mean(row.exact)) for row in rows]
    assert exact == sorted(exact, reverse=True)


def test_a_rule_that_has_to_know_more_is_told_with_the_reason() -> None:
    rows = own_data.rank(labels_only(KNOWN), ["GNM"], ["ET"], epochs=1, copies=1)
    refused = [row for row in rows if row.refused]
    assert {row.name for row in refused} == {"GNM, ET", "GNM, ET, modulated"}
    assert "presentations" in refused[0].refused
    text = own_data.markdown(rows)
    assert text.splitlines()[-1] == f"- GNM, ET; GNM, ET, modulated: {refused[0].refused}"


def test_the_command_ranks_a_file_and_keeps_the_table(tmp_path: Path) -> None:
    KNOWN.save(tmp_path / "mine.npz")
    words: list[Any] = ["--trials", tmp_path / "mine.npz", "--rules", "all", "--neurons", "GNM"]
    told = league.main(parse(league, [*words, "--epochs", 1, "--out", tmp_path]))
    assert Path(told["table"]).read_text("utf-8").count("GNM, ALL") == 1
    assert {"silence", "GNM, ALL"} < {row["name"] for row in json.loads(json.dumps(told))["rows"]}


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (["--by", "voice"], "--by belongs to --trials"),
        (["--epochs", 3], "--epochs belongs to --trials"),
        (["--trials", "mine.npz", "--so-far"], "--so-far is of the league on drawn streams"),
        (["--trials", "mine.npz", "--part", "rl"], "--part is of the league on drawn streams"),
        (["--trials", "mine.npz", "--jobs", 1], "--jobs is of the league on drawn streams"),
        (["--trials", "mine.npz", "--size", "quick"], "--size is of the league on drawn"),
    ],
)
def test_options_that_do_not_go_together_are_refused(words: list[Any], why: str) -> None:
    with pytest.raises(ValueError, match=why):
        league.main(parse(league, words))


def test_an_experiment_on_a_data_set_is_stored_and_is_what_training_by_hand_gives(
    tmp_path: Path,
) -> None:
    pytest.importorskip("xarray")
    from agents.experiments.store import StoreError, read
    from agents.experiments.sweep import sweep

    axes = (
        Axis("alpha", (0.1, 0.3), chunk=0),
        Axis("learner", ("ALL", "ET"), settings=({"rule": "all"}, {"rule": "et"})),
    )
    made = own_data.on_trials("mine", "Mine", KNOWN, axes, epochs=2, learning_rate=1e-3)
    with ThreadPoolExecutor(1) as executor:
        sweep(made, tmp_path / "mine", executor)
    results = read(tmp_path / "mine")
    assert results["exact"].shape == (2, 2)
    train, test = KNOWN.split(0.8, seed=0)
    setting = {"neuron": "gnm", "rule": "et", "alpha": 0.3, "learning_rate": 1e-3}
    agent = make_agent({**setting, "pattern_seed": 0}, train)
    train_many([agent], train, trials=2 * len(train), seed=0)
    by_hand = 1 - answers(agent, test).wrong[0] / len(test)
    assert float(results["exact"].sel(alpha=0.3, learner="ET")) == by_hand
    other = own_data.on_trials("mine", "Mine", KNOWN[:150], axes, epochs=2, learning_rate=1e-3)
    with ThreadPoolExecutor(1) as executor, pytest.raises(StoreError, match="trials"):
        sweep(other, tmp_path / "mine", executor)


def test_a_setting_that_nothing_takes_is_refused_when_it_is_declared() -> None:
    with pytest.raises(ValueError, match="nothing takes the setting 'rate'"):
        own_data.on_trials("x", "x", KNOWN, (Axis("rate", (0.1, 0.2)),))
