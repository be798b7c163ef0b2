"""SB3Agent: a Stable-Baselines3 model that takes the place of a neuron."""

from __future__ import annotations

import copy
from typing import Any, NamedTuple

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from agents.policy import PolicyAgent
from agents.rl.observation import RAW, ObservationConfig
from agents.training.agent import bits_of, checked_begins
from gnm_env.checks import shown
from gnm_env.task import Task
from gnm_env.trials import Trials


class Memory(NamedTuple):
    """State of `SB3Agent.predict` between two bins of n streams; opaque to callers."""

    traces: NDArray[np.float32]
    actions: NDArray[np.int64]
    policy: Any


class SB3Agent(PolicyAgent):
    """A policy with SB3's `predict`, and what it is shown: hears bits, answers spikes.

    So it stands wherever a neuron stands: in `noisy_performance`, in SB3's `evaluate_policy` on the
    bare environment, in a loop of your own. It learns nothing: the model does, in SB3's `learn`.

    Args:
        policy: an SB3 model, or anything with its `predict`, of any framework. Two attributes are
            looked at where they are there: `observation_space`, and `observation_config`, which the
            models of `make_rl_agent` have and their zips keep.
        task: the task, or the data set of trials, that it was trained on; tells the number and the
            rate of the inputs.
        observation: what the policy is shown; None: what its `observation_config` says, or the raw
            bits.

    Raises:
        ValueError: if an argument is not what it should be, or if the policy was trained on other
            observations, if only at another scale.
    """

    def __init__(
        self, policy: Any, task: Task | Trials, observation: ObservationConfig | None = None
    ) -> None:
        if isinstance(policy, type) or not callable(getattr(policy, "predict", None)):
            raise ValueError(
                "policy must be an SB3 model, or anything with its predict(observation, state, "
                f"episode_start, deterministic), got {shown(policy)}"
            )
        if not isinstance(task, Task | Trials):
            raise ValueError(
                "task must be the gnm_env.Task, or the gnm_env.Trials, that the policy was trained "
                f"on, got {shown(task)}"
            )
        self.policy = policy
        self.task = task
        self.observation = _agreed(policy, observation)
        self.n_inputs = task.n_inputs
        bits = spaces.Box(0, 1, (task.n_inputs,), np.int8)
        self.rate = task.rate if isinstance(task, Task) else float(task.rates.mean())
        self._traces = self.observation.traces(1, bits, self.rate)
        self._require_space(bits if self._traces is None else self._traces.space)
        self.begin_trial()

    def _require_space(self, own: spaces.Box) -> None:
        """ValueError unless the policy's space, if it tells one, is that of these observations."""
        space = getattr(self.policy, "observation_space", own)
        if space.shape != own.shape:
            raise ValueError(
                f"the policy takes observations of shape {space.shape}, {self.observation} shows "
                f"{own.shape} (n_inputs = {self.n_inputs}): give the config that it was trained on"
            )
        if isinstance(space, spaces.Box) and not np.allclose(space.high, own.high, rtol=1e-4):
            k = int(np.argmax(~np.isclose(space.high, own.high, rtol=1e-4)))
            raise ValueError(
                f"the policy was trained on observations up to {space.high[k]:.4g} (entry {k}), "
                f"and {self.observation} of inputs of rate {self.rate:g} gives up to "
                f"{own.high[k]:.4g}: give the task and the config that it was trained on, the "
                "scale included"
            )

    def predict(
        self,
        observation: NDArray[Any] | dict[str, NDArray[Any]],
        state: Any = None,
        episode_start: NDArray[Any] | None = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[np.int64], Any]:
        """Spikes for the bits of one bin, (N,) or (n, N): 0-d or (n,). Hand the state back in.

        Raises ValueError for anything but bits, a state of other streams, or an `episode_start`
        that is not one truth per stream.
        """
        observed = bits_of(observation)
        bits = np.atleast_2d(observed)
        n = len(bits)
        if bits.shape != (n, self.n_inputs):
            raise ValueError(
                f"observations must have shape ({self.n_inputs},) or (n, {self.n_inputs}) like "
                f"those of the task that was trained on, got {observed.shape}"
            )
        memory = self._checked_memory(state, n)
        begins = np.full(n, state is None)
        if episode_start is not None:
            begins |= checked_begins(episode_start, n)
        traces = self._followed(memory, bits, begins)
        heard = bits if self._traces is None else traces
        actions, policy_state = self.policy.predict(heard, memory.policy, begins, deterministic)
        actions = np.asarray(actions, np.int64).reshape(n)
        spikes = actions
        if self.observation.rising_edge:
            spikes = np.where(actions > np.where(begins, 0, memory.actions), 1, 0)
        if observed.ndim == 1:
            spikes = spikes.reshape(())
        return spikes, Memory(traces, actions, policy_state)

    def _checked_memory(self, state: Any, n: int) -> Memory:
        """The state of n streams; None: a new one."""
        width = 0 if self._traces is None else self._traces.values.shape[1]
        if state is None:
            return Memory(np.zeros((n, width), np.float32), np.zeros(n, np.int64), None)
        if not isinstance(state, Memory):
            raise ValueError(f"state must be what predict returned, or None, got {shown(state)}")
        if state.actions.shape != (n,) or state.traces.shape != (n, width):
            raise ValueError(
                f"state is that of {len(state.actions)} streams, and there are observations of "
                f"{n}: hand back the state of the same streams, or None"
            )
        return state

    def _followed(
        self, memory: Memory, bits: NDArray[Any], begins: NDArray[np.bool_]
    ) -> NDArray[np.float32]:
        """The traces one bin on, as a new array; begun anew where `begins` says."""
        if self._traces is None:
            return memory.traces
        traces = copy.copy(self._traces)
        traces.values = memory.traces.copy()
        traces.follow(bits, memory.actions)
        if begins.any():
            traces.start(bits, begins)
        return traces.values

    def begin_trial(self) -> None:
        """Forget the last trial."""
        self._memory: Any = None

    def act(self, obs: NDArray[Any]) -> int:
        """The answer to the next bin: 1 for a spike, else 0."""
        action, self._memory = self.predict(obs, self._memory)
        return int(action)


def _agreed(policy: Any, observation: Any) -> ObservationConfig:
    """What the policy says that it was trained on, and the user that it is to be shown."""
    told = getattr(policy, "observation_config", None)
    if told is None:
        return RAW if observation is None else ObservationConfig.of(observation)
    trained = ObservationConfig.of(told)
    if observation is not None and ObservationConfig.of(observation) != trained:
        raise ValueError(
            f"the policy was trained on {trained}, got {observation}: leave observation out"
        )
    return trained
