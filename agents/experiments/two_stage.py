"""A linear neuron of two stages, and the error of backpropagation without a hidden layer.

Together they are what a network with one hidden neuron would be without its sigmoid: the input
passes two leaky integrators in series, and the weights follow the gradient of the same objective.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

from agents.learning.rule import Rule, average_option, decay_option
from agents.neurons.neuron import Neuron, PSPKernel, Response
from agents.simd import where
from gnm_env.checks import real
from gnm_env.compiled import inlined
from gnm_env.rules import compiled_rising as rising


class Parameters(NamedTuple):
    """The numbers of the neuron as compiled code takes them."""

    slow: Any
    """1 − α"""
    fast: Any
    """1 − α₂"""
    scale: Any
    """Makes the largest response to a single unit spike 1."""
    theta: Any


class State(NamedTuple):
    """What passes from bin to bin."""

    slow: Any
    """Σ w (1−α)^(t−t_j) over the input spikes so far."""
    fast: Any
    """Σ w (1−α₂)^(t−t_j), likewise."""
    V: Any


@inlined
def step(
    p: Parameters, static: tuple[int, ...], state: State, current: Any
) -> tuple[State, Response]:
    """One bin: V(t) = scale Σ_j w [(1−α)^(t−t_j) − (1−α₂)^(t−t_j)], without any reset."""
    zero = current * 0.0
    slow = p.slow * state.slow + current
    fast = p.fast * state.fast + current
    V = p.scale * (slow - fast)
    spike = rising(p.theta, V, state.V)
    return State(slow, fast, V), Response(V, zero, zero, V, p.theta <= V, spike)


@dataclass(frozen=True)
class TwoStage(Neuron):
    """Two leaky integrators in series, the second hearing the first with a delay of one bin.

        v(t) = (1 − α) v(t−1) + Σ_i w_i s_i(t),  V(t) = (1 − α₂) V(t−1) + k v(t−1)

    with k such that a single unit spike lifts V to at most 1: the multi-spike tempotron's response
    without its resets. Raises ValueError unless 0 < alpha < alpha_2 <= 1 and theta > 0.

    Attributes:
        alpha: α, decay of the slower stage per bin.
        alpha_2: α₂, decay of the faster stage per bin.
        theta: ϑ, threshold, in membrane-potential units.
    """

    alpha: float = 0.2
    alpha_2: float = 0.4
    theta: float = 1.0

    name: ClassVar[str] = "two-stage"
    default_initial_weight: ClassVar[float] = 0.05
    parameters_type: ClassVar[type] = Parameters
    state_type: ClassVar[type] = State
    step: ClassVar[Any] = step

    def __post_init__(self) -> None:
        real("alpha", self.alpha, above=0.0, high=1.0)
        real("alpha_2", self.alpha_2, above=0.0, high=1.0)
        real("theta", self.theta, above=0.0)
        if not self.alpha < self.alpha_2:
            raise ValueError(
                f"alpha_2, the decay of the faster stage, must be above alpha = {self.alpha:g}, "
                f"got {self.alpha_2:g}"
            )

    def parameters(self) -> tuple[float, ...]:
        kernel = self.psp_kernel()
        return (kernel.slow, kernel.fast, kernel.scale, self.theta)

    def psp_kernel(self) -> PSPKernel:
        """scale [(1−α)^t − (1−α₂)^t], its largest value in whole bins being 1."""
        slow, fast = 1.0 - self.alpha, 1.0 - self.alpha_2
        # The response rises, then falls: its largest value is before the first fall.
        t = 1
        while slow ** (t + 1) - fast ** (t + 1) > slow**t - fast**t:
            t += 1
        return PSPKernel(slow, fast, 1.0 / (slow**t - fast**t), biexponential=True)


@inlined
def bin_signal(p: Any, b: Any) -> Any:
    """E(t), but where a presentation is owed more spikes, only in bins below the threshold."""
    return where((b.E > 0.0) & (b.threshold <= b.V), 0.0, b.E)


@dataclass(frozen=True)
class GradientOfError(Rule):
    """The gradient of J = Σ_t E(t) V(t), with E as `BackPropagation` has it by default.

    For a network without a hidden layer the two are the same, but for the limit that
    backpropagation sets to the length of a step. Raises ValueError if a parameter is out of range.

    Attributes:
        learning_rate: λ, weight change per unit of eligibility.
        momentum: fraction of the previous weight change that is added, 0 … 1.
        decay_trials: trials over which the learning rate falls to 0 in a line; None: constant.
        average_over: first and last trial, counted from 1, of those after which the weights
            count for a mean, which they become after the last; None: no averaging.
    """

    learning_rate: float = 3e-3
    momentum: float = 0.2
    decay_trials: int | None = decay_option()
    average_over: tuple[int, int] | None = average_option()

    name: ClassVar[str] = "gradient-of-error"
    feedback: ClassVar[str] = "presentations"
    uses_error: ClassVar[bool] = True
    bin_signal: ClassVar[Any] = bin_signal
