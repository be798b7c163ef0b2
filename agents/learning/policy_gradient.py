"""PolicyGradient: a neuron whose spikes are drawn, and whose odds follow the reward."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

from agents.learning.logistic import logistic
from agents.learning.rule import BinOfTrial, Rule, average_option, decay_option
from agents.model import Model, PSPKernel
from agents.neurons.gnm import GNM
from agents.simd import like, where
from gnm_env.checks import real
from gnm_env.compiled import compiled


class Parameters(NamedTuple):
    """The rule's numbers."""

    slope: Any
    """1/ΔV"""
    baseline_rate: Any


class Memory(NamedTuple):
    """What it remembers."""

    baseline: Any
    """r̄"""
    seen: Any
    """1 once there was a trial."""


@compiled
def spike_probability(p: Parameters, V: Any, threshold: Any) -> Any:
    """P = σ((V − ϑ)/ΔV)."""
    return logistic((V - threshold) * p.slope)


@compiled
def bin_signal(p: Parameters, b: BinOfTrial) -> Any:
    """y(t) = (r − r̄) (z(t) − P(t)) / ΔV; X is P − z."""
    return b.E * p.slope * -b.X


@compiled
def weigh(p: Parameters, reward: Any, memory: Memory) -> tuple[Any, Memory]:
    """r − r̄, and r̄ moved on; before the first trial r̄ is its reward."""
    baseline = where(memory.seen > 0.0, memory.baseline, reward)
    advantage = reward - baseline
    return advantage, Memory(baseline + p.baseline_rate * advantage, like(1.0, reward))


@dataclass(frozen=True)
class PolicyGradient(Rule):
    """REINFORCE with escape noise (Williams 1992; Xie & Seung 2004): learns from reward alone.

    While it learns, the neuron's output spikes are drawn: in each bin with probability
    P = σ((V − ϑ)/ΔV), neighbouring bins too, from the agent's own generator, default_rng((seed,
    3)). At the end y(t) = (r − r̄)(z(t) − P(t))/ΔV: the gradient of the expected reward, exact at
    η = 0; at η > 0 R follows V, and the trace leaves it out. r̄ is a running mean of r, moved after
    the lesson; the first trial teaches nothing. `act` draws; `predict`, `record` and the scores,
    where nothing is learned, answer by the threshold.

    Feedback: the reward of the trial, −|label − emitted|. For neurons without reset: the GNM with
    readout V. Defaults were chosen on pattern seeds 16–23. Raises ValueError if a parameter is out
    of range.

    Attributes:
        learning_rate: λ; weights are best left unbounded.
        momentum: fraction of the previous weight change that is added, 0 … 1.
        width: ΔV, in membrane-potential units: how soft the threshold is.
        baseline_rate: ρ of r̄ ← r̄ + ρ(r − r̄), 0 … 1.
        decay_trials: trials over which the learning rate falls to 0 in a line; None: constant.
        average_over: first and last trial, counted from 1, of those after which the weights
            count for a mean, which they become after the last; None: no averaging.
    """

    learning_rate: float = 1e-4
    momentum: float = 0.2
    width: float = 0.1
    baseline_rate: float = 0.05
    decay_trials: int | None = decay_option()
    average_over: tuple[int, int] | None = average_option()

    name: ClassVar[str] = "policy-gradient"
    feedback: ClassVar[str] = "reward"
    needs_spikes: ClassVar[bool] = True
    parameters_type: ClassVar[Any] = Parameters
    memory_type: ClassVar[Any] = Memory
    spike_probability: ClassVar[Any] = spike_probability
    weigh: ClassVar[Any] = weigh
    bin_signal: ClassVar[Any] = bin_signal

    def __post_init__(self) -> None:
        super().__post_init__()
        real("width", self.width, above=0.0)
        real("baseline_rate", self.baseline_rate, low=0.0, high=1.0)

    def own_numbers(self, model: Model) -> tuple[float, ...]:
        return (1.0 / self.width, self.baseline_rate)

    def kernel(self, model: Model) -> PSPKernel:
        if not (isinstance(model, GNM) and model.readout == "V"):
            raise ValueError(
                "PolicyGradient draws spikes for neurons that take no notice of them, GNM with "
                f'readout "V"; got {model!r}'
            )
        return super().kernel(model)
