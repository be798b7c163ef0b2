"""The generalised neuron model in continuous time: equation 2 of Fil & Chu."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from agents.continuous.flow import Rates
from agents.neurons.gnm import GNM
from agents.neurons.neuron import Trace
from gnm_env.checks import real


@dataclass(frozen=True)
class ContinuousGNM:
    """Generalised neuron model as differential equations; the unit of time is one bin.

        dV/dt = I(t) − ηγ R V − (1−η)α V,   an input spike of channel i adds w_i to V at once
        dR/dt = ζ H(V) − β R,               H(v) = v^h / (ϑ_B^h + v^h), 0 for v <= 0
        S     = ∫ Θ(V − ϑ_R) V dt           the output: an amount where the discrete neuron spikes

    Raises ValueError if a parameter is out of range.

    Attributes:
        alpha: α > 0, rate of decay of the membrane potential per bin; may exceed 1.
        eta: η, model choice, 0 (R has no effect, all is known in closed form) … 1 (decay by R alone).
        beta: β > 0, rate of decay of R per bin; may exceed 1.
        gamma: γ > 0, strength of the decay by R, per bin.
        zeta: ζ > 0, rate at which R grows above the behavioural threshold, per bin.
        theta_b: ϑ_B > 0, behavioural threshold of the Hill function, in membrane-potential units.
        theta_r: ϑ_R > 0, readout threshold, in membrane-potential units.
        h: exponent of the Hill function, >= 1; infinity makes it a step.
    """

    alpha: float = 0.3
    eta: float = 0.0
    beta: float = 0.3
    gamma: float = 1.0
    zeta: float = 1.0
    theta_b: float = 1.0
    theta_r: float = 1.0
    h: float = 200.0

    default_initial_weight: ClassVar[float] = GNM.default_initial_weight

    def __post_init__(self) -> None:
        for name in ("alpha", "beta", "gamma", "zeta", "theta_b", "theta_r"):
            real(name, getattr(self, name), above=0.0)
        real("eta", self.eta, low=0.0, high=1.0)
        real("h", self.h, low=1.0, finite=False)

    @property
    def threshold(self) -> float:
        """ϑ_R."""
        return self.theta_r

    @property
    def leak(self) -> float:
        """(1−η)α, the rate at which V decays while R is 0."""
        return (1.0 - self.eta) * self.alpha

    def rates(self) -> Rates:
        """The numbers that the compiled functions take."""
        return Rates(
            self.leak,
            self.eta * self.gamma,
            self.beta,
            self.zeta,
            *self._thresholds().parameters()[4:],
        )

    def mode(self) -> tuple[int, ...]:
        """How V is carried from one input spike to the next; see `agents.continuous.flow`."""
        return self._thresholds().mode()

    def recording_mode(self) -> tuple[int, ...]:
        """The mode in which R is computed too, also where it does not act back."""
        return self._thresholds().recording_mode()

    def _thresholds(self) -> GNM:
        """The discrete neuron with this one's thresholds: its Hill function and readout are ours."""
        return GNM(eta=self.eta, theta_b=self.theta_b, theta_r=self.theta_r, h=self.h)

    def trace(self) -> Trace:
        """The presynaptic trace at the end of each bin's input: it decays by e^−(1−η)α a bin."""
        return Trace(math.exp(-self.leak))
