"""Many agents on one shared stream, compiled, on all cores: the same arithmetic as the loop."""

from __future__ import annotations

import contextlib
import copy
import itertools
import os
import signal
import threading
from collections import defaultdict
from collections.abc import Hashable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from typing import Any

import numpy as np
from numpy.random import Generator

from agents.history import BLOCK, Callback, History, checked_callback
from agents.memory import require_memory
from agents.model import Model
from agents.training.batch import AgentBatch
from agents.training.loop import MAX_TRIALS, warn_of_overflow
from agents.training.source import Source, source_of
from gnm_env.checks import whole
from gnm_env.task import Patterns, Task

SHARES, BLOCKS_PER_SHARE = 3, 8
"""Units per thread at most, and blocks of lanes from which on a thread gets more than one.

With several, a thread that the machine holds up leaves work to the others. Every unit draws the
trials for itself, which eight blocks make cheap.
"""

Unit = tuple[AgentBatch, list[int]]
"""Agents that one thread trains side by side, and their places in the user's list."""


def train_many(
    agents: Sequence[Any],
    task: Task | Any,
    patterns: Patterns | None = None,
    trials: int | None = None,
    seed: int | Generator | None = None,
    threads: int | None = None,
    *,
    callback: Callback | None = None,
    block: int = BLOCK,
) -> History:
    """Train agents on the same `trials` trials.

    Each trial is drawn once for all agents of a kind that share a thread, from the same generator.

    Each agent ends with the bits that `train` gives it alone on the same seed, whatever the number
    of agents and of threads. An interrupt (Ctrl-C) waits for the present block of trials: all
    agents then stand at the same trial, the last one of the history that the callback was given.

    Args:
        agents: of any kinds that learn, each once; those alike are trained side by side.
        task, patterns: what they hear; or a data set of trials, `gnm_env.Trials`, in place of both.
        trials: number of trials.
        seed: of the stream. A Generator goes on from where it stands, and is moved on; None: a
            stream that nobody has heard before. Of a data set, it draws the order of the trials,
            each epoch anew.
        threads: number of threads; None: one per core.
        callback: called after each block with the trials done and the history; False ends training.
            The agents are up to date when it is called; what it changes in them is lost.
        block: trials per entry of the history.

    Returns:
        The learning curves, with one column per agent, in the order of `agents`.

    Raises:
        ValueError: if there are no agents, if one cannot learn or does not fit the task, or if
            memory is short.
    """
    if trials is None:
        raise ValueError("trials must say how many trials to train on, such as trials=60_000")
    trials = whole("trials", trials, low=0, high=MAX_TRIALS)
    block = whole("block", block, low=1, high=MAX_TRIALS)
    callback = checked_callback(callback)
    rng = generator_from(seed)
    threads = thread_count(threads)
    source = source_of(task, patterns)
    _refuse_twice(agents)
    units = lane_groups(agents, source, threads)
    for group, places in units:
        if not hasattr(group, "train"):
            raise ValueError(
                f"agents must be able to learn, but agent {places[0]} is a "
                f"{type(agents[places[0]]).__name__}, which can only be scored"
            )
        for place in places:  # not where they are scored, too: that asks nothing of a rule
            rule = getattr(agents[place], "rule", None)
            if rule is not None:
                rule.check_source(source)
    history = History(
        error_rate=np.empty((0, len(agents))),
        mean_error=np.empty((0, len(agents))),
        overflowed=np.full(len(agents), -1),
    )
    if trials == 0:
        return history
    with ThreadPoolExecutor(threads) as pool:
        for start in range(0, trials, block):
            size = min(block, trials - start)
            with uninterrupted():
                _train_block(units, pool, source, rng, size, history)
                over = bool(np.all(history.overflowed >= 0))
                for group, _ in units:
                    group.write_back()
            if callback is not None and callback(start + size, history) is False:
                break
            if over:
                break
    for k in np.flatnonzero(history.overflowed >= 0):
        warn_of_overflow(f"agent {k}", int(history.overflowed[k]) + 1)
    return history


def _train_block(
    units: list[Unit],
    pool: ThreadPoolExecutor,
    source: Source,
    rng: Generator,
    size: int,
    history: History,
) -> None:
    """One block of trials for all units, each with its own copy of the stream's generator."""
    ahead = source.ahead(rng, size)
    # The first unit moves the caller's generator on; the others hear the same from copies.
    streams = [rng] + [copy.deepcopy(rng) for _ in units[1:]]
    wrong = np.empty(len(history.overflowed))
    absolute = np.empty(len(history.overflowed))
    tasks = [
        pool.submit(group.train, stream, ahead, size)
        for (group, _), stream in zip(units, streams, strict=True)
    ]
    wait(tasks)
    for (group, places), result in zip(units, tasks, strict=True):
        wrong[places], absolute[places] = result.result()
        history.overflowed[places] = group.overflowed()
    history.append(size, wrong, absolute)


@contextlib.contextmanager
def uninterrupted() -> Iterator[None]:
    """Ctrl-C inside waits until the end, however often it comes: what is inside is done whole."""
    handler = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(handler):
        yield  # interrupts come to the main thread only, or not at all
        return
    came: list[Any] = []

    def note(number: int, frame: Any) -> None:
        came.append((number, frame))

    signal.signal(signal.SIGINT, note)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, handler)
        if came:
            handler(*came[0])


def _refuse_twice(agents: Any) -> None:
    seen: dict[int, int] = {}
    for place, agent in enumerate(agents if isinstance(agents, Sequence) else ()):
        first = seen.setdefault(id(agent), place)
        if first != place:
            raise ValueError(
                f"agents must be different objects, but agent {place} is agent {first} again: "
                "make one agent for each place"
            )


def generator_from(seed: Any) -> Generator:
    """`seed` as a Generator: itself if it is one, else a new one; ValueError if it cannot be."""
    if isinstance(seed, Generator):
        return seed
    if seed is None:
        return np.random.default_rng()
    return np.random.default_rng(whole("seed", seed, low=0, high=2**128 - 1))


def thread_count(threads: int | None) -> int:
    """`threads`, checked; None: one per core that this process may use."""
    if threads is None:
        can_tell = hasattr(os, "sched_getaffinity")
        return len(os.sched_getaffinity(0)) if can_tell else os.cpu_count() or 1
    return whole("threads", threads, low=1, high=1_024)


def lane_groups(agents: Sequence[Any], source: Source, threads: int) -> list[Any]:
    """Agents grouped by kind and cut into units for the threads, each with its agents' places."""
    if not isinstance(agents, Sequence) or len(agents) == 0:
        raise ValueError(f"agents must be a list of at least one agent, got {agents!r}")
    for place, agent in enumerate(agents):
        if isinstance(agent, type):
            raise ValueError(
                f"agents must be instances, got the class {agent.__name__} as agent {place}"
            )
        if not hasattr(agent, "group_key"):
            raise ValueError(
                f"agents must be agents, such as NeuronAgent makes, got {agent!r} as agent {place}"
            )
    n_weights = sum(
        np.size(getattr(agent, name, ())) for agent in agents for name in ("weights", "weight_sum")
    )
    require_memory(n_weights, len(agents), source, threads)
    kinds: dict[Hashable, list[int]] = defaultdict(list)
    for place, agent in enumerate(agents):
        kinds[agent.group_key()].append(place)
    units: list[Any] = []
    for places in kinds.values():
        widest = getattr(getattr(agents[places[0]], "model", None), "widest", Model.widest)
        for part in _parts(places, threads, widest):
            members = [agents[place] for place in part]
            units.append((type(members[0]).batch(members, source), part))
    return units


def _parts(places: list[int], threads: int, width: int) -> list[list[int]]:
    """Runs of nearly equal length, cut between blocks of lanes: as many for each thread."""
    blocks = -(-len(places) // width)
    shares = max(1, min(SHARES, blocks // (threads * BLOCKS_PER_SHARE))) if threads > 1 else 1
    parts = min(threads * shares, blocks)
    cuts = np.linspace(0, blocks, parts + 1).round().astype(int) * width
    return [places[a:b] for a, b in itertools.pairwise(cuts)]
