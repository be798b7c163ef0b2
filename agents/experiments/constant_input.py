"""F1: a GNM under constant input, below and above threshold. Nothing is trained."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from agents import GNM, AggregateLabel, NeuronAgent, Recording, record
from agents.experiments.design import Axis, Block, Experiment, Variable
from agents.experiments.figures import Picture
from agents.experiments.response import described, draw_response
from agents.experiments.verdict import Claim, Finding, Results
from agents.plotting import BLUE, GREY, INK, RED, WIDE, letter, panels, styled
from gnm_env import Task, Trial

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# --- the grid ------------------------------------------------------------------------------------

NEURON = GNM(eta=0.8, alpha=0.3, beta=0.1)
BINS = 200
LEVELS = {"sub-threshold": 0.05, "super-threshold": 0.15}
"""Input per bin. Without a reset V settles at I / ((1−η)α): 0.83 and 2.5; the threshold is 1."""

TRACES = {
    "V": ("float64", "1", "membrane potential"),
    "D": ("float64", "1/bin", "decay"),
    "R": ("float64", "1", "recovery variable"),
    "X": ("float64", "1", "readout"),
    "spikes": ("int8", "1", "output spikes"),
}


def two_levels(size: str, seeds: tuple[int, ...] | None = None) -> Experiment:
    """V, D and R over time for both levels of input; the same at every size."""
    if seeds:
        raise ValueError("F1 has no pattern seeds: leave --seeds out")
    levels = Axis.named("input", {name: {"drive": level} for name, level in LEVELS.items()})
    variables = tuple(
        Variable(name, dtype, units, what, ("bin",))
        for name, (dtype, units, what) in TRACES.items()
    )
    title = "A neuron under constant input"
    return Experiment("F1", title, (levels,), asdict(NEURON), _watch, variables, {"bin": BINS})


def _watch(block: Block) -> dict[str, NDArray[Any]]:
    runs = []
    for setting in block.settings:
        parameters = dict(setting)
        level = parameters.pop("drive")
        runs.append(constant_input(GNM(**parameters), level))
    return {name: np.stack([getattr(run, name) for run in runs]) for name in TRACES}


def constant_input(neuron: GNM, level: float, bins: int = BINS) -> Recording:
    """What the neuron does when every bin brings the same input `level`."""
    # One channel that spikes in every bin is a constant input of its weight.
    agent = NeuronAgent(neuron, AggregateLabel(fraction=1.0), n_inputs=1)
    agent.weights = level
    trial = Trial.from_dense(np.ones((bins, 1)), [], [], Task(n_inputs=1))
    return record(agent, trial)


def both_levels() -> list[Recording]:
    """The recordings under weak and under strong input, made on the spot."""
    return [constant_input(NEURON, level) for level in LEVELS.values()]


def stored(results: xr.Dataset) -> list[Recording]:
    """The same from the store."""
    return [
        Recording(**{name: results[name].sel(input=level).to_numpy() for name in TRACES})
        for level in LEVELS
    ]


# --- the claims ----------------------------------------------------------------------------------

RESET = 0.5
LOOP = 0.1


def last_cycle(recording: Recording) -> slice:
    """The bins from the last output spike but one to the last; ValueError if there are none."""
    spikes = np.flatnonzero(recording.spikes)
    if len(spikes) < 2:
        raise ValueError(f"a cycle needs two output spikes, got {len(spikes)}: raise the input")
    return slice(int(spikes[-2]), int(spikes[-1]) + 1)


def loop_area(V: NDArray[Any], D: NDArray[Any]) -> float:
    """Area that D encloses over V in one cycle, as a share of the rectangle around it."""
    rectangle = np.ptp(V) * np.ptp(D)
    return float(abs(np.sum(V * np.roll(D, -1) - D * np.roll(V, -1))) / 2 / rectangle)


def _judge_potential(results: Results) -> Finding:
    below, above = (recording.V for recording in stored(results["F1"]))
    peak, trough = above.max(), above[above.argmax() :].min()
    calm = bool(np.all(np.diff(below) > -1e-12) and below.max() < 1.0)
    reset = bool(peak >= 1.0 and trough <= RESET * peak)
    numbers = (
        f"sub-threshold: rises to {below[-1]:.3f}",
        f"super-threshold: peak {peak:.3f}, falls to {trough:.3f} after it",
        "no uncertainty: nothing is drawn",
    )
    return Finding(calm and reset, {}, numbers)


def _judge_hysteresis(results: Results) -> Finding:
    strong = stored(results["F1"])[1]
    cycle = last_cycle(strong)
    area = loop_area(strong.V[cycle], strong.D[cycle])
    numbers = (
        f"the loop fills {area:.0%} of the box around it", "no uncertainty: nothing is drawn"
    )  # fmt: skip
    return Finding(area >= LOOP, {}, numbers)


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
        "reproduced if V rises without falling and stays below the threshold under the weak input, "
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
        "reproduced if the loop of D over V between the last two output spikes encloses at least "
        f"{LOOP:.0%} of the box around it",
        ("F1",),
        "constant input",
        _judge_hysteresis,
    ),
)

# --- the figure ----------------------------------------------------------------------------------


def draw(weak: Recording, strong: Recording) -> Figure:
    """V over time under weak and strong input, and D over V."""
    with styled():
        figure, grid = panels(1, 2, width=WIDE, height=2.5)
        _draw_potential(grid[0, 0], weak, strong)
        _draw_loop(grid[0, 1], weak, strong)
    return figure


def _draw_all(results: Results) -> Figure:
    """The model, a trained neuron's response, and the neuron under constant input."""
    figure, grid = panels(2, 2, width=WIDE, height=4.9)
    weak, strong = stored(results["F1"])
    _draw_model(grid[0, 0])
    letter(grid[0, 0], "a")
    draw_response(grid[0, 1], results["F1b"])
    letter(grid[0, 1], "b")
    _draw_potential(grid[1, 0], weak, strong)
    _draw_loop(grid[1, 1], weak, strong)
    return figure


def _draw_model(axes: Axes) -> None:
    """A schema: spike trains, weights, the neuron with its variables, its readout, output."""
    axes.set(xlim=(0, 10), ylim=(0, 6))
    axes.set_axis_off()
    trains = {"1": (5.1, (0.4, 1.3, 2.1)), "2": (3.9, (0.9, 1.1, 2.4)), "N": (1.2, (0.3, 1.7))}
    for name, (height, spikes) in trains.items():
        axes.plot((0.1, 2.7), (height, height), color=INK, lw=0.8)
        axes.vlines(spikes, height, height + 0.5, color=BLUE, lw=1.4)
        axes.annotate(
            "", (4.35, 3.0 + 0.25 * (height - 3)), (2.7, height),
            arrowprops={"arrowstyle": "-|>", "color": INK, "lw": 0.8, "mutation_scale": 8},
        )  # fmt: skip
        middle = 0.5 * (height + 3.0 + 0.25 * (height - 3))
        axes.text(3.5, middle + 0.18, f"$w_{name}$", ha="center", va="bottom")
    axes.text(1.4, 2.45, "⋮", ha="center", va="center", fontsize=12)
    axes.plot(5.6, 3.0, "o", ms=54, mfc="white", mec=INK, mew=1.2)
    axes.text(5.6, 3.55, "$V$", ha="center", va="center", fontsize=10)
    axes.text(5.6, 2.95, "$D(V, R)$", ha="center", va="center")
    axes.text(5.6, 2.35, "$R$", ha="center", va="center")
    axes.annotate(
        "", (8.3, 3.0), (6.95, 3.0),
        arrowprops={"arrowstyle": "-|>", "color": INK, "lw": 1.0, "mutation_scale": 9},
    )  # fmt: skip
    axes.text(7.75, 3.2, r"$V\geq\vartheta_R$", ha="center", va="bottom", fontsize=7)
    axes.plot((8.3, 10.0), (3.0, 3.0), color=INK, lw=0.8)
    axes.vlines((8.8, 9.5), 3.0, 3.6, color=INK, lw=1.6)
    axes.text(1.4, 0.35, "input spikes, N channels", ha="center", fontsize=7)
    axes.text(5.6, 0.35, "generalised neuron", ha="center", fontsize=7)
    axes.text(9.0, 0.35, "output spikes", ha="center", fontsize=7)


def _draw_potential(axes: Axes, weak: Recording, strong: Recording) -> None:
    last = len(strong.V) - 1
    axes.plot(strong.V, color=INK, lw=1.1, label="super-threshold input")
    axes.plot(weak.V, color=BLUE, lw=1.4, ls="--", label="sub-threshold input")
    axes.axhline(NEURON.theta_r, color=GREY, lw=0.8, ls=":")
    axes.annotate(
        "threshold", (last, NEURON.theta_r), xytext=(2, 0), textcoords="offset points",
        va="center", fontsize=6, color=GREY, annotation_clip=False,
    )  # fmt: skip
    axes.set(xlabel="time (bins)", ylabel="membrane potential V", xlim=(0, last), ylim=(-0.1, 1.45))
    axes.legend(loc="upper right", ncols=2)
    letter(axes, "c")


def _draw_loop(axes: Axes, weak: Recording, strong: Recording) -> None:
    cycle = last_cycle(strong)
    V, D = strong.V[cycle], strong.D[cycle]
    axes.plot(weak.V, weak.D, "--", color=BLUE, lw=1.4)
    axes.plot(V, D, "o-", color=INK, lw=1.0, ms=2.2)
    for k in np.unique(np.linspace(1, len(V) - 2, 9).astype(int)):
        axes.annotate(
            "", (V[k + 1], D[k + 1]), (V[k], D[k]),
            arrowprops={"arrowstyle": "-|>", "color": RED, "lw": 0.9, "mutation_scale": 9},
        )  # fmt: skip
    axes.axvline(NEURON.theta_r, color=GREY, lw=0.8, ls=":")
    axes.set(xlabel="membrane potential V", ylabel="decay D (per bin)")
    letter(axes, "d")


EXPERIMENTS = {"F1": two_levels}
PICTURES = {
    "F1": Picture(
        _draw_all,
        ("F1", "F1b"),
        "(a) The model: weighted input spikes raise the membrane potential V; the decay D takes "
        "from it, the more the more the recovery variable R has opened; V crossing the threshold "
        "from below is an output spike. (b) A trained neuron (η 0, α 0.3) hears three patterns, "
        "shaded, in noise; above, its output spikes. It owes one spike to class 0, two to class 1, "
        "three to class 2 and none to noise. (c, d) A neuron with η 0.8, α 0.3, β 0.1 under "
        "constant input. (c) Weak input (dashed) takes the membrane potential to a plateau below "
        "the threshold; strong input makes it cross the threshold, and R, which has opened, pulls "
        "it down again. (d) The decay D over V in one such cycle: at the same V the neuron decays "
        "far faster on the way down than on the way up, so it remembers that it has crossed. Under "
        "weak input (dashed) D is proportional to V.",
        lambda results: described(results["F1b"]),
    )
}
