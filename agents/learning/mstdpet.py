"""MSTDPET: spike-timing-dependent plasticity, kept in a trace until the reward comes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from agents.learning.rule import Rule, average_option, decay_option
from agents.model import Block, Model
from agents.simd import like, load, store
from gnm_env.checks import real
from gnm_env.compiled import compiled
from gnm_env.segments import TrialArrays


class Parameters(NamedTuple):
    """The rule's numbers."""

    a_plus: Any
    a_minus: Any
    decay: Any
    """e^(−1/τ)"""
    decay_e: Any
    """e^(−1/τ_e)"""
    tau_e: Any


@compiled
def weigh(p: Parameters, told: Any, memory: Any) -> Any:
    """The reward itself: a trial rewarded with 0 teaches nothing."""
    return told, memory


@compiled
def side_by_side(p: Parameters, reward: Any, trial: TrialArrays, log: Any, E: Block) -> Any:
    """r E_i at the end of the trial.

    What an input spike in bin t adds to E_i is the same for all channels: A⁺ Σ_(t_o>=t) e^(−(t_o −
    t)/τ) g(t_o) − A⁻ P⁻(t) g(t), with g(t) what is left at the end of what was added in bin t, and
    P⁻(t) = Σ_(t_o<=t) e^(−(t − t_o)/τ).
    """
    n_bins = trial.edges[len(trial.edges) - 1]
    zero = like(0.0, reward)
    before = np.empty((n_bins, E.shape[1]))
    faded = zero
    for t in range(n_bins):
        faded = p.decay * faded + load(log.output, t, zero)
        store(before, t, faded)
    for i in range(len(E)):
        store(E, i, zero)
    after, left = zero, reward / p.tau_e
    for t in range(n_bins - 1, -1, -1):
        after = p.decay * after + load(log.output, t, zero) * left
        gain = p.a_plus * after - p.a_minus * load(before, t, zero) * left
        for e in range(trial.offsets[t], trial.offsets[t + 1]):
            store(E, trial.channels[e], load(E, trial.channels[e], zero) + gain)
        left = p.decay_e * left
    return reward != 0.0


@dataclass(frozen=True)
class MSTDPET(Rule):
    """Reward-modulated STDP with an eligibility trace, after Florian (Neural Computation 2007).

    P⁺_i ← e^(−1/τ) P⁺_i + s_i, P⁻ ← e^(−1/τ) P⁻ + z; e_i = A⁺ P⁺_i z − A⁻ P⁻ s_i, both traces being
    moved on first, so that a pair in one bin counts both ways; E_i ← e^(−1/τ_e) E_i + e_i/τ_e. At
    the end of the trial Δw_i = λ r E_i with the reward r = −|label − emitted|, no baseline: a trial
    without error teaches nothing, and every other one unlearns what was done.

    Feedback: the reward of the trial. On every spiking neuron. Constants as published. Raises
    ValueError if a parameter is out of range.

    Attributes:
        learning_rate: λ.
        momentum: fraction of the previous weight change that is added, 0 … 1.
        tau: τ in bins, of pairs.
        tau_e: τ_e in bins, of the eligibility trace.
        a_plus, a_minus: A⁺ and A⁻.
        decay_trials: trials over which the learning rate falls to 0 in a line; None: constant.
        average_over: first and last trial, counted from 1, of those after which the weights
            count for a mean, which they become after the last; None: no averaging.
    """

    learning_rate: float = 1e-2
    momentum: float = 0.2
    tau: float = 20.0
    tau_e: float = 25.0
    a_plus: float = 1.0
    a_minus: float = 1.0
    decay_trials: int | None = decay_option()
    average_over: tuple[int, int] | None = average_option()

    name: ClassVar[str] = "mstdpet"
    feedback: ClassVar[str] = "reward"
    needs_spikes: ClassVar[bool] = True
    uses_output: ClassVar[bool] = True
    parameters_type: ClassVar[Any] = Parameters
    weigh: ClassVar[Any] = weigh
    side_by_side: ClassVar[Any] = side_by_side

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("a_plus", "a_minus"):
            real(name, getattr(self, name))
        for name in ("tau", "tau_e"):
            real(name, getattr(self, name), above=0.0)

    def own_numbers(self, model: Model) -> tuple[float, ...]:
        decay, decay_e = math.exp(-1.0 / self.tau), math.exp(-1.0 / self.tau_e)
        return (self.a_plus, self.a_minus, decay, decay_e, self.tau_e)
