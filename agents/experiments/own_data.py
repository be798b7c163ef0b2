"""A data set in the place of drawn streams: the league's neurons and rules on it, and experiments.

`rank` says who counts how many held-out trials right. The settings are those that the search of
`tuning.py` has found on drawn streams: a start, since nothing is tuned on the data. Beside the
entries stand what needs no neuron: silence, and the label that is commonest in training.
`on_trials` declares an experiment.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.evaluation import answers
from agents.experiments.design import Axis, Block, Experiment, Variable
from agents.experiments.markdown import markdown_table
from agents.experiments.training import make_agent, refuse_unknown
from agents.experiments.tuning import chosen_settings, entries, feedback_of, for_trials
from agents.training.many import train_many
from gnm_env import Trials

COPIES = 5
"""Neurons of each entry, which differ in their initial weights."""
EPOCHS = 20
SHARE = 0.8
"""Of the trials that are trained on."""


class Row(NamedTuple):
    """One entry on held-out trials."""

    name: str
    told: str
    """Class of feedback, see docs/rules.md; "" for what is not trained."""
    exact: tuple[float, ...] = ()
    """Share of the held-out trials counted exactly, one for each copy."""
    mean_error: float = float("nan")
    """Mean |label − spikes| of all copies on held-out trials."""
    training: float = float("nan")
    """Share of the training trials counted exactly, mean over copies."""
    refused: str = ""
    """Why it could not be trained: a rule that has to know more than these trials tell."""


def rank(
    trials: Trials,
    neurons: Sequence[str] | None = None,
    rules: Sequence[str] | None = None,
    *,
    epochs: int = EPOCHS,
    copies: int = COPIES,
    seed: int = 0,
    by: str | None = None,
    settings: Mapping[str, Mapping[str, Any]] | None = None,
    progress: Callable[[Iterable[str]], Iterable[str]] = iter,
) -> list[Row]:
    """Every entry trained on a part of the trials and scored on the rest, best first.

    Args:
        trials: the data set.
        neurons, rules: as for `tuning.entries`; None: all.
        epochs: how often each training trial is heard.
        copies: neurons per entry.
        seed: of the split, of the order of trials, and of the first copy's initial weights.
        by: a column whose values stay together in the split, such as a voice or a day.
        settings: by entry; None: those of the league.
        progress: wraps the names while they are trained, to show how far it is.

    Raises ValueError as `tuning.entries` and `Trials.split` do.
    """
    train, test = trials.split(SHARE, seed=seed, by=by)
    known = chosen_settings() if settings is None else settings
    names = [name for name in entries(neurons, rules) if name in known]
    found = [
        _row(name, for_trials(known[name], epochs * len(train)), train, test, epochs, copies, seed)
        for name in progress(names)
    ]
    return sorted([*_without_a_neuron(train, test), *found], key=_place)


def _place(row: Row) -> tuple[bool, float]:
    return (bool(row.refused), -float(np.mean(row.exact)) if row.exact else 0.0)


def _row(
    name: str,
    setting: Mapping[str, Any],
    train: Trials,
    test: Trials,
    epochs: int,
    copies: int,
    seed: int,
) -> Row:
    agents = [
        make_agent({**setting, "pattern_seed": seed, "copy": copy}, train) for copy in range(copies)
    ]
    try:
        train_many(agents, train, trials=epochs * len(train), seed=seed)
    except ValueError as refusal:
        return Row(name, feedback_of(name), refused=str(refusal))
    heard, held_out = answers(agents, train), answers(agents, test)
    return Row(
        name,
        feedback_of(name),
        tuple((1.0 - held_out.wrong / len(test)).tolist()),
        float(held_out.absolute.mean() / len(test)),
        float(1.0 - heard.wrong.mean() / len(train)),
    )


def _without_a_neuron(train: Trials, test: Trials) -> list[Row]:
    commonest = int(np.bincount(train.labels).argmax())

    def row(name: str, count: int) -> Row:
        error, right = np.abs(test.labels - count), float(np.mean(train.labels == count))
        return Row(name, "", (float(np.mean(error == 0)),), float(error.mean()), right)

    return [row("silence", 0), row(f"always {commonest}, the commonest label", commonest)]


# --- experiments ---------------------------------------------------------------------------------


def on_trials(
    name: str,
    title: str,
    trials: Trials,
    axes: tuple[Axis, ...],
    *,
    epochs: int = EPOCHS,
    seed: int = 0,
    by: str | None = None,
    **common: Any,
) -> Experiment:
    """An experiment: one neuron per cell, trained on a part of `trials` and scored on the rest.

    It keeps `exact`, the share of the held-out trials that were counted exactly, and `mean_error`,
    the mean |label − spikes|.

    Args:
        name, title: of the experiment.
        trials: the data set. A store that was made of another one is refused.
        axes: the grid: fields of the neuron or of the rule, "neuron" and "rule" themselves, "copy"
            (other initial weights), "initial_weight", "weight_bounds".
        epochs, seed, by: as for `rank`.
        common: what holds in every cell unless an axis sets it.

    Raises ValueError for a setting that nothing takes, and as `Trials.split` does.
    """
    train, test = trials.split(SHARE, seed=seed, by=by)
    common = {"neuron": "gnm", "rule": "all", "pattern_seed": seed, **common}
    refuse_unknown(axes, common, task=frozenset(), run={"pattern_seed"})

    def compute(block: Block) -> dict[str, NDArray[Any]]:
        agents = [make_agent(setting, train) for setting in block.settings]
        train_many(agents, train, trials=epochs * len(train), seed=seed, threads=1)
        result = answers(agents, test)
        return block.shaped(
            exact=1.0 - result.wrong / len(test), mean_error=result.absolute / len(test)
        )

    variables = (
        Variable("exact", "float64", "1", "share of held-out trials counted exactly"),
        Variable("mean_error", "float64", "spikes", "mean |label - spikes| on held-out trials"),
    )
    told = {"trials": _digest(trials), "epochs": epochs, "split": [SHARE, seed, by]}
    return Experiment(name, title, axes, common, compute, variables, protocol=told)


def _digest(trials: Trials) -> str:
    """What tells one data set from another."""
    made = hashlib.sha256(str(trials.n_inputs).encode())
    for array in trials.arrays[1:]:
        made.update(np.ascontiguousarray(array).tobytes())
    return made.hexdigest()


# --- the table -----------------------------------------------------------------------------------


def markdown(rows: Sequence[Row]) -> str:
    """The table, best first; entries that these trials do not suffice for below it."""
    head = ("told", "learner", "held-out trials counted exactly", "mean error", "in training")
    numbers = [
        (r.told, r.name, _spread(np.array(r.exact)), f"{r.mean_error:.2f}", f"{r.training:.1%}")
        for r in rows
        if r.exact
    ]
    lines = markdown_table(head, numbers, right=2)
    refused: dict[str, list[str]] = {}
    for row in rows:
        if row.refused:
            refused.setdefault(row.refused, []).append(row.name)
    notes = [f"- {'; '.join(names)}: {why}" for why, names in refused.items()]
    return "\n".join([*lines, "", *notes] if notes else lines)


def _spread(exact: NDArray[np.float64]) -> str:
    if len(exact) == 1:
        return f"{exact[0]:.1%}"
    return f"{exact.mean():.1%} ({exact.min():.1%} … {exact.max():.1%})"
