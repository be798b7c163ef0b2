"""F1: a neuron under constant input, and the claims about it. Nothing is trained."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from agents import GNM, Recording
from experiments.design import Axis, Block, Experiment, Variable
from experiments.verdict import Claim, Finding, Results
from hysteresis import BINS, LEVELS, NEURON, constant_input, last_cycle

TRACES = {
    "V": ("float64", "1", "membrane potential"),
    "D": ("float64", "1/bin", "decay"),
    "R": ("float64", "1", "recovery variable"),
    "X": ("float64", "1", "readout"),
    "spikes": ("int8", "1", "output spikes"),
}


def two_levels(size: str, seeds: tuple[int, ...] | None = None) -> Experiment:
    """V, D and R over time for both levels of input; the same at every size."""
    levels = Axis("input", tuple(LEVELS), settings=tuple({"drive": v} for v in LEVELS.values()))
    variables = tuple(
        Variable(name, dtype, units, what, ("bin",))
        for name, (dtype, units, what) in TRACES.items()
    )
    title = "A neuron under constant input"
    return Experiment("F1", title, (levels,), asdict(NEURON), _watch, variables, {"bin": BINS})


def _watch(block: Block) -> dict[str, NDArray[Any]]:
    runs = [_run(dict(setting)) for setting in block.settings]
    return {name: np.stack([getattr(run, name) for run in runs]) for name in TRACES}


def _run(setting: dict[str, Any]) -> Recording:
    drive = setting.pop("drive")
    return constant_input(GNM(**setting), drive)


def recordings(results: xr.Dataset) -> list[Recording]:
    """The recordings under weak and under strong input."""
    return [
        Recording(**{name: results[name].sel(input=level).to_numpy() for name in TRACES})
        for level in LEVELS
    ]


# --- claims --------------------------------------------------------------------------------------

RESET = 0.5
LOOP = 0.1


def loop_area(V: NDArray[Any], D: NDArray[Any]) -> float:
    """Area that D encloses over V in one cycle, as a share of the box around it."""
    box = np.ptp(V) * np.ptp(D)
    return float(abs(np.sum(V * np.roll(D, -1) - D * np.roll(V, -1))) / 2 / box)


def _judge_potential(results: Results) -> Finding:
    below, above = (recording.V for recording in recordings(results["F1"]))
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
    strong = recordings(results["F1"])[1]
    cycle = last_cycle(strong)
    area = loop_area(strong.V[cycle], strong.D[cycle])
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
