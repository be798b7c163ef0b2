"""An agent from outside on the suite: one file, one command, the same scores bit by bit.

    python examples/suite_agent.py --out results/mine
    gnm report results/mine
    python examples/suite_agent.py --out results/again
    gnm report results/mine --same-as results/again

The agent is a leaky neuron in plain NumPy that learns from the sign of the reward alone. Nothing of
`agents` but the score is used: put an agent of your own in its place, in any framework.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.suite import score
from gnm_env import suite
from gnm_env.results import Recorder

KEEP, THRESHOLD = 0.8, 1.0
RATE = 2e-3
"""Of learning: what the most active inputs of a wrong trial gain or lose."""


class LeakyNeuron:
    """Spikes where a weighted sum of decaying inputs rises through its threshold."""

    def __init__(self, n_inputs: int, seed: int) -> None:
        self.weights = np.random.default_rng(seed).random(n_inputs) * 0.2
        self.begin_trial()

    def begin_trial(self) -> None:
        """Forget what was heard."""
        self._trace = np.zeros(len(self.weights))
        self._heard = np.zeros(len(self.weights))
        self._above = False

    def act(self, bits: NDArray[np.int8]) -> int:
        """The answer to one bin."""
        self._trace = KEEP * self._trace + bits
        # Summed by NumPy itself, one after another in its order: no library that sums otherwise.
        potential = float(np.add.reduce(self.weights * self._trace))
        self._heard += max(potential, 0.0) * self._trace
        above = potential >= THRESHOLD
        spike, self._above = above and not self._above, above
        return int(spike)

    def learn(self, sign: float) -> None:
        """+1 asks for more spikes, −1 for fewer: the inputs that were heard at high potential."""
        if sign and self._heard.max() > 0.0:
            most = self._heard >= np.quantile(self._heard, 0.9)
            self.weights[most] = np.clip(self.weights[most] + sign * RATE, 0.0, 1.0)


def train(env: Any, agent: LeakyNeuron, trials: int, seed: int) -> None:
    """The standard loop, one trial an episode."""
    for trial in range(trials):
        bits, _ = env.reset(seed=seed if trial == 0 else None)
        agent.begin_trial()
        over = False
        while not over:
            bits, reward, over, _, _ = env.step(agent.act(bits))
        agent.learn(reward)


def main(arguments: Sequence[str] | None = None) -> list[float]:
    """Train, score and record on each pattern seed; returns the scores."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--level", default="1class", help=f"one of {', '.join(suite())}")
    parser.add_argument("--out", type=Path, default=Path("results/leaky-neuron"))
    parser.add_argument("--trials", type=int, default=2_000, help="to learn from")
    parser.add_argument("--seeds", type=int, default=10, help="how many of the pattern seeds")
    options = parser.parse_args(arguments)
    level, means = suite()[options.level], []
    for seed in suite().pattern_seeds[: options.seeds]:
        command = (
            f"python examples/suite_agent.py --level {level.name} --trials {options.trials} "
            f"--seeds {options.seeds}"
        )
        agent = LeakyNeuron(level.task.n_inputs, seed)
        recorder = Recorder(
            options.out, level, seed, "leaky neuron", parameters=len(agent.weights), command=command
        )
        env = recorder.watch(level.trial_env(seed, feedback="sign", disable_env_checker=True))
        train(env, agent, options.trials, seed)
        survived = score(agent, level, seed, recorder=recorder)
        means.append(float(survived.mean()))
        print(f"pattern seed {seed}: {means[-1]:,.0f} bins; {recorder.heard:,} heard")
    return means


if __name__ == "__main__":
    main()
