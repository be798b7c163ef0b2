"""F7 and BP: neurons and learning rules side by side on two classes, on the same streams."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from agents.experiments.design import Axis, Experiment
from agents.experiments.figures import Picture
from agents.experiments.statistics import by_seed, mean, median, score, wins
from agents.experiments.training import STARTS, class_counts, learners, pattern_seeds, training
from agents.experiments.verdict import (
    Claim,
    Finding,
    Forest,
    Mark,
    Results,
    Tried,
    from_both_starts,
)
from agents.plotting import (
    BINS,
    BLUE,
    INK,
    METHOD_COLOURS,
    METHOD_MARKS,
    RED,
    WIDE,
    error_bars,
    letter,
    panels,
    silent_line,
)
from gnm_env import Task

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# --- the grid ------------------------------------------------------------------------------------

GNM_ALL: dict[str, Any] = {"neuron": "gnm", "rule": "all"}
GNM_ET = {"neuron": "gnm", "rule": "et"}
GNM_ET_MODULATED = {**GNM_ET, "modulate": True}
MST_ALL = {"neuron": "mst", "rule": "all"}
LIF_ALL = {"neuron": "lif", "rule": "all", "refractory": 0}
MODULATED = {"rule": "et", "modulate": True}

F7_LEARNERS = {
    "MST, ALL": MST_ALL,
    "GNM, ALL": GNM_ALL,
    "GNM, ET": GNM_ET,
    "GNM, ET modulated": GNM_ET_MODULATED,
}

NETWORK: dict[str, Any] = {"neuron": "network", "rule": "bp"}
USUAL_RATE, TUNED_RATE = 1e-4, 1e-3
"""λ of ET: the paper's, and the one that does best on pattern seeds 300 to 315, for either form and
from either start. Those of BP are the paper's, and its defaults."""

NETWORKS = {
    "10 hidden": {**NETWORK, "hidden": 10},
    "2 hidden": {**NETWORK, "hidden": 2},
    "1 hidden": {**NETWORK, "hidden": 1},
    "none hidden": {**NETWORK, "hidden": None},
    "10 hidden, no inhibition": {**NETWORK, "hidden": 10, "inhibition": 0.0},
    "10 hidden, usual λ": {
        **NETWORK,
        "hidden": 10,
        "learning_rate_hidden": USUAL_RATE,
        "learning_rate_output": USUAL_RATE,
    },
}
TUNED = {
    f"{name}, tuned λ, {start}": {**setting, "learning_rate": TUNED_RATE, "start": start}
    for name, setting in (("GNM, ET", GNM_ET), ("GNM, ET modulated", GNM_ET_MODULATED))
    for start in STARTS
}

SEEDS = {"F7": {"quick": 10, "paper": 50}, "BP": {"quick": 4, "paper": 50}}


def initial_weights() -> Axis:
    """The axis of both kinds of initial weights, in one block."""
    return Axis("start", STARTS, chunk=0, long_name="initial weights")


def comparison(size: str, seeds: tuple[int, ...] | None = None) -> Experiment:
    """Neurons and rules on two classes, paired by pattern seed."""
    axes = (
        class_counts(2),
        pattern_seeds(seeds or range(SEEDS["F7"][size])),
        initial_weights(),
        learners(F7_LEARNERS),
    )
    return training("F7", "Neurons and learning rules, two classes", axes)


def back_propagation(size: str, seeds: tuple[int, ...] | None = None) -> Experiment:
    """Networks, and ET at its tuned λ, on the pattern seeds and streams of F7."""
    axes = (
        class_counts(2),
        pattern_seeds(seeds or range(SEEDS["BP"][size])),
        learners({**NETWORKS, **TUNED}),
    )
    return training("BP", "Backpropagation by number of hidden neurons, two classes", axes)


# --- the claims ----------------------------------------------------------------------------------

ALPHA = 0.01
"""Level of the two-sided sign tests."""

ET_FORMS = {"GNM, ET": "plain ET", "GNM, ET modulated": "modulated ET"}
_TWO = "gnm/PatternStream-v0, 2 classes"


def paired(results: xr.Dataset, start: str, learner: str) -> NDArray[Any]:
    """Scores by pattern seed, two classes."""
    return by_seed(score(results).sel(classes=2, start=start, learner=learner))


def _judge_mst(results: Results) -> Finding:
    def judge(start: str) -> Tried:
        found = wins(*(paired(results["F7"], start, m) for m in ("MST, ALL", "GNM, ALL")))
        held = found.share <= 0.16 and found.p < ALPHA
        return Tried(held, f"{start}: MST ahead of GNM in {found}", value=found.interval)

    return from_both_starts(judge, forest=Forest("share of seeds", 0.0, 0.16, (), 3 / 50))


def _judge_error_trace(results: Results) -> Finding:
    held, words, marks = {}, [], []
    for learner, name in ET_FORMS.items():
        for start in STARTS:
            found = wins(*(paired(results["F7"], start, m) for m in (learner, "GNM, ALL")))
            held[name, start] = found.share >= 0.8 and found.p < ALPHA
            words.append(f"{start}: {name} ahead of ALL in {found}")
            marks.append(Mark(f"{start}, {name}", found.interval, held[name, start]))
    conditions = {
        f"it is {name} from {start} initial weights": h for (name, start), h in held.items()
    }
    return Finding(
        all(held["plain ET", start] for start in STARTS),
        conditions,
        tuple(words),
        forest=Forest("share of seeds", 0.8, 1.0, tuple(marks), 46 / 50),
    )


def _judge_back_propagation(results: Results) -> Finding:
    shared = np.intersect1d(results["F7"]["pattern_seed"], results["BP"]["pattern_seed"])
    if not shared.size:
        return Finding(False, {}, ("no data: F7 and BP have no pattern seed in common",), False)
    others = results["F7"].sel(pattern_seed=shared)
    ours = score(results["BP"]).sel(classes=2, pattern_seed=shared)
    networks = {name: by_seed(ours.sel(learner=name)) for name in NETWORKS}
    held, words = {}, []
    for rates, name in (("equal λ", "10 hidden, usual λ"), ("tuned λ", "10 hidden")):
        bp = networks[name]
        words.append(f"{rates}: BP {mean(bp):,.0f} bins")
        for learner, form in ET_FORMS.items():
            for start in STARTS:
                et = (
                    paired(others, start, learner)
                    if rates == "equal λ"
                    else by_seed(ours.sel(learner=f"{learner}, tuned λ, {start}"))
                )
                gain = mean(bp - et)
                held[f"at {rates} it is {form} from {start} initial weights"] = not gain.above(0)
                words.append(f"{start} {form}: BP − ET {gain:+,.0f}, BP ahead in {wins(bp, et)}")
    smaller = ("none hidden", "1 hidden", "2 hidden", "10 hidden, no inhibition")
    words.append(
        "what the hidden layer is worth: "
        + "; ".join(f"{name} {mean(networks[name]):,.0f} bins" for name in smaller)
    )
    return Finding.of(held, words)


_PROTOCOL = (
    "η 0, α 0.3, τ_m 20, τ_s 5, 60,000 trials, every method on the same streams; matched and "
    "wide initial weights"
)

CLAIMS = (
    Claim(
        "F7a",
        "Fig. 7",
        "Two classes, ALL: the MST beats the GNM in 3 runs of 50",
        _PROTOCOL,
        "reproduced if the MST is ahead in at most 16 % of the paired seeds (8 of 50) with "
        f"two-sided sign test p < {ALPHA:g}, from both starts; conditional on the start",
        ("F7",),
        _TWO,
        _judge_mst,
    ),
    Claim(
        "F7b",
        "Fig. 7",
        "Two classes, GNM: ET beats ALL in 46 runs of 50",
        _PROTOCOL,
        "reproduced if plain ET is ahead in at least 80 % of the paired seeds (40 of 50) with "
        f"two-sided sign test p < {ALPHA:g}, from both starts; conditional on start and form of ET",
        ("F7",),
        _TWO,
        _judge_error_trace,
    ),
    Claim(
        "F7c",
        "Fig. 7",
        "Two classes: BP with 10 hidden neurons brings no benefit over ET",
        _PROTOCOL + "; BP from its own initial weights, with 10, 2, 1 or no hidden neurons, and 10 "
        f"without inhibition; at equal λ ({USUAL_RATE:g}, the paper's) and at each side's own (ET "
        f"{TUNED_RATE:g}, the best on pattern seeds 300 to 315, BP its defaults)",
        "reproduced if the interval of the mean paired difference BP (10 hidden) − ET does not lie "
        "above 0 (bootstrap over seeds), for plain and modulated ET from both starts, at equal λ "
        "and at each side's tuned λ; conditional on λ, form and start",
        ("F7", "BP"),
        _TWO,
        _judge_back_propagation,
    ),
)

# --- the figure ----------------------------------------------------------------------------------


def _draw(results: Results) -> Figure:
    """Scores of all methods on two classes, seed by seed, and the paired ratios."""
    figure, grid = panels(2, 2, width=WIDE, height=5.4)
    for column, start in enumerate(STARTS):
        values = _by_method(results, start)
        _points(grid[0, column], values)
        _ratios(grid[1, column], values)
        letter(grid[0, column], f"{'ab'[column]}   {start} initial weights")
        letter(grid[1, column], "cd"[column])
    grid[0, 0].set_ylabel(BINS)
    grid[1, 0].set_ylabel("paired ratio of scores")
    for row in grid:
        # From the wide start most scores would lie in a line at the bottom of a linear axis.
        for axes in row:
            axes.set_yscale("log")
            axes.yaxis.set_major_formatter("{x:,g}")
        low, high = min(a.get_ylim()[0] for a in row), max(a.get_ylim()[1] for a in row)
        for axes in row:
            axes.set_ylim(low, high)
    for axes in grid[1]:
        axes.set_ylim(top=axes.get_ylim()[1] * 2)  # room for the counts
    return figure


def _by_method(results: Results, start: str) -> dict[str, tuple[NDArray[Any], NDArray[Any]]]:
    """Seeds and scores of each method."""
    data = results["F7"]
    seeds = data["pattern_seed"].to_numpy()
    values = {name: (seeds, paired(data, start, name)) for name in F7_LEARNERS}
    if "BP" in results:
        network = results["BP"].sel(classes=2, learner="10 hidden")
        values["BP"] = network["pattern_seed"].to_numpy(), by_seed(score(network))
    return values


def _points(axes: Axes, values: dict[str, tuple[NDArray[Any], NDArray[Any]]]) -> None:
    """One point per seed; mean with its interval, and the median as a bar."""
    jitter = np.random.default_rng(0)
    styles = zip(
        values.items(), itertools.cycle(METHOD_COLOURS), itertools.cycle(METHOD_MARKS), strict=False
    )
    for place, ((_, (_, scores)), colour, mark) in enumerate(styles):
        x = place + jitter.uniform(-0.22, 0.22, len(scores))
        axes.plot(x, scores, mark, ms=2.8, color=colour, alpha=0.55, mew=0)
        centre = mean(scores)
        axes.hlines(median(scores).value, place - 0.3, place + 0.3, color=INK, lw=1.6)
        error_bars(axes, place + 0.36, centre, fmt="D", ms=4, color=INK, mfc="white", lw=1.2)
    axes.set_xticks(
        range(len(values)), [name.replace(", ", "\n").replace("ulated", ".") for name in values]
    )
    axes.set_xlim(-0.6, len(values) - 0.4)
    silent_line(axes, Task().silent_score)


def _ratios(axes: Axes, values: dict[str, tuple[NDArray[Any], NDArray[Any]]]) -> None:
    """Ratios of two methods on the same seed, geometric mean with interval, count of wins."""
    pairs = [
        ("MST, ALL", "GNM, ALL"),
        ("GNM, ET", "GNM, ALL"),
        ("GNM, ET modulated", "GNM, ALL"),
        ("BP", "GNM, ET"),
        ("BP", "GNM, ET modulated"),
    ]
    shown = [pair for pair in pairs if pair[0] in values]
    jitter = np.random.default_rng(0)
    for place, (first, second) in enumerate(shown):
        a, b = _common(values[first], values[second])
        if not len(a):  # BP may have seeds of its own
            continue
        ratio, found = np.maximum(a, 1.0) / np.maximum(b, 1.0), wins(a, b)
        x = place + jitter.uniform(-0.2, 0.2, len(ratio))
        ahead = ratio > 1
        axes.plot(x[ahead], ratio[ahead], "^", ms=3, color=BLUE, alpha=0.6, mew=0)
        axes.plot(x[~ahead], ratio[~ahead], "v", ms=3, color=RED, alpha=0.6, mew=0)
        centre = np.exp(mean(np.log(ratio)))
        error_bars(axes, place + 0.33, centre, fmt="D", ms=4, color=INK, mfc="white", lw=1.2)
        axes.annotate(
            f"{found.wins}/{found.pairs}", (place, 0.99), xycoords=("data", "axes fraction"),
            ha="center", va="top", fontsize=7,
        )  # fmt: skip
    axes.axhline(1, color=INK, lw=0.9, ls="--", zorder=1)
    labels = [f"{_short(a)}\n/ {_short(b)}" for a, b in shown]
    axes.set_xticks(range(len(shown)), labels, fontsize=6)
    axes.set_xlim(-0.6, len(shown) - 0.4)


def _short(name: str) -> str:
    return {"MST, ALL": "MST", "GNM, ALL": "ALL", "GNM, ET": "ET",
            "GNM, ET modulated": "ET mod."}.get(name, name)  # fmt: skip


def _common(
    first: tuple[NDArray[Any], NDArray[Any]], second: tuple[NDArray[Any], NDArray[Any]]
) -> tuple[NDArray[Any], NDArray[Any]]:
    """The scores of both on the seeds that both have."""
    _, a, b = np.intersect1d(first[0], second[0], return_indices=True)
    return first[1][a], second[1][b]


def _draw_networks(results: Results) -> Figure:
    """Scores of networks by number of hidden neurons, beside ET at its tuned λ."""
    scores = score(results["BP"]).sel(classes=2)
    seeds = scores["pattern_seed"].to_numpy()
    names = {
        "GNM, ET modulated, tuned λ, matched": "ET mod.\nλ tuned",
        "none hidden": "BP\nnone hidden",
        "1 hidden": "BP\n1 hidden",
        "2 hidden": "BP\n2 hidden",
        "10 hidden": "BP\n10 hidden",
        "10 hidden, no inhibition": "10 hidden\nno inhibition",
        "10 hidden, usual λ": f"10 hidden\nλ {USUAL_RATE:g}",
    }
    figure, grid = panels(1, 1, width=WIDE, height=3.0)
    values = {words: (seeds, by_seed(scores.sel(learner=name))) for name, words in names.items()}
    _points(grid[0, 0], values)
    grid[0, 0].set_ylabel(BINS)
    return figure


EXPERIMENTS = {"F7": comparison, "BP": back_propagation}
PICTURES = {
    "F7": Picture(
        _draw,
        ("F7",),
        "Two classes, logarithmic axes. (a, b) One point per pattern seed; bars are medians, "
        "diamonds means with 95 % bootstrap intervals; dotted is what silence scores. (c, d) "
        "Ratios of the scores of two methods on the same patterns and streams, diamonds their "
        "geometric means with 95 % bootstrap intervals; above, how often the first was ahead. BP "
        "has initial weights of its own, the same in both columns.",
    ),
    "F7-hidden": Picture(
        _draw_networks,
        ("BP",),
        "Two classes: networks by number of hidden neurons, beside one neuron that learns by "
        "modulated ET at the λ that suits it best. One point per pattern seed; bars are medians, "
        "diamonds means with 95 % bootstrap intervals; dotted is what silence scores.",
    ),
}
