"""NeuronAgent: a neuron with weights and a learning rule, acting bin by bin."""

from __future__ import annotations

import os
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import asdict, replace
from typing import Any, ClassVar

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike, NDArray

from agents import checkpoint
from agents.kernels import Heard, Log, kernels, recorder
from agents.learning.aggregate_label import AggregateLabel
from agents.learning.error_trace import ErrorTrace
from agents.learning.rule import Rule
from agents.neuron_lanes import NeuronLanes
from agents.neurons.gnm import GNM
from agents.neurons.lif import LIF
from agents.neurons.mst import MST
from agents.neurons.neuron import Neuron
from agents.recording import Recording
from gnm_env.checks import real, whole
from gnm_env.task import Patterns, Task
from gnm_env.trial import Trial

NEURONS: dict[str, type[Neuron]] = {cls.name: cls for cls in (GNM, LIF, MST)}
_RECORD = ("_channels", "_offsets", "_V", "_above", "_spikes")
"""An agent's record of the present trial, for learning at its end."""
RULES: dict[str, type[Rule]] = {cls.name: cls for cls in (AggregateLabel, ErrorTrace)}


@checkpoint.register_kind("neuron")
class NeuronAgent:
    """A spiking neuron that learns from trials.

    In the standard loop: `begin_trial()` before the first bin, `act(obs)` in each bin,
    `learn(reward, info)` after the last. `predict` has the signature of Stable-Baselines3 and
    changes nothing.

    Args:
        neuron: GNM, LIF or MST.
        rule: AggregateLabel or ErrorTrace.
        n_inputs: N, number of input channels.
        seed: of the initial weights, default_rng((seed, 2)).random(N) · initial_weight.
        initial_weight: w₀, upper end of the initial weights; None: the neuron's default.
        weight_bounds: lowest and highest weight; None: unbounded.

    Attributes:
        weights: float64 (N,), the agent's own writable array.
        momentum: float64 (N,), weight change of the last learning step, momentum included.

    Raises:
        ValueError: if an argument is out of range.
    """

    graded: ClassVar[bool] = False
    """Whether actions are amounts instead of spikes."""

    def __init__(
        self,
        neuron: Neuron,
        rule: Rule,
        n_inputs: int,
        seed: int = 0,
        initial_weight: float | None = None,
        weight_bounds: tuple[float, float] | None = (0.0, 1.0),
    ) -> None:
        if not isinstance(neuron, Neuron):
            raise ValueError(f"neuron must be one of {_names(NEURONS)}, got {neuron!r}")
        if neuron.graded != self.graded:
            raise ValueError(
                f"a {type(self).__name__} cannot have {neuron!r}: spikes and amounts do not mix; "
                "amounts are for agents.continuous.ContinuousAgent"
            )
        if not isinstance(rule, Rule):
            raise ValueError(f"rule must be one of {_names(RULES)}, got {rule!r}")
        self.neuron = neuron
        self.rule = rule
        self.n_inputs = whole("n_inputs", n_inputs, low=1)
        self.weight_bounds = _checked_bounds(weight_bounds)
        self.rule_mode = rule.mode(self.n_inputs)
        if initial_weight is None:
            initial_weight = neuron.default_initial_weight
        scale = real("initial_weight", initial_weight)
        rng = np.random.default_rng((whole("seed", seed, low=0), 2))
        self._weights = np.clip(rng.random(self.n_inputs) * scale, *self.bounds)
        self.momentum = np.zeros(self.n_inputs)
        self._prepare()

    def _prepare(self) -> None:
        self._kernels = kernels(self.neuron, self.rule)
        self._mode = self.neuron.mode()
        self._parameters = np.array(self.neuron.parameters())[:, None]
        self._rule_parameters = np.array(self.rule_parameters())[:, None]
        self._n_state = len(self.neuron.state_type._fields)  # type: ignore[attr-defined]
        self._state = np.zeros((self._n_state, 1))
        self._make_room(256, 4 * self.n_inputs + 256)
        self.overflowed = False
        self.begin_trial()

    @property
    def weights(self) -> NDArray[np.float64]:
        """float64 (N,), the agent's own writable array; assigning copies into it, checked."""
        return self._weights

    @weights.setter
    def weights(self, values: ArrayLike) -> None:
        array = np.asarray(values, np.float64)
        if array.shape not in ((), (self.n_inputs,)):
            raise ValueError(f"weights must have shape ({self.n_inputs},), got {array.shape}")
        _require_finite(array)
        self._weights[:] = array

    @property
    def bounds(self) -> tuple[float, float]:
        """Lowest and highest weight; infinite where there is no bound."""
        return self.weight_bounds or (-np.inf, np.inf)

    def rule_parameters(self) -> tuple[float, ...]:
        """The numbers of `agents.learning.rule.RuleParameters`, in order."""
        trace = self.rule.trace(self.neuron)
        rule = self.rule
        return (
            rule.learning_rate, rule.momentum, *self.bounds, trace.slow, trace.fast, trace.scale,
        )  # fmt: skip

    # --- the standard loop -----------------------------------------------------------------------

    def begin_trial(self) -> None:
        """Forget the last trial: state 0, empty record. Checks that the weights are finite."""
        _require_finite(self._weights)
        self._state[:] = 0.0
        self._bin = 0
        self._offsets[0] = 0

    def act(self, obs: NDArray[Any]) -> int:
        """The answer to one bin: 1 for an output spike, else 0. `obs` holds N bits."""
        row = self._checked(obs, (self.n_inputs,))
        action = self._hear(row)
        if action < 0:
            self._make_room(2 * len(self._spikes), 2 * len(self._channels))
            action = self._hear(row)
        self._bin += 1
        return action

    def _hear(self, row: NDArray[np.int8]) -> int:
        action: int = self._kernels.hear(
            self._mode, self._parameters, self._weights[:, None], self._state, row, self._bin,
            self._channels, self._offsets, self._V, self._above, self._spikes,
        )  # fmt: skip
        return action

    def learn(self, reward: float, info: Mapping[str, Any], sign_only: bool = False) -> None:
        """Learn from the trial that has just ended.

        `reward` is that of the last step and `info` its terminal info. With `sign_only` (the
        environment gives feedback="sign") aggregate-label learning uses the reward alone.
        A weight that would overflow ends learning: `overflowed` is set, the last weights are kept.
        """
        if self.overflowed:
            return
        by_sign = sign_only and not self.rule.uses_error
        sign = float(np.sign(reward)) if by_sign else np.nan
        onsets = np.empty(0, np.int64) if by_sign else info["onsets"]
        owed = np.empty(0, np.int64) if by_sign else info["targets"]
        t = self._bin
        heard = Heard(
            self._channels,
            self._offsets[: t + 1],
            np.array(onsets, np.int64),
            np.array(owed, np.int64),
            0 if by_sign else int(info["pattern_bins"]),
        )
        log = Log(self._V, self._above, np.empty((len(heard.onsets), 1)))
        label = 0 if by_sign else int(info["label"])
        taken = self._kernels.study(
            self.rule_mode, self._rule_parameters, sign, heard, label, log, self._spikes,
            self._weights[:, None], self.momentum[:, None],
        )  # fmt: skip
        self.overflowed = not taken

    def _make_room(self, bins: int, events: int) -> None:
        """Buffers for at least `bins` bins and `events` input spikes; what they hold is kept."""
        old = [getattr(self, name) for name in _RECORD] if hasattr(self, "_V") else []
        self._channels = np.empty(events, np.int32)
        self._offsets = np.zeros(bins + 1, np.int64)
        self._V = np.empty((bins, 1))
        self._above = np.empty((bins, 1))
        self._spikes = np.empty(bins, np.int64)
        for name, short in zip(_RECORD, old, strict=False):
            getattr(self, name)[: len(short)] = short

    # --- without learning ------------------------------------------------------------------------

    def predict(
        self,
        observation: NDArray[Any] | dict[str, NDArray[Any]],
        state: tuple[NDArray[Any], ...] | None = None,
        episode_start: NDArray[Any] | None = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[np.int64], tuple[NDArray[Any], ...]]:
        """Actions for one bin, as Stable-Baselines3 asks for them; changes nothing.

        `observation` of shape (N,) gives a 0-d action, (n, N) gives n of them for n independent
        streams. Pass the returned, opaque state to the next call; `episode_start` (n,) says where
        a new trial begins. The neuron is deterministic whatever `deterministic` says.
        """
        obs = np.asarray(observation)
        single = obs.ndim == 1
        n = 1 if single else len(obs)
        rows = self._checked(obs[None] if single else obs, (n, self.n_inputs))
        shape = (n, self._n_state, 1)
        states = np.zeros(shape) if state is None else np.array(state[0]).reshape(shape)
        if episode_start is not None:
            states[np.atleast_1d(np.asarray(episode_start, np.bool_))] = 0.0
        actions = self._kernels.foresee(
            self._mode, self._parameters, self._weights[:, None], states, rows
        )
        return (actions.reshape(()) if single else actions), (states,)

    def record(self, trial: Trial) -> Recording:
        """See `agents.record`."""
        heard = Heard(
            trial.channels, trial.offsets, trial.onsets, trial.targets, trial.pattern_bins
        )
        values, spikes = recorder(self.neuron)(
            self._mode, self._parameters, self._weights[:, None], heard
        )
        V, D, R, X = values
        return Recording(V, D, R, X, spikes)

    def _checked(self, obs: NDArray[Any], shape: tuple[int, ...]) -> NDArray[np.int8]:
        if type(obs) is not np.ndarray or obs.dtype != np.int8 or not obs.flags.c_contiguous:
            obs = np.ascontiguousarray(obs, np.int8)
        if obs.shape != shape:
            raise ValueError(
                f"an observation must have shape {shape} (n_inputs = {self.n_inputs}), "
                f"got {obs.shape}"
            )
        return obs

    # --- many at once ----------------------------------------------------------------------------

    def group_key(self) -> Hashable:
        """Agents with equal keys can be trained side by side."""
        step, _ = self.neuron.step()
        double = self.rule.trace(self.neuron).double
        return (
            type(self), step, self._mode, type(self.rule), self.rule_mode, double, self.n_inputs,
        )  # fmt: skip

    @classmethod
    def lanes(cls, agents: Sequence[NeuronAgent], task: Task, patterns: Patterns) -> NeuronLanes:
        """The agents, all of one `group_key`, side by side."""
        return NeuronLanes(agents, task, patterns)

    # --- checkpoints -----------------------------------------------------------------------------

    def save(
        self,
        path: str | os.PathLike[str],
        *,
        task: Task | None = None,
        patterns: Patterns | None = None,
        rng: Generator | None = None,
    ) -> None:
        """Save to exactly this one file, whole or not at all, with what else is to be kept."""
        header = {
            "neuron": self.neuron.name,
            "neuron_parameters": asdict(self.neuron),  # type: ignore[call-overload]
            "rule": self.rule.name,
            "rule_parameters": asdict(self.rule),  # type: ignore[call-overload]
            "weight_bounds": self.weight_bounds,
            "overflowed": self.overflowed,
        }
        arrays = {"weights": self._weights, "momentum": self.momentum}
        checkpoint.write(path, "neuron", header, arrays, task=task, patterns=patterns, rng=rng)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> NeuronAgent:
        """Load an agent; ValueError if the file is missing, damaged or of another kind."""
        return checkpoint.load_agent(path, cls)

    @classmethod
    def from_checkpoint(
        cls, header: dict[str, Any], arrays: dict[str, NDArray[Any]]
    ) -> NeuronAgent:
        """An agent from what `save` wrote; ValueError if the parts do not fit together."""
        bounds = header["weight_bounds"]
        agent = cls(
            NEURONS[header["neuron"]](**header["neuron_parameters"]),
            RULES[header["rule"]](**header["rule_parameters"]),
            n_inputs=len(arrays["weights"]),
            weight_bounds=None if bounds is None else tuple(bounds),
        )
        agent.weights = arrays["weights"]
        if arrays["momentum"].shape != (agent.n_inputs,):
            raise ValueError(f"momentum must have shape ({agent.n_inputs},)")
        _require_finite(arrays["momentum"], "momentum")
        agent.momentum[:] = arrays["momentum"]
        agent.overflowed = bool(header["overflowed"])
        return agent

    def replaced(self, **changes: Any) -> NeuronAgent:
        """A copy with other neuron parameters, such as alpha=0.2; weights and momentum are kept."""
        neuron = replace(self.neuron, **changes)  # type: ignore[type-var]
        agent = NeuronAgent(neuron, self.rule, self.n_inputs, weight_bounds=self.weight_bounds)
        agent.weights = self._weights
        agent.momentum[:] = self.momentum
        return agent


def _names(classes: Mapping[str, type]) -> str:
    return ", ".join(cls.__name__ for cls in classes.values())


def _require_finite(values: NDArray[np.float64], name: str = "weights") -> None:
    if not np.isfinite(values).all():
        bad = int(np.flatnonzero(~np.isfinite(np.atleast_1d(values)))[0])
        raise ValueError(
            f"{name} must be finite, got {np.atleast_1d(values)[bad]} for input {bad}; "
            "load an earlier checkpoint or start anew"
        )


def _checked_bounds(bounds: tuple[float, float] | None) -> tuple[float, float] | None:
    if bounds is None:
        return None
    try:
        low, high = bounds
    except (TypeError, ValueError):
        raise ValueError(
            f"weight_bounds must be (lowest, highest) or None, got {bounds!r}"
        ) from None
    low = real("the lower weight bound", low, finite=False)
    high = real("the upper weight bound", high, finite=False)
    if not low < high:
        raise ValueError(
            f"weight_bounds must be (lowest, highest) with lowest < highest, got {bounds!r}; "
            "use None for no bounds"
        )
    return low, high
