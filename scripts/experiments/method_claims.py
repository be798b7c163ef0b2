"""The paper's claims about other neurons (figures 6 and 7), with the rules that judge them."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from experiments.methods import REFRACTORY
from experiments.statistics import Interval, bootstrap, by_seed, mean, score, wins
from experiments.training import STARTS
from experiments.verdict import Claim, Finding, Results

COMPARABLE = (0.8, 1.25)
FLAT = 1e-9
"""Slopes up to this are rounding."""

ALPHA = 0.01
"""Level of the two-sided sign tests."""

_TWO = "gnm/PatternStream-v0, 2 classes"
_LIF = [f"LIF {n}" for n in REFRACTORY]


def _condition(start: str) -> str:
    return f"the initial weights are the {start} ones"


# --- F6: refractory period -----------------------------------------------------------------------


def ratios(results: xr.Dataset, classes: int, start: str) -> tuple[NDArray[Any], NDArray[Any]]:
    """Scores of the LIF neurons (seeds, refractory periods) and of the GNM (seeds, 1)."""
    scores = score(results).sel(classes=classes, start=start)
    return by_seed(scores.sel(learner=_LIF)), by_seed(scores.sel(learner=["GNM"]))


def ratio(lif: NDArray[Any], gnm: NDArray[Any]) -> Any:
    """Mean score of the LIF neurons over that of the GNM, one per refractory period."""
    return lif.mean(axis=0) / gnm.mean(axis=0)


def _slope(lif: NDArray[Any], gnm: NDArray[Any]) -> float:
    """Change of the ratio per bin of refractory period, by least squares."""
    return float(np.polyfit(REFRACTORY, ratio(lif, gnm), 1)[0])


def _ratio_at(refractory: int, lif: NDArray[Any], gnm: NDArray[Any]) -> Interval:
    return bootstrap(lambda a, b: float(ratio(a, b)[refractory]), lif, gnm)


def _ratio_words(start: str, lif: NDArray[Any], gnm: NDArray[Any], slope: Interval) -> str:
    first, last = _ratio_at(0, lif, gnm), _ratio_at(REFRACTORY[-1], lif, gnm)
    scaled = Interval(*(25 * end for end in slope))
    return (
        f"{start}: ratio {first:.2f} at 0, {last:.2f} at 25 bins, trend over 25 bins {scaled:+.2f}"
    )


def _judge_one_class(results: Results) -> Finding:
    held, words = {}, []
    for start in STARTS:
        lif, gnm = ratios(results["F6"], 1, start)
        slope = bootstrap(_slope, lif, gnm)
        values = ratio(lif, gnm)
        comparable = bool(np.all((values >= COMPARABLE[0]) & (values <= COMPARABLE[1])))
        held[_condition(start)] = comparable and slope.above(FLAT)
        words.append(
            _ratio_words(start, lif, gnm, slope)
            + f", all in {values.min():.2f} … {values.max():.2f}"
        )
    return Finding(all(held.values()), held, tuple(words))


def _judge_three_classes(results: Results) -> Finding:
    held, words = {}, []
    for start in STARTS:
        lif, gnm = ratios(results["F6"], 3, start)
        slope = bootstrap(_slope, lif, gnm)
        held[_condition(start)] = _ratio_at(0, lif, gnm).below(1) and slope.below(-FLAT)
        words.append(_ratio_words(start, lif, gnm, slope))
    return Finding(all(held.values()), held, tuple(words))


# --- F7: rules and neurons on two classes --------------------------------------------------------


def paired(results: xr.Dataset, start: str, learner: str) -> NDArray[Any]:
    """Scores by pattern seed, two classes."""
    return by_seed(score(results).sel(classes=2, start=start, learner=learner))


def _judge_mst(results: Results) -> Finding:
    held, words = {}, []
    for start in STARTS:
        found = wins(*(paired(results["F7"], start, m) for m in ("MST, ALL", "GNM, ALL")))
        held[_condition(start)] = found.share <= 0.16 and found.p < ALPHA
        words.append(f"{start}: MST ahead of GNM in {found}")
    return Finding(all(held.values()), held, tuple(words))


ET_FORMS = {"GNM, ET": "plain ET", "GNM, ET modulated": "modulated ET"}


def _judge_error_trace(results: Results) -> Finding:
    held, words = {}, []
    for learner, name in ET_FORMS.items():
        for start in STARTS:
            found = wins(*(paired(results["F7"], start, m) for m in (learner, "GNM, ALL")))
            held[name, start] = found.share >= 0.8 and found.p < ALPHA
            words.append(f"{start}: {name} ahead of ALL in {found}")
    return Finding(
        all(held["plain ET", start] for start in STARTS), _et_conditions(held), tuple(words)
    )


def _et_conditions(held: dict[tuple[str, str], bool]) -> dict[str, bool]:
    return {f"it is {name} from {start} initial weights": holds
            for (name, start), holds in held.items()}  # fmt: skip


def _judge_back_propagation(results: Results) -> Finding:
    shared = np.intersect1d(results["F7"]["pattern_seed"], results["BP"]["pattern_seed"])
    if not shared.size:
        return Finding(False, {}, ("no data: F7 and BP have no pattern seed in common",), False)
    network, others = (results[name].sel(pattern_seed=shared) for name in ("BP", "F7"))
    bp = by_seed(score(network).sel(classes=2))
    held, words = {}, [f"BP {mean(bp):,.0f} bins"]
    for learner, name in ET_FORMS.items():
        for start in STARTS:
            et = paired(others, start, learner)
            gain = mean(bp - et)
            held[name, start] = not gain.above(0)
            words.append(f"{start} {name}: BP − ET {gain:+,.0f}, BP ahead in {wins(bp, et)}")
    return Finding(all(held.values()), _et_conditions(held), tuple(words))


_F6_PROTOCOL = (
    "GNM (η 0, α 0.3) and LIF (α 0.3, refractory 0 … 25), ALL, 60,000 trials; "
    "matched and published initial weights"
)
_F7_PROTOCOL = (
    "η 0, α 0.3, τ_m 20, τ_s 5, 60,000 trials, every method on the same streams; "
    "matched and published initial weights"
)

CLAIMS = (
    Claim(
        "F6a",
        "Fig. 6",
        "One class: LIF over GNM is comparable to 1 and rises with the refractory period",
        _F6_PROTOCOL,
        f"reproduced if the ratio of means stays in {COMPARABLE[0]:g} … {COMPARABLE[1]:g} for "
        "every "
        "refractory period and its least-squares slope has an interval above 0 (bootstrap over "
        "seeds), from both starts; conditional on the start",
        ("F6",),
        "gnm/PatternStream-v0, 1 class",
        _judge_one_class,
    ),
    Claim(
        "F6b",
        "Fig. 6",
        "Three classes: LIF over GNM is below 1 even without a refractory period, and falls "
        "with it",
        _F6_PROTOCOL,
        "reproduced if the ratio at 0 has an interval below 1 and the slope one below 0 (bootstrap "
        "over seeds), from both starts; conditional on the start",
        ("F6",),
        "gnm/PatternStream-v0, 3 classes",
        _judge_three_classes,
    ),
    Claim(
        "F7a",
        "Fig. 7",
        "Two classes, ALL: the MST beats the GNM in 3 runs of 50",
        _F7_PROTOCOL,
        "reproduced if the MST is ahead in at most 16 % of the paired seeds (8 of 50) with "
        "two-sided "
        f"sign test p < {ALPHA:g}, from both starts; conditional on the start",
        ("F7",),
        _TWO,
        _judge_mst,
    ),
    Claim(
        "F7b",
        "Fig. 7",
        "Two classes, GNM: ET beats ALL in 46 runs of 50",
        _F7_PROTOCOL,
        f"reproduced if plain ET is ahead in at least 80 % of the paired seeds (40 of 50) with "
        f"two-sided sign test p < {ALPHA:g}, from both starts; conditional on start and form of ET",
        ("F7",),
        _TWO,
        _judge_error_trace,
    ),
    Claim(
        "F7c",
        "Fig. 7",
        "Two classes: BP with 10 hidden neurons brings no benefit over ET",
        _F7_PROTOCOL + "; BP from its own initial weights",
        "reproduced if the interval of the mean paired difference BP − ET does not lie above 0 "
        "(bootstrap over seeds), for plain and modulated ET from both starts; conditional on form "
        "and start",
        ("F7", "BP"),
        _TWO,
        _judge_back_propagation,
    ),
)
