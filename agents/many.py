"""Many agents on one shared stream, compiled, on all cores: the same arithmetic as the loop."""

from __future__ import annotations

import copy
import itertools
import os
from collections import defaultdict
from collections.abc import Hashable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from numpy.random import Generator

from agents.history import BLOCK, Callback, History
from agents.lane_group import LaneGroup
from agents.loop import warn_of_overflow
from agents.memory import require_memory
from agents.neuron_lanes import LANES_PER_BLOCK
from gnm_env.checks import whole
from gnm_env.task import Patterns, Task

SHARES, BLOCKS_PER_SHARE = 3, 8
"""Units per thread at most, and blocks of lanes from which on a thread gets more than one.

With several, a thread that the machine holds up leaves work to the others. Every unit draws the
trials for itself, which eight blocks make cheap.
"""


def train_many(
    agents: Sequence[Any],
    task: Task,
    patterns: Patterns,
    trials: int,
    seed: int | Generator | None = None,
    threads: int | None = None,
    *,
    callback: Callback | None = None,
    block: int = BLOCK,
) -> History:
    """Train agents on the same `trials` trials.

    Each trial is drawn once for all agents of a kind that share a thread, from the same generator.

    Each agent ends with the bits that `train` gives it alone on the same seed, whatever the number
    of agents and of threads.

    Args:
        agents: of any kinds that learn; those alike are trained side by side.
        task, patterns: what they hear.
        trials: number of trials.
        seed: of the stream. A Generator goes on from where it stands, and is moved on; None: a
            stream that nobody has heard before.
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
    trials, block = whole("trials", trials, low=0), whole("block", block, low=1)
    rng = seed if isinstance(seed, Generator) else np.random.default_rng(seed)
    threads = thread_count(threads)
    units = lane_groups(agents, task, patterns, threads)
    for group, places in units:
        if not hasattr(group, "train"):
            raise ValueError(
                f"agents must be able to learn, but agent {places[0]} is a "
                f"{type(agents[places[0]]).__name__}, which can only be scored"
            )
    history = History(
        error_rate=np.empty((0, len(agents))),
        mean_error=np.empty((0, len(agents))),
        overflowed=np.full(len(agents), -1),
    )
    try:
        with ThreadPoolExecutor(threads) as pool:
            for start in range(0, trials, block):
                size = min(block, trials - start)
                _train_block(units, pool, rng, size, history)
                if callback is not None:
                    _write_back(units)
                    if callback(start + size, history) is False:
                        break
                if np.all(history.overflowed >= 0):
                    break
    finally:
        # After an interrupt too, and then only once every thread has finished its block: before
        # that, weights are on the move.
        _write_back(units)
    for k in np.flatnonzero(history.overflowed >= 0):
        warn_of_overflow(f"agent {k}", int(history.overflowed[k]) + 1)
    return history


Unit = tuple[LaneGroup, list[int]]
"""Agents that one thread trains side by side, and their places in the user's list."""


def _train_block(
    units: list[Unit], pool: ThreadPoolExecutor, rng: Generator, size: int, history: History
) -> None:
    """One block of trials for all units, each with its own copy of the stream's generator."""
    # The first unit moves the caller's generator on; the others hear the same from copies.
    streams = [rng] + [copy.deepcopy(rng) for _ in units[1:]]
    wrong = np.empty(len(history.overflowed))
    absolute = np.empty(len(history.overflowed))
    tasks = [
        pool.submit(group.train, stream, size)
        for (group, _), stream in zip(units, streams, strict=True)
    ]
    for (group, places), result in zip(units, tasks, strict=True):
        wrong[places], absolute[places] = result.result()
        history.overflowed[places] = group.overflowed()
    history.append(size, wrong, absolute)


def _write_back(units: list[Unit]) -> None:
    for group, _ in units:
        group.write_back()


def thread_count(threads: int | None) -> int:
    """`threads`, checked; None: one per core that this process may use."""
    if threads is None:
        can_tell = hasattr(os, "sched_getaffinity")
        return len(os.sched_getaffinity(0)) if can_tell else os.cpu_count() or 1
    return whole("threads", threads, low=1)


def lane_groups(agents: Sequence[Any], task: Task, patterns: Patterns, threads: int) -> list[Unit]:
    """Agents grouped by kind and cut into units for the threads, each with its agents' places."""
    if not isinstance(agents, Sequence) or len(agents) == 0:
        raise ValueError(f"agents must be a list of at least one agent, got {agents!r}")
    for place, agent in enumerate(agents):
        if not hasattr(agent, "group_key"):
            raise ValueError(
                f"agents must be agents, such as NeuronAgent makes, got {agent!r} as agent {place}"
            )
    n_weights = sum(np.size(getattr(agent, "weights", ())) for agent in agents)
    require_memory(n_weights, len(agents), task, threads)
    kinds: dict[Hashable, list[int]] = defaultdict(list)
    for place, agent in enumerate(agents):
        kinds[agent.group_key()].append(place)
    units: list[Unit] = []
    for places in kinds.values():
        for part in _parts(places, threads):
            members = [agents[place] for place in part]
            units.append((type(members[0]).lanes(members, task, patterns), part))
    return units


def _parts(places: list[int], threads: int) -> list[list[int]]:
    """Runs of nearly equal length, cut between blocks of lanes: as many for each thread."""
    blocks = -(-len(places) // LANES_PER_BLOCK)
    shares = max(1, min(SHARES, blocks // (threads * BLOCKS_PER_SHARE))) if threads > 1 else 1
    parts = min(threads * shares, blocks)
    cuts = np.linspace(0, blocks, parts + 1).round().astype(int) * LANES_PER_BLOCK
    return [places[a:b] for a, b in itertools.pairwise(cuts)]
