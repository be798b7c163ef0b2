"""What the native vector environments share: many copies, one compiled call a step."""

from __future__ import annotations

import copy
import math
import operator
import threading
from collections.abc import Sequence
from typing import Any, Self

import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from gnm_env.base.env import array_of, checked_options
from gnm_env.base.kernels import (
    COST,
    DISABLED,
    NEXT_STEP,
    SAME_STEP,
    Config,
    DisplayArrays,
    Episodes,
    Growing,
    OutcomeArrays,
    StepCounters,
    clear_rows,
    event_shift,
    growing_of,
    new_state,
)
from gnm_env.base.params import NO_LIMIT, EnvParams, HasParams, VectorParams
from gnm_env.checks import MAX_SEED, require_memory, shown, whole
from gnm_env.generators import Generators

AUTORESET = {
    AutoresetMode.NEXT_STEP: NEXT_STEP,
    AutoresetMode.SAME_STEP: SAME_STEP,
    AutoresetMode.DISABLED: DISABLED,
}

Bits = NDArray[np.int8]
Seeds = int | list[int | None] | None
Step = tuple[Bits, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]


class PatternVectorEnv(HasParams, VectorEnv[Bits, NDArray[Any], NDArray[Any]]):
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

    _source: Any
    """Where trials and streams come from, for compiled code."""
    _episodes: Episodes
    """The state of each episode, for compiled code."""

    def __init__(
        self, params: EnvParams, vector: VectorParams, action_space: spaces.Space[Any]
    ) -> None:
        if params.render_mode is not None:
            raise ValueError(
                f"render_mode must be None, got {params.render_mode!r}: many environments at once "
                "draw no pictures; use gymnasium.make or vectorization_mode='sync'"
            )
        self.num_envs, self.copy = vector.num_envs, vector.copy
        self._params = params
        self.autoreset_mode = AutoresetMode(vector.autoreset_mode)
        self.metadata = {"render_modes": [], "autoreset_mode": self.autoreset_mode}
        self._by_hand = self.autoreset_mode == AutoresetMode.DISABLED
        self._limit = vector.max_episode_steps or NO_LIMIT
        self._n_inputs = params.n_inputs
        self.single_observation_space = spaces.Box(0, 1, (self._n_inputs,), np.int8)
        self.single_action_space = action_space
        # Compiled code relies on it, whatever becomes of `num_envs`.
        self._n = n = self.num_envs
        require_memory(
            f"num_envs = {n:,} with {self._n_inputs:,} channels each",
            20.0 * n * self._n_inputs,
            "lower num_envs",
        )
        self.observation_space = batch_space(self.single_observation_space, n)
        self.action_space = batch_space(action_space, n)
        self._display = DisplayArrays(
            observations=np.zeros((n, self._n_inputs), np.int8),
            final_obs=np.zeros((n, self._n_inputs), np.int8),
            # Under SAME_STEP a row may be shown twice in a step: its last bin, and the first anew.
            shown=np.empty(2 * n * self._n_inputs + 1, np.uint64),
        )
        self._outcome = OutcomeArrays(
            done=np.zeros(n, np.int64),
            results=self._new_results(),
            heads=np.zeros((n, 5), np.int64),
        )
        # What is asked for at every step, at hand.
        self._observations, self._results = self._display.observations, self._outcome.results
        self._counters = StepCounters(*np.zeros((4, n), np.uint32))
        self._n_done = 0
        self._generators: Generators | None = None
        self._seeds: list[int | None] = []
        self._state: Any = None
        """Everything for compiled code, from the first `reset` on."""
        self._entry = threading.Lock()

    def _new_state(self, growing: Growing) -> Any:
        """The environments for compiled code, going on from what has grown."""
        return new_state(
            rngs=self._seeded().held,
            source=self._source,
            config=self._config(),
            counters=self._counters,
            episodes=self._episodes,
            display=self._display,
            outcome=self._outcome,
            growing=growing,
        )

    def _config(self) -> Config:
        """What never changes, for compiled code."""
        return Config(
            autoreset=AUTORESET[self.autoreset_mode],
            limit=self._limit,
            most=1.0,
            feedback=COST,
            tolerance=0.0,
            tells_ends=False,
            shift=event_shift(self._n_inputs),
        )

    def _nothing_grown(self) -> Growing:
        """Rows for what has not begun."""
        n = self._n
        return Growing(
            events=np.zeros((n, 8), self._event_type()),
            presentations=np.zeros((n, 8), np.int64),
            edges=np.zeros((n, 2), np.int64),
            target=np.zeros((n, 1), np.int64),
            report=np.empty(64, np.int64),
            n_shown=0,
            n_done=0,
            n_told=0,
        )

    def __getstate__(self) -> dict[str, Any]:
        """What a copy needs to go on from here."""
        if not self._entry.acquire(False):
            raise self._busy()
        try:
            kept = {name: value for name, value in self.__dict__.items() if name != "_entry"}
            kept["_state"] = None if self._state is None else growing_of(self._state)
            return kept
        finally:
            self._entry.release()

    def __copy__(self) -> Self:
        """A deep copy: two environments that share arrays would write over each other."""
        return copy.deepcopy(self)

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._entry = threading.Lock()
        if self._state is not None:
            self._state = self._new_state(self._state)

    def _event_type(self) -> type[np.signedinteger[Any]]:
        """The smallest type that holds the last bin of what is drawn, with a channel."""
        bits = event_shift(self._n_inputs) + math.ceil(math.log2(self._most_bins() + 2))
        return np.int32 if bits < 32 else np.int64

    # What the two kinds of environment do each in its own way.

    def _new_results(self) -> Any:
        """TrialResults or StreamResults, of zeros."""
        raise NotImplementedError

    def _step(self, actions: NDArray[Any]) -> Step:
        """One step; nobody else is in here."""
        raise NotImplementedError

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
            drawn = [seeding.np_random() for _ in range(self._n)]
            self._seeds = [seed for _, seed in drawn]
            self._generators = Generators(rng for rng, _ in drawn)
        return self._generators

    def _seed(self, seeds: list[int | None] | None, which: NDArray[np.int64]) -> None:
        """New generators for the environments `which` that are given a seed."""
        if seeds is None:
            return
        generators = self._seeded()
        for i in which.tolist():
            if seeds[i] is not None:
                rng, self._seeds[i] = seeding.np_random(seeds[i])
                generators.replace(i, rng)
                self._reseeded(i)

    def _seed_of_each(self, seed: Any) -> list[int | None] | None:
        """One seed per environment, None where its generator goes on; ValueError if they are none.

        None if no generator is to be replaced.
        """
        if seed is None:
            return None
        n = self._n
        expected = f"seed must be a whole number or one per environment, num_envs = {n}"
        try:
            first = operator.index(seed)
        except TypeError:
            return self._listed(seed, expected)
        whole("seed", first, low=0, high=MAX_SEED - n)
        return [first + i for i in range(n)]

    def _listed(self, seeds: Any, expected: str) -> list[int | None]:
        """Seeds that are given one by one."""
        if not isinstance(seeds, (Sequence, np.ndarray)) or isinstance(seeds, (str, bytes)):
            raise ValueError(f"{expected}, got {shown(seeds)}")
        if len(seeds) != self._n:
            raise ValueError(f"{expected}, got {len(seeds)} seeds")
        try:
            return [
                None if seed is None else whole(f"seed[{i}]", operator.index(seed), low=0)
                for i, seed in enumerate(seeds)
            ]
        except TypeError:
            raise ValueError(f"{expected}, got {shown(seeds)}") from None

    # Reset and step

    @staticmethod
    def _busy() -> ValueError:
        return ValueError(
            "another thread is stepping, resetting or copying these environments: let one thread "
            "do it, or give each thread environments of its own"
        )

    def reset(
        self, *, seed: Seeds = None, options: dict[str, Any] | None = None
    ) -> tuple[Bits, dict[str, Any]]:
        """Begin an episode in every environment, or in those of `options["reset_mask"]`.

        `seed` is that of environment 0, the others counting up, or a list; see the class.
        """
        if not self._entry.acquire(False):
            raise self._busy()
        try:
            mask = self._mask(options)
            # All first: a seed that is refused then leaves everything as it was.
            seeds = self._seed_of_each(seed)
            which = np.flatnonzero(mask)
            self._seed(seeds, which)
            if self._state is None:
                self._state = self._new_state(self._nothing_grown())
            self._n_done = clear_rows(self._state, mask)
            self._begin(which)
            return self._seen(), {}
        finally:
            self._entry.release()

    def step(self, actions: NDArray[Any]) -> Step:
        """Answer the bin just seen in every environment: see the single environment, and above."""
        if not self._entry.acquire(False):
            raise self._busy()
        try:
            if self._state is None or (self._n_done and self._by_hand):
                raise self._reset_needed()
            return self._step(actions)
        finally:
            self._entry.release()

    @property
    def n_done(self) -> int:
        """Number of environments whose episode the last step has ended."""
        return self._n_done

    def _mask(self, options: dict[str, Any] | None) -> NDArray[np.bool_]:
        """Where to reset."""
        mask = checked_options(options, ("reset_mask",)).get("reset_mask")
        if mask is None:
            return np.ones(self._n, np.bool_)
        wrong = not isinstance(mask, np.ndarray) or mask.dtype != np.bool_
        if wrong or mask.shape != (self._n,) or not mask.any():
            raise ValueError(
                f"options['reset_mask'] must be a bool array of shape ({self._n},) with at "
                f"least one True, got {shown(mask)}"
            )
        if self._state is None:
            raise ResetNeeded("call reset() once for all environments before using 'reset_mask'")
        return np.ascontiguousarray(mask)

    def _seen(self) -> Bits:
        return self._observations.copy() if self.copy else self._observations

    def _reset_needed(self) -> ResetNeeded:
        """Why no step can be taken."""
        if self._state is None:
            return ResetNeeded("call reset() before step()")
        return ResetNeeded(
            f"environment {self._outcome.done[0]} has ended and autoreset is disabled: call "
            "reset(options={'reset_mask': mask}) before step()"
        )

    def _spikes(self, actions: NDArray[Any]) -> NDArray[np.int64]:
        """Actions as int64 (n,); whether each is 0 or 1 the compiled step finds out."""
        checked = array_of(actions)
        if checked.shape != (self._n,) or checked.dtype.kind not in "iub":
            raise ValueError(
                f"actions must be whole numbers of shape ({self._n},), one per environment, "
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
        done = self._outcome.done[: self._n_done]
        final_obs = np.empty(self._n, object)
        for i, row in zip(
            done.tolist(), self._display.final_obs[: self._n_done].copy(), strict=True
        ):
            final_obs[i] = row
        mask = np.zeros(self._n, np.bool_)
        mask[done] = True
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
