"""HIDDEN: is it the network, or what one neuron lacks?

Backpropagation with ten hidden neurons is far ahead of one neuron that learns by the error trace,
and one hidden neuron gives most of that. A hidden neuron brings two things: a sigmoid, and a second
leaky integrator in series. Here a linear neuron of two stages follows the same gradient, without
the sigmoid; and the same linear neurons, of one stage and of two, learn by PeakError, which knows
no more than backpropagation does.

Learning rates and decays were chosen on pattern seeds 0 to 7; what is reported is heard with seeds
100 to 123.
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from agents.experiments.design import Experiment
from agents.experiments.figures import Picture
from agents.experiments.statistics import Interval, bootstrap, by_seed, goodness, mean, score
from agents.experiments.training import class_counts, learners, pattern_seeds, training
from agents.experiments.verdict import Finding, Hypothesis, Results
from agents.plotting import (
    BINS,
    BLUE,
    GREY,
    INK,
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

HIDDEN = (0, 1, 2, 5, 10)
RATES = (1e-3, 3e-3, 1e-2)
INHIBITION = {"": 0.05, ", no inhibition": 0.0}

TWO_STAGE = {"neuron": "agents.experiments.two_stage:TwoStage"}
STAGES: dict[str, dict[str, Any]] = {
    "one stage": {"neuron": "gnm", "alpha": 0.3},
    "two stages, 0.3 and 0.31": {**TWO_STAGE, "alpha": 0.3, "alpha_2": 0.31},
    "two stages, 0.3 and 0.9": {**TWO_STAGE, "alpha": 0.3, "alpha_2": 0.9},
}
"""By their decays. The first pair is the network's, whose hidden neurons and readout both decay by
0.3 a bin (two equal ones have no response of this form); the second did best among four pairs."""

GRADIENT: dict[str, Any] = {
    "rule": "agents.experiments.two_stage:GradientOfError", "weight_bounds": None,
}  # fmt: skip
GRADIENT_RATES = (1e-4, 3e-4, 1e-3)
PEAK: dict[str, Any] = {
    "rule": "peak-error", "learning_rate": 3e-2, "decay_trials": 60_000,
    "weight_bounds": (-0.4, 0.4),
}  # fmt: skip

ONE, NETWORKS_OWN, BEST_TWO = (
    "one stage, λ 0.0003",
    "two stages, 0.3 and 0.31, λ 0.0001",
    "two stages, 0.3 and 0.9, λ 0.0001",
)
"""The linear neurons that follow the gradient, each at its best rate on pattern seeds 0 to 7."""
PEAK_ONE, PEAK_TWO = "PeakError, one stage", "PeakError, two stages"


def network(hidden: int, rate: float = 3e-3, how: str = "") -> str:
    """The name of a network among the learners; by default with the rule's own learning rate."""
    return f"BP, {hidden} hidden, λ {rate:g}{how}"


def _networks() -> dict[str, dict[str, Any]]:
    found = {}
    for hidden, rate, (how, inhibition) in itertools.product(HIDDEN, RATES, INHIBITION.items()):
        if hidden < 2 and how:  # there is nobody to inhibit
            continue
        found[network(hidden, rate, how)] = {
            "neuron": "network", "rule": "bp", "hidden": hidden or None, "inhibition": inhibition,
            "learning_rate_hidden": rate, "learning_rate_output": rate,
        }  # fmt: skip
    return found


LEARNERS: dict[str, dict[str, Any]] = {
    **_networks(),
    **{
        f"{name}, λ {rate:g}": {**neuron, **GRADIENT, "learning_rate": rate}
        for (name, neuron), rate in itertools.product(STAGES.items(), GRADIENT_RATES)
    },
    PEAK_ONE: {"neuron": "gnm", "alpha": 0.15, **PEAK},
    PEAK_TWO: {**TWO_STAGE, "alpha": 0.15, "alpha_2": 0.4, **PEAK},
}

SIZES = {"quick": range(100, 103), "paper": range(100, 124)}


def hidden_unit(size: str, seeds: tuple[int, ...] | None = None) -> Experiment:
    """Networks by hidden neurons, rate and inhibition, and linear neurons of one and two stages."""
    axes = (class_counts(2), pattern_seeds(seeds or SIZES[size]), learners(LEARNERS))
    return training("HIDDEN", "Networks beside linear neurons of one and two stages", axes)


# --- the hypotheses ------------------------------------------------------------------------------


def scores_of(data: xr.Dataset, learner: str) -> NDArray[np.float64]:
    """Scores by pattern seed, two classes."""
    return by_seed(score(data).sel(classes=2, learner=learner))


def goodness_of(data: xr.Dataset, learner: str) -> NDArray[np.float64]:
    """−log10 of the mistakes per bin by pattern seed."""
    survived = by_seed(data["survived"].sel(classes=2, learner=learner), "run")
    return goodness(survived, data.attrs["settings"]["common"]["cap"])


def share_of_gain(
    part: NDArray[np.float64], whole: NDArray[np.float64], base: NDArray[np.float64]
) -> Interval:
    """(mean part − mean base) / (mean whole − mean base), bootstrap over seeds."""
    return bootstrap(
        lambda p, w, b: float((p.mean() - b.mean()) / (w.mean() - b.mean())), part, whole, base
    )


def _judge_sigmoid(results: Results) -> Finding:
    data = results["HIDDEN"]
    base, whole = scores_of(data, ONE), scores_of(data, network(1))
    held, words = {}, [f"one stage {mean(base):,.0f} bins, one hidden neuron {mean(whole):,.0f}"]
    for learner, name in ((NETWORKS_OWN, "0.3 and 0.31"), (BEST_TWO, "0.3 and 0.9")):
        part = scores_of(data, learner)
        share = share_of_gain(part, whole, base)
        held[f"the two stages decay by {name}"] = share.below(0.5)
        words.append(f"two linear stages, {name}: {mean(part):,.0f} bins, share {share:.0%}")
    return Finding.of(held, words)


def _judge_rule(results: Results) -> Finding:
    data = results["HIDDEN"]
    peak = scores_of(data, PEAK_ONE)
    held, words = {}, [f"one neuron by PeakError {mean(peak):,.0f} bins"]
    for hidden in (1, 10):
        bp = scores_of(data, network(hidden))
        gain = mean(peak - bp)
        held[f"the network has {hidden} hidden"] = gain.above(0)
        words.append(f"BP, {hidden} hidden: {mean(bp):,.0f} bins; PeakError − BP {gain:+,.0f}")
    return Finding.of(held, words)


def _judge_second_stage(results: Results) -> Finding:
    data = results["HIDDEN"]
    gain = mean(goodness_of(data, PEAK_TWO) - goodness_of(data, PEAK_ONE))
    times = Interval(*(10**end for end in gain))
    words = (
        f"PeakError: one stage {mean(scores_of(data, PEAK_ONE)):,.0f} bins, two stages "
        f"{mean(scores_of(data, PEAK_TWO)):,.0f}",
        f"one stage errs {times:.2f} times as often (geometric mean over seeds)",
    )
    return Finding(gain.above(0), {}, words)


def _judge_number(results: Results) -> Finding:
    data = results["HIDDEN"]
    base, whole = scores_of(data, network(0)), scores_of(data, network(10))
    held, words = {}, []
    for hidden in (1, 2, 5):
        share = share_of_gain(scores_of(data, network(hidden)), whole, base)
        held[f"there are {hidden} hidden"] = share.above(0.7)
        words.append(f"{hidden} hidden: {share:.0%} of what ten bring")
    without = mean(scores_of(data, network(10, how=", no inhibition")) - whole)
    held_without = not without.below(0)
    words.append(f"ten without inhibition − with: {without:+,.0f} bins")
    return Finding(
        all(held.values()) and held_without,
        {**held, "it is the inhibition that is left out": held_without},
        tuple(words),
    )


_PROTOCOL = (
    "two classes, 60,000 trials, pattern seeds 100 to 123; BP with 0, 1, 2, 5 or 10 hidden neurons "
    "at λ 1e-3, 3e-3 (its default) and 1e-2, with and without inhibition; linear neurons of one "
    "stage (GNM, η 0, α 0.3) and two (two leaky integrators in series, no reset) that follow the "
    "gradient of the same error, unbounded; PeakError with λ 3e-2 falling to 0, weights in ±0.4, "
    "α 0.15, or 0.15 and 0.4"
)

HYPOTHESES = (
    Hypothesis(
        "U1",
        "What one hidden neuron brings is its sigmoid: two linear stages in series, which follow "
        "the same gradient, bring less than half of it",
        "pattern seeds 0 to 7: one stage 4,251 bins, two stages 3,340 (decays 0.3 and 0.31) and "
        "4,939 (0.3 and 0.9), at the best of three rates each; one hidden neuron 7,145 on seeds 0 "
        "to 49",
        _PROTOCOL,
        "holds if, for both pairs of decays, (two stages − one stage) / (one hidden − one stage) "
        "in mean bins has an interval below 50 % (bootstrap over seeds)",
        ("HIDDEN",),
        _judge_sigmoid,
    ),
    Hypothesis(
        "U2",
        "It is not the network: a single linear neuron that learns by PeakError is ahead of "
        "backpropagation with one and with ten hidden neurons",
        "PeakError above 9,000 bins and BP 8,620 with ten hidden neurons on other seeds",
        _PROTOCOL,
        "holds if the mean paired difference PeakError (one stage) − BP at its default rate has an "
        "interval above 0, for one and for ten hidden neurons",
        ("HIDDEN",),
        _judge_rule,
    ),
    Hypothesis(
        "U3",
        "A second stage does help the neuron that learns by PeakError",
        "pattern seeds 0 and 1: 9,638 bins with one stage, 9,952 with two",
        _PROTOCOL,
        "holds if the mean paired difference of log10 mistakes per bin, one stage − two stages, "
        "has an interval above 0",
        ("HIDDEN",),
        _judge_second_stage,
    ),
    Hypothesis(
        "U4",
        "One hidden neuron does most of what ten do, and inhibition does nothing",
        "seeds 0 to 49: 7,145 bins with one, 8,620 with ten, 8,834 with ten without inhibition, "
        "1,928 with none",
        _PROTOCOL,
        "holds if 1, 2 and 5 hidden neurons each bring more than 70 % of what ten bring over none "
        "(interval, default rate, with inhibition), and leaving the inhibition of ten out does not "
        "lower their mean (interval of the paired difference not below 0)",
        ("HIDDEN",),
        _judge_number,
    ),
)

# --- the figure ----------------------------------------------------------------------------------

_SHOWN = {
    ONE: ("one\nstage", GREY),
    NETWORKS_OWN: ("two\nstages", GREY),
    BEST_TWO: ("two, one\nfast", GREY),
    network(1): ("1\nhidden", BLUE),
    network(10): ("10\nhidden", BLUE),
    PEAK_ONE: ("one\nstage", RED),
    PEAK_TWO: ("two\nstages", RED),
}


def _draw(results: Results) -> Figure:
    """Networks by hidden neurons, rate and inhibition; beside them linear neurons."""
    data = results["HIDDEN"]
    figure, grid = panels(
        1, 2, width=WIDE, height=3.2, sharey=True, gridspec_kw={"width_ratios": [1, 1.45]}
    )
    _draw_networks(grid[0, 0], data)
    axes = grid[0, 1]
    jitter = np.random.default_rng(0)
    for place, (learner, (_, colour)) in enumerate(_SHOWN.items()):
        scores = scores_of(data, learner)
        x = place + jitter.uniform(-0.2, 0.2, len(scores))
        axes.plot(x, scores, "o", color=colour, ms=2.8, alpha=0.5, mew=0)
        look = {"fmt": "D", "ms": 3.5, "color": INK, "mfc": "white", "lw": 1.1}
        error_bars(axes, place + 0.32, mean(scores), **look)
    axes.set_xticks(range(len(_SHOWN)), [name for name, _ in _SHOWN.values()], fontsize=6)
    axes.set_xlim(-0.6, len(_SHOWN) - 0.3)
    for between, name, colour in (
        ((0, 2), "linear, same gradient", GREY),
        ((3, 4), "network, BP", BLUE),
        ((5, 6), "linear, PeakError", RED),
    ):
        middle = float(np.mean(between))
        axes.annotate(name, (middle, 10_450), ha="center", fontsize=7, color=colour)
    for border in (2.6, 4.6):
        axes.axvline(border, color=GREY, lw=0.6)
    silent_line(axes, Task().silent_score)
    axes.set_ylim(0, 11_000)
    axes.set_yticks(range(0, 10_001, 2_000))
    letter(axes, "b   where the gain comes from")
    return figure


def _draw_networks(axes: Axes, data: xr.Dataset) -> None:
    """Mean scores against the number of hidden neurons."""
    places = np.arange(len(HIDDEN))
    for rate, colour, mark in zip(RATES, ("#1b998b", INK, "#8f6bb3"), "os^", strict=True):
        for how in INHIBITION:
            names = [network(h, rate, how if h > 1 else "") for h in HIDDEN]
            found = np.array([mean(scores_of(data, name)) for name in names])
            axes.plot(
                places, found[:, 0], ":" if how else "-", marker=mark, ms=4, lw=1.1, color=colour,
                mfc="white" if how else colour, label=f"λ {rate:g}{how}",
            )  # fmt: skip
            if not how:
                axes.fill_between(places, found[:, 1], found[:, 2], color=colour, alpha=0.13, lw=0)
    axes.set_xticks(places, [str(number) for number in HIDDEN])
    axes.set(xlabel="hidden neurons", ylabel=BINS)
    axes.legend(fontsize=6, loc="lower right")
    letter(axes, "a   networks")


EXPERIMENTS = {"HIDDEN": hidden_unit}
PICTURES = {
    "HIDDEN": Picture(
        _draw,
        ("HIDDEN",),
        "Two classes. (a) Networks by number of hidden neurons, learning rate and inhibition "
        "(dotted, open: none): means, with 95 % bootstrap bands over pattern seeds. (b) One point "
        "per pattern seed, diamonds are means with intervals. Grey, linear neurons of one stage "
        "and of two that follow the gradient that the network follows; blue, networks; red, "
        "linear neurons that learn by PeakError. Dotted, a neuron that never spikes.",
    )
}
