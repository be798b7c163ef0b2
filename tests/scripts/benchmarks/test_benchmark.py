from __future__ import annotations

import functools
import json
import os
import platform
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import benchmark
from agents import GNM, AggregateLabel, train_many
from benchmarks import footprint, growth, others, training
from benchmarks.cores import Cores
from benchmarks.machine import machine
from benchmarks.picture import draw
from benchmarks.report import number, page, summary, table
from benchmarks.rows import (
    BEST_ONLY,
    MET,
    MISSED,
    Curve,
    Findings,
    Row,
    Target,
    rate_rows,
)
from benchmarks.timing import Settings, Skip, Subject, Timing, race
from gnm_env import Patterns, Task

SCRIPT = Path(benchmark.__file__)


@pytest.fixture(scope="module")
def cores() -> Cores:
    return Cores(watch=0.01)


@pytest.fixture
def settings(cores: Cores) -> Settings:
    return Settings(repeats=3, quick=True, full=False, seed=0, cores=cores)


def row(*values: float, **fields: Any) -> Row:
    return Row("section", "name", "steps/s", values, **fields)


# --- verdicts ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("values", "more_is_better", "verdict"),
    [
        ((9.0, 10.0, 11.0), True, MET),
        ((8.0, 9.0, 10.0), True, BEST_ONLY),
        ((7.0, 8.0, 9.0), True, MISSED),
        ((9.0, 10.0, 11.0), False, MET),
        ((10.0, 11.0, 12.0), False, BEST_ONLY),
        ((11.0, 12.0, 13.0), False, MISSED),
    ],
)
def test_a_target_is_met_by_the_median_and_nothing_less(
    values: tuple[float, ...], more_is_better: bool, verdict: str
) -> None:
    assert row(*values, more_is_better=more_is_better).reached(Target(10.0)) == verdict


@pytest.mark.parametrize(
    ("ratios", "best_ratio", "verdict"),
    [
        ((1.4, 1.5, 9.0), 1.2, MET),
        ((1.3, 1.4, 9.0), 1.5, BEST_ONLY),
        ((1.3, 1.4, 9.0), 1.4, MISSED),
    ],
)
def test_a_ratio_is_met_by_its_median_or_by_best_against_best_never_by_a_lucky_round(
    ratios: tuple[float, ...], best_ratio: float, verdict: str
) -> None:
    # Times are worse the larger they are, ratios of speed never.
    measured = row(1.0, ratios=ratios, best_ratio=best_ratio, more_is_better=False)
    assert measured.reached(Target(1.5, "ratio")) == verdict


def test_speeds_are_compared_round_by_round() -> None:
    timings = {
        "ours": Timing((0.5, 0.25, 1.0), (1.0, 1.0, 1.0)),
        "theirs": Timing((1.0, 1.0, 1.0), (1.0, 1.0, 1.0)),
    }
    ours, theirs = rate_rows("section", timings, "steps/s", 1.0, against="theirs")
    assert ours.values == (2.0, 4.0, 1.0)
    assert ours.ratios == (2.0, 4.0, 1.0)
    assert ours.best_ratio == 4.0
    assert theirs.ratios == ()


def test_growth_is_flat_to_within_what_its_extremes_leave_their_middle() -> None:
    assert growth.deviation([1.0, 1.0, 1.0]) == 0.0
    assert growth.deviation([8.0, 9.0, 12.0]) == pytest.approx(20.0)


# --- timing --------------------------------------------------------------------------------------


def test_competitors_take_turns_and_every_second_round_goes_backwards(settings: Settings) -> None:
    order: list[str] = []

    def subject(name: str) -> Subject:
        return Subject(name, lambda _: order.append(name), 1.0, warm=lambda: None)

    # A repeat calls its subject often, to fill its time.
    timings = race([subject("a"), subject("b")], settings)
    turns = [name for k, name in enumerate(order) if k == 0 or name != order[k - 1]]
    assert turns == ["a", "b", "a", "b"]  # a b, b a, a b
    assert [len(timing.seconds) for timing in timings.values()] == [3, 3]


def test_preparing_a_run_takes_none_of_its_time(settings: Settings) -> None:
    prepared = []

    def make() -> None:
        time.sleep(0.02)
        prepared.append(True)

    subject = Subject("subject", lambda _: time.sleep(0.001), 1.0, make, warm=lambda: None)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Settings, "least_seconds", 0.0)
        timing = race([subject], settings)["subject"]
    assert len(prepared) == 3
    assert 0.001 <= min(timing.seconds) < 0.02


@pytest.mark.skipif(not hasattr(os, "sched_getaffinity"), reason="this system cannot pin")
def test_a_measurement_has_its_cores_and_gives_them_back(cores: Cores) -> None:
    before = os.sched_getaffinity(0)
    with cores.only(1):
        assert os.sched_getaffinity(0) == set(cores.chosen[:1])
    assert os.sched_getaffinity(0) == before
    with pytest.raises(ValueError, match="needs 10000 cores"), cores.only(10_000):
        pass


def test_the_work_is_the_bins_that_the_environment_shows() -> None:
    env = gym.make("gnm/PatternTrial-v0", n_classes=2)
    steps = 0
    env.reset(seed=5)
    for _ in range(3):
        ended = False
        while not ended:
            _, _, ended, _, _ = env.step(0)
            steps += 1
        env.reset()
    assert training.bins(Task(n_classes=2), 3, 5) == steps


@pytest.mark.parametrize(("full", "values"), [(False, 3), (True, 1)])
def test_a_heat_map_is_scaled_up_from_a_part_or_done_whole(
    full: bool, values: int, settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, small in {
        "GRID": 3,
        "MAP_SEEDS": 2,
        "TRIALS": 5,
        "RUNS": 1,
        "MAX_EPISODE_BINS": 10,
    }.items():
        monkeypatch.setattr(training, name, small)
    monkeypatch.setattr(training, "MAP_PART", {True: 4})
    monkeypatch.setattr(Settings, "least_seconds", 0.0)
    measured = training.heat_map(replace(settings, full=full)).rows[0]
    assert len(measured.values) == values
    assert ("the whole map" in measured.note) == full
    assert 0 < measured.median < 5


def test_a_part_of_the_map_reaches_from_corner_to_corner() -> None:
    part = [(n.neuron.alpha, n.neuron.eta) for n in training.grid(65)]  # type: ignore[attr-defined]
    assert part[0] == (0.0, 0.0) and part[-1] == (1.0, 1.0)
    assert len(set(part)) == 65
    np.testing.assert_allclose(np.mean(part, axis=0), 0.5, atol=0.02)


# --- other software does the same arithmetic -----------------------------------------------------


@pytest.mark.parametrize("name", list(others.OTHERS))
def test_other_software_counts_the_same_spikes(name: str) -> None:
    package, make = others.OTHERS[name]
    pytest.importorskip(package)
    agents = others.listeners()
    expected = others.spikes_of_ours(agents, 4, seed=3)
    assert expected.sum() > 500
    others.require_agreement(name, make()(others.heard(agents, 4, seed=3)), expected)


def test_software_that_does_something_else_is_not_compared() -> None:
    expected = np.full(64, 100)
    with pytest.raises(ValueError, match="does not do the same arithmetic"):
        others.require_agreement("another", expected + 1, expected)


@pytest.mark.parametrize("lanes", [1, 5])
def test_learning_in_numpy_ends_with_our_weights(lanes: int) -> None:
    task = Task()
    make = functools.partial(training.neurons, GNM(alpha=others.ALPHA), AggregateLabel(), lanes)
    agents = make()
    train_many(agents, task, Patterns.draw(task, 0), 60, 7, 1)
    given = [others.Heard.of(trial) for trial in others.drawn(task, 60, 7)]
    learned = others.numpy_training(given, others.weights_of(make))
    assert not np.allclose(learned, others.weights_of(make), atol=1e-4)
    np.testing.assert_allclose(learned, others.weights_of(lambda: agents), rtol=0, atol=1e-12)


# --- what is told --------------------------------------------------------------------------------


@pytest.fixture
def found(cores: Cores) -> Findings:
    rows = [
        row(1.0, 2.0, 3.0, targets=(Target(2.0, aim=5.0),), cpu_share=(1.0, 1.0, 1.0)),
        row(
            1.0, 2.0, ratios=(0.5, 0.6), best_ratio=0.6, targets=(Target(0.7, "ratio"),), note="so"
        ),
        Row("Listening, beside other software", "agents", "bins/s", (1e6, 2e6)),
    ]
    return Findings(
        machine(cores),
        {"command": "python scripts/benchmark.py --quick", "repeats": 3, "seconds": 1.0},
        rows,
        [Curve("lanes", "neurons", "ns", (64, 4096), ((1.0, 2.0), (1.1, 1.3)), flat=True)],
        ["norse: not installed"],
        ["loop: OSError: gone"],
    )


def test_findings_survive_json(found: Findings) -> None:
    assert Findings.from_json(json.dumps(found.to_json())) == found


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"machine": 1}'])
def test_other_json_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="not the JSON of a benchmark"):
        Findings.from_json(text)


def test_json_tells_the_verdict_of_every_target(found: Findings) -> None:
    assert [shown["verdicts"] for shown in found.to_json()["rows"]] == [[MET], [MISSED], []]


@pytest.mark.parametrize("write", [table, page])
def test_table_and_page_tell_targets_verdicts_and_what_is_left_out(
    write: Any, found: Findings
) -> None:
    text = write(found)
    for part in ("≥ 2.00 (aim 5.00)", "≥ 0.7 ×", MISSED, "norse: not installed", "gone", "4,096"):
        assert part in text.replace("4096", "4,096")
    assert summary(found) in text
    assert "1 of 2 targets met" in text


def test_the_page_names_the_machine_but_neither_host_nor_folder(found: Findings) -> None:
    text = page(found)
    assert found.machine["processor"] in text
    assert found.machine["python"] in text
    assert not re.search(rf"\b{re.escape(platform.node())}\b", text)
    assert not re.search(r"(?<![\w.])/\w+/", text)


def test_a_shared_machine_is_told(found: Findings) -> None:
    assert "shared" not in summary(found)
    found.rows.append(row(1.0, cpu_share=(0.3,)))
    found.rows.append(row(1.0, cpu_share=(0.3,)))
    found.rows.append(row(1.0, cpu_share=(0.3,)))
    found.rows.append(row(1.0, cpu_share=(0.3,)))
    assert "had 30 % of its time" in summary(found)


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.0, "0"), (0.01234, "0.0123"), (1.234, "1.23"), (56.78, "56.8"), (1234.5, "1,234")],
)
def test_numbers_have_three_figures(value: float, text: str) -> None:
    assert number(value) == text


def test_a_picture_is_drawn_of_whatever_there_is(found: Findings, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    draw(found, tmp_path / "all.png")
    draw(Findings(found.machine, found.settings), tmp_path / "nothing.png")
    for name in ("all.png", "nothing.png"):
        assert (tmp_path / name).read_bytes().startswith(b"\x89PNG")


# --- the command ---------------------------------------------------------------------------------


@pytest.fixture
def stand_in(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """Puts a function in the place of a measurement."""

    def put(function: Any) -> str:
        monkeypatch.setattr(training, "loop", function)
        return "training:loop"

    yield put


def test_what_cannot_be_measured_is_named_and_the_rest_goes_on(
    stand_in: Any, settings: Settings
) -> None:
    def missing(_: Settings) -> Findings:
        raise Skip("not installed")

    def broken(_: Settings) -> Findings:
        raise RuntimeError("broken")

    assert benchmark.attempt(stand_in(missing), settings).skipped == [
        "training:loop: not installed"
    ]
    assert benchmark.attempt(stand_in(broken), settings).failed == [
        "training:loop: RuntimeError: broken"
    ]


@pytest.mark.parametrize(
    "function", [name for names in benchmark.SECTIONS.values() for name in names]
)
def test_every_section_names_a_function_that_is_there(function: str) -> None:
    module, name = function.split(":")
    assert callable(getattr(pytest.importorskip(f"benchmarks.{module}"), name))


def run(*arguments: object, cwd: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, str(SCRIPT), *map(str, arguments)],
        capture_output=True, text=True, timeout=120, cwd=cwd,
    )  # fmt: skip


def test_the_command_ends_with_json_and_can_be_shown_again(tmp_path: Path) -> None:
    ended = run("--only", "loop", "--quick", "--repeats", 2, "--json", cwd=tmp_path)
    assert ended.returncode == 0, ended.stderr
    told = json.loads(ended.stdout.splitlines()[-1])
    assert [len(shown["values"]) for shown in told["rows"]] == [2]
    assert told["settings"]["command"].endswith("--only loop --quick --repeats 2")
    assert (tmp_path / "results/benchmark/benchmark.png").exists()
    again = run("--last", "--json", cwd=tmp_path)
    assert json.loads(again.stdout.splitlines()[-1]) == told


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["--repeats", 0], "--repeats: must be >= 1, got 0"),
        (["--seed", -1], "--seed: must be >= 0, got -1"),
        (["--quick", "--full"], "exclude each other"),
        (["--quick", "--only", "loop", "--publish"], "not one with --quick and --only"),
        (["--repeats", 2, "--publish"], "not one with --repeats"),
        (["--last"], "run the benchmark without --last first"),
        (["--only", "nothing"], "invalid choice"),
    ],
)
def test_bad_input_ends_with_code_2_and_no_traceback(
    arguments: list[object], complaint: str, tmp_path: Path
) -> None:
    ended = run(*arguments, cwd=tmp_path)
    assert ended.returncode == 2
    assert complaint in ended.stderr.splitlines()[-1]
    assert "Traceback" not in ended.stderr


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/clear_refs").exists(), reason="needs /proc")
def test_memory_is_what_is_stated(settings: Settings) -> None:
    measured = footprint.memory(settings).rows
    assert [each.reached(each.targets[0]) for each in measured] == [MET] * len(measured)


@pytest.mark.slow
def test_a_later_start_compiles_nothing(settings: Settings) -> None:
    rows = footprint.starts(replace(settings, repeats=1)).rows
    (compiled,) = re.findall(r"([\d,]+) functions are compiled", rows[0].note)
    assert int(compiled.replace(",", "")) > 10  # else nothing was counted
    assert [each.values for each in rows if each.unit == "functions"] == [(0.0,)]
