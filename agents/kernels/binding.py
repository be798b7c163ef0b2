"""From templates to compiled loops: one set for each kind of neuron, rule and width."""

from __future__ import annotations

import functools
from types import SimpleNamespace
from typing import Any

from agents.kernels.slots import LEARN_WIDTH
from agents.kernels.stepwise import (
    foresee_template,
    hear_template,
    record_template,
    study_template,
)
from agents.kernels.streams import answer_template, survive_template, train_template
from agents.kernels.trial import (
    learn_trial_template,
    run_bins_template,
    run_trial_template,
    sum_eligibility_template,
)
from agents.learning.rule import Rule
from agents.neurons.neuron import Neuron
from gnm_env.compiled import specialise


def kernels(neuron: Neuron, rule: Rule, width: int = 1) -> Any:
    """The compiled loops for neurons and rules such as these, `width` neurons side by side.

    Compiled at their first call and kept on disk.
    """
    return _kernels(*neuron.step(), type(neuron), type(rule), rule.trace(neuron).double, width)


@functools.cache
def _kernels(
    name: str, step: Any, neuron: type[Neuron], rule: type[Rule], double: bool, width: int
) -> Any:
    of_neuron = _neuron_bindings(step, neuron, width)
    of_rule = {
        "WIDTH": width,
        "LEARN_WIDTH": min(width, LEARN_WIDTH),
        "USES_ERROR": rule.uses_error,
        "DOUBLE_TRACE": double,
        "correction": rule.correction,
        "teaching_signal": rule.teaching_signal,
        "weight_change": rule.weight_change,
    }
    alone = f"{name}_{width}"
    together = f"{name}_{rule.name}_{'double' if double else 'single'}_{width}"
    bins = specialise(run_bins_template, together, **of_neuron, USES_ERROR=rule.uses_error)
    trial = specialise(run_trial_template, together, **of_neuron, run_bins=bins)
    eligibility = specialise(sum_eligibility_template, together, **of_rule)
    learn = specialise(learn_trial_template, together, **of_rule, sum_eligibility=eligibility)
    all_ = {**of_neuron, **of_rule, "run_trial": trial, "learn_trial": learn}
    return SimpleNamespace(
        train=specialise(train_template, together, **all_),
        answer=specialise(answer_template, together, **all_),
        study=specialise(study_template, together, **all_),
        survive=specialise(survive_template, alone, **of_neuron),
        hear=specialise(hear_template, alone, **of_neuron),
        foresee=specialise(foresee_template, alone, **of_neuron),
    )


def recorder(neuron: Neuron) -> Any:
    """The compiled loop that notes every variable of a neuron such as this."""
    return _recorder(*neuron.recording_step(), type(neuron))


@functools.cache
def _recorder(name: str, step: Any, neuron: type[Neuron]) -> Any:
    return specialise(record_template, name, **_neuron_bindings(step, neuron, 1))


def _neuron_bindings(step: Any, neuron: type[Neuron], width: int) -> dict[str, Any]:
    return {
        "WIDTH": width,
        "Parameters": neuron.parameters_type,
        "State": neuron.state_type,
        "step": step,
    }
