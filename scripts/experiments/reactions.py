"""F8: trained neurons as chemical reaction networks, molecule by molecule; its claim."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from agents.chemistry import ReactionNetwork, Reactor
from agents.chemistry.mistakes import count_mistakes
from agents.chemistry.reactor import POINTS_PER_BIN
from agents.continuous import InputSpikes
from experiments.continuous import CLASSES, trained
from experiments.design import Block, Coordinate, Experiment, Variable
from experiments.statistics import Interval, bootstrap, mean
from experiments.training import (
    WEIGHTS,
    class_counts,
    evaluation_seed,
    pattern_seeds,
    protocol,
    stream_seeds,
)
from experiments.verdict import Claim, Finding, Results
from gnm_env import Patterns, Task, Trial

MOLECULES = (10, 25, 50, 100, 200, 500, 1000, 2000)
"""Molecules per input spike for which wrong outputs are counted."""

TRACED = (25, 100, 500)
"""Those of the paper's figure."""

CONVERSION = 10.0
SEEDS = {"quick": 2, "paper": 4}
TRIALS = {"quick": 4, "paper": 25}
RUNS = {"quick": 4, "paper": 20}
GAP = 25
"""Bins of noise before, between and after the patterns of the trial that is traced."""

BINS = CLASSES * (GAP + Task().pattern_bins) + GAP


def volumes(size: str, seeds: tuple[int, ...] | None = None) -> Experiment:
    """Traces and wrong outputs for several numbers of molecules per input spike."""
    common = {
        "neuron": "continuous",
        "rule": "all",
        "alpha": 0.2,
        "trials": 60_000,
        "conversion": CONVERSION,
        "heard": TRIALS[size],
        "runs": RUNS[size],
    }
    lengths = {
        "molecules": len(MOLECULES),
        "traced": len(TRACED),
        "run": RUNS[size],
        "heard": TRIALS[size],
        "point": BINS * POINTS_PER_BIN + 1,
        "channel": Task().n_inputs,
    }
    unit = "molecules per input spike"
    variables = (
        Variable("wrong", "int64", "1", "wrong outputs of a trial", ("molecules", "heard")),
        Variable("wrong_deterministic", "int64", "1", "the same, deterministic", ("heard",)),
        Variable("wrong_neuron", "int64", "1", "the same, continuous neuron", ("heard",)),
        Variable("deviation", "float64", unit, "rms of V about deterministic V", ("traced", "run")),
        Variable("V", "float64", unit, "V of run 0 over the traced trial", ("traced", "point")),
        Variable("V_deterministic", "float64", unit, "deterministic V", ("point",)),
        WEIGHTS,
    )
    axes = (class_counts(CLASSES), pattern_seeds(seeds or tuple(range(SEEDS[size]))))
    described = protocol(Task(), [common]) | {"molecules": MOLECULES, "traced": TRACED, "gap": GAP}
    title = "Trained neurons as chemical reaction networks, two classes"
    coordinates = (
        *stream_seeds(axes),
        Coordinate("molecules", ("molecules",), np.array(MOLECULES), "molecules per input spike"),
        Coordinate("traced", ("traced",), np.array(TRACED), "molecules per input spike"),
    )
    return Experiment("F8", title, axes, common, _react, variables, lengths, described, coordinates)


def traced_trial(task: Task, patterns: Patterns, seed: int) -> Trial:
    """Each pattern once, with noise around it."""
    rng = np.random.default_rng(seed)
    noise = rng.random((task.n_classes + 1, GAP, task.n_inputs)) < task.rate
    parts = [part for pair in zip(noise, patterns.dense(), strict=False) for part in pair]
    onsets = GAP + (GAP + task.pattern_bins) * np.arange(task.n_classes)
    raster = np.concatenate([*parts, noise[-1]])
    return Trial.from_dense(raster, onsets, np.arange(task.n_classes), task)


def _react(block: Block) -> dict[str, NDArray[Any]]:
    (setting,) = block.settings
    agent, task, patterns = trained(setting)
    seed = evaluation_seed(setting["classes"], setting["pattern_seed"])
    mistakes = count_mistakes(
        agent, task, patterns, MOLECULES, setting["heard"], seed, setting["conversion"]
    )
    spikes = InputSpikes.from_trial(traced_trial(task, patterns, seed))
    reactor = Reactor(ReactionNetwork.from_agent(agent, setting["conversion"]))
    exact = reactor.deterministic(spikes).V
    runs = np.stack([reactor.stochastic(spikes, m, setting["runs"], seed).V for m in TRACED])
    values = {
        "wrong": mistakes.stochastic,
        "wrong_deterministic": mistakes.deterministic,
        "wrong_neuron": mistakes.neuron,
        "deviation": np.sqrt(np.mean((runs - exact) ** 2, axis=-1)),
        "V": runs[:, 0],
        "V_deterministic": exact,
        "weights": agent.weights,
    }
    return {name: value.reshape(*block.shape, *value.shape) for name, value in values.items()}


# --- the claim -----------------------------------------------------------------------------------


def pooled(values: xr.DataArray, within: str, last: str) -> NDArray[Any]:
    """Values of all seeds in one row, (seeds × `within`, `last`)."""
    ordered = values.squeeze("classes").transpose("pattern_seed", within, last).to_numpy()
    return ordered.reshape(-1, ordered.shape[-1])


def _shrinkage(results: xr.Dataset) -> list[Interval]:
    """Deviation at each number of traced molecules over that at the next larger one."""
    runs = pooled(results["deviation"].sel(traced=list(TRACED)), "run", "traced")
    return [
        bootstrap(lambda a, b: float(a.mean() / b.mean()), runs[:, k], runs[:, k + 1])
        for k in range(len(TRACED) - 1)
    ]


def _judge(results: Results) -> Finding:
    shrinks = _shrinkage(results["F8"])
    wrong = pooled(results["F8"]["wrong"].sel(molecules=list(TRACED)), "heard", "molecules")
    fewer = mean(wrong[:, 0] - wrong[:, -1])
    means = wrong.mean(axis=0)
    approaches = all(found.low > 1 for found in shrinks)
    errs_more = fewer.low > 0 and bool(np.all(np.diff(means) <= 0))
    numbers = (
        "deviation from the deterministic V: "
        + ", ".join(f"{m} over {n} molecules {found:.2f}"
                    for m, n, found in zip(TRACED, TRACED[1:], shrinks, strict=False)),
        f"wrong outputs per trial at {', '.join(map(str, TRACED))} molecules: "
        + ", ".join(f"{value:.2f}" for value in means)
        + f"; difference between first and last {fewer:.2f}",
    )  # fmt: skip
    return Finding(approaches and errs_more, {}, numbers)


CLAIMS = (
    Claim(
        "F8",
        "Fig. 8",
        "Chemical network, two classes: stochastic runs with 25, 100, 500 molecules per spike "
        "approach the deterministic solution; fewer molecules, more wrong outputs",
        "continuous GNM, η 0, α 0.2, ALL, 60,000 trials, as a reaction network with C = 10; exact "
        "stochastic simulation",
        "reproduced if the rms deviation of V from the deterministic V shrinks from 25 to 100 and "
        "from 100 to 500 molecules (ratios with intervals above 1, bootstrap over runs) and wrong "
        "outputs per trial do not rise with the number of molecules, with an interval of the fall "
        "from 25 to 500 above 0 (bootstrap over trials)",
        ("F8",),
        "gnm/PatternTrial-v0, graded, 2 classes",
        _judge,
    ),
)
