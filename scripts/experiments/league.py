"""The league: neurons, the network and RL agents on the same patterns, by bins heard.

Two experiments of one form, since neurons are cheap and RL agents are not: each may have pattern
seeds of its own. A cell is one learner that hears its whole budget and is scored on the way.
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents import noisy_performance, train_many
from agents.neuron_agent import NEURONS, RULES
from experiments.design import Axis, Block, Experiment, Setting, Variable
from experiments.methods import GNM_ALL, GNM_ET, GNM_ET_MODULATED, LIF_ALL, MODULATED, MST_ALL
from experiments.training import (
    class_counts,
    evaluation_seed,
    make_agent,
    pattern_seeds,
    training_seed,
)
from gnm_env import Patterns, PatternStreamEnv, Task
from gnm_env.sampling import append_piece, new_buffers
from gnm_env.task import task_arrays

MILESTONES = (100_000, 200_000, 400_000, 800_000, 1_600_000, 4_000_000, 8_000_000, 12_000_000)
"""Bins heard at which a learner is scored; it is scored once more when its budget is spent."""

FINAL = len(MILESTONES)
"""Place of the last score along the axis "milestone"."""

MATCHED = {1: 1_600_000, 2: 8_000_000}
"""Bins at which all are compared, by number of classes: PPO's budget."""

PARTS = ("neurons", "rl")
RUN: dict[str, Any] = {"runs": 100, "cap": 10_000}
SEEDS = {"quick": (3, 1), "full": (10, 5)}
"""Number of pattern seeds of the neurons, and of the RL agents."""
CLASSES = {"quick": (1,), "full": (1, 2)}
FIRST_SEED = 100
"""None of these pattern seeds was used when the settings of the RL agents were chosen."""

_TRIALS = {"trials": 60_000}
_LIF_ET, _MST_ET = {**LIF_ALL, "rule": "et"}, {**MST_ALL, "rule": "et"}

NEURON_LEARNERS: dict[str, Setting] = {
    "GNM, ALL": {**GNM_ALL, **_TRIALS},
    "GNM, ET": {**GNM_ET, **_TRIALS},
    "GNM, ET modulated": {**GNM_ET_MODULATED, **_TRIALS},
    "LIF, ALL": {**LIF_ALL, **_TRIALS},
    "LIF, ET": {**_LIF_ET, **_TRIALS},
    "LIF, ET modulated": {**LIF_ALL, **MODULATED, **_TRIALS},
    "MST, ALL": {**MST_ALL, **_TRIALS},
    "MST, ET": {**_MST_ET, **_TRIALS},
    "MST, ET modulated": {**MST_ALL, **MODULATED, **_TRIALS},
    "network, BP": {"neuron": "network", "rule": "bp", **_TRIALS},
    "silent": {"reference": "silent"},
    "random spikes": {"reference": "random"},
    "oracle": {"reference": "oracle"},
}

_SLOW = {"most": 1_600_000}
"""Bins that learners hear at most which take minutes per million."""

RL_LEARNERS: dict[str, Setting] = {
    "PPO, cost": {"algorithm": "ppo", "feedback": "cost"},
    "PPO, dense": {"algorithm": "ppo", "feedback": "dense"},
    "PPO linear, cost": {"algorithm": "ppo-linear", "feedback": "cost"},
    "RecurrentPPO, cost": {"algorithm": "recurrent-ppo", "feedback": "cost", **_SLOW},
    "RecurrentPPO, dense": {"algorithm": "recurrent-ppo", "feedback": "dense", **_SLOW},
    "DQN, dense": {"algorithm": "dqn", "feedback": "dense", **_SLOW},
    "PPO, random weights": {
        "algorithm": "ppo",
        "feedback": "cost",
        "steps": 0,
        "spike_probability": 0.5,
    },
}

VARIABLES = (
    Variable(
        "survived",
        "int32",
        "bins",
        "bins survived before the first mistake, learning off; -1 beyond the budget",
        ("milestone", "run"),
    ),
    Variable(
        "heard", "int64", "bins", "bins heard in training; -1 beyond the budget", ("milestone",)
    ),
    Variable("seconds", "float64", "s", "time of training alone, on one core", ("milestone",)),
    Variable("parameters", "int64", "1", "number of trainable parameters"),
)


def league(
    part: str, size: str, seeds: tuple[int, ...] | None = None, steps: int | None = None
) -> Experiment:
    """The half of the league that `part` names, "neurons" or "rl".

    `steps` shortens the training of RL agents, for trying things out.
    """
    rows = NEURON_LEARNERS if part == "neurons" else RL_LEARNERS
    count = SEEDS[size][part == "rl"]
    seeds = seeds or tuple(range(FIRST_SEED, FIRST_SEED + count))
    # Seeds first: a run that is stopped has every learner on the patterns that it came to.
    axes = (
        pattern_seeds(seeds),
        class_counts(*CLASSES[size]),
        Axis("learner", tuple(rows), settings=tuple(rows.values()), long_name="who learns"),
    )
    common = {**RUN, **({"budget": steps} if steps and part == "rl" else {})}
    return Experiment(
        f"league-{part}",
        "Learners side by side, by bins heard",
        axes,
        common,
        learn_and_score,
        VARIABLES,
        {"milestone": FINAL + 1, "run": RUN["runs"]},
        _protocol(part),
    )


def _protocol(part: str) -> dict[str, Any]:
    """Every default that the settings leave out, and how seeds become streams."""
    if part == "neurons":
        from agents.network import BackPropagation, Network

        kinds: list[tuple[str, Any]] = [
            *NEURONS.items(),
            *RULES.items(),
            ("network", Network),
            ("bp", BackPropagation),
        ]
        defaults = {name: asdict(kind()) for name, kind in kinds}
    else:
        from agents.rl import RECIPES

        defaults = {
            kind: {"senses": asdict(recipe.senses), "n_envs": recipe.n_envs}
            | {name: str(value) for name, value in recipe.settings(recipe.n_envs).items()}
            for kind, recipe in RECIPES.items()
        }
    return {
        "milestones": list(MILESTONES),
        "budget": {str(classes): bins for classes, bins in MATCHED.items()},
        "defaults": defaults,
        "seeds": {
            "patterns": "default_rng((pattern_seed, 1))",
            "training": "default_rng(training_seed) for neurons, seed=1000 * pattern_seed for SB3",
            "evaluation": "default_rng(evaluation_seed + run)",
        },
    }


def learn_and_score(block: Block) -> dict[str, NDArray[Any]]:
    """Train the one learner of a block and score it on the way."""
    (setting,) = block.settings
    log = Log(setting)
    parameters = _learner(setting)(setting, log)
    return {
        "survived": log.survived.reshape(*block.shape, FINAL + 1, -1),
        "heard": log.heard.reshape(*block.shape, -1),
        "seconds": log.seconds.reshape(*block.shape, -1),
        "parameters": np.full(block.shape, parameters),
    }


class Log:
    """Scores of one learner, milestone by milestone.

    Attributes:
        task, patterns: what the learner hears.
        seed: of the streams of the score.
        survived: (milestones + 1, runs); heard, seconds: (milestones + 1,).
    """

    def __init__(self, setting: Setting) -> None:
        self.task = Task(n_classes=setting["classes"])
        self.patterns = Patterns.draw(self.task, setting["pattern_seed"])
        self.seed = evaluation_seed(setting["classes"], setting["pattern_seed"])
        self._runs, self._cap = setting["runs"], setting["cap"]
        self.survived = np.full((FINAL + 1, self._runs), -1)
        self.heard = np.full(FINAL + 1, -1)
        self.seconds = np.full(FINAL + 1, np.nan)

    def score(self, milestone: int, agent: Any, heard: int, seconds: float) -> None:
        """Enter the score of `agent` after so many bins and seconds of training."""
        self.enter(milestone, noisy_performance(
            agent, self.task, self.patterns, self._runs, self._cap, self.seed, threads=1
        ), heard, seconds)  # fmt: skip

    def enter(
        self, milestone: int, survived: NDArray[np.int64], heard: int, seconds: float
    ) -> None:
        """Enter bins survived, for a milestone and, until a later one comes, as the last."""
        for place in {milestone, FINAL}:
            self.survived[place] = survived
            self.heard[place], self.seconds[place] = heard, seconds


def _learner(setting: Setting) -> Callable[[Setting, Log], int]:
    """What trains it; each returns the number of trainable parameters."""
    if "reference" in setting:
        return _reference
    return _rl_agent if "algorithm" in setting else _neuron


def _neuron(setting: Setting, log: Log) -> int:
    """A neuron or the network. Bins heard are trials times their mean length."""
    task, patterns = log.task, log.patterns
    agent, twin = make_agent(setting, task), make_agent(setting, task)
    # Not part of training: the first call compiles, or loads what was compiled.
    train_many([twin], task, patterns, 1, seed=0, threads=1)
    rng = np.random.default_rng(training_seed(setting["classes"], setting["pattern_seed"]))
    bins = task.background_bins + task.mean_pattern_bins
    stops = [round(milestone / bins) for milestone in MILESTONES]
    done, seconds = 0, 0.0
    for place, stop in enumerate([*stops, setting["trials"]]):
        if stop > setting["trials"]:
            continue
        start = time.perf_counter()
        train_many([agent], task, patterns, stop - done, rng, threads=1)
        seconds += time.perf_counter() - start
        done = stop
        log.score(place, agent, round(done * bins), seconds)
    return int(agent.n_parameters) if hasattr(agent, "n_parameters") else len(agent.weights)


def _rl_agent(setting: Setting, log: Log) -> int:
    """One of the recipes; scored between rollouts."""
    import torch

    from agents.rl import SB3Agent, make_rl_agent, training_env
    from agents.rl.callbacks import Milestones
    from agents.rl.recipes import RECIPES, n_parameters

    torch.set_num_threads(1)
    kind, task = setting["algorithm"], log.task
    matched = MATCHED[setting["classes"]]
    budget = setting.get("steps", setting.get("budget", min(matched, setting.get("most", matched))))
    env = training_env(task, log.patterns, kind, feedback=setting["feedback"])
    model = make_rl_agent(
        kind,
        env,
        # Environment i hears the stream of this seed + i.
        1_000 * setting["pattern_seed"],
        spike_probability=setting.get("spike_probability", 0.01),
    )
    agent = SB3Agent(model, task, RECIPES[kind].senses)

    def score(milestone: int, heard: int, seconds: float) -> None:
        log.score(MILESTONES.index(milestone), agent, heard, seconds)

    if budget:
        clock = Milestones([m for m in MILESTONES if m <= budget], score)
        model.learn(budget, callback=clock)
        log.score(FINAL, agent, model.num_timesteps, clock.seconds)
    else:
        log.score(FINAL, agent, 0, 0.0)
    return n_parameters(model)


class Silent:
    """Never spikes."""

    def predict(
        self, observation: Any, state: Any = None, episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[np.int64], None]:  # fmt: skip
        """0 everywhere."""
        return np.zeros(len(observation), np.int64), None


class RandomSpikes(Silent):
    """Spikes in one bin of a hundred, whatever it hears."""

    def __init__(self, seed: int) -> None:
        self._rng = np.random.default_rng(seed)

    def predict(
        self, observation: Any, state: Any = None, episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[np.int64], None]:  # fmt: skip
        """Independent coins."""
        return (self._rng.random(len(observation)) < 0.01).astype(np.int64), None


def _reference(setting: Setting, log: Log) -> int:
    """What needs no training: the ends of the scale."""
    name = setting["reference"]
    if name == "oracle":
        seeds = range(log.seed, log.seed + setting["runs"])
        told = [_oracle(log.task, log.patterns, seed, setting["cap"]) for seed in seeds]
        log.enter(FINAL, np.array(told), 0, 0.0)
    else:
        policy = Silent() if name == "silent" else RandomSpikes(setting["pattern_seed"])
        log.score(FINAL, policy, 0, 0.0)
    return 0


def _oracle(task: Task, patterns: Patterns, seed: int, cap: int) -> int:
    """Bins survived on the stream of `seed` by one who is told where each pattern lies."""
    env = PatternStreamEnv(task, patterns)
    env.reset(seed=seed)
    for survived, spike in enumerate(itertools.islice(_right_answers(task, patterns, seed), cap)):
        if env.step(spike)[2]:
            return survived
    return cap


def _right_answers(task: Task, patterns: Patterns, seed: int) -> Iterator[int]:
    """0 in noise; in an occurrence the spikes owed, one a bin from its first bin on."""
    rng, numbers, noise_left = np.random.default_rng(seed), task_arrays(task, patterns), -1.0
    channels, offsets = new_buffers()[:2]
    while True:
        channels, offsets, n_noise, class_, noise_left = append_piece(
            rng, numbers, noise_left, channels, offsets, 0
        )
        yield from itertools.repeat(0, n_noise)
        if class_ >= 0:
            owed = task.owed[class_]
            yield from [1] * owed + [0] * (task.pattern_bins - owed)
