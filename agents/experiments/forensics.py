"""Forensics: which single protocol, of all that the paper leaves open, gives its numbers back.

The search is fixed in advance. Every way of training below is tried on a few pattern seeds
(coarse); the best quarter goes on to more of them (fine); the best three protocols, and the four
conditions of `agents.experiments.conditions`, are then scored on pattern seeds that nothing was
chosen by (confirmed). All by one rule, `NUMBERS`: each number of the paper has a band in which it
counts as come back, and a distance beyond it at which nothing is left of its point; a protocol's
score is the sum of its points.

Neurons that several protocols share are trained once, and all of a pattern seed hear one stream.
"""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents import noisy_performance, train_many
from agents.experiments.conditions import AUTHORS, CONDITIONS, Condition, Treatment
from agents.experiments.design import Axis, Block, Experiment, Setting, Variable
from agents.experiments.statistics import Interval, bootstrap, by_seed
from agents.experiments.training import make_agent, pattern_seeds, protocol, task_of, training_seed
from gnm_env import Patterns, Task
from gnm_env.levels import evaluation_seed

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]

# --- what is searched ----------------------------------------------------------------------------

STARTS = {
    "0.1, 0.1, 0.02": (0.1, 0.1, 0.02),
    "0.3, 0.5, 0.2": (0.3, 0.5, 0.2),
    "0.3, 0.3, 0.2": (0.3, 0.3, 0.2),
    "0.1 for all": (0.1, 0.1, 0.1),
    "0.2 for all": (0.2, 0.2, 0.2),
    "0.3 for all": (0.3, 0.3, 0.3),
}
"""Upper ends of the initial weights of GNM, LIF and MST."""

BOUNDS: dict[str, tuple[float, float] | None] = {"0 … 1": (0.0, 1.0), "none": None}
TRACES = {"own": None, "literal": 0.0, "0.2": 0.2}

RATES = {
    "1e-4": ((1e-4, 0.2), (1e-4, 0.2), (1e-4, 0.2)),
    "5e-4": ((5e-4, 0.2), (5e-4, 0.2), (5e-4, 0.2)),
    "authors": tuple(
        (one.learning_rate, one.momentum) for one in (AUTHORS.gnm, AUTHORS.lif, AUTHORS.mst)
    ),
}
"""λ and momentum of GNM, LIF and MST."""

TRIALS = (20_000, 60_000)
CAPS = (1_000, 10_000)


class Way(NamedTuple):
    """One way of training, by the names of its choices."""

    readout: str
    start: str
    bounds: str
    trace: str
    rates: str
    fraction: float

    @property
    def words(self) -> str:
        """The choices in words."""
        return (
            f"readout {self.readout}, initial weights {self.start}, bounds {self.bounds}, trace "
            f"{self.trace}, λ {self.rates}, fraction {self.fraction:g}"
        )


class Protocol(NamedTuple):
    """A whole protocol: a condition, and the cap at which a run of the measure ends."""

    condition: Condition
    cap: int

    @property
    def words(self) -> str:
        """Its name with the cap."""
        return f"{self.condition.name}, cap {self.cap:,}"


@dataclass(frozen=True)
class Size:
    """How much is done.

    Attributes:
        coarse, fine, confirmed: pattern seeds of the three stages.
        ways: the ways of training that are tried.
        runs: of the measure, in the search and in the confirmation.
        shorten: every number of trials is divided by this; for tests.
    """

    coarse: tuple[int, ...]
    fine: tuple[int, ...]
    confirmed: tuple[int, ...]
    ways: tuple[Way, ...]
    runs: tuple[int, int]
    shorten: int = 1


def _ways(
    bounds: Iterable[str] = BOUNDS, rates: Iterable[str] = RATES, fractions: Iterable[float] = ()
) -> tuple[Way, ...]:
    return tuple(
        Way(*choices)
        for choices in itertools.product(
            ("V", "D"), STARTS, bounds, TRACES, rates, tuple(fractions) or (0.1, 0.2)
        )
    )


SIZES = {
    "quick": Size((0,), (1,), (500, 501), _ways(["0 … 1"], ["1e-4", "5e-4"], (0.1,)), (20, 50)),
    "paper": Size(tuple(range(3)), tuple(range(3, 10)), tuple(range(500, 548)), _ways(), (50, 100)),
}
KEPT_SHARE = 4
"""Of the ways of training one in so many goes on from the coarse stage to the fine one."""
BEST = 3
"""So many protocols are confirmed, each of another way of training."""


def readings(way: Way, size: Size) -> list[Protocol]:
    """The protocols that share a way of training: form of ET, number of trials, and cap."""
    found = []
    for modulate, trials, cap in itertools.product((False, True), TRIALS, CAPS):
        gnm, lif, mst = (
            Treatment(
                weight,
                BOUNDS[way.bounds],
                TRACES[way.trace],
                rate,
                momentum,
                way.fraction,
                trials // size.shorten,
            )
            for weight, (rate, momentum) in zip(STARTS[way.start], RATES[way.rates], strict=True)
        )
        form = "modulated" if modulate else "plain"
        name = f"{way.words}, ET {form}, {trials:,} trials"
        found.append(
            Protocol(Condition(name, "", way.readout, modulate, gnm, lif, mst, (cap,)), cap)
        )
    return found


def named(size: Size) -> list[Protocol]:
    """The conditions of the reproduction as protocols, one for each of their caps."""
    return [
        Protocol(_shortened(one, size.shorten), cap)
        for one in CONDITIONS.values()
        for cap in one.caps
    ]


def _shortened(one: Condition, by: int) -> Condition:
    parts = {name: getattr(one, name) for name in ("gnm", "lif", "mst")}
    return replace(one, **{n: replace(part, trials=part.trials // by) for n, part in parts.items()})


# --- the neurons that a protocol is known by -----------------------------------------------------


class Probe(NamedTuple):
    """A neuron whose score enters some number."""

    classes: int
    neuron: str
    rule: str
    further: Mapping[str, Any]


ALPHAS = (0.05, 0.08, 0.15, 0.2, 0.3, 0.4, 0.6, 1.0)
FOUR_ALPHAS = (0.15, 0.2, 0.3, 0.5)
PROBES: dict[str, Probe] = {
    **{f"GNM 1 α {a:g}": Probe(1, "gnm", "all", {"alpha": a}) for a in ALPHAS},
    "GNM 1 on the line": Probe(1, "gnm", "all", {"alpha": 0.6, "eta": 0.5}),
    "GNM 1 η 1": Probe(1, "gnm", "all", {"alpha": 0.3, "eta": 1.0}),
    "MST 1": Probe(1, "mst", "all", {}),
    "LIF 1, 0": Probe(1, "lif", "all", {"refractory": 0}),
    "LIF 1, 25": Probe(1, "lif", "all", {"refractory": 25}),
    "GNM 2": Probe(2, "gnm", "all", {"alpha": 0.3}),
    "ET 2": Probe(2, "gnm", "et", {"alpha": 0.3}),
    "MST 2": Probe(2, "mst", "all", {}),
    "GNM 3": Probe(3, "gnm", "all", {"alpha": 0.3}),
    "MST 3": Probe(3, "mst", "all", {}),
    "LIF 3, 0": Probe(3, "lif", "all", {"refractory": 0}),
    "LIF 3, 25": Probe(3, "lif", "all", {"refractory": 25}),
    **{f"GNM 4 α {a:g}": Probe(4, "gnm", "all", {"alpha": a}) for a in FOUR_ALPHAS},
}
PLACE = {name: place for place, name in enumerate(PROBES)}


def setting(condition: Condition, probe: Probe) -> Setting:
    """The settings of one neuron under a condition, the number of trials left out."""
    found = condition.settings(probe.neuron, probe.rule, **probe.further)
    return {"classes": probe.classes, **found}


AFTER = "after"
"""Setting of a neuron: the numbers of trials after which it is scored, where not all are needed."""


def neurons(protocols: Iterable[Protocol]) -> list[Setting]:
    """Every neuron that the protocols need, each once, by number of classes."""
    found: dict[str, Setting] = {}
    after: dict[str, set[int]] = {}
    for protocol_ in protocols:
        for probe in PROBES.values():
            one = setting(protocol_.condition, probe)
            found[_key(one)] = one
            trials = protocol_.condition.treatment(probe.neuron).trials
            after.setdefault(_key(one), set()).add(trials)
    every = set().union(*after.values())
    for key, one in found.items():
        if after[key] != every:
            one[AFTER] = sorted(after[key])
    return [found[key] for key in sorted(found, key=lambda key: (found[key]["classes"], key))]


def _key(one: Setting) -> str:
    return json.dumps({name: one[name] for name in one if name != AFTER}, sort_keys=True)


# --- training ------------------------------------------------------------------------------------

MOST = max(CAPS)
SURVIVED = Variable(
    "survived",
    "int32",
    "bins",
    "bins survived before the first mistake, learning off, after each number of trials",
    ("checkpoint", "run"),
)
_SIDE_BY_SIDE = 600
"""Neurons a block: some half a minute of work."""


def stage(
    name: str, title: str, protocols: Sequence[Protocol], seeds: Sequence[int], runs: int
) -> Experiment:
    """The experiment that trains what the protocols need on these pattern seeds."""
    settings = neurons(protocols)
    rows = dict(enumerate(settings))
    axes = (
        pattern_seeds(seeds),
        Axis.named("neuron", rows, _SIDE_BY_SIDE, "neuron, by its settings"),
    )
    checkpoints = sorted(
        {one.condition.treatment(p.neuron).trials for one in protocols for p in PROBES.values()}
    )
    common = {"runs": runs, "cap": MOST, "checkpoints": checkpoints}
    return Experiment(
        name,
        title,
        axes,
        common,
        train_and_score,
        (SURVIVED,),
        {"checkpoint": len(checkpoints), "run": runs},
        protocol(Task(), settings),
    )


def train_and_score(block: Block) -> dict[str, NDArray[Any]]:
    """Train the block's neurons on the stream of their pattern seed; score at their checkpoints.

    Bins are −1 at checkpoints that a neuron does not need; after its last it is left alone.
    """
    settings, shared = block.settings, block.settings[0]
    checkpoints, runs, cap = shared["checkpoints"], shared["runs"], shared["cap"]
    seed = shared["pattern_seed"]
    survived = np.full((len(settings), len(checkpoints), runs), -1, np.int32)
    for classes in sorted({one["classes"] for one in settings}):
        places = [k for k, one in enumerate(settings) if one["classes"] == classes]
        task = task_of({"classes": classes})
        patterns = Patterns.draw(task, seed)
        agents = {k: make_agent(settings[k], task) for k in places}
        after = {k: list(settings[k].get(AFTER, ())) or checkpoints for k in places}
        stream = np.random.default_rng(training_seed(classes, seed))
        done = 0
        for at, trials in enumerate(checkpoints):
            learning = [agents[k] for k in places if max(after[k]) >= trials]
            train_many(learning, task, patterns, trials - done, stream, threads=1)
            done = trials
            due = [k for k in places if trials in after[k]]
            if due:
                survived[due, at] = noisy_performance(
                    [agents[k] for k in due], task, patterns, runs, cap,
                    evaluation_seed(classes, seed), threads=1,
                )  # fmt: skip
    return block.shaped(survived=survived)


class Scores:
    """The scores of a stage, by neuron, checkpoint and cap."""

    def __init__(self, results: xr.Dataset) -> None:
        described = results.attrs["settings"]
        self._place = {_key(one): k for k, one in enumerate(described["sets"]["neuron"])}
        self._checkpoint = {t: k for k, t in enumerate(described["common"]["checkpoints"])}
        values = by_seed(results["survived"], "neuron", "checkpoint", "run")
        self._at = {cap: np.minimum(values, cap).mean(-1) for cap in CAPS}

    def of(self, protocol_: Protocol) -> Array:
        """Scores (pattern seeds, probes) of one protocol."""
        condition, columns = protocol_.condition, []
        for probe in PROBES.values():
            place = self._place[_key(setting(condition, probe))]
            checkpoint = self._checkpoint[condition.treatment(probe.neuron).trials]
            columns.append(self._at[protocol_.cap][:, place, checkpoint])
        return np.stack(columns, axis=-1)


# --- the rule ------------------------------------------------------------------------------------

Value = Callable[[Array], float]
"""A number of the paper from scores (pattern seeds, probes)."""


@dataclass(frozen=True)
class Number:
    """A number or statement of the paper, and when it counts as come back.

    Attributes:
        id: of the claim that it belongs to.
        words: what it is.
        paper: what the paper has, in its words.
        value: ours from scores.
        low, high: ends of the band in which it has come back.
        far: factor beyond the band at which nothing is left of its point.
        at: the paper's own number, or None where it has words only.
        share: whether it is a share of runs, compared by arcsin √x with a distance of 0.3 in place
            of a factor.
    """

    id: str
    words: str
    paper: str
    value: Value
    low: float
    high: float
    far: float = 2.0
    at: float | None = None
    share: bool = False

    def back(self, value: float) -> bool:
        """Whether ours lies in the band."""
        return self.low <= value <= self.high

    def point(self, value: float) -> float:
        """1 in the band, falling to 0 at the distance `far` beyond it."""
        if self.back(value):
            return 1.0
        edge = self.low if value < self.low else self.high
        if self.share:
            distance = abs(np.arcsin(np.sqrt(value)) - np.arcsin(np.sqrt(edge))) / 0.3
        else:
            distance = abs(np.log(max(value, 1e-6) / max(edge, 1e-6))) / np.log(self.far)
        return float(max(0.0, 1.0 - distance))


def _mean(name: str) -> Value:
    return lambda scores: float(scores[:, PLACE[name]].mean())


def _ratio(above: str, below: str) -> Value:
    return lambda scores: _mean(above)(scores) / max(_mean(below)(scores), 1.0)


def _one_class(scores: Array) -> Array:
    """Mean over seeds at each of `ALPHAS`, one class, η = 0."""
    found: Array = scores[:, [PLACE[f"GNM 1 α {a:g}"] for a in ALPHAS]].mean(0)
    return found


def _of_best(name: str) -> Value:
    return lambda scores: _mean(name)(scores) / max(float(_one_class(scores).max()), 1.0)


def _best_alpha(scores: Array) -> float:
    return ALPHAS[int(_one_class(scores).argmax())]


def _best_of_four(scores: Array) -> float:
    return float(scores[:, [PLACE[f"GNM 4 α {a:g}"] for a in FOUR_ALPHAS]].mean(0).max())


def _ahead(first: str, second: str) -> Value:
    return lambda scores: float(np.mean(scores[:, PLACE[first]] > scores[:, PLACE[second]]))


def _slowest_fall(scores: Array) -> float:
    """Largest ratio of the scores with one class more and without, α = 0.3."""
    means = np.array([_mean(n)(scores) for n in ("GNM 1 α 0.3", "GNM 2", "GNM 3", "GNM 4 α 0.3")])
    return float((means[1:] / np.maximum(means[:-1], 1.0)).max())


def _best_over_mst(scores: Array) -> float:
    return float(_one_class(scores).max()) / max(_mean("MST 1")(scores), 1.0)


NUMBERS = (
    Number("F3e", "MST, one class (bins)", "≈ 377", _mean("MST 1"), 300, 475, at=377),
    Number("F4", "best of four classes (bins)", "≈ 200", _best_of_four, 133, 300, at=200),
    Number(
        "F7a", "MST ahead of GNM, two classes", "3 of 50", _ahead("MST 2", "GNM 2"), 0, 0.165,
        at=0.06, share=True,
    ),
    Number(
        "F7b", "ET ahead of ALL, two classes", "46 of 50", _ahead("ET 2", "GNM 2"), 0.808, 1,
        at=0.92, share=True,
    ),
    Number(
        "F6a", "LIF / GNM, one class, refractory 0", "“comparably to or slightly worse”",
        _ratio("LIF 1, 0", "GNM 1 α 0.3"), 0.7, 1.05, far=1.5,
    ),
    Number(
        "F6a", "LIF 25 / LIF 0, one class", "“tends to increase”",
        _ratio("LIF 1, 25", "LIF 1, 0"), 1.02, 2, far=1.1,
    ),
    Number(
        "F6b", "LIF / GNM, three classes, refractory 0", "“worse”",
        _ratio("LIF 3, 0", "GNM 3"), 0.3, 0.95, far=1.25,
    ),
    Number(
        "F6b", "LIF 25 / LIF 0, three classes", "“drops”",
        _ratio("LIF 3, 25", "LIF 3, 0"), 0, 0.7, far=1.4,
    ),
    Number(
        "F6c", "LIF / MST, three classes, refractory 0", "“worse”",
        _ratio("LIF 3, 0", "MST 3"), 0, 0.95, far=1.25,
    ),
    Number(
        "F3", "best GNM / MST, one class", "“at least equally well”", _best_over_mst, 0.95, 1e9,
        far=1.5,
    ),
    Number("F3c", "best α, one class, η = 0", "≈ 0.3", _best_alpha, 0.2, 0.4, at=0.3),
    Number("F3b", "α 0.05, share of the best", "≈ 0", _of_best("GNM 1 α 0.05"), 0, 0.2, at=0),
    Number(
        "F3b", "α 0.08, share of the best", "“the global best”", _of_best("GNM 1 α 0.08"), 0.9, 1,
        far=1.5, at=1,
    ),
    Number(
        "F3c", "α 1, share of the best", "“decreases again”", _of_best("GNM 1 α 1"), 0, 0.95,
        far=1.1,
    ),
    Number(
        "F3a", "η 1, share of the best", "“learning impossible”", _of_best("GNM 1 η 1"), 0, 0.3
    ),
    Number(
        "F3d", "η 0.5, α 0.6 against η 0, α 0.3", "“does not significantly increase”",
        _ratio("GNM 1 on the line", "GNM 1 α 0.3"), 0.8, 1.1, far=1.25,
    ),
    Number(
        "F4", "one class more, largest ratio", "“dropped quickly”", _slowest_fall, 0, 0.8, far=1.25
    ),
)  # fmt: skip


def points(scores: Array) -> float:
    """The score of a protocol: the sum of its points, at most one a number."""
    return sum(one.point(one.value(scores)) for one in NUMBERS)


def come_back(scores: Array) -> int:
    """How many of the paper's numbers lie in their bands."""
    return sum(one.back(one.value(scores)) for one in NUMBERS)


class Found(NamedTuple):
    """A protocol with its scores (pattern seeds, probes)."""

    protocol: Protocol
    scores: Array

    @property
    def rank(self) -> tuple[float, int]:
        """Points, then numbers that have come back."""
        return points(self.scores), come_back(self.scores)


# --- the three stages ----------------------------------------------------------------------------


@cache
def protocols(size: Size) -> dict[Way, tuple[Protocol, ...]]:
    """All protocols of a size by their way of training."""
    return {way: tuple(readings(way, size)) for way in size.ways}


def coarse(size: Size) -> Experiment:
    """Stage one: every way of training on a few pattern seeds."""
    tried = [one for group in protocols(size).values() for one in group]
    title = "What the paper leaves open, every way of training"
    return stage("FORENSICS-coarse", title, tried, size.coarse, size.runs[0])


def kept_ways(size: Size, results: xr.Dataset) -> list[Way]:
    """The ways of training that go on: the best quarter by the best protocol of each."""
    scores = Scores(results)
    best = {
        way: max(Found(one, scores.of(one)).rank for one in group)
        for way, group in protocols(size).items()
    }
    order = sorted(best, key=lambda way: best[way], reverse=True)
    return order[: kept(size)]


def kept(size: Size) -> int:
    """How many ways of training go on."""
    return max(BEST, len(size.ways) // KEPT_SHARE)


def fine(size: Size, results: xr.Dataset) -> Experiment:
    """Stage two: the ways of training that `kept_ways` keeps, on more pattern seeds."""
    tried = [one for way in kept_ways(size, results) for one in protocols(size)[way]]
    title = "What the paper leaves open, the best quarter"
    return stage("FORENSICS-fine", title, tried, size.fine, size.runs[0])


def ranking(size: Size, first: xr.Dataset, second: xr.Dataset) -> list[Found]:
    """The protocols of both stages on the pattern seeds of both, the best first."""
    scores = Scores(first), Scores(second)
    found = [
        Found(one, np.concatenate([part.of(one) for part in scores]))
        for way in kept_ways(size, first)
        for one in protocols(size)[way]
    ]
    return sorted(found, key=lambda one: one.rank, reverse=True)


def best(size: Size, ranked: Sequence[Found]) -> list[Protocol]:
    """The protocols to confirm: the best, and the best of other ways of training after it."""
    way = {one.words: name for name, group in protocols(size).items() for one in group}
    chosen: dict[Way, Protocol] = {}
    for found in ranked:
        chosen.setdefault(way[found.protocol.words], found.protocol)
    return list(chosen.values())[:BEST]


def confirmed(size: Size, chosen: Sequence[Protocol]) -> Experiment:
    """Stage three: the chosen protocols on fresh pattern seeds, those of `conditions`."""
    title = "The best protocols of the search on fresh pattern seeds"
    return stage("FORENSICS-confirmed", title, chosen, size.confirmed, size.runs[1])


def conditions(size: Size, seeds: tuple[int, ...] | None = None) -> Experiment:
    """The same neurons under the conditions of the reproduction, each with its own trials."""
    title = "The paper's numbers under the named conditions"
    return stage("CONDITIONS", title, named(size), seeds or size.confirmed, size.runs[1])


# --- what comes out ------------------------------------------------------------------------------


def interval(one: Number, scores: Array) -> Interval:
    """Our number with its bootstrap interval over pattern seeds."""
    return bootstrap(one.value, scores, resamples=1_000)


def points_interval(scores: Array) -> Interval:
    """The score of a protocol with its bootstrap interval over pattern seeds."""
    return bootstrap(points, scores, resamples=500)


def lead(first: Array, second: Array) -> Interval:
    """How many points one protocol is ahead of another, paired by pattern seed."""
    return bootstrap(lambda a, b: points(a) - points(b), first, second, resamples=500)


HYPOTHESES = {
    "D": "the D reading explains more of the paper than matched, wide and the authors' code: its "
    "lead in points over each of them, at the cap that suits that one best, has an interval above "
    "0",
    "all": "no protocol explains everything: none of those confirmed has all numbers in their "
    "bands",
    "found": "the search finds a better protocol than the four conditions: the best of the three "
    "leads the best of the conditions with an interval above 0",
}
"""Written down before the run; judged on the pattern seeds of the confirmation alone."""


def judged(found: Sequence[Found]) -> dict[str, tuple[bool, str]]:
    """Each hypothesis: whether it holds, and the numbers. The first `BEST` are the search's."""
    scores = {one.protocol.words: one.scores for one in found}
    searched = max(found[:BEST], key=lambda one: one.rank)
    conditions: dict[str, Found] = {}
    for one in found[BEST:]:
        name = one.protocol.condition.name
        conditions[name] = max(conditions.get(name, one), one, key=lambda f: f.rank)
    ours = conditions["D reading"]
    leads = {n: lead(ours.scores, o.scores) for n, o in conditions.items() if n != "D reading"}
    other = max(conditions.values(), key=lambda one: one.rank)
    gain = lead(searched.scores, other.scores)
    most = max(come_back(one) for one in scores.values())
    return {
        "D": (
            all(one.above(0.0) for one in leads.values()),
            "; ".join(f"over {name} {one:+.1f} points" for name, one in leads.items()),
        ),
        "all": (most < len(NUMBERS), f"at most {most} of {len(NUMBERS)} come back"),
        "found": (
            gain.above(0.0),
            f"{searched.protocol.words} over {other.protocol.words}: {gain:+.1f} points",
        ),
    }


def unexplained(found: Sequence[Found]) -> list[Number]:
    """The numbers that come back under none of the protocols."""
    return [one for one in NUMBERS if not any(one.back(one.value(f.scores)) for f in found)]
