"""Both environments as native vector environments: many copies, one compiled call a step."""

from __future__ import annotations

import math
import operator
from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from gnm_env.base.kernels import (
    COST,
    DISABLED,
    NEXT_STEP,
    NO_LIMIT,
    SAME_STEP,
    clear_rows,
    event_shift,
    new_crowd,
)
from gnm_env.checks import whole
from gnm_env.generators import Generators
from gnm_env.task import Patterns, Task, task_arrays

AUTORESET = {
    AutoresetMode.NEXT_STEP: NEXT_STEP,
    AutoresetMode.SAME_STEP: SAME_STEP,
    AutoresetMode.DISABLED: DISABLED,
}

Bits = NDArray[np.int8]
Seeds = int | list[int | None] | None
Step = tuple[Bits, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]


class PatternVectorEnv(VectorEnv[Bits, NDArray[Any], NDArray[Any]]):
    """Base of the vector environments: what they have in common, and the manual of that.

    ## Seeding
    After `reset(seed=s)` environment i hears what the single environment hears after
    `reset(seed=s + i)`. A list holds one seed per environment, None where the generator goes on.
    Each environment draws from a generator of its own, in the order of the single environment: its
    rollout is that of the single environment, whatever the others do.

    ## Autoreset
    `autoreset_mode`, also in `metadata["autoreset_mode"]`, is NEXT_STEP (the step after the end of
    an episode ignores the action and returns the first observation of the next), SAME_STEP (the
    step that ends an episode returns it, and `info` has `final_obs` and `final_info`) or DISABLED
    (ended environments must be reset before the next step). `reset(options={"reset_mask": mask})`
    resets those environments where the bool array `mask` is True, in any mode.

    ## Observations
    int8 (num_envs, N). With `copy=True` a new array each time. With `copy=False` always the same
    array, which the next call overwrites: faster, for those who use or copy it at once.

    ## Info
    As Gymnasium's SyncVectorEnv has it: for each key an array over environments, and under `_key` a
    bool array that tells where it holds (one for all keys, read-only). Lists are in object arrays.
    """

    _results: Any
    """TrialResults or StreamResults of the last step."""

    def __init__(
        self,
        num_envs: int,
        task: Task,
        patterns: Patterns | None,
        pattern_seed: int,
        action_space: spaces.Space[Any],
        max_episode_steps: int | None,
        autoreset_mode: AutoresetMode | str,
        copy: bool,
        render_mode: str | None,
    ) -> None:
        self.num_envs = whole("num_envs", num_envs, low=1)
        self.task = task
        self.patterns = Patterns.draw(task, pattern_seed) if patterns is None else patterns
        self._task_arrays = task_arrays(task, self.patterns)
        if render_mode is not None:
            raise ValueError(
                f"render_mode must be None, got {render_mode!r}: many environments at once draw no "
                "pictures; use gymnasium.make or vectorization_mode='sync'"
            )
        self.autoreset_mode = AutoresetMode(autoreset_mode)
        self.metadata = {"render_modes": [], "autoreset_mode": self.autoreset_mode}
        self._by_hand = self.autoreset_mode == AutoresetMode.DISABLED
        self.copy = bool(copy)
        self._limit = NO_LIMIT
        if max_episode_steps is not None:
            self._limit = whole("max_episode_steps", max_episode_steps, low=1, high=NO_LIMIT - 1)
        self.single_observation_space = spaces.Box(0, 1, (task.n_inputs,), np.int8)
        self.single_action_space = action_space
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(action_space, self.num_envs)

        self._observations = np.zeros((self.num_envs, task.n_inputs), np.int8)
        self._finals = np.zeros_like(self._observations)
        self._over = np.zeros(self.num_envs, np.int64)
        self._heads = np.zeros((self.num_envs, 5), np.int64)
        self._n_over = 0
        self._generators: Generators | None = None
        self._seeds: list[int | None] = []
        self._crowd: Any = None

    def _new_crowd(
        self,
        state: NDArray[Any],
        emitted: NDArray[Any],
        most: float,
        feedback: int = COST,
        tolerance: float = 0.0,
    ) -> Any:
        return new_crowd(
            self._seeded().held,
            self._task_arrays,
            AUTORESET[self.autoreset_mode],
            self._limit,
            most,
            feedback,
            tolerance,
            state,
            emitted,
            np.zeros((self.num_envs, 8), self._event_type()),
            self._observations,
            self._over,
            self._finals,
            self._results,
            self._heads,
        )

    def _event_type(self) -> type[np.signedinteger[Any]]:
        """The smallest type that holds the last bin of what is drawn, with a channel."""
        bits = event_shift(self.task.n_inputs) + math.ceil(math.log2(self._most_bins() + 2))
        return np.int32 if bits < 32 else np.int64

    # What the two kinds of environment do each in its own way.

    def _most_bins(self) -> float:
        """No trial, or piece of a stream, is ever longer."""
        raise NotImplementedError

    def _begin(self, which: NDArray[np.int64]) -> None:
        """Begin an episode in the environments `which`, whose rows are clear."""
        raise NotImplementedError

    def _reseeded(self, i: int) -> None:
        """Environment `i` has a new generator."""

    # Random numbers

    @property
    def np_random(self) -> Any:
        """The generator of each environment, in a tuple."""
        return tuple(self._seeded().rngs)

    @np_random.setter
    def np_random(self, value: Any) -> None:
        raise AttributeError("each environment has its own generator; use reset(seed=…)")

    @property
    def np_random_seed(self) -> Any:
        """The seed of each environment's generator, in a tuple."""
        self._seeded()
        return tuple(self._seeds)

    def _seeded(self) -> Generators:
        """The generators, with seeds from the operating system if none were given yet."""
        if self._generators is None:
            drawn = [seeding.np_random() for _ in range(self.num_envs)]
            self._seeds = [seed for _, seed in drawn]
            self._generators = Generators(rng for rng, _ in drawn)
        return self._generators

    def _seed(self, seed: Seeds, which: NDArray[np.int64]) -> None:
        """New generators for the environments `which` that are given a seed."""
        if seed is None:
            return
        seeds = self._seed_of_each(seed)
        # All first: a seed that is refused then leaves everything as it was.
        drawn = {i: seeding.np_random(seeds[i]) for i in which.tolist() if seeds[i] is not None}
        generators = self._seeded()
        for i, (rng, self._seeds[i]) in drawn.items():
            generators.replace(i, rng)
            self._reseeded(i)

    def _seed_of_each(self, seed: int | list[int | None]) -> list[int | None]:
        """One seed per environment, None where its generator goes on."""
        try:
            first = operator.index(seed)  # type: ignore[arg-type]
        except TypeError:
            return self._listed(seed)
        return [first + i for i in range(self.num_envs)]

    def _listed(self, seeds: Any) -> list[int | None]:
        """Seeds that are given one by one."""
        expected = f"seed must be a whole number or one per environment, num_envs = {self.num_envs}"
        try:
            listed = [None if seed is None else operator.index(seed) for seed in seeds]
        except TypeError:
            raise ValueError(f"{expected}, got {seeds!r}") from None
        if len(listed) != self.num_envs:
            raise ValueError(f"{expected}, got {len(listed)} seeds")
        return listed

    # Reset and step

    def reset(
        self, *, seed: Seeds = None, options: dict[str, Any] | None = None
    ) -> tuple[Bits, dict[str, Any]]:
        """Begin an episode in every environment, or in those of `options["reset_mask"]`.

        `seed` is that of environment 0, the others counting up, or a list; see the class.
        """
        mask = self._mask(options)
        which = np.flatnonzero(mask)
        self._seed(seed, which)
        if self._crowd is not None:
            self._n_over = clear_rows(self._crowd, mask)
        self._begin(which)
        return self._seen(), {}

    def _mask(self, options: dict[str, Any] | None) -> NDArray[np.bool_]:
        """Where to reset."""
        unknown = sorted(set(options or {}) - {"reset_mask"})
        if unknown:
            raise ValueError(f"unknown reset option {unknown[0]!r}; known options: 'reset_mask'")
        mask = (options or {}).get("reset_mask")
        if mask is None:
            return np.ones(self.num_envs, np.bool_)
        wrong = not isinstance(mask, np.ndarray) or mask.dtype != np.bool_
        if wrong or mask.shape != (self.num_envs,) or not mask.any():
            raise ValueError(
                f"options['reset_mask'] must be a bool array of shape ({self.num_envs},) with at "
                f"least one True, got {mask!r}"
            )
        if self._crowd is None:
            raise ResetNeeded("call reset() once for all environments before using 'reset_mask'")
        return mask

    def _seen(self) -> Bits:
        return self._observations.copy() if self.copy else self._observations

    def _require_reset(self) -> None:
        """ResetNeeded unless every environment can take a step."""
        if self._crowd is None:
            raise ResetNeeded("call reset() before step()")
        if self._n_over and self._by_hand:
            raise ResetNeeded(
                f"environment {self._over[0]} has ended and autoreset is disabled: call "
                "reset(options={'reset_mask': mask}) before step()"
            )

    def _spikes(self, actions: NDArray[Any]) -> NDArray[np.int64]:
        """Actions as int64 (n,); whether each is 0 or 1 the compiled step finds out."""
        checked = np.asarray(actions)
        if checked.shape != (self.num_envs,) or checked.dtype.kind not in "iub":
            raise ValueError(
                f"actions must be whole numbers of shape ({self.num_envs},), one per environment, "
                f"got {checked.dtype} of shape {checked.shape}"
            )
        return np.ascontiguousarray(checked, np.int64)

    def _no_spike(self, actions: NDArray[Any], bad: int) -> ValueError:
        return ValueError(
            f"action must be 0 (silent) or 1 (spike), got {np.asarray(actions)[bad]!r} "
            f"for environment {bad}"
        )

    def _stepped(self, info: dict[str, Any]) -> Step:
        """What `step` returns: copies, since the next step writes to the same results."""
        results = self._results
        return (
            self._seen(),
            results.rewards.copy(),
            results.terminated.copy(),
            results.truncated.copy(),
            info,
        )

    def _info(self, terminal: dict[str, Any]) -> dict[str, Any]:
        """`terminal`, the info of what has ended, in the form that the autoreset mode asks for."""
        if self.autoreset_mode != AutoresetMode.SAME_STEP:
            return terminal
        over = self._over[: self._n_over]
        final_obs = np.empty(self.num_envs, object)
        for i, row in zip(over.tolist(), self._finals[: self._n_over].copy(), strict=True):
            final_obs[i] = row
        mask = np.zeros(self.num_envs, np.bool_)
        mask[over] = True
        return {
            "final_obs": final_obs,
            "_final_obs": mask,
            "final_info": terminal,
            "_final_info": mask.copy(),
        }


def read_only(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """A copy that may stand in `info` under several keys."""
    copy = mask.copy()
    copy.setflags(write=False)
    return copy
