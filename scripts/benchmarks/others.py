"""The same arithmetic done by what one would otherwise use.

64 neurons (GNM, η = 0) listen to trials of 200 bins, learning off: V(t) = (1−α) V(t−1) + I(t), and
an output spike where V rises to 1 or above it. The others get the trials as a ready-made dense
raster, several side by side, since without learning trials may run in parallel; ours draws its
trials as well, within its time. All have to count the same output spikes.
"""

from __future__ import annotations

import functools
import warnings
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents import GNM, AggregateLabel, NeuronAgent
from agents.training.source import TaskSource
from benchmarks.rows import Findings, rate_rows
from benchmarks.timing import Settings, Subject, race
from benchmarks.training import LANES, bins, learning, neurons
from gnm_env import Patterns, Task, Trial, draw_trial

ALPHA = 0.3
LISTENED = Task(background_bins=200, mean_occurrences=0.0)
"""Trials of equal length, as libraries that work on batches want them."""
SIDE_BY_SIDE = 16
"""Trials that the others work on at once: more no longer fit into the cache."""
OURS = "agents, compiled"
NUMPY = "NumPy, loop over bins"


class Forward(NamedTuple):
    """What the others are given."""

    raster: NDArray[np.float64]
    """(bins, trials, inputs)"""
    weights: NDArray[np.float64]
    """(inputs, neurons)"""


Way = Callable[[Forward], NDArray[Any]]
"""Counts the output spikes of each neuron, (neurons,)."""


def numpy_loop(given: Forward) -> NDArray[Any]:
    """One matrix product for the input, then a loop over bins for all neurons at once."""
    drive = given.raster @ given.weights
    V = np.zeros(drive.shape[1:])
    below = np.ones(V.shape, np.bool_)
    count = np.zeros(V.shape, np.int64)
    for t in range(len(drive)):
        V = (1 - ALPHA) * V + drive[t]
        above = V >= 1.0
        count += above & below
        below = ~above
    return count.sum(axis=0)


def scipy_filter(given: Forward) -> NDArray[Any]:
    """The potential as a linear filter of the input; only without soft reset, η = 0."""
    from scipy.signal import lfilter

    V = lfilter([1.0], [1.0, ALPHA - 1.0], given.raster @ given.weights, axis=0)
    return _crossings(V)


def _crossings(V: NDArray[Any]) -> NDArray[Any]:
    """Upward crossings of 1 by each neuron; V is (bins, trials, neurons)."""
    above = V >= 1.0
    first: NDArray[Any] = above[0].sum(axis=0)
    return first + (above[1:] & ~above[:-1]).sum(axis=(0, 1))


def snntorch_leaky() -> Way:
    """snnTorch's leaky neuron without reset, bin by bin."""
    import snntorch

    return _in_torch(snntorch.Leaky(beta=1 - ALPHA, threshold=1.0, reset_mechanism="none"))


def norse_leaky() -> Way:
    """Norse's leaky integrator without synaptic current, bin by bin."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from norse.torch.functional.leaky_integrator_box import (
            LIBoxParameters,
            LIBoxState,
            li_box_feed_forward_step,
        )
    import torch

    p = LIBoxParameters(tau_mem_inv=torch.tensor(1000 * ALPHA))

    def cell(drive: Any, V: Any) -> tuple[Any, Any]:
        # Norse weighs the input with dt/τ = α.
        return li_box_feed_forward_step(drive / ALPHA, LIBoxState(V), p)

    return _in_torch(lambda drive, V: (None, cell(drive, V)[0]))


def _in_torch(cell: Callable[[Any, Any], tuple[Any, Any]]) -> Way:
    """Spikes counted by a loop over a cell that gives (anything, V); float32, as is usual there."""
    import torch

    torch.set_num_threads(1)

    def count(given: Forward) -> NDArray[Any]:
        with torch.no_grad():
            raster, weights = (torch.as_tensor(array, dtype=torch.float32) for array in given)
            drive = raster @ weights
            V = torch.zeros(drive.shape[1:], dtype=drive.dtype)
            below = torch.ones(V.shape, dtype=torch.bool)
            spikes = torch.zeros(V.shape, dtype=torch.int64)
            for t in range(len(drive)):
                _, V = cell(drive[t], V)
                above = V >= 1.0
                spikes += above & below
                below = ~above
        return spikes.sum(dim=0).numpy()

    return count


OTHERS: dict[str, tuple[str, Callable[[], Way]]] = {
    NUMPY: ("numpy", lambda: numpy_loop),
    "scipy.signal.lfilter": ("scipy", lambda: scipy_filter),
    "snnTorch, Leaky": ("snntorch", snntorch_leaky),
    "Norse, leaky integrator": ("norse", norse_leaky),
}
"""Package that each needs, and how to make it."""


def forward(settings: Settings) -> Findings:
    """Listening only."""
    found = Findings()
    agents = listeners()
    given = heard(agents, SIDE_BY_SIDE, settings.seed)
    expected = spikes_of_ours(agents, SIDE_BY_SIDE, settings.seed)
    subjects = [_ours(agents, settings)]
    for name, (package, make) in OTHERS.items():
        try:
            way = make()
        except ImportError as error:
            found.skipped.append(f"{name}: {package} cannot be imported ({error})")
            continue
        require_agreement(name, way(given), expected)
        work = SIDE_BY_SIDE * LISTENED.background_bins * LANES
        subjects.append(Subject(name, lambda _, way=way: way(given), work))  # type: ignore[misc]
    notes = {
        OURS: "draws its trials within its time; the others get them as a dense raster, "
        f"{SIDE_BY_SIDE} trials of {LISTENED.background_bins} bins side by side, and all count "
        "the same output spikes"
    }
    section = f"Listening only, {LANES} neurons, beside other software"
    found.rows += rate_rows(section, race(subjects, settings), against=NUMPY, notes=notes)
    return found


def learning_trials(settings: Settings) -> Findings:
    """Listening and aggregate-label learning, trial after trial, beside NumPy."""
    task = Task()
    rows = []
    for lanes, trials in ((LANES, 300), (1, 2_000)):
        trials = trials // 5 if settings.quick else trials
        who = f"{lanes} neurons" if lanes > 1 else "one neuron"
        given = [Heard.of(trial) for trial in drawn(task, trials, settings.seed)]
        make = functools.partial(neurons, GNM(alpha=ALPHA), AggregateLabel(), lanes)
        ours = learning(f"agents.train_many, {who}", make, task, trials, settings.seed)
        theirs = Subject(
            f"NumPy, {who}",
            functools.partial(numpy_training, given),
            ours.work,
            functools.partial(weights_of, make),
        )
        rows += rate_rows(
            "Listening and learning (ALL), beside other software",
            race([ours, theirs], settings),
            against=theirs.name,
            notes={ours.name: f"the first {trials:,} trials"},
        )
    return Findings(rows=rows)


def weights_of(make: Callable[[], Sequence[NeuronAgent]]) -> NDArray[np.float64]:
    """The weights of new agents, (inputs, neurons)."""
    return np.stack([agent.weights for agent in make()], axis=1)


class Heard(NamedTuple):
    """A trial as a NumPy user would hold it."""

    raster: NDArray[np.float64]
    label: int

    @classmethod
    def of(cls, trial: Trial) -> Heard:
        return cls(trial.dense().astype(np.float64), trial.label)


def numpy_training(trials: Sequence[Heard], weights: NDArray[np.float64]) -> NDArray[np.float64]:
    """Aggregate-label learning of all columns of `weights` (inputs, neurons) in NumPy, in place."""
    rule = AggregateLabel()
    n_inputs, lanes = weights.shape
    teaching = round(rule.fraction * n_inputs)
    previous = np.zeros(weights.shape)
    for trial in trials:
        drive = trial.raster @ weights
        V = np.empty(drive.shape)
        v = np.zeros(lanes)
        for t in range(len(drive)):
            v = (1 - ALPHA) * v + drive[t]
            V[t] = v
        above = V >= 1.0
        emitted = above[0] + (above[1:] & ~above[:-1]).sum(axis=0)
        sign = np.sign(trial.label - emitted)
        if not sign.any():
            continue
        g = np.zeros(lanes)
        for t in range(len(V) - 1, -1, -1):
            g = V[t] + (1 - ALPHA) * g
            V[t] = g
        eligibility = trial.raster.T @ V
        bar = np.partition(eligibility, n_inputs - teaching - 1, axis=0)[n_inputs - teaching - 1]
        change = np.where(eligibility > bar, rule.learning_rate * sign, 0.0)
        change += rule.momentum * previous
        wrong = sign != 0
        previous[:, wrong] = change[:, wrong]
        weights[:, wrong] = np.clip(weights[:, wrong] + change[:, wrong], 0.0, 1.0)
    return weights


def listeners() -> list[NeuronAgent]:
    """Neurons whose initial weights make them spike now and then."""
    return [
        NeuronAgent(GNM(alpha=ALPHA), AggregateLabel(), LISTENED.n_inputs, seed, 0.5)
        for seed in range(LANES)
    ]


def heard(agents: Sequence[NeuronAgent], trials: int, seed: int) -> Forward:
    """The first trials of the stream of `seed` as a dense raster, and the agents' weights."""
    rasters = [trial.dense() for trial in drawn(LISTENED, trials, seed)]
    return Forward(np.stack(rasters, axis=1).astype(np.float64), weights_of(lambda: agents))


def drawn(task: Task, trials: int, seed: int) -> list[Trial]:
    """The first trials of the stream of `seed`."""
    rng = np.random.default_rng(seed)
    patterns = Patterns.draw(task, 0)
    return [draw_trial(task, patterns, rng) for _ in range(trials)]


def spikes_of_ours(agents: Sequence[NeuronAgent], trials: int, seed: int) -> NDArray[np.int64]:
    """Output spikes of each agent in these trials."""
    group = NeuronAgent.batch(agents, TaskSource(LISTENED, Patterns.draw(LISTENED, 0)))
    return group.answer(np.random.default_rng(seed), trials).false_positives


def require_agreement(name: str, counted: NDArray[Any], expected: NDArray[np.int64]) -> None:
    """ValueError unless the spikes are the same, but for rounding where V only just reaches 1."""
    if np.abs(counted - expected).sum() > 1e-3 * expected.sum():
        raise ValueError(
            f"{name} must count the output spikes that ours counts, {expected.sum()} in all, "
            f"got {counted.sum()}: it does not do the same arithmetic"
        )


def _ours(agents: Sequence[NeuronAgent], settings: Settings) -> Subject:
    trials = 500 if settings.quick else 5_000
    group = NeuronAgent.batch(agents, TaskSource(LISTENED, Patterns.draw(LISTENED, 0)))
    return Subject(
        OURS,
        lambda _: group.answer(np.random.default_rng(settings.seed), trials),
        LANES * bins(LISTENED, trials, settings.seed),
    )
