"""Wrong outputs of the chemical neuron, against how many molecules make an input spike."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agents.chemistry.network import ReactionNetwork
from agents.chemistry.reactor import POINTS_PER_BIN, Course, Reactor
from agents.continuous.agent import ContinuousAgent
from agents.continuous.outputs import at_edges, wrong_outputs
from agents.continuous.simulate import InputSpikes
from gnm_env.checks import whole
from gnm_env.task import Patterns, Task
from gnm_env.trial import draw_trial

MOLECULES = (10, 20, 50, 100, 200, 500, 1000, 2000)


@dataclass(frozen=True, eq=False)
class Mistakes:
    """Wrong outputs per trial (see `agents.continuous.outputs.wrong_outputs`) on the same trials.

    Attributes:
        molecules: int64 (M,), molecules per input spike.
        stochastic: int64 (M, trials), one run of each trial.
        deterministic: int64 (trials,), with infinitely many molecules.
        neuron: int64 (trials,), of the continuous neuron itself: C → ∞ as well, unless it is a
            `ReactingGNM`.
    """

    molecules: NDArray[np.int64]
    stochastic: NDArray[np.int64]
    deterministic: NDArray[np.int64]
    neuron: NDArray[np.int64]


def count_mistakes(
    agent: ContinuousAgent,
    task: Task,
    patterns: Patterns,
    molecules: Sequence[int] = MOLECULES,
    trials: int = 100,
    seed: int = 0,
    conversion: float | None = None,
    progress: Callable[[], None] | None = None,
) -> Mistakes:
    """Run `trials` trials, drawn from `seed`, for each number of molecules.

    `conversion` is that of `ReactionNetwork.from_agent`; `progress` is called after each trial.
    Raises ValueError and ImportError as `ReactionNetwork` and `Reactor` do.
    """
    numbers = [whole("molecules", m, low=1) for m in molecules]
    trials = whole("trials", trials, low=1)
    reactor = Reactor(ReactionNetwork.from_agent(agent, conversion))
    rng = np.random.default_rng(seed)
    found = Mistakes(
        np.array(numbers, np.int64),
        np.empty((len(numbers), trials), np.int64),
        np.empty(trials, np.int64),
        np.empty(trials, np.int64),
    )
    for k in range(trials):
        trial = draw_trial(task, patterns, rng)
        spikes = InputSpikes.from_trial(trial)
        found.neuron[k] = wrong_outputs(trial, at_edges(agent, trial))
        found.deterministic[k] = wrong_outputs(trial, _edges(reactor.deterministic(spikes)))
        for m, number in enumerate(numbers):
            course = reactor.stochastic(spikes, number, seed=k)
            found.stochastic[m, k] = wrong_outputs(trial, _edges(course)[0])
        if progress is not None:
            progress()
    return found


def _edges(course: Course) -> NDArray[np.float64]:
    """S at the edges of the bins."""
    return course.S()[..., ::POINTS_PER_BIN]
