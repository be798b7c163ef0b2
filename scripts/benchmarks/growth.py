"""How the time per unit of work grows with the size of the problem."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from statistics import median
from typing import Any

import gymnasium as gym
import numpy as np

from agents import AggregateLabel
from benchmarks.environments import staggered
from benchmarks.rows import Curve, Findings, Row, Target
from benchmarks.timing import Settings, Skip, Subject, Timing, race
from benchmarks.training import LANES, learning, neurons
from gnm_env import Task

SECTION = "Growth"
NS = "ns per neuron-bin"
FLAT = 20.0
"""Percent by which a flat curve may leave its middle."""


def sizes(settings: Settings) -> Findings:
    """Growth with the number of inputs, the length of trials, and the rate of input spikes."""
    found = Findings()
    trials = 500 if settings.quick else 3_000
    given = f"{LANES} neurons, {trials:,} trials"
    tasks: dict[str, tuple[str, dict[float, Task]]] = {
        "inputs": ("N, inputs", {n: Task(n_inputs=n) for n in (10, 30, 100, 300, 1_000)}),
        "length of a trial": (
            "background bins",
            {n: Task(background_bins=n) for n in (30, 100, 300, 1_000, 3_000)},
        ),
        "rate": (
            "p, spikes per bin",
            {p: Task(rate=p) for p in (0.001, 0.0025, 0.005, 0.01, 0.02)},
        ),
    }
    for name, (symbol, by_size) in tasks.items():
        subjects = []
        for size, task in by_size.items():
            # The longer the trials the fewer, so that each size does about the same work.
            n = max(round(trials * 200 / (task.background_bins + task.mean_pattern_bins)), 5)
            make = partial(neurons, n_inputs=task.n_inputs)
            subjects.append(learning(str(size), make, task, n, settings.seed))
        timings = race(subjects, settings)
        note = given + (
            "; from 210 inputs on the tenth of highest eligibility is found by cuts"
            if name == "inputs"
            else ""
        )
        found.curves.append(curve(name, symbol, list(by_size), timings, note=note))
    inputs = found.curves[0]
    found.rows.append(
        Row(
            SECTION,
            f"{inputs.name}, {inputs.sizes[-1]:,}",
            NS,
            inputs.values[-1],
            more_is_better=False,
            targets=(Target(10.0),),
        )
    )
    return found


def lanes(settings: Settings) -> Findings:
    """Growth with the number of neurons side by side: to be flat."""
    trials = 500 if settings.quick else 2_000
    at = [64, 256, 1_024, 4_096]
    subjects = [learning(str(n), partial(neurons, n=n), Task(), trials, settings.seed) for n in at]
    timings = race(subjects, settings)
    note = f"{trials:,} trials"
    return _flat(curve("neurons side by side", "neurons", at, timings, note=note, flat=True))


def trials(settings: Settings) -> Findings:
    """Growth with the number of trials, while neurons learn and where they cannot.

    As they learn they err less, and a trial without an error costs less. With learning rate 0 all
    trials cost the same, and the curve is to be flat; with learning it is not to rise.
    """
    at = [1_000, 3_000, 10_000, 30_000]
    if not settings.quick:
        at = [10_000, 30_000, 100_000, 300_000, 1_000_000]
    curves = []
    cases = (("learning", AggregateLabel(), LANES), ("learning rate 0", idle_rule(), LANES // 2))
    for label, rule, n in cases:
        make = partial(neurons, rule=rule, n=n)
        timings = race([learning(str(k), make, Task(), k, settings.seed) for k in at], settings)
        grown = curve(f"number of trials, {label}", "trials", at, timings, note=f"{n} neurons")
        curves.append(replace(grown, label=label, flat=rule.learning_rate == 0.0))
    learned, idle = curves
    row = Row(
        SECTION,
        f"{learned.name}, {at[0]:,} … {at[-1]:,}",
        f"× the time per neuron-bin at {at[0]:,}, at most",
        tuple(max(r) / r[0] for r in zip(*learned.values, strict=True)),
        more_is_better=False,
        targets=(Target(1.2),),
        note="falls where neurons err less and less, since only errors are learned from",
    )
    return Findings(rows=[row, *_flat(idle).rows], curves=curves)


def idle_rule() -> AggregateLabel:
    """Does all the work of learning, and changes nothing."""
    return AggregateLabel(learning_rate=0.0)


def environments(settings: Settings) -> Findings:
    """Growth with the number of environments in one native vector environment."""
    at = [1, 4, 16, 64, 256, 1_024, 4_096]
    timings = race([_stepping(n, 200 if settings.quick else 1_000) for n in at], settings)
    unit = "ns per environment-step"
    return Findings(curves=[curve("environments", "environments", at, timings, unit=unit)])


def _stepping(n: int, steps: int) -> Subject:
    steps = max(steps * 64 // max(n, 64), 20)
    try:
        envs = gym.make_vec(
            "gnm/PatternTrial-v0", num_envs=n, vectorization_mode="vector_entry_point"
        )
    except (gym.error.Error, ImportError, TypeError) as error:
        raise Skip(f"there is no native vector environment: {error}") from None
    staggered(envs)
    actions = np.zeros(n, np.int64)

    def run(_: Any) -> None:
        for _ in range(steps):
            envs.step(actions)

    return Subject(str(n), run, n * steps)


def curve(
    name: str,
    symbol: str,
    at: Sequence[float],
    timings: dict[str, Timing],
    *,
    unit: str = NS,
    note: str = "",
    flat: bool = False,
) -> Curve:
    """Timings of subjects that are named after their size."""
    values = tuple(tuple(1e9 * s for s in timings[str(size)].seconds) for size in at)
    return Curve(name, symbol, unit, tuple(at), values, flat, note)


def _flat(grown: Curve) -> Findings:
    """The curve, and a row that says how far it is from flat."""
    row = Row(
        SECTION,
        f"{grown.name}, {grown.sizes[0]:,} … {grown.sizes[-1]:,}",
        "± % of the time per neuron-bin",
        # Of the medians, which a single disturbance does not move.
        (deviation([median(repeats) for repeats in grown.values]),),
        more_is_better=False,
        targets=(Target(FLAT),),
        note=grown.note,
    )
    return Findings(rows=[row], curves=[grown])


def deviation(values: Sequence[float]) -> float:
    """How far the extremes are from the middle between them, in percent."""
    return 100 * (max(values) - min(values)) / (max(values) + min(values))
