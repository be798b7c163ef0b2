"""PPO in plain torch, in one file, by the settings of docs/reinforcement-learning.md.

    python examples/ppo_from_scratch.py
    python examples/ppo_from_scratch.py --pattern-seed 300 --steps 2000000

Learns one class from the terminal cost alone, and is scored as every neuron is. Start from here
with an agent of your own: what matters is that it hears `TRACES`, and says that it was trained on
them.
"""

from __future__ import annotations

import argparse
import itertools
import math
import time
from collections.abc import Sequence
from typing import Any

import gymnasium as gym
import numpy as np
import torch
from gymnasium.vector import AutoresetMode, VectorEnv
from numpy.typing import NDArray
from torch import Tensor, nn

from agents import noisy_performance
from agents.rl import TRACES, SB3Agent
from gnm_env import Patterns, Task

ENVS, STEPS, MINIBATCHES, EPOCHS = 64, 256, 8, 3
"""64 environments, 256 bins of each per rollout, in 8 parts, each used 3 times."""

LEARNING_RATE, CLIP, ENTROPY, VALUE, MAX_NORM = 3e-3, 0.2, 0.01, 0.5, 0.5
SPIKES_AT_FIRST = 0.01
"""Per bin: a fresh policy would spike in every other bin, and first have to unlearn that."""


class Policy(nn.Module):
    """64 × 64 units for the answer, beside a linear critic; begins near silence."""

    observation_config = TRACES  # compared where it is scored

    def __init__(self, n_observed: int) -> None:
        super().__init__()
        sizes = (n_observed, 64, 64, 2)
        layers = [nn.Linear(a, b) for a, b in itertools.pairwise(sizes)]
        self.answer = nn.Sequential(layers[0], nn.Tanh(), layers[1], nn.Tanh(), layers[2])
        self.critic = nn.Linear(n_observed, 1)
        for layer, gain in zip([*layers, self.critic], (2**0.5, 2**0.5, 1e-3, 1.0), strict=True):
            nn.init.orthogonal_(layer.weight, gain)
            nn.init.zeros_(layer.bias)
        with torch.no_grad():
            layers[2].bias[1] = math.log(SPIKES_AT_FIRST / (1.0 - SPIKES_AT_FIRST))

    def forward(self, observed: Tensor) -> tuple[torch.distributions.Categorical, Tensor]:
        """The distribution of the answers, and the value, (n,)."""
        answers = torch.distributions.Categorical(logits=self.answer(observed), validate_args=False)
        return answers, self.critic(observed).squeeze(-1)

    def predict(
        self, observation: Any, state: Any = None, episode_start: Any = None, best: bool = True
    ) -> tuple[NDArray[np.int64], Any]:
        """The most likely answers: what SB3Agent asks for."""
        with torch.no_grad():
            return self.answer(torch.as_tensor(observation)).argmax(-1).numpy(), state


def collect(envs: VectorEnv, policy: Policy, observed: Tensor) -> tuple[dict[str, Tensor], Tensor]:
    """One rollout: what was observed, answered and thought, (STEPS, ENVS, …), and what came of it.

    With γ = λ = 1 the return of a bin is the sum of all later rewards of its trial; of trials that
    go on, the critic guesses the rest.
    """
    rows: dict[str, list[Tensor]] = {}
    for _ in range(STEPS):
        with torch.no_grad():
            answers, value = policy(observed)
        action = answers.sample()
        following, reward, over, _, _ = envs.step(action.numpy())
        row = {
            "observed": observed, "action": action, "value": value,
            "log_p": answers.log_prob(action), "reward": torch.as_tensor(reward).float(),
            "goes_on": torch.as_tensor(~over).float(),
        }  # fmt: skip
        for name, column in row.items():
            rows.setdefault(name, []).append(column)
        observed = torch.as_tensor(following)
    rollout = {name: torch.stack(column) for name, column in rows.items()}
    with torch.no_grad():
        later = policy(observed)[1]
    returns = torch.empty_like(rollout["reward"])
    for t in reversed(range(STEPS)):
        later = returns[t] = rollout["reward"][t] + rollout["goes_on"][t] * later
    rollout["return"], rollout["advantage"] = returns, returns - rollout["value"]
    return {name: part.flatten(0, 1) for name, part in rollout.items()}, observed


def improve(policy: Policy, optimiser: torch.optim.Optimizer, rollout: dict[str, Tensor]) -> None:
    """PPO's clipped steps on one rollout."""
    for _ in range(EPOCHS):
        for part in torch.randperm(STEPS * ENVS).chunk(MINIBATCHES):
            batch = {name: values[part] for name, values in rollout.items()}
            answers, value = policy(batch["observed"])
            advantage = batch["advantage"]
            advantage = (advantage - advantage.mean()) / (advantage.std() + 1e-8)
            ratio = (answers.log_prob(batch["action"]) - batch["log_p"]).exp()
            gain = torch.min(ratio * advantage, ratio.clamp(1 - CLIP, 1 + CLIP) * advantage).mean()
            loss = VALUE * (value - batch["return"]).square().mean() - gain
            loss = loss - ENTROPY * answers.entropy().mean()
            optimiser.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(policy.parameters(), MAX_NORM)
            optimiser.step()


def train(task: Task, patterns: Patterns, steps: int, seed: int) -> Policy:
    """A policy after so many bins of training."""
    torch.manual_seed(seed)
    torch.set_num_threads(1)  # on networks this small, threads only get in each other's way
    bare = gym.make_vec(
        "gnm/PatternTrial-v0", num_envs=ENVS, vectorization_mode="vector_entry_point",
        task=task, patterns=patterns, feedback="cost", autoreset_mode=AutoresetMode.SAME_STEP,
    )  # fmt: skip
    envs = TRACES.wrap(bare)
    observed = torch.as_tensor(envs.reset(seed=seed)[0])
    policy = Policy(observed.shape[1])
    optimiser = torch.optim.Adam(policy.parameters(), eps=1e-5)
    rollouts = max(steps // (STEPS * ENVS), 1)
    for k in range(rollouts):
        optimiser.param_groups[0]["lr"] = LEARNING_RATE * (1.0 - k / rollouts)
        rollout, observed = collect(envs, policy, observed)
        improve(policy, optimiser, rollout)
    return policy


def main(arguments: Sequence[str] | None = None) -> float:
    """Train and score; returns the mean noisy performance."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--pattern-seed", type=int, default=0)
    parser.add_argument("--seed", type=int, default=0, help="of the training")
    parser.add_argument("--steps", type=int, default=2_000_000, help="bins to hear")
    parser.add_argument("--runs", type=int, default=100, help="streams of the score")
    options = parser.parse_args(arguments)
    task = Task(n_classes=1)
    patterns = Patterns.draw(task, options.pattern_seed)
    start = time.perf_counter()
    policy = train(task, patterns, options.steps, options.seed)
    seconds = time.perf_counter() - start
    agent = SB3Agent(policy, task)
    survived = noisy_performance(agent, task, patterns, runs=options.runs, seed=1_000_000)
    print(f"noisy performance {survived.mean():,.0f} bins; {seconds:,.0f} s of training")
    return float(survived.mean())


if __name__ == "__main__":
    main()
