"""What every neuron offers: parameters that check themselves, and one compiled step.

A neuron is one file beside this one. It holds

- a frozen dataclass, derived from `Neuron`, with the parameters that a user sets;
- `Parameters`, a NamedTuple of the numbers that the step needs, one per lane;
- `State`, a NamedTuple of what passes from bin to bin; all zeros at the beginning of a trial;
- `step(p, mode, state, drive) -> (state, Response)`: one bin, compiled, for one neuron or for many
  side by side (see `agents.simd`). `drive` is I(t), the weighted input of the bin.

The dataclass names the two types in `parameters_type` and `state_type`; its method `step` gives the
compiled step that suits its parameters.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, ClassVar, NamedTuple


class Response(NamedTuple):
    """What a neuron shows in one bin; units of membrane potential unless said otherwise."""

    V: Any
    """Membrane potential, before any reset that the bin's spike causes."""
    D: Any
    """What the bin took away from the membrane potential: decay, or a soft reset."""
    R: Any
    """The neuron's own reset variable (dimensionless; bins for a refractory period)."""
    X: Any
    """Readout, compared with the threshold."""
    above: Any
    """Whether the readout is at or above the threshold."""
    spike: Any
    """Whether an output spike falls into this bin."""


class Trace(NamedTuple):
    """The presynaptic trace: a neuron's linear response to one unit input spike, t bins later.

    slow^t if `double` is false, else scale·(slow^t − fast^t).
    """

    slow: float
    fast: float = 0.0
    scale: float = 1.0
    double: bool = False


class Neuron(ABC):
    """Base of all neurons. Each adds its fields as a frozen dataclass."""

    name: ClassVar[str]
    default_initial_weight: ClassVar[float]
    parameters_type: ClassVar[type]
    state_type: ClassVar[type]
    graded: ClassVar[bool] = False
    """Whether the output of a bin is an amount instead of a spike."""

    @abstractmethod
    def parameters(self) -> tuple[float, ...]:
        """The numbers of `parameters_type`, in order."""

    @abstractmethod
    def trace(self) -> Trace:
        """The neuron's own presynaptic trace."""

    @property
    @abstractmethod
    def threshold(self) -> float:
        """The readout's threshold for an output spike."""

    @abstractmethod
    def step(self) -> tuple[str, Any]:
        """The compiled step, and a name that tells it from every other step."""

    def recording_step(self) -> tuple[str, Any]:
        """The step that computes every variable, also those that do not act back."""
        return self.step()

    def mode(self) -> tuple[int, ...]:
        """Switches of the step that are not numbers; neurons side by side must share them."""
        return (0,)
