"""Training, score, one trial and its teaching signal: what the page draws, ready for JSON."""

from __future__ import annotations

import dataclasses
import math
import os
import tempfile
import time
import warnings
from collections import OrderedDict
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents import History, WeightOverflow, train_many
from agents.commands.scoring import score
from agents.explorer.settings import Settings
from agents.explorer.teaching import teaching_signal
from agents.plotting import shown_trial
from agents.recording import record
from gnm_env import Patterns, Trial

BLOCKS = 60
"""Points of a learning curve."""
KEPT = 16
"""Trained agents that are kept, so that a game, a download or another trial need no training."""
DIGITS = 5
"""Significant digits of what is only drawn."""


class Superseded(Exception):
    """Nobody waits for this result any more."""


class Trained(NamedTuple):
    """An agent that has learned, and what is told of it."""

    agent: Any
    patterns: Patterns
    history: History
    initial: NDArray[np.float64]
    rng: np.random.Generator
    score: dict[str, Any]
    seconds: float
    """Wall time of training and scoring."""


class Trainer:
    """Trains what a link says, and keeps the last few. To be used by one thread at a time."""

    def __init__(self) -> None:
        self._kept: OrderedDict[Settings, Trained] = OrderedDict()

    def trained(self, settings: Settings, cancelled: Callable[[], bool] = lambda: False) -> Trained:
        """The agent of these settings after its training.

        `cancelled` is asked after each block of trials; once it says True, Superseded is raised.
        """
        key = dataclasses.replace(settings, shown=0)
        if key not in self._kept:
            self._kept[key] = _train(settings, cancelled)
            if len(self._kept) > KEPT:
                self._kept.popitem(last=False)
        self._kept.move_to_end(key)
        return self._kept[key]


def _train(settings: Settings, cancelled: Callable[[], bool]) -> Trained:
    began = time.monotonic()
    agent, patterns = settings.agent(), settings.patterns()
    initial, rng = agent.weights.copy(), np.random.default_rng(settings.seed)

    def callback(done: int, history: History) -> bool:
        return not cancelled()

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", WeightOverflow)  # the page says so itself
        history = train_many(
            [agent], settings.task, patterns, settings.trials, rng, threads=1,
            callback=callback, block=max(1, settings.trials // BLOCKS),
        )  # fmt: skip
    if cancelled():
        raise Superseded
    scored = score(agent, settings.task, patterns)
    seconds = time.monotonic() - began
    return Trained(agent, patterns, history.of(0), initial, rng, scored, seconds)


def result(settings: Settings, trained: Trained) -> dict[str, Any]:
    """All that the page draws, but for the teaching signal."""
    trial = shown_trial(settings.task, trained.patterns, settings.shown)
    recording = record(trained.agent, trial)
    agent, history, scored = trained.agent, trained.history, trained.score
    bounds = agent.weight_bounds
    return {
        "score": scored | {"silent_mistakes_per_10000_bins": _silent_mistakes(settings)},
        "state": state_of(scored, recording, agent.model.threshold),
        "curve": {
            "trials": history.trials.tolist(),
            "wrong": rounded(history.error_rate),
            "error": rounded(history.mean_error),
        },
        "overflowed": int(history.overflowed),
        "trial": described(trial),
        "recording": {
            "X": rounded(recording.X),
            "threshold": agent.model.threshold,
            "readout": getattr(agent.model, "readout", "V"),
            "graded": bool(agent.model.graded),
            "spikes": np.flatnonzero(recording.spikes).tolist(),
        },
        "weights": {
            "initial": rounded(trained.initial),
            "learned": rounded(agent.weights),
            "bounds": list(bounds) if bounds and all(map(math.isfinite, bounds)) else None,
        },
        "seconds": trained.seconds,
    }


def _silent_mistakes(settings: Settings) -> float | None:
    """Mistakes per 10,000 bins of silence; None where silence makes none."""
    survived = settings.task.silent_score
    return 10_000.0 / survived if math.isfinite(survived) and any(settings.task.owed) else None


def state_of(scored: dict[str, Any], recording: Any, threshold: float) -> str:
    """ "silent" or "above" where the neuron never spikes, else "alive"."""
    given = np.array(scored["answers"]["spikes_given"])
    if given[:, 1:].any() or scored["answers"]["false_positives_per_1000_noise_bins"] > 0:
        return "alive"
    return "above" if np.mean(recording.X >= threshold) > 0.5 else "silent"


def described(trial: Trial) -> dict[str, Any]:
    """A trial: its input spikes by bin, and its presentations."""
    arrays = trial.arrays
    return {
        "n_bins": trial.n_bins,
        "n_inputs": trial.n_inputs,
        "bins": np.repeat(np.arange(trial.n_bins), np.diff(arrays.offsets)).tolist(),
        "channels": arrays.channels.tolist(),
        "onsets": trial.onsets.tolist(),
        "ends": trial.ends.tolist(),
        "classes": trial.classes.tolist(),
        "targets": trial.targets.tolist(),
        "label": trial.label,
    }


def teaching(settings: Settings, trained: Trained) -> dict[str, Any]:
    """The teaching signal in the trial that is shown, ready for JSON; y is None if there is none.

    It is what the rule would say, also where the label is muted.
    """
    trial = shown_trial(settings.task, trained.patterns, settings.shown)
    y = teaching_signal(trained.agent, trial)
    return {"y": None if y is None else rounded(y)}


def checkpoint(settings: Settings, trained: Trained) -> bytes:
    """The file that `gnm evaluate` and `gnm train --resume` take."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "agent.npz")
        trained.agent.save(
            os.fspath(path), task=settings.task, patterns=trained.patterns, rng=trained.rng
        )
        return path.read_bytes()


def rounded(values: NDArray[np.float64]) -> list[float]:
    """Numbers for a picture, at DIGITS significant digits."""
    return [float(f"{value:.{DIGITS}g}") for value in values.tolist()]
