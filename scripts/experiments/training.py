"""The work behind every trained number: a block of neurons learns one stream and is scored."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents import noisy_performance, train_many
from agents.neuron_agent import NEURONS, RULES, NeuronAgent
from experiments.design import Axis, Block, Coordinate, Experiment, Setting, Variable
from gnm_env import Patterns, Task

RUN = {"trials": 60_000, "runs": 100, "cap": 10_000}
"""The paper's training length and measure."""

PUBLISHED_START = {"gnm": 0.3, "mst": 0.2, "lif": 0.5}
"""Upper end of the initial weights in the published code; the other start is the agents' default,
which drives all neurons to about the same mean potential ("matched")."""

STARTS = ("matched", "published")
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

_PLACE = ("classes", "pattern_seed", "neuron", "rule", "start", "weight_bounds", *RUN)


def training_seed(classes: Any, pattern_seed: Any) -> Any:
    """Seed of the training stream; far from every seed of an evaluation."""
    return 1_000_000 + 10_000 * classes + pattern_seed


def evaluation_seed(classes: Any, pattern_seed: Any) -> Any:
    """Seed of evaluation run 0. Run k hears the stream of this seed + k; runs stay below 1000."""
    return 10_000_000 * classes + 1_000 * pattern_seed


def train_and_score(block: Block) -> dict[str, NDArray[Any]]:
    """Train the block's neurons side by side on the stream of their pattern seed, and score them.

    All of them have the same number of classes, pattern seed, trials, runs and cap.
    """
    shared = block.settings[0]
    classes, pattern_seed = shared["classes"], shared["pattern_seed"]
    task = Task(n_classes=classes)
    patterns = Patterns.draw(task, pattern_seed)
    neurons = [make_agent(setting, task) for setting in block.settings]
    history = train_many(
        neurons, task, patterns, shared["trials"], training_seed(classes, pattern_seed), threads=1,
        block=min(LAST_TRIALS, shared["trials"]),
    )  # fmt: skip
    survived = noisy_performance(
        neurons, task, patterns, shared["runs"], shared["cap"],
        evaluation_seed(classes, pattern_seed), threads=1,
    )  # fmt: skip
    weights = [getattr(neuron, "weights", np.full(task.n_inputs, np.nan)) for neuron in neurons]
    return {
        "survived": survived.reshape(*block.shape, -1),
        "error_rate": history.error_rate[-1].reshape(block.shape),
        "weights": np.reshape(weights, (*block.shape, -1)),
    }


def make_agent(setting: Setting, task: Task) -> Any:
    """The untrained agent that a setting describes; ValueError for a key that nothing takes."""
    kinds = neuron_type(setting["neuron"]), rule_type(setting["rule"])
    taken = {field.name for kind in kinds for field in fields(kind)}
    unknown = sorted(set(setting) - taken - set(_PLACE))
    if unknown:
        raise ValueError(f"setting {unknown[0]!r} fits neither {kinds[0].__name__} nor its rule")
    neuron, rule = (
        kind(**{f.name: setting[f.name] for f in fields(kind) if f.name in setting})
        for kind in kinds
    )
    if setting["neuron"] == "network":
        from agents.network import NetworkAgent

        return NetworkAgent(neuron, rule, task.n_inputs, seed=setting["pattern_seed"])
    published = setting.get("start", "matched") == "published"
    return NeuronAgent(
        neuron,
        rule,
        task.n_inputs,
        seed=setting["pattern_seed"],
        initial_weight=PUBLISHED_START[setting["neuron"]] if published else None,
        weight_bounds=setting.get("weight_bounds", (0.0, 1.0)),
    )


def neuron_type(kind: str) -> Any:
    """The class that holds the parameters of a kind of neuron."""
    if kind == "continuous":
        from agents.continuous import ContinuousGNM

        return ContinuousGNM
    if kind == "network":
        from agents.network import Network

        return Network
    return NEURONS[kind]


def rule_type(rule: str) -> Any:
    """The class that holds the parameters of a learning rule."""
    if rule == "bp":
        from agents.network import BackPropagation

        return BackPropagation
    return RULES[rule]


def training(
    name: str, title: str, axes: tuple[Axis, ...], *, keep_weights: bool = False, **common: Any
) -> Experiment:
    """An experiment that trains one neuron per cell of the grid `axes`.

    Among the axes are "classes" and "pattern_seed"; a block lies at one value of each.
    """
    task = Task()
    common = {**RUN, "start": "matched", "rule": "all", "neuron": "gnm", **common}
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
        protocol(task, [common, *(setting for axis in axes for setting in axis.settings)]),
        stream_seeds(axes),
    )


def pattern_seeds(seeds: tuple[int, ...]) -> Axis:
    """The axis of pattern seeds. Raises ValueError for seeds whose streams would overlap."""
    outside = [seed for seed in seeds if not 0 <= seed <= LARGEST_SEED]
    if outside:
        raise ValueError(f"pattern seeds must be in 0 … {LARGEST_SEED}, got {outside[0]}")
    return Axis("pattern_seed", seeds, long_name="seed of patterns and initial weights")


def class_counts(*counts: int) -> Axis:
    """The axis of tasks, by number of pattern classes."""
    return Axis("classes", counts, long_name="number of pattern classes")


def learners(rows: Mapping[str, Mapping[str, Any]]) -> Axis:
    """An axis of named combinations of neuron and rule, all in one block."""
    names, settings = tuple(rows), tuple(rows.values())
    return Axis("learner", names, chunk=0, settings=settings, long_name="neuron and learning rule")


def protocol(task: Task, sets: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Every default that the settings `sets` leave out, and how seeds become streams."""
    neurons = sorted({setting["neuron"] for setting in sets if "neuron" in setting})
    rules = sorted({setting["rule"] for setting in sets if "rule" in setting})
    types = {kind: neuron_type(kind) for kind in neurons} | {
        rule: rule_type(rule) for rule in rules
    }
    world = {k: v for k, v in asdict(task).items() if k not in ("n_classes", "targets")}
    return {
        "task": {**world, "targets": "1, 2, … classes"},
        "defaults": {name: asdict(kind()) for name, kind in types.items()},
        "initial_weight": {
            "matched": {
                kind: types[kind].default_initial_weight
                for kind in neurons
                if hasattr(types[kind], "default_initial_weight")
            },
            "published": {kind: w for kind, w in PUBLISHED_START.items() if kind in neurons},
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
