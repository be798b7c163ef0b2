"""gnm chemistry: what it writes, what it says, and what it refuses."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from agents import GNM, AggregateLabel, ErrorTrace, NeuronAgent, train_many
from agents.commands import chemistry
from agents.commands.terminal import parse
from agents.continuous import ContinuousAgent, ContinuousGNM
from agents.experiments.reactions import traced_trial
from gnm_env import Patterns, Task

libsbml = pytest.importorskip("libsbml")
pytest.importorskip("roadrunner")
pytest.importorskip("antimony")

ROOT = Path(__file__).resolve().parents[3]
TASK = Task(n_inputs=20, n_classes=2, rate=0.02, pattern_bins=20, background_bins=20)
PATTERNS = Patterns.draw(TASK, seed=3)


@pytest.fixture
def checkpoint(tmp_path: Path) -> Path:
    agent = ContinuousAgent(ContinuousGNM(alpha=0.2), ErrorTrace(modulate=True), 20)
    train_many([agent], TASK, PATTERNS, 3_000, seed=1)
    agent.save(tmp_path / "agent.npz", task=TASK, patterns=PATTERNS)
    return tmp_path / "agent.npz"


def script(*arguments: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "scripts/chemistry.py", *map(str, arguments)],
        capture_output=True, text=True, timeout=600, cwd=ROOT,
    )  # fmt: skip


def run(*arguments: object) -> dict[str, Any]:
    return chemistry.main(parse(chemistry, arguments))


def test_one_command_draws_counts_and_exports(checkpoint: Path) -> None:
    out, model = checkpoint.parent / "pictures", checkpoint.parent / "model.xml"
    ended = script(
        checkpoint, "--molecules", 5, 50, "--export", model, "--runs", 3, "--out", out,
        "--trials", 1, "--json",
    )  # fmt: skip
    assert ended.returncode == 0, ended.stderr
    told = json.loads(ended.stdout.splitlines()[-1])
    assert sorted(told["stochastic_S"]) == ["5", "50"]
    assert len(told["deterministic_S"]) == len(told["outputs_alone"]) == 2
    assert told["targets"] == [1, 2]
    assert len(told["wrong_outputs"]["mean"]) == len(told["wrong_outputs"]["molecules"]) == 8
    stems = ("F2_classes", "F8_volumes", "F8_mistakes")
    names = {f"{stem}.{ending}" for stem in stems for ending in ("pdf", "png")}
    assert {Path(path).name for path in told["figures"]} == names
    assert {path.name for path in out.iterdir()} == names | {"F8_mistakes.csv"}
    header, row = (out / "F8_mistakes.csv").read_text().splitlines()
    assert header == "neuron,deterministic,10,20,50,100,200,500,1000,2000"
    assert [int(cell) for cell in row.split(",")][2:] == told["wrong_outputs"]["mean"]
    document = libsbml.readSBMLFromFile(str(model))
    assert document.getNumErrors() == 0
    assert document.getModel().getParameter("molecules").getValue() == 5


def test_a_name_for_antimony_gets_antimony(checkpoint: Path) -> None:
    path = checkpoint.parent / "model.ant"
    run(checkpoint, "--export", path, "--runs", 1)
    assert "decay: V => ; alpha*V;" in path.read_text()


def test_the_shown_trial_has_each_pattern_once() -> None:
    trial = traced_trial(TASK, PATTERNS, seed=1)
    assert trial.classes.tolist() == [0, 1]
    for onset, pattern in zip(trial.onsets, PATTERNS.dense(), strict=True):
        assert np.array_equal(trial.dense()[onset : onset + 20], pattern)


def test_bad_input_ends_with_one_line_and_code_2(checkpoint: Path) -> None:
    ended = script(checkpoint.parent / "no_such_file.npz")
    assert ended.returncode == 2
    assert len(ended.stderr.strip().splitlines()) == 1
    assert "there is no checkpoint" in ended.stderr


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--molecules", "0"], "molecules must be >= 1, got 0"),
        (["--conversion", "-3"], "conversion must be > 0"),
        (["--export", "no_such_folder/model.xml"], "cannot write"),
        (["--out", "{file}", "--runs", "1"], "cannot write|choose a folder"),
    ],
)
def test_bad_numbers_and_folders_are_refused(
    checkpoint: Path, arguments: list[str], message: str
) -> None:
    filled = [argument.format(file=checkpoint) for argument in arguments]
    with pytest.raises(ValueError, match=message):
        run(checkpoint, *filled)


def test_neurons_without_a_chemistry_are_refused(checkpoint: Path) -> None:
    spiking = NeuronAgent(GNM(), AggregateLabel(), 20)
    unbounded = ContinuousAgent(ContinuousGNM(), AggregateLabel(), 20, weight_bounds=None)
    unbounded.weights[3] = 1.5
    for agent, message in ((spiking, "continuous time"), (unbounded, "channel 3 has 1.5")):
        agent.save(checkpoint, task=TASK, patterns=PATTERNS)
        with pytest.raises(ValueError, match=message):
            run(checkpoint)


def test_a_checkpoint_without_its_patterns_is_refused(checkpoint: Path) -> None:
    ContinuousAgent(ContinuousGNM(), AggregateLabel(), 20).save(checkpoint)
    with pytest.raises(ValueError, match="saved without its task"):
        run(checkpoint)
