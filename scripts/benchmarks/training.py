"""Speed of training: many neurons side by side, one alone, two threads, a whole heat map."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache, partial
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

import gnm_env  # noqa: F401  registers the environments
from agents import (
    GNM,
    LIF,
    MPDAL,
    MST,
    MSTDPET,
    PSD,
    SPAN,
    STDP,
    AggregateLabel,
    Chronotron,
    CriticalThreshold,
    ErrorTrace,
    NeuronAgent,
    PeakError,
    PolicyGradient,
    ReSuMe,
    SurrogateGradient,
    noisy_performance,
    train,
    train_many,
)
from agents.learning.rule import Rule
from agents.neurons.neuron import Neuron
from benchmarks.rows import Findings, Row, Target, rate_rows
from benchmarks.timing import Settings, Skip, Subject, race
from gnm_env import Patterns, Task
from gnm_env.generators import Generators
from gnm_env.rules import MAX_EPISODE_BINS, RUNS
from gnm_env.task import task_arrays
from gnm_env.trial import draw_next

LANES = 64
GRID = 41
"""Values of α, and of η, in a heat map: k / 40."""
MAP_SEEDS = 5
TRIALS = 60_000
"""Length of a training in the paper."""
MAP_PART = {False: 393, True: 65}
"""Cells per pattern seed that stand for the 1,681, quick or not. Two threads share them less evenly
than the 1,681, so that the estimate is rather too long."""
"""The paper's measure: streams, and most bins of each."""

Make = Callable[[], list[Any]]


_GNM, _ALL = GNM(), AggregateLabel()


@cache
def bins(task: Task, trials: int, seed: int) -> int:
    """Bins in the first `trials` trials of the stream of `seed`, counted."""
    return sum(trial_bins(task, trials, seed).tolist())


def trial_bins(task: Task, trials: int, seed: int) -> NDArray[np.int64]:
    """Bins of each of these trials, (trials,)."""
    numbers = task_arrays(task, Patterns.draw(task, 0))
    generators = Generators([np.random.default_rng(seed)])
    lengths = (draw_next(task, numbers, generators).n_bins for _ in range(trials))
    return np.fromiter(lengths, np.int64, trials)


def neurons(
    neuron: Neuron = _GNM,
    rule: Rule = _ALL,
    n: int = LANES,
    n_inputs: int = 100,
    bounds: tuple[float, float] | None = (0.0, 1.0),
) -> list[NeuronAgent]:
    """`n` neurons that differ in their initial weights."""
    return [
        NeuronAgent(neuron, rule, n_inputs, seed=seed, weight_bounds=bounds) for seed in range(n)
    ]


def learning(
    name: str, make: Make, task: Task, trials: int, seed: int, threads: int = 1
) -> Subject:
    """`train_many` with the agents that `make` gives; the work is counted in neuron-bins."""
    patterns = Patterns.draw(task, 0)
    lanes = len(make())
    return Subject(
        name,
        lambda agents: train_many(agents, task, patterns, trials, seed, threads),
        lanes * bins(task, trials, seed),
        make,
        lambda: train_many(make(), task, patterns, 2, seed, threads),
        threads,
    )


def side_by_side(settings: Settings) -> Findings:
    """Every neuron and rule, 64 neurons on one stream."""
    section = f"Training, {LANES} neurons on one stream"
    one, two = Task(), Task(n_classes=2)
    gnm = GNM()
    kinds: dict[str, tuple[Neuron, Rule, Task, Target]] = {
        "GNM η=0, ALL": (gnm, AggregateLabel(), one, Target(700, aim=1_000)),
        "GNM η=0, ALL, C=2": (gnm, AggregateLabel(), two, Target(600)),
        "GNM η=0.5 h=200, ALL": (GNM(eta=0.5), AggregateLabel(), one, Target(350)),
        "GNM η=0, ET": (gnm, ErrorTrace(), one, Target(500)),
        "GNM η=0, ET modulated": (gnm, ErrorTrace(modulate=True), one, Target(500)),
        "LIF refractory 0, ALL": (LIF(), AggregateLabel(), one, Target(500)),
        "MST, ALL": (MST(), AggregateLabel(), one, Target(300)),
    }
    subjects = [
        learning(name, partial(neurons, neuron, rule), task, settings.trials, settings.seed)
        for name, (neuron, rule, task, _) in kinds.items()
    ]
    targets = {name: (target,) for name, (*_, target) in kinds.items()}
    timings = race(subjects, settings)
    return Findings(rows=rate_rows(section, timings, against="GNM η=0, ALL", targets=targets))


def rules(settings: Settings) -> Findings:
    """Every rule beside ALL, 64 neurons on one stream of full length, one class.

    What a rule costs depends on how often it finds something wrong, and so on how well it has
    learned: only whole trainings compare. Tempotron is left out: the task owes it too many spikes.
    """
    first, as_fast, slower = "ALL", Target(1.0, "ratio"), Target(0.4, "ratio")
    free: dict[str, tuple[Neuron, Rule, Target]] = {
        "CriticalThreshold": (GNM(), CriticalThreshold(), as_fast),
        "CriticalThreshold, amount": (GNM(), CriticalThreshold(amount=True), slower),
        "CriticalThreshold, MST": (MST(), CriticalThreshold(), Target(0.1, "ratio")),
        "PeakError": (GNM(), PeakError(), as_fast),
    }
    others = (
        MPDAL(), SurrogateGradient(), SurrogateGradient(on_count=True), ReSuMe(), PSD(), SPAN(),
        Chronotron(), Chronotron(rule="I"), MSTDPET(), PolicyGradient(),
    )  # fmt: skip
    for rule in others:
        variant = {"surrogate": ", count", "chronotron": ", I"}.get(rule.name, "")
        name = type(rule).__name__ + (variant if type(rule).__name__ in free else "")
        free[name] = (GNM(), rule, slower)
    makes: dict[str, Make] = {
        name: partial(neurons, neuron, rule, bounds=None)
        for name, (neuron, rule, _) in free.items()
    }
    makes[first] = neurons
    makes["STDP"] = partial(neurons, rule=STDP())
    trials = settings.trials if settings.quick else TRIALS
    subjects = [learning(name, make, Task(), trials, settings.seed) for name, make in makes.items()]
    targets = {name: (target,) for name, (*_, target) in free.items()} | {"STDP": (slower,)}
    section, timings = f"Rules, {LANES} neurons on one stream", race(subjects, settings)
    return Findings(rows=rate_rows(section, timings, against=first, targets=targets))


def alone(settings: Settings) -> Findings:
    """Every neuron and rule, one agent; ratios within which the paper's neurons are to stay."""
    section = "Training, one neuron alone"
    first = "GNM η=0, ALL"
    fast = Target(80)
    half_more, twice = Target(1 / 1.5, "ratio"), Target(1 / 2, "ratio")
    kinds: dict[str, tuple[Neuron, Rule, tuple[Target, ...]]] = {
        first: (GNM(), AggregateLabel(), (fast,)),
        "GNM η=0.5 h=200, ALL": (GNM(eta=0.5), AggregateLabel(), (fast, twice)),
        "GNM η=0, ET": (GNM(), ErrorTrace(), (fast, half_more)),
        "GNM η=0, ET modulated": (GNM(), ErrorTrace(modulate=True), (fast, half_more)),
        "LIF refractory 0, ALL": (LIF(), AggregateLabel(), (fast, half_more)),
        "MST, ALL": (MST(), AggregateLabel(), (fast, half_more)),
    }
    subjects = [
        learning(name, partial(neurons, neuron, rule, 1), Task(), TRIALS, settings.seed)
        for name, (neuron, rule, _) in kinds.items()
    ]
    targets = {name: target for name, (*_, target) in kinds.items()}
    timings = race(subjects, settings)
    return Findings(rows=rate_rows(section, timings, against=first, targets=targets))


NETWORKS = 32
"""Networks side by side."""


def network(settings: Settings) -> Findings:
    """The network with 10 hidden neurons, by backpropagation, alone and side by side."""
    try:
        from agents.network import BackPropagation, Network, NetworkAgent
    except ImportError as error:
        raise Skip(f"agents.network cannot be imported: {error}") from None

    def make(n: int) -> list[Any]:
        rule = BackPropagation()
        return [NetworkAgent(Network(), rule, Task().n_inputs, seed=seed) for seed in range(n)]

    cases = {
        "10 hidden, BP, one class": (partial(make, 1), Target(6.0)),
        f"the same, {NETWORKS} networks side by side, each": (
            partial(make, NETWORKS),
            Target(0.4, aim=0.2),
        ),
    }
    return _per_training(settings, cases)


def continuous(settings: Settings) -> Findings:
    """The neuron in continuous time, exact (η = 0), alone and side by side."""
    try:
        from agents.continuous import ContinuousAgent, ContinuousGNM
    except ImportError as error:
        raise Skip(f"agents.continuous cannot be imported: {error}") from None

    def make(n: int) -> list[Any]:
        neuron, rule, n_inputs = ContinuousGNM(), AggregateLabel(), Task().n_inputs
        return [ContinuousAgent(neuron, rule, n_inputs, seed=seed) for seed in range(n)]

    cases: dict[str, tuple[Make, Target | None]] = {
        "continuous GNM η=0, ALL": (partial(make, 1), None),
        f"the same, {LANES} neurons side by side, each": (partial(make, LANES), None),
    }
    return _per_training(settings, cases)


def _per_training(settings: Settings, cases: Mapping[str, tuple[Make, Target | None]]) -> Findings:
    """Seconds for a whole training of 60,000 trials, on average as long as trials are."""
    task = Task()
    trials = settings.trials // 10 if settings.quick else settings.trials
    whole = TRIALS * (task.background_bins + task.mean_pattern_bins)
    subjects = [
        learning(name, make, task, trials, settings.seed) for name, (make, _) in cases.items()
    ]
    rows = []
    for name, timing in race(subjects, settings).items():
        target = cases[name][1]
        rows.append(
            Row(
                "Training, network and continuous time",
                name,
                f"s per {TRIALS:,} trials",
                tuple(seconds * whole for seconds in timing.seconds),
                more_is_better=False,
                targets=(target,) if target else (),
                cpu_share=timing.cpu_share,
            )
        )
    return Findings(rows=rows)


def loop(settings: Settings) -> Findings:
    """The standard Gymnasium loop with a GNM, through `gym.make` and its wrappers."""
    trials = 100 if settings.quick else 500
    env = gym.make("gnm/PatternTrial-v0", n_classes=1)
    subject = Subject(
        "agents.train, GNM η=0, ALL",
        lambda agent: train(agent, env, trials, settings.seed),
        bins(Task(), trials, settings.seed),
        lambda: NeuronAgent(GNM(), AggregateLabel(), Task().n_inputs),
    )
    timings, targets = race([subject], settings), {subject.name: (Target(150_000),)}
    return Findings(rows=rate_rows("Standard loop", timings, "steps/s", 1.0, targets=targets))


def grid(n: int = GRID**2, seed: int = 0) -> list[NeuronAgent]:
    """`n` neurons spread evenly over the 41 × 41 map of (α, η)."""
    places = np.linspace(0, GRID**2 - 1, n).round().astype(int)
    return [
        NeuronAgent(
            GNM(alpha=place % GRID / (GRID - 1), eta=place // GRID / (GRID - 1)),
            AggregateLabel(),
            Task().n_inputs,
            seed=seed,
        )
        for place in places.tolist()
    ]


def threads(settings: Settings) -> Findings:
    """Two threads on two cores beside one on one, for the 1,681 neurons of a heat map."""
    if settings.cores.count < 2:
        raise Skip("two threads need two physical cores, this process has one")
    trials = 100 if settings.quick else 2_000
    one, two = f"{GRID**2:,} neurons, one thread", f"{GRID**2:,} neurons, two threads, two cores"
    subjects = [
        learning(one, grid, Task(), trials, settings.seed),
        learning(two, grid, Task(), trials, settings.seed, threads=2),
    ]
    timings, targets = race(subjects, settings), {two: (Target(1.8, "ratio"),)}
    return Findings(rows=rate_rows("Threads", timings, against=one, targets=targets))


def heat_map(settings: Settings) -> Findings:
    """Minutes for a heat map: 8,405 trainings of full length and their scores, on two cores.

    Repeat k does an even part of the map of pattern seed k, which is scaled up. With
    `settings.full` the whole map is done once, all five pattern seeds.
    """
    n_cores = min(2, settings.cores.count)
    cells = GRID**2 if settings.full else MAP_PART[settings.quick]
    seeds = range(MAP_SEEDS if settings.full else settings.repeats)
    once = replace(settings, repeats=1)
    timings = []
    for pattern_seed in seeds:
        subject = Subject(
            "heat map",
            partial(_train_and_score, TRIALS, pattern_seed, n_cores),
            cells,
            partial(grid, cells, pattern_seed),
            partial(_train_and_score, 2, pattern_seed, n_cores, grid(3)),
            n_cores,
        )
        timings.append(race([subject], once)[subject.name])
    minutes = [timing.seconds[0] * GRID**2 * MAP_SEEDS / 60 for timing in timings]
    how = "the whole map" if settings.full else f"from {cells} of the {GRID**2:,} cells per seed"
    row = Row(
        "Heat map, 41 × 41 × 5",
        f"heat map on {n_cores} core{'s' * (n_cores > 1)}",
        "minutes",
        (sum(minutes) / len(minutes),) if settings.full else tuple(minutes),
        more_is_better=False,
        targets=(Target(5.0, aim=2.0),) if n_cores == 2 else (),
        cpu_share=tuple(timing.cpu_share[0] for timing in timings),
        note=f"{MAP_SEEDS * GRID**2:,} trainings of {TRIALS:,} trials, one class, each scored on "
        f"{RUNS} streams; {how}",
    )
    return Findings(rows=[row])


def _train_and_score(
    trials: int, pattern_seed: int, threads: int, agents: Sequence[NeuronAgent]
) -> None:
    task = Task()
    patterns = Patterns.draw(task, pattern_seed)
    train_many(agents, task, patterns, trials, pattern_seed, threads)
    noisy_performance(agents, task, patterns, RUNS, MAX_EPISODE_BINS, 1_000, threads=threads)
