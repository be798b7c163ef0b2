from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from agents.commands.forensics import search
from agents.experiments.conditions import D_READING, MATCHED
from agents.experiments.design import Axis
from agents.experiments.forensics import (
    BEST,
    NUMBERS,
    PLACE,
    PROBES,
    SIZES,
    Found,
    Number,
    Protocol,
    Scores,
    Size,
    Way,
    best,
    coarse,
    come_back,
    confirmed,
    judged,
    named,
    neurons,
    points,
    protocols,
    ranking,
    setting,
    stage,
    unexplained,
)
from agents.experiments.forensics_page import STAGES, write
from agents.experiments.store import read, summarise
from agents.experiments.training import class_counts, pattern_seeds, training
from agents.experiments.workers import threads

TOY = Size(
    (0,),
    (1,),
    (500, 501),
    tuple(
        Way("VD"[k % 2], start, "0 … 1", "own", "1e-4", 0.1)
        for k, start in enumerate(("0.1, 0.1, 0.02", "0.3 for all", "0.2 for all", "0.1 for all"))
    ),
    (3, 4),
    shorten=1_000,
)

AS_IN_THE_PAPER = {
    **{"GNM 1 α 0.05": 50.0, "GNM 1 α 0.08": 930.0, "GNM 1 α 0.15": 950.0, "GNM 1 α 0.2": 960.0},
    **{"GNM 1 α 0.3": 1_000.0, "GNM 1 α 0.4": 950.0, "GNM 1 α 0.6": 900.0, "GNM 1 α 1": 800.0},
    **{"GNM 1 on the line": 950.0, "GNM 1 η 1": 20.0, "MST 1": 377.0},
    **{"LIF 1, 0": 900.0, "LIF 1, 25": 950.0, "GNM 2": 600.0, "ET 2": 700.0, "MST 2": 200.0},
    **{"GNM 3": 350.0, "MST 3": 300.0, "LIF 3, 0": 250.0, "LIF 3, 25": 50.0},
    **{"GNM 4 α 0.15": 190.0, "GNM 4 α 0.2": 190.0, "GNM 4 α 0.3": 200.0, "GNM 4 α 0.5": 150.0},
}


def scores(changes: dict[str, float] | None = None, seeds: int = 6) -> Any:
    """Scores (seeds, probes) as in the paper but for `changes`."""
    values = {**AS_IN_THE_PAPER, **(changes or {})}
    return np.tile([values[name] for name in PROBES], (seeds, 1))


def number(words: str) -> Number:
    (found,) = (one for one in NUMBERS if one.words.startswith(words))
    return found


def test_a_world_as_in_the_paper_has_every_number_and_every_point() -> None:
    assert come_back(scores()) == len(NUMBERS)
    assert points(scores()) == len(NUMBERS)


def test_points_fall_to_none_at_the_distance_that_is_written_down() -> None:
    mst = number("MST, one class")
    assert mst.point(475) == mst.point(300) == 1.0
    assert mst.point(475 * math.sqrt(2)) == pytest.approx(0.5)
    assert mst.point(150) == pytest.approx(0.0)
    assert mst.point(5_000) == 0.0


def test_a_share_is_compared_by_its_arcsine() -> None:
    ahead = number("ET ahead")
    assert ahead.point(1.0) == ahead.point(0.808) == 1.0
    edge = math.asin(math.sqrt(0.808))
    assert ahead.point(math.sin(edge - 0.15) ** 2) == pytest.approx(0.5)
    assert ahead.point(0.5) == 0.0


def test_each_number_is_read_off_the_neurons_that_it_names() -> None:
    changed = scores({"LIF 3, 0": 700.0, "MST 1": 754.0})
    assert number("LIF / GNM, three").value(changed) == pytest.approx(2.0)
    assert number("MST, one class").value(changed) == pytest.approx(754.0)
    assert number("best α").value(changed) == 0.3
    assert number("best of four").value(changed) == 200.0
    assert number("one class more").value(changed) == pytest.approx(0.6)


def test_a_win_is_counted_seed_by_seed() -> None:
    values = scores(seeds=4)
    values[0, PLACE["MST 2"]] = 650.0
    assert number("MST ahead").value(values) == 0.25


def test_the_hypotheses_are_judged_by_the_points_of_the_confirmation() -> None:
    bad = scores({"MST 1": 9_000.0, "GNM 1 α 0.08": 100.0})
    size = SIZES["paper"]
    found = [Found(Protocol(MATCHED, 1_000), scores())] * BEST
    found += [
        Found(one, scores() if one.condition.name == D_READING.name else bad) for one in named(size)
    ]
    verdicts = {key: holds for key, (holds, _) in judged(found).items()}
    assert verdicts == {"D": True, "all": False, "found": False}
    assert unexplained(found) == []


def test_a_number_is_unexplained_if_it_comes_back_nowhere() -> None:
    without = [
        Found(Protocol(MATCHED, 1_000), scores({"MST 1": 9_000.0})),
        Found(Protocol(MATCHED, 10_000), scores({"MST 1": 5.0, "GNM 4 α 0.3": 5_000.0})),
    ]
    assert unexplained(without) == [number("MST, one class")]


def test_the_search_is_as_wide_as_it_says() -> None:
    size = SIZES["paper"]
    assert len(size.ways) == len(set(size.ways)) == 432
    assert sum(len(group) for group in protocols(size).values()) == 3_456
    assert not {*size.coarse, *size.fine} & {*size.confirmed}
    assert size.confirmed == tuple(range(500, 548))


def test_a_neuron_that_protocols_share_is_trained_once() -> None:
    shared = neurons([Protocol(MATCHED, 1_000), Protocol(MATCHED, 10_000)])
    assert len(shared) == len(PROBES)
    assert [one["classes"] for one in shared] == sorted(one["classes"] for one in shared)


def test_a_neuron_is_scored_where_a_protocol_needs_it_and_nowhere_else() -> None:
    early = replace(MATCHED, gnm=replace(MATCHED.gnm, trials=20))
    late = replace(
        MATCHED, gnm=replace(MATCHED.gnm, trials=60), mst=replace(MATCHED.mst, trials=60)
    )
    needed = [
        Protocol(replace(one, lif=replace(one.lif, trials=20)), 1_000) for one in (early, late)
    ]
    needed[0] = needed[0]._replace(
        condition=replace(needed[0].condition, mst=needed[1].condition.mst)
    )
    wanted = stage("toy", "", needed, (3,), 2)
    (block,) = wanted.blocks()
    done = wanted.compute(block)["survived"].reshape(len(block.settings), 2, 2)[:, :, 0] >= 0

    assert wanted.common["checkpoints"] == [20, 60]
    scored = {one["neuron"]: row.tolist() for one, row in zip(block.settings, done, strict=True)}
    assert scored == {"gnm": [True, True], "lif": [True, False], "mst": [False, True]}


def test_a_checkpoint_has_the_bits_of_a_training_of_that_length() -> None:
    one = Protocol(MATCHED, 1_000)
    short, long = 40, 100
    wanted = stage("toy", "", [one], (3,), 5)
    (block,) = wanted.blocks()
    for cell in block.settings:
        cell["checkpoints"] = cell["after"] = [short, long]
    values = wanted.compute(block)["survived"].reshape(len(block.settings), 2, 5)

    for at, trials in enumerate((short, long)):
        for probe in (PROBES["ET 2"], PROBES["MST 2"]):
            cell = setting(MATCHED, probe)
            classes = cell.pop("classes")
            axes = (class_counts(classes), pattern_seeds((3,)), Axis("copy", (0,)))
            alone = training("one", "", axes, trials=trials, runs=5, **cell)
            place = neurons([one]).index({"classes": classes, **cell})
            np.testing.assert_array_equal(
                values[place, at], alone.compute(alone.blocks()[0])["survived"].ravel()
            )


def test_the_whole_search_runs_goes_on_and_tells(tmp_path: Path) -> None:
    with threads(1) as executor:
        search(TOY, tmp_path, executor)
    done = [summarise(tmp_path / name) for name in STAGES]
    with threads(1) as executor:  # again: nothing is left to do
        search(TOY, tmp_path, executor)
    assert [summarise(tmp_path / name) for name in STAGES] == done

    told = write(TOY, tmp_path, "toy", tmp_path / "out")

    first, second, third, _ = (read(tmp_path / name) for name in STAGES)
    chosen = best(TOY, ranking(TOY, first, second))
    assert len(chosen) == BEST
    assert len({one.condition.name.partition(", ET")[0] for one in chosen}) == BEST
    assert third.attrs["settings"] == json.loads(json.dumps(confirmed(TOY, chosen).settings()))
    ranks = [row["rank"] for row in told["protocols"]]
    assert ranks == sorted(ranks, reverse=True)
    assert {row["label"] for row in told["protocols"]} >= {"search 1", "D reading, cap 1,000"}
    assert (tmp_path / "out" / "figures" / "FORENSICS.png").stat().st_size > 1_000
    assert "Numbers that come back under none" in (tmp_path / "out" / "forensics.md").read_text()
    values = Scores(third).of(chosen[0])
    assert values.shape == (2, len(PROBES))
    assert (values <= chosen[0].cap).all()


def test_the_coarse_stage_needs_no_other(tmp_path: Path) -> None:
    assert coarse(TOY).name == STAGES[0]
