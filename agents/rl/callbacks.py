"""Periodic evaluation during SB3's `learn`: on endless streams, as at the end."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import gymnasium as gym
import numpy as np
from stable_baselines3.common.callbacks import BaseCallback, EvalCallback
from stable_baselines3.common.vec_env import VecMonitor

from agents.rl.checkpoint import BEST, MODEL, save_model
from agents.rl.observation import ObservationConfig
from agents.rl.vec_env import PatternVecEnv
from gnm_env.task import Patterns, Task

STREAMS = 20
"""Streams of one evaluation: enough to tell a good policy from a better one, and 2 s at most."""


class Evaluation(EvalCallback):
    """SB3's EvalCallback on `gnm/PatternStream-v0`: its mean reward is the noisy performance.

    Saves the present model and the best one so far into `folder`, each whole or not at all, and
    goes on from the evaluations that are there already.

    Args:
        folder: of the saved agent.
        task, patterns, observation: what is heard, and how.
        every: calls (steps of all environments) between evaluations.
        seed: of the streams, which go on from one evaluation to the next.

    Attributes:
        seconds: time that evaluations took.
    """

    def __init__(
        self,
        folder: str | os.PathLike[str],
        task: Task,
        patterns: Patterns,
        observation: ObservationConfig,
        *,
        every: int,
        seed: int,
    ) -> None:
        streams = gym.make_vec(
            "gnm/PatternStream-v0",
            num_envs=STREAMS,
            vectorization_mode="vector_entry_point",
            task=task,
            patterns=patterns,
            autoreset_mode=gym.vector.AutoresetMode.SAME_STEP,
        )
        env = VecMonitor(PatternVecEnv(observation.wrap(streams)))
        env.seed(seed)
        place = Path(folder)
        super().__init__(
            env,
            callback_on_new_best=_Keep(place / BEST),
            callback_after_eval=_Keep(place / MODEL),
            n_eval_episodes=STREAMS,
            eval_freq=max(every, 1),
            log_path=str(place),
            verbose=0,
        )
        self.seconds = 0.0

    def go_on(self) -> None:
        """Take up the evaluations of an earlier run of the same agent, and its best."""
        assert self.log_path is not None
        path = Path(self.log_path + ".npz")
        if not path.exists():
            return
        try:
            with np.load(path) as earlier:
                self.evaluations_timesteps = earlier["timesteps"].tolist()
                self.evaluations_results = earlier["results"].tolist()
                self.evaluations_length = earlier["ep_lengths"].tolist()
            self.best_mean_reward = max(map(float, map(np.mean, self.evaluations_results)))
        except Exception as error:  # a damaged file fails in any way
            raise ValueError(
                f"{path} is not readable ({type(error).__name__}: {error}); "
                "remove it to go on without the earlier evaluations"
            ) from None

    def _on_training_end(self) -> None:
        """The last model too, which learned with the smallest steps."""
        if self.evaluations_timesteps[-1:] != [self.num_timesteps]:
            self.eval_freq = 1
            self._on_step()

    def _on_step(self) -> bool:
        start = time.monotonic()
        go_on = super()._on_step()
        self.seconds += time.monotonic() - start
        return go_on


class _Keep(BaseCallback):
    """Save the model to `path`."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self._path = path

    def _on_step(self) -> bool:
        save_model(self._path, self.model)
        return True


class Milestones(BaseCallback):
    """Calls `reached(milestone, heard, seconds)` between rollouts, once each milestone is passed.

    Args:
        milestones: numbers of environment steps, ascending.
        reached: gets the milestone, the steps really done, and the seconds of training so far.

    Attributes:
        seconds: processor time of training so far, without that of the calls: what other programs
            take of the machine does not count.
    """

    def __init__(
        self, milestones: Sequence[int], reached: Callable[[int, int, float], None]
    ) -> None:
        super().__init__()
        self._left = list(milestones)
        self._reached = reached
        self._since = 0.0
        self.seconds = 0.0

    def _on_training_start(self) -> None:
        self._since = time.process_time()

    def _on_rollout_start(self) -> None:
        self._look()

    def _on_training_end(self) -> None:
        self._look()

    def _on_step(self) -> bool:
        return True

    def _look(self) -> None:
        self.seconds += time.process_time() - self._since
        while self._left and self.num_timesteps >= self._left[0]:
            self._reached(self._left.pop(0), self.num_timesteps, self.seconds)
        self._since = time.process_time()
