"""How good a trained agent is: noisy performance, mistakes, answers per class, with intervals."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from agents.policy import as_agent
from agents.training.batch import Answers
from agents.training.loop import MAX_TRIALS
from agents.training.many import lane_groups, thread_count
from agents.training.source import source_of
from gnm_env.checks import MAX_BINS, MAX_SEED, flag, require_memory, shown, whole
from gnm_env.rules import MAX_EPISODE_BINS, RUNS
from gnm_env.task import Patterns, Task

ANSWERED = 2_000
"""Trials of a stream that `answers` hears unless told otherwise."""

MAX_RUNS = 10_000_000
"""Most streams of one measurement."""

MAX_RESAMPLES = 1_000_000_000
"""Most resamples of a bootstrap."""


def noisy_performance(
    agent: Any | Sequence[Any],
    task: Task,
    patterns: Patterns,
    runs: int = RUNS,
    cap: int = MAX_EPISODE_BINS,
    seed: int = 0,
    *,
    threads: int | None = None,
    shared: bool = True,
) -> NDArray[np.int64]:
    """Bins survived before the first mistake on endless streams, learning off.

    Equal to the returns of `gnm/PatternStream-v0`, stepped with the agent: run k hears the stream
    of `reset(seed=seed + k)`.

    Args:
        agent: an agent, or anything with Stable-Baselines3's `predict` that hears the bits; or a
            list of such.
        task, patterns: what they hear.
        runs: number of streams, at most MAX_RUNS.
        cap: most bins per stream, at most 10⁹.
        seed: of the streams. Space the seeds of different measurements by at least `runs`.
        threads: number of threads; None: one per core.
        shared: whether the agents of a list hear the same streams. If not, agent b hears those of
            seed + b·runs.

    Returns:
        int64 (runs,), or (agents, runs) for a list.

    Raises:
        ValueError: if a number is out of range, memory is short, or an agent does not fit the task
            or answers with anything but one spike or none for each stream.
    """
    runs = whole("runs", runs, low=1, high=MAX_RUNS)
    cap = whole("cap", cap, low=1, high=MAX_BINS)
    seed, shared = whole("seed", seed, low=0), flag("shared", shared)
    agents = [as_agent(one) for one in (agent if isinstance(agent, Sequence) else [agent])]
    require_memory(
        f"{runs:,} runs of {len(agents):,} agents", 8.0 * runs * len(agents), "run fewer"
    )
    bins = np.empty((len(agents), runs), np.int64)
    threads = thread_count(threads)
    source = source_of(task, patterns)
    if shared or not agents:
        units = lane_groups(agents, source, threads)
    else:
        units = [
            (group, [b])
            for b in range(len(agents))
            for group, _ in lane_groups(agents[b : b + 1], source, 1)
        ]

    def fill(unit: int) -> None:
        group, places = units[unit]
        first = seed if shared else seed + places[0] * runs
        bins[places] = _survived(group, first, runs, cap)

    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(fill, range(len(units))))
    return bins if isinstance(agent, Sequence) else bins[0]


def _survived(group: Any, first_seed: int, runs: int, cap: int) -> NDArray[np.int64]:
    """Bins survived on `runs` streams, (agents, runs)."""
    if hasattr(group, "survive_streams"):  # a policy: all streams side by side
        together: NDArray[np.int64] = group.survive_streams(first_seed, runs, cap)
        return together
    streams = (np.random.default_rng(first_seed + k) for k in range(runs))
    return np.stack([group.survive(rng, cap) for rng in streams], axis=1)


def answers(
    agent: Any | Sequence[Any],
    task: Task | Any,
    patterns: Patterns | None = None,
    trials: int | None = None,
    seed: int = 0,
) -> Answers:
    """What an agent, or each agent of a list, answers to trials, learning off.

    Args:
        agent: as for `noisy_performance`.
        task, patterns: what is heard; or a data set of trials, `gnm_env.Trials`, in place of both.
        trials: number of trials, at most 10¹²; None: 2,000, or each trial of the data set once.
        seed: of the stream; the order of a data set is its own.

    Raises:
        ValueError: as for `noisy_performance`.
    """
    source = source_of(task, patterns)
    once = trials is None
    if trials is None:
        trials = source.n_trials or ANSWERED
    trials = whole("trials", trials, low=1, high=MAX_TRIALS)
    seed = whole("seed", seed, low=0)
    agents = [as_agent(one) for one in (agent if isinstance(agent, Sequence) else [agent])]
    units = lane_groups(agents, source, threads=1)
    parts = []
    for group, _ in units:
        source.restart(in_order=once)
        parts.append(group.answer(np.random.default_rng(seed), trials))
    places = np.concatenate([places for _, places in units])

    def in_order(arrays: list[NDArray[Any]]) -> NDArray[Any]:
        return np.concatenate(arrays)[np.argsort(places)]

    return Answers(
        in_order([part.table for part in parts]),
        in_order([part.false_positives for part in parts]),
        parts[0].noise_bins,
        in_order([part.wrong for part in parts]),
        in_order([part.absolute for part in parts]),
        trials,
    )


@dataclass(frozen=True)
class MistakeRate:
    """Mistakes per 10,000 bins over all runs, with an exact 95 % Poisson interval."""

    rate: float
    low: float
    high: float


def mistake_rate(survived: ArrayLike, cap: int = MAX_EPISODE_BINS) -> MistakeRate:
    """The mistake rate of runs that survived so many bins; those at the cap made no mistake.

    Raises ValueError unless there is at least one run, and all are whole numbers in 0 … cap.
    """
    from scipy.stats import chi2

    cap = whole("cap", cap, low=1)
    bins = _numbers("survived", survived)
    if bins.dtype.kind == "f" and np.all(bins == np.floor(bins)):
        bins = bins.astype(np.int64)
    if bins.dtype.kind not in "iu" or bins.min() < 0 or bins.max() > cap:
        raise ValueError(
            f"survived must be whole numbers of bins in 0 … cap = {cap:,}, got {shown(survived)}; "
            "give the cap that the runs were measured with"
        )
    mistakes = int(np.sum(bins < cap))
    # Who errs in the very first bin of every run has survived none: count those bins.
    exposure = max(int(bins.sum()), mistakes, 1) / 10_000
    low = chi2.ppf(0.025, 2 * mistakes) / 2 if mistakes else 0.0
    high = chi2.ppf(0.975, 2 * mistakes + 2) / 2
    return MistakeRate(mistakes / exposure, float(low) / exposure, float(high) / exposure)


def bootstrap_interval(
    values: ArrayLike, *, resamples: int = 10_000, seed: int = 0
) -> tuple[float, float]:
    """95 % percentile bootstrap interval of the mean of `values`, (n,), n >= 1 finite numbers.

    Raises ValueError for other values, a number out of range, or if memory is short.
    """
    sample = _numbers("values", values).astype(np.float64)
    if sample.ndim != 1:
        raise ValueError(f"values must be a row of numbers, got shape {sample.shape}")
    resamples = whole("resamples", resamples, low=1, high=MAX_RESAMPLES)
    rng = np.random.default_rng(whole("seed", seed, low=0, high=MAX_SEED))
    need = 1.6 * resamples * len(sample) + 16.0 * resamples
    require_memory(f"{resamples:,} resamples of {len(sample):,} values", need, "take fewer")
    # In ten parts, which take a tenth of the memory.
    sizes = np.full(10, resamples // 10) + (np.arange(10) < resamples % 10)
    chunks = [
        sample[rng.integers(0, len(sample), (size, len(sample)))].mean(axis=1) for size in sizes
    ]
    low, high = np.percentile(np.concatenate(chunks), (2.5, 97.5))
    return float(low), float(high)


def _numbers(name: str, values: Any) -> NDArray[Any]:
    """`values` as an array of at least one finite number, or ValueError."""
    try:
        array = np.asarray(values)
    except ValueError:  # rows of unequal length
        array = np.array(None)
    if array.dtype.kind not in "fiub" or array.ndim == 0 or array.size == 0:
        raise ValueError(f"{name} must be at least one number, in a row, got {shown(values)}")
    if not np.isfinite(array).all():
        raise ValueError(f"{name} must be finite, got {shown(values)}: leave out what is missing")
    return array
