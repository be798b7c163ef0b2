"""Anything that has Stable-Baselines3's `predict`, scored as the neurons are scored."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from agents.training.batch import Answers
from agents.training.source import Source, TaskSource
from agents.training.streams import MOST_SPIKES
from gnm_env.checks import shown
from gnm_env.trial import Trial

TRIALS_AT_ONCE = 500
"""Trials that one `predict` answers side by side."""


@runtime_checkable
class Policy(Protocol):
    """What answers bins: an SB3 model that hears bits, or a class of your own."""

    def predict(
        self,
        observation: NDArray[Any],
        state: Any = None,
        episode_start: NDArray[np.bool_] | None = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[Any], Any]:
        """Actions (n,) for one bin, int8 (n, N), of n streams; and the state to hand in next.

        `state` is None in the first call. `episode_start` (n,) says where a stream begins anew.
        """


class PolicyAgent:
    """What makes a policy an agent that can be scored; see `agents.lane_group`."""

    def predict(
        self,
        observation: NDArray[Any],
        state: Any = None,
        episode_start: NDArray[np.bool_] | None = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[Any], Any]:
        """See `Policy.predict`."""
        raise NotImplementedError

    def group_key(self) -> Hashable:
        """No two policies are answered by one `predict`."""
        return id(self)

    @classmethod
    def batch(cls, agents: Sequence[PolicyAgent], source: Source) -> PolicyBatch:
        """The one agent."""
        (agent,) = agents
        return PolicyBatch(agent, source)


class PolicyBatch:
    """One policy that hears many streams, or many trials, side by side."""

    def __init__(self, policy: Policy, source: Source) -> None:
        self._policy = policy
        self._source = source

    def survive_streams(self, first_seed: int, runs: int, cap: int) -> NDArray[np.int64]:
        """Bins survived before the first mistake, (1, runs), at most `cap` each.

        Run k hears the stream of `gnm/PatternStream-v0` after `reset(seed=first_seed + k)`.
        """
        from gnm_env.stream_task.vector import (
            PatternStreamVectorEnv,
        )  # only who scores policies needs it

        assert isinstance(self._source, TaskSource)
        streams = PatternStreamVectorEnv(runs, self._source.task, self._source.patterns)
        bits, _ = streams.reset(seed=first_seed)
        survived, alive = np.zeros(runs, np.int64), np.ones(runs, np.bool_)
        state, begins = None, np.ones(runs, np.bool_)
        for _ in range(cap):
            actions, state = self._answered_by_policy(bits, state, begins)
            bits, _, mistaken, _, _ = streams.step(actions)
            begins = np.zeros(runs, np.bool_)
            # A stream that is lost goes on, unheeded: the batch keeps its shape, and `state` too.
            alive &= ~mistaken
            survived += alive
            if not alive.any():
                break
        return survived[None]

    def answer(self, rng: Generator, trials: int) -> Answers:
        """Responses to `trials` trials of the source, the next from `rng`."""
        table = np.zeros((1, self._source.n_classes, MOST_SPIKES + 1), np.int64)
        false_positives, wrong, absolute, noise_bins = 0, 0, 0, 0
        for trial, spikes in self._answered(rng, trials):
            owner = trial.owner()
            given = np.bincount(owner[spikes] + 1, minlength=len(trial.onsets) + 1)
            np.add.at(table[0], (trial.classes, np.minimum(given[1:], MOST_SPIKES)), 1)
            false_positives += int(given[0])
            noise_bins += int(np.sum(owner < 0))
            error = abs(int(spikes.sum()) - trial.label)
            wrong += error > 0
            absolute += error
        return Answers(
            table,
            np.array([false_positives]),
            noise_bins,
            np.array([wrong]),
            np.array([float(absolute)]),
            trials,
        )

    def _answered(self, rng: Generator, trials: int) -> Iterator[tuple[Trial, NDArray[np.bool_]]]:
        """Trials with the output spikes in each of their bins, (T,)."""
        for done in range(0, trials, TRIALS_AT_ONCE):
            drawn = self._source.trials(rng, min(TRIALS_AT_ONCE, trials - done))
            # Shorter trials are followed by silence, which nobody counts.
            shape = (max(t.n_bins for t in drawn), len(drawn), self._source.n_inputs)
            raster = np.zeros(shape, np.int8)
            for k, trial in enumerate(drawn):
                raster[: trial.n_bins, k] = trial.dense()
            spikes = self._play(raster)
            for k, trial in enumerate(drawn):
                yield trial, spikes[: trial.n_bins, k]

    def _play(self, raster: NDArray[np.int8]) -> NDArray[np.bool_]:
        """Output spikes (T, n) of n streams (T, n, N)."""
        n_bins, n, _ = raster.shape
        spikes = np.zeros((n_bins, n), np.bool_)
        state, begins = None, np.ones(n, np.bool_)
        for t in range(n_bins):
            spikes[t], state = self._answered_by_policy(raster[t], state, begins)
            begins = np.zeros(n, np.bool_)
        return spikes

    def _answered_by_policy(
        self, bits: NDArray[np.int8], state: Any, begins: NDArray[np.bool_]
    ) -> tuple[NDArray[Any], Any]:
        """What the policy answers to one bin of n streams, (n,), and its state; checked."""
        answered, state = answer_of(self._policy.predict(bits, state, begins, True))
        actions = np.asarray(answered)
        if actions.shape != (len(bits),) or not np.isin(actions, (0, 1)).all():
            raise ValueError(
                f"predict must answer {len(bits)} streams with one action each, 0 or 1, "
                f"got {shown(answered)}"
            )
        return actions, state


def answer_of(given: Any) -> tuple[Any, Any]:
    """The actions and the state that a policy's `predict` gave; ValueError if it is not both."""
    if not isinstance(given, tuple) or len(given) != 2:
        raise ValueError(
            f"predict must return the actions and the state, got {shown(given)}; "
            "return (actions, None) where there is no state"
        )
    return given


class _Bare(PolicyAgent):
    """A policy that has nothing but `predict`."""

    def __init__(self, policy: Policy) -> None:
        self.predict = policy.predict  # type: ignore[method-assign]


def as_agent(agent: Any) -> Any:
    """`agent`, or what makes an agent of a policy; ValueError if it is neither."""
    if isinstance(agent, type):
        raise ValueError(f"an agent must be an instance, got the class {agent.__name__}")
    if hasattr(agent, "group_key"):
        return agent
    if isinstance(agent, Policy):
        return _Bare(agent)
    raise ValueError(
        f"an agent must have a method predict(observation, state, episode_start, deterministic), "
        f"got {shown(agent)}"
    )
