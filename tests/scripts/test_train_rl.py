"""scripts/train_rl.py: files, numbers, resuming, refusals."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

import train_rl

SMALL = ["--n-envs", "4", "--runs", "3"]
ROLLOUT = 16_384


def run(*arguments: object) -> dict[str, Any]:
    return train_rl.main(train_rl.parser().parse_args([*SMALL, *map(str, arguments)]))


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rl") / "agent"
    return folder, run("--out", folder, "--steps", ROLLOUT, "--evaluations", 1)


def test_a_run_leaves_model_task_evaluations_score_and_log(trained):
    folder, _ = trained
    names = {path.name for path in folder.iterdir()}
    assert {"model.zip", "best_model.zip", "task.json", "evaluations.npz", "score.json"} <= names
    assert list(folder.glob("tensorboard/*/events*"))


def test_the_result_has_the_fields_of_every_score(trained):
    folder, result = trained
    assert {"mean", "median", "ci95", "runs"} <= set(result["noisy_performance"])
    assert result["noisy_performance"]["runs"] == 3
    assert result["silent_score"] == 148
    assert result["steps"] == ROLLOUT
    assert result["checkpoint"] == str(folder)
    assert json.loads((folder / "score.json").read_text()) == json.loads(json.dumps(result))


def test_evaluate_takes_the_folder_and_gives_the_same_score(trained):
    import evaluate

    folder, result = trained
    again = evaluate.main(evaluate.parser().parse_args([str(folder), "--runs", "3"]))
    assert again["noisy_performance"] == result["noisy_performance"]
    assert again["answers"] == result["answers"]


def test_resuming_goes_on_from_where_it_was(trained, tmp_path):
    folder = shutil.copytree(trained[0], tmp_path / "copy")
    result = run("--resume", folder, "--steps", 2 * ROLLOUT, "--evaluations", 2)
    assert result["steps"] == 2 * ROLLOUT
    with np.load(folder / "evaluations.npz") as evaluations:
        steps = evaluations["timesteps"].tolist()
    assert len(steps) == 2 and steps[0] <= ROLLOUT < steps[1]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], f"room for one rollout of 16,384 bins, got {ROLLOUT:,} of which {ROLLOUT:,} are done"),
        (["--n-classes", "2"], "n_classes is 1 there and 2 here"),
        (["--pattern-seed", "5"], "other patterns than those of --pattern-seed 5"),
        (["--feedback", "dense"], "feedback is 'cost' there"),
        (["--algo", "dqn"], "algo is 'ppo' there and 'dqn' here"),
        (["--out", "elsewhere"], "--out does not go with --resume"),
    ],
)
def test_only_the_same_task_can_be_resumed(trained, arguments, message):
    with pytest.raises(ValueError, match=message):
        run("--resume", trained[0], "--steps", ROLLOUT, *arguments)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--steps", "100"], "room for one rollout of 16,384 bins, got 100"),
        (["--steps", "0"], "--steps must be >= 1"),
        (["--n-envs", "0"], "--n-envs must be >= 1"),
        (["--n-classes", "0"], "n_classes must be >= 1"),
        (["--evaluations", "-1"], "--evaluations must be >= 0"),
        (["--pattern-seed", "-1"], "pattern seed must be >= 0"),
    ],
)
def test_bad_numbers_are_refused_in_one_sentence(tmp_path, arguments, message):
    with pytest.raises(ValueError, match=message):
        run("--out", tmp_path / "none", *arguments)
    assert not (tmp_path / "none").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--algo", "sarsa"], "invalid choice: 'sarsa'"),
        (["--resume", "{folder}"], "train_rl.py: {folder} holds no RL agent"),
        (["--out", "{file}/agent"], "train_rl.py: cannot make the folder {file}/agent"),
    ],
)
def test_the_command_ends_with_2_and_one_clear_line(tmp_path, arguments, message):
    places = {"folder": str(tmp_path / "none"), "file": str(tmp_path / "file")}
    Path(places["file"]).write_text("")
    command = [argument.format(**places) for argument in arguments]
    done = subprocess.run(
        [sys.executable, train_rl.__file__, *command], capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
    assert message.format(**places) in done.stderr.splitlines()[-1]
