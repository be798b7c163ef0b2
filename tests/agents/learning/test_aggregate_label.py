"""ALL: the inputs with the highest eligibility change by ±λ, worked out by direct double sums."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import Any

import numpy as np
import pytest
from numba import njit
from numpy.typing import NDArray

from agents import GNM, LIF, MST, AggregateLabel, NeuronAgent, record, train
from agents.learning.aggregate_label import nth_largest
from agents.neurons.neuron import Neuron
from agents.simd import full, store
from gnm_env import Patterns, Task, Trial, draw_trial
from tests.agents import reference
from tests.agents.worlds import BUSY, BUSY_PATTERNS, BUSY_WEIGHT, play, trial_env

LAMBDA = 0.01


def plain_trace(neuron: Neuron, raster: NDArray[np.bool_], weights: Any) -> reference.Trace:
    drive = reference.drives(raster, weights)
    if isinstance(neuron, GNM):
        return reference.gnm(drive, **asdict(neuron))
    if isinstance(neuron, LIF):
        return reference.lif(drive, **asdict(neuron))
    assert isinstance(neuron, MST)
    return reference.mst(raster, weights, **asdict(neuron))


def own_kernel(neuron: Neuron, n_bins: int) -> NDArray[np.float64]:
    """The neuron's response to one unit spike, resets and R left out."""
    if isinstance(neuron, MST):
        return reference.mst_kernel(np.arange(n_bins), neuron.tau_m, neuron.tau_s)
    eta = neuron.eta if isinstance(neuron, GNM) else 0.0
    assert isinstance(neuron, (GNM, LIF))
    return reference.decay_kernel(1.0 - (1.0 - eta) * neuron.alpha, n_bins)


@pytest.mark.parametrize(
    ("neuron", "trace_decay", "bounds"),
    [
        (GNM(), None, (0.0, 1.0)),
        (GNM(), 0.0, (0.0, 1.0)),
        (GNM(), 0.3, (0.0, 1.0)),
        (GNM(), 1.0, None),
        (GNM(alpha=0.5, readout="D", theta_r=0.3), None, None),
        (GNM(eta=0.5), None, (0.0, 1.0)),
        (MST(), None, (0.0, 1.0)),
        (MST(), None, None),
    ],
    ids=str,
)
def test_the_inputs_with_the_highest_eligibility_change_by_one_step(
    neuron: Neuron, trace_decay: float | None, bounds: tuple[float, float] | None
) -> None:
    rule = AggregateLabel(learning_rate=LAMBDA, fraction=0.25, trace_decay=trace_decay)
    rng, signs = np.random.default_rng(1), []
    for _ in range(25):
        trial = draw_trial(BUSY, BUSY_PATTERNS, rng)
        agent = NeuronAgent(neuron, rule, BUSY.n_inputs, weight_bounds=bounds)
        weights = rng.random(BUSY.n_inputs) * BUSY_WEIGHT[neuron.name]
        if bounds is None:  # some inputs inhibit, some eligibilities are negative
            weights -= 0.15 * BUSY_WEIGHT[neuron.name]
        agent.weights = weights
        spikes = play(agent, trial)

        raster = trial.dense()
        expected = plain_trace(neuron, raster, weights)
        assert np.array_equal(spikes, expected.spikes)
        kernel = (
            own_kernel(neuron, trial.n_bins)
            if trace_decay is None
            else reference.decay_kernel(trace_decay, trial.n_bins)
        )
        eligibility = reference.eligibilities(raster, kernel, expected.V)
        sign = np.sign(trial.label - spikes.sum())
        change = np.where(reference.top(eligibility, 3), sign * LAMBDA, 0.0)
        assert np.array_equal(agent.velocity, change)
        assert np.array_equal(agent.weights, np.clip(weights + change, *(bounds or (-9.0, 9.0))))
        signs.append(sign)
    assert {-1, 1} <= set(signs), "the trials should ask for more as well as for less"


def lone_spikes(channels: list[int], n_inputs: int = 4) -> Trial:
    """20 bins; each channel named spikes once, all in bin 3; one occurrence is owed one spike."""
    raster = np.zeros((20, n_inputs), np.bool_)
    raster[3, channels] = True
    return Trial.from_dense(raster, [10], [0], Task(n_inputs=n_inputs, pattern_bins=5))


@pytest.mark.parametrize(
    ("fraction", "channels", "changed"),
    [
        (0.25, [2], [2]),  # k = 1, one eligible
        (0.25, [0, 2], []),  # k = 1, a tie for the first place: neither is above the second largest
        (0.5, [0, 2], [0, 2]),  # k = 2
        (0.75, [0, 1, 2, 3], []),  # all equal: none is above the fourth
        (0.75, [0, 2], [0, 2]),  # k = 3, but ε = 0 is not above the fourth largest, 0
        (1.0, [0, 2], [0, 1, 2, 3]),  # k = N: all, eligible or not
    ],
)
def test_only_inputs_strictly_above_the_next_one_change(
    fraction: float, channels: list[int], changed: list[int]
) -> None:
    agent = NeuronAgent(GNM(), AggregateLabel(LAMBDA, fraction=fraction), 4)
    agent.weights = 0.1
    play(agent, lone_spikes(channels))
    assert np.flatnonzero(agent.velocity).tolist() == changed
    assert set(agent.velocity[changed]) <= {LAMBDA}


@pytest.mark.parametrize("fraction", [0.5, 0.97])
def test_a_large_fraction_of_many_inputs_is_found_as_sorting_finds_it(fraction: float) -> None:
    task = Task(n_inputs=130, rate=0.05, pattern_bins=10, background_bins=60)
    trial = draw_trial(task, Patterns.draw(task, 0), np.random.default_rng(0))
    agent = NeuronAgent(GNM(), AggregateLabel(LAMBDA, fraction=fraction), 130, initial_weight=0.01)
    weights = agent.weights.copy()
    play(agent, trial)
    V = plain_trace(agent.neuron, trial.dense(), weights).V
    eligibility = reference.eligibilities(trial.dense(), own_kernel(agent.neuron, len(V)), V)
    chosen = reference.top(eligibility, round(fraction * 130))
    assert 0 < chosen.sum() <= round(fraction * 130)
    assert np.array_equal(agent.velocity > 0, chosen)


def bars(values: NDArray[np.float64], places: list[int]) -> NDArray[np.float64]:
    """What `nth_largest` gives for each place, (places, width)."""
    width = values.shape[1]

    @njit(error_model="numpy")
    def bar(values: NDArray[np.float64], static: Any, out: NDArray[np.float64]) -> None:
        zero = full(0.0, width)
        store(out, 0, nth_largest(values, static, zero == zero, zero))

    found = np.empty((len(places), width))
    for row, n in enumerate(places):
        static = AggregateLabel(fraction=n / len(values)).static(len(values)) if n else (0,)
        bar(values, static, found[row : row + 1])
    return found


@pytest.mark.parametrize("width", [1, 8])
@pytest.mark.parametrize("kind", ["ties", "spread", "all equal", "sample lies", "infinite"])
def test_the_same_values_lie_above_the_bar_as_above_the_one_that_sorting_finds(
    kind: str, width: int
) -> None:
    rng = np.random.default_rng(2)
    for n_values in (103, 256, 1_000):
        values = rng.integers(-20, 20, (n_values, width)) / 8
        if kind == "spread":
            values = rng.lognormal(0.0, 3.0, (n_values, width))
        elif kind == "all equal":
            values[:] = 0.5
        elif kind == "sample lies":  # every value in a sample is among the highest, or the lowest
            values[:: n_values // 80 + 1] += np.where(np.arange(width) % 2, 100.0, -100.0)
        elif kind == "infinite":
            values[rng.random(values.shape) < 0.3] = np.inf
            values[rng.random(values.shape) < 0.3] = -np.inf
        places = [0, 1, 9, 20, 21, 47, 75, 100, n_values // 2, n_values - 2, n_values - 1]
        in_order = -np.sort(-values, axis=0)
        for n, found in zip(places, bars(values, places), strict=True):
            assert np.array_equal(values > found, values > in_order[n]), (n_values, n)


def test_nothing_changes_when_the_sum_is_right_the_momentum_included() -> None:
    """Even where the timing is all wrong: ALL does not know it."""
    agent = NeuronAgent(GNM(), AggregateLabel(LAMBDA), BUSY.n_inputs, initial_weight=0.6)
    agent.velocity[:] = 0.125
    weights = agent.weights.copy()
    trial = draw_trial(BUSY, BUSY_PATTERNS, np.random.default_rng(0))
    emitted = int(record(agent, trial).spikes.sum())
    assert emitted > 0
    play(agent, trial, label=emitted)
    assert np.array_equal(agent.weights, weights)
    assert (agent.velocity == 0.125).all()


def test_feedback_by_sign_gives_the_same_bits_as_by_cost_from_the_reward_alone() -> None:
    """Under "sign" the label in the info is a lie, and the timing is missing altogether."""

    class Lying:
        def __init__(self) -> None:
            self.unwrapped = (env := trial_env(feedback="sign")).unwrapped
            self.reset, self._step = env.reset, env.step

        def step(self, action: int) -> Any:
            obs, reward, terminated, truncated, info = self._step(action)
            if terminated:
                info = {"label": -7, "emitted": 3}
            return obs, reward, terminated, truncated, info

    rule = AggregateLabel(LAMBDA, fraction=0.25)
    told, lied_to = (NeuronAgent(GNM(), rule, BUSY.n_inputs, initial_weight=0.6) for _ in range(2))
    before = told.weights.copy()
    train(told, trial_env(feedback="cost"), trials=60, seed=3)
    train(lied_to, Lying(), trials=60, seed=3)  # type: ignore[arg-type]
    assert not np.array_equal(before, told.weights)
    assert np.array_equal(told.weights, lied_to.weights)
    assert np.array_equal(told.velocity, lied_to.velocity)


def test_the_reward_is_not_looked_at_where_the_label_is_known() -> None:
    trial = draw_trial(BUSY, BUSY_PATTERNS, np.random.default_rng(1))
    agents = [NeuronAgent(GNM(), AggregateLabel(LAMBDA), BUSY.n_inputs) for _ in range(2)]
    play(agents[0], trial)
    play(agents[1], trial, reward=1e9)
    assert agents[0].velocity.any()
    assert np.array_equal(agents[0].velocity, agents[1].velocity)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"learning_rate": -1e-4}, r"learning_rate must be >= 0, got -0.0001"),
        ({"learning_rate": float("nan")}, r"learning_rate must be finite, got nan"),
        ({"momentum": 1.5}, r"momentum must be in 0 … 1, got 1.5"),
        ({"fraction": 1.5}, r"fraction must be in 0 … 1, got 1.5"),
        ({"trace_decay": -0.1}, r"trace_decay must be in 0 … 1, got -0.1"),
    ],
)
def test_a_bad_parameter_is_refused_by_name_value_and_remedy(
    fields: dict[str, float], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        AggregateLabel(**fields)


@pytest.mark.parametrize(("fraction", "n_inputs"), [(0.0, 100), (0.1, 4), (0.005, 100)])
def test_a_fraction_that_is_no_input_at_all_is_refused_with_one_that_is(
    fraction: float, n_inputs: int
) -> None:
    rule = AggregateLabel(fraction=fraction)
    with pytest.raises(ValueError, match=r"nothing would be learned: choose fraction >= ") as error:
        NeuronAgent(GNM(), rule, n_inputs)
    least = float(str(error.value).rsplit(">= ", 1)[1])
    NeuronAgent(GNM(), replace(rule, fraction=least), n_inputs)
