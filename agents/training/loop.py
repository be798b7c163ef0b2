"""The standard loop: one agent, one environment, one bin at a time."""

from __future__ import annotations

import warnings
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.random import Generator

from agents.history import BLOCK, Callback, History, checked_callback
from gnm_env.checks import shown, whole

MAX_TRIALS = 10**12
"""Most trials of one call."""


class WeightOverflow(RuntimeWarning):
    """A weight would have overflowed, or the potential has: learning ended.

    The last finite weights are kept.
    """


def train(
    agent: Any,
    env: gym.Env[Any, Any],
    trials: int,
    seed: int | Generator | None = None,
    *,
    callback: Callback | None = None,
    block: int = BLOCK,
) -> History:
    """Train `agent` on `trials` episodes of `env`, a PatternTrial environment, wrapped or not.

    Args:
        agent: offers begin_trial(), act(obs) and learn(reward, info, sign_only). Spikes and amounts
            do not mix: a spiking agent needs an environment of spikes. If it has an attribute
            `overflowed`, training ends once that is True; answers within its `wrong_beyond` of the
            label, if it has one, count as right.
        env: gives the aggregate label in its terminal info, or its sign as reward.
        trials: number of episodes, at most MAX_TRIALS.
        seed: of the stream. A Generator goes on from where it stands (and is moved on); None goes
            on with the environment's own.
        callback: called after each block with the trials done and the history; False ends training.
        block: trials per entry of the history.

    Returns:
        The learning curve. Ends with the same bits as `train_many` on the same seed.

    Raises:
        ValueError: if a number is out of range, if `agent` does not learn in `env`, or if `env`
            ends a trial without its label.
    """
    trials = whole("trials", trials, low=0, high=MAX_TRIALS)
    block = whole("block", block, low=1, high=MAX_TRIALS)
    callback = checked_callback(callback)
    _require_learner(agent)
    _require_env(env, agent)
    sign_only = getattr(env.unwrapped, "feedback", None) == "sign"
    if isinstance(seed, Generator):
        env.unwrapped.np_random = seed
        seed = None
    # Amounts are never exactly right: an agent that gives them says what counts as wrong.
    wrong_beyond = max(
        getattr(env.unwrapped, "tolerance", 0.0), getattr(agent, "wrong_beyond", 0.0)
    )
    history = History()
    for start in range(0, trials, block):
        size = min(block, trials - start)
        wrong, absolute = 0, 0.0
        for trial in range(start, start + size):
            obs, info = env.reset(seed=seed)
            seed = None
            agent.begin_trial()
            ended = False
            while not ended:
                obs, reward, terminated, truncated, info = env.step(agent.act(obs))
                ended = terminated or truncated
            if "label" not in info or "emitted" not in info:
                raise ValueError(
                    "env must tell the aggregate label at the end of each trial, as "
                    f"gnm/PatternTrial-v0 does, got info {info} from {env}; "
                    "a trial must not be truncated"
                )
            agent.learn(float(reward), info, sign_only)
            error = abs(info["label"] - info["emitted"])
            wrong += error > wrong_beyond
            absolute += error
            if getattr(agent, "overflowed", False) and history.overflowed < 0:
                history.overflowed = np.array(trial)
        history.append(size, wrong, absolute)
        if callback is not None and callback(start + size, history) is False:
            break
        if history.overflowed >= 0:
            break
    if history.overflowed >= 0:
        warn_of_overflow("the agent", int(history.overflowed) + 1)
    return history


def _require_learner(agent: Any) -> None:
    missing = [
        name for name in ("begin_trial", "act", "learn") if not callable(getattr(agent, name, None))
    ]
    if missing or isinstance(agent, type):
        lacks = f", which has no {missing[0]}()" if missing else ""
        raise ValueError(
            "agent must be one agent with begin_trial(), act(obs) and learn(reward, info, "
            f"sign_only), such as NeuronAgent makes, got {shown(agent)}{lacks}"
        )


def _require_env(env: Any, agent: Any) -> None:
    lacking = not all(hasattr(env, name) for name in ("reset", "step", "unwrapped"))
    if lacking or isinstance(env, (type, gym.vector.VectorEnv)):
        raise ValueError(
            f"env must be a gymnasium Env, got {shown(env)}; "
            'make one with gymnasium.make("gnm/PatternTrial-v0"), or use train_many'
        )
    graded = getattr(getattr(agent, "model", None), "graded", None)
    actions = getattr(env, "action_space", None)
    if graded is None or actions is None:
        return  # an agent or an environment of another make
    if graded == isinstance(actions, gym.spaces.Discrete):
        given, output = ("amounts", "graded") if graded else ("spikes", "spikes")
        raise ValueError(
            f"the {type(agent).__name__} answers with {given}, and the environment takes "
            f'{actions}: make it with output="{output}"'
        )


def warn_of_overflow(who: str, trials: int) -> None:
    """Warn, with a remedy, that learning has ended; as if from where training was called."""
    warnings.warn(
        f"a weight or a potential of {who} would have overflowed within {trials:,} trials: "
        "learning ended and the last finite weights are kept; lower learning_rate or "
        "initial_weight, or set weight_bounds",
        WeightOverflow,
        stacklevel=3,
    )
