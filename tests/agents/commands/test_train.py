"""gnm train, evaluate and show, as a person at the terminal meets them."""

from __future__ import annotations

import csv
import json
import os
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from agents import load_checkpoint
from agents.commands import evaluate, show, train
from agents.commands.terminal import Stopped, parse

SCRIPTS = Path(__file__).resolve().parents[3] / "scripts"


def run_script(name: str, *words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(SCRIPTS / name), *words]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def trained(folder: Path, *words: str) -> dict[str, Any]:
    return train.main(parse(train, ["--out", str(folder), "--trials", "300", *words]))


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    folder = tmp_path_factory.mktemp("run")
    return folder, trained(folder)


def test_training_leaves_neuron_curve_score_and_picture(run: tuple[Path, dict[str, Any]]) -> None:
    folder, _ = run
    names = {path.name for path in folder.iterdir()}
    assert names == {"agent.npz", "learning_curve.csv", "score.json", "training.png"}
    with open(folder / "learning_curve.csv") as file:
        rows = list(csv.DictReader(file))
    assert [int(row["trials"]) for row in rows][-1] == 300
    assert all(0.0 <= float(row["error_rate"]) <= 1.0 for row in rows)
    assert (folder / "training.png").read_bytes().startswith(b"\x89PNG")


def test_evaluation_of_the_checkpoint_repeats_the_score(run: tuple[Path, dict[str, Any]]) -> None:
    folder, result = run
    options = parse(evaluate, [str(folder / "agent.npz")])
    again = evaluate.main(options)
    for key in ("noisy_performance", "mistakes_per_10000_bins", "error_rate", "answers"):
        assert again[key] == result[key]


def test_json_is_the_last_line_and_has_the_promised_keys(run: tuple[Path, dict[str, Any]]) -> None:
    folder, _ = run
    done = run_script("evaluate.py", str(folder / "agent.npz"), "--json", "--runs", "5")
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout.splitlines()[-1])
    assert set(result) >= {
        "noisy_performance", "mistakes_per_10000_bins", "silent_score", "error_rate", "seconds",
        "checkpoint",
    }  # fmt: skip
    assert set(result["noisy_performance"]) >= {"mean", "median", "ci95", "runs"}
    assert result["silent_score"] == 148.0
    assert result["noisy_performance"]["runs"] == 5


def test_standard_loop_and_compiled_loop_save_the_same_weights(tmp_path: Path) -> None:
    words = ("--trials", "40", "--n-classes", "2")
    trained(tmp_path / "a", *words, "--loop", "standard")
    trained(tmp_path / "b", *words, "--loop", "compiled")
    weights = [load_checkpoint(tmp_path / x / "agent.npz").agent.weights for x in "ab"]
    assert np.array_equal(*weights)


def test_resumed_training_ends_as_an_uninterrupted_one(tmp_path: Path) -> None:
    trained(tmp_path / "whole", "--trials", "200")
    trained(tmp_path / "half", "--trials", "100")
    checkpoint = str(tmp_path / "half" / "agent.npz")
    trained(tmp_path / "rest", "--trials", "100", "--resume", checkpoint)
    whole, rest = (load_checkpoint(tmp_path / x / "agent.npz") for x in ("whole", "rest"))
    assert np.array_equal(whole.agent.weights, rest.agent.weights)
    assert np.array_equal(whole.agent.velocity, rest.agent.velocity)


@pytest.fixture
def stops_at_100(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C once 100 trials are done."""
    real = train.train_many

    def interrupted(*args: Any, callback: Any, **settings: Any) -> Any:
        def stop(done: int, history: Any) -> None:
            callback(done, history)
            if done >= 100:
                raise KeyboardInterrupt

        return real(*args, callback=stop, **settings)

    monkeypatch.setattr(train, "train_many", interrupted)


def test_a_training_that_is_stopped_keeps_what_was_learned(
    tmp_path: Path, stops_at_100: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(Stopped, match="go on with --resume") as told:
        trained(tmp_path / "run")
    trials = told.value.result["trials"]
    assert told.value.result["stopped"] and 100 <= trials < 300
    assert told.value.result["checkpoint"] == str(tmp_path / "run" / "agent.npz")
    monkeypatch.undo()
    trained(tmp_path / "whole", "--trials", str(trials))
    saved, whole = (load_checkpoint(tmp_path / x / "agent.npz") for x in ("run", "whole"))
    assert np.array_equal(saved.agent.weights, whole.agent.weights)


def test_a_training_that_is_stopped_leaves_a_finished_one_alone(
    run: tuple[Path, dict[str, Any]], tmp_path: Path, stops_at_100: None
) -> None:
    folder = shutil.copytree(run[0], tmp_path / "copy")
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    with pytest.raises(Stopped, match=r"agent\.npz is as it was"):
        trained(folder, "--seed", "7")
    after = {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}
    assert after == before
    assert load_checkpoint(folder / "unfinished" / "agent.npz").task is not None


def test_a_training_that_is_killed_leaves_the_old_agent_and_its_last_checkpoint(
    run: tuple[Path, dict[str, Any]], tmp_path: Path
) -> None:
    folder = shutil.copytree(run[0], tmp_path / "copy")
    before = (folder / "agent.npz").read_bytes()
    words = ["--out", folder, "--checkpoint-every", "0", "--trials", "100000000"]
    process = subprocess.Popen([sys.executable, SCRIPTS / "train.py", *map(str, words)])
    try:
        while not (folder / "unfinished" / "agent.npz").exists():
            assert process.poll() is None
            time.sleep(0.05)
    finally:
        process.kill()
        process.wait()
    assert (folder / "agent.npz").read_bytes() == before
    resumed = trained(folder, "--resume", str(folder / "unfinished" / "agent.npz"))
    assert not resumed["stopped"] and not (folder / "unfinished").exists()


def test_sigterm_ends_as_ctrl_c_does_and_the_last_line_says_what_was_kept(tmp_path: Path) -> None:
    words = ["--out", tmp_path, "--checkpoint-every", "0", "--trials", "100000000", "--json"]
    process = subprocess.Popen(
        [sys.executable, SCRIPTS / "train.py", *map(str, words)],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    while not (tmp_path / "unfinished" / "agent.npz").exists():
        assert process.poll() is None
        time.sleep(0.05)
    process.terminate()
    out, err = process.communicate(timeout=60)
    assert process.returncode == 130
    told = json.loads(out.splitlines()[-1])
    assert told["stopped"] and told["checkpoint"] == str(tmp_path / "agent.npz")
    assert re.match(
        r"train\.py: stopped; kept what was learned in [\d,]+ trials", err.splitlines()[-1]
    )
    assert load_checkpoint(tmp_path / "agent.npz").rng is not None


def test_a_terminal_without_our_letters_does_not_fail_a_finished_training(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, SCRIPTS / "train.py", "--trials", "50", "--out", tmp_path],
        capture_output=True, env={**os.environ, "PYTHONIOENCODING": "ascii"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert b"95 % interval" in done.stdout


@pytest.mark.parametrize(
    "words",
    [
        ("--alpha", ".9"),
        ("--n-classes", "2"),
        ("--seed", "0"),
        ("--neuron", "lif"),
        ("--modulate",),
    ],
)
def test_options_that_resuming_would_ignore_are_refused(
    run: tuple[Path, dict[str, Any]], words: tuple[str, ...], tmp_path: Path
) -> None:
    with pytest.raises(ValueError, match=f"{words[0]} does not go with --resume"):
        trained(tmp_path, "--resume", str(run[0] / "agent.npz"), *words)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (("--rate", "2"), "rate must be in 0 … 1, got 2.0"),
        (("--n-classes", "2", "--targets", "1"), "targets must have one entry per class"),
        (("--alpha", "-1"), "alpha must be in 0 … 1"),
        (("--neuron", "lif", "--refractory", "-1"), "refractory must be >= 0"),
        (("--neuron", "mst", "--tau-s", "30"), "tau_s must be smaller than tau_m"),
        (("--tau-m", "9"), "--tau-m belongs to --neuron mst"),
        (("--modulate",), "--modulate belongs to --learner et"),
        (("--neuron", "network", "--learner", "all"), "network does not go with the rule all"),
        (("--learner", "bp"), "backpropagation needs the network's hidden layer"),
        (("--neuron", "lif", "--time", "continuous"), "only the GNM has differential equations"),
        (("--weight-bounds", "1", "0"), "weight_bounds must be (lowest, highest)"),
        (("--weight-bounds", "some"), "takes two numbers"),
        (("--resume", "nowhere.npz"), "there is no checkpoint nowhere.npz"),
    ],
)
def test_bad_input_is_refused_with_a_reason(
    words: tuple[str, ...], complaint: str, tmp_path: Path
) -> None:
    with pytest.raises(ValueError, match=re.escape(complaint)) as caught:
        trained(tmp_path / "out", *words)
    assert "\n" not in str(caught.value)


def test_bad_input_ends_with_exit_code_2_and_one_line(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_text("in the way")
    for script, words in (
        ("train.py", ("--out", str(file / "run"))),
        ("train.py", ("--pattern-seed", "-1", "--out", str(tmp_path / "run"))),
        ("evaluate.py", (str(file),)),
        ("show.py", ("responses",)),
    ):
        done = run_script(script, *words)
        assert done.returncode == 2
        assert len(done.stderr.strip().splitlines()) == 1, done.stderr
        assert done.stderr.startswith(f"{script}: ")


@pytest.mark.parametrize(
    "words",
    [
        ("--neuron", "lif", "--refractory", "2"),
        ("--neuron", "mst", "--learner", "et"),
        ("--time", "continuous", "--trials", "50"),
        ("--neuron", "network", "--trials", "50"),
    ],
)
def test_every_kind_trains_and_its_checkpoint_is_scored(
    words: tuple[str, ...], tmp_path: Path
) -> None:
    result = trained(tmp_path, *words)
    options = parse(evaluate, [result["checkpoint"], "--runs", "100"])
    assert evaluate.main(options)["noisy_performance"] == result["noisy_performance"]
    shown = parse(show, ["responses", result["checkpoint"], "--out", str(tmp_path)])
    assert Path(show.main(shown)["picture"]).exists()


def test_hysteresis_is_drawn_without_a_checkpoint(tmp_path: Path) -> None:
    options = parse(show, ["hysteresis", "--out", str(tmp_path)])
    assert Path(show.main(options)["picture"]).exists()
