"""NetworkAgent: a network with weights and its learning rule, acting bin by bin."""

from __future__ import annotations

import os
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike, NDArray

from agents import checkpoint
from agents.kernels import Heard
from agents.network import kernels
from agents.network.backpropagation import rule_at, rule_row
from agents.network.dynamics import Log, n_state, n_weights, new_log, wiring_at, wiring_row
from agents.network.network_lanes import NetworkLanes
from agents.network.parameters import BackPropagation, Network
from agents.recording import Recording
from gnm_env.checks import real, whole
from gnm_env.task import Patterns, Task
from gnm_env.trial import Trial

MAX_WEIGHTS = 100_000_000
"""Most weights of one network: learning keeps three numbers for each, 2.4 GB at this size."""


@dataclass(frozen=True, eq=False)
class NetworkRecording(Recording):
    """Variables of a network in each of the T bins of a trial.

    V, X and spikes are those of the readout, D = α V(t−1) its decay, and R is 0: it has no reset.

    Attributes:
        v: hidden potentials, (T, H).
        z: hidden outputs, (T, H).
        j: currents into the readout, (T, H).
    """

    v: NDArray[np.float64]
    z: NDArray[np.float64]
    j: NDArray[np.float64]


@checkpoint.register_kind("network")
class NetworkAgent:
    """A network with a hidden layer that learns by backpropagated error traces.

    To be used as a NeuronAgent is: in the standard loop, in `train_many`, with `noisy_performance`,
    `record` and checkpoints.

    Args:
        network: its size and parameters.
        rule: BackPropagation.
        n_inputs: N, number of input channels.
        seed: of the initial weights, default_rng((seed, 2)): first W (N, H), then u (H,), uniform
            on [0, initial_weight).
        initial_weight: upper end of the initial weights; None: 0.3.

    Attributes:
        weights: float64 (N·H + H,), the agent's own writable array, W by inputs and then u.
        momentum: float64, same shape, weight change of the last learning step, momentum included.
        overflowed: whether learning has ended because a weight would have overflowed.

    Raises:
        ValueError: if an argument is out of range.
    """

    def __init__(
        self,
        network: Network | None = None,
        rule: BackPropagation | None = None,
        n_inputs: int = 100,
        seed: int = 0,
        initial_weight: float | None = None,
    ) -> None:
        self.network = Network() if network is None else network
        self.rule = BackPropagation() if rule is None else rule
        if not isinstance(self.network, Network):
            raise ValueError(f"network must be a Network, got {network!r}")
        if not isinstance(self.rule, BackPropagation):
            raise ValueError(
                f"rule must be BackPropagation, which alone trains a hidden layer, got {rule!r}"
            )
        self.n_inputs = whole("n_inputs", n_inputs, low=1)
        size = n_weights(self.network, self.n_inputs)
        if size > MAX_WEIGHTS:
            raise ValueError(
                f"a network must have at most {MAX_WEIGHTS:,} weights, got n_inputs · hidden = "
                f"{self.n_inputs} · {self.network.hidden}: lower hidden"
            )
        if initial_weight is None:
            initial_weight = Network.default_initial_weight
        scale = real("initial_weight", initial_weight)
        rng = np.random.default_rng((whole("seed", seed, low=0), 2))
        self._weights = rng.random(size) * scale
        self.momentum = np.zeros(size)
        self._prepare()

    def _prepare(self) -> None:
        self._wiring = wiring_at(np.array([wiring_row(self.network, self.n_inputs)], float), 0)
        self._rule = rule_at(np.array([rule_row(self.rule)], float), 0)
        self._state = np.zeros(n_state(self.network.width))
        self._channels = np.empty(0, np.int32)
        self._offsets = np.zeros(1, np.int64)
        self._log = new_log(0, self.network.width)
        self._make_room(256, 4 * self.n_inputs + 256)
        self.overflowed = False
        self.begin_trial()

    @property
    def weights(self) -> NDArray[np.float64]:
        """All weights, the agent's own writable array; assigning copies into it, checked."""
        return self._weights

    @weights.setter
    def weights(self, values: ArrayLike) -> None:
        _put("weights", values, self._weights)

    @property
    def hidden_weights(self) -> NDArray[np.float64]:
        """W, (N, H), a writable view of `weights`; assigning copies into it, checked."""
        return self._weights[: self.n_inputs * self.network.width].reshape(self.n_inputs, -1)

    @hidden_weights.setter
    def hidden_weights(self, values: ArrayLike) -> None:
        _put("hidden_weights", values, self.hidden_weights)

    @property
    def output_weights(self) -> NDArray[np.float64]:
        """u, (H,), a writable view of `weights`; assigning copies into it, checked."""
        return self._weights[self.n_inputs * self.network.width :]

    @output_weights.setter
    def output_weights(self, values: ArrayLike) -> None:
        _put("output_weights", values, self.output_weights)

    # --- the standard loop -----------------------------------------------------------------------

    def begin_trial(self) -> None:
        """Forget the last trial: state 0, empty record. Checks that the weights are finite."""
        _require_finite("weights", self._weights)
        self._state[:] = 0.0
        self._bin = 0
        self._offsets[0] = 0

    def act(self, obs: NDArray[Any]) -> int:
        """The answer to one bin: 1 for an output spike, else 0. `obs` holds N bits."""
        row = self._checked(obs, (self.n_inputs,))
        action = self._hear(row)
        if action < 0:
            self._make_room(2 * len(self._log.V), 2 * len(self._channels))
            action = self._hear(row)
        self._bin += 1
        return action

    def _hear(self, row: NDArray[np.int8]) -> int:
        action: int = kernels.hear(
            self._wiring, self._weights, self._state, row, self._bin,
            self._channels, self._offsets, self._log,
        )  # fmt: skip
        return action

    def learn(self, reward: float, info: Mapping[str, Any], sign_only: bool = False) -> None:
        """Learn from the trial that has just ended, by its terminal info.

        A weight that would overflow ends learning: `overflowed` is set, the last weights are kept.
        """
        if self.overflowed:
            return
        heard = Heard(
            self._channels,
            self._offsets[: self._bin + 1],
            np.array(info["onsets"], np.int64),
            np.array(info["targets"], np.int64),
            int(info["pattern_bins"]),
        )
        taken = kernels.study(
            self._wiring, self._rule, heard, self._log, self._weights, self.momentum
        )
        self.overflowed = not taken

    def _make_room(self, bins: int, events: int) -> None:
        """Buffers for at least `bins` bins and `events` input spikes; what they hold is kept."""
        old = (self._channels, self._offsets, *self._log)
        self._channels = np.empty(events, np.int32)
        self._offsets = np.zeros(bins + 1, np.int64)
        self._log = Log(*new_log(bins, self.network.width))
        for short, long in zip(old, (self._channels, self._offsets, *self._log), strict=True):
            long[: len(short)] = short

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
        a new trial begins. The network is deterministic whatever `deterministic` says.
        """
        obs = np.asarray(observation)
        single = obs.ndim == 1
        n = 1 if single else len(obs)
        rows = self._checked(obs[None] if single else obs, (n, self.n_inputs))
        shape = (n, len(self._state))
        states = np.zeros(shape) if state is None else np.array(state[0]).reshape(shape)
        if episode_start is not None:
            states[np.atleast_1d(np.asarray(episode_start, np.bool_))] = 0.0
        actions = kernels.foresee(self._wiring, self._weights, states, rows)
        return (actions.reshape(()) if single else actions), (states,)

    def record(self, trial: Trial) -> NetworkRecording:
        """See `agents.record`."""
        heard = Heard(
            trial.channels, trial.offsets, trial.onsets, trial.targets, trial.pattern_bins
        )
        states = kernels.record(self._wiring, self._weights, heard)
        H = self.network.width
        V = states[:, -1]
        before = np.concatenate([[0.0], V[:-1]])
        theta = self.network.theta_r
        return NetworkRecording(
            V,
            self.network.alpha * before,
            np.zeros_like(V),
            V,
            (V >= theta) & (before < theta),
            states[:, :H],
            states[:, H : 2 * H],
            states[:, 2 * H : 3 * H],
        )

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
        return type(self), self.n_inputs, self.network.width

    @classmethod
    def lanes(cls, agents: Sequence[NetworkAgent], task: Task, patterns: Patterns) -> NetworkLanes:
        """The agents, all of one `group_key`, on one stream."""
        return NetworkLanes(agents, task, patterns)

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
            "network": asdict(self.network),
            "rule_parameters": asdict(self.rule),
            "n_inputs": self.n_inputs,
            "overflowed": self.overflowed,
        }
        arrays = {"weights": self._weights, "momentum": self.momentum}
        checkpoint.write(path, "network", header, arrays, task=task, patterns=patterns, rng=rng)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> NetworkAgent:
        """Load an agent; ValueError if the file is missing, damaged or of another kind."""
        return checkpoint.load_agent(path, cls)

    @classmethod
    def from_checkpoint(
        cls, header: dict[str, Any], arrays: dict[str, NDArray[Any]]
    ) -> NetworkAgent:
        """An agent from what `save` wrote; ValueError if the parts do not fit together."""
        agent = cls(
            Network(**header["network"]),
            BackPropagation(**header["rule_parameters"]),
            header["n_inputs"],
        )
        agent._take(arrays["weights"], arrays["momentum"])
        agent.overflowed = bool(header["overflowed"])
        return agent

    def replaced(self, **changes: Any) -> NetworkAgent:
        """A copy with other parameters, such as alpha=0.2; weights and momentum are kept."""
        agent = NetworkAgent(replace(self.network, **changes), self.rule, self.n_inputs)
        agent._take(self._weights, self.momentum)
        return agent

    def _take(self, weights: NDArray[Any], momentum: NDArray[Any]) -> None:
        if weights.shape != self._weights.shape:  # no one number for all, as the setter allows
            raise ValueError(f"weights must have shape {self._weights.shape}, got {weights.shape}")
        _put("weights", weights, self._weights)
        _put("momentum", momentum, self.momentum)


def _put(name: str, values: ArrayLike, place: NDArray[np.float64]) -> None:
    array = np.asarray(values, np.float64)
    if array.shape not in ((), place.shape):
        raise ValueError(f"{name} must have shape {place.shape}, got {array.shape}")
    _require_finite(name, array)
    place[:] = array


def _require_finite(name: str, values: NDArray[np.float64]) -> None:
    if not np.isfinite(values).all():
        raise ValueError(
            f"{name} must be finite, but hold NaN or infinity; load an earlier checkpoint or "
            "start anew"
        )
