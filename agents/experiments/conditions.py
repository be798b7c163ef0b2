"""The conditions under which a claim of the paper is judged: what it leaves open, set four ways.

    matched   weights that drive all neurons to about the same mean potential; all else as here
    wide      the same from the larger initial weights of the authors' code
    authors   the values of the authors' code, https://github.com/jf330/HystNeuron at 5d18fdb, by
              file and line
    D reading the readout D, the paper's formula for the eligibility taken literally

Each is whole: nothing is left to a default that another condition could change unseen.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

from agents.experiments.design import Setting
from agents.experiments.training import WIDE_START
from agents.learning.error_trace import ErrorTrace
from agents.neurons.gnm import GNM
from agents.neurons.lif import LIF
from agents.neurons.mst import MST
from agents.registry import find_rule
from gnm_env.checks import MAX_BINS, choice, flag, real, whole

NEURONS = ("gnm", "lif", "mst")
PAPER_TRIALS = 60_000
CAPS = (1_000, 10_000)
"""Bins at which a run of the measure ends. The paper gives none; its figures end near 1,000."""


@dataclass(frozen=True)
class Treatment:
    """How one kind of neuron is trained. Raises ValueError if a value is out of range.

    Attributes:
        initial_weight: upper end of the uniform initial weights, in units of the threshold.
        weight_bounds: least and greatest weight, or None for no bounds.
        trace_decay: factor by which the presynaptic trace shrinks in a bin; 0 reads the paper's
            formula for ε literally, None means the neuron's own response to a spike.
        learning_rate: λ, per trial.
        momentum: share of the last change that is added to the next.
        fraction: share of the inputs that aggregate-label learning changes.
        trials: of a training.
        sources: where each value stands in the authors' code, "file:line" by name of the field.
    """

    initial_weight: float
    weight_bounds: tuple[float, float] | None = (0.0, 1.0)
    trace_decay: float | None = None
    learning_rate: float = 1e-4
    momentum: float = 0.2
    fraction: float = 0.1
    trials: int = PAPER_TRIALS
    sources: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        real("initial_weight", self.initial_weight, above=0.0)
        if self.weight_bounds is not None:
            low, high = (real("weight_bounds", end) for end in self.weight_bounds)
            if not low < high:
                raise ValueError(f"weight_bounds must ascend, got {self.weight_bounds}")
        if self.trace_decay is not None:
            real("trace_decay", self.trace_decay, low=0.0, high=1.0)
        real("learning_rate", self.learning_rate, above=0.0)
        real("momentum", self.momentum, low=0.0, high=1.0)
        real("fraction", self.fraction, above=0.0, high=1.0)
        whole("trials", self.trials, low=1)
        wrong = sorted(set(self.sources) - {one.name for one in fields(self)})
        if wrong:
            raise ValueError(f"sources must name fields of a treatment, got {wrong[0]!r}")


@dataclass(frozen=True)
class Condition:
    """A full set of the choices that the paper leaves open.

    Raises ValueError if a value is out of range.

    Attributes:
        name: in settings and in the report.
        words: what it is.
        readout: of the GNM, "V" or "D".
        modulate: whether the error trace of ET is multiplied by the potential.
        gnm, lif, mst: how each neuron is trained.
        caps: bins at which a run of the measure ends.
        sources: where `readout` and `modulate` stand in the authors' code.
    """

    name: str
    words: str
    readout: str
    modulate: bool
    gnm: Treatment
    lif: Treatment
    mst: Treatment
    caps: tuple[int, ...] = CAPS
    sources: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        choice("readout", self.readout, ("V", "D"))
        flag("modulate", self.modulate)
        if not self.caps:
            raise ValueError("caps must hold at least one cap, got none")
        for cap in self.caps:
            whole("caps", cap, low=1, high=MAX_BINS)

    def treatment(self, neuron: str) -> Treatment:
        """How a neuron is trained. ValueError for one that the condition says nothing of."""
        if neuron not in NEURONS:
            raise ValueError(
                f"a condition says how {', '.join(NEURONS)} are trained, not {neuron!r}: give its "
                "settings one by one"
            )
        found: Treatment = getattr(self, neuron)
        return found

    def settings(self, neuron: str, rule: str = "all", **further: Any) -> Setting:
        """The settings of one neuron that `agents.experiments.training.training` takes.

        The number of trials is not among them, since neurons side by side share it: see
        `treatment`. `further` adds settings, or replaces some.
        """
        one = self.treatment(neuron)
        found = {
            "neuron": neuron,
            "rule": rule,
            "initial_weight": one.initial_weight,
            "weight_bounds": one.weight_bounds,
        }
        if neuron == "gnm":
            found["readout"] = self.readout
        taken = {one.name for one in fields(find_rule(rule))}
        for name in ("trace_decay", "learning_rate", "momentum", "fraction"):
            if name in taken:
                found[name] = getattr(one, name)
        if rule == ErrorTrace.name:
            found["modulate"] = self.modulate
        return {**found, **further}


_MATCHED = {kind.name: kind.default_initial_weight for kind in (GNM, LIF, MST)}

MATCHED = Condition(
    "matched",
    "initial weights that drive all neurons to about the same mean potential",
    "V",
    modulate=False,
    gnm=Treatment(_MATCHED["gnm"]),
    lif=Treatment(_MATCHED["lif"]),
    mst=Treatment(_MATCHED["mst"]),
)

WIDE = Condition(
    "wide",
    "the larger initial weights of the authors' code, all else as in matched",
    "V",
    modulate=False,
    gnm=Treatment(WIDE_START["gnm"]),
    lif=Treatment(WIDE_START["lif"]),
    mst=Treatment(WIDE_START["mst"]),
)

AUTHORS = Condition(
    "authors",
    "the values of the authors' code as it stands",
    "D",
    modulate=True,
    sources={"readout": "tests.py:462", "modulate": "models/hyst_neuron.py:88"},
    gnm=Treatment(
        WIDE_START["gnm"],
        weight_bounds=None,
        trace_decay=0.2,
        fraction=0.2,
        trials=25_000,
        sources={
            "initial_weight": "tests.py:456",
            "weight_bounds": "models/hyst_neuron.py:118",
            "trace_decay": "models/hyst_neuron.py:6, tests.py:554, utils/training.py:10",
            "learning_rate": "tests.py:453",
            "momentum": "models/hyst_neuron.py:33",
            "fraction": "tests.py:454",
            "trials": "tests.py:455",
        },
    ),
    lif=Treatment(
        WIDE_START["lif"],
        weight_bounds=(0.0, 1.0),
        trace_decay=0.0,
        learning_rate=5e-4,
        momentum=0.3,
        fraction=0.2,
        trials=30_000,
        sources={
            "initial_weight": "utils/other_tests.py:33",
            "weight_bounds": "models/LiF_neuron.py:94",
            "trace_decay": "utils/other_tests.py:145",
            "learning_rate": "utils/other_tests.py:30",
            "momentum": "models/LiF_neuron.py:20",
            "fraction": "utils/other_tests.py:31",
            "trials": "utils/other_tests.py:32",
        },
    ),
    mst=Treatment(
        WIDE_START["mst"],
        weight_bounds=None,
        trace_decay=None,
        momentum=0.4,
        fraction=0.1,
        trials=20_000,
        sources={
            "initial_weight": "utils/other_tests.py:716",
            "weight_bounds": "models/Tempotron_neuron.py:156",
            "trace_decay": "models/Tempotron_neuron.py:65",
            "learning_rate": "utils/other_tests.py:713",
            "momentum": "models/Tempotron_neuron.py:41",
            "fraction": "utils/other_tests.py:714",
            "trials": "utils/other_tests.py:715",
        },
    ),
)

D_READING = Condition(
    "D reading",
    "readout D, and the eligibility as the paper's formula has it, spikes without a trace",
    "D",
    modulate=True,
    gnm=Treatment(WIDE_START["gnm"], trace_decay=0.0),
    lif=Treatment(0.3, trace_decay=0.0),
    mst=Treatment(WIDE_START["mst"], trace_decay=0.0),
    caps=(1_000,),
)

CONDITIONS = {one.name: one for one in (MATCHED, WIDE, AUTHORS, D_READING)}


def condition(name: str) -> Condition:
    """The condition of that name. Raises ValueError if there is none."""
    if name not in CONDITIONS:
        raise ValueError(f"there is no condition {name!r}: choose one of {', '.join(CONDITIONS)}")
    return CONDITIONS[name]


def table() -> list[str]:
    """The conditions as the lines of a Markdown table, with where the authors' values stand."""
    head = [*CONDITIONS, "the authors' value stands in"]
    lines = [f"| | {' | '.join(head)} |", "|---" * (len(head) + 1) + "|"]

    def row(words: str, cells: list[str], source: str) -> None:
        lines.append(f"| {words} | {' | '.join(cells)} | {source} |")

    every = CONDITIONS.values()
    row("readout of the GNM", [one.readout for one in every], AUTHORS.sources["readout"])
    row(
        "ET multiplied by the potential",
        ["yes" if one.modulate else "no" for one in every],
        AUTHORS.sources["modulate"],
    )
    for neuron in NEURONS:
        for name, words in _ROWS.items():
            values = [getattr(one.treatment(neuron), name) for one in every]
            source = AUTHORS.treatment(neuron).sources[name]
            row(f"{neuron.upper()}: {words}", [_shown(name, value) for value in values], source)
    row("caps", [", ".join(f"{cap:,}" for cap in one.caps) for one in every], "none given")
    return lines


_ROWS = {
    "initial_weight": "initial weights up to",
    "weight_bounds": "weight bounds",
    "trace_decay": "trace in ε, factor per bin",
    "learning_rate": "λ",
    "momentum": "momentum",
    "fraction": "top fraction (ALL)",
    "trials": "trials",
}


def _shown(name: str, value: Any) -> str:
    if name == "weight_bounds":
        return "none" if value is None else f"{value[0]:g} … {value[1]:g}"
    if name == "trace_decay" and value is None:
        return "the neuron's own"
    return f"{value:,}" if name == "trials" else f"{value:g}"
