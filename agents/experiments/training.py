"""The work behind every trained number: a block of neurons learns one stream and is scored."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping, Sequence, Set
from dataclasses import asdict, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents import History, noisy_performance, train_many
from agents.experiments.design import Axis, Block, Coordinate, Experiment, Setting, Variable
from agents.experiments.models import new_agent
from agents.registry import find_model, find_rule
from gnm_env import Patterns, Task, Trials
from gnm_env.checks import MAX_BINS, flag, shown, whole
from gnm_env.levels import evaluation_seed
from gnm_env.rules import MAX_EPISODE_BINS, RUNS
from gnm_env.task import MAX_CLASSES

RUN: dict[str, Any] = {"trials": 60_000, "runs": RUNS, "cap": MAX_EPISODE_BINS}
"""The paper's training length and measure."""

WIDE_START = {"gnm": 0.3, "mst": 0.2, "lif": 0.5}
"""Upper end of the initial weights in the authors' code ("wide"); the other start is the agents'
default, which drives all neurons to about the same mean potential ("matched")."""

STARTS = ("matched", "wide")
LAST_TRIALS = 5_000
"""The error rate that is kept is that of the last so many trials."""
LARGEST_SEED = 8_999

SURVIVED = Variable(
    "survived", "int32", "bins", "bins survived before the first mistake, learning off", ("run",)
)
ERROR_RATE = Variable(
    "error_rate", "float64", "1", f"fraction of wrong trials in the last {LAST_TRIALS} of training"
)
WEIGHTS = Variable("weights", "float64", "1", "weights at the end of training", ("channel",))

_TASK = {field.name for field in fields(Task)} - {"n_classes"}
_SHARED = {"classes", "pattern_seed", *RUN, *_TASK}
"""What all neurons of a block have in common."""
_OWN = {"neuron", "rule", "start", "initial_weight", "weight_bounds", "copy"}
"""`copy` numbers neurons that differ in their initial weights alone."""


def training_seed(classes: Any, pattern_seed: Any) -> Any:
    """Seed of the training stream; far from every seed of an evaluation."""
    return 1_000_000 + 10_000 * classes + pattern_seed


def task_of(setting: Mapping[str, Any]) -> Task:
    """The task that a setting describes: its number of classes, and any other field of a Task."""
    return Task(n_classes=setting["classes"], **{k: setting[k] for k in _TASK & set(setting)})


def train_and_score(block: Block) -> dict[str, NDArray[Any]]:
    """Train the block's neurons side by side on the stream of their pattern seed, and score them.

    All of them have the same task, pattern seed, trials, runs and cap.
    """
    shared = block.settings[0]
    task = task_of(shared)
    patterns = Patterns.draw(task, shared["pattern_seed"])
    neurons, history = trained(block.settings, task, patterns)
    survived = scored(neurons, task, patterns, shared)
    values = {"survived": survived, "error_rate": history.error_rate[-1]}
    weights = [getattr(neuron, "weights", np.full(task.n_inputs, np.nan)) for neuron in neurons]
    if len({np.shape(one) for one in weights}) == 1:  # networks of several sizes fit no array
        values["weights"] = np.array(weights)
    return block.shaped(**values)


def trained(
    settings: Sequence[Setting], task: Task, patterns: Patterns
) -> tuple[list[Any], History]:
    """Agents of these settings, trained side by side on the stream of their pattern seed."""
    shared = settings[0]
    agents = [make_agent(setting, task) for setting in settings]
    seed = training_seed(task.n_classes, shared["pattern_seed"])
    block = min(LAST_TRIALS, shared["trials"])
    history = train_many(agents, task, patterns, shared["trials"], seed, threads=1, block=block)
    return agents, history


def scored(
    agents: Sequence[Any], task: Task, patterns: Patterns, shared: Setting
) -> NDArray[np.int64]:
    """Bins survived, (agents, runs), on the streams of the pattern seed; runs and cap as given."""
    seed = evaluation_seed(task.n_classes, shared["pattern_seed"])
    return noisy_performance(agents, task, patterns, shared["runs"], shared["cap"], seed, threads=1)


def make_agent(setting: Setting, task: Task | Trials) -> Any:
    """The untrained agent that a setting describes, with the inputs of a task or of a data set."""
    # "neuron" and "rule" name classes, whatever fields of these names a class may have.
    given = setting.keys() - {"neuron", "rule"}
    neuron, rule = (
        kind(**{f.name: setting[f.name] for f in fields(kind) if f.name in given})
        for kind in (find_model(setting["neuron"]), find_rule(setting["rule"]))
    )
    initial_weight = setting.get("initial_weight")
    if setting.get("start") == "wide":
        initial_weight = WIDE_START[setting["neuron"]]
    bounds = {k: setting[k] for k in ("weight_bounds",) if k in setting}
    # Copy 0 has the weights that the pattern seed alone gives; other copies have others.
    seed = setting["pattern_seed"] + (LARGEST_SEED + 1) * setting.get("copy", 0)
    return new_agent(neuron, rule, task.n_inputs, seed, initial_weight, **bounds)


# --- declaring an experiment ---------------------------------------------------------------------


def training(
    name: str, title: str, axes: tuple[Axis, ...], *, keep_weights: bool = False, **common: Any
) -> Experiment:
    """An experiment that trains one neuron per cell of the grid `axes`.

    Args:
        name, title: of the experiment.
        axes: the grid; `class_counts` and `pattern_seeds` make two that are always among them.
            Others, and `common`, set what the task, the neuron or the rule has a field for:
            "rate", "alpha", "learning_rate"; "neuron" and "rule" themselves, by registered name or
            as "module:Class" or "file.py:Class"; "trials", "runs", "cap"; "start" ("matched" or
            "wide"), "initial_weight", "weight_bounds".
        keep_weights: whether the weights at the end of training are stored.
        common: what holds in every cell unless an axis sets it.

    Raises:
        ValueError: if an axis has a name that nothing takes, or a value that is out of range.
    """
    wrong = [axis for axis in axes if not isinstance(axis, Axis)]
    if wrong or len({axis.name for axis in axes}) < len(axes):
        raise ValueError(
            "axes must each be an Axis with a name of its own, got "
            + (shown(wrong[0]) if wrong else ", ".join(axis.name for axis in axes))
        )
    flag("keep_weights", keep_weights)
    common = {**RUN, "start": "matched", "rule": "all", "neuron": "gnm", **common}
    _check_names(axes, common, {"runs", "n_inputs"} if keep_weights else {"runs"})
    _check_values(axes, common)
    task = task_of({"classes": len(common.get("targets", "1")), **common})
    variables = (SURVIVED, ERROR_RATE, WEIGHTS) if keep_weights else (SURVIVED, ERROR_RATE)
    lengths = {"run": common["runs"], **({"channel": task.n_inputs} if keep_weights else {})}
    return Experiment(
        name,
        title,
        axes,
        common,
        train_and_score,
        variables,
        lengths,
        protocol(task, [common, *(setting for axis in axes for setting in _settings(axis))]),
        stream_seeds(axes),
    )


def _settings(axis: Axis) -> list[Mapping[str, Any]]:
    return [axis.setting(index) for index in range(len(axis.values))]


def _check_names(axes: tuple[Axis, ...], common: Mapping[str, Any], lengths: set[str]) -> None:
    """ValueError if a cell of the grid would have a setting that nothing in it takes."""
    for axis in axes:
        set_here = {key for setting in _settings(axis) for key in setting}
        if set_here & lengths:
            raise ValueError(
                f"{min(set_here & lengths)} cannot be set by an axis, since it is the length of an "
                "array of results: make one experiment for each value"
            )
        shared = sorted(set_here & _SHARED)
        if shared and axis.step > 1:
            raise ValueError(
                f"axis {axis.name} must have chunk=1, since neurons side by side share "
                f"{shared[0]}, got {axis.chunk}"
            )
    refuse_unknown(axes, common)
    names = [axis.name for axis in axes]
    for needed, maker in (("classes", "class_counts(1, 2)"), ("pattern_seed", "pattern_seeds(…)")):
        if needed not in names:
            raise ValueError(
                f"the axes must hold {needed}, as {maker} makes it, got {', '.join(names)}"
            )


def refuse_unknown(
    axes: tuple[Axis, ...],
    common: Mapping[str, Any],
    task: Set[str] = frozenset(_TASK),
    run: Set[str] = frozenset(_SHARED - _TASK),
) -> None:
    """ValueError if a cell has a setting of none of its neuron, its rule, `task` and `run`."""
    kinds = [{(s.get("neuron"), s.get("rule"), frozenset(s)) for s in _settings(a)} for a in axes]
    for parts in itertools.product(*kinds):
        neuron = _last(common["neuron"], [part[0] for part in parts])
        rule = _last(common["rule"], [part[1] for part in parts])
        _refuse_others({*common}.union(*(part[2] for part in parts)), neuron, rule, task, run)


def _last(default: str, given: Sequence[str | None]) -> str:
    return next((one for one in reversed(given) if one is not None), default)


def _refuse_others(names: set[str], neuron: str, rule: str, task: Set[str], run: Set[str]) -> None:
    known = {"the task": task} if task else {}
    for kind in (find_model(neuron), find_rule(rule)):
        known[kind.__name__] = {f.name for f in fields(kind)}
    known["the run"] = _OWN | run
    unknown = sorted(names.difference(*known.values()))
    if unknown:
        takers = ", nor ".join(f"{taker} ({_listed(set(of))})" for taker, of in known.items())
        raise ValueError(f"nothing takes the setting {unknown[0]!r}: neither {takers}")


def _listed(names: set[str]) -> str:
    return ", ".join(sorted(names))


def _check_values(axes: tuple[Axis, ...], common: Mapping[str, Any]) -> None:
    """ValueError for a value out of range: each is tried beside the first ones of other axes."""
    first = {**common}
    for axis in axes:
        first.update(axis.setting(0))
    for setting in ({**first, **one} for axis in axes for one in _settings(axis)):
        if setting["start"] not in STARTS:
            raise ValueError(f"start must be {' or '.join(STARTS)}, got {setting['start']!r}")
        if setting["start"] == "wide" and setting["neuron"] not in WIDE_START:
            raise ValueError(
                f"the wide initial weights are those of {', '.join(WIDE_START)}, not of "
                f"{setting['neuron']}: give initial_weight"
            )
        for name in RUN:
            whole(name, setting[name], low=1, high=MAX_BINS)
        make_agent(setting, task_of(setting))


def pattern_seeds(seeds: Sequence[int]) -> Axis:
    """The axis of pattern seeds. Raises ValueError for seeds whose streams would overlap."""
    if not isinstance(seeds, Iterable):
        raise ValueError(f"pattern seeds must be whole numbers, got {shown(seeds)}")
    for seed in seeds:
        whole("pattern seeds", seed, 0, LARGEST_SEED)
    return Axis("pattern_seed", tuple(seeds), long_name="seed of patterns and initial weights")


def class_counts(*counts: int) -> Axis:
    """The axis of tasks, by number of pattern classes."""
    for count in counts:
        whole("classes", count, low=1, high=MAX_CLASSES)
    return Axis("classes", counts, long_name="number of pattern classes")


def learners(rows: Mapping[str, Mapping[str, Any]]) -> Axis:
    """An axis of named combinations of neuron and rule, all in one block."""
    return Axis.named("learner", rows, chunk=0, long_name="neuron and learning rule")


def alpha_axis(values: Sequence[float]) -> Axis:
    """The axis of α, in one block."""
    return Axis("alpha", tuple(values), chunk=0, units="1/bin", long_name="α, decay per bin")


def eta_axis(values: Sequence[float], chunk: int = 0) -> Axis:
    """The axis of η."""
    return Axis("eta", tuple(values), chunk, long_name="η, model choice")


def protocol(task: Task, sets: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Every default that the settings `sets` leave out, and how seeds become streams."""
    neurons = sorted({setting["neuron"] for setting in sets if "neuron" in setting})
    rules = sorted({setting["rule"] for setting in sets if "rule" in setting})
    types: dict[str, Any] = {kind: find_model(kind) for kind in neurons}
    defaults = {**types, **{rule: find_rule(rule) for rule in rules}}
    world = {k: v for k, v in asdict(task).items() if k not in ("n_classes", "targets")}
    usual = task.targets == tuple(range(1, task.n_classes + 1))
    return {
        "task": {**world, "targets": "1, 2, … classes" if usual else task.targets},
        "defaults": {name: asdict(kind()) for name, kind in defaults.items()},
        "initial_weight": {
            "matched": {kind: types[kind].default_initial_weight for kind in neurons},
            "wide": {kind: w for kind, w in WIDE_START.items() if kind in neurons},
        },
        "seeds": {
            "patterns": "default_rng((pattern_seed, 1))",
            "initial weights": "default_rng((pattern_seed, 2))",
            "training": "default_rng(training_seed)",
            "evaluation": "default_rng(evaluation_seed + run)",
        },
    }


def stream_seeds(axes: tuple[Axis, ...]) -> tuple[Coordinate, ...]:
    """The seeds of the streams, for each number of classes and pattern seed."""
    by_name = {axis.name: axis.values for axis in axes}
    dims = ("classes", "pattern_seed")
    classes, seeds = np.meshgrid(*(by_name[dim] for dim in dims), indexing="ij")
    return (
        Coordinate(
            "training_seed", dims, training_seed(classes, seeds), "seed of the training stream"
        ),
        Coordinate(
            "evaluation_seed", dims, evaluation_seed(classes, seeds), "seed of evaluation run 0"
        ),
    )
