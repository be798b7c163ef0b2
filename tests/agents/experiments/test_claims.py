from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import xarray as xr

from agents.experiments.design import Setting
from agents.experiments.listing import claims, experiments
from agents.experiments.reactions import MOLECULES, TRACED
from agents.experiments.verdict import MISSING, NOT_REPRODUCED, REPRODUCED, Finding
from tests.agents.experiments.worlds import BEST, Score, as_in_the_paper, world

BY_ID = {claim.id: claim for claim in claims()}
ELSEWHERE = ("D1", "D2", "D3", "D4", "D5", "D6", "D7", "F6c", "S2")
"""Judged in tests of their own subjects."""

LISTED = [
    *ELSEWHERE,
    *("F1b", "F1c", "F1d", "F2", "F3a", "F3b", "F3c", "F3d", "F3e", "F3f", "F4"),
    *("F5a", "F5b", "F6a1", "F6a2", "F6b", "F7a", "F7b", "F7c", "F8"),
    *("F3e+", "F4+", "F6a1+", "F6a2+", "F6b+", "F7a+", "F7b+"),
]
SCORED = [
    id_
    for id_ in LISTED
    if id_ not in (*ELSEWHERE, "F1b", "F1c", "F1d", "F2", "F3f", "F8", "F4+", "F6a2+")
]


def found(id_: str, score: Score = as_in_the_paper, seeds: int | None = 10) -> Finding:
    """What the rule of a claim finds in a made-up world."""
    claim = BY_ID[id_]
    finding = claim.finding(world(score, claim.needs, seeds))
    assert finding is not None
    return finding


def test_every_claim_is_judged_once_and_says_what_it_needs() -> None:
    order = sorted(LISTED, key=lambda id_: ("FSD".index(id_[0]), id_))  # figures first
    assert [claim.id for claim in claims()] == order
    for claim in claims():
        assert set(claim.needs) <= set(experiments())
        assert claim.rule.startswith("reproduced if")
        assert claim.words and claim.protocol and claim.environment


def test_a_claim_without_its_data_is_not_judged() -> None:
    assert BY_ID["F7c"].finding(world(as_in_the_paper, ["F7"], 3)) is None


@pytest.mark.parametrize("id_", SCORED)
def test_a_world_as_in_the_paper_reproduces(id_: str) -> None:
    finding = found(id_)
    assert finding.verdict == REPRODUCED, finding.numbers


def by_classes(setting: Setting) -> float:
    """A score that falls with every class, and for LIF neurons rises with the period."""
    return BEST[setting["classes"]] * (0.9 + 0.004 * setting.get("refractory", 0))


@pytest.mark.parametrize("id_", ["F4+", "F6a2+"])
def test_a_low_cap_hides_what_a_high_one_shows(id_: str) -> None:
    finding = found(id_, by_classes)
    high = [f"the condition is {name}, cap 10,000" for name in ("matched", "wide", "authors")]
    assert finding.verdict == f"{REPRODUCED} if {', or '.join(high)}"
    assert finding.forest is not None
    assert len(finding.forest.marks) == len(finding.conditions) == 7


def test_a_map_below_its_cap_is_judged_for_both_readouts_and_starts() -> None:
    finding = found("F3f", lambda setting: as_in_the_paper(setting) / 10)
    assert finding.verdict == REPRODUCED
    assert len(finding.numbers) == 3
    assert found("F3f").verdict == NOT_REPRODUCED  # all that is good reaches the cap


@pytest.mark.parametrize("id_", ["F3e", "F4", "F5b", "F6a1", "F6a2", "F6b", "F7a", "F7b"])
def test_a_claim_with_a_number_has_a_forest_plot_that_agrees_with_its_verdict(id_: str) -> None:
    finding = found(id_)
    assert finding.forest is not None
    marks = finding.forest.marks
    assert marks
    assert all(mark.holds for mark in marks)
    assert all(finding.forest.low <= mark.value.value <= finding.forest.high for mark in marks)


def flat(setting: Setting) -> float:
    """Every neuron alike: nothing that the paper found is there."""
    return 5_000.0


@pytest.mark.parametrize(
    "id_", [id_ for id_ in SCORED if id_ not in ("F5a", "F5b", "F6a1", "F6a1+", "F7c")]
)
def test_a_world_in_which_all_neurons_are_alike_does_not(id_: str) -> None:
    assert found(id_, flat).verdict == NOT_REPRODUCED


def only(start: str) -> Score:
    """As in the paper from one kind of initial weights, all alike from the other."""
    return lambda setting: (as_in_the_paper if setting["start"] == start else flat)(setting)


@pytest.mark.parametrize("start", ["matched", "wide"])
@pytest.mark.parametrize("id_", ["F3a", "F3b", "F3c", "F6a2", "F6b", "F7a"])
def test_a_claim_that_holds_from_one_start_says_which(id_: str, start: str) -> None:
    expected = f"{REPRODUCED} if the initial weights are the {start} ones"
    assert found(id_, only(start)).verdict.startswith(expected)


def test_scores_far_from_each_other_are_not_comparable() -> None:
    def half(setting: Setting) -> float:
        return flat(setting) / (2 if setting["neuron"] == "lif" else 1)

    assert found("F6a1", flat).verdict == REPRODUCED
    assert found("F6a1", half).verdict == NOT_REPRODUCED


def test_a_rise_that_the_cap_hides_shows_in_the_mistakes() -> None:
    data = world(flat, ["F6"], 10)
    survived, run = data["F6"]["survived"], np.arange(100)
    survived[:] = np.where(run < 40, 9_900, 10_000)
    for refractory in range(26):
        fewer = np.where(run < 40 - refractory, 9_900, 10_000)
        survived.loc[{"learner": f"LIF {refractory}"}] = fewer

    for id_ in ("F6a1", "F6a2"):
        finding = BY_ID[id_].finding(data)
        assert finding is not None
        assert finding.verdict == REPRODUCED
    assert "2.67 [2.67 … 2.67] times at 25 bins" in finding.numbers[0]


def test_the_form_of_error_trace_learning_is_a_condition() -> None:
    def modulated_alone(setting: Setting) -> float:
        good = setting["rule"] == "et" and setting.get("modulate")
        return 1_500.0 if good and setting["start"] == "wide" else 500.0

    expected = f"{REPRODUCED} if it is modulated ET from wide initial weights"
    assert found("F7b", modulated_alone).verdict == expected


def test_forty_of_fifty_wins_are_enough_and_thirty_nine_are_not() -> None:
    def wins(count: int) -> Score:
        def score(setting: Setting) -> float:
            ahead = setting["rule"] == "et" and setting["pattern_seed"] < count
            return 1_500.0 if ahead else 500.0 if setting["rule"] == "all" else 400.0

        return score

    assert found("F7b", wins(40), 50).verdict == REPRODUCED
    assert found("F7b", wins(39), 50).verdict == NOT_REPRODUCED


def test_a_network_that_is_better_than_error_traces_is_a_benefit() -> None:
    def deep(setting: Setting) -> float:
        return 6_000.0 if setting["neuron"] == "network" else as_in_the_paper(setting)

    assert found("F7c", deep).verdict == NOT_REPRODUCED


def test_a_benefit_that_is_one_of_the_learning_rate_alone_is_told_from_one_of_the_network() -> None:
    def fast(setting: Setting) -> float:
        if setting["neuron"] == "network":
            return 900.0 if setting.get("learning_rate_hidden") == 1e-4 else 4_000.0
        return 3_500.0 if setting.get("learning_rate") == 1e-3 else 1_500.0

    finding = found("F7c", fast)
    assert finding.verdict.startswith(f"{REPRODUCED} if at equal λ it is plain ET from matched")
    assert "tuned" not in finding.verdict


@pytest.mark.parametrize("id_", ["F6a2", "F6b", "F7c"])
def test_one_seed_has_no_interval_and_is_judged_by_its_value(id_: str) -> None:
    def unlike(setting: Setting) -> float:
        return 6_000.0 if setting["neuron"] == "network" else flat(setting)

    assert found(id_, seeds=1).verdict == REPRODUCED
    assert found(id_, unlike, seeds=1).verdict == NOT_REPRODUCED


def test_a_network_is_compared_on_the_seeds_that_it_shares_with_error_traces() -> None:
    some = world(as_in_the_paper, ["F7"], 5) | world(as_in_the_paper, ["BP"], 10)
    finding = BY_ID["F7c"].finding(some)
    assert finding is not None
    assert finding.verdict == REPRODUCED
    assert "of 5" in finding.numbers[1]
    assert "of 5" in finding.numbers[6]

    some["BP"] = some["BP"].isel(pattern_seed=slice(5, None))
    finding = BY_ID["F7c"].finding(some)
    assert finding is not None
    assert finding.verdict == MISSING
    assert finding.numbers == ("no data: F7 and BP have no pattern seed in common",)


def test_the_mst_mark_may_come_back_at_the_lower_cap_alone() -> None:
    def skewed(setting: Setting) -> float:
        return 9_000.0 if setting["start"] == "matched" else 500.0

    verdict = found("F3e", skewed).verdict
    assert "wide ones and the cap is 10,000" in verdict
    assert "wide ones and the cap is 1,000" in verdict
    assert "matched" not in verdict


def test_a_ridge_at_positive_eta_denies_that_eta_zero_is_among_the_best() -> None:
    def ridge(setting: Setting) -> float:
        return 2_000.0 if setting["eta"] >= 0.3 else 400.0

    assert found("F5a", ridge).verdict == NOT_REPRODUCED
    assert found("F5b", ridge).verdict == NOT_REPRODUCED


def test_one_run_of_five_needs_enough_runs_to_be_told_from_two() -> None:
    def some(every: int) -> Score:
        def score(setting: Setting) -> float:
            gains = setting["eta"] > 0 and setting["pattern_seed"] % every == 0
            return 2_000.0 if gains else 400.0

        return score

    assert found("F5b", some(5), 32).verdict == REPRODUCED  # 7 of 32
    assert found("F5b", some(5), 5).verdict == NOT_REPRODUCED
    assert found("F5b", some(3), 32).verdict == NOT_REPRODUCED  # 11 of 32


def test_an_optimal_line_for_more_classes_only_is_a_condition() -> None:
    def later(setting: Setting) -> float:
        return flat(setting) if setting["classes"] == 1 else as_in_the_paper(setting)

    verdict = found("F3d", later).verdict
    for classes in ("two", "three"):
        for start in ("matched", "wide"):
            assert f"the task has {classes} classes, {start} initial weights" in verdict
    assert "one class" not in verdict


def test_a_line_that_another_family_follows_better_is_not_the_papers() -> None:
    def straight(setting: Setting) -> float:
        return 9_000.0 * math.exp(-20 * abs(setting["alpha"] - setting["eta"] - 0.3))

    finding = found("F3d", straight)
    assert finding.verdict == NOT_REPRODUCED
    assert "α − η = α* -" in finding.numbers[0]


def test_figure_one_follows_from_the_equations() -> None:
    data = world(as_in_the_paper, ["F1"])
    for id_ in ("F1c", "F1d"):
        finding = BY_ID[id_].finding(data)
        assert finding is not None
        assert finding.verdict == REPRODUCED


@pytest.mark.parametrize(
    ("amounts", "verdict"), [((0.9, 2.1), REPRODUCED), ((0.9, 1.6), NOT_REPRODUCED)]
)
def test_continuous_outputs_are_compared_with_their_targets(
    amounts: tuple[float, float], verdict: str
) -> None:
    S = np.tile(amounts, (5, 1)) + 0.01 * np.arange(5)[:, None]
    data = xr.Dataset({"S": (("classes", "pattern_seed", "target"), S[None])})
    finding = BY_ID["F2"].finding({"F2": data})
    assert finding is not None
    assert finding.verdict == verdict
    assert finding.forest is not None
    assert [mark.at for mark in finding.forest.marks] == [0.81, 0.99]


def chemistry(deviation: Any, wrong: Any, alone: tuple[float, float] = (0.9, 2.1)) -> xr.Dataset:
    """Made-up results of one pattern seed; `alone` is S of each pattern, with 1 and 2 owed."""
    spread = 1 + 0.05 * np.cos(np.arange(12))
    return xr.Dataset(
        {
            "deviation": (
                ("classes", "pattern_seed", "traced", "run"),
                (np.array(deviation)[:, None] * spread)[None, None],
            ),
            "wrong": (
                ("classes", "pattern_seed", "molecules", "heard"),
                np.array([[w + k % 2 for k in range(12)] for w in wrong])[None, None],
            ),
            "wrong_deterministic": (("classes", "pattern_seed", "heard"), np.zeros((1, 1, 12))),
            "S_alone": (("classes", "pattern_seed", "class"), np.array(alone)[None, None]),
        },
        {"molecules": list(MOLECULES), "traced": list(TRACED)},
    )


@pytest.mark.parametrize(
    ("deviation", "at_the_ends", "verdict"),
    [
        ((0.2, 0.1, 0.045), (4, 1), REPRODUCED),
        ((0.2, 0.2, 0.045), (4, 1), NOT_REPRODUCED),
        ((0.2, 0.1, 0.045), (2, 2), NOT_REPRODUCED),
    ],
)
def test_more_molecules_have_to_come_closer_and_err_less(
    deviation: tuple[float, ...], at_the_ends: tuple[int, int], verdict: str
) -> None:
    first, last = at_the_ends
    wrong = [first if m <= TRACED[0] else last for m in MOLECULES]
    finding = BY_ID["F8"].finding({"F8": chemistry(deviation, wrong)})
    assert finding is not None
    assert finding.verdict == verdict


def test_molecules_are_not_blamed_for_what_a_network_gets_wrong_by_itself() -> None:
    wrong = [4 if m <= TRACED[0] else 1 for m in MOLECULES]
    results = chemistry((0.2, 0.1, 0.045), wrong, alone=(0.9, 1.4))
    finding = BY_ID["F8"].finding({"F8": results})
    assert finding is not None
    assert finding.verdict == NOT_REPRODUCED
    assert finding.numbers[0].startswith("of 1 trained neurons 0 give both patterns")


def test_verdicts_are_the_four_that_the_report_knows() -> None:
    assert Finding(True, {}, ()).verdict == REPRODUCED
    assert Finding(False, {"it rains": False}, ()).verdict == NOT_REPRODUCED
    both = Finding(False, {"it rains": True, "it snows": True, "the sun shines": False}, ())
    assert both.verdict == f"{REPRODUCED} if it rains, or it snows"
    assert MISSING not in (REPRODUCED, NOT_REPRODUCED)
