"""Claims under each of the named conditions: matched, wide, the authors' code and the D reading.

Other subjects vary the initial weights alone. Here every condition is whole, with its own readout,
bounds, trace, λ, momentum, fraction, trials and caps, on pattern seeds that no other experiment
has.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from agents.experiments.conditions import CONDITIONS
from agents.experiments.design import Experiment
from agents.experiments.figures import Picture
from agents.experiments.forensics import (
    ALPHAS,
    FOUR_ALPHAS,
    PLACE,
    SIZES,
    Array,
    Protocol,
    Scores,
    conditions,
)
from agents.experiments.forest import draw_forest
from agents.experiments.statistics import Interval, mean, ratio_of_means, wins
from agents.experiments.verdict import Claim, Finding, Forest, Mark, Results
from agents.plotting import WIDE, letter, panels

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NAME = "CONDITIONS"


def by_condition(size: str, seeds: tuple[int, ...] | None = None) -> Experiment:
    """The neurons behind the paper's numbers under every condition."""
    return conditions(SIZES[size], seeds)


# --- the rules -----------------------------------------------------------------------------------

ALPHA = 0.01
"""Level of the two-sided sign tests."""

Judge = Callable[[Array], tuple[Interval, bool, str]]
"""From scores (pattern seeds, probes): the number to draw, whether the claim holds, in words."""


def _everywhere(results: Results, judge: Judge, forest: Forest) -> Finding:
    """The finding of a rule that is tried under every condition, at each of its caps."""
    scores = Scores(results[NAME])
    held: dict[str, bool] = {}
    words, marks = [], []
    for one in CONDITIONS.values():
        for cap in one.caps:
            label = f"{one.name}, cap {cap:,}"
            value, holds, told = judge(scores.of(Protocol(one, cap)))
            held[f"the condition is {label}"] = holds
            words.append(f"{label}: {told}")
            marks.append(Mark(label, value, holds))
    return Finding.of(held, words, forest=forest._replace(marks=tuple(marks)))


def _column(scores: Array, name: str) -> Array:
    found: Array = scores[:, PLACE[name]]
    return found


def _ratio(scores: Array, above: str, below: str) -> Interval:
    return ratio_of_means(_column(scores, above), _column(scores, below), least=1.0)


def _mst(scores: Array) -> tuple[Interval, bool, str]:
    value = mean(_column(scores, "MST 1"))
    return value, 377 / 2 <= value.value <= 377 * 2, f"{value:,.0f} bins"


def _four_classes(scores: Array) -> tuple[Interval, bool, str]:
    grids: Mapping[int, list[str]] = {
        1: [f"GNM 1 α {a:g}" for a in ALPHAS],
        2: ["GNM 2"],
        3: ["GNM 3"],
        4: [f"GNM 4 α {a:g}" for a in FOUR_ALPHAS],
    }
    means = {c: [float(_column(scores, name).mean()) for name in g] for c, g in grids.items()}
    tops = [max(one) for one in means.values()]
    best = mean(_column(scores, grids[4][int(np.argmax(means[4]))]))
    falls = all(later < earlier for earlier, later in itertools.pairwise(tops))
    number = ", ".join(f"{top:,.0f}" for top in tops)
    inside = best.low >= 100 and best.high <= 400 if np.isfinite(best.low) else (
        100 <= best.value <= 400
    )  # fmt: skip
    return best, falls and inside, f"{number} bins for 1, 2, 3, 4 classes; at four {best:,.0f}"


def _one_class_ratio(scores: Array) -> tuple[Interval, bool, str]:
    first, last = (_ratio(scores, f"LIF 1, {n}", "GNM 1 α 0.3") for n in (0, 25))
    holds = all(0.8 <= one.value <= 1.25 for one in (first, last))
    return first, holds, f"ratio {first:.2f} at 0, {last:.2f} at 25 bins"


def _rise(scores: Array) -> tuple[Interval, bool, str]:
    grows = _ratio(scores, "LIF 1, 25", "LIF 1, 0")
    return grows, grows.above(1.0 + 1e-9), f"25 bins over none {grows:.2f}"


def _three_class_ratio(scores: Array) -> tuple[Interval, bool, str]:
    first = _ratio(scores, "LIF 3, 0", "GNM 3")
    fall = _ratio(scores, "LIF 3, 25", "LIF 3, 0")
    holds = first.below(1.0) and fall.below(1.0)
    return first, holds, f"ratio {first:.2f} at 0; 25 bins over none {fall:.2f}"


def _mst_ahead(scores: Array) -> tuple[Interval, bool, str]:
    found = wins(_column(scores, "MST 2"), _column(scores, "GNM 2"))
    return found.interval, found.share <= 0.16 and found.p < ALPHA, f"MST ahead in {found}"


def _et_ahead(scores: Array) -> tuple[Interval, bool, str]:
    found = wins(_column(scores, "ET 2"), _column(scores, "GNM 2"))
    return found.interval, found.share >= 0.8 and found.p < ALPHA, f"ET ahead in {found}"


def _claim(
    id_: str, where: str, words: str, rule: str, classes: str, judge: Judge, forest: Forest
) -> Claim:
    return Claim(
        id_,
        where,
        f"{words}: under each condition",
        "the conditions of the reproduction, each whole, at each of its caps; ET is modulated "
        "under the authors' code and the D reading, plain else",
        f"reproduced if {rule}, under every condition and cap; conditional on them",
        (NAME,),
        f"gnm/PatternStream-v0, {classes}",
        lambda results: _everywhere(results, judge, forest),
    )


CLAIMS = (
    _claim(
        "F3e+", "Fig. 3, caption", "The MST averages ≈ 377 on one class",
        "the mean lies within a factor of 2 of 377", "1 class", _mst,
        Forest("bins", 377 / 2, 377 * 2, (), 377, logarithmic=True),
    ),
    _claim(
        "F4+", "Fig. 4", "A quick fall with the number of classes, at best ≈ 200 bins at four",
        "the best mean over α falls with every class added (two and three classes at α = 0.3) and "
        "its interval at four classes lies in 100 … 400 bins", "1 to 4 classes", _four_classes,
        Forest("bins at four classes", 100, 400, (), 200, logarithmic=True),
    ),
    _claim(
        "F6a1+", "Fig. 6", "One class: LIF over GNM is comparable to 1 at every refractory period",
        "the ratio of mean scores lies in 0.8 … 1.25 without a refractory period and with one of "
        "25 bins", "1 class", _one_class_ratio, Forest("LIF / GNM", 0.8, 1.25, ()),
    ),
    _claim(
        "F6a2+", "Fig. 6", "One class: LIF over GNM rises with the refractory period",
        "the ratio of the scores with 25 bins and without has an interval above 1", "1 class",
        _rise, Forest("LIF 25 / LIF 0", 1.0, 9.0, ()),
    ),
    _claim(
        "F6b+", "Fig. 6", "Three classes: LIF over GNM is below 1 even without a refractory "
        "period, and falls with it",
        "the ratio without has an interval below 1, and that of 25 bins to none too", "3 classes",
        _three_class_ratio, Forest("LIF / GNM", 0.0, 1.0, ()),
    ),
    _claim(
        "F7a+", "Fig. 7", "Two classes, ALL: the MST beats the GNM in 3 runs of 50",
        "the MST is ahead in at most 16 % of the paired seeds with two-sided sign test p < "
        f"{ALPHA:g}", "2 classes", _mst_ahead, Forest("share of seeds", 0.0, 0.16, (), 0.06),
    ),
    _claim(
        "F7b+", "Fig. 7", "Two classes, GNM: ET beats ALL in 46 runs of 50",
        "ET is ahead in at least 80 % of the paired seeds with two-sided sign test p < "
        f"{ALPHA:g}", "2 classes", _et_ahead, Forest("share of seeds", 0.8, 1.0, (), 0.92),
    ),
)  # fmt: skip

# --- the figure ----------------------------------------------------------------------------------


def _draw(results: Results) -> Figure:
    """A forest plot for each claim."""
    columns = 2
    rows = -(-len(CLAIMS) // columns)
    figure, grid = panels(rows, columns, width=WIDE, height=1.7 * rows)
    for place, (axes, claim) in enumerate(zip(grid.flat, CLAIMS, strict=False)):
        forest = claim.judge(results).forest
        assert forest is not None
        draw_forest(axes, forest, names=place % columns == 0)
        axes.set_xlabel(forest.unit)
        letter(axes, f"{'abcdefgh'[place]}   {claim.id}")
    for axes in grid.flat[len(CLAIMS) :]:
        axes.set_visible(False)
    return figure


EXPERIMENTS = {NAME: by_condition}
PICTURES = {
    NAME: Picture(
        _draw,
        (NAME,),
        "The paper's numbers under each named condition at each of its caps, with 95 % intervals "
        "over pattern seeds. Shaded: where the claim holds; line: the paper's own number, where "
        "it gives one. Blue holds, red does not. (a) MST, one class. (b) The best of four "
        "classes. (c) LIF over GNM without a refractory period, one class. (d) LIF with 25 bins "
        "of it over none, one class. (e) LIF over GNM, three classes. (f) How often the MST is "
        "ahead of the GNM, two classes. (g) How often ET is ahead of ALL, two classes.",
    )
}
