"""The native vector environments as Stable-Baselines3 takes them: its own `VecEnv`."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv

from gnm_env.checks import shown, whole

Indices = None | int | Iterable[int]


class PatternVecEnv(VecEnv):
    """SB3's view of a vector environment from `gymnasium.make_vec`, wrapped or not.

    As everywhere in SB3, an environment that ends is reset at once: the observation is the first
    of its next episode, and its info holds `terminal_observation` and `TimeLimit.truncated` beside
    what the environment tells at the end. Observations and rewards are copies.

    Args:
        envs: made with `autoreset_mode=AutoresetMode.SAME_STEP`.

    Raises:
        ValueError: if the vector environment resets in another way.
    """

    def __init__(self, envs: VectorEnv[Any, Any, Any]) -> None:
        if not isinstance(envs, VectorEnv):
            raise ValueError(f"envs must be a Gymnasium vector environment, got {shown(envs)}")
        mode = envs.metadata.get("autoreset_mode")
        if mode != AutoresetMode.SAME_STEP:
            raise ValueError(
                f"the vector environment must reset in the same step, got {mode}; make it with "
                "autoreset_mode=gymnasium.vector.AutoresetMode.SAME_STEP"
            )
        self.envs = envs
        self.spec = envs.spec
        self._actions: NDArray[Any] = np.zeros(0)
        self._empty: list[dict[str, Any]] = [{} for _ in range(envs.num_envs)]
        super().__init__(envs.num_envs, envs.single_observation_space, envs.single_action_space)

    def reset(self) -> NDArray[Any]:
        if any(self._options):
            raise ValueError(f"there are no reset options, got {self._options[0]!r}")
        # `seed` has put a seed for each environment here; without it, all are None.
        seeds: Any = None if self._seeds[0] is None else list(self._seeds)
        observations, _ = self.envs.reset(seed=seeds)
        self._reset_seeds()
        self._reset_options()
        self.reset_infos = [{} for _ in range(self.num_envs)]
        return self._own(observations)

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """Seeds for the next reset: `seed` for the first environment, one more for each other."""
        return super().seed(None if seed is None else whole("seed", seed, low=0))

    def step_async(self, actions: NDArray[Any]) -> None:
        self._actions = actions

    def step_wait(self) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any], list[dict[str, Any]]]:
        observations, rewards, terminated, truncated, told = self.envs.step(self._actions)
        over = terminated | truncated
        infos = self._empty_infos()
        for i in np.flatnonzero(over).tolist():
            infos[i] = {
                **_of_one(told["final_info"], i),
                "terminal_observation": told["final_obs"][i],
                "TimeLimit.truncated": bool(truncated[i] and not terminated[i]),
            }
        return self._own(observations), rewards.astype(np.float32), over, infos

    def _empty_infos(self) -> list[dict[str, Any]]:
        """A new list of empty dicts, the same ones each time unless somebody wrote into one."""
        if any(self._empty):
            self._empty = [{} for _ in range(self.num_envs)]
        return self._empty.copy()

    def _own(self, observations: NDArray[Any]) -> NDArray[Any]:
        """A copy where the environment hands out the array that it goes on writing into."""
        copies = getattr(self.envs.unwrapped, "copy", False)
        return observations if copies and self.envs is self.envs.unwrapped else observations.copy()

    def close(self) -> None:
        self.envs.close()

    def get_attr(self, attr_name: str, indices: Indices = None) -> list[Any]:
        """The attribute of the vector environment, once for each environment asked about."""
        those = list(self._get_indices(indices))
        if not all(-self.num_envs <= i < self.num_envs for i in those):
            raise IndexError(f"there are {self.num_envs} environments, got indices {those}")
        if attr_name == "render_mode":
            return [None for _ in those]
        return [self._attribute(attr_name) for _ in those]

    def _attribute(self, name: str) -> Any:
        return getattr(self.envs if hasattr(self.envs, name) else self.envs.unwrapped, name)

    def set_attr(self, attr_name: str, value: Any, indices: Indices = None) -> None:
        """Set an attribute of the vector environment, which all environments share."""
        if indices is not None and len(list(self._get_indices(indices))) < self.num_envs:
            raise ValueError(f"{attr_name} is shared by all environments: leave indices out")
        setattr(self.envs.unwrapped, attr_name, value)

    def env_method(
        self, method_name: str, *method_args: Any, indices: Indices = None, **method_kwargs: Any
    ) -> list[Any]:
        raise NotImplementedError(
            f"there are no single environments whose {method_name}() could be called: "
            "use the vector environment, .envs"
        )

    def env_is_wrapped(
        self, wrapper_class: type[gym.Wrapper[Any, Any, Any, Any]], indices: Indices = None
    ) -> list[bool]:
        return [False for _ in self._get_indices(indices)]


def _of_one(infos: dict[str, Any], i: int) -> dict[str, Any]:
    """What a vector environment's dict of arrays says of environment `i`, in plain Python."""
    return {
        key: _plain(values[i])
        for key, values in infos.items()
        if not key.startswith("_") and _said(infos.get(f"_{key}"), i)
    }


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value


def _said(mask: Sequence[bool] | None, i: int) -> bool:
    return mask is None or bool(mask[i])
