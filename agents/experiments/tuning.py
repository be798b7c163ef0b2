"""TUNING: one search, with the same number of tries, for every neuron and every rule.

An entry is a neuron with a rule. Each is tried with `TRIES` settings: the usual ones, and the
points of one Sobol sequence, the same for all, stretched over the ranges that `_try` names. All
tries are scored on pattern seeds 0 to 7 after a third of the league's trials; the usual settings
and the `KEPT − 1` best others then on pattern seeds 8 to 15 after all of them, and the best of
these is chosen. A score is the mean over two and three classes. `chosen_settings` reads what the
search has found from `league_settings.json` beside this file; `choose` makes that file's content
from a store.
"""

from __future__ import annotations

import functools
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.experiments.design import Axis, Experiment, Setting
from agents.experiments.former_names import current
from agents.experiments.statistics import score
from agents.experiments.training import class_counts, pattern_seeds, training
from agents.registry import find_rule
from gnm_env.files import atomic_write

if TYPE_CHECKING:
    import xarray as xr

TRIES = 32
KEPT = 8
CHOSEN = Path(__file__).with_name("league_settings.json")


class Stage(NamedTuple):
    """One of the two stages of the search; the league reports on other pattern seeds."""

    seeds: Sequence[int]
    trials: int
    classes: tuple[int, ...]


SIZES = {
    "quick": (Stage(range(1), 20_000, (2,)), Stage(range(1, 2), 60_000, (2,))),
    "full": (Stage(range(8), 20_000, (2, 3)), Stage(range(8, 16), 60_000, (2, 3))),
}
"""The stage in which all tries are scored, and the one in which those are that were kept."""


class RuleEntry(NamedTuple):
    """A rule as it takes part."""

    feedback: str
    """Its class: "A", "A′", "B", "C" or "U", see docs/rules.md."""
    setting: Setting


NEURONS: dict[str, Setting] = {
    "GNM": {"neuron": "gnm"},
    "LIF": {"neuron": "lif"},
    "MST": {"neuron": "mst"},
}

RULES: dict[str, RuleEntry] = {
    "ALL": RuleEntry("A", {"rule": "all"}),
    "CriticalThreshold": RuleEntry("A", {"rule": "critical"}),
    "MPDAL": RuleEntry("A", {"rule": "mpdal"}),
    "CriticalThreshold, amount": RuleEntry("A′", {"rule": "critical", "amount": True}),
    "SurrogateGradient, count": RuleEntry("A′", {"rule": "surrogate", "on_count": True}),
    "MSTDPET": RuleEntry("A′", {"rule": "mstdpet"}),
    "PolicyGradient": RuleEntry("A′", {"rule": "policy-gradient"}),
    "ET": RuleEntry("B", {"rule": "et"}),
    "ET, modulated": RuleEntry("B", {"rule": "et", "modulate": True}),
    "PeakError": RuleEntry("B", {"rule": "peak-error"}),
    "SurrogateGradient": RuleEntry("B", {"rule": "surrogate"}),
    "ReSuMe": RuleEntry("C", {"rule": "resume"}),
    "PSD": RuleEntry("C", {"rule": "psd"}),
    "SPAN": RuleEntry("C", {"rule": "span"}),
    "Chronotron": RuleEntry("C", {"rule": "chronotron"}),
    "STDP": RuleEntry("U", {"rule": "stdp"}),
}
"""Every rule for a single neuron but the tempotron, whose labels are 0 and 1 only."""

ONLY_ON = {"PolicyGradient": ("GNM",)}
"""Neurons of the rules that do not go with all: spikes can be drawn where nothing resets."""

NETWORK = "network, BP"


def entries(
    neurons: Sequence[str] | None = None, rules: Sequence[str] | None = None
) -> dict[str, Setting]:
    """Neuron and rule of each entry by its name, such as "GNM, PeakError"; the network last.

    Args:
        neurons: names in NEURONS; None: all.
        rules: names in RULES, upper or lower case, or the registered names of rules, which stand
            for all their variants; None: all.

    Raises ValueError for a name that there is not, or if nothing is left.
    """
    wanted_neurons = _named(neurons, {name: (name.lower(),) for name in NEURONS}, "neuron")
    known = {name: (name.lower(), entry.setting["rule"]) for name, entry in RULES.items()}
    wanted_rules = _named(rules, known, "rule")
    found: dict[str, Setting] = {
        f"{neuron}, {rule}": {**NEURONS[neuron], **RULES[rule].setting}
        for neuron in wanted_neurons
        for rule in wanted_rules
        if neuron in ONLY_ON.get(rule, NEURONS)
    }
    if neurons is None and rules is None:
        found[NETWORK] = {"neuron": "network", "rule": "bp"}
    if not found:
        raise ValueError(
            f"no entry is left of the rules {', '.join(wanted_rules)} on the neurons "
            f"{', '.join(wanted_neurons)}: PolicyGradient goes with the GNM only"
        )
    return found


def _named(
    wanted: Sequence[str] | None, known: Mapping[str, tuple[str, ...]], what: str
) -> list[str]:
    for word in wanted or ():
        if not any(word.lower() in names for names in known.values()):
            raise ValueError(
                f"there is no {what} {word!r} in the league: choose among {'; '.join(known)}"
            )
    words = {word.lower() for word in wanted or ()}
    return [name for name, names in known.items() if wanted is None or words & set(names)]


def rule_of(entry: str) -> str:
    """The rule of an entry."""
    return entry.partition(", ")[2]


def folder_name(entry: str) -> str:
    """The name of an entry as that of a folder."""
    words = entry.lower().replace("′", "").replace(",", " ").split()
    return "-".join(words)


def feedback_of(entry: str) -> str:
    """The class of feedback of an entry."""
    return "B" if entry == NETWORK else RULES[rule_of(entry)].feedback


# --- the search ----------------------------------------------------------------------------------

FALLING = "falling"
"""Setting that stands for a learning rate which falls to 0 over the whole training."""


@functools.cache
def _points() -> NDArray[np.float64]:
    """(TRIES, 5) in 0 … 1, evenly spread; the same for every entry. Row 0 is not used."""
    from scipy.stats import qmc

    return np.asarray(qmc.Sobol(5, scramble=True, rng=0).random(TRIES))


def tries(entry: Setting) -> list[Setting]:
    """The settings that are tried for an entry, the usual ones first."""
    usual = {**entry, "start": "matched", FALLING: False}
    if entry["neuron"] != "network" and entry["rule"] not in ("all", "et", "stdp"):
        usual["weight_bounds"] = None  # as their docstrings say; others keep the paper's 0 … 1
    return [usual, *(_try(entry, point) for point in _points()[1:])]


def _try(entry: Setting, point: NDArray[np.float64]) -> Setting:
    """One point of the search as settings of an entry, numbers to two digits.

    The decay α from 0.06 to 0.4, or τ_m from 4 to 30 bins with τ_s = τ_m/4; the learning rate from
    0.3 to 20 times the rule's own; weights in 0 … 1, in ±0.4, or unbounded; the smaller or the
    larger initial weights; a rate that falls to 0, three times in four, or a constant one.
    """
    found = {**entry, **_rates(entry["rule"], point[1]), FALLING: bool(point[4] < 0.75)}
    if entry["neuron"] == "mst":
        tau = _between(point[0], 4.0, 30.0)
        found |= {"tau_m": tau, "tau_s": tau / 4.0}
    else:
        found["alpha"] = _between(point[0], 0.06, 0.4)
    larger = bool(point[3] >= 0.5)
    if entry["neuron"] == "network":  # has no bounds, and one wide start
        return {**found, "initial_weight": 0.6 if larger else 0.3}
    bounds = ((0.0, 1.0), (-0.4, 0.4), None)[int(3 * point[2])]
    return {**found, "weight_bounds": bounds, "start": "wide" if larger else "matched"}


def _rates(rule: str, share: float) -> Setting:
    """The learning rates of a rule; both of backpropagation move together."""
    usual = find_rule(rule)()
    names = ("learning_rate_hidden", "learning_rate_output") if rule == "bp" else ("learning_rate",)
    rates = {name: getattr(usual, name) for name in names}
    return {name: _between(share, 0.3 * rate, 20.0 * rate) for name, rate in rates.items()}


def _between(share: float, low: float, high: float) -> float:
    """The number that lies so far between two on a logarithmic scale, to two digits."""
    return float(f"{low * (high / low) ** share:.2g}")


def for_trials(setting: Mapping[str, Any], trials: int) -> Setting:
    """Settings of the search as those of a training of so many trials."""
    found = {key: value for key, value in setting.items() if key != FALLING}
    bounds = found.get("weight_bounds")
    if bounds is not None:
        found["weight_bounds"] = tuple(bounds)
    return {**found, "decay_trials": trials} if setting[FALLING] else found


def search(name: str, stage: Stage, numbers: Sequence[int] = tuple(range(TRIES))) -> Experiment:
    """One stage of the search for the settings of an entry: the tries of these `numbers`."""
    tried = tries(entries()[name])
    rows = {number: for_trials(tried[number], stage.trials) for number in numbers}
    # As many side by side as fill the lanes which the league needs: one set of compiled loops
    # serves both.
    axis = Axis.named("try", rows, KEPT, "number of the try; 0, the usual settings")
    axes = (pattern_seeds(stage.seeds), class_counts(*stage.classes), axis)
    common = {key: tried[0][key] for key in ("neuron", "rule")}
    return training(f"TUNING {name}", "Tries of one entry", axes, trials=stage.trials, **common)


def kept_tries(name: str, results: xr.Dataset) -> tuple[int, ...]:
    """The tries that the first stage leaves: the usual settings and the best others, in order."""
    means, _ = _means(name, results)
    others = sorted(means.keys() - {0}, key=lambda number: -means[number])
    return (0, *sorted(others[: KEPT - 1]))


def choose(name: str, results: xr.Dataset) -> dict[str, Any]:
    """The best settings of an entry by what the store of the second stage holds."""
    means, finished = _means(name, results)
    best = max(means, key=lambda number: means[number])
    return {
        "settings": tries(entries()[name])[best],
        "try": best,
        "score": round(means[best]),
        "usual": round(means[0]),
        "pattern_seeds": finished["pattern_seed"].values.tolist(),
        "classes": finished["classes"].values.tolist(),
    }


def _means(name: str, results: xr.Dataset) -> tuple[dict[int, float], xr.Dataset]:
    """Mean score by try over the pattern seeds that are finished, and what is finished.

    Raises ValueError if none is.
    """
    survived = results["survived"].transpose("pattern_seed", ...)
    done = (survived >= 0).all(survived.dims[1:]).to_numpy()
    if not done.any():
        raise ValueError(f"the search for {name} has not finished one pattern seed: run it again")
    finished = results.isel(pattern_seed=np.flatnonzero(done))
    means = score(finished).mean(("pattern_seed", "classes"))
    numbers = finished["try"].values.tolist()
    return dict(zip(numbers, means.to_numpy().tolist(), strict=True)), finished


def save_choices(found: Mapping[str, Mapping[str, Any]], path: Path) -> None:
    """Write what `choose` found for each entry; entries that it says nothing of stay as they are.

    One line an entry, so that changes can be read.
    """
    known = dict(found)
    if path.exists():
        known = current(json.loads(path.read_text("utf-8"))["chosen"]) | known
    chosen = {name: known[name] for name in entries() if name in known}
    with atomic_write(path) as file:
        file.write(as_json({"search": {"tries": TRIES, "kept": KEPT}, "chosen": chosen}).encode())


def as_json(value: Mapping[str, Any]) -> str:
    """JSON with one line for each entry of the second level, so that changes can be read."""
    parts = []
    for name, inner in value.items():
        lines = [f"  {_json(key)}: {_json(one)}" for key, one in inner.items()]
        parts.append(f" {_json(name)}: {{\n" + ",\n".join(lines) + "\n }")
    return "{\n" + ",\n".join(parts) + "\n}\n"


def _json(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False)


def chosen_settings(path: Path = CHOSEN) -> dict[str, Setting]:
    """The settings of each entry that the search chose. ValueError if the file is not there."""
    if not path.exists():
        raise ValueError(f"{path} is not there: run `gnm league --part rules --tune` to make it")
    found = current(json.loads(path.read_text("utf-8"))["chosen"])
    return {name: entry["settings"] for name, entry in found.items()}
