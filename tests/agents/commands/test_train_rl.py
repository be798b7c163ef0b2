"""gnm train-rl: files, numbers, resuming, refusals."""

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

from agents.commands import evaluate, train_rl
from agents.commands.terminal import Stopped, parse

SCRIPT = Path(__file__).resolve().parents[3] / "scripts" / "train_rl.py"
SMALL = ["--n-envs", "4", "--runs", "3"]
ROLLOUT = 16_384
TRAINED = 2 * ROLLOUT
"""The learning rate falls to 0 until the last rollout, so that one alone would teach nothing."""


def run(*arguments: object) -> dict[str, Any]:
    return train_rl.main(parse(train_rl, [*SMALL, *arguments]))


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rl") / "agent"
    return folder, run("--out", folder, "--steps", TRAINED, "--evaluations", 1)


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
    assert result["steps"] == TRAINED
    assert result["checkpoint"] == str(folder)
    assert json.loads((folder / "score.json").read_text()) == json.loads(json.dumps(result))


def test_evaluate_takes_the_folder_and_gives_the_same_score(trained):
    folder, result = trained
    again = evaluate.main(parse(evaluate, [str(folder), "--runs", "3"]))
    assert again["noisy_performance"] == result["noisy_performance"]
    assert again["answers"] == result["answers"]


def resume(folder: Path, *arguments: object) -> dict[str, Any]:
    """Without --n-envs, which is that of the saved agent."""
    command = ["--resume", folder, "--runs", 3, *arguments]
    return train_rl.main(parse(train_rl, command))


def evaluated(folder: Path) -> list[int]:
    with np.load(folder / "evaluations.npz") as evaluations:
        steps: list[int] = evaluations["timesteps"].tolist()
    return steps


def test_the_last_model_is_evaluated_too(trained):
    assert evaluated(trained[0])[-1] == TRAINED


def test_resuming_goes_on_from_where_it_was(trained, tmp_path):
    folder = shutil.copytree(trained[0], tmp_path / "copy")
    result = resume(folder, "--steps", 2 * TRAINED, "--evaluations", 2)
    assert result["steps"] == 2 * TRAINED
    steps = evaluated(folder)
    assert steps[:-2] == evaluated(trained[0]) and steps[-1] == 2 * TRAINED


def test_resuming_begins_with_the_saved_weights_and_changes_them(trained, tmp_path, monkeypatch):
    folder = shutil.copytree(trained[0], tmp_path / "copy")
    saved = weights(folder)
    begun = []
    learn = train_rl.learn
    monkeypatch.setattr(
        train_rl, "learn", lambda model, *rest: (begun.append(head(model)), learn(model, *rest))[1]
    )
    resume(folder, "--steps", 2 * TRAINED, "--evaluations", 0)
    np.testing.assert_array_equal(begun[0], saved)
    assert np.any(weights(folder) != saved)


def test_without_evaluations_the_last_agent_is_the_one_that_is_kept(trained, tmp_path):
    folder = shutil.copytree(trained[0], tmp_path / "copy")
    resume(folder, "--steps", 2 * TRAINED, "--evaluations", 0)
    assert not (folder / "best_model.zip").exists()
    assert not (folder / "evaluations.npz").exists()


def test_a_dqn_agent_is_not_resumed(trained, tmp_path):
    folder = shutil.copytree(trained[0], tmp_path / "copy")
    about = json.loads((folder / "task.json").read_text())
    (folder / "task.json").write_text(json.dumps({**about, "kind": "dqn"}))
    with pytest.raises(ValueError, match="a DQN agent, which cannot go on"):
        resume(folder, "--steps", 2 * TRAINED)


def weights(folder: Path) -> Any:
    from stable_baselines3 import PPO

    return head(PPO.load(folder / "model.zip"))


def head(model: Any) -> Any:
    return model.policy.action_net.weight.detach().numpy().copy()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            [],
            "room for more than one rollout of 16,384 bins, .* "
            f"got {TRAINED:,} of which {TRAINED:,} are done",
        ),
        (["--n-classes", "2"], "n_classes is 1 there and 2 here"),
        (["--pattern-seed", "5"], "other patterns than those of --pattern-seed 5"),
        (["--feedback", "dense"], "feedback is 'cost' there"),
        (["--algo", "dqn"], "algo is 'ppo' there and 'dqn' here"),
        (["--out", "elsewhere"], "--out does not go with --resume"),
        (["--n-envs", "5"], "trained in 4 environments .* leave --n-envs out"),
    ],
)
def test_only_the_same_task_can_be_resumed(trained, arguments, message):
    with pytest.raises(ValueError, match=message):
        run("--resume", trained[0], "--steps", TRAINED, *arguments)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--steps", "100"], "room for more than one rollout of 16,384 bins, .* got 100"),
        (["--steps", str(ROLLOUT)], "room for more than one rollout"),
        (["--algo", "dqn", "--steps", "100"], "room for more than one rollout of 10,000 bins"),
        (["--n-classes", "0"], "n_classes must be >= 1"),
    ],
)
def test_bad_numbers_are_refused_in_one_sentence(tmp_path, arguments, message):
    with pytest.raises(ValueError, match=message):
        run("--out", tmp_path / "none", *arguments)
    assert not (tmp_path / "none").exists()


@pytest.mark.parametrize(
    ("option", "low"),
    [("--steps", 1), ("--n-envs", 1), ("--evaluations", 0), ("--pattern-seed", 0)],
)
def test_numbers_out_of_range_are_refused_in_one_line(option, low, capsys):
    with pytest.raises(SystemExit) as ended:
        parse(train_rl, [option, low - 1])
    assert ended.value.code == 2
    assert capsys.readouterr().err.endswith(f"{option}: must be >= {low}, got {low - 1}\n")


@pytest.mark.parametrize("change", ["no seal", "another model"])
def test_a_model_that_no_run_of_ones_own_wrote_is_opened_with_trust_alone(
    trained, tmp_path, change
):
    folder = shutil.copytree(trained[0], tmp_path / "copy")
    evaluate.loaded(folder)
    if change == "no seal":
        (folder / "model.zip.seal").unlink()
    else:
        with open(folder / "best_model.zip", "ab") as file:
            file.write(b" ")
    with pytest.raises(ValueError, match=r"pickled objects, .* give --trust"):
        evaluate.loaded(folder)
    with pytest.raises(ValueError, match=r"pickled objects, .* give --trust"):
        resume(folder, "--steps", 2 * TRAINED)
    evaluate.loaded(folder, trust=True)


def test_a_training_that_is_stopped_leaves_a_finished_one_alone(trained, tmp_path, monkeypatch):
    folder = shutil.copytree(trained[0], tmp_path / "copy")
    before = {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}

    def learn(model, about, fresh, steps, options):
        model.num_timesteps += ROLLOUT
        return 1.0, True

    monkeypatch.setattr(train_rl, "learn", learn)
    with pytest.raises(Stopped, match=r"kept what was learned in 16,384 bins in .*unfinished"):
        run("--out", folder, "--steps", TRAINED)
    after = {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}
    assert after == before


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
        [sys.executable, str(SCRIPT), *command], capture_output=True, text=True, timeout=600
    )
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
    assert message.format(**places) in done.stderr.splitlines()[-1]
