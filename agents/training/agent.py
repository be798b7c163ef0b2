"""The agent shell: a model with weights and a learning rule, acting bin by bin."""

from __future__ import annotations

import copy
import os
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import fields, replace
from typing import Any, ClassVar, Self

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike, NDArray

from agents import checkpoint, registry
from agents.learning.averaging import average_alone
from agents.learning.rule import FEEDBACK, Rule
from agents.model import Arrays, Model
from agents.recording import Recording
from agents.training.batch import AgentBatch
from agents.training.binding import loops, recorder
from agents.training.compile_errors import COMPILING, explained
from agents.training.source import Source
from agents.training.stepwise import TrialSoFar
from agents.training.streams import WRONG_BEYOND
from agents.training.told import Told, segments_told, whole_trial
from agents.training.trial import ModelBlock, RuleBlock
from gnm_env.checks import brief, real, shown, whole
from gnm_env.task import Patterns, Task
from gnm_env.trial import Trial

MAX_INPUTS = 10_000_000
"""Most input channels of an agent."""

MAX_WEIGHTS = 100_000_000
"""Most weights of an agent: learning keeps three numbers for each, 2.4 GB at this size."""

Bounds = tuple[float, float] | None


class Agent:
    """Base of the agents: weights, acting, learning, prediction, recording, checkpoints.

    A subclass says in `models` which models it takes and in `name` how checkpoints call it.
    """

    name: ClassVar[str]
    models: ClassVar[type[Model]]
    model_role: ClassVar[str]
    """What messages call the model: "neuron" or "network"."""
    wrong_beyond: ClassVar[float] = WRONG_BEYOND
    """A trial is answered wrongly if its sum is further than this from the label."""

    def __init_subclass__(cls, **keywords: Any) -> None:
        super().__init_subclass__(**keywords)
        if "name" in vars(cls):  # others serve well, but cannot be saved
            registry.register("agent", cls)

    def __init__(
        self,
        model: Model,
        rule: Rule,
        n_inputs: int,
        seed: int,
        initial_weight: float | None,
        weight_bounds: Bounds,
    ) -> None:
        self._model = self._checked_model(model)
        self._rule = _checked_rule(rule)
        self._n_inputs = whole("n_inputs", n_inputs, low=1, high=MAX_INPUTS)
        size = model.n_weights(self._n_inputs)
        if size > MAX_WEIGHTS:
            raise ValueError(
                f"an agent must have at most {MAX_WEIGHTS:,} weights, got {size:,} for "
                f"{self._n_inputs:,} inputs: lower n_inputs, or hidden of a network"
            )
        self._weight_bounds = _checked_bounds(weight_bounds)
        _require_numbers(model)
        rule.kernel(model)  # refuses a model that the rule cannot teach
        rule.static(self._n_inputs)
        if initial_weight is None:
            initial_weight = model.default_initial_weight
        scale = real("initial_weight", initial_weight, low=-1e100, high=1e100)
        seed = whole("seed", seed, low=0, high=2**128 - 1)
        rng = np.random.default_rng((seed, 2))
        drawn = model.initial_weights(rng, self._n_inputs, scale)
        self._weights = np.clip(drawn, *self.bounds)
        self._velocity = np.zeros(size)
        self._rule_memory = np.zeros(len(rule.memory_type._fields))
        self._weight_sum = np.zeros(size if rule.averages else 0)
        self.rng = np.random.default_rng((seed, 3)) if rule.spike_probability else None
        self._silence = np.ones(2)
        self._trials = 0
        self.overflowed = False
        self._prepare()

    def _prepare(self) -> None:
        """What is derived from the rest, and is not kept in checkpoints or pickles."""
        model, rule = self._model, self._rule
        self._loops = loops(model, rule)
        self._n_state = len(model.state_type._fields)  # type: ignore[attr-defined]
        states = np.zeros((self._n_state + model.n_memory, 1))
        self._state, memory = states[: self._n_state], states[self._n_state :]
        static = model.static(self._n_inputs)
        parameters = np.array(model.parameters(), np.float64)[:, None]
        arrays = Arrays(self._weights[:, None], memory, np.empty((0, 1)))
        self._block = ModelBlock(parameters, arrays, static, model.n_notes)
        self._rule_block = RuleBlock(
            np.array(self.rule_parameters(), np.float64)[:, None],
            self._velocity[:, None],
            rule.static(self._n_inputs),
            self._rule_memory[:, None],
        )
        self._heard: TrialSoFar | None = None
        self._make_room(256, 4 * self._n_inputs + 256)
        self.begin_trial()

    def __getstate__(self) -> dict[str, Any]:
        kept = {name: value for name, value in self.__dict__.items() if name not in _DERIVED}
        return {**kept, "heard so far": self._heard_so_far()}

    def __setstate__(self, state: dict[str, Any]) -> None:
        state = dict(state)
        so_far = state.pop("heard so far", None)
        self.__dict__.update(state)
        self._prepare()
        if so_far is not None:
            self._go_on(*so_far)

    def _heard_so_far(self) -> tuple[Any, ...]:
        """The present trial: bins heard, state, memory, and the used part of each buffer."""
        assert self._heard is not None
        bins, events = self._bin, self._heard.offsets[self._bin]
        used = (events, bins + 1, bins, bins, bins, bins, bins * self._model.n_notes)
        pairs: Any = zip(self._heard, used, strict=True)
        parts = [buffer[:n].copy() for buffer, n in pairs]
        return bins, self._state.copy(), self._block.arrays.memory.copy(), parts

    def _go_on(self, bins: int, state: Any, memory: Any, parts: Any) -> None:
        """Take up a trial where `_heard_so_far` left it."""
        self._make_room(max(bins, 256), len(parts[0]) + 4 * self._n_inputs + 256)
        assert self._heard is not None
        self._bin, self._state[:], self._block.arrays.memory[:] = bins, state, memory
        pairs: Any = zip(self._heard, parts, strict=True)
        for place, part in pairs:
            place[: len(part)] = part

    def __repr__(self) -> str:
        parts = f"{brief(self._model)}, {brief(self._rule)}, n_inputs={self._n_inputs}"
        return f"{type(self).__name__}({parts})"

    # --- what it is made of ----------------------------------------------------------------------

    @property
    def model(self) -> Any:
        """The neuron or network."""
        return self._model

    @property
    def rule(self) -> Any:
        """The learning rule."""
        return self._rule

    @property
    def n_inputs(self) -> int:
        """N, number of input channels."""
        return self._n_inputs

    @property
    def weight_bounds(self) -> Bounds:
        """Lowest and highest weight; None: unbounded."""
        return self._weight_bounds

    @property
    def trials(self) -> int:
        """Trials that it has learned from, or might have."""
        return self._trials

    @property
    def weights(self) -> NDArray[np.float64]:
        """float64, the agent's own writable array; assigning copies into it, checked."""
        return self._weights

    @weights.setter
    def weights(self, values: ArrayLike) -> None:
        put("weights", values, self._weights)

    @property
    def velocity(self) -> NDArray[np.float64]:
        """float64, Δw of the last learning step, momentum included; assigning copies, checked."""
        return self._velocity

    @velocity.setter
    def velocity(self, values: ArrayLike) -> None:
        put("velocity", values, self._velocity)

    @property
    def momentum(self) -> NDArray[np.float64]:
        """The former name of `velocity`. (The factor μ is the rule's: `agent.rule.momentum`.)"""
        return self._velocity

    @momentum.setter
    def momentum(self, values: ArrayLike) -> None:
        self.velocity = values

    @property
    def rule_memory(self) -> NDArray[np.float64]:
        """float64, what the rule remembers from trial to trial; assigning copies, checked."""
        return self._rule_memory

    @rule_memory.setter
    def rule_memory(self, values: ArrayLike) -> None:
        put("rule_memory", values, self._rule_memory)

    @property
    def weight_sum(self) -> NDArray[np.float64]:
        """float64, sum of the weights that count for their mean so far; no numbers where the rule
        takes none. Assigning copies, checked."""
        return self._weight_sum

    @weight_sum.setter
    def weight_sum(self, values: ArrayLike) -> None:
        put("weight_sum", values, self._weight_sum)

    @property
    def potential(self) -> float:
        """Membrane potential in the bin that `act` heard last, before any reset; 0 before any.

        Divided by `model.threshold` it is what an environment's `potential` takes for its pictures.
        """
        assert self._heard is not None
        return float(self._heard.V[self._bin - 1, 0]) if self._bin else 0.0

    @property
    def bounds(self) -> tuple[float, float]:
        """Lowest and highest weight; infinite where there is no bound."""
        return self._weight_bounds or (-np.inf, np.inf)

    def rule_parameters(self) -> tuple[float, ...]:
        """The numbers of the rule as compiled code takes them."""
        parameters: tuple[float, ...] = self._rule.parameters(self._model, self.bounds)
        return parameters

    def _checked_model(self, model: Any) -> Model:
        role, expected = self.model_role, self.models
        if isinstance(model, type) and issubclass(model, Model):
            raise ValueError(
                f"{role} must be an instance, got the class {model.__name__}; "
                f"write {model.__name__}()"
            )
        if not isinstance(model, expected):
            hint = ""
            if isinstance(model, Model):
                hint = f"; {_agent_for(model)} is the agent for it"
            raise ValueError(
                f"{role} must be one of {_names(expected)}, or a class of yours derived from "
                f"{expected.__name__}, got {model!r}{hint}"
            )
        missing = [name for name in model.needs if not hasattr(model, name)]
        if missing:
            raise ValueError(
                f"the class {type(model).__name__} needs {missing[0]}; write, beside its fields, "
                f"{missing[0]}: ClassVar[Any] = …"
            )
        return model

    # --- the standard loop -----------------------------------------------------------------------

    def begin_trial(self) -> None:
        """Forget the last trial: state 0, empty record. Checks that what learns is finite."""
        require_finite("weights", self._weights)
        require_finite("velocity", self._velocity)
        assert self._heard is not None
        self._state[:] = 0.0
        self._block.arrays.memory[:] = 0.0
        self._bin = 0
        self._heard.offsets[0] = 0

    def act(self, obs: NDArray[Any]) -> Any:
        """The answer to one bin: 1 for an output spike, else 0. `obs` holds N bits."""
        return int(self._step(obs))

    def _step(self, obs: NDArray[Any]) -> float:
        row = self._checked(obs, (self._n_inputs,))
        try:
            out: float = self._loops.step(row, self._bin, *self._parts)
        except COMPILING as error:
            raise explained(error, self._model) from None
        if out < 0.0:
            assert self._heard is not None
            self._make_room(2 * len(self._heard.V), 2 * len(self._heard.channels))
            out = self._loops.step(row, self._bin, *self._parts)
        if self.rng is not None:
            out = self._drawn()
        self._bin += 1
        return out

    def _drawn(self) -> float:
        """The output of this bin, drawn."""
        assert self.rng is not None and self._heard is not None
        if self._bin == 0:
            self._silence[:] = 1.0, self.rng.random()
        out: float = self._loops.explore_bin(
            self._rule_block, self._block, self._heard, self._bin, self._silence
        )
        if out != 0.0:
            self._silence[:] = 1.0, self.rng.random()
        return out

    def learn(self, reward: float, info: Mapping[str, Any], sign_only: bool = False) -> None:
        """Learn from the trial that has just ended.

        `reward` is that of the last step and `info` its terminal info. With `sign_only` (the
        environment gives feedback="sign") only the reward is used. A weight that would overflow,
        or a potential that has, ends learning: `overflowed` is set, the last weights are kept.

        Raises:
            ValueError: if reward or info are no numbers, do not agree with what was heard, or do
                not tell what the rule needs.
        """
        told = self._told(reward, info, sign_only)
        self._trials += 1
        assert self._heard is not None
        # What is not finite stays so: the last bin tells for all.
        if not np.isfinite(self._heard.V[self._bin - 1, 0]):
            self.overflowed = True
        if self.overflowed:
            return
        decay_trials = self._rule.decay_trials
        decay = 0.0 if decay_trials is None else 1.0 / decay_trials
        left = 1.0 - float(self._trials - 1) * decay
        rate = self.rule_parameters()[0] * max(left, 0.0)
        trial = told.arrays(self._heard.channels, self._heard.offsets[: self._bin + 1])
        try:
            outcome = self._loops.update(
                self._rule_block, self._block, trial, self._heard, told.told, told.label, rate
            )
        except COMPILING as error:
            raise explained(error, self._model, self._rule) from None
        self.overflowed = outcome < 0
        if self._rule.averages and not self.overflowed:
            average_alone(
                self._rule_block.parameters, float(self._trials),
                self._block.arrays.weights, self._weight_sum[:, None],
            )  # fmt: skip

    def _told(self, reward: float, info: Mapping[str, Any], sign_only: bool) -> Told:
        """What the rule may know, checked."""
        feedback = self._rule.feedback
        reward = real("reward", reward)
        if self._bin == 0:
            raise ValueError(
                "a trial must be heard before it can be learned from, and no bin was: "
                "call act(obs) for each bin, and then learn"
            )
        if not sign_only:
            self._require_agreement(info)
        elif feedback == "sign":
            return whole_trial(self._bin, told=float(np.sign(reward)))
        if feedback == "none":
            return whole_trial(self._bin, told=1.0)
        if feedback == "reward" and not sign_only:
            return whole_trial(self._bin, told=float(reward) - 1.0)
        if sign_only:
            raise ValueError(
                f"{type(self._rule).__name__} needs to know {FEEDBACK[feedback]}, and this "
                'environment tells the sign of the error only: use feedback="cost", or a rule '
                "such as AggregateLabel or CriticalThreshold"
            )
        told = segments_told(self._bin, info, feedback == "presentations", type(self._rule))
        self._rule.check_label(told.label)
        return told

    def _require_agreement(self, info: Any) -> None:
        """ValueError if the terminal `info` contradicts what was heard and answered."""
        if not isinstance(info, Mapping):
            raise ValueError(
                f"info must be the terminal info of the trial, a dict, got {shown(info)}; "
                "hand on what env.step returned last"
            )
        assert self._heard is not None
        given = float(self._heard.output[: self._bin].sum())
        emitted = real("emitted", info["emitted"], finite=False) if "emitted" in info else given
        if abs(emitted - given) > 1e-6 * max(1.0, given):
            raise ValueError(
                f"the environment counted {emitted:g} of output and the agent gave {given:g} "
                f"in {self._bin} bins: an agent must hear and answer every bin of a trial, so "
                "wrappers that skip bins or change actions cannot be used"
            )

    def _make_room(self, bins: int, events: int) -> None:
        """Buffers for at least `bins` bins and `events` input spikes; what they hold is kept."""
        long = TrialSoFar(
            np.empty(events, np.int32),
            np.zeros(bins + 1, np.int64),
            np.empty((bins, 1)),
            np.empty((bins, 1)),
            np.empty((bins, 1)),
            np.empty((bins, 1)),
            np.empty((bins * self._model.n_notes, 1)),
        )
        if self._heard is not None:
            pairs: Any = zip(self._heard, long, strict=True)
            for short, place in pairs:
                place[: len(short)] = short
        self._heard = long
        block = self._block
        # What `step` takes, array by array.
        self._parts = (
            self._state, block.static, block.n_notes, block.parameters,
            block.arrays.weights, block.arrays.memory, *long,
        )  # fmt: skip

    # --- without learning ------------------------------------------------------------------------

    def predict(
        self,
        observation: NDArray[Any] | dict[str, NDArray[Any]],
        state: tuple[NDArray[Any], ...] | None = None,
        episode_start: NDArray[Any] | None = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[Any], tuple[NDArray[Any], ...]]:
        """Actions for one bin, as Stable-Baselines3 asks for them; changes nothing.

        `observation` of shape (N,) gives a 0-d action, (n, N) gives n of them for n independent
        streams. Pass the returned, opaque state to the next call; `episode_start` (n,) says where
        a new trial begins. The answer is deterministic whatever `deterministic` says.
        """
        outputs, states = self._predicted(observation, state, episode_start)
        actions = outputs.astype(np.int64)
        return (actions.reshape(()) if np.asarray(observation).ndim == 1 else actions), (states,)

    def _predicted(
        self, observation: Any, state: Any, episode_start: Any
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Outputs (n,) of n streams for one bin, and their states."""
        obs = _array(observation)
        obs = obs[None] if obs.ndim == 1 else obs
        rows = self._checked(obs, (*obs.shape[:1], self._n_inputs))
        shape = (len(rows), self._n_state + self._model.n_memory, 1)
        states = np.zeros(shape) if state is None else _checked_state(state, shape)
        if episode_start is not None:
            states[checked_begins(episode_start, len(rows))] = 0.0
        require_finite("weights", self._weights)
        return self._loops.predict(self._block, self._n_state, states, rows), states

    def record(self, trial: Trial) -> Recording:
        """See `agents.record`."""
        arrays = Arrays(
            self._weights[:, None], np.zeros((self._model.n_memory, 1)),
            np.empty((self._model.n_notes, 1)),
        )  # fmt: skip
        block = ModelBlock(self._block.parameters, arrays, self._block.static, self._block.n_notes)
        try:
            values, given, memory = recorder(self._model)(block, trial.arrays)
        except COMPILING as error:
            raise explained(error, self._model) from None
        return self._recording(values, given, memory)

    def _recording(
        self, values: NDArray[Any], given: NDArray[np.float64], memory: NDArray[np.float64]
    ) -> Recording:
        V, D, R, X, spikes = values
        return Recording(V, D, R, X, spikes > 0.0)

    def _checked(self, obs: NDArray[Any], shape: tuple[int, ...]) -> NDArray[np.int8]:
        """`obs` as contiguous bits of this shape."""
        obs = bits_of(obs)
        if obs.shape != shape:
            raise ValueError(
                f"an observation must have shape {shape} (n_inputs = {self._n_inputs}), "
                f"got {obs.shape}"
            )
        return obs

    # --- many at once ----------------------------------------------------------------------------

    def group_key(self) -> Hashable:
        """Agents with equal keys can be trained side by side."""
        model, rule = self._model, self._rule
        _, advance = model.advance()
        biexponential = rule.kernel(model).biexponential
        return (
            type(self), advance, model.static(self._n_inputs), type(rule), rule.variant,
            rule.averages, rule.static(self._n_inputs), biexponential, self._n_inputs,
        )  # fmt: skip

    @classmethod
    def batch(cls, agents: Sequence[Self], source: Source) -> AgentBatch:
        """The agents, all of one `group_key`, side by side."""
        return AgentBatch(agents, source)

    def _take(
        self,
        weights: NDArray[np.float64],
        velocity: NDArray[np.float64],
        rule_memory: NDArray[np.float64],
        weight_sum: NDArray[np.float64],
        trials: int,
        over: bool,
    ) -> None:
        """What training side by side has made of it."""
        self._weights[:] = weights
        self._velocity[:] = velocity
        self._rule_memory[:] = rule_memory
        self._weight_sum[:] = weight_sum
        self._trials, self.overflowed = trials, over

    # --- checkpoints -----------------------------------------------------------------------------

    def save(
        self,
        path: str | os.PathLike[str],
        *,
        task: Task | None = None,
        patterns: Patterns | None = None,
        rng: Generator | None = None,
    ) -> None:
        """Save to exactly this one file, whole or not at all, with what else is to be kept.

        Raises ValueError for what could not be loaded again.
        """
        checkpoint.save_agent(path, self, task=task, patterns=patterns, rng=rng)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Self:
        """Load an agent; ValueError if the file is missing, damaged or of another kind."""
        return checkpoint.load_agent(path, cls)

    @classmethod
    def rebuilt(cls, model: Any, rule: Any, n_inputs: int, weight_bounds: Bounds) -> Self:
        """A new agent of these parts."""
        return cls(model, rule, n_inputs, weight_bounds=weight_bounds)  # type: ignore[call-arg]

    def replaced(self, **changes: Any) -> Self:
        """A copy with other parameters of its model, such as alpha=0.2; the weights are kept.

        Raises ValueError for a parameter that the model does not have, or out of range.
        """
        known = [field.name for field in fields(self._model) if field.init]  # type: ignore[arg-type]
        unknown = sorted(set(changes) - set(known))
        if unknown:
            raise ValueError(
                f"a {type(self._model).__name__} has the parameters {', '.join(known)}, "
                f"got {unknown[0]!r}"
            )
        model = replace(self._model, **changes)  # type: ignore[type-var]
        agent = self.rebuilt(model, self._rule, self._n_inputs, self._weight_bounds)
        agent.weights, agent.velocity = self._weights, self._velocity
        agent.rule_memory = self._rule_memory
        agent.weight_sum = self._weight_sum
        agent.rng = copy.deepcopy(self.rng)
        agent._trials = self._trials
        return agent


_DERIVED = {"_loops", "_n_state", "_state", "_block", "_rule_block", "_heard", "_parts", "_bin"}
"""Attributes that `_prepare` makes of the others."""


def put(name: str, values: ArrayLike, place: NDArray[np.float64]) -> None:
    """Copy `values`, one for each or one for all, into `place`; ValueError if they do not fit."""
    array = _array(values)
    if array.dtype.kind not in "fiub":
        raise ValueError(f"{name} must be real numbers, got {array.dtype} values")
    if array.shape not in ((), place.shape):
        raise ValueError(f"{name} must have shape {place.shape}, got {array.shape}")
    array = array.astype(np.float64)
    require_finite(name, array)
    place[:] = array


def require_finite(name: str, values: NDArray[np.float64]) -> None:
    """ValueError unless all `values` are finite."""
    if not np.isfinite(values).all():
        bad = int(np.flatnonzero(~np.isfinite(np.atleast_1d(values)))[0])
        raise ValueError(
            f"{name} must be finite, got {np.atleast_1d(values)[bad]} for input {bad}; "
            "load an earlier checkpoint or start anew"
        )


def _array(values: Any) -> NDArray[Any]:
    """`values` as an array; rows of unequal length as one of objects, which no check lets pass."""
    try:
        return np.asarray(values)
    except ValueError:
        return np.empty(1, object)


def checked_begins(episode_start: Any, n: int) -> NDArray[np.bool_]:
    """Where streams begin anew, (n,); ValueError unless it says so, True or False, for each."""
    begins = np.atleast_1d(_array(episode_start))
    if begins.dtype.kind not in "biuf" or not np.isin(begins, (0, 1)).all():
        raise ValueError(
            f"episode_start must be True or False for each stream, got {shown(episode_start)}"
        )
    if begins.shape != (n,):
        raise ValueError(
            f"episode_start must have shape ({n},), one per stream, got {begins.shape}"
        )
    return begins.astype(np.bool_)


def _require_numbers(model: Model) -> None:
    """ValueError if what compiled code takes of the model's parameters is no number."""
    derived = dict(zip(model.parameters_type._fields, model.parameters(), strict=False))  # type: ignore[attr-defined]
    bad = [name for name, value in derived.items() if np.isnan(value)]
    if bad:
        raise ValueError(
            f"the parameters of {model!r} must give finite numbers, and {bad[0]} is none: "
            "choose values nearer to their defaults"
        )


_BITS = np.dtype(np.int8)  # compared in half the time that np.int8 takes


def bits_of(obs: Any) -> NDArray[np.int8]:
    """Observations as contiguous int8; ValueError unless they are 0 and 1 (int8 is believed)."""
    if type(obs) is np.ndarray and obs.dtype == _BITS and obs.flags.c_contiguous:
        return obs
    array = _array(obs)
    if array.dtype.kind not in "fiub" or not np.isin(array, (0, 1)).all():
        raise ValueError(
            "an observation must hold the bits of a bin, 0 and 1, as the environments give them; "
            f"got {array.dtype} values other than these: wrappers such as SynapticTrace are for "
            "reinforcement learning"
        )
    return np.ascontiguousarray(array, np.int8)


def _checked_state(state: Any, shape: tuple[int, ...]) -> NDArray[np.float64]:
    if not isinstance(state, tuple) or len(state) != 1:
        raise ValueError(
            f"state must be what predict returned, or None, got {type(state).__name__}"
        )
    states = _array(state[0])
    if states.dtype != np.float64 or states.shape != shape:
        raise ValueError(
            f"state must be what predict returned for as many streams, float64 of shape {shape}, "
            f"got {states.dtype} of shape {states.shape}"
        )
    if np.isnan(states).any():
        raise ValueError(
            "state must hold numbers, got NaN: it is not what predict returned, or a potential "
            "has overflowed; begin anew with None, or lower the weights"
        )
    return np.array(states, order="C")


def _checked_rule(rule: Any) -> Rule:
    if isinstance(rule, type) and issubclass(rule, Rule):
        raise ValueError(
            f"rule must be an instance, got the class {rule.__name__}; write {rule.__name__}()"
        )
    if not isinstance(rule, Rule):
        known = ", ".join(cls.__name__ for cls in registry.rules().values())
        raise ValueError(
            f"rule must be one of {known}, or a class of yours derived from Rule, got {rule!r}"
        )
    return rule


def _names(expected: type) -> str:
    known = (cls.__name__ for cls in registry.neurons().values() if issubclass(cls, expected))
    return ", ".join(known) or expected.__name__


def _agent_for(model: Model) -> str:
    for cls in registry.agents().values():
        if isinstance(model, cls.models):  # type: ignore[attr-defined]
            return cls.__name__
    return "an agent class of yours"


def _checked_bounds(bounds: Bounds) -> Bounds:
    if bounds is None:
        return None
    try:
        low, high = bounds
    except (TypeError, ValueError):
        raise ValueError(
            f"weight_bounds must be (lowest, highest) or None, got {bounds!r}"
        ) from None
    low = real("the lower weight bound", low, finite=False)
    high = real("the upper weight bound", high, finite=False)
    if not low < high:
        raise ValueError(
            f"weight_bounds must be (lowest, highest) with lowest < highest, got {bounds!r}; "
            "use None for no bounds"
        )
    return low, high
