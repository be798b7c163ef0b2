"""WHEN: at what difficulty a neuron has to remember.

A neuron with α = 1 hears nothing but the present bin. One fixed pattern in noise is no reason to
remember more: a coincidence of spikes in one bin gives it away. Here that task is made harder in
four ways: a second pattern that is owed nothing (another one, the wanted one played backwards, or
one that shares most of its spikes with it), spikes that are moved in time at each presentation, and
spikes that are left out. What is kept from the past then decides who can learn it.

Learning rates were chosen on pattern seeds 0 and 1; what is reported is heard with seeds 100 to
115.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from agents.experiments.design import Axis, Block, Experiment
from agents.experiments.figures import Picture
from agents.experiments.statistics import Interval, by_seed, mean, ratio_of_means, score
from agents.experiments.training import (
    RUN,
    SURVIVED,
    learners,
    pattern_seeds,
    protocol,
    scored,
    trained,
)
from agents.experiments.verdict import Finding, Hypothesis, Results
from agents.plotting import BINS, BLUE, GREY, INK, RED, WIDE, legend_above, letter, panels
from gnm_env import Patterns, Task

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# --- what is heard -------------------------------------------------------------------------------

PLAIN = "plain"
SITUATIONS: dict[str, dict[str, Any]] = {
    PLAIN: {},
    "another": {"second": "another"},
    "overlap 50 %": {"second": "overlap", "shared": 0.5},
    "overlap 80 %": {"second": "overlap", "shared": 0.8},
    "overlap 90 %": {"second": "overlap", "shared": 0.9},
    "backwards": {"second": "backwards"},
    "jitter 1": {"jitter_bins": 1},
    "jitter 2": {"jitter_bins": 2},
    "jitter 4": {"jitter_bins": 4},
    "jitter 8": {"jitter_bins": 8},
    "deletion 10 %": {"deletion": 0.1},
    "deletion 20 %": {"deletion": 0.2},
    "deletion 40 %": {"deletion": 0.4},
}
"""A wanted pattern owed one spike, alone or with a second one that is owed none."""

FAMILIES = {
    "a second pattern": (
        PLAIN, "another", "overlap 50 %", "overlap 80 %", "overlap 90 %", "backwards",
    ),
    "spikes moved by bins": (PLAIN, "jitter 1", "jitter 2", "jitter 4", "jitter 8"),
    "spikes left out": (PLAIN, "deletion 10 %", "deletion 20 %", "deletion 40 %"),
}  # fmt: skip
"""In the order of difficulty, each from the plain task on."""


def task_of(situation: Mapping[str, Any]) -> Task:
    """The task of a situation: one class owed 1 and, with a second pattern, one owed 0."""
    owed = (1, 0) if "second" in situation else (1,)
    fields = {k: situation[k] for k in ("jitter_bins", "deletion") if k in situation}
    return Task(n_classes=len(owed), targets=owed, **fields)


def patterns_of(situation: Mapping[str, Any], seed: int) -> Patterns:
    """The patterns of a situation; the wanted one is the same in all of them.

    "overlap" takes each spike of the wanted pattern over with the probability `shared`, and fills
    up with those of another pattern, likewise thinned, so that both have the same rate.
    """
    task = task_of(situation)
    drawn = Patterns.draw(Task(n_classes=2), seed).dense()
    wanted, other = drawn
    second = situation.get("second")
    if second is None:
        return Patterns.from_dense(drawn[: task.n_classes])
    if second == "backwards":
        other = wanted[::-1]
    elif second == "overlap":
        kept, added = np.random.default_rng((seed, 3)).random((2, *wanted.shape))
        shared = situation["shared"]
        other = (wanted & (kept < shared)) | (other & (added >= shared))
    return Patterns.from_dense(np.stack([wanted, other]))


def silent_score(situation: Mapping[str, Any]) -> float:
    """Bins that a neuron which never spikes survives, on average.

    With a second pattern, owed none, as many of these go before the first wanted one as it takes
    a coin to fall on its other side: one on average, each with the noise before it.
    """
    alone = Task()
    noise = (1.0 - alone.onset_probability) / alone.onset_probability
    before = 1.0 if "second" in situation else 0.0
    return before * (noise + alone.pattern_bins) + alone.silent_score


# --- the grid ------------------------------------------------------------------------------------

TRIALS = 20_000
NEURONS: dict[str, dict[str, Any]] = {
    "no memory": {"neuron": "gnm", "alpha": 1.0},
    "GNM, α 0.3": {"neuron": "gnm", "alpha": 0.3},
    "GNM, α 0.15": {"neuron": "gnm", "alpha": 0.15},
    "two stages": {
        "neuron": "agents.experiments.two_stage:TwoStage", "alpha": 0.15, "alpha_2": 0.4,
    },
    "MST": {"neuron": "mst", "tau_m": 10.0, "tau_s": 2.5},
}  # fmt: skip
"""The response of the last two rises before it falls; only that of the MST is reset by spikes."""

FALLING: dict[str, Any] = {"weight_bounds": None, "decay_trials": TRIALS}
RULES: dict[str, dict[str, Any]] = {
    "PeakError": {"rule": "peak-error", "learning_rate": 1e-2, **FALLING},
    "CriticalThreshold": {"rule": "critical", "learning_rate": 3e-2, **FALLING},
}
NETWORK = "network, BP"
LEARNERS: dict[str, dict[str, Any]] = {
    **{
        f"{name}, {rule}": {**neuron, **how}
        for rule, how in RULES.items()
        for name, neuron in NEURONS.items()
    },
    NETWORK: {"neuron": "network", "rule": "bp", "hidden": 1},
}

SIZES = {"quick": range(100, 102), "paper": range(100, 116)}


def when(size: str, seeds: tuple[int, ...] | None = None) -> Experiment:
    """Every neuron and rule in every situation, on the same streams."""
    axes = (
        Axis.named("situation", SITUATIONS, long_name="what makes the task harder"),
        pattern_seeds(seeds or SIZES[size]),
        learners(LEARNERS),
    )
    common = {**RUN, "trials": TRIALS, "start": "matched"}
    described = protocol(Task(), list(LEARNERS.values())) | {
        "owed": "1 by the wanted pattern, 0 by the second",
        "overlap": "default_rng((pattern_seed, 3))",
    }
    return Experiment(
        "WHEN", "When memory is needed", axes, common, _compute, (SURVIVED,),
        {"run": RUN["runs"]}, described,
    )  # fmt: skip


def _compute(block: Block) -> dict[str, NDArray[Any]]:
    shared = block.settings[0]
    task, patterns = task_of(shared), patterns_of(shared, shared["pattern_seed"])
    agents, _ = trained(block.settings, task, patterns)
    return block.shaped(survived=scored(agents, task, patterns, shared))


# --- the hypotheses ------------------------------------------------------------------------------

NEAR_SILENCE = 1.25
"""A score up to so many times that of a silent neuron has learned nothing worth the name."""


def scores_of(data: xr.Dataset, situation: str, learner: str) -> NDArray[np.float64]:
    """Scores by pattern seed."""
    return by_seed(score(data).sel(situation=situation, learner=learner))


def kept(data: xr.Dataset, learner: str, situation: str, base: str) -> Interval:
    """Mean score in a situation over that in another, bootstrap over seeds."""
    return ratio_of_means(*(scores_of(data, one, learner) for one in (situation, base)))


def _judge_backwards(results: Results) -> Finding:
    data, silent = results["WHEN"], silent_score(SITUATIONS["backwards"])
    held, words = {}, [f"a silent neuron {silent:,.0f} bins"]
    for rule in RULES:
        for neuron in NEURONS:
            found = mean(scores_of(data, "backwards", f"{neuron}, {rule}"))
            fails = neuron == "no memory"
            good = found.below(NEAR_SILENCE * silent) if fails else found.above(5 * silent)
            held[f"it is {neuron} under {rule}"] = good
            words.append(f"{neuron}, {rule}: {found:,.0f}")
    return Finding.of(held, words)


def _judge_jitter(results: Results) -> Finding:
    data = results["WHEN"]
    held, words = {}, []
    for rule in RULES:
        without, with_ = (
            kept(data, f"{neuron}, {rule}", "jitter 1", PLAIN)
            for neuron in ("no memory", "GNM, α 0.15")
        )
        held[f"the rule is {rule}"] = without.below(0.2) and with_.above(0.5)
        words.append(f"{rule}: no memory keeps {without:.0%}, GNM with α 0.15 {with_:.0%}")
    return Finding.of(held, words)


def _judge_rise(results: Results) -> Finding:
    data = results["WHEN"]
    held, words = {}, []
    for rule in RULES:
        base = scores_of(data, "jitter 4", f"GNM, α 0.15, {rule}")
        words.append(f"{rule}: GNM with α 0.15 {mean(base):,.0f} bins")
        for neuron in ("two stages", "MST"):
            other = scores_of(data, "jitter 4", f"{neuron}, {rule}")
            gain = mean(other - base)
            held[f"it is {neuron} under {rule}"] = gain.above(0)
            words.append(f"{neuron} {mean(other):,.0f}, {gain:+,.0f}")
    return Finding.of(held, words)


def _judge_deletion(results: Results) -> Finding:
    data = results["WHEN"]
    held, words = {}, []
    for rule in RULES:
        for neuron in NEURONS:
            share = kept(data, f"{neuron}, {rule}", "deletion 20 %", PLAIN)
            held[f"it is {neuron} under {rule}"] = share.below(0.5)
            words.append(f"{neuron}, {rule}: {share:.0%}")
    return Finding.of(held, words)


def _judge_overlap(results: Results) -> Finding:
    data = results["WHEN"]
    silent = silent_score(SITUATIONS["overlap 80 %"])
    held, words = {}, []
    for rule in RULES:
        found = mean(scores_of(data, "overlap 80 %", f"no memory, {rule}"))
        share = kept(data, f"GNM, α 0.15, {rule}", "overlap 90 %", "another")
        held[f"the rule is {rule}"] = found.below(NEAR_SILENCE * silent) and share.above(0.5)
        words.append(
            f"{rule}: no memory at 80 % {found:,.0f} bins (silent {silent:,.0f}); GNM with α 0.15 "
            f"keeps {share:.0%} at 90 %"
        )
    return Finding.of(held, words)


_PROTOCOL = (
    "one wanted pattern owed 1 spike; GNM with α 1, 0.3 and 0.15 (η 0), two stages (decays 0.15 "
    "and 0.4, no reset) and MST (τ 10 and 2.5 bins); PeakError λ 1e-2 and CriticalThreshold λ 3e-2 "
    "falling to 0, unbounded; network of one hidden neuron by BP; 20,000 trials, pattern seeds 100 "
    "to 115"
)

HYPOTHESES = (
    Hypothesis(
        "N1",
        "A neuron without memory cannot tell a pattern from the same played backwards, whatever "
        "the rule; every neuron with a memory can",
        "backwards a memoryless neuron gives as many spikes; pattern seeds 0 and 1: 305 bins, a "
        "silent neuron 297, others 7,000 to 10,000",
        _PROTOCOL,
        "holds if, under either rule, the mean score of α = 1 has an interval below "
        f"{NEAR_SILENCE:g} times that of a silent neuron, and that of each other neuron one above "
        "5 times",
        ("WHEN",),
        _judge_backwards,
    ),
    Hypothesis(
        "N2",
        "Without a second pattern memory is needed as soon as spikes move by a single bin",
        "pattern seeds 0 and 1: α = 1 falls from 9,440 bins to about 430, α = 0.15 from 9,930 to "
        "8,400 and more",
        _PROTOCOL,
        "holds if, at a jitter of one bin and under either rule, α = 1 keeps less than 20 % of its "
        "score on the plain task and α = 0.15 more than 50 % (intervals, bootstrap over seeds)",
        ("WHEN",),
        _judge_jitter,
    ),
    Hypothesis(
        "N3",
        "Against jitter of several bins a response that rises before it falls is better than one "
        "that jumps, with a reset or without",
        "pattern seeds 0 and 1, jitter 4: MST 9,480 to 9,956 bins, GNM with α 0.15 2,424 to 5,895; "
        "two stages not tried",
        _PROTOCOL,
        "holds if, at a jitter of 4 bins and under either rule, the mean paired differences two "
        "stages − GNM (α 0.15) and MST − GNM (α 0.15) have intervals above 0",
        ("WHEN",),
        _judge_rise,
    ),
    Hypothesis(
        "N4",
        "Spikes that are left out cannot be made up for by any memory",
        "pattern seeds 0 and 1, 20 % left out: α = 0.3 and 0.15 700 to 1,500 bins, plain 9,900; "
        "MST and two stages not tried",
        _PROTOCOL,
        "holds if, with 20 % of the spikes left out, every neuron keeps less than half of its "
        "score on the plain task under either rule (intervals)",
        ("WHEN",),
        _judge_deletion,
    ),
    Hypothesis(
        "N5",
        "A second pattern that shares most spikes is too much for a neuron without memory, and not "
        "for one with it",
        "pattern seeds 0 and 1: α = 1 has 293 bins at 80 %, α = 0.15 4,865 to 9,438 at 90 %",
        _PROTOCOL,
        "holds if, under either rule, α = 1 has an interval below "
        f"{NEAR_SILENCE:g} times silence where 80 % are shared, and α = 0.15 keeps more than half "
        "of its score beside an unrelated pattern where 90 % are (interval)",
        ("WHEN",),
        _judge_overlap,
    ),
)

# --- the figure ----------------------------------------------------------------------------------

_STYLES = {
    "no memory": (RED, "o"),
    "GNM, α 0.3": (BLUE, "^"),
    "GNM, α 0.15": (INK, "s"),
    "two stages": ("#1b998b", "D"),
    "MST": ("#8f6bb3", "v"),
}


def _short(situation: str) -> str:
    """A situation as the label of a tick."""
    for word, short in (("overlap", "shares"), ("jitter ", ""), ("deletion ", "")):
        situation = situation.replace(word, short)
    return situation.replace("shares ", "shares\n").replace("backwards", "back-\nwards")


def _draw(results: Results) -> Figure:
    """Scores along each way of making the task harder, by neuron; a row for each rule."""
    data = results["WHEN"]
    figure, grid = panels(
        2, len(FAMILIES), width=WIDE, height=4.6, sharey=True, sharex="col",
        gridspec_kw={"width_ratios": [len(steps) + 0.6 for steps in FAMILIES.values()]},
    )  # fmt: skip
    for row, rule in enumerate(RULES):
        for column, (family, steps) in enumerate(FAMILIES.items()):
            axes = grid[row, column]
            _draw_family(axes, data, rule, steps)
            if row == 0:
                letter(axes, f"{'abc'[column]}   {family}")
        grid[row, 0].set_ylabel(f"{rule}\n{BINS}")
    legend_above(figure, grid[0, 0], 6)
    return figure


def _draw_family(axes: Axes, data: xr.Dataset, rule: str, steps: tuple[str, ...]) -> None:
    names = {name: (f"{name}, {rule}", *style) for name, style in _STYLES.items()}
    names["network, 1 hidden (BP)"] = (NETWORK, GREY, "P")
    places = np.arange(len(steps), dtype=float)
    for shift, (label, (learner, colour, mark)) in enumerate(names.items()):
        found = np.array([mean(scores_of(data, step, learner)) for step in steps])
        x = places + 0.09 * (shift - 2.5)
        axes.plot(x, found[:, 0], ls="-", marker=mark, ms=3.5, lw=1.0, color=colour, label=label)
        axes.vlines(x, found[:, 1], found[:, 2], color=colour, lw=0.9)
    silent = [silent_score(SITUATIONS[step]) for step in steps]
    axes.plot(places, silent, ls=":", lw=0.9, color=GREY)
    axes.set_xticks(places, [_short(step) for step in steps], fontsize=6)
    axes.set_yscale("log")
    axes.set_ylim(100, 13_000)
    axes.set_yticks((100, 300, 1_000, 3_000, 10_000), ("100", "300", "1,000", "3,000", "10,000"))
    axes.minorticks_off()


EXPERIMENTS = {"WHEN": when}
PICTURES = {
    "WHEN": Picture(
        _draw,
        ("WHEN",),
        "One wanted pattern in noise, made harder in three ways from left to right: a second "
        "pattern that is owed nothing, spikes moved by up to so many bins at each presentation, "
        "and spikes left out. Means over pattern seeds with 95 % bootstrap intervals, logarithmic; "
        "dotted, a neuron that never spikes. Above PeakError, below CriticalThreshold; the network "
        "learns by backpropagation in both.",
    )
}
