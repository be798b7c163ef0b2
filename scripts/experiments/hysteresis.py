"""F1: a neuron under constant input. Nothing is trained."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents import GNM, AggregateLabel, NeuronAgent, record
from experiments.design import Axis, Block, Experiment, Variable
from gnm_env import Task, Trial

NEURON = {"eta": 0.8, "alpha": 0.3, "beta": 0.1}
BINS = 200
LEVELS = {"sub-threshold": 0.05, "super-threshold": 0.15}
"""Input per bin. Without a reset V settles at I / ((1−η)α): 0.83 and 2.5; the threshold is 1."""


def constant_input(size: str, seeds: tuple[int, ...] | None = None) -> Experiment:
    """V, D and R over time for both levels of input; the same at every size."""
    levels = Axis("input", tuple(LEVELS), settings=tuple({"drive": v} for v in LEVELS.values()))
    variables = tuple(
        Variable(name, "float64", units, what, ("bin",))
        for name, units, what in (
            ("V", "1", "membrane potential"),
            ("D", "1/bin", "decay"),
            ("R", "1", "recovery variable"),
        )
    ) + (Variable("spikes", "int8", "1", "output spikes", ("bin",)),)
    return Experiment(
        "F1", "A neuron under constant input", (levels,), NEURON, _watch, variables, {"bin": BINS}
    )


def _watch(block: Block) -> dict[str, NDArray[Any]]:
    traces = [_trace(dict(setting)) for setting in block.settings]
    return {name: np.stack([trace[name] for trace in traces]) for name in traces[0]}


def _trace(setting: dict[str, Any]) -> dict[str, NDArray[Any]]:
    """One channel that spikes in every bin is a constant input of its weight."""
    drive = setting.pop("drive")
    agent = NeuronAgent(GNM(**setting), AggregateLabel(fraction=1.0), n_inputs=1)
    agent.weights[:] = drive
    trial = Trial.from_dense(np.ones((BINS, 1)), [], [], Task(n_inputs=1))
    recording = record(agent, trial)
    return {name: getattr(recording, name) for name in ("V", "D", "R", "spikes")}
