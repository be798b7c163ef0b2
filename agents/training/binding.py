"""From templates to compiled loops: one set for each kind of model, rule and width."""

from __future__ import annotations

import functools
from types import SimpleNamespace
from typing import Any, NamedTuple

from agents.learning.rule import CORRECTIONS, Rule, always
from agents.learning.teaching import accumulate_template, replay_template
from agents.model import Model, threshold_name
from agents.training import change
from agents.training.exploration import explore_bin_template, explore_trial_template
from agents.training.slots import LEARN_WIDTH
from agents.training.stepwise import (
    predict_template,
    record_template,
    step_template,
    update_template,
)
from agents.training.streams import (
    answer_template,
    new_log_template,
    survive_template,
    train_template,
)
from agents.training.trial import (
    amount_of,
    gives_any,
    is_above,
    learn_trial_template,
    run_bins_template,
    run_trial_template,
    spikes_of,
    weighed_template,
)
from gnm_env.compiled import specialise


def loops(model: Model, rule: Rule, width: int = 1) -> Any:
    """The compiled loops for models and rules such as these, `width` models side by side.

    Compiled at their first call and kept on disk.
    """
    label, advance = model.advance()
    return _loops(
        Key(
            label, advance, type(model), model.reads_V, model.readout_lag,
            type(rule), rule.variant, rule.averages, rule.kernel(model).biexponential, width,
        )
    )  # fmt: skip


class Key(NamedTuple):
    """What compiled loops differ in."""

    label: str
    advance: Any
    model: type[Model]
    reads_V: bool
    lag: int
    rule: type[Rule]
    variant: tuple[str, bool]
    averages: bool
    biexponential: bool
    width: int

    @property
    def taught(self) -> str:
        """A name for the model and what it learns by, whatever the width."""
        parts = [self.label, self.rule.name, "bi" if self.biexponential else "mono"]
        if self.variant != (self.rule.feedback, self.rule.learns_when_right):
            parts.append("_".join(map(str, self.variant)))
        if self.averages:
            parts.append("averaged")
        if not self.reads_V:
            parts.append(f"x{self.lag}")
        return "_".join(parts)


def recorder(model: Model) -> Any:
    """The compiled loop that notes every variable of a model such as this."""
    label, advance = model.recording()
    return _recorder(label, advance, type(model))


@functools.cache
def _recorder(label: str, advance: Any, model: type[Model]) -> Any:
    return specialise(record_template, label, **_of_model(advance, model, 1))


@functools.cache
def _loops(key: Key) -> Any:
    of_model = _of_model(key.advance, key.model, key.width)
    of_rule = _of_rule(key)
    alone = f"{key.label}_{key.width}"
    together = f"{key.taught}_{key.width}"
    flags = {name: of_rule[name] for name in ("USES_ERROR", "USES_OUTPUT", "USES_READOUT")}
    flags["USES_READOUT"] &= not of_rule["EXPLORES"]  # what is drawn afterwards takes its place
    bins = specialise(run_bins_template, together, inline=True, **of_model, **flags)
    trial = specialise(
        run_trial_template, together, inline=True, **of_model, **flags, run_bins=bins
    )
    compute_change = _change(key, of_model, of_rule, together)
    learn = specialise(
        learn_trial_template, together, inline=True, **of_rule, compute_change=compute_change
    )
    everything = {**of_model, **of_rule, "run_trial": trial, "learn_trial": learn}
    everything["new_log"] = specialise(new_log_template, together, inline=True, **of_rule)
    if key.rule.weigh is not None:
        everything["weighed"] = specialise(weighed_template, together, **of_rule)
    explore_bin = None
    if key.rule.spike_probability is not None:
        names = {**of_rule, "THRESHOLD": _threshold_row(of_model)}
        everything["explore_trial"] = specialise(
            explore_trial_template, together, inline=True, **names
        )
        explore_bin = specialise(explore_bin_template, together, **names)
    return SimpleNamespace(
        explore_bin=explore_bin,
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


def _of_rule(key: Key) -> dict[str, Any]:
    rule, (feedback, learns_when_right) = key.rule, key.variant
    whole_trial = rule.teach is not None or rule.change is not None
    needs_readout = whole_trial or rule.bin_signal is not None
    draws = rule.spike_probability is not None
    # Rules that learn from every trial leave no lane out, and gain nothing by smaller parts.
    every_trial = rule.weigh is not None or feedback in ("reward", "none")
    return {
        "WIDTH": key.width,
        "LEARN_WIDTH": key.width if every_trial else min(key.width, LEARN_WIDTH),
        "USES_ERROR": rule.uses_error and feedback == "presentations",
        "USES_OUTPUT": whole_trial or rule.uses_output,
        "USES_READOUT": draws or (needs_readout and not key.reads_V),
        "READS_V": not draws and (key.reads_V or not needs_readout),
        "LAG": key.lag if needs_readout else 0,
        "BIEXPONENTIAL": key.biexponential,
        "SEES_PRESENTATIONS": feedback == "presentations",
        "TOLD_REWARD": feedback == "reward",
        "WEIGHS": rule.weigh is not None,
        "AVERAGES": key.averages,
        "EXPLORES": draws,
        "BY_BIN": rule.bin_signal is not None or rule.side_by_side is not None,
        "OwnNumbers": rule.parameters_type,
        "Memory": rule.memory_type,
        "correction": always if learns_when_right else CORRECTIONS[feedback],
        **rule.compiled_parts(),
    }


def _change(key: Key, of_model: dict[str, Any], of_rule: dict[str, Any], together: str) -> Any:
    """The compiled function that computes Δw before momentum and bounds."""
    rule = key.rule
    names = {**of_rule}
    if rule.bin_signal is not None or rule.teaching_signal is None:
        names["THRESHOLD"] = _threshold_row(of_model)
    if rule.block_change is not None:
        return specialise(rule.block_change, together, **of_rule)
    if rule.side_by_side is not None:
        sums = specialise(change.side_by_side_template, together, inline=True, **names)
        names["sum_eligibility"] = sums
        return specialise(change.pointwise_change_template, together, inline=True, **names)
    if rule.bin_signal is not None or rule.teaching_signal is not None:
        signal = specialise(change.bin_signal_template, together, inline=True, **names)
        names["bin_signal"] = signal
        sums = specialise(change.sum_eligibility_template, together, inline=True, **names)
        names["sum_eligibility"] = sums
        return specialise(change.pointwise_change_template, together, inline=True, **names)
    names |= {**of_model, "WIDTH": 1}
    kernel = "bi" if key.biexponential else "mono"
    replay = specialise(replay_template, key.label, **names)
    accumulate = specialise(accumulate_template, kernel, **names)
    calls = {"replay": replay, "accumulate": accumulate}
    own = specialise(rule.teach or rule.change, f"{key.taught}_own", **calls)
    epsilon = own
    if rule.teach is not None:
        names |= {"teach": own, "accumulate": accumulate}
        epsilon = specialise(change.epsilon_template, key.taught, **names)
    names["epsilon"] = epsilon
    learn_alone = specialise(change.learn_alone_template, key.taught, **names)
    names = {**of_rule, "THRESHOLD": names["THRESHOLD"], "learn_alone": learn_alone}
    return specialise(change.taught_change_template, together, **names)


def _threshold_row(of_model: dict[str, Any]) -> int:
    parameters = of_model["Parameters"]
    row: int = parameters._fields.index(threshold_name(parameters))
    return row
