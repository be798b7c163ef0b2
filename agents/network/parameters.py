"""What a network is made of, and how it learns: numbers that check themselves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from agents.learning.rule import Rule, average_option, decay_option
from agents.model import Model, PSPKernel
from agents.network.backpropagation import RuleNumbers, backpropagated_change
from agents.network.dynamics import NetworkParams, State, advance_for, largest_ratio
from gnm_env.checks import choice, real, whole

MAX_HIDDEN = 10_000
"""Most hidden neurons of a Network: with more, the record of one trial fills the memory."""

NOISE_ERRORS = ("above", "spikes")


@dataclass(frozen=True)
class Network(Model):
    """A hidden layer of GNM neurons (η = 0), and a GNM neuron that reads it out.

    With the input spikes s, the weights W (N, H) and u (H,), and all else 0 before the first bin:

        v_k(t) = (1 − α) v_k(t−1) − c Σ_{l≠k} z_l(t−1) + Σ_i W_ik s_i(t)    hidden potentials
        z_k(t) = H(v_k(t)), H(v) = v^h / (ϑ_B^h + v^h), 0 for v ≤ 0         hidden outputs
        j_k(t) = (1 − κ) j_k(t−1) + z_k(t)                                  decaying currents
        V(t)   = (1 − α) V(t−1) + Σ_k u_k j_k(t)                            potential of the readout

    An output spike is an upward crossing of ϑ_R by V. Raises ValueError if a parameter is out of
    range.

    Attributes:
        hidden: H, number of hidden neurons; None leaves the layer out, V(t) = (1 − α) V(t−1) +
            Σ_i u_i s_i(t) with u (N,), to compare with error-trace learning.
        alpha: α, decay per bin of all membrane potentials, 0 … 1.
        inhibition: c, what each unit of a hidden neuron's output takes from the potentials of the
            others in the next bin.
        kappa: κ, decay per bin of the currents into the readout, 0 … 1.
        theta_b: ϑ_B, potential at which a hidden neuron gives half of its full output.
        h: exponent of the Hill function, finite and >= 1; an infinite one has no gradient.
        theta_r: ϑ_R, readout threshold.
    """

    hidden: int | None = 10
    alpha: float = 0.3
    inhibition: float = 0.05
    kappa: float = 0.9
    theta_b: float = 1.0
    h: float = 4.0
    theta_r: float = 1.0

    name: ClassVar[str] = "network"
    default_initial_weight: ClassVar[float] = 0.3
    parameters_type: ClassVar[type] = NetworkParams
    state_type: ClassVar[type] = State
    widest: ClassVar[int] = 8
    kind: ClassVar[str] = "network"

    def __post_init__(self) -> None:
        if self.hidden is not None:
            object.__setattr__(self, "hidden", _checked_hidden(self.hidden))
        for name in ("alpha", "kappa"):
            real(name, getattr(self, name), low=0.0, high=1.0)
        real("inhibition", self.inhibition, low=0.0)
        for name in ("theta_b", "theta_r"):
            real(name, getattr(self, name), above=0.0)
        real("h", self.h, low=1.0)
        if not np.isfinite(np.float64(self.h) / np.float64(self.theta_b)):
            raise ValueError(
                f"h / theta_b, the steepness of the Hill function, must be finite, got h = "
                f"{self.h:g} and theta_b = {self.theta_b:g}: choose a larger theta_b"
            )

    @property
    def width(self) -> int:
        """H, 0 where there is no hidden layer."""
        return self.hidden or 0

    @property
    def threshold(self) -> float:
        """The readout's threshold for an output spike."""
        return self.theta_r

    def parameters(self) -> tuple[float, ...]:
        return (
            self.alpha, self.inhibition, self.kappa, self.theta_b, self.h, self.theta_r,
            largest_ratio(self.h),
        )  # fmt: skip

    def static(self, n_inputs: int) -> tuple[int, ...]:
        """Inputs and hidden neurons."""
        return (n_inputs, self.width)

    def advance(self) -> tuple[str, Any]:
        return advance_for(self.h == 4.0, self.theta_b == 1.0)

    def n_weights(self, n_inputs: int) -> int:
        """N·H + H, or N without a hidden layer."""
        return (n_inputs + 1) * self.width or n_inputs

    @property
    def n_memory(self) -> int:
        """v, z and j of the hidden neurons."""
        return 3 * self.width

    @property
    def n_notes(self) -> int:
        """H'(v) and j of the hidden neurons, in each bin."""
        return 2 * self.width


def _checked_hidden(value: Any) -> int:
    try:
        return whole("hidden", value, low=1, high=MAX_HIDDEN)
    except ValueError as error:
        raise ValueError(
            f"{error}; for a neuron without a hidden layer use NeuronAgent with ErrorTrace"
        ) from None


@dataclass(frozen=True)
class BackPropagation(Rule):
    """Backpropagation of the error trace (BP): ascend J = Σ_t E(t) V(t), with E held fixed.

    E(t) is, over each presentation of a pattern, the spikes that it is owed less those given in it,
    and over noise −1 where `noise_error` says. The gradient is exact, through time and through the
    inhibition. Raises ValueError if a parameter is out of range.

    Attributes:
        learning_rate_hidden: λ of the weights W into the hidden layer.
        learning_rate_output: λ of the weights u into the readout.
        momentum: fraction of the previous weight change that is added, 0 … 1.
        noise_error: where in noise E is −1: "above", in every bin with V ≥ ϑ_R, or "spikes", only
            in those with an output spike.
        lift_above: whether a presentation that is owed more spikes raises V in all of its bins, as
            in error-trace learning, or only in those with V < ϑ_R: an upward crossing cannot begin
            in the others, and raising them too keeps a network that is above threshold for long
            there for ever.
        max_step: longest step that one trial may cause, momentum aside: the Euclidean length of the
            change of all weights together; infinity sets no limit.
        decay_trials: trials over which the learning rates fall to 0 in a line; None: constant.
        average_over: first and last trial, counted from 1, of those after which the weights
            count for a mean, which they become after the last; None: no averaging.
    """

    learning_rate_hidden: float = 3e-3
    learning_rate_output: float = 3e-3
    momentum: float = 0.2
    noise_error: str = "above"
    lift_above: bool = False
    max_step: float = 0.3
    decay_trials: int | None = decay_option()
    average_over: tuple[int, int] | None = average_option()

    name: ClassVar[str] = "bp"
    feedback: ClassVar[str] = "presentations"
    uses_error: ClassVar[bool] = True
    parameters_type: ClassVar[Any] = RuleNumbers
    block_change: ClassVar[Any] = backpropagated_change
    learning_rate: ClassVar[float] = 1.0  # type: ignore[misc]

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("learning_rate_hidden", "learning_rate_output"):
            real(name, getattr(self, name), low=0.0)
        choice("noise_error", self.noise_error, NOISE_ERRORS)
        if not isinstance(self.lift_above, (bool, np.bool_)):
            raise ValueError(f"lift_above must be True or False, got {self.lift_above!r}")
        real("max_step", self.max_step, above=0.0, finite=False)

    def kernel(self, model: Model) -> PSPKernel:
        """None is needed: the gradient runs through the network itself."""
        if not isinstance(model, Network):
            raise ValueError(
                f"BackPropagation trains a Network; for {type(model).__name__} take another rule, "
                "such as ErrorTrace, which is the same without a hidden layer"
            )
        return PSPKernel(0.0)

    def parameters(self, model: Model, bounds: tuple[float, float]) -> tuple[float, ...]:
        common = super().parameters(model, bounds)[: -len(RuleNumbers._fields)]
        return (*common, *self.numbers())

    def numbers(self) -> RuleNumbers:
        """What is its own, as compiled code takes it."""
        return RuleNumbers(
            float(self.learning_rate_hidden),
            float(self.learning_rate_output),
            float(self.noise_error == "spikes"),
            float(self.lift_above),
            float(self.max_step),
        )
