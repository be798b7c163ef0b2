"""F1b: a trained neuron tells three patterns apart by one, two and three spikes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from agents import GNM, AggregateLabel, NeuronAgent, record
from agents.experiments.design import Block, Experiment, Variable
from agents.experiments.methods import GNM_ALL, initial_weights
from agents.experiments.reactions import GAP, traced_trial
from agents.experiments.statistics import share
from agents.experiments.training import (
    RUN,
    STARTS,
    WEIGHTS,
    class_counts,
    pattern_seeds,
    protocol,
    stream_seeds,
    trained,
)
from agents.experiments.verdict import Claim, Finding, Forest, Mark, Results
from agents.plotting import GREY, INK, shade
from gnm_env import Patterns, Task, Trial
from gnm_env.levels import evaluation_seed

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

# --- the grid ------------------------------------------------------------------------------------

CLASSES = 3
SEEDS = {"quick": 6, "paper": 24}
HEARD = 100
"""Trials that a trained neuron hears, each pattern once in each, with noise around."""


def three_patterns(size: str, seeds: tuple[int, ...] | None = None) -> Experiment:
    """GNMs on three classes from both starts, and what they answer to each pattern."""
    axes = (class_counts(CLASSES), pattern_seeds(seeds or range(SEEDS[size])), initial_weights())
    common = {**GNM_ALL, "trials": RUN["trials"]}
    given = Variable(
        "given", "int16", "1", "output spikes in each presentation, by class", ("heard", "target")
    )
    astray = Variable("astray", "int16", "1", "output spikes in the noise of a trial", ("heard",))
    return Experiment(
        "F1b",
        "Responses to three patterns",
        axes,
        common,
        _train_and_hear,
        (given, astray, WEIGHTS),
        {"heard": HEARD, "target": CLASSES, "channel": Task().n_inputs},
        protocol(Task(), [common]),
        stream_seeds(axes),
    )


def _train_and_hear(block: Block) -> dict[str, NDArray[Any]]:
    task, pattern_seed = Task(n_classes=CLASSES), block.settings[0]["pattern_seed"]
    patterns = Patterns.draw(task, pattern_seed)
    neurons, _ = trained(block.settings, task, patterns)
    trials = _heard(task, patterns, pattern_seed)
    counts = np.array([[_counts(neuron, trial) for trial in trials] for neuron in neurons])
    weights = [neuron.weights for neuron in neurons]
    return block.shaped(given=counts[..., :-1], astray=counts[..., -1], weights=weights)


def _heard(task: Task, patterns: Patterns, pattern_seed: int) -> list[Trial]:
    first = evaluation_seed(task.n_classes, pattern_seed)
    return [traced_trial(task, patterns, first + k) for k in range(HEARD)]


def _counts(neuron: NeuronAgent, trial: Trial) -> list[int]:
    """Output spikes in each presentation, and in all noise together."""
    spikes = record(neuron, trial).spikes
    given = [int(spikes[on:end].sum()) for on, end in zip(trial.onsets, trial.ends, strict=True)]
    return [*given, int(spikes.sum()) - sum(given)]


# --- the claim -----------------------------------------------------------------------------------

OWED = Task(n_classes=CLASSES).owed


def exact(data: xr.Dataset) -> xr.DataArray:
    """Share of the trials answered with the spikes owed and silence in between, by neuron."""
    given = (data["given"] == np.asarray(OWED)).all("target")
    return (given & (data["astray"] == 0)).mean("heard").squeeze("classes")


def _judge(results: Results) -> Finding:
    shares = exact(results["F1b"])
    held, words, marks = {}, [], []
    for start in STARTS:
        does = shares.sel(start=start).to_numpy() > 0.5
        found = share(does)
        holds = found.value >= 0.5
        held[f"the initial weights are the {start} ones"] = holds
        words.append(
            f"{start}: {does.sum()} of {len(does)} neurons answer more than half of the trials "
            f"exactly, {found:.0%}; the median neuron {float(shares.sel(start=start).median()):.0%}"
        )
        marks.append(Mark(start, found, holds))
    forest = Forest("share of seeds", 0.5, 1.0, tuple(marks))
    return Finding.of(held, words, forest=forest)


CLAIMS = (
    Claim(
        "F1b",
        "Fig. 1b",
        "The GNM responds with one spike to one pattern, with two and three to two others, and is "
        "silent in the noise between",
        "GNM, η 0, α 0.3, ALL, three classes, 60,000 trials; matched and wide initial weights; "
        f"{HEARD} trials with each pattern once and {GAP} bins of noise around each",
        "reproduced if in at least half of the pattern seeds the neuron answers more than half of "
        "the trials exactly (one, two and three spikes, none in noise), from both starts; "
        "conditional on the start",
        ("F1b",),
        "gnm/PatternTrial-v0, 3 classes",
        _judge,
    ),
)

# --- the panel -----------------------------------------------------------------------------------


def example(data: xr.Dataset) -> tuple[NeuronAgent, Trial, int]:
    """The neuron drawn, a trial that it answers exactly where there is one, and its pattern seed.

    It is that of the first pattern seed that answers more than half of the trials exactly from
    matched initial weights; where none does, that of the best.
    """
    shares = exact(data).sel(start="matched").to_numpy()
    does = shares > 0.5
    place = int(does.argmax() if does.any() else shares.argmax())
    pattern_seed = int(data["pattern_seed"][place])
    task = Task(n_classes=CLASSES)
    one = data.isel(pattern_seed=place, classes=0).sel(start="matched")
    neuron = NeuronAgent(GNM(), AggregateLabel(), n_inputs=task.n_inputs)
    neuron.weights = one["weights"].to_numpy()
    right = ((one["given"] == np.asarray(OWED)).all("target") & (one["astray"] == 0)).to_numpy()
    trial = _heard(task, Patterns.draw(task, pattern_seed), pattern_seed)[int(right.argmax())]
    return neuron, trial, pattern_seed


def draw_response(axes: Axes, data: xr.Dataset) -> None:
    """V over a trial with each pattern once, output spikes above, presentations shaded."""
    neuron, trial, _ = example(data)
    recording = record(neuron, trial)
    theta = GNM().theta_r
    shade(axes, trial)
    axes.plot(recording.V, color=INK, lw=0.9)
    axes.axhline(theta, color=GREY, lw=0.8, ls=":")
    spikes = np.flatnonzero(recording.spikes)
    top = float(recording.V.max())
    axes.vlines(spikes, top + 0.08, top + 0.2, color=INK, lw=1.2)
    counts = _counts(neuron, trial)
    for class_, (onset, end) in enumerate(zip(trial.onsets, trial.ends, strict=True)):
        axes.annotate(
            f"class {class_}\n{counts[class_]} spike{'s' * (counts[class_] != 1)}",
            ((onset + end) / 2, top + 0.27), ha="center", va="bottom", fontsize=6,
        )  # fmt: skip
    axes.set(xlabel="time (bins)", ylabel="membrane potential V", xlim=(0, trial.n_bins))
    axes.set_ylim(-0.05, top + 0.62)


def described(data: xr.Dataset) -> str:
    """For a caption: which neuron is drawn."""
    _, _, pattern_seed = example(data)
    right = exact(data).sel(start="matched", pattern_seed=pattern_seed)
    return (
        f" The neuron of (b) has pattern seed {pattern_seed} and answers {float(right):.0%} of "
        f"{HEARD} such trials exactly."
    )


EXPERIMENTS = {"F1b": three_patterns}
