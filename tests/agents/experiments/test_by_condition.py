from __future__ import annotations

import pytest

from agents.experiments.by_condition import CLAIMS, NAME, PICTURES
from agents.experiments.design import Setting
from agents.experiments.verdict import REPRODUCED, Finding
from agents.plotting import styled
from tests.agents.experiments.worlds import Score, as_in_the_paper, world

BY_ID = {claim.id: claim for claim in CLAIMS}


def found(id_: str, score: Score, seeds: int = 10) -> Finding:
    finding = BY_ID[id_].finding(world(score, [NAME], seeds))
    assert finding is not None
    return finding


def test_every_claim_is_tried_under_every_condition_at_each_of_its_caps() -> None:
    tried = [
        *("matched, cap 1,000", "matched, cap 10,000", "wide, cap 1,000", "wide, cap 10,000"),
        *("authors, cap 1,000", "authors, cap 10,000", "D reading, cap 1,000"),
    ]
    for id_ in BY_ID:
        forest = found(id_, as_in_the_paper).forest
        assert forest is not None
        assert [mark.label for mark in forest.marks] == tried


def test_a_claim_that_holds_under_one_condition_alone_says_which() -> None:
    def code_alone(setting: Setting) -> float:
        if setting["neuron"] != "mst":
            return as_in_the_paper(setting)
        return 377.0 if setting["momentum"] == 0.4 else 9_000.0

    assert found("F3e+", code_alone).verdict == (
        f"{REPRODUCED} if the condition is authors, cap 1,000, or the condition is authors, "
        "cap 10,000"
    )


def test_a_score_at_four_classes_whose_interval_leaves_the_band_does_not_count() -> None:
    def uncertain(setting: Setting) -> float:
        if setting["classes"] < 4:
            return as_in_the_paper(setting)
        return 200.0 if setting["pattern_seed"] % 5 else 900.0

    assert "cap 10,000" not in found("F4+", uncertain).verdict


@pytest.mark.parametrize(("wins", "holds"), [(40, True), (39, False)])
def test_forty_of_fifty_wins_are_enough(wins: int, holds: bool) -> None:
    def score(setting: Setting) -> float:
        ahead = setting["rule"] == "et" and setting["pattern_seed"] < wins
        return 900.0 if ahead else 500.0 if setting["rule"] == "all" else 400.0

    assert found("F7b+", score, 50).holds is holds


def test_the_figure_has_a_panel_for_each_claim() -> None:
    with styled():
        figure = PICTURES[NAME].draw(world(as_in_the_paper, [NAME], 3))
    assert [a.get_title(loc="left")[4:] for a in figure.axes if a.get_visible()] == list(BY_ID)
