"""Trained agents load by name and score what they are said to score."""

from __future__ import annotations

import pytest

from agents import noisy_performance, pretrained
from agents.experiments import tuning
from agents.trained import names, published_score
from agents.trained.make import agent_name


def test_there_are_agents_of_every_neuron() -> None:
    assert {name.partition("-")[0] for name in names()} == {"gnm", "lif", "mst", "network"}


def test_every_entry_of_the_league_that_learned_has_one_on_two_classes() -> None:
    hardly_learns = {"stdp", "mstdpet"}
    for entry in tuning.entries():
        name = f"{agent_name(entry)}-2"
        assert name in names() or hardly_learns & set(name.split("-")), name


@pytest.mark.parametrize("name", names())
def test_an_agent_scores_the_very_bins_that_are_published(name: str) -> None:
    checkpoint = pretrained(name)
    assert checkpoint.task is not None and checkpoint.patterns is not None
    score = published_score(name)
    survived = noisy_performance(
        checkpoint.agent, checkpoint.task, checkpoint.patterns, score.runs, score.cap, score.seed
    )
    assert survived.mean() == pytest.approx(score.mean)
    assert score.low <= survived.mean() <= score.high
    assert score.mean > 2 * checkpoint.task.silent_score


def test_a_name_that_there_is_not_is_told_with_the_nearest() -> None:
    with pytest.raises(ValueError, match="no trained agent 'gnm-critic-2', did you mean 'gnm-crit"):
        pretrained("gnm-critic-2")


@pytest.mark.parametrize("name", [None, 3, [], "../x"])
def test_what_is_no_name_is_refused(name: object) -> None:
    with pytest.raises(ValueError, match="there is no trained agent"):
        pretrained(name)  # type: ignore[arg-type]
