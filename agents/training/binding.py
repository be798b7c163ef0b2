"""From templates to compiled loops: one set for each kind of model, rule and width."""

from __future__ import annotations

import functools
from types import SimpleNamespace
from typing import Any

from agents.learning.rule import CORRECTIONS, Rule
from agents.learning.teaching import replay_template
from agents.model import Model, threshold_name
from agents.training import change
from agents.training.slots import LEARN_WIDTH
from agents.training.stepwise import (
    predict_template,
    record_template,
    step_template,
    update_template,
)
from agents.training.streams import answer_template, survive_template, train_template
from agents.training.trial import (
    amount_of,
    gives_any,
    is_above,
    learn_trial_template,
    run_bins_template,
    run_trial_template,
    spikes_of,
)
from gnm_env.compiled import specialise


def loops(model: Model, rule: Rule, width: int = 1) -> Any:
    """The compiled loops for models and rules such as these, `width` models side by side.

    Compiled at their first call and kept on disk.
    """
    label, advance = model.advance()
    kernel = rule.kernel(model)
    return _loops(label, advance, type(model), type(rule), kernel.biexponential, width)


def recorder(model: Model) -> Any:
    """The compiled loop that notes every variable of a model such as this."""
    label, advance = model.recording()
    return _recorder(label, advance, type(model))


@functools.cache
def _recorder(label: str, advance: Any, model: type[Model]) -> Any:
    return specialise(record_template, label, **_of_model(advance, model, 1))


@functools.cache
def _loops(
    label: str, advance: Any, model: type[Model], rule: type[Rule], biexponential: bool, width: int
) -> Any:
    of_model = _of_model(advance, model, width)
    of_rule = _of_rule(rule, biexponential, width)
    alone = f"{label}_{width}"
    together = f"{label}_{rule.name}_{'bi' if biexponential else 'mono'}_{width}"
    flags = {name: of_rule[name] for name in ("USES_ERROR", "USES_OUTPUT")}
    bins = specialise(run_bins_template, together, inline=True, **of_model, **flags)
    trial = specialise(run_trial_template, together, inline=True, **of_model, run_bins=bins)
    compute_change = _change(label, of_model, of_rule, rule, together)
    learn = specialise(
        learn_trial_template, together, inline=True, **of_rule, compute_change=compute_change
    )
    everything = {**of_model, **of_rule, "run_trial": trial, "learn_trial": learn}
    return SimpleNamespace(
        train=specialise(train_template, together, **everything),
        answer=specialise(answer_template, together, **everything),
        update=specialise(update_template, together, **everything),
        survive=specialise(survive_template, alone, **of_model),
        step=specialise(step_template, alone, **of_model),
        predict=specialise(predict_template, alone, **of_model),
    )


def _of_model(advance: Any, model: type[Model], width: int) -> dict[str, Any]:
    return {
        "WIDTH": width,
        "Parameters": model.parameters_type,
        "State": model.state_type,
        "advance": advance,
        "output": amount_of if model.graded else spikes_of,
        "active": gives_any if model.graded else is_above,
    }


def _of_rule(rule: type[Rule], biexponential: bool, width: int) -> dict[str, Any]:
    return {
        "WIDTH": width,
        "LEARN_WIDTH": min(width, LEARN_WIDTH),
        "USES_ERROR": rule.uses_error,
        "USES_OUTPUT": rule.teach is not None or rule.change is not None,
        "BIEXPONENTIAL": biexponential,
        "SEES_PRESENTATIONS": rule.feedback == "presentations",
        "correction": CORRECTIONS[rule.feedback],
    }


def _change(
    label: str, of_model: dict[str, Any], of_rule: dict[str, Any], rule: type[Rule], together: str
) -> Any:
    """The compiled function that computes Δw before momentum and bounds."""
    if rule.block_change is not None:
        return specialise(rule.block_change, together, **of_rule)
    if rule.teaching_signal is not None:
        names = {**of_rule, **rule.compiled_pointwise()}
        sums = specialise(change.sum_eligibility_template, together, inline=True, **names)
        return specialise(
            change.pointwise_change_template, together, inline=True, **names, sum_eligibility=sums
        )
    numbers = of_model["Parameters"]
    names = {**of_model, **of_rule, "WIDTH": 1, "OwnNumbers": rule.parameters_type}
    names["THRESHOLD"] = numbers._fields.index(threshold_name(numbers))
    alone = together.rpartition("_")[0]
    replay = specialise(replay_template, label, **names)
    own = specialise(rule.teach or rule.change, f"{alone}_own", replay=replay)
    epsilon = specialise(change.epsilon_template, alone, **names, teach=own) if rule.teach else own
    learn_alone = specialise(change.learn_alone_template, alone, **names, epsilon=epsilon)
    return specialise(change.taught_change_template, together, **of_rule, learn_alone=learn_alone)
