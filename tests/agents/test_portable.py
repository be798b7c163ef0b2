"""Steps as a user writes them: the same bits at every width, or one sentence."""

from __future__ import annotations

import math
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, ClassVar, NamedTuple

import numpy as np
import pytest
from numba import njit

from agents import GNM, AggregateLabel, NeuronAgent, check_neuron
from agents.neurons.neuron import Neuron, PSPKernel, Response
from agents.portable import portable
from agents.simd import fitted, full, load, store, unpack, where

BINS = 40


class State(NamedTuple):
    V: Any
    count: Any


class Parameters(NamedTuple):
    alpha: Any
    theta: Any


def signs(p: Any, static: Any, state: Any, current: Any) -> Any:
    V = +state.V * 0.7 + current
    up = max(V, 0, p.alpha, 0.2)
    low = min(-V, 0.5, 1, p.alpha)
    spike = up >= p.theta
    return State(abs(V) - np.abs(low) + math.fabs(low), low), Response(V, up, 0, V, spike, spike)


def powers(p: Any, static: Any, state: Any, current: Any) -> Any:
    V = state.V * 0.5 + current
    V **= 2
    grown = 1.5**V + p.alpha**V + abs(V) ** p.alpha + V**2
    spike = grown > 3
    return State(0 if spike else V, grown), Response(V, grown, 0, V, spike, spike)


def truths(p: Any, static: Any, state: Any, current: Any) -> Any:
    V = state.V * 0.7 + current
    spike = V >= p.theta and True and not state.count
    spike |= V > 3
    other = (V > 0.5) ^ (0 < V < 1)
    V = V * (1 - spike) + 0.1 * other
    return State(0.25 if state.count else V, spike), Response(V, spike, True, V, spike, spike * 1.0)


def plain(p: Any, static: Any, state: Any, current: Any) -> Any:
    V, count = state
    V = V * math.exp(-1) + current + 1 // 2
    spike = True if V >= 1 else False  # noqa: SIM210
    count = 3 if spike else (count - 1 if count > 0 else 0)
    return (0 if spike and count == 3 else V, 1), Response(V, 0, count, V, spike, 1 if spike else 0)


def run_alone(step: Any, alpha: float, heard: Any) -> Any:
    """In plain Python: V, D, the spike and the second variable, bin by bin."""
    p, state, rows = SimpleNamespace(alpha=alpha, theta=1.0), State(0.0, 0.0), []
    for current in heard:
        after, response = step(p, (0,), state, float(current))
        state = State(*map(float, after))
        rows.append((response.V, float(response.D), bool(response.spike), *state))
    return np.array(rows, float)


def run_compiled(function: Any, alpha: Any, heard: Any) -> Any:
    step, width = portable(function), heard.shape[1]

    @njit
    def run(parameters: Any, heard: Any, rows: Any) -> None:
        zero = full(0.0, width)
        silent = zero > zero
        state = State(zero, zero)
        p = unpack(Parameters, parameters, zero)
        for t in range(len(heard)):
            after, response = step(p, (0,), state, load(heard, t, zero))
            state = fitted(after, state)
            fit = fitted(response, Response(zero, zero, zero, zero, silent, silent))
            store(rows, 5 * t, fit.V)
            store(rows, 5 * t + 1, fit.D)
            store(rows, 5 * t + 2, where(fit.spike, 1.0, zero))
            store(rows, 5 * t + 3, state.V)
            store(rows, 5 * t + 4, state.count)

    rows = np.zeros((5 * BINS, width))
    run(np.stack([alpha, np.ones(width)]), np.ascontiguousarray(heard), rows)
    return rows.reshape(BINS, 5, width)


@pytest.mark.parametrize("step", [signs, powers, truths, plain])
def test_a_step_as_a_user_writes_it_means_what_python_means_with_the_same_bits_at_every_width(
    step: Any,
) -> None:
    rng = np.random.default_rng(0)
    heard, alpha = rng.normal(0.4, 0.8, (BINS, 32)), rng.uniform(0.1, 0.9, 32)
    in_python = np.stack([run_alone(step, alpha[k], heard[:, k]) for k in range(32)], axis=-1)
    assert 0 < in_python[:, 2].sum() < in_python[:, 2].size
    together = run_compiled(step, alpha, heard)
    np.testing.assert_allclose(together, in_python, rtol=1e-12)  # Python's x**2 is not x·x
    for width in (1, 8):
        for part in (slice(0, width), slice(32 - width, 32)):
            got = run_compiled(step, alpha[part], heard[:, part])
            np.testing.assert_array_equal(got, together[..., part])


@dataclass(frozen=True)
class Mended(Neuron):
    """What the steps below are steps of."""

    alpha: float = 0.3
    theta: float = 1.0
    default_initial_weight: ClassVar[float] = 0.1
    state_type: ClassVar[type] = State

    def psp_kernel(self) -> PSPKernel:
        return PSPKernel(0.7)


def neuron_of(step: Any) -> Any:
    body = {"name": f"step-{step.__name__}", "step": staticmethod(step), "__module__": __name__}
    return dataclass(frozen=True)(type(step.__name__, (Mended,), body))()


def answers_alone(p: Any, static: Any, state: Any, current: Any) -> Any:
    return State(current, 0)


def clipped(p: Any, static: Any, state: Any, current: Any) -> Any:
    V = np.clip(current, 0.0, 1.0)
    return State(V, 0), Response(V, V, V, V, V > 1.0, V > 1.0)


def joined(p: Any, static: Any, state: Any, current: Any) -> Any:
    V = current > 0 and state.V
    return State(V, 0), Response(V, V, V, V, V > 1.0, V > 1.0)


def halved(x: float) -> float:
    return 0.5 * x


def helped(p: Any, static: Any, state: Any, current: Any) -> Any:
    V = halved(state.V) + current
    return State(V, 0), Response(V, V, V, V, V > 1.0, V > 1.0)


def replaced(p: Any, static: Any, state: Any, current: Any) -> Any:
    return state._replace(V=current), Response(current, 0, 0, current, current > 1, current > 1)


def named_within(p: Any, static: Any, state: Any, current: Any) -> Any:
    spike = (V := state.V + current) > 1.0
    return State(V, 0), Response(V, V, V, V, spike, spike)


def written_into(p: Any, static: Any, state: Any, current: Any) -> Any:
    state.V = current
    return state, Response(current, 0, 0, current, current > 1, current > 1)


@pytest.mark.parametrize(
    ("step", "told"),
    [
        (answers_alone, r"`answers_alone` .*: a step returns its new state and a Response"),
        (clipped, r"`V = np.clip\(.*: clip is for arrays; write min\(max\(x, low\), high\)"),
        (joined, r"`V = current > 0 and .*: and, or join conditions; write x != 0.0"),
        (helped, r"`V = halved.*: halved is not compiled: from agents.portable import portable"),
        (replaced, r"`return state._replace.*: name every field of the new state, State\(V=…\)"),
        (named_within, r"`spike = \(V := .*give names their values in lines of their own"),
        (written_into, r"`written_into` .*: nothing can be written into a State; make a new one"),
    ],
    ids=lambda value: getattr(value, "__name__", ""),
)
def test_a_step_that_cannot_be_compiled_is_told_its_line_and_what_to_write(
    step: Any, told: str
) -> None:
    with pytest.raises(ValueError, match=r"test_portable.py, line \d+, " + told) as refusal:
        check_neuron(neuron_of(step))
    assert "\n" not in str(refusal.value)


def test_a_neuron_without_one_of_its_parts_is_told_which() -> None:
    for missing in ("state_type", "default_initial_weight", "step"):
        whole = {"name": f"no-{missing}", "step": staticmethod(signs), "__module__": __name__}
        parts = {**whole, "state_type": State, "default_initial_weight": 0.1}
        del parts[missing]
        parts["psp_kernel"] = Mended.psp_kernel
        incomplete = dataclass(frozen=True)(type("Incomplete", (Neuron,), parts))
        with pytest.raises(ValueError, match=f"the class Incomplete needs {missing}"):
            NeuronAgent(incomplete(), AggregateLabel(), 10)


def test_a_neuron_without_a_kernel_is_told_to_have_one() -> None:
    parts = {"name": "no-kernel", "step": staticmethod(signs), "__module__": __name__}
    parts |= {"state_type": State, "default_initial_weight": 0.1}
    without = dataclass(frozen=True)(type("Without", (Neuron,), parts))
    with pytest.raises(ValueError, match="Without to one unit spike: give it a method psp_kernel"):
        NeuronAgent(without(), AggregateLabel(), 10)


def test_a_helper_may_be_portable_too() -> None:
    assert portable(halved)(GNM().alpha) == 0.15
