"""STDP: inputs just before an output spike grow, those just after it shrink."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from agents.learning.rule import Rule, average_option, decay_option
from agents.model import Block, Model
from agents.simd import like, load, store, where
from gnm_env.checks import real
from gnm_env.compiled import compiled
from gnm_env.segments import TrialArrays


class Parameters(NamedTuple):
    """The rule's numbers."""

    a_plus: Any
    a_minus: Any
    plus: Any
    """e^(−1/τ⁺)"""
    minus: Any
    """e^(−1/τ⁻)"""


@compiled
def side_by_side(p: Parameters, c: Any, trial: TrialArrays, log: Any, eligibility: Block) -> Any:
    """Forward, each input with the output before it; backward, each with the output after it.

    `paired` keeps the number of the output that the channel's last pair was with: forward 1, 2, …,
    backward −1, −2, … Only the first input on each side of an output is immediate.
    """
    n_bins = trial.edges[len(trial.edges) - 1]
    zero = like(0.0, c)
    paired = np.zeros(eligibility.shape)
    for i in range(len(eligibility)):
        store(eligibility, i, zero)
    number, faded = zero, zero
    for t in range(n_bins):
        faded = p.minus * faded
        for e in range(trial.offsets[t], trial.offsets[t + 1]):
            i = trial.channels[e]
            pair = where(load(paired, i, zero) != number, p.a_minus * faded, zero)
            store(eligibility, i, load(eligibility, i, zero) - pair)
            store(paired, i, number)
        z = load(log.output, t, zero)
        number = number + z
        faded = where(z > 0.0, 1.0, faded)
    taught = number > 0.0
    number, faded = zero, zero
    for t in range(n_bins - 1, -1, -1):
        z = load(log.output, t, zero)
        number = number - z
        faded = where(z > 0.0, 1.0, p.plus * faded)
        for e in range(trial.offsets[t], trial.offsets[t + 1]):
            i = trial.channels[e]
            pair = where(load(paired, i, zero) != number, p.a_plus * faded, zero)
            store(eligibility, i, load(eligibility, i, zero) + pair)
            store(paired, i, number)
    return taught


@dataclass(frozen=True)
class STDP(Rule):
    """Spike-timing-dependent plasticity, after Masquelier et al. (2008): the unsupervised floor.

    Immediate pairs only. Up, a⁺ e^(−Δ/τ⁺): an output spike with the last input spike of a channel
    at or before it, unless an earlier output spike lies between, or in that input's bin. Down,
    a⁻ e^(−Δ/τ⁻): an input spike with the last output spike in an earlier bin, unless another input
    spike of the channel lies between. Changes add up over the trial and act at its end.

    Feedback: none; every trial with output teaches, right or wrong. On every spiking neuron. Leave
    the weights in (0, 1). The published amounts are those at λ = 1; the constants are recalled, and
    confirmed by a public repetition. Raises ValueError if a parameter is out of range.

    Attributes:
        learning_rate: λ, factor of all changes.
        momentum: fraction of the previous weight change that is added, 0 … 1.
        a_plus, a_minus: a⁺ and a⁻, largest change up and down.
        tau_plus, tau_minus: τ⁺ and τ⁻ in bins.
        decay_trials: trials over which the learning rate falls to 0 in a line; None: constant.
        average_over: first and last trial, counted from 1, of those after which the weights
            count for a mean, which they become after the last; None: no averaging.
    """

    learning_rate: float = 1.0
    momentum: float = 0.0
    a_plus: float = 0.03125
    a_minus: float = 0.85 * 0.03125
    tau_plus: float = 16.8
    tau_minus: float = 33.7
    decay_trials: int | None = decay_option()
    average_over: tuple[int, int] | None = average_option()

    name: ClassVar[str] = "stdp"
    feedback: ClassVar[str] = "none"
    needs_spikes: ClassVar[bool] = True
    uses_output: ClassVar[bool] = True
    parameters_type: ClassVar[Any] = Parameters
    side_by_side: ClassVar[Any] = side_by_side

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("a_plus", "a_minus"):
            real(name, getattr(self, name), low=0.0)
        for name in ("tau_plus", "tau_minus"):
            real(name, getattr(self, name), above=0.0)

    def own_numbers(self, model: Model) -> tuple[float, ...]:
        plus, minus = math.exp(-1.0 / self.tau_plus), math.exp(-1.0 / self.tau_minus)
        return (self.a_plus, self.a_minus, plus, minus)
