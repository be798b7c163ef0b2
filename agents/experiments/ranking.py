"""RANKING: every learning rule on every neuron, tuned alike, on patterns that no setting was
chosen on.

The settings come from the search of `tuning.py`. Each entry hears the same streams of each pattern
seed, 60,000 trials, as three neurons that differ in their initial weights; its score on a pattern
seed is the mean of the three. Intervals are stratified bootstraps over pattern seeds.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.experiments.design import Axis, Block, Experiment, Setting
from agents.experiments.markdown import in_brackets, markdown_table
from agents.experiments.rules import LEARNERS
from agents.experiments.statistics import (
    Interval,
    Wins,
    counted,
    improvements,
    mean,
    middle_means,
    mistakes_per_thousand,
    stratified_bootstrap,
    wins,
)
from agents.experiments.store import read
from agents.experiments.training import class_counts, pattern_seeds, training
from agents.experiments.tuning import (
    CHOSEN,
    NETWORK,
    NEURONS,
    ONLY_ON,
    RULES,
    chosen_settings,
    entries,
    feedback_of,
    folder_name,
    for_trials,
)
from agents.plotting import GREY, INK, OKABE_ITO, WIDE, panels, styled
from gnm_env import Task

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

# --- the grid ------------------------------------------------------------------------------------

TRIALS = 60_000
COPIES = 3
PAPER = "GNM, ALL as published"
BY_HAND = {
    "GNM, CriticalThreshold by hand": "A: GNM, CriticalThreshold, tuned",
    "GNM, PeakError by hand": "B: GNM, PeakError, tuned",
}
"""Learners of `rules.py`, whose settings were chosen with more care, on pattern seeds 0 to 15."""

FIXED: dict[str, Setting] = {
    PAPER: {"neuron": "gnm", "rule": "all"},
    **{name: dict(LEARNERS[learner]) for name, learner in BY_HAND.items()},
}
"""Rows beside the entries: settings that no search chose."""

SIZES = {"quick": (range(100, 102), (1, 2)), "full": (range(100, 148), (1, 2, 3, 4))}
"""Pattern seeds and numbers of classes."""


def ranking(
    name: str, size: str, seeds: tuple[int, ...] | None = None, chosen: Path = CHOSEN
) -> Experiment:
    """One learner with its settings in the file `chosen`, pattern seed by pattern seed.

    Raises ValueError if the file has no settings for it.
    """
    usual, classes = SIZES[size]
    if name in FIXED:
        setting = FIXED[name]
    else:
        known = chosen_settings(chosen)
        if name not in known:
            raise ValueError(
                f"{chosen} has no settings for {name}: run `gnm league --tune` for its rule first"
            )
        setting = for_trials(known[name], TRIALS)
    copy = Axis(
        "copy", tuple(range(COPIES)), chunk=0, long_name="neuron with initial weights of its own"
    )
    axes = (pattern_seeds(seeds or usual), class_counts(*classes), copy)
    return training(f"RANKING {name}", "One learner, tuned", axes, **{**setting, "trials": TRIALS})


def rows_of(neurons: Sequence[str] | None, rules: Sequence[str] | None) -> list[str]:
    """The rows that `--neurons` and `--rules` choose. Raises ValueError for an unknown name."""
    everything = neurons is None and rules is None
    return [*entries(neurons, rules), *(FIXED if everything else [])]


def on_seed(experiment: Experiment, seed: int) -> Callable[[Block], bool]:
    """Whether a block of `experiment` is of this pattern seed."""
    seeds = experiment.axes[0].values
    return lambda block: bool(seeds[block.ranges[0][0]] == seed)


# --- what a store says ---------------------------------------------------------------------------


class Scores(NamedTuple):
    """Scores of one learner at one number of classes."""

    seeds: NDArray[np.int64]
    """Pattern seeds, ascending, (S,)."""
    bins: NDArray[np.float64]
    """Bins survived, mean over runs and copies, (S,)."""
    mistakes: NDArray[np.float64]
    """Mistakes in 1,000 bins, (S,); NaN where it is not known."""


Table = dict[str, dict[int, Scores]]
"""Scores by learner and number of classes."""


def read_ranking(folder: Path, names: Sequence[str]) -> Table:
    """What is finished of the learners `names`, each of which has a store in `folder`."""
    table: Table = {}
    for name in names:
        place = folder / folder_name(name)
        if place.exists():
            table[name] = scores_of(read(place, unfinished=True))
    return {name: scores for name, scores in table.items() if scores}


def scores_of(results: xr.Dataset) -> dict[int, Scores]:
    """The scores in the store of one learner, by number of classes."""
    survived = results["survived"].transpose("classes", "pattern_seed", "copy", "run")
    seeds, cap = results["pattern_seed"].to_numpy(), results.attrs["settings"]["common"]["cap"]
    found = {}
    for classes, bins in zip(results["classes"].to_numpy(), survived.to_numpy(), strict=True):
        done = (bins >= 0).all((1, 2))
        if done.any():
            rates = [mistakes_per_thousand(one, cap) for one in bins[done]]
            found[int(classes)] = Scores(seeds[done], bins[done].mean((1, 2)), np.array(rates))
    return found


OTHERS = Path(__file__).with_name("rl_scores.json")
"""Scores of PPO by pattern seed, as docs/reinforcement-learning.md gives them."""


def with_others(table: Table, path: Path = OTHERS) -> Table:
    """The table with rows that were measured elsewhere, from a file of scores by pattern seed."""
    others = json.loads(path.read_text("utf-8"))["scores"]
    return table | {
        name: {
            int(classes): Scores(
                np.array([int(seed) for seed in by_seed]),
                np.array([float(value) for value in by_seed.values()]),
                np.full(len(by_seed), np.nan),
            )
            for classes, by_seed in rows.items()
        }
        for name, rows in others.items()
    }


def saved(table: Table) -> dict[str, Any]:
    """The table as plain values: bins and mistakes by learner, classes and pattern seed."""
    return {
        name: {
            str(classes): {
                str(seed): [round(float(bins), 1), round(float(rate), 4)]
                for seed, bins, rate in zip(*scores, strict=True)
            }
            for classes, scores in by_classes.items()
        }
        for name, by_classes in table.items()
    }


class Contrast(NamedTuple):
    """Two learners on the pattern seeds that both have."""

    first: str
    second: str
    classes: int
    seeds: int
    difference: Interval
    """Mean paired difference in bins survived."""
    improvement: Interval
    """Probability of improvement."""
    wins: Wins


CONTRASTS = (
    *((f"{neuron}, CriticalThreshold", f"{neuron}, ALL") for neuron in NEURONS),
    ("GNM, CriticalThreshold", PAPER),
    *((f"{neuron}, PeakError", f"{neuron}, ET") for neuron in NEURONS),
    *((f"{neuron}, PeakError", f"{neuron}, ET, modulated") for neuron in NEURONS),
    *((f"GNM, {rule}", f"MST, {rule}") for rule in RULES if rule not in ONLY_ON),
    *(
        (f"GNM, {rule}", other)
        for rule in ("CriticalThreshold", "PeakError")
        for other in (NETWORK, "PPO, cost", "PPO, dense")
    ),
    *((name, other) for name in BY_HAND for other in (PAPER, NETWORK, "PPO, cost", "PPO, dense")),
)
"""All but those of BY_HAND were fixed before anything was scored."""


def contrasts(table: Table) -> Iterator[Contrast]:
    """Each contrast of CONTRASTS for which the table has at least two seeds, by classes."""
    for first, second in CONTRASTS:
        for classes in sorted(table.get(first, {}).keys() & table.get(second, {}).keys()):
            one, other = table[first][classes], table[second][classes]
            shared, a, b = np.intersect1d(one.seeds, other.seeds, return_indices=True)
            if len(shared) > 1:
                x, y = one.bins[a], other.bins[b]
                yield Contrast(
                    first, second, classes, len(shared), mean(x - y),
                    stratified_bootstrap(improvements, x, y), wins(x, y),
                )  # fmt: skip


# --- tables --------------------------------------------------------------------------------------


def markdown(table: Table) -> str:
    """The tables of the page on rules: scores by feedback, and contrasts."""
    return f"{score_table(table)}\n\n{contrast_table(table)}\n"


def score_table(table: Table) -> str:
    """Interquartile mean with its interval, and the mistake rate, by feedback and rule."""
    counts = sorted({classes for by_classes in table.values() for classes in by_classes})
    head = ["told", "learner", "seeds"]
    for classes in counts:
        head += [counted(classes), "mistakes"]
    rows = []
    for name in _by_feedback(table):
        by_classes = table[name]
        numbers = [len(by_classes[c].seeds) for c in counts if c in by_classes]
        same = len(set(numbers)) == 1
        cells = [_told(name), name, str(numbers[0]) if same else ", ".join(map(str, numbers))]
        for classes in counts:
            cells += _cells(by_classes.get(classes))
        rows.append(cells)
    return "\n".join(markdown_table(head, rows, right=3))


def _cells(scores: Scores | None) -> list[str]:
    if scores is None:
        return ["", ""]
    iqm = stratified_bootstrap(middle_means, scores.bins)
    rate = np.median(scores.mistakes)
    return [in_brackets(iqm, ",.0f"), f"{rate:.2g}" if np.isfinite(rate) else ""]


def contrast_table(table: Table) -> str:
    """Paired differences, probability of improvement, and how often the first was ahead."""
    head = ["first − second", "classes", "seeds", "difference in bins", "P(improvement)", "ahead"]
    rows = [
        (
            f"{c.first} − {c.second}", c.classes, c.seeds, in_brackets(c.difference, "+,.0f"),
            in_brackets(c.improvement, ".2f"), f"{c.wins.wins} of {c.wins.pairs}",
        )
        for c in contrasts(table)
    ]  # fmt: skip
    return "\n".join(markdown_table(head, rows, right=1))


FEEDBACK = {
    "A": "too many or too few",
    "A′": "how many too many or too few",
    "B": "where the patterns were",
    "C": "when to spike",
    "U": "nothing",
}


def _told(name: str) -> str:
    if name in FIXED:
        name = name.replace(" as published", "").replace(" by hand", "")
    if name.startswith("PPO"):
        return "A′" if name.endswith("cost") else "B"
    return feedback_of(name)


def _by_feedback(table: Mapping[str, Any]) -> list[str]:
    """Names of the learners by what they are told, within it in the order of the grid."""
    order = [*FEEDBACK]
    return sorted(table, key=lambda name: order.index(_told(name)))


# --- pictures ------------------------------------------------------------------------------------

NEURON_STYLES = {
    "GNM": (OKABE_ITO["blue"], "o"),
    "LIF": (OKABE_ITO["orange"], "s"),
    "MST": (OKABE_ITO["green"], "^"),
}


def draw(table: Table, folder: Path) -> list[Path]:
    """front.png and, once an entry was scored, ranking.png, with their PDFs, in `folder`."""
    paths = []
    pictures = {"front": draw_front, **({"ranking": draw_ranking} if _groups(table) else {})}
    with styled():
        for name, picture in pictures.items():
            figure = picture(table)
            for ending in ("png", "pdf"):
                paths.append(folder / f"{name}.{ending}")
                figure.savefig(paths[-1])
    return paths


def draw_ranking(table: Table) -> Figure:
    """Interquartile means by rule, split by what a rule is told; a column for each class count."""
    counts = sorted({c for name in table if name in entries() for c in table[name]})
    groups = _groups(table)
    heights = [len(rules) for _, rules in groups]
    figure, axes = panels(
        len(groups), len(counts), width=WIDE, height=0.26 * sum(heights) + 0.32 * len(groups) + 0.6,
        height_ratios=heights, sharex=True,
    )  # fmt: skip
    for row, (feedback, rules) in zip(axes, groups, strict=True):
        for axis, classes in zip(row, counts, strict=True):
            _panel(axis, table, rules, classes)
        row[0].set_yticklabels(rules)
        row[0].set_title(f"{feedback}: told {FEEDBACK[feedback]}", loc="left", fontsize=8)
    for axis, classes in zip(axes[0], counts, strict=True):
        axis.annotate(
            counted(classes), (0.5, 1.0), (0, 20), xycoords="axes fraction",
            textcoords="offset points", ha="center", fontweight="bold",
        )  # fmt: skip
    figure.supxlabel("bins survived, interquartile mean", fontsize=8)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower left", ncols=3)
    return figure


def _groups(table: Table) -> list[tuple[str, list[str]]]:
    """Rules by feedback, as far as one of their entries was scored."""
    found: dict[str, list[str]] = {}
    for rule, entry in RULES.items():
        if any(f"{neuron}, {rule}" in table for neuron in NEURONS):
            found.setdefault(entry.feedback, []).append(rule)
    return list(found.items())


def _panel(axis: Any, table: Table, rules: list[str], classes: int) -> None:
    for shift, (neuron, (colour, mark)) in zip((-0.24, 0.0, 0.24), NEURON_STYLES.items(),
                                               strict=True):  # fmt: skip
        places, values = [], []
        for place, rule in enumerate(rules):
            scores = table.get(f"{neuron}, {rule}", {}).get(classes)
            if scores is not None:
                iqm = stratified_bootstrap(middle_means, scores.bins)
                axis.plot([iqm.low, iqm.high], [place + shift] * 2, color=colour, lw=1.1)
                places.append(place + shift)
                values.append(iqm.value)
        axis.plot(values, places, mark, color=colour, ms=3.6, label=neuron)
    axis.axvline(Task().silent_score, color=GREY, ls=":", lw=0.8, zorder=0)
    axis.set(xlim=(0, 10_200), ylim=(len(rules) - 0.5, -0.5), xticks=(0, 5_000, 10_000))
    axis.set_yticks(range(len(rules)), [""] * len(rules))
    axis.set_xticks((2_500, 7_500), minor=True)
    axis.xaxis.set_major_formatter("{x:,.0f}")
    axis.grid(axis="x", which="both", color="0.92", lw=0.6)


class FrontRow(NamedTuple):
    """A line of the first picture."""

    label: str
    colour: str
    mark: str
    dashes: str


FRONT = {
    "GNM, PeakError by hand": FrontRow(
        "one neuron, PeakError: told where the patterns were", OKABE_ITO["orange"], "^", "-"
    ),
    "GNM, CriticalThreshold by hand": FrontRow(
        "one neuron, CriticalThreshold: told “too many” or “too few”", OKABE_ITO["blue"], "o", "-"
    ),
    PAPER: FrontRow(
        "one neuron, ALL, the paper's rule: told the same", OKABE_ITO["sky"], "o", "--"
    ),
    NETWORK: FrontRow("network, 1,010 weights, BP: told where", INK, "D", "-"),
    "PPO, cost": FrontRow(
        "PPO, 10,985 weights: told the number of errors", OKABE_ITO["vermillion"], "s", ":"
    ),
}


def draw_front(table: Table) -> Figure:
    """How long learners survive by number of classes: one neuron, the network, PPO."""
    figure, ((axis,),) = panels(1, 1, width=WIDE, height=4.0)
    counts = sorted({classes for name in FRONT for classes in table.get(name, {})})
    places = np.linspace(-0.14, 0.14, len(FRONT))
    for shift, (name, row) in zip(places, FRONT.items(), strict=True):
        known = sorted(table.get(name, {}))
        found = [stratified_bootstrap(middle_means, table[name][c].bins) for c in known]
        x = [counts.index(c) + shift for c in known]
        seeds = max((len(table[name][c].seeds) for c in known), default=0)
        axis.plot(
            x, [iqm.value for iqm in found], row.mark, ls=row.dashes, color=row.colour, ms=5,
            lw=1.4, label=f"{row.label} ({seeds} pattern seeds)",
        )  # fmt: skip
        for place, iqm in zip(x, found, strict=True):
            axis.plot([place, place], [iqm.low, iqm.high], color=row.colour, lw=1.4)
    axis.axhline(Task().silent_score, color=GREY, ls=":", lw=0.9, zorder=0)
    axis.annotate("never spikes", (0.005, Task().silent_score + 90), fontsize=7, color=GREY,
                  xycoords=("axes fraction", "data"))  # fmt: skip
    axis.set_xticks(range(len(counts)), [counted(classes) for classes in counts])
    axis.set_xlim(-0.35, len(counts) - 0.65)
    axis.set(ylim=(0, 10_200), ylabel="bins without a mistake, of 10,000")
    axis.grid(axis="y", color="0.92", lw=0.6)
    axis.yaxis.set_major_formatter("{x:,.0f}")
    figure.legend(loc="outside lower center", fontsize=8)
    return figure
