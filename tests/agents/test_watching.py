"""An agent at work as a file, and with its potential."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from agents import GNM, LIF, AggregateLabel, NeuronAgent, play, record
from agents.commands import watch
from agents.commands.terminal import parse
from gnm_env import Patterns, Task, draw_trial

TASK = Task(n_classes=2)
PATTERNS = Patterns.draw(TASK, seed=0)


class Reflex:
    """A policy with Stable-Baselines3's `predict`: never spikes."""

    def predict(self, observation: Any, state: Any = None, **how: Any) -> tuple[Any, Any]:
        return np.zeros(np.asarray(observation).shape[:-1], np.int64), None


def agent(neuron: Any = None) -> NeuronAgent:
    return NeuronAgent(neuron or GNM(), AggregateLabel(), TASK.n_inputs, 0, 0.3)


@pytest.mark.parametrize("neuron", [GNM(), LIF(), GNM(readout="D")])
def test_the_potential_is_that_of_the_recording(neuron: Any) -> None:
    one = agent(neuron)
    trial = draw_trial(TASK, PATTERNS, np.random.default_rng(0))
    assert one.potential == 0.0
    one.begin_trial()
    seen = []
    for row in trial.dense().view(np.int8):
        one.act(row)
        seen.append(one.potential)
    assert np.array_equal(seen, record(one, trial).V)
    one.begin_trial()
    assert one.potential == 0.0


@pytest.mark.parametrize("hears", ["stream", "trials"])
def test_a_gif_shows_every_second_bin(tmp_path: Path, hears: str) -> None:
    image = pytest.importorskip("PIL.Image")
    path = tmp_path / "watch.gif"
    told = play(agent(), TASK, PATTERNS, path, hears=hears, bins=60, every=2, scale=0.5)
    assert told["bins"] == 60 and told["path"] == str(path)
    with image.open(path) as gif:
        assert gif.n_frames == 30
        assert gif.info["duration"] == 40


def test_the_potential_is_in_the_picture(tmp_path: Path) -> None:
    image = pytest.importorskip("PIL.Image")
    pictures = []
    for name, one in (("neuron", agent()), ("policy", Reflex())):
        path = tmp_path / f"{name}.gif"
        play(one, TASK, PATTERNS, path, bins=40, every=40)
        with image.open(path) as gif:
            pictures.append(np.array(gif.convert("RGB")))
    # Below the raster and the spikes, the potential is drawn only where it is known.
    from gnm_env.rendering import (
        COUNT_HEIGHT,
        GAP,
        LEFT,
        POTENTIAL_HEIGHT,
        RASTER_HEIGHT,
        SPIKE_HEIGHT,
        TOP,
    )

    top = TOP + RASTER_HEIGHT + GAP + SPIKE_HEIGHT + COUNT_HEIGHT + GAP
    dark = [(p[top : top + POTENTIAL_HEIGHT, LEFT:].max(axis=2) < 90).sum() for p in pictures]
    assert dark[0] > 40 and dark[1] == 0


def test_an_mp4_is_written(tmp_path: Path) -> None:
    pytest.importorskip("imageio_ffmpeg")
    path = tmp_path / "watch.mp4"
    play(agent(), TASK, PATTERNS, path, bins=20, every=2, scale=0.5)
    assert path.read_bytes()[4:8] == b"ftyp"


def test_silence_makes_a_mistake_at_each_pattern_of_the_stream(tmp_path: Path) -> None:
    pytest.importorskip("PIL.Image")
    told = play(Reflex(), TASK, PATTERNS, tmp_path / "a.gif", bins=1_000, every=500)
    assert 3 <= told["mistakes"] <= 12  # one in 148 bins


def test_bad_arguments_are_told(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="must end in"):
        play(agent(), TASK, PATTERNS, tmp_path / "watch.avi")
    with pytest.raises(ValueError, match="hears"):
        play(agent(), TASK, PATTERNS, tmp_path / "watch.gif", hears="noise")
    with pytest.raises(ValueError, match="no frame"):
        play(agent(), TASK, PATTERNS, tmp_path / "watch.gif", bins=2, every=5)
    with pytest.raises(ValueError, match=r"a GIF of 500,000,000 frames needs .* GiB"):
        play(agent(), TASK, PATTERNS, tmp_path / "watch.gif", bins=10**9)
    with pytest.raises(ValueError, match="cannot write 3: a path must be text"):
        play(agent(), TASK, PATTERNS, 3)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"fps must be in 0\.01 … 1000"):
        play(agent(), TASK, PATTERNS, tmp_path / "watch.gif", fps=1e300)
    with pytest.raises(ValueError, match=r"patterns must be gnm_env\.Patterns, got None"):
        play(agent(), TASK, None, tmp_path / "watch.gif")  # type: ignore[arg-type]
    for nobody in (None, 3, GNM()):
        with pytest.raises(ValueError, match="an agent must have a method predict"):
            play(nobody, TASK, PATTERNS, tmp_path / "watch.gif")
    assert not list(tmp_path.iterdir())


def test_the_command_shows_a_saved_agent(tmp_path: Path) -> None:
    pytest.importorskip("PIL.Image")
    agent().save(tmp_path / "agent.npz", task=TASK, patterns=PATTERNS)
    words = [str(tmp_path / "agent.npz"), "--to", str(tmp_path / "a.gif"), "--bins", "20"]
    assert watch.main(parse(watch, words))["bins"] == 20
    assert (tmp_path / "a.gif").exists()


def test_without_pygame_the_command_names_the_extra_in_one_line() -> None:
    root = Path(__file__).parents[2]
    saved = root / "agents" / "trained" / "gnm-all-1.npz"
    code = "import sys; sys.modules['pygame'] = None; from agents.commands import main; main()"
    ended = subprocess.run(
        [sys.executable, "-c", code, "watch", str(saved)],
        capture_output=True, text=True, cwd=root,
        env={**os.environ, "PYTHONPATH": str(root)},
    )  # fmt: skip
    assert ended.returncode == 2
    (line,) = ended.stderr.splitlines()
    assert line == 'gnm watch: render_mode="human" needs pygame: pip install "gnm-env[rendering]"'
