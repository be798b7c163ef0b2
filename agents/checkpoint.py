"""Checkpoints: one file, no pickle, written whole or not at all.

A checkpoint is a zip of plain arrays (NumPy's npz) with a JSON header beside them. The header names
the classes of agent, model and rule and the modules that they came from; loading imports nothing by
itself, but says which module to import where a class is not known.
"""

from __future__ import annotations

import json
import math
import os
from dataclasses import asdict, dataclass, fields
from typing import Any, TypeVar

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from agents import registry
from agents.learning.rule import NoMemory
from gnm_env.checks import brief, generator, whole
from gnm_env.files import ArraySpec, atomic_write, open_arrays, write_arrays
from gnm_env.task import Patterns, Task, task_arrays

__all__ = ["Checkpoint", "atomic_write", "load_agent", "load_checkpoint", "save_agent"]

FORMAT = 2
"""Format 1 had the parts of the header under other names, by kind of agent; it is still read."""
WHAT = "checkpoint"
MOST_HEADER_BYTES = 10_000_000
_ARRAYS = {
    "weights": ArraySpec("f8", (None,)),
    "velocity": ArraySpec("f8", (None,)),
    "momentum": ArraySpec("f8", (None,)),
    "rule_memory": ArraySpec("f8", (None,)),
    "weight_sum": ArraySpec("f8", (None,)),
    "patterns": ArraySpec("u1", (None,)),
}
_BIT_GENERATORS = {
    cls.__name__: cls
    for cls in (
        np.random.MT19937,
        np.random.PCG64,
        np.random.PCG64DXSM,
        np.random.Philox,
        np.random.SFC64,
    )
}
_Agent = TypeVar("_Agent")


@dataclass(frozen=True)
class Checkpoint:
    """What a checkpoint holds beside the agent: the task that it was trained on, and how far.

    Attributes:
        agent: the agent, ready to go on.
        task: its task, if it was saved with one.
        patterns: its patterns, likewise.
        rng: the generator of its stream, as it stood when it was saved.
    """

    agent: Any
    task: Task | None = None
    patterns: Patterns | None = None
    rng: Generator | None = None

    def __repr__(self) -> str:
        task = "no task" if self.task is None else brief(self.task)
        return f"Checkpoint({self.agent!r}, {task})"


def save_agent(
    path: str | os.PathLike[str],
    agent: Any,
    *,
    task: Task | None = None,
    patterns: Patterns | None = None,
    rng: Generator | None = None,
) -> None:
    """Save `agent` with what else is to be kept; ValueError for what could not be loaded again."""
    model, rule = agent.model, agent.rule
    header: dict[str, Any] = {
        "format": FORMAT,
        "agent": _of_class("agent", type(agent)),
        "model": _of_class(model.kind, type(model)) | {"parameters": _parameters(model)},
        "rule": _of_class("rule", type(rule)) | {"parameters": _parameters(rule)},
        "n_inputs": agent.n_inputs,
        "weight_bounds": agent.weight_bounds,
        "overflowed": bool(agent.overflowed),
        "trials": agent.trials,
    }
    if agent.rng is not None:
        header["agent_rng"] = agent.rng.bit_generator.state
    contents = {"weights": agent.weights, "velocity": agent.velocity}
    if rule.memory_type is not NoMemory:
        contents["rule_memory"] = agent.rule_memory
    if rule.averages:
        contents["weight_sum"] = agent.weight_sum
    for name, array in contents.items():
        if not np.isfinite(array).all():
            raise ValueError(
                f"the {name} hold NaN or infinity, which no checkpoint can be loaded with: "
                "load an earlier checkpoint or start anew"
            )
    if task is not None:
        if not isinstance(task, Task):
            raise ValueError(f"task must be a gnm_env.Task, got {type(task).__name__}")
        header["task"] = asdict(task)
    if patterns is not None:
        if task is not None:
            task_arrays(task, patterns)  # they must fit each other
        elif not isinstance(patterns, Patterns):
            raise ValueError(f"patterns must be gnm_env.Patterns, got {type(patterns).__name__}")
        contents["patterns"] = np.packbits(patterns.dense())
        header["patterns_shape"] = patterns.shape
    if rng is not None:
        state = generator("rng", rng).bit_generator.state
        if state["bit_generator"] not in _BIT_GENERATORS:
            raise ValueError(
                f"a checkpoint cannot keep a generator of kind {state['bit_generator']}; "
                f"known kinds: {', '.join(_BIT_GENERATORS)}"
            )
        header["rng"] = state
    text = json.dumps(header, default=_plain).encode()
    write_arrays(path, {"header": np.frombuffer(text, np.uint8), **contents})


def _of_class(kind: str, cls: type) -> dict[str, Any]:
    """How a header names a class; ValueError if loading would find another under its name."""
    name = getattr(cls, "name", "")
    known = registry.known(kind, name)
    if known is not cls:
        raise ValueError(
            f"the {kind} {registry.home(cls)} cannot be saved: {name!r} is by now the name of "
            f"{registry.home(known) if known else 'no class'}; define it once, under a name of "
            "its own"
        )
    return {"name": name, "class": registry.home(cls)}


def _parameters(part: Any) -> dict[str, Any]:
    """The fields of a dataclass; ValueError unless it can be made of them again."""
    values = {f.name: getattr(part, f.name) for f in fields(part) if f.init}
    try:
        again = type(part)(**json.loads(json.dumps(values, default=_plain)))
    except (TypeError, ValueError) as error:
        raise ValueError(
            f"{part!r} cannot be saved: its parameters do not survive JSON ({error}); "
            "use numbers, texts and None"
        ) from None
    try:
        same = again == part
    except ValueError:  # an array among them
        same = False
    if not same:
        raise ValueError(f"{part!r} cannot be saved: it would be loaded as {again!r}")
    return values


def _plain(value: Any) -> Any:
    """NumPy's numbers and arrays, as JSON knows them."""
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    raise TypeError(f"a {type(value).__name__} is not JSON")


def load_checkpoint(path: str | os.PathLike[str]) -> Checkpoint:
    """Load an agent of any kind with all that was saved beside it; ValueError if it is damaged."""
    with open_arrays(path, what=WHAT) as file:
        spec = ArraySpec("u1", (None,))
        header = json.loads(file.read("header", spec).tobytes())
        if not isinstance(header, dict):
            raise ValueError("its header is no JSON object")
        unknown = sorted(set(file.names) - set(_ARRAYS) - {"header"})
        if unknown:
            raise ValueError(f"it holds an array {unknown[0]!r} that does not belong there")
        arrays = {name: file.read(name, _ARRAYS[name]) for name in file.names if name != "header"}
        header = _upgraded(header, arrays)
        task = _task(header)
        patterns = _patterns(header, arrays)
        if task is not None and patterns is not None:
            task_arrays(task, patterns)  # they must fit each other
        return Checkpoint(_agent(header, arrays), task, patterns, _generator(header.get("rng")))


def _upgraded(header: dict[str, Any], arrays: dict[str, Any]) -> dict[str, Any]:
    """A header of format 1 as one of format 2; the array of the velocity gets its name."""
    if header["format"] == FORMAT:
        return header
    if header["format"] != 1:
        raise ValueError(
            f"its format is {header['format']!r}, and this version reads 1 and {FORMAT}: "
            "load it with the version that wrote it"
        )
    kind = header["kind"]
    arrays["velocity"] = arrays.pop("momentum")
    model = {"neuron": header.get("neuron"), "continuous": "continuous", "network": "network"}[kind]
    parameters = header["network"] if kind == "network" else header["neuron_parameters"]
    return {
        **header,
        "format": FORMAT,
        "agent": {"name": kind},
        "model": {"name": model, "parameters": parameters},
        "rule": {"name": header.get("rule", "bp"), "parameters": header["rule_parameters"]},
        "n_inputs": header.get("n_inputs", len(arrays["weights"])),
        "weight_bounds": header.get("weight_bounds"),
        "trials": 0,
    }


def _agent(header: dict[str, Any], arrays: dict[str, NDArray[Any]]) -> Any:
    cls: Any = _class("agent", header["agent"])
    model_kind = "network" if registry.known("network", header["model"]["name"]) else "neuron"
    model = _class(model_kind, header["model"])(**header["model"]["parameters"])
    rule = _class("rule", header["rule"])(**header["rule"]["parameters"])
    bounds = header["weight_bounds"]
    weights, velocity = arrays["weights"], arrays["velocity"]
    n_inputs, trials = header["n_inputs"], header["trials"]
    expected = model.n_weights(n_inputs)
    if len(weights) != expected or len(velocity) != expected:
        raise ValueError(
            f"weights and velocity must have length {expected}, "
            f"got {len(weights)} and {len(velocity)}"
        )
    if type(header["overflowed"]) is not bool or type(trials) is not int or trials < 0:
        raise ValueError("its header does not say how far the agent was trained")
    agent = cls.rebuilt(model, rule, n_inputs, None if bounds is None else tuple(bounds))
    agent.weights, agent.velocity = weights, velocity
    if "agent_rng" in header:
        agent.rng = _generator(header["agent_rng"])
    if "rule_memory" in arrays:
        agent.rule_memory = arrays["rule_memory"]
    if rule.averages:
        agent.weight_sum = arrays["weight_sum"]
    agent._trials, agent.overflowed = trials, header["overflowed"]
    return agent


def _class(kind: str, named: Any) -> Any:
    if not isinstance(named, dict):
        raise ValueError(f"its header does not name the class of its {kind}, but {named!r}")
    home = named.get("class")  # format 1 does not tell it
    if home is not None and not (isinstance(home, str) and ":" in home):
        raise ValueError(f"its header does not name the class of its {kind}, but {home!r}")
    return registry.find_class(kind, named["name"], home)


def _task(header: dict[str, Any]) -> Task | None:
    return Task(**header["task"]) if "task" in header else None


def _patterns(header: dict[str, Any], arrays: dict[str, NDArray[Any]]) -> Patterns | None:
    if "patterns_shape" not in header:
        return None
    shape = tuple(whole("patterns_shape", n, low=1) for n in header["patterns_shape"])
    n_bits = math.prod(shape)
    if min(shape, default=0) < 1 or len(arrays["patterns"]) != -(-n_bits // 8):
        raise ValueError(f"its patterns do not fill the shape {shape}")
    return Patterns.from_dense(np.unpackbits(arrays["patterns"], count=n_bits).reshape(shape))


def load_agent(path: str | os.PathLike[str], cls: type[_Agent]) -> _Agent:
    """The agent of a checkpoint; ValueError if it is damaged, or its agent no `cls`."""
    agent = load_checkpoint(path).agent
    if not isinstance(agent, cls):
        raise ValueError(
            f"{path} holds a {type(agent).__name__}, not a {cls.__name__}; "
            "use agents.load_checkpoint for checkpoints of any kind"
        )
    return agent


def _generator(state: dict[str, Any] | None) -> Generator | None:
    if state is None:
        return None
    bit_generator: Any = _BIT_GENERATORS[state["bit_generator"]]()
    bit_generator.state = state
    return Generator(bit_generator)
