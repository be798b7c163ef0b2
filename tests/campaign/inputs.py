"""Bad inputs to everything public: what a user may mistype, mix up or get out of a broken file.

Each case is a few lines of code that ought to be refused, run in the names of `namespace()`.
"""

from __future__ import annotations

import dataclasses
import typing
from typing import Any

from tests.campaign import tools
from tests.campaign.case import (
    ACTION,
    BOOL,
    OBJECT,
    OBSERVATION,
    RASTER,
    REAL,
    ROW,
    SEED,
    TEXT,
    WHOLE,
    Case,
)
from tests.campaign.case import fine as _fine
from tests.campaign.case import of as _of


def namespace() -> dict[str, Any]:
    """The names that the code of a case may use; small, so that compiled code is shared."""
    import pickle
    import warnings
    from pathlib import Path

    import gymnasium as gym
    import numpy as np

    import agents
    import gnm_env
    from agents.continuous import ContinuousAgent, ContinuousGNM
    from agents.learning.aggregate_label import AggregateLabel
    from agents.network import BackPropagation, Network, NetworkAgent
    from gnm_env import wrappers
    from tests.campaign.flips import seen_in_checkpoint

    task = gnm_env.Task(n_inputs=4, pattern_bins=3, rate=0.2, n_classes=2, background_bins=6)
    patterns = gnm_env.Patterns.draw(task, 1)
    names: dict[str, Any] = {**vars(agents), **vars(gnm_env), **vars(wrappers)}
    names |= {
        "np": np, "gym": gym, "nan": float("nan"), "inf": float("inf"), "Path": Path,
        "pickle": pickle, "warnings": warnings, "agents": agents, "gnm_env": gnm_env,
        "task": task, "patterns": patterns, "trial": gnm_env.draw_trial(
            task, patterns, np.random.default_rng(0)
        ),
        "ContinuousAgent": ContinuousAgent, "ContinuousGNM": ContinuousGNM, "Network": Network,
        "NetworkAgent": NetworkAgent, "BackPropagation": BackPropagation,
    }  # fmt: skip

    def trial_env(**keywords: Any) -> Any:
        return gym.make("gnm/PatternTrial-v0", task=task, patterns=patterns, **keywords)

    def stream_env(**keywords: Any) -> Any:
        return gym.make("gnm/PatternStream-v0", task=task, patterns=patterns, **keywords)

    def vector(kind: str = "Trial", n: int = 3, **keywords: Any) -> Any:
        return gym.make_vec(
            f"gnm/Pattern{kind}-v0", num_envs=n, task=task, patterns=patterns, **keywords
        )

    def agent(**keywords: Any) -> Any:
        return agents.NeuronAgent(agents.GNM(), AggregateLabel(fraction=0.25), 4, **keywords)

    def heard(one: Any = None, bins: int = 9) -> Any:
        """An agent that has just heard a trial of 9 bins."""
        one = agent() if one is None else one
        one.begin_trial()
        for _ in range(bins):
            one.act(np.ones(4, np.int8))
        return one

    def info(**changes: Any) -> dict[str, Any]:
        known = {
            "label": 1, "emitted": 0, "onsets": [2], "ends": [5], "classes": [0], "targets": [1],
            "pattern_bins": 3,
        }  # fmt: skip
        return {**known, **changes}

    def blaming(**keywords: Any) -> Any:
        """An agent whose rule looks at where the spikes were owed."""
        return agents.NeuronAgent(agents.GNM(), agents.ErrorTrace(), 4, **keywords)

    def continuous(**keywords: Any) -> Any:
        return ContinuousAgent(ContinuousGNM(), AggregateLabel(fraction=0.25), 4, **keywords)

    def network(**keywords: Any) -> Any:
        return NetworkAgent(Network(hidden=2), BackPropagation(), 4, **keywords)

    names |= {
        "trial_env": trial_env, "stream_env": stream_env, "vector": vector, "agent": agent,
        "heard": heard, "info": info, "continuous": continuous, "network": network,
        "command": command, "replace_entry": replace_entry, "blaming": blaming,
        "refuse_if": refuse_if, "seen_in_checkpoint": seen_in_checkpoint,
    }  # fmt: skip
    return names


def command(script: str, *arguments: str) -> None:
    """Run a command line. Raises `Refused` if it ends with 2 and one clear line, as it should."""
    import os
    import subprocess
    import sys
    from pathlib import Path

    root = Path(__file__).parents[2]
    found = os.pathsep.join((str(root), os.environ.get("PYTHONPATH", "")))
    program = ["-m", "agents.commands"] if script == "gnm" else [str(root / "scripts" / script)]
    done = subprocess.run(
        [sys.executable, *program, *arguments],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": found},
    )
    if "Traceback" in done.stderr:
        raise ForeignTraceback(done.stderr.strip().splitlines()[-1])
    if done.returncode < 0:
        os.kill(os.getpid(), -done.returncode)
    if done.returncode == 2:
        raise Refused(done.stderr.strip().splitlines()[-1])
    if done.returncode:
        raise ForeignTraceback(f"exit code {done.returncode}: {done.stderr[-200:]}")


def replace_entry(header: dict[str, Any], place: int, value: Any) -> None:
    """Put `value` where the entry number `place` of a nested header is."""
    entries: list[tuple[dict[str, Any], str]] = []
    waiting = [header]
    while waiting:
        current = waiting.pop(0)
        entries += [(current, name) for name in current]
        waiting += [inner for inner in current.values() if isinstance(inner, dict)]
    if place >= len(entries):
        raise Refused("the header has no more entries")
    inside, name = entries[place]
    inside[name] = value


def refuse_if(without_effect: bool) -> None:
    """Count what has no effect as refused."""
    if without_effect:
        raise Refused("without effect")


class Refused(Exception):
    """A command line ended with exit code 2 and a sentence."""


class ForeignTraceback(Exception):
    """A command line ended with a traceback, or with another exit code."""


def cases() -> list[Case]:
    """All bad inputs, some 4,400, in a fixed order."""
    made = [
        *_parameters(), *_task_and_patterns(), *_trials(), *_environments(), *_steps(),
        *_wrappers(), *_agents(), *_learning(), *_predict(), *_running(), *_files(), *_rl(),
        *_commands(), *tools.cases(),
    ]  # fmt: skip
    names = [case.name for case in made]
    assert len(set(names)) == len(names), [n for n in names if names.count(n) > 1]
    return made


# --- parameters -----------------------------------------------------------------------------------


def _values_for(annotation: Any) -> tuple[str, ...]:
    """Bad values for a field of that type."""
    parts = set(typing.get_args(annotation)) or {annotation}
    optional = type(None) in parts
    values: tuple[str, ...] = OBJECT
    if bool in parts:
        values = BOOL
    elif float in parts:
        values = REAL
    elif int in parts:
        values = WHOLE
    elif str in parts:
        values = TEXT
    return tuple(v for v in values if not (optional and v == "None"))


def _parameters() -> list[Case]:
    """Every field of every class of parameters that there is, those still to come included."""
    import agents
    from agents import continuous, network
    from agents.learning.rule import Rule
    from agents.neurons.neuron import Neuron

    classes: dict[str, type] = {}
    for home in (agents, continuous, network):
        for name, thing in vars(home).items():
            known = isinstance(thing, type) and issubclass(thing, Neuron | Rule)
            if known or name in ("Network", "BackPropagation"):
                classes[name] = thing
    made = []
    for name, cls in sorted(classes.items()):
        if not dataclasses.is_dataclass(cls) or not dataclasses.fields(cls):
            continue
        owner = cls.__module__.replace(".", "/") + ".py"
        # What these classes are called by is not in `namespace`: some are not exported by agents.
        hints = typing.get_type_hints(cls)
        for field in dataclasses.fields(cls):
            values = _values_for(hints[field.name])
            prefix = f"from {cls.__module__} import {name}\n"
            for value in values:
                text = f"{name}({field.name}={value})"
                made.append(Case(text, owner, prefix + text))
        made.append(
            Case(f"{name}(bogus=1)", owner, f"from {cls.__module__} import {name}\n{name}(bogus=1)")
        )
    extra = [
        "MST(tau_m=1e308, tau_s=1e-308)", "MST(tau_m=5.0, tau_s=5.0)", "MST(tau_m=inf)",
        "MST(tau_s=5e-324)", "GNM(theta_b=5e-324)", "GNM(alpha=1e-320).alpha = 3",
        "GNM(gamma=1e308, beta=1e-308)", "LIF(refractory=2**62)", "LIF(theta=inf)", "GNM(zeta=inf)",
        "GNM(0.3, 0, 0.3, 1, 1, 1, 1, 200, 'V', 5)",
    ]  # fmt: skip
    made += [Case(code, "agents/neurons", code) for code in extra]
    # The amplitudes of STDP and what ReSuMe adds may have either sign: that is another rule, which
    # weakens where this one strengthens.
    return _fine(
        made, "theta_b=5e-324", "gamma=1e308", "trace_decay=-1", "hidden=10**30", "momentum=True",
        "a_plus=-1.0", "a_minus=-1.0", "ReSuMe(a=-1.0)",
    )  # fmt: skip


# --- task, patterns, trials -----------------------------------------------------------------------


def _task_and_patterns() -> list[Case]:
    owner = "gnm_env/task.py"
    made: list[Case] = []
    for name in ("n_inputs", "pattern_bins", "n_classes", "background_bins"):
        made += _of(owner, f"Task({name}=«»)", [*WHOLE, "0", "2**62"])
    made += _of(owner, "Task(jitter_bins=«»)", [*WHOLE, "2**62"])
    for name in ("rate", "mean_occurrences", "onset_probability", "deletion"):
        made += _of(owner, f"Task({name}=«»)", [*REAL, "1e300", "inf"])
    made += _of(
        owner,
        "Task(targets=«»)",
        ["'1'", "(-1,)", "(2.5,)", "(2**62,)", "(nan,)", "(1, 2)", "()", "3", "{}", "object()",
         "(None,)", "('1',)", "(True,)", "[[1]]"],
    )  # fmt: skip
    made += _of(
        owner,
        "draw_trial(Task(n_classes=2, targets=«»), Patterns.draw(Task(n_classes=2), 0), np.random.default_rng(0))",
        ["(2**62, 2**62)", "(10**9, 10**10)"],
    )
    made += _of(owner, "Task(bogus=«»)", ["1"])
    made += _of(owner, "task.n_inputs = «»", ["7"])
    made += _of(owner, "object.__setattr__(Task(), 'rate', «»)", ["0.5"])
    made += _of(owner, "Patterns.draw(task, «»)", SEED)
    made += _of(owner, "Patterns.draw(«», 0)", ["None", "3", "'x'", "{}", "object()", "patterns"])
    made += _of(owner, "Patterns.draw(Task(n_inputs=«», pattern_bins=1000), 0)", ["10**7", "10**8"])
    made += _of(owner, "Patterns.from_dense(«»)", RASTER)
    made += _of(
        owner, "Patterns.from_dense(np.broadcast_to(np.int8(0), «»))", ["(10**6, 10**6, 100)"]
    )
    good = "channels=np.array([0, 3]), offsets=np.array([0, 1, 2, 2, 2, 2, 2]), shape=(2, 3, 4)"
    changes = {
        "channels": ["np.array([0, 9], np.int32)", "np.array([-1, 0], np.int32)", "np.zeros(1, np.int32)",
                     "np.zeros(9, np.int32)", "np.zeros((2, 1), np.int32)", "np.array([0.5, nan])",
                     "None", "'ab'", "[None, 1]", "np.array([2**40, 0])", "object()"],
        "offsets": ["np.array([0, 1, 2])", "np.array([0, 9, 9, 9, 9, 9, 9])",
                    "np.array([0, 2, 1, 2, 2, 2, 2])", "np.array([-5, 1, 2, 2, 2, 2, 2])",
                    "np.array([1, 1, 2, 2, 2, 2, 2])", "np.array([0, 2**62, 2, 2, 2, 2, 2])",
                    "np.zeros((7, 1), int)", "np.zeros(0, int)", "np.full(7, nan)", "None", "'x'"],
        "shape": ["(2, 3)", "(2, 3, 1)", "(9, 9, 9)", "(-2, -3, 4)", "(0, 3, 4)", "(2, 3, 2**62)",
                  "None", "'234'", "(2.0, 3.5, 4)", "3", "(1, 6, 10**9)"],
    }  # fmt: skip
    for name, values in changes.items():
        for value in values:
            code = f"made = Patterns(**{{**dict({good}), '{name}': {value}}})\nmade.dense()\nhash(made)"
            made.append(Case(f"Patterns({name}={value})", owner, code))
    made += _of(
        owner,
        "env = trial_env()\ngym.make('gnm/PatternTrial-v0', task=task, patterns=Patterns.draw(Task(n_inputs=«»), 0))",
        ["5"],
    )
    made += _of(owner, "patterns.channels[0] = «»", ["99"])
    made += _of(
        owner,
        "patterns.channels.setflags(write=True)\npatterns.channels[:] = «»\npatterns.dense()\ntrial_env().reset(seed=0)\ndraw_trial(task, patterns, np.random.default_rng(0)).dense()",
        ["10**6"],
    )
    made += _of(owner, "patterns.channels = «»", ["np.zeros(2, np.int32)"])
    made += _of(owner, "patterns.shape = «»", ["(9, 9, 9)"])
    return _fine(made, "object.__setattr__", "(1, 6, 10**9)", "'jitter_bins", "rate=True")


def _trials() -> list[Case]:
    owner = "gnm_env/trial.py"
    made: list[Case] = []
    made += _of(
        owner, "draw_trial(«», patterns, np.random.default_rng(0))", ["None", "3", "Task()", "'x'"]
    )
    made += _of(
        owner,
        "draw_trial(task, «», np.random.default_rng(0))",
        ["None", "3", "np.zeros((2, 3, 4))"],
    )
    made += _of(
        owner, "draw_trial(task, patterns, «»)",
        ["None", "3", "np.random", "'x'", "np.random.RandomState(0)", "np.random.PCG64()"],
    )  # fmt: skip
    raster = "np.zeros((9, 4), np.int8)"
    made += _of(owner, "Trial.from_dense(«», [0], [0], task)", RASTER)
    made += _of(owner, f"Trial.from_dense({raster}, «», [0], task)", [*ROW, "[7]", "[0, 1]"])
    made += _of(owner, f"Trial.from_dense({raster}, [0], «», task)", [*ROW, "[5]", "[0, 1]"])
    made += _of(owner, f"Trial.from_dense({raster}, [0], [0], «»)", ["3", "'x'", "{}", "Task()"])
    made += _of(
        owner,
        f"Trial.from_dense({raster}, label=«»)",
        [v for v in WHOLE if v != "None"] + ["2**62"],
    )
    made += _of(
        owner, f"Trial.from_dense({raster}, [0], targets=[1], ends=«»)", [*ROW, "[0]", "[99]"]
    )
    made += _of(
        owner,
        f"Trial.from_dense({raster}, [0], targets=[1], lengths=«»)",
        [*ROW, "[0]", "[99]", "0"],
    )
    made += _of(owner, f"Trial.from_dense({raster}, [0], targets=«», lengths=2)", ROW)
    made += _of(
        owner,
        f"Trial.from_dense({raster}«»)",
        ["", ", label=1, onsets=[0]", ", [0, 2], [0, 0], task"],
    )
    times = "[[0.5], [], [3.2], []]"
    made += _of(
        owner, "Trial.from_times(«», 9, [0], [0], task)",
        ["None", "3", "'abcd'", "[[0.5]]", "[[nan], [], [], []]", "[[inf], [], [], []]",
         "[[-1], [], [], []]", "[[9.0], [], [], []]", "[['a'], [], [], []]", "[[1j], [], [], []]",
         "[[[1]], [], [], []]", "[None] * 4", "{}", "object()", "np.zeros((4, 2, 2))", "[1, 2, 3, 4]"],
    )  # fmt: skip
    made += _of(owner, f"Trial.from_times({times}, «», [0], [0], task)", [*WHOLE, "0", "2**62"])
    made += _of(
        owner,
        f"Trial.from_times({times}, 9, [0], [0], task, bin_width=«»)",
        [*REAL, "0.0", "inf", "5e-324"],
    )
    made += _of(owner, "Trial.from_times([[0.001], [0.002], [0.5], []], 9, [0], [0], task«»)", [""])
    base = (
        "channels=np.zeros(2, np.int32), offsets=np.array([0, 1, 2, 2, 2, 2]), onsets=[1], "
        "classes=[0], targets=[1], n_inputs=4, pattern_bins=3"
    )
    changes = {
        "channels": ["[9, 0]", "[-1, 0]", "[0]", "[0] * 9", "[[0], [1]]", "[0.5, nan]", "None", "'ab'",
                     "[2**40, 0]", "object()"],
        "offsets": ["[0, 2]", "[0, 9, 9, 9, 9, 9]", "[0, 2, 1, 2, 2, 2]", "[-9, 1, 2, 2, 2, 2]",
                    "[0, 2**62, 2, 2, 2, 2]", "[]", "[0]", "None", "[[0]]", "np.full(6, nan)", "'x'"],
        "onsets": ["[-1]", "[3]", "[99]", "[2**62]", "[1, 1]", "[0.5]", "None", "[nan]", "'1'", "[[1]]"],
        "classes": ["[-1]", "[2**62]", "[0, 1]", "[0.5]", "'a'", "[]"],
        "targets": ["[-1]", "[2**62]", "[1, 2]", "[0.5]", "None", "[]", "[nan]"],
        "n_inputs": ["0", "-1", "2**62", "None", "2.5", "'4'", "1e9"],
        "pattern_bins": ["0", "-3", "2**62", "99", "2.5", "'3'"],
    }  # fmt: skip
    for name, values in changes.items():
        for value in values:
            code = (
                f"made = Trial(**{{**dict({base}), '{name}': {value}}})\nmade.dense()\nmade.owner()\n"
                "trial_env().reset(options={'trial': made})\nrecord(agent(), made)"
            )
            made.append(Case(f"Trial({name}={value})", owner, code))
    made += _of(owner, "trial.channels[0] = «»", ["99"])
    made += _of(
        owner, "trial.offsets.setflags(write=True)\ntrial.offsets[1] = «»\ntrial.dense()", ["2**40"]
    )
    made += _of(owner, "trial.channels = «»", ["np.zeros(2, np.int32)"])
    trials = "gnm_env/trials.py"
    made += _of(trials, "Trials(«»)", ["None", "[]", "3", "'x'", "[3]", "[trial, None]", "{}", "trial",
        "[trial, Trial.from_dense(np.zeros((3, 5)), label=1)]", "[trial, 'x']"])  # fmt: skip
    made += _of(
        trials,
        "Trials([trial])[«»]",
        ["5", "-2", "'a'", "None", "1.5", "2**70", "[7]", "object()", "[True, True]", "(0, 1)"],
    )
    made += _of(
        trials,
        "Trials([trial]).delayed(«»)",
        ["None", "[]", "[-1]", "['a']", "[2**62]", "[0.5]", "3", "[nan]", "[[1]]", "object()"],
    )
    made += _of(
        trials,
        "Trials([trial]).save(«»)",
        ["None", "'missing/folder/x'", "'.'", "3", "'x' * 300", "'zero\\0'"],
    )
    made += _of(
        trials,
        "Path('f').write_bytes(«»)\nTrials.load('f')",
        [
            "b''",
            "b'text'",
            "b'PK\\3\\4'",
            "b'\\x93NUMPY\\1\\0'",
            "pickle.dumps(3)",
            "bytes(range(256))",
        ],
    )
    made += _of(
        trials, "Trials.load(«»)", ["None", "'missing'", "'.'", "3", "'/dev/null'", "'x' * 300"]
    )
    made += _of(trials, "Trials([trial], n_classes=«»)", ["-1", "'2'", "0.5", "2**62", "[1]"])
    made += _of(
        trials,
        "Trials([trial], columns=«»)",
        [
            "3",
            "{'a': 3}",
            "{'a': [1, 2]}",
            "{'a': [object()]}",
            "[1]",
            "'x'",
            "{'a': [nan]}",
            "{3: [1]}",
        ],
    )
    made += _of(
        trials,
        "Trials([trial], metadata=«»)",
        ["3", "[1]", "{'a': object()}", "{'a': {1, 2}}", "'x'"],
    )
    made += _of(trials, "Trials.draw(task, patterns, «», 0)", [*WHOLE, "0", "2**62", "10**12"])
    made += _of(trials, "Trials.draw(task, patterns, 2, «»)", [*SEED, "None"])
    return _fine(made, "classes=[2**62]", "{3: [1]}", "{'a': [nan]}", "[trial, 'x']['x']", "[True]")


# --- environments ---------------------------------------------------------------------------------


def _environments() -> list[Case]:
    made: list[Case] = []
    for kind, owner in (("Trial", "gnm_env/trial_task"), ("Stream", "gnm_env/stream_task")):
        make = f"gym.make('gnm/Pattern{kind}-v0', «»)"
        keywords = [
            "task=None, rate=2", "task=3", "task='x'", "task={}", "task=task, n_inputs=4", "n_inputs='4'",
            "patterns=3", "patterns=np.zeros((2, 3, 4))", "patterns=patterns", "patterns='x'",
            "task=task, patterns=Patterns.draw(Task(), 0)", "pattern_seed='x'", "pattern_seed=-1",
            "pattern_seed=2.5", "pattern_seed=None", "task=task, patterns=patterns, pattern_seed='x'",
            "render_mode='bogus'", "bogus=1", "n_classes=None",
            "targets=(2**62,)", "jitter_bins=2**62", "rate=nan", "n_inputs=10**9, pattern_bins=10**6",
            "max_episode_steps='x'",
        ]  # fmt: skip
        if kind == "Trial":
            keywords += [
                "feedback='bogus'", "feedback=None", "feedback=3", "feedback=['cost']", "output='bogus'",
                "output=None", "output=3", "tolerance=0.5", "tolerance='x', output='graded'",
                "tolerance=-1, output='graded'", "tolerance=nan, output='graded'",
                "max_output=0, output='graded'", "max_output=nan, output='graded'", "max_output='x', output='graded'",
                "max_output=-1, output='graded'", "max_output=inf, output='graded'",
                "trials=3", "trials=[]", "trials=[trial]", "trials=None, task=task, patterns=patterns, bogus=2",
                "trials=Trials([trial]), task=task", "trials=Trials([trial]), n_classes=2",
                "trials=Trials([trial]), patterns=patterns",
                "trials=Trials([Trial.from_dense(np.zeros((3, 4)), label=1)]), feedback='dense'",
            ]  # fmt: skip
        made += _of(owner, make, keywords)
        vec = f"gym.make_vec('gnm/Pattern{kind}-v0', task=task, patterns=patterns, «»)"
        made += _of(
            owner, vec,
            [*(f"num_envs={v}" for v in (*WHOLE, "0", "2**62", "10**7")),
             *(f"num_envs=2, copy={v}" for v in BOOL),
             *(f"num_envs=2, autoreset_mode={v}" for v in (*TEXT, "None")),
             *(f"num_envs=2, max_episode_steps={v}" for v in ("'x'", "0", "-1", "2.5", "2**62", "nan", "True")),
             "num_envs=2, bogus=1" ],
        )  # fmt: skip
        for single in (True, False):
            env = f"{kind.lower()}_env()" if single else f"vector('{kind}')"
            made += _of(
                owner,
                f"{env}.reset(seed=«»)",
                [
                    *SEED,
                    *(
                        ()
                        if single
                        else (
                            "[1]",
                            "[1, 2, 'x']",
                            "[1, 2, -1]",
                            "[None, 1.5, 2]",
                            "np.zeros((3, 1))",
                        )
                    ),
                ],
            )
            made += _of(
                owner, f"env = {env}\nenv.reset(seed=0)\nenv.reset(options=«»)",
                ["3", "'x'", "[1]", "{'trial': 3}", "{'trial': None}", "{'trial': 'x'}", "{'bogus': 1}",
                 "{'trial': Trial.from_dense(np.zeros((3, 5)), label=1)}", "object()",
                 *(() if single else ("{'reset_mask': 3}", "{'reset_mask': [True]}", "{'reset_mask': 'x'}",
                                      "{'reset_mask': np.zeros(3)}", "{'reset_mask': np.zeros(2, bool)}",
                                      "{'reset_mask': np.zeros(3, bool)}", "{'reset_mask': None}"))],
            )  # fmt: skip
        made += _of(owner, f"env = {kind.lower()}_env().unwrapped\nenv.step(«»)", ["0"])
        made += _of(owner, f"env = vector('{kind}')\nenv.step(«»)", ["np.zeros(3, int)"])
        made += _of(
            owner,
            f"env = {kind.lower()}_env().unwrapped\nenv.reset(seed=0)\nenv.np_random = «»\nenv.reset()",
            ["None", "3", "'x'", "np.random.RandomState(0)"],
        )
        made += _of(
            owner,
            f"env = {kind.lower()}_env().unwrapped\nenv.reset(seed=0)\nenv.task = «»\nenv.reset()\nenv.step(0)",
            ["None", "Task(n_inputs=9)"],
        )
        made += _of(
            owner,
            f"env = {kind.lower()}_env().unwrapped\nenv.reset(seed=0)\nenv.patterns = «»\nenv.reset()\nenv.step(0)",
            ["None", "Patterns.draw(Task(), 0)"],
        )
        made += _of(
            owner,
            f"env = {kind.lower()}_env(render_mode='rgb_array').unwrapped\n«»env.render()",
            [""],
        )
        made += _of(
            owner,
            f"env = {kind.lower()}_env(render_mode='rgb_array').unwrapped\nenv.reset(seed=0)\nenv.potential = «»\nenv.step(0)\nenv.render()",
            ["'x'", "nan", "None", "inf", "1e308", "[1]", "object()"],
        )
    direct = "PatternTrialEnv"
    made += _of(
        "gnm_env/trial_task",
        f"{direct}(«»)",
        [
            "3",
            "task, 3",
            "task, patterns, 'bogus'",
            "task, patterns, 'cost', 1, 2, 3, 4, 5, 6, 7, 8",
            "None, patterns",
        ],
    )
    made += _of(
        "gnm_env/stream_task",
        "PatternStreamEnv(«»)",
        ["3", "task, 3", "None, patterns", "task, patterns, 0, 'human', 5"],
    )
    return _fine(
        made, "seed=True", "pattern_seed=None", "options={'bogus': 1}", "num_envs=10**7", "num_envs=True",
        "env.task = ", "env.patterns = ", "env.potential =", "seed=[1, 2]", "np.random.RandomState", "'trial': None", "{'reset_mask': None}",
        "np_random = None", "«»env.render", "\nenv.render()", "[None, 1.5", "max_episode_steps=None",
    )  # fmt: skip


def _steps() -> list[Case]:
    made: list[Case] = []
    for kind, owner in (("trial", "gnm_env/trial_task"), ("stream", "gnm_env/stream_task")):
        for wrapped in ("", ".unwrapped"):
            made += _of(
                owner, f"env = {kind}_env(){wrapped}\nenv.reset(seed=0)\nenv.step(«»)", ACTION
            )
        made += _of(
            owner, f"env = vector('{kind.title()}')\nenv.reset(seed=0)\nenv.step(«»)",
            ["[0, 1]", "[0, 1, 2]", "[0, 1, -1]", "[0, 1, 256]", "[0, 1, 0.5]", "[0, 1, nan]", "None",
             "'010'", "{}", "object()", "0", "[[0, 1, 0]]", "[0, 1, None]", "np.zeros(3, complex)",
             "np.zeros(3, object)", "[0, 1, 2**40]", "['0', '1', '0']", "[]", "np.zeros((3, 2), int)"],
        )  # fmt: skip
    graded = "env = trial_env(output='graded')\nenv.reset(seed=0)\nenv.step(«»)"
    made += _of(
        "gnm_env/trial_task",
        graded,
        [
            "nan",
            "[nan]",
            "[-1.0]",
            "[1e300]",
            "['a']",
            "None",
            "[0, 1]",
            "'1'",
            "object()",
            "[1j]",
            "[inf]",
            "{}",
            "[None]",
        ],
    )
    graded = "env = vector(output='graded')\nenv.reset(seed=0)\nenv.step(«»)"
    made += _of(
        "gnm_env/trial_task",
        graded,
        [
            "np.full((3, 1), nan)",
            "np.full((3, 1), -1)",
            "np.zeros(2)",
            "None",
            "[['a']] * 3",
            "np.full((3, 1), 1e300)",
            "np.zeros((3, 1), complex)",
            "'x'",
        ],
    )
    ended = "env = trial_env().unwrapped\nenv.reset(seed=0)\nwhile not env.step(0)[2]: pass\nenv.step(«»)"
    made += _of("gnm_env/trial_task", ended, ["0"])
    ended = "env = stream_env().unwrapped\nenv.reset(seed=0)\nwhile not env.step(1)[2]: pass\nenv.step(«»)"
    made += _of("gnm_env/stream_task", ended, ["0"])
    threads = (
        "import threading\nenv = vector('«»', 50)\nenv.reset(seed=0)\nerrors = []\n"
        "def go():\n    for _ in range(3000):\n"
        "        try: env.step(np.zeros(50, np.int64))\n        except ValueError as e: errors.append(e)\n"
        "pool = [threading.Thread(target=go) for _ in range(4)]\n"
        "[t.start() for t in pool]\n[t.join() for t in pool]\nif errors: raise errors[0]"
    )
    made += [
        Case(
            f"four threads step one {k} vector", "gnm_env/base", threads.replace("«»", k), fine=True
        )
        for k in ("Trial", "Stream")
    ]
    for text in ("pickle.loads(pickle.dumps(env))", "__import__('copy').deepcopy(env)"):
        for kind in ("Trial", "Stream"):
            code = f"env = vector('{kind}')\nenv.reset(seed=0)\nother = {text}\nother.step(np.zeros(3, int))"
            made.append(Case(f"{text} of {kind}", "gnm_env/base", code, fine=True))
    return _fine(
        made,
        "env.step(nope)",
        "env.step(np.zeros(3, object))",
    )


def _wrappers() -> list[Case]:
    owner = "gnm_env/wrappers.py"
    made: list[Case] = []
    for cls, env in (("SynapticTrace", "trial_env()"), ("VectorSynapticTrace", "vector()")):
        made += _of(
            owner,
            f"{cls}({env}, decays=«»)",
            [
                "'0.3'",
                "True",
                "()",
                "(0.0,)",
                "(1.5,)",
                "nan",
                "('a',)",
                "None",
                "{}",
                "(-0.3,)",
                "object()",
                "[[0.3]]",
                "1j",
                "[inf]",
            ],
        )
        made += _of(owner, f"{cls}({env}, scale=«»)", [*REAL, "0.0", "1e300", "inf", "5e-324"])
        made += _of(owner, f"{cls}({env}, previous_action=«»)", BOOL)
        made += _of(
            owner, f"{cls}({env}, own_decay=«»)", [*(v for v in REAL if v != "None"), "0.0", "1.5"]
        )
        made += _of(owner, f"{cls}({env}, rate=«»)", [*(v for v in REAL if v != "None"), "1.5"])
        made += _of(
            owner,
            f"{cls}(«»)",
            [
                "None",
                "3",
                "vector()" if cls == "SynapticTrace" else "trial_env()",
                "gym.make('CartPole-v1')",
            ],
        )
    for cls, env in (("RisingEdge", "trial_env"), ("VectorRisingEdge", "vector")):
        made += _of(owner, f"{cls}(«»)", ["None", "3", f"{env}(output='graded')"])
    made += _of(owner, "env = RisingEdge(trial_env())\nenv.reset(seed=0)\nenv.step(«»)", ACTION)
    made += _of(
        owner,
        "env = SynapticTrace(trial_env(), previous_action=True)\nenv.reset(seed=0)\nenv.step(«»)",
        ACTION,
    )
    made += _of(
        owner,
        "env = VectorRisingEdge(vector())\nenv.reset(seed=0)\nenv.step(«»)",
        ["[0, 1]", "[0, 1, 2]", "None", "'010'", "[0, 1, 0.5]", "object()", "[[0, 1, 0]]"],
    )
    made += _of(owner, "SeededEpisodes(trial_env(), «»)", [*SEED, "None"])
    made += _of(owner, "env = «»(trial_env())\nenv.step(0)", ["SynapticTrace", "RisingEdge"])
    return _fine(
        made,
        "decays=[[0.3]]",
    )


# --- agents ---------------------------------------------------------------------------------------

_KINDS = (
    ("agent()", "agents/neuron_agent.py"),
    ("continuous()", "agents/continuous/agent.py"),
    ("network()", "agents/network/network_agent.py"),
)


def _agents() -> list[Case]:
    made: list[Case] = []
    owner = "agents/neuron_agent.py"
    rule = "AggregateLabel(fraction=0.25)"
    made += _of(
        owner,
        f"NeuronAgent(«», {rule}, 4)",
        ["None", "3", "'gnm'", "GNM", "{}", rule, "ContinuousGNM()", "Network()"],
    )
    made += _of(
        owner,
        "NeuronAgent(GNM(), «», 4)",
        ["None", "3", "'all'", "AggregateLabel", "{}", "GNM()", "BackPropagation()"],
    )
    for make, own in (
        (f"NeuronAgent(GNM(), {rule}, ", owner),
        (f"ContinuousAgent(ContinuousGNM(), {rule}, ", "agents/continuous/agent.py"),
        ("NetworkAgent(Network(hidden=2), BackPropagation(), ", "agents/network/network_agent.py"),
    ):
        made += _of(own, make + "«»)", [*WHOLE, "0", "2**62", "10**10"])
        made += _of(own, make + "4, seed=«»)", [*SEED, "None"])
        made += _of(
            own,
            make + "4, initial_weight=«»)",
            ["'0.3'", "nan", "inf", "True", "[0.3]", "{}", "1j", "object()", "1e308", "10**400"],
        )
        if "Network" not in make:
            made += _of(
                own,
                make + "4, weight_bounds=«»)",
                [
                    "3",
                    "(0,)",
                    "(1, 0)",
                    "(0, 0)",
                    "('a', 'b')",
                    "(nan, 1)",
                    "(0, nan)",
                    "'01'",
                    "(0, 1, 2)",
                    "{}",
                    "object()",
                    "(0, 1j)",
                    "(None, 1)",
                    "(inf, inf)",
                ],
            )
    made += _of(
        "agents/network/network_agent.py",
        "NetworkAgent(«», BackPropagation(), 4)",
        ["3", "'x'", "GNM()", "{}"],
    )
    made += _of(
        "agents/network/network_agent.py",
        "NetworkAgent(Network(hidden=2), «», 4)",
        ["3", "'x'", rule, "{}"],
    )
    for one, own in _KINDS:
        use = "\na.begin_trial()\na.act(np.ones(4, np.int8))\na.learn(-1.0, info(onsets=[], ends=[], targets=[], classes=[]))"
        made += _of(own, f"a = {one}\na.n_inputs = «»{use}", ["7", "1", "None", "'x'", "2**40"])
        made += _of(
            own,
            f"a = {one}\na.velocity = «»{use}",
            [
                "np.zeros(1)",
                "np.zeros(9)",
                "None",
                "'x'",
                "np.zeros(4, np.int8)",
                "np.full(4, nan)",
                "np.zeros((4, 1))",
                "np.zeros(4, complex)",
                "np.zeros(0)",
            ],
        )
        made += _of(
            own,
            f"a = {one}\na.weights = «»{use}",
            [
                "np.zeros(1)",
                "np.zeros(99)",
                "None",
                "'x'",
                "np.full(4, nan)",
                "nan",
                "np.zeros(4) + 1j",
                "{}",
                "inf",
                "[[0.1] * 4]",
                "object()",
                "['a'] * 4",
            ],
        )
        made += _of(own, f"a = {one}\na.weights[0] = «»{use}", ["nan", "inf"])
        made += _of(own, f"a = {one}\na.velocity[0] = «»{use}", ["nan", "inf"])
        made += _of(
            own, f"a = {one}\na.neuron = «»{use}", ["LIF()", "MST()", "None", "3", "GNM(alpha=0.9)"]
        )
        made += _of(own, f"a = {one}\na.rule = «»{use}", ["None", "ErrorTrace()", "3"])
        made += _of(own, f"a = {one}\na.weight_bounds = «»{use}", ["(1, 0)", "'x'", "3"])
        made += _of(own, f"a = {one}\na.begin_trial()\na.act(«»)", OBSERVATION)
        made += _of(
            own,
            f"record({one}, «»)",
            [
                "None",
                "3",
                "'x'",
                "np.zeros((5, 4))",
                "Trial.from_dense(np.zeros((3, 5)), label=1)",
                "{}",
            ],
        )
        made += _of(own, f"{one}.replaced(«»)", ["bogus=1", "alpha=-7", "alpha='x'"])
    made += _of("agents/recording.py", "record(«», trial)", ["None", "3", "GNM()", "'x'"])
    return _fine(
        made, "a.neuron = ", "a.rule = ", "initial_weight=1e308", "a.weight_bounds", "seed=True",
        "np.zeros(4, object)", "np.zeros(4, np.int8)", "a.n_inputs = 4",
    )  # fmt: skip


def _learning() -> list[Case]:
    made: list[Case] = []
    rules = ((_KINDS[0][0], _KINDS[0][1]), ("blaming()", _KINDS[0][1]), _KINDS[2])
    for one, own in rules:
        make = f"a = heard({one})\n"
        made += _of(
            own,
            make + "a.learn(«», info())",
            ["nan", "'x'", "None", "inf", "1j", "[1]", "object()"],
        )
        made += _of(
            own, make + "a.learn(«», {}, True)", ["nan", "'x'", "None", "[1, 2]", "1j", "object()"]
        )
        made += _of(
            own,
            make + "a.learn(-1.0, «»)",
            ["None", "3", "{}", "'x'", "[]", "{'label': 1}", "object()"],
        )
        for change in (
            "label=1.7", "label=nan", "label='1'", "label=None", "label=-1", "label=2**62", "label=[1]",
            "onsets=[50]", "onsets=[-1]", "onsets=[7]", "onsets=[2**62]", "onsets=[2, 2]", "onsets=None",
            "onsets='x'", "onsets=[0.5]", "onsets=[[2]]", "onsets=[5, 2], ends=[8, 5], targets=[1, 1], classes=[0, 0], label=2",
            "onsets=[nan]", "onsets=3", "targets=[]", "targets=[1, 1, 1]", "targets=[-1]", "targets=[2**62]",
            "targets=[0.5]", "targets=None", "targets=['a']", "targets=[nan]", "pattern_bins=99",
            "pattern_bins=-1", "pattern_bins=0", "pattern_bins=None", "pattern_bins='x'", "pattern_bins=2.5",
            "pattern_bins=2**62", "ends=[99]", "ends=[1]", "ends=[]", "ends=None", "ends=['a']", "ends=[2**62]",
            "label=5", "onsets=list(range(1000)), ends=list(range(1, 1001)), targets=[1] * 1000, classes=[0] * 1000, label=1000",
        ):  # fmt: skip
            made += _of(own, make + "a.learn(-1.0, info(«»))", [change])
        made += _of(own, f"a = {one}\na.begin_trial()\na.learn(-1.0, «»)", ["info()"])
        made += _of(own, f"a = {one}\na.act(«»)\na.learn(-1.0, info())", ["np.ones(4, np.int8)"])
        made += _of(own, make + "for _ in range(3): a.learn(«», info())", ["-1.0"])
    # A rule that only asks how much was owed needs no more than the label, which may be any.
    alone = ("learn(-1.0, {'label': 1})", "learn(-1.0, info(label=-1))")
    made = [
        dataclasses.replace(
            c,
            fine="heard(agent())" in c.code
            and (c.code.endswith(alone) or ("info(" in c.code and "label=" not in c.code)),
        )
        for c in made
    ]
    return _fine(made, "label=5", "pattern_bins=", "for _ in range(3)", "ends=None", "reward")


def _predict() -> list[Case]:
    made: list[Case] = []
    for one, own in _KINDS:
        made += _of(own, f"{one}.predict(«»)", [v for v in OBSERVATION if v != "np.zeros((1, 4))"])
        made += _of(
            own, f"{one}.predict(np.zeros((2, 4), np.int8), state=«»)",
            ["3", "'x'", "(np.zeros(1),)", "(np.zeros((9, 9)),)", "()", "(None,)", "(np.full((2, 2, 1), nan),)",
             "(np.zeros((2, 2, 1), np.float32),)", "(np.zeros((2, 2, 1), complex),)", "({},)", "('a',)",
             "(np.zeros((1, 2, 1)),)", "object()", "(np.zeros((2, 2, 1), np.int64),)", "{}", "[]"],
        )  # fmt: skip
        made += _of(
            own, f"{one}.predict(np.zeros((2, 4), np.int8), None, «»)",
            ["[True]", "[True] * 3", "'x'", "3", "[[True], [False]]", "object()", "{}", "[nan, 1]", "[0.5, 1]"],
        )  # fmt: skip
    return _fine(
        made,
        "np.zeros((2, 2, 1), np.float32)",
        "np.zeros((2, 2, 1), np.int64)",
        "np.zeros(4, object)",
        "state=[])",
    )


# --- training and scores --------------------------------------------------------------------------


def _running() -> list[Case]:
    made: list[Case] = []
    own = "agents/loop.py"
    made += _of(
        own,
        "train(«», trial_env(), 2, seed=1)",
        ["None", "3", "'x'", "GNM()", "object()", "[agent()]", "continuous()"],
    )
    made += _of(
        own,
        "train(agent(), «», 2, seed=1)",
        [
            "None",
            "3",
            "'x'",
            "vector()",
            "stream_env()",
            "gym.make('CartPole-v1')",
            "trial_env(output='graded')",
            "object()",
            "trial_env(max_episode_steps=3)",
            "gym.make('gnm/PatternTrial-v0')",
        ],
    )
    made += _of(own, "train(agent(), trial_env(), «», seed=1)", WHOLE)
    made += _of(own, "train(agent(), trial_env(), 2, seed=«»)", SEED)
    made += _of(own, "train(agent(), trial_env(), 2, seed=1, block=«»)", [*WHOLE, "0"])
    made += _of(
        own, "train(agent(), trial_env(), 2, seed=1, block=1, callback=«»)", ["3", "'x'", "[]"]
    )
    made += _of(own, "train(agent(), SynapticTrace(trial_env()), 2, seed=«»)", ["1"])
    made += _of(
        own,
        "train(agent(), gym.wrappers.«», 2, seed=1)",
        [
            "MaxAndSkipObservation(trial_env(), 4)",
            "FrameStackObservation(trial_env(), 2)",
            "TimeLimit(trial_env(), 2)",
            "TransformReward(trial_env(feedback='sign'), lambda r: r * np.nan)",
        ],
    )
    own = "agents/many.py"
    many = "train_many([agent()], task, patterns, trials=2, seed=1)"
    made += _of(
        own,
        many.replace("[agent()]", "«»"),
        [
            "None",
            "[]",
            "3",
            "'x'",
            "[None]",
            "[3]",
            "{}",
            "agent()",
            "[agent(), None]",
            "[GNM()]",
            "[agent(), NeuronAgent(GNM(), ErrorTrace(), 5)]",
            "object()",
        ],
    )
    made += _of(own, f"a = agent()\n{many.replace('[agent()]', '«»')}", ["[a, a]"])
    made += _of(
        own,
        f"a = agent()\na.«»\n{many.replace('[agent()]', '[a, agent()]')}",
        [
            "velocity = np.zeros(1)",
            "velocity = np.zeros(99)",
            "n_inputs = 2",
            "n_inputs = 900",
            "velocity = None",
            "neuron = LIF(refractory=3)",
            "rule = ErrorTrace()",
            "weights[:] = nan",
        ],
    )
    made += _of(
        own,
        many.replace("task, patterns", "«»"),
        [
            "None, patterns",
            "task, None",
            "Task(), patterns",
            "3, patterns",
            "task, 3",
            "task",
            "patterns, task",
            "Task(), Patterns.draw(Task(), 0)",
            "Trials([trial]), patterns",
            "Trials([Trial.from_dense(np.zeros((3, 5)), label=1)])",
        ],
    )
    made += _of(own, many.replace("trials=2", "trials=«»"), WHOLE)
    made += _of(own, many.replace("seed=1", "seed=«»"), SEED)
    made += _of(
        own, many.replace("seed=1", "seed=1, threads=«»"), [*(v for v in WHOLE if v != "None"), "0"]
    )
    made += _of(own, many.replace("seed=1", "seed=1, block=«»"), [*WHOLE, "0"])
    made += _of(own, many.replace("seed=1", "seed=1, block=1, callback=«»"), ["3", "'x'", "[]"])
    own = "agents/evaluation.py"
    score = "noisy_performance(agent(), task, patterns, runs=2, cap=50, seed=1)"
    made += _of(
        own,
        score.replace("agent()", "«»"),
        [
            "None",
            "[]",
            "3",
            "'x'",
            "[None]",
            "{}",
            "GNM()",
            "object()",
            "[agent(), 3]",
            "NeuronAgent(GNM(), ErrorTrace(), 5)",
            "type('P', (), {'predict': lambda *a: 3})()",
            "type('P', (), {'predict': lambda *a: (np.array(['a', 'b']), None)})()",
            "type('P', (), {'predict': lambda *a: (np.array([7, nan]), None)})()",
        ],
    )
    made += _of(
        own,
        score.replace("task, patterns", "«»"),
        ["None, patterns", "task, None", "Task(), patterns", "3, 3"],
    )
    made += _of(own, score.replace("runs=2", "runs=«»"), [*WHOLE, "0", "10**12"])
    made += _of(own, score.replace("cap=50", "cap=«»"), [*WHOLE, "0"])
    made += _of(own, score.replace("seed=1", "seed=«»"), [*SEED, "None"])
    made += _of(
        own, score.replace("seed=1", "seed=1, threads=«»"), ["0", "-1", "'x'", "2.5", "10**30"]
    )
    made += _of(own, score.replace("seed=1", "seed=1, shared=«»"), BOOL)
    made += _of(own, "answers(agent(), task, patterns, trials=«»)", [*WHOLE[1:], "0"])
    made += _of(own, "answers(agent(), task, patterns, trials=2, seed=«»)", SEED)
    made += _of(
        own, "answers(«», task, patterns, trials=2)", ["None", "[]", "3", "'x'", "[agent(), 3]"]
    )
    made += _of(
        own,
        "mistake_rate(«»)",
        [
            "[-5]",
            "[]",
            "'x'",
            "None",
            "[nan]",
            "[1.5]",
            "[20000]",
            "{}",
            "object()",
            "[[1], [2, 3]]",
            "['a']",
            "[1j]",
            "[inf]",
        ],
    )
    made += _of(own, "mistake_rate([5], cap=«»)", [*WHOLE, "0", "3"])
    made += _of(
        own,
        "bootstrap_interval(«»)",
        [
            "[]",
            "None",
            "'x'",
            "[nan]",
            "[[1, 2], [3, 4]]",
            "{}",
            "['a']",
            "[1j]",
            "[inf, 1]",
            "object()",
            "3",
        ],
    )
    made += _of(own, "bootstrap_interval([1.0, 2.0], resamples=«»)", [*WHOLE, "0", "10**14"])
    made += _of(own, "bootstrap_interval([1.0, 2.0], seed=«»)", SEED)
    own = "agents/history.py"
    one = "h = train_many([agent(), agent()], task, patterns, trials=2, seed=1)\n"
    made += _of(own, one + "h.of(«»)", ["5", "-3", "'x'", "None", "0.5", "2**70", "object()"])
    made += _of(
        own,
        "h = train(agent(), trial_env(), 2, seed=1)\nh.save(«»)",
        ["None", "'missing/folder/x'", "'.'", "3", "'x' * 300", "'a\\0'"],
    )
    made += _of(own, one + "h.save(«»)", ["'curve.csv'"])
    made += _of(
        own,
        "History().append(«»)",
        ["-1, 0, 0", "'x', 0, 0", "1, 'x', 0", "1, nan, 0", "1, [1, 2], 0", "None, 0, 0"],
    )
    return _fine(
        made, "seed=True", "GNM(alpha", "callback=[]", "neuron = LIF", "rule = Err", "h.save('curve.csv')",
        "cap=10**30", "seed=[1, 2]", "FrameStack", "History()", "block=10**30", "block=10**5000", "mistake_rate([5], cap=10**30)", "MaxAndSkip", "[1, 2], 0",
    )  # fmt: skip


# --- files ----------------------------------------------------------------------------------------


def _files() -> list[Case]:
    made: list[Case] = []
    own = "agents/checkpoint.py"
    for one, _ in _KINDS:
        cls = {
            "agent()": "NeuronAgent",
            "continuous()": "ContinuousAgent",
            "network()": "NetworkAgent",
        }[one]
        made += _of(
            own,
            f"{one}.save(«»)",
            [
                "None",
                "3",
                "'missing/folder/x'",
                "'.'",
                "'x' * 300",
                "'a\\0b'",
                "object()",
                "'/dev/null'",
                "''",
            ],
        )
        made += _of(own, f"{one}.save('a', task=«»)", ["3", "'x'", "{}"])
        made += _of(own, f"{one}.save('a', patterns=«»)", ["3", "'x'", "np.zeros((2, 3, 4))"])
        made += _of(own, f"{one}.save('a', rng=«»)", ["3", "'x'", "np.random.RandomState(0)"])
        made += _of(
            own,
            f"{one}.save('a', task=task, patterns=«»)\nload_checkpoint('a')",
            ["Patterns.draw(Task(), 0)"],
        )
        made += _of(
            own, f"a = {one}\na.weights[0] = «»\na.save('a')\nload_checkpoint('a')", ["nan", "inf"]
        )
        made += _of(
            own,
            f"a = {one}\na.velocity = «»\na.save('a')\nload_checkpoint('a')",
            ["np.zeros(1)", "None", "np.zeros(4) + 1j", "np.full(4, nan)"],
        )
        made += _of(
            own,
            f"{cls}.load(«»)",
            [
                "None",
                "3",
                "'missing'",
                "'.'",
                "'x' * 300",
                "'a\\0b'",
                "object()",
                "'/dev/null'",
                "''",
            ],
        )
    made += _of(own, "agent().save('a')\n«».load('a')", ["NetworkAgent", "ContinuousAgent"])
    contents = [
        "b''", "b'some text\\n'", "b'PK\\3\\4'", "b'\\x93NUMPY\\1\\0'", "pickle.dumps({'a': 1})", "bytes(range(256))",
        "b'{\"a\": 1}'", "b'\\0' * 10000", "b'\\x89HDF'", "b'\\x1f\\x8b' + bytes(50)", "'ä'.encode('latin-1') * 99",
    ]  # fmt: skip
    made += _of(own, "Path('f').write_bytes(«»)\nload_checkpoint('f')", contents)
    header = (
        "import json\nagent(weight_bounds=(0.0, 1.0)).save('a', task=task, patterns=patterns, "
        "rng=np.random.default_rng(0))\n"
        "before = seen_in_checkpoint(Path('a'))\n"
        "with np.load('a') as f: c = {n: f[n] for n in f.files}\n"
        "h = json.loads(c['header'].tobytes())\n"
        "«»\n"
        "if isinstance(h, (dict, list)): h = np.frombuffer(json.dumps(h).encode(), np.uint8)\n"
        "c['header'] = h\n"
        "with open('a', 'wb') as f: np.savez(f, **c)\n"
        "refuse_if(seen_in_checkpoint(Path('a')) == before)"
    )
    whole = [
        "h = []", "h = np.frombuffer(b'[' * 100000, np.uint8)", "h = np.zeros(3)",
        "h = np.frombuffer(b'{}', np.uint8)", "h['format'] = 99", "h['patterns_shape'] = [10**6] * 3",
        "h['patterns_shape'] = [-1, 3, 4]", "h['patterns_shape'] = [2, 3]", "h['task'] = {'rate': 7}",
        "h['task'] = {'bogus': 1}", "h['rng'] = {'bit_generator': 'os'}", "h['weight_bounds'] = [1, 0]",
        "h['rng'] = {'bit_generator': 'PCG64', 'state': 3}", "h['patterns_shape'] = [2.5, 3, 4]",
        "c['weights'] = np.zeros(10**6)", "c['weights'] = np.zeros(4, np.int8)", "del c['weights']",
        "c['weights'] = np.zeros(4) + 1j", "c['weights'] = np.array(['a'] * 4)",
        "c['weights'] = np.zeros((2, 2))", "c['weights'] = np.zeros(0)", "c['weights'] = np.full(4, nan)",
        "c['weights'] = np.array([{}] * 4, object)", "c['bogus'] = np.zeros(3)",
        "c['patterns'] = np.zeros(1, np.uint8)", "c['patterns'] = np.zeros(999, np.uint8)",
        "c['patterns'] = np.zeros(3)", "del c['patterns']",
    ]  # fmt: skip
    made += [Case(f"checkpoint: {line}", own, header.replace("«»", line)) for line in whole]
    # Every entry of the header, whatever it is called, with something else in its place.
    for place in range(28):
        for value in ("'bogus'", "[]", "{'a': 1}", "nan", "-1e9", "None"):
            line = f"replace_entry(h, {place}, {value})"
            # Some entries are numbers that may be any, or need not be there.
            fine = value in ("None", "-1e9")
            made.append(Case(f"checkpoint: {line}", own, header.replace("«»", line), fine))
    made += _of(
        own,
        "load_checkpoint(«»)",
        ["None", "3", "'missing'", "'.'", "'x' * 300", "'a\\0b'", "object()", "'/dev/null'", "''"],
    )
    own = "gnm_env/files.py"
    made += _of(
        own,
        "from gnm_env.files import atomic_write\nwith atomic_write(«») as f: f.write(b'x')",
        ["None", "3", "'no/x'", "'.'", "'x' * 256", "'a\\0b'", "'/dev/null'", "''", "'/proc/x'"],
    )
    made += _of(
        own,
        "from gnm_env.files import read_arrays\nread_arrays(«», {})",
        ["None", "3", "'no'", "'.'", "'x' * 256", "'a\\0b'", "'/dev/zero'", "''"],
    )
    return _fine(
        made,
        "h['overflowed'] = 'x'",
        "h['task'] = None",
        "c['weights'] = np.zeros(4, np.int8)",
        "c['bogus']",
        "h['neuron'] = None",
    )


# --- reinforcement learning, command lines --------------------------------------------------------


def _rl() -> list[Case]:
    made: list[Case] = []
    own = "agents/rl/sb3_agent.py"
    head = (
        "from agents.rl import ObservationConfig, SB3Agent\n"
        "class P:\n    def predict(self, o, s=None, e=None, d=True): return np.zeros(len(o), int), s\n"
    )

    def more(values: list[str], template: str) -> list[Case]:
        return [
            Case(template.replace("«»", v), own, head + template.replace("«»", v)) for v in values
        ]

    made += more(["None", "3", "'x'", "object()"], "SB3Agent(«», task)")
    made += more(["None", "3", "'x'", "{}", "patterns"], "SB3Agent(P(), «»)")
    made += more(["3", "'x'", "{}", "None"], "SB3Agent(P(), task, «»)")
    made += more(list(OBSERVATION), "SB3Agent(P(), task).predict(«»)")
    made += more(
        [
            "3",
            "'x'",
            "(1, 2, 3)",
            "object()",
            "{}",
            "(np.zeros((5, 5)), np.zeros(2), None)",
            "(np.zeros((2, 0)), np.zeros((2, 3)), None)",
        ],
        "SB3Agent(P(), task).predict(np.zeros((2, 4), np.int8), «»)",
    )
    made += more(
        ["[True]", "'x'", "3", "[True] * 5", "object()"],
        "SB3Agent(P(), task).predict(np.zeros((2, 4), np.int8), None, «»)",
    )
    made += more(
        [
            "decays='0.3'",
            "decays=True",
            "decays=(nan,)",
            "decays=(2.0,)",
            "decays=None",
            "decays={}",
            "scale=0",
            "scale='x'",
            "scale=nan",
            "scale=1e300",
            "decays=(0.3,), previous_action='no'",
            "previous_action=True",
            "own_decay=0.1",
            "decays=(0.3,), own_decay='x'",
            "decays=(0.3,), own_decay=7",
            "rising_edge='no'",
            "rising_edge=None",
            "bogus=1",
        ],
        "ObservationConfig(«»)",
    )
    return _fine(made, "np.zeros(4, object)", "P(), task, None", "predict(np.zeros((1, 4)))")


def _commands() -> list[Case]:
    made: list[Case] = []

    def lines(script: str, values: list[str]) -> list[Case]:
        return [
            Case(f"{script} {v}", f"scripts/{script}", f"command({script!r}, *{v.split()!r})")
            for v in values
        ]

    quick = "--trials 10 --runs 2 --out out"
    made += lines("train.py", [f"{quick} {v}" for v in (
        "--alpha 7", "--alpha x", "--alpha nan", "--trials -1", "--trials 2.5", "--trials x", "--runs 0", "--runs -5",
        "--neuron bogus", "--rule bogus", "--classes 0", "--seed -1", "--seed x", "--bogus 1", "--learning-rate nan",
        "--learning-rate -1", "--out /dev/null/x", "--out /proc/x", "--resume missing", "--n-inputs 0", "--rate 7",
        "--pattern-seed -1", "--neuron lif --alpha 2", "--threads 0", "--checkpoint",
    )])  # fmt: skip
    made += lines(
        "evaluate.py",
        [
            "",
            "missing",
            ".",
            "/dev/null",
            "missing --runs 0",
            "missing --json",
            "a b c",
            "--bogus",
            "/etc/hostname",
        ],
    )
    made += lines("show.py", ["missing --json", "/etc/hostname", "--bogus", "/dev/null"])
    made += lines(
        "sweep.py",
        [
            "",
            "bogus",
            "table --size bogus",
            "table --threads 0",
            "table --threads x",
            "--json",
            "table --store /proc/x",
        ],
    )
    made += lines(
        "reproduce.py", ["--size bogus", "--results /proc/x --size quick --bogus", "bogus"]
    )
    made += lines(
        "report.py",
        [
            "--size bogus",
            "--results missing --out out",
            "--results /dev/null --out out",
            "--out /proc/x",
        ],
    )
    made += lines("figures.py", ["bogus", "--size bogus", "--results missing --out out"])
    made += lines("league.py", ["--bogus", "--size bogus"])
    made += lines("chemistry.py", ["missing", "", "/etc/hostname", "--bogus"])
    made += lines(
        "train_rl.py", ["--algo bogus", "--steps -1", "--out /proc/x --steps 1", "--bogus"]
    )
    return made


def by_owner(results: typing.Iterable[tuple[Case, str]]) -> dict[str, dict[str, int]]:
    """How often each outcome came, by owner."""
    table: dict[str, dict[str, int]] = {}
    for case, outcome in results:
        row = table.setdefault(case.owner, {})
        row[outcome] = row.get(outcome, 0) + 1
    return table
