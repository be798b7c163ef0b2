"""D1, D2, D3, D6, D7, F6c and S2: what the paper says in passing, in its discussion and supplement.

Each is a sentence of the paper that its figures do not show. Settings are the paper's, from both
kinds of initial weights where they may decide.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import spearmanr

from agents.experiments.design import Axis, Experiment
from agents.experiments.figures import Picture
from agents.experiments.heat_maps import CLASS_NAMES
from agents.experiments.methods import GNM_ALL, LIF_ALL, MST_ALL, initial_weights
from agents.experiments.residuals import AHEAD_SIGMAS, ASKED, clearly_ahead
from agents.experiments.statistics import (
    Interval,
    bootstrap,
    by_seed,
    counts_of,
    mean,
    means,
    ratio_of_means,
    score,
    share,
)
from agents.experiments.training import (
    STARTS,
    WIDE_START,
    alpha_axis,
    class_counts,
    eta_axis,
    learners,
    pattern_seeds,
    training,
)
from agents.experiments.verdict import Claim, Finding, Results
from agents.plotting import BLUE, INK, RED, WIDE, error_bars, letter, panels, silent_line
from gnm_env import Task

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

# --- the grids -----------------------------------------------------------------------------------

SEEDS = {"quick": range(4), "paper": range(24)}
COUNTS = {"quick": (1, 2, 3), "paper": (1, 2, 3, 4)}

NEURONS = {
    "GNM": GNM_ALL,
    "GNM, α = 1": {**GNM_ALL, "alpha": 1.0},
    "GNM, α = 0": {**GNM_ALL, "alpha": 0.0},
    "GNM, initial weights of the LIF": {
        **GNM_ALL, "start": "matched", "initial_weight": WIDE_START["lif"]
    },
    "MST": MST_ALL,
    "LIF 0": LIF_ALL,
    "LIF 10": {**LIF_ALL, "refractory": 10},
    "LIF 25": {**LIF_ALL, "refractory": 25},
}  # fmt: skip


def neurons(size: str, seeds: tuple[int, ...] | None = None) -> Experiment:
    """Every neuron that the discussion speaks of, with ALL, one to four classes, both starts."""
    axes = (
        class_counts(*COUNTS[size]),
        pattern_seeds(seeds or SEEDS[size]),
        initial_weights(),
        learners(NEURONS),
    )
    return training("NEURONS", "What the discussion says of the neurons", axes)


MOMENTUM = {
    "momentum 0.2": {"momentum": 0.2},
    "none": {"momentum": 0.0},
    "none, λ × 1.25": {"momentum": 0.0, "learning_rate": 1.25e-4},
}
MOMENTUM_SEEDS = {"quick": range(4), "paper": range(48)}
LENGTHS = (1_000, 3_000, 10_000)
"""Trials of trainings that end while neurons still learn."""


def momentum(size: str, seeds: tuple[int, ...] | None = None) -> Experiment:
    """The GNM with and without momentum after short trainings."""
    axes = (
        class_counts(1, 2),
        pattern_seeds(seeds or MOMENTUM_SEEDS[size]),
        Axis("trials", LENGTHS, long_name="trials of training"),
        learners({name: {**GNM_ALL, **setting} for name, setting in MOMENTUM.items()}),
    )
    return training("MOMENTUM", "Speed of learning with and without momentum", axes)


ALPHAS = {"quick": (0.05, 0.1, 0.2, 0.3, 0.6, 1.0), "paper": (0.05, 0.1, 0.15, 0.2, 0.3, 0.5, 1.0)}
TIMES = {"discrete": GNM_ALL, "continuous": {"neuron": "continuous", "rule": "all"}}


def both_times(size: str, seeds: tuple[int, ...] | None = None) -> Experiment:
    """The GNM at η = 0 in discrete and in continuous time, over α."""
    axes = (
        class_counts(1, 2),
        pattern_seeds(seeds or SEEDS[size][:16]),
        alpha_axis(ALPHAS[size]),
        learners(TIMES),
    )
    return training("TIMES", "Discrete and continuous time over α", axes)


ETA = (0.0, 0.2, 0.4, 0.6)
READOUTS: dict[str, dict[str, Any]] = {"V": {}, "D": {"weight_bounds": None}}


def spikiness(size: str, seeds: tuple[int, ...] | None = None) -> Experiment:
    """A coarse map over α and η for every number of classes and both readouts."""
    readouts = {name: {"readout": name, **further} for name, further in READOUTS.items()}
    axes = (
        class_counts(*COUNTS[size]),
        pattern_seeds(seeds or SEEDS[size][:16]),
        Axis.named("readout", readouts, long_name="variable beside the threshold"),
        eta_axis(ETA),
        alpha_axis(ALPHAS[size]),
    )
    return training("SPIKINESS", "Whether η > 0 pays, by classes and readout", axes, **GNM_ALL)


# --- the claims ----------------------------------------------------------------------------------

SILENT = Task().silent_score
LEARNED = 1.25
"""Learning remains if the score is surely above so many times that of silence."""

SHAPE = 0.7
"""Rank correlation over α between discrete and continuous time."""


def _scores(results: xr.Dataset, classes: int, start: str, learner: str) -> NDArray[Any]:
    return by_seed(score(results).sel(classes=classes, start=start, learner=learner))


def _ratio(data: xr.Dataset, classes: int, start: str, above: str, below: str) -> Interval:
    pair = (_scores(data, classes, start, learner) for learner in (above, below))
    return ratio_of_means(*pair, least=1.0)


def _there(classes: int) -> str:
    return "there is one class" if classes == 1 else f"there are {classes} classes"


def _judge_alpha(results: Results) -> Finding:
    data, held, numbers = results["NEURONS"], {}, []
    for start in STARTS:
        one = mean(_scores(data, 1, start, "GNM, α = 1"))
        none = mean(_scores(data, 1, start, "GNM, α = 0"))
        held[f"the initial weights are the {start} ones"] = one.above(
            LEARNED * SILENT
        ) and none.below(LEARNED * SILENT)
        numbers.append(f"{start}: α = 1 {one:,.0f} bins, α = 0 {none:,.0f}; silence {SILENT:,.0f}")
    return Finding.of(held, numbers)


def _judge_time(results: Results) -> Finding:
    scores = score(results["TIMES"])
    held, numbers = {}, []
    for classes in counts_of(results["TIMES"]):
        pair = [by_seed(scores.sel(classes=classes, learner=name), "alpha") for name in TIMES]
        shape = bootstrap(lambda a, b: spearmanr(a.mean(0), b.mean(0)).statistic, *pair)
        tops = [scores["alpha"].values[one.mean(0).argmax()] for one in pair]
        bins = [one.mean(0).max() for one in pair]
        held[_there(classes)] = shape.value >= SHAPE
        numbers.append(
            f"{CLASS_NAMES[classes]}: rank correlation {shape:.2f}; best α {tops[0]:g} and "
            f"{tops[1]:g}, there {bins[0]:,.0f} and {bins[1]:,.0f} bins"
        )
    return Finding.of(held, numbers)


def _judge_momentum(results: Results) -> Finding:
    errors = results["MOMENTUM"]["error_rate"]
    gains: dict[str, list[Interval]] = {"none": [], "none, λ × 1.25": []}
    numbers = []
    for classes in counts_of(results["MOMENTUM"]):
        for name, found in gains.items():
            with_it, without = (
                by_seed(errors.sel(classes=classes, learner=learner), "trials").mean(1)
                for learner in ("momentum 0.2", name)
            )
            found.append(mean(100.0 * (without - with_it)))
            numbers.append(
                f"{CLASS_NAMES[classes]}, against {name}: {found[-1]:+.2f} percentage points of "
                "trials"
            )
    held = {
        "compared at the same λ": all(gain.above(0.0) for gain in gains["none"]),
        "compared at the same effective λ": all(g.above(0.0) for g in gains["none, λ × 1.25"]),
    }
    return Finding.of(held, numbers)


def _judge_spikiness(results: Results) -> Finding:
    scores = score(results["SPIKINESS"])
    held, numbers = {}, []
    for readout in READOUTS:
        fine = []
        for classes in counts_of(results["SPIKINESS"]):
            one = scores.sel(classes=classes, readout=readout)
            gain = _gain_on_other_seeds(by_seed(one, "eta", "alpha"))
            fine.append(not gain.above(0.0))
            numbers.append(f"readout {readout}, {CLASS_NAMES[classes]}: {gain:+,.0f} bins")
        held[f"the readout is {readout}"] = all(fine)
    return Finding.of(held, numbers)


def _gain_on_other_seeds(table: NDArray[Any]) -> Interval:
    """What the best cell with η > 0 gains over the best one with η = 0.

    Cells are chosen on every other pattern seed and compared on the rest: the best of many looks
    better than it is on the seeds that chose it. `table` is (seeds, η, α), η = 0 first.
    """
    chosen, rest = table[::2].mean(0), table[1::2]
    plain = int(chosen[0].argmax())
    eta, alpha = np.unravel_index(chosen[1:].argmax(), chosen[1:].shape)
    return mean(rest[:, 1 + eta, alpha] - rest[:, 0, plain])


def _judge_supplement(results: Results) -> Finding:
    held, numbers = {}, []
    for classes in counts_of(results["SPIKINESS"]):
        if classes == 3:
            continue  # figure 5b itself
        data = results["SPIKINESS"].sel(classes=classes, readout="V")
        found = by_seed(clearly_ahead(data))
        ahead = share(found)
        held[_there(classes)] = ahead.below(ASKED)
        numbers.append(f"{CLASS_NAMES[classes]}: {found.sum()} of {len(found)} runs, {ahead:.0%}")
    return Finding.of(held, numbers)


def _judge_lif_worse(results: Results) -> Finding:
    data, held, numbers = results["NEURONS"], {}, []
    for start in STARTS:
        for refractory in (0, 10, 25):
            worse, words = [], []
            for other in ("MST", "GNM"):
                ratios = [
                    _ratio(data, c, start, f"LIF {refractory}", other)
                    for c in counts_of(data)
                    if c > 1
                ]
                worse += [ratio.below(1.0) for ratio in ratios]
                words.append(f"LIF / {other} " + ", ".join(f"{ratio:.2f}" for ratio in ratios))
            numbers.append(f"{start}, refractory {refractory}, two classes on: {'; '.join(words)}")
            held[f"the start is {start} and the refractory period {refractory}"] = all(worse)
    return Finding.of(held, numbers)


def _judge_reasons(results: Results) -> Finding:
    data = results["NEURONS"]
    held: dict[str, bool] = {}
    numbers = []
    for start, free in (("matched", "GNM"), ("wide", "GNM, initial weights of the LIF")):
        resets, waits = [], []
        for classes in counts_of(data):
            if classes == 1:
                continue
            reset = _ratio(data, classes, start, "LIF 0", free)
            wait = _ratio(data, classes, start, "LIF 25", "LIF 0")
            resets.append(reset.below(1.0))
            waits.append(wait.below(1.0))
            numbers.append(
                f"{start}, {CLASS_NAMES[classes]}: the reset × {reset:.2f}, 25 refractory bins × "
                f"{wait:.2f}"
            )
        held[f"it is both, from {start} initial weights"] = all(resets) and all(waits)
        held[f"it is the refractory period alone, from {start} initial weights"] = all(
            waits
        ) and not all(resets)
    return Finding(
        all(value for name, value in held.items() if name.startswith("it is both")),
        held,
        tuple(numbers),
    )


_BOTH = "ALL, 60,000 trials; matched and wide initial weights; "
_STREAM = "gnm/PatternStream-v0, "

CLAIMS = (
    Claim(
        "D1", "Discussion", "With α = 1 some learning remains, with α = 0 none",
        "GNM, η = 0, one class, " + _BOTH + "noisy performance",
        f"reproduced if the mean score at α = 1 has an interval above {LEARNED:g} times that of "
        "silence and the one at α = 0 an interval below it, from both starts; conditional on the "
        "start",
        ("NEURONS",), _STREAM + "1 class", _judge_alpha,
    ),
    Claim(
        "D2", "Results, chemistry",
        "Training in continuous time gives qualitatively the same result as in discrete time",
        "GNM, η = 0, ALL, 60,000 trials, matched initial weights; the same values of α in both",
        f"reproduced if the mean scores over α have a rank correlation of at least {SHAPE:g} at "
        "one and at two classes; conditional on the number of classes",
        ("TIMES",), _STREAM + "1 and 2 classes", _judge_time,
    ),
    Claim(
        "D3", "Momentum", "The momentum heuristic improves the speed of learning",
        "GNM, η = 0, ALL, matched initial weights; wrong trials in the last 5,000 of trainings of "
        + ", ".join(f"{n:,}" for n in LENGTHS) + " trials, averaged; momentum 0.2 against none, "
        "and against none with λ × 1.25, which a momentum of 0.2 amounts to",
        "reproduced if fewer trials are wrong with momentum (paired difference, interval above 0) "
        "at one and two classes, against both; conditional on what it is compared with",
        ("MOMENTUM",), "gnm/PatternTrial-v0, 1 and 2 classes", _judge_momentum,
    ),
    Claim(
        "D6", "Discussion", "There is no benefit in spiking: η = 0 suffices, over all classes and "
        "both readouts",
        "GNM, ALL, 60,000 trials, matched initial weights, readout D without bounds; coarse map "
        "over α and η = 0, 0.2, 0.4, 0.6; the best cell with η > 0 and the best one with η = 0 are "
        "chosen on every other pattern seed and compared on the rest",
        "reproduced if η > 0 is surely ahead (interval above 0) for no number of classes and no "
        "readout; conditional on the readout",
        ("SPIKINESS",), _STREAM + "1 to 4 classes", _judge_spikiness,
    ),
    Claim(
        "D7", "Discussion",
        "Hard reset and refractory period are why the LIF is worse",
        "LIF, " + _BOTH + "beside a GNM with η = 0, which is the same neuron without reset, from "
        "the same initial weights; two and more classes",
        "reproduced if the ratio of scores LIF without refractory period / GNM has an interval "
        "below 1 (the reset costs) and that of 25 refractory bins / none too (they cost), for each "
        "number of classes, from both starts; conditional on the start, and on the refractory "
        "period alone",
        ("NEURONS",), _STREAM + "2 to 4 classes", _judge_reasons,
    ),
    Claim(
        "F6c", "Fig. 6, text",
        "With more than one pattern the LIF is worse than both the MST and the GNM",
        "LIF with 0, 10 and 25 refractory bins, MST, GNM; " + _BOTH + "two and more classes",
        "reproduced if the ratios of scores LIF / MST and LIF / GNM have intervals below 1 for "
        "each number of classes, from both starts, with each refractory period; conditional on "
        "start and refractory period",
        ("NEURONS",), _STREAM + "2 to 4 classes", _judge_lif_worse,
    ),
    Claim(
        "S2", "Supplement", "Residuals for 1, 2 and 4 classes: η > 0 is seldom ahead",
        "the data of D6, readout V",
        f"reproduced if the share of runs in which any η > 0 is ahead by more than "
        f"{AHEAD_SIGMAS:g} standard errors has an exact 95 % interval below 2 of 5, for each "
        "number of classes; conditional on it",
        ("SPIKINESS",), _STREAM + "1, 2 and 4 classes", _judge_supplement,
    ),
)  # fmt: skip

# --- the figure ----------------------------------------------------------------------------------


def _draw(results: Results) -> Figure:
    """(a) discrete and continuous time over α, (b) what momentum saves, (c) reset and waiting."""
    figure, grid = panels(1, 3, width=WIDE, height=2.6)
    _draw_times(grid[0, 0], results["TIMES"])
    _draw_momentum(grid[0, 1], results["MOMENTUM"])
    _draw_reasons(grid[0, 2], results["NEURONS"])
    return figure


def _draw_times(axes: Any, data: xr.Dataset) -> None:
    scores = score(data).sel(classes=2)
    for name, colour, mark in (("discrete", BLUE, "o"), ("continuous", RED, "s")):
        error_bars(
            axes, scores["alpha"].values, means(by_seed(scores.sel(learner=name), "alpha")),
            fmt=mark, ls="-", ms=3, lw=1, color=colour, mfc="white", label=f"{name} time",
        )  # fmt: skip
    silent_line(axes, SILENT)
    axes.set(xscale="log", xlabel="α (1/bin)", ylabel="bins survived", ylim=(0, None))
    axes.set_xticks((0.05, 0.1, 0.3, 1.0), ("0.05", "0.1", "0.3", "1"))
    axes.minorticks_off()
    axes.legend(loc="upper left", fontsize=6)
    letter(axes, "a   two classes")


def _draw_momentum(axes: Any, data: xr.Dataset) -> None:
    errors = 100.0 * data["error_rate"].sel(classes=2)
    for name, colour, mark in zip(MOMENTUM, (BLUE, INK, RED), "osD", strict=True):
        rows = by_seed(errors.sel(learner=name), "trials")
        axes.plot(LENGTHS, rows.mean(0), mark, ls="-", ms=3, lw=1, color=colour, mfc="white",
                  label=name)  # fmt: skip
    axes.set(xscale="log", xlabel="trials of training", ylabel="wrong trials (%)")
    axes.set_xticks(LENGTHS, [f"{n:,}" for n in LENGTHS])
    axes.minorticks_off()
    axes.legend(loc="lower left", fontsize=6)
    letter(axes, "b   two classes")


def _draw_reasons(axes: Any, data: xr.Dataset) -> None:
    counts = [count for count in counts_of(data) if count > 1]
    rows = (("matched", "GNM", -0.15, BLUE, "o"),
            ("wide", "GNM, initial weights of the LIF", 0.15, RED, "s"))  # fmt: skip
    for start, free, shift, colour, mark in rows:
        for refractory, fill in ((0, "white"), (25, colour)):
            found = [_ratio(data, c, start, f"LIF {refractory}", free) for c in counts]
            error_bars(
                axes, np.array(counts) + shift, found, fmt=mark, ms=3.5, lw=1, color=colour,
                mfc=fill, label=f"{start}, {'reset' if refractory == 0 else '+ 25 bins'}",
            )  # fmt: skip
    axes.axhline(1.0, color=INK, lw=0.8, ls="--")
    axes.set(
        yscale="log", xlabel="classes", ylabel="LIF / no reset", xticks=counts, ylim=(0.006, 5.0)
    )  # room for the legend
    axes.legend(loc="lower left", fontsize=6)
    letter(axes, "c")


def _draw_spikiness(results: Results) -> Figure:
    """What the best η > 0 gains over the best η = 0, by classes and readout."""
    figure, grid = panels(1, 2, width=WIDE, height=2.4, sharey=True)
    data = results["SPIKINESS"]
    counts = counts_of(data)
    for axes, readout, name in zip(grid[0], READOUTS, "ab", strict=True):
        for classes in counts:
            one = score(data).sel(classes=classes, readout=readout)
            gain = _gain_on_other_seeds(by_seed(one, "eta", "alpha"))
            colour = RED if gain.above(0.0) else INK
            error_bars(axes, classes, gain, fmt="o", ms=4, lw=1.2, color=colour, mfc="white")
        axes.axhline(0.0, color=INK, lw=0.8, ls="--")
        axes.set(xlabel="classes", xticks=counts)
        letter(axes, f"{name}   readout {readout}")
    grid[0, 0].set_ylabel("gain of η > 0 (bins)")
    return figure


EXPERIMENTS = {
    "NEURONS": neurons,
    "MOMENTUM": momentum,
    "TIMES": both_times,
    "SPIKINESS": spikiness,
}
PICTURES = {
    "D": Picture(
        _draw,
        ("NEURONS", "MOMENTUM", "TIMES"),
        "(a) Noisy performance over α in discrete and in continuous time, two classes, η = 0. (b) "
        "Wrong trials at the end of short trainings, with momentum, without, and without at 1.25 "
        "times the learning rate. (c) Scores of the LIF over those of the same neuron without a "
        "reset, from the same initial weights: with the reset alone (open), and with 25 refractory "
        "bins as well (filled). Means with 95 % intervals over pattern seeds.",
    ),
    "D6": Picture(
        _draw_spikiness,
        ("SPIKINESS",),
        "What the best cell with η > 0 gains over the best one with η = 0, by number of classes "
        "and readout; cells are chosen on every other pattern seed and compared on the rest. Means "
        "of the paired differences with 95 % intervals; red where the gain is sure.",
    ),
}
