"""D4 and D5: what the equations of the neuron say by themselves. Nothing is trained.

D4 asks whether the decay ever takes more from the potential than there is, D5 how near a GNM with a
step for H comes to a LIF neuron.
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from agents import GNM, LIF, AggregateLabel, NeuronAgent, Recording, record
from agents.experiments.design import Axis, Block, Experiment, Variable
from agents.experiments.figures import Picture
from agents.experiments.statistics import by_seed
from agents.experiments.verdict import Claim, Finding, Results
from agents.plotting import BLUE, INK, RED, WIDE, letter, panels
from gnm_env import Task, Trial

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

# --- the grids -----------------------------------------------------------------------------------

BINS = 500
SEEDS = {"quick": 4, "paper": 24}
WEIGHT = 0.25
"""Mean weight: with 0.5 input spikes a bin the potential crosses the threshold again and again."""

GRID = tuple(k / 10 for k in range(11))
"""Values of η, with α = 0.3 and the other defaults of the paper, and of β from 0.1 on."""

LEAK, MODEL_CHOICE = 0.3, 0.5
"""Decay per bin of the LIF, which the GNM has as (1−η)α; and that η."""


def noise(seed: int, task: Task) -> Trial:
    """BINS bins of noise."""
    raster = np.random.default_rng((seed, 1)).random((BINS, task.n_inputs)) < task.rate
    return Trial.from_dense(raster.astype(np.int8), [], [], task)


def heard(neuron: Any, seed: int) -> Recording:
    """What `neuron` does on the noise of `seed`; weights are uniform up to twice WEIGHT."""
    task = Task()
    agent = NeuronAgent(neuron, AggregateLabel(), task.n_inputs, weight_bounds=None)
    agent.weights = np.random.default_rng((seed, 2)).random(task.n_inputs) * 2.0 * WEIGHT
    return record(agent, noise(seed, task))


def _noises(size: str, seeds: tuple[int, ...] | None) -> Axis:
    values = tuple(seeds or range(SEEDS[size]))
    return Axis("pattern_seed", values, chunk=0, long_name="seed of noise")


def balance(size: str, seeds: tuple[int, ...] | None = None) -> Experiment:
    """How much more than there is the decay takes, over η and β, and how large ηγR becomes."""
    axes = (
        Axis("eta", GRID, long_name="η, model choice"),
        Axis("beta", GRID[1:], chunk=0, units="1/bin", long_name="β, recovery per bin"),
        _noises(size, seeds),
    )
    variables = (
        Variable("overdraft", "float64", "1", "most that D(t) exceeds V(t−1) >= 0 by", ()),
        Variable("share", "float64", "1", "largest ηγR(t) + (1−η)α", ()),
    )
    return Experiment(
        "BALANCE", "Decay and potential", axes, {"alpha": 0.3}, _balance, variables, {}
    )


def _balance(block: Block) -> dict[str, NDArray[Any]]:
    overdraft, share = [], []
    for setting in block.settings:
        neuron = GNM(alpha=setting["alpha"], eta=setting["eta"], beta=setting["beta"])
        run = heard(neuron, setting["pattern_seed"])
        before, taken = run.V[:-1], run.D[1:]
        overdraft.append(np.max(np.where(before >= 0.0, taken - before, -np.inf)))
        leak = (1.0 - neuron.eta) * neuron.alpha
        share.append(neuron.eta * neuron.gamma * run.R.max() + leak)
    return block.shaped(overdraft=overdraft, share=share)


STEP = GNM(
    alpha=LEAK / (1.0 - MODEL_CHOICE), eta=MODEL_CHOICE, beta=1.0, gamma=1.0 / MODEL_CHOICE,
    h=np.inf,
)  # fmt: skip
TRACES = {"lif": LIF(alpha=LEAK, refractory=0), "gnm": STEP}


def as_lif(size: str, seeds: tuple[int, ...] | None = None) -> Experiment:
    """The potentials of a LIF and of a GNM with h = ∞, ζ = 1, γ = 1/η on the same noise."""
    axes = (_noises(size, seeds),)
    variables = tuple(
        Variable(
            name, "float64", "1", f"potential of the {name.upper()}, before any reset", ("bin",)
        )
        for name in TRACES
    )
    title = "A LIF and a GNM that should be one"
    return Experiment("AS-LIF", title, axes, {}, _as_lif, variables, {"bin": BINS})


def _as_lif(block: Block) -> dict[str, NDArray[Any]]:
    return {
        name: np.stack([heard(neuron, s["pattern_seed"]).V for s in block.settings])
        for name, neuron in TRACES.items()
    }


# --- the claims ----------------------------------------------------------------------------------

EXACT = 1e-9
LAG = 2
"""Bins by which R acts late: it hears V a bin later, and D hears R a bin later."""


def _judge_balance(results: Results) -> Finding:
    data = results["BALANCE"]
    created, share = data["overdraft"].to_numpy() > EXACT, data["share"].to_numpy()
    cells = created.any(data["overdraft"].get_axis_num("pattern_seed"))
    within = share <= 1.0
    numbers = (
        f"D takes more than there is in {cells.sum()} of {cells.size} cells of the grid",
        f"where ηγR + (1−η)α stays at most 1: {np.sum(created & within)} of {within.sum()} runs; "
        f"where it does not: {np.sum(created & ~within)} of {np.sum(~within)}",
        f"at worst it takes {float(data['overdraft'].max()):.2g} too much: V oscillates and grows",
    )
    kept = {"ηγR + (1−η)α never exceeds 1": not np.any(created & within)}
    return Finding(not created.any(), kept, numbers)


def first_crossing(V: NDArray[np.float64]) -> int:
    """The first bin at or above the threshold of 1; the number of bins if there is none."""
    above = np.flatnonzero(V >= 1.0)
    return int(above[0]) if len(above) else len(V)


def _judge_as_lif(results: Results) -> Finding:
    data = results["AS-LIF"]
    lif, gnm = (by_seed(data[name], "bin") for name in TRACES)
    before, after, late = [], [], []
    for one, other in zip(lif, gnm, strict=True):
        first = first_crossing(one)
        before.append(np.abs(one[: first + 1] - other[: first + 1]).max())
        if first + LAG < len(one):
            after.append(abs(one[first + 1] - other[first + 1]))
            late.append(other[first + LAG] < 1.0 and other[first + LAG] <= other[first + 1])
    same, reset_at_once, reset_late = max(before), max(after) < EXACT, all(late)
    numbers = (
        f"up to and with the first crossing the potentials differ by at most {same:.1g}",
        f"one bin later the LIF has been reset and the GNM has not: they differ by up to "
        f"{max(after):.2f}",
        f"two bins after the crossing the GNM is down again in {sum(late)} of {len(late)} runs",
    )
    held = {
        f"the reset may come {LAG} bins late": same < EXACT and reset_late,
        "it is asked up to the threshold only": same < EXACT and not reset_late,
    }
    return Finding(same < EXACT and reset_at_once, held, numbers)


_NOISE = f"{BINS} bins of noise, weights uniform up to {2 * WEIGHT:g}"

CLAIMS = (
    Claim(
        "D4", "Discussion",
        "The GNM conserves its membrane potential: nothing is created out of nothing",
        f"GNM with α 0.3, η 0 … 1, β 0.1 … 1, other parameters as elsewhere; {_NOISE}",
        "reproduced if in no bin the decay D(t) exceeds the potential V(t−1) >= 0 that it is taken "
        "from (by more than 1e-9): V falls below 0 by nothing that was heard; conditional on "
        "ηγR + (1−η)α <= 1 if that keeps it so",
        ("BALANCE",), "noise", _judge_balance,
    ),
    Claim(
        "D5", "Methods",
        "The LIF behaves like the GNM with h = ∞, ζ = 1, γ = 1/η up to the threshold, the reset "
        "included",
        f"LIF with α {LEAK:g} and GNM with (1−η)α = {LEAK:g}, η = {MODEL_CHOICE:g}, β = 1; "
        f"{_NOISE}",
        "reproduced if the potentials agree (to 1e-9) up to the first crossing and in the bin "
        "after it; conditional on a reset that comes two bins late if the GNM is below the "
        "threshold then, and no higher than before; and on leaving the reset out",
        ("AS-LIF",), "noise", _judge_as_lif,
    ),
)  # fmt: skip

# --- the figure ----------------------------------------------------------------------------------

SHOWN = slice(0, 14)
"""Bins from four before the first crossing."""


def draw(results: Results) -> Figure:
    """(a) where the decay takes more than there is, (b) both neurons around the first crossing."""
    figure, grid = panels(1, 2, width=WIDE, height=2.6)
    _draw_balance(grid[0, 0], results["BALANCE"])
    _draw_as_lif(grid[0, 1], results["AS-LIF"])
    return figure


def _draw_balance(axes: Any, data: xr.Dataset) -> None:
    worst = data["overdraft"].max("pattern_seed").transpose("beta", "eta")
    for eta, beta in itertools.product(worst["eta"].values, worst["beta"].values):
        created = float(worst.sel(eta=eta, beta=beta)) > EXACT
        axes.plot(eta, beta, "s" if created else "o", color=RED if created else BLUE, ms=4.5,
                  mfc=RED if created else "white")  # fmt: skip
    axes.plot([], [], "s", color=RED, ms=4.5, label="D exceeds V somewhere")
    axes.plot([], [], "o", color=BLUE, mfc="white", ms=4.5, label="never")
    axes.set(xlabel="η (model choice)", ylabel="β (1/bin)", ylim=(0, 1.3))
    axes.legend(loc="upper center", ncols=2, fontsize=6)
    letter(axes, "a   conservation")


def _draw_as_lif(axes: Any, data: xr.Dataset) -> None:
    lif, gnm = (by_seed(data[name], "bin") for name in TRACES)
    firsts = [first_crossing(one) for one in lif]
    run = next(k for k, first in enumerate(firsts) if 4 <= first < BINS - SHOWN.stop)
    start = firsts[run] - 4
    bins = np.arange(SHOWN.stop) - 4
    for V, name, colour, mark in ((lif, "LIF", INK, "o"), (gnm, "GNM", RED, "s")):
        axes.plot(bins, V[run, start : start + SHOWN.stop], mark, ls="-", ms=3, lw=1, color=colour,
                  mfc="white", label=name)  # fmt: skip
    axes.axhline(1.0, color=INK, lw=0.8, ls=":")
    axes.set(xlabel="bins from the first crossing", ylabel="membrane potential V")
    axes.legend(loc="upper right", fontsize=6)
    letter(axes, "b   a LIF as a GNM")


EXPERIMENTS = {"BALANCE": balance, "AS-LIF": as_lif}
PICTURES = {
    "D4": Picture(
        draw,
        ("BALANCE", "AS-LIF"),
        "(a) Values of η and β at which the decay D takes more from the potential than there is "
        "(red) and at which it never does. (b) A LIF and a GNM with h = ∞, ζ = 1, γ = 1/η around "
        "their first crossing of the threshold (dotted): equal up to it, then the LIF is reset at "
        "once (shown before its reset) and the GNM two bins later.",
    )
}
