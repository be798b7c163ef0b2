"""A GNM under constant input, below and above threshold: figures 1c and 1d of the paper."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from agents import GNM, AggregateLabel, NeuronAgent, Recording, record
from gnm_env import Task, Trial

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


def hysteresis_picture() -> Figure:
    """V(t) for both inputs, and D against V for the larger one."""
    import matplotlib.pyplot as plt

    from drawing.style import styled

    weak, strong = (constant_input(NEURON, drive) for drive in LEVELS.values())
    with styled():
        figure, (time, loop) = plt.subplots(1, 2, figsize=(8, 3.2))
        time.plot(weak.V, color="black", ls="--", label=f"I = {LEVELS['sub-threshold']}")
        time.plot(strong.V, color="black", label=f"I = {LEVELS['super-threshold']}")
        time.axhline(NEURON.theta_r, color="0.6", lw=0.8, ls=":")
        time.set(xlabel="time (bins)", ylabel="membrane potential V", ylim=(0, None))
        time.set_title("c", loc="left", fontweight="bold")
        time.set_ylim(0, 1.5)
        time.legend(frameon=False, title="input per bin", loc="upper right", ncols=2)
        loop.plot(strong.V, strong.D, ".-", color="black", lw=0.8, markersize=3)
        for k in (4, int(np.argmax(strong.V[:50])), int(np.argmax(strong.D[:50]))):
            loop.annotate(
                "", (strong.V[k : k + 2].mean(), strong.D[k : k + 2].mean()),
                (strong.V[k], strong.D[k]),
                arrowprops={"arrowstyle": "-|>", "color": "#D55E00", "lw": 1.2},
            )  # fmt: skip
        loop.set(xlabel="membrane potential V", ylabel="decay D (per bin)")
        loop.set_title("d", loc="left", fontweight="bold")
    return figure
