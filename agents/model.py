"""What the training loops ask of a model: a neuron, a continuous neuron, a network.

A model is a frozen dataclass of the parameters that a user sets. It offers the loops

- `parameters_type`, a NamedTuple of the numbers that compiled code needs, one per lane, and
  `parameters()`, their values;
- `state_type`, a NamedTuple of what passes from bin to bin in registers; all zeros at the beginning
  of a trial. A model with many variables keeps them in `n_memory` rows of memory instead;
- `advance(p, static, arrays, state, channels, first, last, row) -> (state, response)`: one bin, in
  which channels[first:last] spike, compiled, for one model or for many side by side (see
  `agents.simd`). `arrays` are the block's `Arrays`, of which `notes` has `n_notes` rows for each
  bin of a trial, from `row` on, for what learning wants to know;
- `graded`: whether the response's output is an amount `S` instead of a `spike`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from agents import registry

Block = NDArray[np.float64]
"""WIDTH models side by side: (rows, WIDTH); of many blocks, (blocks, rows, WIDTH)."""


class Arrays(NamedTuple):
    """What a model's step reads and writes beside its state; a block each."""

    weights: Block
    memory: Block
    notes: Block


class Response(NamedTuple):
    """What a model shows in one bin; units of membrane potential unless said otherwise."""

    V: Any
    """Membrane potential, before any reset that the bin's spike causes."""
    D: Any
    """What the bin took away from the membrane potential: decay, or a soft reset."""
    R: Any
    """The model's own reset variable (dimensionless; bins for a refractory period)."""
    X: Any
    """Readout, compared with the threshold."""
    above: Any
    """Whether the readout is at or above the threshold."""
    spike: Any
    """Whether an output spike falls into this bin."""


class PSPKernel(NamedTuple):
    """The presynaptic trace: a neuron's linear response to one unit input spike, t bins later.

    slow^t, or scale·(slow^t − fast^t) where it is biexponential.
    """

    slow: float
    fast: float = 0.0
    scale: float = 1.0
    biexponential: bool = False


class Model(ABC):
    """Base of all models. Each adds its parameters as a frozen dataclass."""

    name: ClassVar[str]
    default_initial_weight: ClassVar[float]
    parameters_type: ClassVar[type]
    state_type: ClassVar[type]
    graded: ClassVar[bool] = False
    """Whether the output of a bin is an amount instead of a spike."""
    widest: ClassVar[int] = 32
    """Most models side by side in one block: with more, what they work on leaves the cache."""

    needs: ClassVar[tuple[str, ...]] = ("state_type", "default_initial_weight")
    """What a class must have to be trained."""

    kind: ClassVar[str] = "neuron"
    """Where it is registered: see `agents.registry`."""

    def __init_subclass__(cls, **keywords: Any) -> None:
        super().__init_subclass__(**keywords)
        registry.register(cls.kind, cls, ("step", "advance", "compiled_step"))

    @abstractmethod
    def parameters(self) -> tuple[float, ...]:
        """The numbers of `parameters_type`, in order."""

    @property
    @abstractmethod
    def threshold(self) -> float:
        """The readout's threshold for an output spike, in units of the readout."""

    @property
    def reads_V(self) -> bool:
        """Whether the readout X is the membrane potential V itself. False is safe, but slower."""
        return False

    @property
    def readout_lag(self) -> int:
        """Bins by which the readout is behind the potential that it shows."""
        return 0

    @abstractmethod
    def advance(self) -> tuple[str, Any]:
        """A label that tells this compiled step from every other, and the step."""

    def recording(self) -> tuple[str, Any]:
        """As `advance`: the step that computes every variable, also those that do not act back."""
        return self.advance()

    def static(self, n_inputs: int) -> tuple[int, ...]:
        """Whole numbers that compiled code branches on; models side by side must share them."""
        return (0,)

    def n_weights(self, n_inputs: int) -> int:
        """Number of weights of a model with so many input channels."""
        return n_inputs

    @property
    def n_memory(self) -> int:
        """Rows of memory."""
        return 0

    @property
    def n_notes(self) -> int:
        """Rows of notes per bin."""
        return 0

    def initial_weights(self, rng: Generator, n_inputs: int, scale: float) -> NDArray[np.float64]:
        """Weights uniform on [0, scale), in the order in which the model keeps them."""
        return rng.random(self.n_weights(n_inputs)) * scale

    def psp_kernel(self) -> PSPKernel | None:
        """The presynaptic trace; None for a model whose potential is not linear in its inputs."""
        return None


def threshold_name(parameters: Any) -> str:
    """The name of the readout's threshold among the parameters of a neuron."""
    for name in ("theta_r", "theta"):
        if name in parameters._fields:
            return name
    raise ValueError(
        f"the parameters of a neuron must hold its threshold under the name theta or theta_r, "
        f"got {', '.join(parameters._fields)}"
    )
