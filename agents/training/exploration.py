"""Output spikes that are drawn while a rule learns, each agent from its own generator.

Compiled code draws what `Generator.random` of NumPy's PCG64 draws, from its state: 128 bits as two
numbers, and as many of the increment. For many agents side by side that is several times as fast as
to ask as many generators.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numpy.random import Generator
from numpy.typing import NDArray

from agents.learning.rule import Outcome
from agents.simd import any_lane, full, lanes_of, load, next_lane, store, unpack, where
from agents.training.slots import (
    THRESHOLD,
    USES_OUTPUT,
    WIDTH,
    OwnNumbers,
    spike_probability,
)
from agents.training.stepwise import TrialSoFar
from agents.training.trial import N_COMMON, ModelBlock, RuleBlock, TrialLog
from gnm_env.compiled import compiled
from gnm_env.segments import TrialArrays

MULTIPLIER = 0x2360ED051FC65DA44385DF649FCCF645
"""Of PCG64."""
_LOW = 2**64 - 1


def state_of(rng: Generator | None) -> list[int]:
    """State and increment of a PCG64, two numbers of 64 bits each; zeros if there is none."""
    if rng is None:
        return [0, 0, 0, 0]
    state = rng.bit_generator.state["state"]
    return [state["state"] >> 64, state["state"] & _LOW, state["inc"] >> 64, state["inc"] & _LOW]


def put_state(rng: Generator, numbers: NDArray[np.uint64]) -> None:
    """The reverse of `state_of`, into `rng`."""
    state: Any = rng.bit_generator.state
    high, low = int(numbers[0]), int(numbers[1])
    state["state"]["state"] = high << 64 | low
    rng.bit_generator.state = state


_intrinsic: Any = intrinsic  # called from compiled code, without the typing context


@_intrinsic
def _moved_on(typing_context: Any, high: Any, low: Any, inc_high: Any, inc_low: Any) -> Any:
    """state·MULTIPLIER + increment, in 128 bits."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        wide = ir.IntType(128)
        half = ir.Constant(wide, 64)

        def joined(top: Any, bottom: Any) -> Any:
            top = builder.shl(builder.zext(top, wide), half)
            return builder.or_(top, builder.zext(bottom, wide))

        product = builder.mul(joined(args[0], args[1]), ir.Constant(wide, MULTIPLIER))
        state = builder.add(product, joined(args[2], args[3]))
        halves = [builder.lshr(state, half), state]
        numbers = [builder.trunc(number, ir.IntType(64)) for number in halves]
        return context.make_tuple(builder, sig.return_type, numbers)

    return types.UniTuple(types.uint64, 2)(*[types.uint64] * 4), generate


@compiled
def next_uniform(state: NDArray[np.uint64], lane: int) -> float:
    """The next uniform number in 0 … 1 of one lane; `state` (4, WIDTH) is moved on."""
    high, low = _moved_on(state[0, lane], state[1, lane], state[2, lane], state[3, lane])
    state[0, lane], state[1, lane] = high, low
    turn = high >> np.uint64(58)
    mixed = high ^ low
    bits = (mixed >> turn) | (mixed << ((np.uint64(64) - turn) & np.uint64(63)))
    return (bits >> np.uint64(11)) * (1.0 / 9007199254740992.0)


def explore_trial_template(
    rule: RuleBlock,
    model: ModelBlock,
    trial: TrialArrays,
    log: TrialLog,
    state: NDArray[np.uint64],
) -> Outcome:
    """Draw the output of a trial that has been heard: `log` and its Outcome are those of the draw.

    For neurons that take no notice of their own output. See `explore_bin_template`.
    """
    zero = full(0.0, WIDTH)
    own = unpack(OwnNumbers, rule.parameters[N_COMMON:], zero)
    threshold = load(model.parameters, THRESHOLD, zero)
    # First all probabilities: among the branches of the second loop they would cost far more.
    for t in range(trial.edges[len(trial.edges) - 1]):
        store(log.readout, t, spike_probability(own, load(log.V, t, zero), threshold))
    bars = np.empty((1, WIDTH))
    for lane in range(WIDTH):
        bars[0, lane] = next_uniform(state, lane)
    bar = load(bars, 0, zero)
    silence = full(1.0, WIDTH)
    emitted = zero
    owed = 0
    for segment in range(len(trial.target)):
        given = zero
        for t in range(trial.edges[segment], trial.edges[segment + 1]):
            probability = load(log.readout, t, zero)
            silence = silence * (1.0 - probability)
            fires = silence <= bar
            if USES_OUTPUT:
                store(log.output, t, where(fires, 1.0, zero))
            if any_lane(fires):
                z = where(fires, 1.0, zero)
                store(log.readout, t, probability - z)
                given = given + z
                left = lanes_of(fires)
                while left != 0:
                    lane = next_lane(left)
                    bars[0, lane] = next_uniform(state, lane)
                    left &= left - 1
                bar = load(bars, 0, zero)
                silence = where(fires, 1.0, silence)
        store(log.counts, segment, given)
        emitted = emitted + given
        owed += trial.target[segment]
    return Outcome(emitted, full(float(owed), WIDTH), emitted != float(owed))


def explore_bin_template(
    rule: RuleBlock, model: ModelBlock, heard: TrialSoFar, t: int, silence: NDArray[np.float64]
) -> float:
    """As `explore_trial`, one bin of one neuron: its output z, and P − z, noted in `heard`.

    `silence` is (S, u): the probability Π(1 − P) that there would have been no spike since the last
    one, or since the trial began, and a uniform number. The spike comes in the first bin in which S
    is u or less, which has probability 1 − S; then both are drawn anew. So the odds are those of a
    draw in each bin, for one random number a spike.
    """
    own = unpack(OwnNumbers, rule.parameters[N_COMMON:], 0.0)
    probability = spike_probability(own, heard.V[t, 0], model.parameters[THRESHOLD, 0])
    silence[0] = silence[0] * (1.0 - probability)
    out = 1.0 if silence[0] <= silence[1] else 0.0
    heard.readout[t, 0] = probability - out
    heard.output[t, 0] = out
    return out
