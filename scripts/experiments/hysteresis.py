"""F1: a neuron under constant input, and the claims about it. Nothing is trained."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from agents import GNM, AggregateLabel, NeuronAgent, record
from experiments.design import Axis, Block, Experiment, Variable
from experiments.verdict import Claim, Finding, Results
from gnm_env import Task, Trial

NEURON = {"eta": 0.8, "alpha": 0.3, "beta": 0.1}
BINS = 200
LEVELS = {"sub-threshold": 0.05, "super-threshold": 0.15}
"""Input per bin. Without a reset V settles at I / ((1−η)α): 0.83 and 2.5; the threshold is 1."""


def constant_input(size: str, seeds: tuple[int, ...] | None = None) -> Experiment:
    """V, D and R over time for both levels of input; the same at every size."""
    levels = Axis("input", tuple(LEVELS), settings=tuple({"drive": v} for v in LEVELS.values()))
    variables = (
        Variable("V", "float64", "1", "membrane potential", ("bin",)),
        Variable("D", "float64", "1/bin", "decay", ("bin",)),
        Variable("R", "float64", "1", "recovery variable", ("bin",)),
        Variable("spikes", "int8", "1", "output spikes", ("bin",)),
    )
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


# --- claims --------------------------------------------------------------------------------------

RESET = 0.5
LOOP = 0.1


def cycle(results: xr.Dataset) -> tuple[NDArray[Any], NDArray[Any]]:
    """V and D from one output spike to the next, once the beginning is forgotten."""
    driven = results.sel(input="super-threshold")
    first, last = np.flatnonzero(driven["spikes"].to_numpy())[-2:]
    return tuple(driven[name].to_numpy()[first : last + 1] for name in ("V", "D"))  # type: ignore[return-value]


def loop_area(V: NDArray[Any], D: NDArray[Any]) -> float:
    """Area that D encloses over V in one cycle, as a share of the box around it."""
    box = np.ptp(V) * np.ptp(D)
    return float(abs(np.sum(V * np.roll(D, -1) - D * np.roll(V, -1))) / 2 / box)


def _judge_potential(results: Results) -> Finding:
    data = results["F1"]
    below = data["V"].sel(input="sub-threshold").to_numpy()
    above = data["V"].sel(input="super-threshold").to_numpy()
    peak, trough = above.max(), above[above.argmax() :].min()
    calm = bool(np.all(np.diff(below) > -1e-12) and below.max() < 1.0)
    reset = bool(peak >= 1.0 and trough <= RESET * peak)
    return Finding(
        calm and reset,
        {},
        (
            f"sub-threshold: rises to {below[-1]:.3f}",
            f"super-threshold: peak {peak:.3f}, falls to {trough:.3f} after it",
            "no uncertainty: nothing is drawn",
        ),
    )


def _judge_hysteresis(results: Results) -> Finding:
    area = loop_area(*cycle(results["F1"]))
    return Finding(
        area >= LOOP,
        {},
        (f"the loop fills {area:.0%} of the box around it", "no uncertainty: nothing is drawn"),
    )


_PROTOCOL = "GNM with η 0.8, α 0.3, β 0.1, other parameters as elsewhere; input " + ", ".join(
    f"{level:g} per bin ({name})" for name, level in LEVELS.items()
)

CLAIMS = (
    Claim(
        "F1c",
        "Fig. 1c",
        "η 0.8, α 0.3, β 0.1, constant input: V(t) stays below threshold under weak input and is "
        "reset under strong input",
        _PROTOCOL,
        "reproduced if V rises without falling and stays below the threshold under the weak "
        "input, "
        f"and under the strong one crosses it and then falls to at most {RESET:.0%} of its peak",
        ("F1",),
        "constant input",
        _judge_potential,
    ),
    Claim(
        "F1d",
        "Fig. 1d",
        "Under super-threshold input D(t) is hysteretic in V(t)",
        _PROTOCOL,
        f"reproduced if the loop of D over V between the last two output spikes encloses at least "
        f"{LOOP:.0%} of the box around it",
        ("F1",),
        "constant input",
        _judge_hysteresis,
    ),
)
