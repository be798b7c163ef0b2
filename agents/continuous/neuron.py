"""The generalised neuron model in continuous time: equation 2 of Fil & Chu."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

from agents.continuous.flow import CLOSED_FORM, SMOOTH, SMOOTH_WHOLE, STEP, Rates, walk
from agents.continuous.steps import STEPS, Parameters, State
from agents.neurons.gnm import GNM, LARGEST_WHOLE
from agents.neurons.neuron import Neuron, PSPKernel
from gnm_env.checks import real


@dataclass(frozen=True)
class ContinuousGNM(Neuron):
    """Generalised neuron model as differential equations; the unit of time is one bin.

        dV/dt = I(t) − ηγ R V − (1−η)α V,   an input spike of channel i adds w_i to V at once
        dR/dt = ζ H(V) − β R,               H(v) = v^h / (ϑ_B^h + v^h), 0 for v <= 0
        S     = ∫ Θ(V − ϑ_R) V dt           the output: an amount where the discrete neuron spikes

    Raises ValueError if a parameter is out of range.

    Attributes:
        alpha: α > 0, rate of decay of the membrane potential per bin; may exceed 1.
        eta: η, model choice, 0 (R has no effect, V and S in closed form) … 1 (decay by R alone).
        beta: β > 0, rate of decay of R per bin; may exceed 1.
        gamma: γ > 0, strength of the decay by R, per bin.
        zeta: ζ > 0, rate at which R grows above the behavioural threshold, per bin.
        theta_b: ϑ_B > 0, behavioural threshold of the Hill function, in membrane-potential units.
        theta_r: ϑ_R > 0, readout threshold, in membrane-potential units.
        h: exponent of the Hill function, >= 1; infinity makes it a step.
        max_output: the most S that an agent gives for one bin; anything above is cut off there, as
            the environment asks for finite amounts (its own `max_output` must not be smaller).
    """

    alpha: float = 0.3
    eta: float = 0.0
    beta: float = 0.3
    gamma: float = 1.0
    zeta: float = 1.0
    theta_b: float = 1.0
    theta_r: float = 1.0
    h: float = 200.0
    max_output: float = 100.0

    name: ClassVar[str] = "continuous"
    default_initial_weight: ClassVar[float] = GNM.default_initial_weight
    parameters_type: ClassVar[type] = Parameters
    state_type: ClassVar[type] = State
    graded: ClassVar[bool] = True

    def __post_init__(self) -> None:
        for name in ("alpha", "beta", "gamma", "zeta", "theta_b", "theta_r", "max_output"):
            real(name, getattr(self, name), above=0.0)
        real("eta", self.eta, low=0.0, high=1.0)
        real("h", self.h, low=1.0, finite=False)

    @property
    def threshold(self) -> float:
        return self.theta_r

    @property
    def leak(self) -> float:
        """(1−η)α, the rate at which V decays while R is 0."""
        return (1.0 - self.eta) * self.alpha

    def rates(self) -> Rates:
        """The numbers of the equations."""
        # What the Hill function and the readout take is the same in discrete and continuous time.
        discrete = GNM(theta_b=self.theta_b, theta_r=self.theta_r, h=self.h)
        return Rates(*discrete.parameters())._replace(
            leak=self.leak, eta_gamma=self.eta * self.gamma, beta=self.beta, zeta=self.zeta
        )

    def parameters(self) -> tuple[float, ...]:
        return (*self.rates(), self.max_output, self.psp_kernel().slow)

    @property
    def widest(self) -> int:  # type: ignore[override]
        """Neurons of η > 0 take steps of their own, and so go one by one."""
        return Neuron.widest if self.eta == 0.0 else 1

    def static(self, n_inputs: int = 0) -> tuple[int, ...]:
        """How V and R go on between input spikes, and the exponent of H where it is whole."""
        if self.eta == 0.0:
            return (CLOSED_FORM, 0)
        if math.isinf(self.h):
            return (STEP, 0)
        whole = self.h <= LARGEST_WHOLE and self.h == int(self.h)
        return (SMOOTH_WHOLE, int(self.h)) if whole else (SMOOTH, 0)

    def compiled_step(self) -> tuple[str, Any]:
        return STEPS[self.eta == 0.0]

    def compiled_walk(self) -> tuple[Any, Any]:
        """The walk through input spikes at any times, and the numbers that it takes."""
        return walk, self.rates()

    def psp_kernel(self) -> PSPKernel:
        """The response to one unit spike, right after the input of each bin: e^−(1−η)α a bin."""
        return PSPKernel(math.exp(-self.leak))
