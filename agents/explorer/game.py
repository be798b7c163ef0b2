"""Beat the neuron: a person answers an endless stream, by the rules that a neuron is scored by."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np

from agents import noisy_performance
from agents.explorer.results import Trained
from agents.explorer.settings import Settings
from gnm_env.rules import MAX_EPISODE_BINS

SLOWEST, FASTEST = 2, 60
"""Bins per second."""


class Game:
    """One run of `gnm/PatternStream-v0`, a bin at a time, with the neuron listening beside.

    Args:
        settings, trained: what is heard, and the agent to beat.
        seed: of the stream; the neuron's score is that on the same stream.

    Attributes:
        over: whether a mistake has ended it.
    """

    def __init__(self, settings: Settings, trained: Trained, seed: int) -> None:
        if settings.model.graded:
            raise ValueError("the game is played with spikes: choose a neuron that gives spikes")
        self._agent = trained.agent
        self._env = gym.make(
            "gnm/PatternStream-v0", task=settings.task, patterns=trained.patterns,
            max_episode_steps=MAX_EPISODE_BINS,
        )  # fmt: skip
        self._seed, self._task, self._patterns = seed, settings.task, trained.patterns
        self._obs, _ = self._env.reset(seed=seed)
        self._state: Any = None
        self._survived = 0
        self.over = False

    def neuron_score(self) -> int:
        """Bins that the neuron survives on this stream."""
        survived = noisy_performance(
            self._agent, self._task, self._patterns, runs=1, seed=self._seed, threads=1
        )
        return int(survived[0])

    def look(self) -> dict[str, Any]:
        """The bin that waits for an answer: its channels, its class, and the neuron's answer."""
        answer, self._state = self._agent.predict(self._obs, self._state)
        return {
            "channels": np.flatnonzero(self._obs).tolist(),
            "class": self._env.unwrapped.presented,  # type: ignore[attr-defined]
            "neuron": int(answer),
        }

    def answer(self, spike: int) -> dict[str, Any]:
        """Answer that bin. The message says how many bins were survived, and which mistake, if any.

        Raises ValueError once the game is over.
        """
        if self.over:
            raise ValueError("this game is over: begin another")
        self._obs, reward, terminated, truncated, info = self._env.step(spike)
        self._survived += int(reward)
        self.over = terminated or truncated
        return {
            "survived": self._survived,
            "over": self.over,
            "mistake": info.get("mistake") if terminated else None,
        }
