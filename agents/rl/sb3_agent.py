"""SB3Agent: a Stable-Baselines3 model that takes the place of a neuron."""

from __future__ import annotations

import copy
from typing import Any, NamedTuple

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from agents.policy import PolicyAgent
from agents.rl.senses import RAW, Senses
from gnm_env.task import Task


class Memory(NamedTuple):
    """State of `SB3Agent.predict` between two bins of n streams; opaque to callers."""

    traces: NDArray[np.float32]
    actions: NDArray[np.int64]
    policy: Any


class SB3Agent(PolicyAgent):
    """A policy with SB3's `predict`, and its senses: hears bits, answers spikes.

    So it stands wherever a neuron stands: in `noisy_performance`, in SB3's `evaluate_policy` on the
    bare environment, in a loop of your own. It learns nothing: the model does, in SB3's `learn`.

    Args:
        policy: an SB3 model, or anything with its `predict`.
        task: the task that it was trained on; tells the number and the rate of the inputs.
        senses: what the policy is shown.

    Raises:
        ValueError: if the senses do not show what the policy's observation space says.
    """

    def __init__(self, policy: Any, task: Task, senses: Senses = RAW) -> None:
        self.policy = policy
        self.task = task
        self.senses = senses
        self.n_inputs = task.n_inputs
        bits = spaces.Box(0, 1, (task.n_inputs,), np.int8)
        self._traces = senses.traces(1, bits, task.rate)
        shown = bits if self._traces is None else self._traces.space
        expected = getattr(policy, "observation_space", shown)
        if expected.shape != shown.shape:
            raise ValueError(
                f"the policy takes observations of shape {expected.shape}, these senses show "
                f"{shown.shape} (n_inputs = {self.n_inputs}): give those that it was trained with"
            )
        self.begin_trial()

    def predict(
        self,
        observation: NDArray[Any] | dict[str, NDArray[Any]],
        state: Any = None,
        episode_start: NDArray[Any] | None = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[np.int64], Any]:
        """Spikes for the bits of one bin, (N,) or (n, N): 0-d or (n,). Hand the state back in."""
        observed = np.asarray(observation)
        bits = np.atleast_2d(observed)
        n = len(bits)
        memory: Memory | None = state
        if bits.shape != (n, self.n_inputs):
            raise ValueError(
                f"observations must have shape ({self.n_inputs},) or (n, {self.n_inputs}) like "
                f"those of the task that was trained on, got {observed.shape}"
            )
        if memory is not None and len(memory.actions) != n:
            raise ValueError(
                f"state is that of {len(memory.actions)} streams, and there are observations of "
                f"{n}: hand back the state of the same streams, or None"
            )
        begins = np.full(n, memory is None)
        if episode_start is not None:
            begins |= np.asarray(episode_start, np.bool_).reshape(n)
        if memory is None:
            width = 0 if self._traces is None else self._traces.values.shape[1]
            memory = Memory(np.zeros((n, width), np.float32), np.zeros(n, np.int64), None)
        traces = self._followed(memory, bits, begins)
        shown = bits if self._traces is None else traces
        actions, policy_state = self.policy.predict(shown, memory.policy, begins, deterministic)
        actions = np.asarray(actions, np.int64).reshape(n)
        spikes = actions
        if self.senses.rising_edge:
            spikes = np.where(actions > np.where(begins, 0, memory.actions), 1, 0)
        if observed.ndim == 1:
            spikes = spikes.reshape(())
        return spikes, Memory(traces, actions, policy_state)

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
