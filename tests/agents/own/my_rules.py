"""Rules of a user's own: one of V and E in a bin, one of the whole trial."""

from dataclasses import dataclass
from typing import Any, ClassVar

from agents.learning.rule import Rule


@dataclass(frozen=True)
class OwnTempotron(Rule):
    """Too few: the highest potential below threshold up; too many: the highest of all down.

    Attributes:
        learning_rate: weight change per unit of eligibility.
        momentum: fraction of the previous change that is added.
        slack: how far below the threshold a bin may be to count.
    """

    learning_rate: float = 1e-2
    momentum: float = 0.2
    slack: float = 5.0
    name: ClassVar[str] = "own-tempotron"
    feedback: ClassVar[str] = "sign"

    @staticmethod
    def teach(p: Any, trial: Any, y: Any) -> None:
        best, height = -1, trial.threshold - p.slack
        for t in range(len(trial.V)):
            counts = trial.V[t] < trial.threshold if trial.error > 0.0 else True
            if counts and trial.V[t] > height:
                best, height = t, trial.V[t]
        if best >= 0:
            y[best] = trial.error


@dataclass(frozen=True)
class Squared(Rule):
    """E(t) weighted by V², where that is positive."""

    learning_rate: float = 1e-3
    momentum: float = 0.2
    name: ClassVar[str] = "squared"
    feedback: ClassVar[str] = "presentations"
    uses_error: ClassVar[bool] = True

    @staticmethod
    def teaching_signal(static: Any, V: Any, E: Any) -> Any:
        return E * V**2 if 0.0 < V <= 5.0 and not V < 0.0 else -abs(E) * 0.0
