"""F8: trained neurons as chemical reaction networks, molecule by molecule."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from agents import bootstrap_interval
from agents.chemistry import Course, ReactionNetwork, Reactor
from agents.chemistry.mistakes import Mistakes, count_mistakes
from agents.chemistry.reactor import POINTS_PER_BIN
from agents.continuous import InputSpikes
from agents.continuous.outputs import in_presentations, outputs_alone
from agents.experiments.continuous_time import CLASSES, first_stored, threshold_line
from agents.experiments.design import Block, Coordinate, Experiment, Variable
from agents.experiments.figures import Picture
from agents.experiments.statistics import Interval, by_seed, mean, ratio_of_means
from agents.experiments.training import (
    WEIGHTS,
    class_counts,
    evaluation_seed,
    pattern_seeds,
    protocol,
    stream_seeds,
    trained,
)
from agents.experiments.verdict import Claim, Finding, Results
from agents.plotting import BLUE, GREY, INK, NARROW, OKABE_ITO, WIDE, panels, shade, styled
from gnm_env import Patterns, Task, Trial

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# --- the grid ------------------------------------------------------------------------------------

MOLECULES = (10, 25, 50, 100, 200, 500, 1000, 2000)
"""Molecules per input spike for which wrong outputs are counted."""

TRACED = (25, 100, 500)
"""Those of the paper's figure."""

CONVERSION = 10.0
SEEDS = {"quick": 2, "paper": 8}
TRIALS = {"quick": 4, "paper": 25}
RUNS = {"quick": 4, "paper": 20}
GAP = 25
"""Bins of noise before, between and after the patterns of the trial that is traced."""

BINS = CLASSES * (GAP + Task().pattern_bins) + GAP


def volumes(size: str, seeds: tuple[int, ...] | None = None) -> Experiment:
    """Traces and wrong outputs for several numbers of molecules per input spike."""
    common = {
        "neuron": "reacting",
        "rule": "all",
        "alpha": 0.2,
        "trials": 60_000,
        "conversion": CONVERSION,
        "heard": TRIALS[size],
        "runs": RUNS[size],
    }
    lengths = {
        "molecules": len(MOLECULES),
        "traced": len(TRACED),
        "run": RUNS[size],
        "heard": TRIALS[size],
        "point": BINS * POINTS_PER_BIN + 1,
        "channel": Task().n_inputs,
        "class": CLASSES,
    }
    unit = "molecules per input spike"
    variables = (
        Variable("wrong", "int64", "1", "wrong outputs of a trial", ("molecules", "heard")),
        Variable("wrong_deterministic", "int64", "1", "the same, deterministic", ("heard",)),
        Variable("wrong_neuron", "int64", "1", "the same, continuous neuron", ("heard",)),
        Variable("deviation", "float64", unit, "rms of V about deterministic V", ("traced", "run")),
        Variable("V", "float64", unit, "V of run 0 over the traced trial", ("traced", "point")),
        Variable("V_deterministic", "float64", unit, "deterministic V", ("point",)),
        Variable("S_alone", "float64", unit, "deterministic S of each pattern alone", ("class",)),
        WEIGHTS,
    )
    axes = (class_counts(CLASSES), pattern_seeds(seeds or range(SEEDS[size])))
    described = protocol(Task(), [common]) | {"molecules": MOLECULES, "traced": TRACED, "gap": GAP}
    title = "Trained neurons as chemical reaction networks, two classes"
    coordinates = (
        *stream_seeds(axes),
        Coordinate("molecules", ("molecules",), np.array(MOLECULES), "molecules per input spike"),
        Coordinate("traced", ("traced",), np.array(TRACED), "molecules per input spike"),
    )
    return Experiment("F8", title, axes, common, _react, variables, lengths, described, coordinates)


def traced_trial(task: Task, patterns: Patterns, seed: int) -> Trial:
    """Each pattern once, with noise around it."""
    rng = np.random.default_rng(seed)
    noise = rng.random((task.n_classes + 1, GAP, task.n_inputs)) < task.rate
    parts = [part for pair in zip(noise, patterns.dense(), strict=False) for part in pair]
    onsets = GAP + (GAP + task.pattern_bins) * np.arange(task.n_classes)
    raster = np.concatenate([*parts, noise[-1]])
    return Trial.from_dense(raster, onsets, np.arange(task.n_classes), task)


def _react(block: Block) -> dict[str, NDArray[Any]]:
    (setting,) = block.settings
    task = Task(n_classes=CLASSES)
    patterns = Patterns.draw(task, setting["pattern_seed"])
    (agent,), _ = trained(block.settings, task, patterns)
    seed = evaluation_seed(setting["classes"], setting["pattern_seed"])
    mistakes = count_mistakes(agent, task, patterns, MOLECULES, setting["heard"], seed)
    spikes = InputSpikes.from_trial(traced_trial(task, patterns, seed))
    reactor = Reactor(ReactionNetwork.from_agent(agent))
    exact = reactor.deterministic(spikes).V
    runs = np.stack([reactor.stochastic(spikes, m, setting["runs"], seed).V for m in TRACED])
    return block.shaped(
        wrong=[mistakes.stochastic],
        wrong_deterministic=[mistakes.deterministic],
        wrong_neuron=[mistakes.neuron],
        deviation=[np.sqrt(np.mean((runs - exact) ** 2, axis=-1))],
        V=[runs[:, 0]],
        V_deterministic=[exact],
        S_alone=[outputs_alone(agent, patterns)],
        weights=[agent.weights],
    )


# --- the claim -----------------------------------------------------------------------------------


def right(results: xr.Dataset) -> xr.Dataset:
    """The pattern seeds whose network gives each pattern, alone, what it is owed, rounded.

    With infinitely many molecules: of a network that is wrong by itself, the noise of few molecules
    cannot be told apart from its own mistakes.
    """
    given = by_seed(results["S_alone"].squeeze("classes"), "class")
    found = np.all(np.floor(given + 0.5) == Task(n_classes=CLASSES).owed, axis=1)
    return results.isel(pattern_seed=np.flatnonzero(found))


def pooled(values: xr.DataArray, within: str, last: str) -> NDArray[Any]:
    """Values of all seeds in one row, (seeds × `within`, `last`)."""
    ordered = by_seed(values.squeeze("classes"), within, last)
    return ordered.reshape(-1, ordered.shape[-1])


def _shrinkage(results: xr.Dataset) -> list[Interval]:
    """Deviation at each number of traced molecules over that at the next larger one."""
    runs = pooled(results["deviation"].sel(traced=list(TRACED)), "run", "traced")
    return [ratio_of_means(runs[:, k], runs[:, k + 1]) for k in range(len(TRACED) - 1)]


def _judge(results: Results) -> Finding:
    data = right(results["F8"])
    n_right, n = data.sizes["pattern_seed"], results["F8"].sizes["pattern_seed"]
    trained_to = (
        f"of {n} trained neurons {n_right} give both patterns what they are owed with infinitely "
        "many molecules; the numbers are theirs"
    )
    if not n_right:
        return Finding(False, {}, (trained_to,))
    shrinks = _shrinkage(data)
    wrong = pooled(data["wrong"].sel(molecules=list(TRACED)), "heard", "molecules")
    fewer = mean(wrong[:, 0] - wrong[:, -1])
    means = wrong.mean(axis=0)
    approaches = all(found.low > 1 for found in shrinks)
    errs_more = fewer.low > 0 and bool(np.all(np.diff(means) <= 0))
    numbers = (
        trained_to,
        "deviation from the deterministic V (by theory the square root of the ratio of molecules): "
        + ", ".join(f"{m} over {n} molecules {found:.2f} (theory {np.sqrt(n / m):.2f})"
                    for m, n, found in zip(TRACED, TRACED[1:], shrinks, strict=False)),
        f"wrong outputs per trial at {', '.join(map(str, TRACED))} molecules: "
        + ", ".join(f"{value:.2f}" for value in means)
        + f"; difference between first and last {fewer:.2f}; with infinitely many "
        f"{float(data['wrong_deterministic'].mean()):.2f}",
    )  # fmt: skip
    return Finding(approaches and errs_more, {}, numbers)


CLAIMS = (
    Claim(
        "F8",
        "Fig. 8",
        "Chemical network, two classes: stochastic runs with 25, 100, 500 molecules per spike "
        "approach the deterministic solution; fewer molecules, more wrong outputs",
        "continuous GNM, η 0, α 0.2, ALL, 60,000 trials, trained with the response that it has as "
        "a reaction network (C = 10); exact stochastic simulation",
        "reproduced if, of the pattern seeds whose network is right with infinitely many "
        "molecules, the rms deviation of V from the deterministic V shrinks from 25 to 100 and "
        "from 100 to 500 molecules (ratios with intervals above 1, bootstrap over runs; they are "
        "√4 and √5 by theory, so this checks the engine) and wrong outputs per trial do not rise "
        "with the number of molecules, with an interval of the fall from 25 to 500 above 0 "
        "(bootstrap over trials)",
        ("F8",),
        "gnm/PatternTrial-v0, graded, 2 classes",
        _judge,
    ),
)

# --- the figures ---------------------------------------------------------------------------------


def _shown(results: Results) -> xr.Dataset:
    """Those that are right; if none is, all of them, since their S is printed beside them."""
    found = right(results["F8"])
    return found if found.sizes["pattern_seed"] else results["F8"]


def _draw_volumes(results: Results) -> Figure:
    data, task, patterns = first_stored(_shown(results))
    trial = traced_trial(task, patterns, int(data["evaluation_seed"]))
    stochastic = {int(m): _course(data["V"].sel(traced=m)) for m in data["traced"]}
    return draw_volumes(trial, _course(data["V_deterministic"]), stochastic)


def _course(V: xr.DataArray) -> Course:
    values = V.to_numpy()
    return Course(np.arange(len(values)) / POINTS_PER_BIN, values, theta_r=1.0)


def _draw_mistakes(results: Results) -> Figure:
    data = _shown(results)
    stochastic = pooled(data["wrong"], "heard", "molecules").T
    alone = (data[name].transpose("classes", "pattern_seed", "heard").to_numpy().ravel()
             for name in ("wrong_deterministic", "wrong_neuron"))  # fmt: skip
    return draw_mistakes(Mistakes(data["molecules"].to_numpy(), stochastic, *alone))


def draw_volumes(trial: Trial, deterministic: Course, stochastic: Mapping[int, Course]) -> Figure:
    """Stochastic traces over the deterministic one (black), all with the same input."""
    colours = ("sky", "vermillion", "green", "purple", "orange")
    rows = [("infinitely many molecules (black in every panel)", deterministic, INK)]
    rows += [
        (f"{number:,} molecules per input spike", course, OKABE_ITO[colours[k % 5]])
        for k, (number, course) in enumerate(stochastic.items())
    ]
    top = 1.15 * max(deterministic.theta_r, *(float(course.V.max()) for _, course, _ in rows))
    with styled():
        figure, grid = panels(len(rows), 1, width=WIDE, height=1.45 * len(rows), sharex=True)
        for axis, (name, course, colour) in zip(grid[:, 0], rows, strict=True):
            axis.set(xlim=(0.0, trial.n_bins), ylim=(0.0, top))
            _print_amounts(axis, trial, course)
            if course is not deterministic:
                axis.plot(course.t, np.atleast_2d(course.V)[0], color=colour, linewidth=0.9)
            axis.plot(deterministic.t, deterministic.V, color=INK, linewidth=0.7)
            threshold_line(axis, course.theta_r)
            axis.set_title(name, loc="left")
        grid[-1, 0].set_xlabel("time (bins)")
        figure.supylabel("$V$ (molecules per input spike)", fontsize=8)
    return figure


def given(trial: Trial, course: Course) -> NDArray[np.float64]:
    """S of each presentation, (K,) or (runs, K)."""
    S = course.S()
    return in_presentations(trial, S[..., :: (S.shape[-1] - 1) // trial.n_bins])


def _print_amounts(axis: Axes, trial: Trial, course: Course) -> None:
    """Shade each presentation and print the S given in it, of several runs in the first."""
    shade(axis, trial)
    amounts = np.atleast_2d(given(trial, course))[0]
    middles = (trial.onsets + trial.ends) / 2
    for middle, class_, amount in zip(middles, trial.classes, amounts, strict=True):
        axis.text(
            middle, 0.97 * axis.get_ylim()[1],
            f"class {class_}: $S$ = {amount:.2f}", ha="center", va="top", fontsize=7,
        )  # fmt: skip


def draw_mistakes(mistakes: Mistakes) -> Figure:
    """Wrong outputs per trial against molecules per input spike, with 95 % intervals."""
    average = mistakes.stochastic.mean(axis=1)
    interval = np.array([bootstrap_interval(row) for row in mistakes.stochastic])
    with styled():
        figure, grid = panels(1, 1, width=1.3 * NARROW, height=0.85 * NARROW)
        axis: Axes = grid[0, 0]
        axis.errorbar(
            mistakes.molecules, average, yerr=np.abs(interval.T - average), color=BLUE,
            marker="o", markersize=4, linewidth=1.0, capsize=2.5,
            label="molecule by molecule (mean, 95 % interval)",
        )  # fmt: skip
        # They may coincide, so that one has to be seen under the other.
        neuron, smooth = mistakes.neuron.mean(), mistakes.deterministic.mean()
        name = "the neuron itself"
        axis.axhline(neuron, color=GREY, alpha=0.6, linewidth=3.0, label=name)
        name = "infinitely many molecules"
        axis.axhline(smooth, color=INK, linestyle="--", linewidth=1.0, label=name)
        axis.set_xscale("log")
        axis.set_xticks(mistakes.molecules, [f"{number:,}" for number in mistakes.molecules])
        axis.minorticks_off()
        # A little below 0, so that lines at 0 do not hide in the frame.
        axis.set_ylim(bottom=-0.03 * max(float(interval.max()), 1.0))
        axis.set(xlabel="molecules per input spike", ylabel="wrong outputs per trial")
        axis.legend()
    return figure


EXPERIMENTS = {"F8": volumes}
PICTURES = {
    "F8": Picture(
        _draw_volumes,
        ("F8",),
        "A trained neuron (the first pattern seed on which it is right with infinitely many "
        "molecules) as a chemical reaction network: V of one stochastic run with 25, 100 and 500 "
        "molecules per input spike, over the deterministic solution (black), all with the same "
        "input. Shaded are the patterns, with the S that they are given.",
    ),
    "F8-mistakes": Picture(
        _draw_mistakes,
        ("F8",),
        "Wrong outputs per trial (patterns answered with another rounded S than owed, and "
        "stretches of noise with more than one half) against the number of molecules per input "
        "spike, with 95 % bootstrap intervals over trials, of the pattern seeds on which the "
        "network is right with infinitely many.",
    ),
}
