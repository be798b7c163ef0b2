"""Random valid tasks, environments, wrappers, neurons, rules and widths, under bounds checks.

Each configuration follows from one number. Vector environments must give what single ones give,
agents side by side must become what each becomes alone, and a neuron's answers must be the same in
every loop; no access may leave its array.

Compiling a rule on a neuron takes far longer than a configuration. Hence those of one seed share
some pairs of a neuron and a rule, each rule being in one of them; another seed has other pairs.

    GNM_CHECKED=1 python tests/campaign/configurations.py --count 20 --pairs 2
    GNM_CHECKED=1 python tests/campaign/configurations.py --part environments --count 200
"""

from __future__ import annotations

import argparse
import copy
import json
import os
import subprocess
import sys
import traceback
from collections import Counter
from dataclasses import fields
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
STEPS = 60
TRIALS = 5
FIRST_OF_SEED = 1_000_000


def campaign(count: int, seed: int, pairs: int = 0, part: str = "agents") -> Counter[str]:
    """`count` configurations in a process of its own, with bounds checks; how many differ.

    `pairs`: of neurons and rules, 0 for all of the seed. `part` is one of PARTS.
    """
    counts: Counter[str] = Counter(tried=0, wrong=0)
    first = seed * FIRST_OF_SEED
    end = first + count
    while first < end:
        done = subprocess.run(
            [
                sys.executable,
                str(Path(__file__)),
                "--first",
                str(first),
                "--count",
                str(end - first),
                "--pairs",
                str(pairs),
                "--part",
                part,
            ],
            env={**os.environ, "GNM_CHECKED": "1", "PYTHONPATH": str(ROOT)},
            stdout=subprocess.PIPE,
            text=True,
        )
        lines = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
        for line in lines:
            counts["tried"] += 1
            if line["said"]:
                counts["wrong"] += 1
                print(f"configuration {line['number']}: {line['said']}")
        first += len(lines)
        if done.returncode and first < end:
            counts["tried"] += 1
            counts["wrong"] += 1
            print(f"configuration {first}: the process ended with {done.returncode}")
            first += 1
    return counts


# --- one configuration ----------------------------------------------------------------------------


def random_task(rng: Any) -> Any:
    """Small, and often at the edge of what a task may be."""
    from gnm_env import Task

    n_classes, n_inputs = int(rng.integers(1, 4)), int(rng.integers(1, 13))
    own_rates = tuple(rng.choice([0.0, 0.1, 0.7, 1.0], n_inputs).tolist())
    return Task(
        n_inputs=n_inputs,
        rates=own_rates if rng.random() < 0.15 else None,
        pattern_bins=int(rng.integers(1, 9)),
        rate=float(rng.choice([0.0, 0.02, 0.2, 0.5, 1.0])),
        n_classes=n_classes,
        targets=tuple(int(t) for t in rng.integers(0, 4, n_classes)),
        background_bins=int(rng.integers(1, 25)),
        mean_occurrences=float(rng.choice([0.0, 0.5, 2.0, 6.0])),
        onset_probability=float(rng.choice([0.0, 0.05, 0.5, 1.0])),
        jitter_bins=int(rng.choice([0, 0, 1, 20])),
        deletion=float(rng.choice([0.0, 0.0, 0.4, 1.0])),
    )


def compare_environments(rng: Any, task: Any, patterns: Any) -> None:
    """A vector environment beside as many single ones, on the same actions."""
    import gymnasium as gym
    import numpy as np
    from gymnasium.vector import AutoresetMode

    stream = bool(rng.random() < 0.4)
    name = f"gnm/Pattern{'Stream' if stream else 'Trial'}-v0"
    keywords: dict[str, Any] = {"task": task, "patterns": patterns}
    graded = not stream and rng.random() < 0.3
    if not stream:
        keywords["feedback"] = str(rng.choice(["cost", "sign", "dense"]))
        if graded:
            keywords |= {"output": "graded", "tolerance": float(rng.choice([0.0, 0.5]))}
    limit = None if rng.random() < 0.5 else int(rng.integers(1, 20))
    limits = {} if limit is None else {"max_episode_steps": limit}
    mode = AutoresetMode(rng.choice([m.value for m in AutoresetMode]))
    n, seed = int(rng.integers(1, 6)), int(rng.integers(0, 1000))
    envs: Any = gym.make_vec(
        name, num_envs=n, autoreset_mode=mode, copy=bool(rng.random() < 0.5), **keywords, **limits
    )
    singles = [gym.make(name, disable_env_checker=True, **keywords, **limits) for _ in range(n)]
    wrap, wrap_vector = _wrappers(rng, graded)
    envs, singles = wrap_vector(envs), [wrap(env) for env in singles]
    obs, _ = envs.reset(seed=seed)
    for k, env in enumerate(singles):
        _equal(obs[k], env.reset(seed=seed + k)[0], "first observation")
    ended = np.zeros(n, np.bool_)
    for step in range(STEPS):
        if mode == AutoresetMode.DISABLED and ended.any():
            obs, _ = envs.reset(options={"reset_mask": ended})
            for k in np.flatnonzero(ended):
                _equal(obs[k], singles[k].reset()[0], f"observation after reset, step {step}")
        actions: Any = rng.integers(0, 2, n)
        if graded:
            actions = rng.random((n, 1)) * 3
        obs, reward, terminated, truncated, info = envs.step(actions)
        for k, env in enumerate(singles):
            where = f"of {k}, step {step}"
            if mode == AutoresetMode.NEXT_STEP and ended[k]:
                _equal(obs[k], env.reset()[0], f"observation after reset {where}")
                _equal((reward[k], terminated[k], truncated[k]), (0.0, False, False), where)
                continue
            one = env.step(actions[k])
            _equal((reward[k], terminated[k], truncated[k]), one[1:4], f"outcome {where}")
            told, last = info, obs[k]
            if (one[2] or one[3]) and mode == AutoresetMode.SAME_STEP:
                told, last = info["final_info"], info["final_obs"][k]
                _equal(obs[k], env.reset()[0], f"observation after reset {where}")
            _equal(last, one[0], f"observation {where}")
            for key in set(one[4]) - {"TimeLimit.truncated"}:  # which Gymnasium adds to single ones
                _equal(told[key][k], one[4][key], f"{key} {where}")
        now = terminated | truncated
        ended = now & ~ended if mode == AutoresetMode.NEXT_STEP else now
    envs.close()


def _wrappers(rng: Any, graded: bool) -> tuple[Any, Any]:
    """One wrapper for single environments and its like for vectors."""
    from gnm_env import wrappers

    kind = rng.integers(0, 4)
    traces = {
        "decays": tuple(float(d) for d in rng.uniform(0.05, 1.0, int(rng.integers(1, 3)))),
        "scale": float(rng.uniform(0.2, 2.0)),
        "previous_action": bool(rng.random() < 0.5),
        "own_decay": None if rng.random() < 0.5 else float(rng.uniform(0.05, 1.0)),
        "rate": float(rng.uniform(0.05, 0.95)),
    }
    if kind == 0 or graded:
        return (lambda env: env), (lambda env: env)
    if kind == 1:
        return (
            lambda env: wrappers.SynapticTrace(env, **traces),
            lambda env: wrappers.VectorSynapticTrace(env, **traces),
        )
    if kind == 2:
        return wrappers.RisingEdge, wrappers.VectorRisingEdge
    return (
        lambda env: wrappers.SynapticTrace(wrappers.RisingEdge(env), **traces),
        lambda env: wrappers.VectorSynapticTrace(wrappers.VectorRisingEdge(env), **traces),
    )


def pairs_of(seed: int) -> list[tuple[str, Any, dict[str, Any]]]:
    """Every rule with some options, on one kind of neuron each; a network, a continuous neuron."""
    import numpy as np

    import agents
    from agents.learning.rule import Rule

    rng = np.random.default_rng((seed, 78))
    rules = [
        thing
        for _, thing in sorted(vars(agents).items())
        if isinstance(thing, type) and issubclass(thing, Rule)
    ]
    neurons = rng.permutation(sorted(NEURONS)).tolist()
    made: list[tuple[str, Any, dict[str, Any]]] = [
        (neurons[k % len(neurons)], rule, _option(rng, rule) if rng.random() < 0.5 else {})
        for k, rule in enumerate(rules)
    ]
    # This rule is for neurons that take no notice of their own spikes.
    made = [("gnm none V" if rule is agents.PolicyGradient else n, rule, o) for n, rule, o in made]
    made += [("network", None, {})]
    made += [("continuous", (agents.AggregateLabel, agents.ErrorTrace)[seed % 2], {})]
    rng.shuffle(made)  # type: ignore[arg-type]  # a list
    return made


def random_agent(rng: Any, n_inputs: int, pairs: list[tuple[str, Any, dict[str, Any]]]) -> Any:
    """A neuron, or now and then a network or a continuous neuron, with a rule."""
    import agents
    from agents.continuous import ContinuousAgent, ContinuousGNM
    from agents.network import BackPropagation, Network, NetworkAgent

    kind, rule_class, options = pairs[int(rng.integers(0, len(pairs)))]
    common = {"n_inputs": n_inputs, "seed": int(rng.integers(0, 99))}
    common["initial_weight"] = float(rng.choice([0.1, 0.5, 1.5]))
    if kind == "network":
        network = Network(hidden=int(rng.integers(1, 6)), h=float(rng.uniform(1, 6)))
        return NetworkAgent(
            network, BackPropagation(max_step=float(rng.choice([0.3, 5.0]))), **common
        )
    bounds = [(0.0, 1.0), None, (-0.5, 2.0), (0.0, float("inf"))]
    common["weight_bounds"] = bounds[int(rng.integers(0, 4))]
    keywords: dict[str, Any] = {
        "learning_rate": float(rng.choice([1e-4, 0.03, 0.5])),
        "momentum": float(rng.choice([0.0, 0.2, 0.9])),
        "fraction": float(rng.uniform(0.6 / n_inputs, 1.0)),  # one input at least
        **options,
    }
    known = {field.name for field in fields(rule_class)}
    rule = rule_class(**{name: value for name, value in keywords.items() if name in known})
    if kind == "continuous":
        neuron = ContinuousGNM(alpha=float(rng.uniform(0.05, 1)), eta=float(rng.choice([0.0, 0.5])))
        return ContinuousAgent(neuron, rule, **common)
    return agents.NeuronAgent(_neuron(rng, kind), rule, **common)


NEURONS = {
    f"gnm {recovery} {readout}": (h, readout)
    for recovery, h in (("none", 0.0), ("whole", 2.0), ("real", 7.3), ("infinite", float("inf")))
    for readout in "VD"
} | {"lif": None, "mst": None}
"""Kinds of neurons, each with code of its own; for a GNM its h, 0 where η = 0, and its readout."""


def _neuron(rng: Any, kind: str) -> Any:
    from agents import GNM, LIF, MST

    if kind == "lif":
        return LIF(
            float(rng.uniform(0, 1)), int(rng.choice([0, 1, 5, 25])), float(rng.choice([0.3, 1.0]))
        )
    if kind == "mst":
        return MST(
            float(rng.uniform(6, 30)), float(rng.uniform(0.5, 5)), float(rng.choice([0.3, 1.0]))
        )
    h, readout = NEURONS[kind]  # type: ignore[misc]  # the others are named above
    return GNM(
        alpha=float(rng.uniform(0, 1)), eta=float(rng.uniform(0.01, 1.0)) if h else 0.0,
        beta=float(rng.uniform(0, 1)), h=h or 200.0, readout=readout,
        theta_r=float(rng.choice([0.3, 1.0])),
    )  # fmt: skip


def _option(rng: Any, rule_class: Any) -> dict[str, Any]:
    """One of the rule's own options, if it has one that is a yes or no, or a fraction."""
    known = {
        "trace_decay": float(rng.choice([0.0, 0.3, 1.0])),
        "modulate": True, "amount": True, "first_only": True,
    }  # fmt: skip
    names = [field.name for field in fields(rule_class) if field.name in known]
    return {name: known[name] for name in names if rng.random() < 0.5}


def compare_training(rng: Any, task: Any, patterns: Any, pairs: Any) -> None:
    """Agents side by side, in the compiled loop, and each alone in the standard loop."""
    import gymnasium as gym
    import numpy as np

    from agents import train, train_many
    from gnm_env import Trial, Trials

    first = random_agent(rng, task.n_inputs, pairs)
    together = [copy.deepcopy(first) for _ in range(int(rng.integers(1, 11)))]
    for k, agent in enumerate(together):
        agent.weights = agent.weights * (0.5 + 0.1 * k)
    alone = copy.deepcopy(together[:2])
    seed = int(rng.integers(0, 1000))
    world: dict[str, Any] = {"task": task, "patterns": patterns}
    if getattr(first.rule, "binary", False) or rng.random() < 0.2:
        drawn = Trials.draw(task, patterns, 12, seed)
        few = drawn.labels <= (1 if getattr(first.rule, "binary", False) else 10**9)
        silent = Trial.from_dense(np.zeros((7, task.n_inputs)), label=0)
        world = {"trials": drawn[few] if few.any() else Trials([silent])}
    history = train_many(together, *world.values(), trials=TRIALS, seed=seed, threads=1)
    # Under "sign" only a rule that needs no more can learn.
    by_sign = first.rule.__class__.__name__ == "AggregateLabel"
    feedback = str(rng.choice(["cost", "sign"])) if by_sign else "cost"
    output = {"output": "graded"} if first.__class__.__name__ == "ContinuousAgent" else {}
    for k, agent in enumerate(alone):
        env = gym.make(
            "gnm/PatternTrial-v0", disable_env_checker=True, feedback=feedback, **world, **output
        )
        one = train(agent, env, TRIALS, seed)
        for name in ("weights", "momentum", "velocity"):
            if hasattr(agent, name):
                mine, theirs = getattr(agent, name), getattr(together[k], name)
                _equal(mine, theirs, f"{name} of {first!r} ({_what(first)}), agent {k}")
        _equal(one.error_rate, history.error_rate[:, k], f"error rate of {_what(first)}")
    assert np.isfinite(together[0].weights).all()


def compare_answers(rng: Any, task: Any, patterns: Any, pairs: Any) -> None:
    """Survival of an agent in the compiled loop and in the environment; spikes of its recording."""
    import gymnasium as gym
    import numpy as np

    from agents import noisy_performance, record
    from gnm_env import draw_trial

    agent = random_agent(rng, task.n_inputs, pairs)
    if agent.__class__.__name__ == "ContinuousAgent":
        return
    seed, cap = int(rng.integers(0, 1000)), 40
    survived = noisy_performance(agent, task, patterns, runs=3, cap=cap, seed=seed, threads=1)
    for run, expected in enumerate(survived):
        env: Any = gym.make(
            "gnm/PatternStream-v0", disable_env_checker=True, task=task, patterns=patterns,
            max_episode_steps=cap,
        )  # fmt: skip
        obs, _ = env.reset(seed=seed + run)
        total, ended, state = 0.0, False, None
        while not ended:
            action, state = agent.predict(obs, state)
            obs, reward, terminated, truncated, _ = env.step(action)
            total, ended = total + reward, terminated or truncated
        _equal(total, float(expected), f"survival of {_what(agent)}, run {run}")
    if agent.rule.__class__.__name__ == "PolicyGradient":
        return  # while it learns it draws its spikes; a recording shows the neuron's own
    trial = draw_trial(task, patterns, np.random.default_rng(seed))
    agent.begin_trial()
    spikes = [agent.act(row) for row in trial.dense().astype(np.int8)]
    _equal(np.array(spikes, np.bool_), record(agent, trial).spikes, f"spikes of {_what(agent)}")


def _what(agent: Any) -> str:
    return f"{getattr(agent, 'neuron', None) or agent.network}, {agent.rule}"


def _equal(one: Any, other: Any, what: str) -> None:
    import numpy as np

    if not np.array_equal(np.asarray(one), np.asarray(other), equal_nan=False):
        raise AssertionError(f"{what}: {one} != {other}")


PARTS = ("agents", "environments")


def check(number: int, pairs: int, part: str) -> str:
    """What is wrong with the configuration of this number; empty if nothing is."""
    import numpy as np

    from gnm_env import Patterns

    rng = np.random.default_rng((number, 77 + PARTS.index(part)))
    try:
        task = random_task(rng)
        patterns = Patterns.draw(task, number)
        compare_environments(rng, task, patterns)
        if part == "agents":
            chosen = pairs_of(number // FIRST_OF_SEED)
            chosen = chosen[: pairs or len(chosen)]
            compare_training(rng, task, patterns, chosen)
            compare_answers(rng, task, patterns, chosen)
    except Exception as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        return f"{type(error).__name__}: {error} [{Path(place.filename).name}:{place.lineno}]"
    return ""


def main() -> None:
    """Check configurations one by one, one line of JSON each."""
    import warnings

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=10)
    parser.add_argument("--pairs", type=int, default=0, help="of neurons and rules; 0: all")
    parser.add_argument("--part", choices=PARTS, default="agents")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    for number in range(options.first, options.first + options.count):
        print(
            json.dumps({"number": number, "said": check(number, options.pairs, options.part)}),
            flush=True,
        )


if __name__ == "__main__":
    sys.path[:0] = [str(ROOT), str(ROOT / "scripts")]
    main()
