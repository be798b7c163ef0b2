"""What a trial environment is made from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np
from gymnasium import spaces

from gnm_env.base.params import EnvParams, HasParams
from gnm_env.checks import choice, real
from gnm_env.trials import Trials

FEEDBACK = ("cost", "sign", "dense")
OUTPUT = ("spikes", "graded")


@dataclass(frozen=True, kw_only=True)
class TrialEnvParams(EnvParams):
    """An EnvParams with what only trials need.

    Attributes:
        trials: a data set of trials, in place of a task and its patterns.
        feedback: "cost", "sign" or "dense".
        output: "spikes" or "graded".
        max_output: greatest amount in one bin, > 0; belongs to "graded".
        tolerance: errors up to this count as none, >= 0; belongs to "graded".
    """

    trials: Trials | None = None
    feedback: str = "cost"
    output: str = "spikes"
    max_output: float = 100.0
    tolerance: float = 0.0

    def __post_init__(self) -> None:
        self._put("feedback", choice("feedback", self.feedback, FEEDBACK))
        self._put("output", choice("output", self.output, OUTPUT))
        self._put("max_output", real("max_output", self.max_output, above=0.0))
        self._put("tolerance", real("tolerance", self.tolerance, low=0.0))
        if self.tolerance > 0.0 and not self.graded:
            raise ValueError(
                f"tolerance belongs to output='graded', got {self.tolerance:g} with "
                "output='spikes': leave it out"
            )
        super().__post_init__()

    def _resolve(self) -> None:
        if self.trials is None:
            super()._resolve()
            return
        beside = [name for name in ("task", "patterns") if getattr(self, name) is not None]
        beside += list(self.task_fields)
        if self.pattern_seed != 0:
            beside.append("pattern_seed")
        if beside:
            raise ValueError(
                f"give either trials or a task with its patterns, got trials and "
                f"{', '.join(beside)}"
            )
        if not isinstance(self.trials, Trials):
            raise ValueError(
                f"trials must be gnm_env.Trials, got {type(self.trials).__name__}; "
                "use Trials([trial, …])"
            )
        if self.feedback == "dense" and self.trials.arrays.label_only.any():
            require_presentations("trials")

    @property
    def n_inputs(self) -> int:
        """N, number of input channels."""
        return super().n_inputs if self.trials is None else self.trials.n_inputs

    @property
    def graded(self) -> bool:
        """Whether actions are amounts of output instead of spikes."""
        return self.output == "graded"

    @property
    def action_space(self) -> spaces.Space[Any]:
        """The action space of one environment."""
        if self.graded:
            return spaces.Box(0.0, self.max_output, (1,), np.float64)
        return spaces.Discrete(2)


class HasTrialParams(HasParams):
    """What a trial environment tells of its arguments; none of it can be changed afterwards."""

    _params: TrialEnvParams

    @property
    def trials(self) -> Trials | None:
        """The data set that trials come from; None where they are drawn."""
        return self._params.trials

    @property
    def feedback(self) -> str:
        """One of FEEDBACK."""
        return self._params.feedback

    @property
    def output(self) -> str:
        """One of OUTPUT."""
        return self._params.output

    @property
    def max_output(self) -> float:
        """Greatest amount in one bin, where output is graded."""
        return self._params.max_output

    @property
    def tolerance(self) -> float:
        """Errors up to this count as none."""
        return self._params.tolerance


def require_presentations(name: str) -> NoReturn:
    """Refuse a trial, or a data set with one, of which only the label is known."""
    raise ValueError(
        f"feedback='dense' needs to know where the label was earned, and {name} has the label "
        "alone: use feedback='cost' or 'sign'"
    )
