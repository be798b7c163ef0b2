"""A GNM under constant input, below and above threshold: figures 1c and 1d of the paper."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from agents import GNM, AggregateLabel, NeuronAgent, Recording, record
from gnm_env import Task, Trial

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

NEURON = GNM(eta=0.8, alpha=0.3, beta=0.1)
BINS = 200
LEVELS = {"sub-threshold": 0.05, "super-threshold": 0.15}
"""Input per bin. Without a reset V settles at I / ((1−η)α): 0.83 and 2.5; the threshold is 1."""


def constant_input(neuron: GNM, drive: float, bins: int = BINS) -> Recording:
    """What the neuron does when every bin brings the same input `drive`."""
    # One channel that spikes in every bin is a constant input of its weight.
    agent = NeuronAgent(neuron, AggregateLabel(fraction=1.0), n_inputs=1)
    agent.weights = drive
    trial = Trial.from_dense(np.ones((bins, 1)), [], [], Task(n_inputs=1))
    return record(agent, trial)


def last_cycle(recording: Recording) -> slice:
    """The bins from the last output spike but one to the last; ValueError if there are none."""
    spikes = np.flatnonzero(recording.spikes)
    if len(spikes) < 2:
        raise ValueError(f"a cycle needs two output spikes, got {len(spikes)}: raise the input")
    return slice(int(spikes[-2]), int(spikes[-1]) + 1)


def hysteresis_picture() -> Figure:
    """V(t) for both inputs, and D against V, drawn on the spot."""
    return draw(*(constant_input(NEURON, drive) for drive in LEVELS.values()))


def draw(weak: Recording, strong: Recording) -> Figure:
    """V over time under weak and strong input, and D over V."""
    from drawing import style

    with style.styled():
        figure, grid = style.panels(1, 2, width=style.WIDE, height=2.5)
        _draw_potential(grid[0, 0], weak, strong)
        _draw_loop(grid[0, 1], weak, strong)
    return figure


def _draw_potential(axes: Axes, weak: Recording, strong: Recording) -> None:
    from drawing import style

    last = len(strong.V) - 1
    axes.plot(strong.V, color=style.INK, lw=1.1, label="super-threshold input")
    axes.plot(weak.V, color=style.BLUE, lw=1.4, ls="--", label="sub-threshold input")
    axes.axhline(NEURON.theta_r, color=style.GREY, lw=0.8, ls=":")
    axes.annotate(
        "threshold", (last, NEURON.theta_r), xytext=(2, 0), textcoords="offset points",
        va="center", fontsize=6, color=style.GREY, annotation_clip=False,
    )  # fmt: skip
    axes.set(xlabel="time (bins)", ylabel="membrane potential V", xlim=(0, last), ylim=(-0.1, 1.45))
    axes.legend(loc="upper right", ncols=2)
    style.letter(axes, "c")


def _draw_loop(axes: Axes, weak: Recording, strong: Recording) -> None:
    from drawing import style

    cycle = last_cycle(strong)
    V, D = strong.V[cycle], strong.D[cycle]
    axes.plot(weak.V, weak.D, "--", color=style.BLUE, lw=1.4)
    axes.plot(V, D, "o-", color=style.INK, lw=1.0, ms=2.2)
    for k in np.unique(np.linspace(1, len(V) - 2, 9).astype(int)):
        axes.annotate(
            "", (V[k + 1], D[k + 1]), (V[k], D[k]),
            arrowprops={"arrowstyle": "-|>", "color": style.RED, "lw": 0.9, "mutation_scale": 9},
        )  # fmt: skip
    axes.axvline(NEURON.theta_r, color=style.GREY, lw=0.8, ls=":")
    axes.set(xlabel="membrane potential V", ylabel="decay D (per bin)")
    style.letter(axes, "d")
