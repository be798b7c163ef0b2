"""CEILING: what the best weights of a neuron could do, beside what learning rules make of them.

A score after learning says what neuron and rule do together. Here the weights of GNM, LIF and MST
are also sought directly, by the evolution strategy CMA-ES on the mistake rate, from the weights
that ALL has learned and from those of PeakError. Every generation hears streams of its own, so that
no stream can be learned by heart; all candidates of a generation hear the same ones, side by side.
What the search finds is a lower bound of what the weights could do, never an upper one.

Needs the library cma (`pip install "gnm-env[search]"`) to compute, not to judge or draw.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from agents import noisy_performance
from agents.experiments.design import Axis, Block, Experiment, Setting, Variable
from agents.experiments.figures import Picture
from agents.experiments.statistics import by_seed, counts_of, mean, ratio_of_means
from agents.experiments.training import (
    RUN,
    class_counts,
    evaluation_seed,
    make_agent,
    pattern_seeds,
    protocol,
    stream_seeds,
    task_of,
    trained,
)
from agents.experiments.verdict import Finding, Hypothesis, Results
from agents.plotting import BINS, BLUE, INK, RED, WIDE, legend_above, letter, panels
from gnm_env import Patterns, Task

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

# --- the grid ------------------------------------------------------------------------------------

NEURONS: dict[str, dict[str, Any]] = {
    "GNM": {"neuron": "gnm", "alpha": 0.15},
    "LIF": {"neuron": "lif", "alpha": 0.15, "refractory": 0},
    "MST": {"neuron": "mst"},
}
BOUNDS: dict[str, dict[str, Any]] = {
    "[0, 1]": {"weight_bounds": (0.0, 1.0)},
    "signed": {"weight_bounds": (-0.4, 0.4)},
}
ALL: dict[str, Any] = {"rule": "all", "learning_rate": 1e-4}
PEAK_ERROR: dict[tuple[str, str], dict[str, Any]] = {
    ("gnm", "[0, 1]"): {"learning_rate": 3e-3},
    ("lif", "[0, 1]"): {"learning_rate": 3e-3},
    ("mst", "[0, 1]"): {"learning_rate": 1e-3},
    ("gnm", "signed"): {"learning_rate": 3e-2, "decay_trials": 60_000},
    ("lif", "signed"): {"learning_rate": 3e-2, "decay_trials": 60_000},
    ("mst", "signed"): {"learning_rate": 1e-2, "decay_trials": 60_000},
}
"""As they did well on pattern seeds 0 to 15."""

METHODS = ("ALL", "PeakError", "search from ALL", "search from PeakError")
SEARCH = {"candidates": 32, "streams": 30, "search_cap": 2_000, "steps": (0.05, 0.01)}
"""`steps`: the first step sizes, from the weights of ALL and from those of PeakError."""

GENERATIONS = {"quick": (20, 5), "paper": (150, 30)}
"""From the weights of ALL, and from those of PeakError, where there is little left to gain."""

SIZES = {"quick": (range(100, 102), (2,)), "paper": (range(100, 120), (2, 4))}
SEARCH_SEED = 500_000_000
"""First seed of the streams of a search: beyond those of training and of evaluation."""


def ceiling(size: str, seeds: tuple[int, ...] | None = None) -> Experiment:
    """Learned and sought weights, by neuron, bounds and number of classes."""
    usual, classes = SIZES[size]
    bounds = {name: {**setting, "bounds": name} for name, setting in BOUNDS.items()}
    axes = (
        class_counts(*classes),
        pattern_seeds(seeds or usual),
        Axis.named("model", NEURONS, long_name="neuron"),
        Axis.named("weights_in", bounds, long_name="weight bounds"),
    )
    common = {**RUN, **SEARCH, "generations": GENERATIONS[size]}
    task = Task()
    lengths = {"method": len(METHODS), "run": RUN["runs"], "channel": task.n_inputs}
    variables = (
        Variable("survived", "int32", "bins", "bins survived, fresh streams", ("method", "run")),
        Variable("chosen", "float64", "bins", "the same on streams to choose by", ("method",)),
        Variable("weights", "float64", "1", "weights of each method", ("method", "channel")),
    )
    rules = {"methods": METHODS, "ALL": ALL, "search_seed": SEARCH_SEED} | {
        f"PeakError {neuron} {bounds}": rule for (neuron, bounds), rule in PEAK_ERROR.items()
    }
    described = protocol(task, [{"neuron": "gnm", "rule": "all"}, *NEURONS.values()]) | rules
    title = "What the best weights could do, beside what rules learn"
    return Experiment(
        "CEILING", title, axes, common, _compute, variables, lengths, described, stream_seeds(axes)
    )


def _compute(block: Block) -> dict[str, NDArray[Any]]:
    (setting,) = block.settings
    learned = [_learned(setting, rule) for rule in (ALL, _peak_error(setting))]
    sought = [
        search(setting, start, step, generations)
        for start, step, generations in zip(
            learned, setting["steps"], setting["generations"], strict=True
        )
    ]
    weights = np.array([*learned, *sought])
    seed = evaluation_seed(setting["classes"], setting["pattern_seed"])
    survived = evaluator(setting, len(weights))(weights, setting["runs"], setting["cap"], seed)
    # Half way to the next pattern seed: streams that neither training nor the score hears.
    chosen = evaluator(setting, len(weights))(
        weights, setting["runs"], setting["cap"], seed + 500
    ).mean(axis=1)
    return block.shaped(survived=[survived], chosen=[chosen], weights=[weights])


def _peak_error(setting: Setting) -> dict[str, Any]:
    return {"rule": "peak-error", **PEAK_ERROR[setting["neuron"], setting["bounds"]]}


def _learned(setting: Setting, rule: dict[str, Any]) -> NDArray[np.float64]:
    task = task_of(setting)
    patterns = Patterns.draw(task, setting["pattern_seed"])
    (agent,), _ = trained([{**setting, **rule}], task, patterns)
    return np.array(agent.weights)


Evaluate = Callable[[Iterable[Any], int, int, int], NDArray[np.int64]]


def evaluator(setting: Setting, most: int) -> Evaluate:
    """A function of weights (k, N), k <= `most`, runs, cap and seed: bins survived (k, runs)."""
    task = task_of(setting)
    patterns = Patterns.draw(task, setting["pattern_seed"])
    agents = [make_agent({**setting, **ALL}, task) for _ in range(most)]

    def survived(weights: Iterable[Any], runs: int, cap: int, seed: int) -> NDArray[np.int64]:
        rows = list(weights)
        for agent, row in zip(agents, rows, strict=False):
            agent.weights[:] = row
        some = agents[: len(rows)]
        return noisy_performance(some, task, patterns, runs, cap, seed, threads=1)

    return survived


def search(
    setting: Setting, start: NDArray[np.float64], step: float, generations: int
) -> NDArray[np.float64]:
    """The weights at which CMA-ES (diagonal) ends that sets out from `start` with steps of `step`.

    Raises ValueError if the library cma is not installed.
    """
    try:
        import cma
    except ImportError:
        raise ValueError(
            'the search needs cma, which is not installed: pip install "gnm-env[search]"'
        ) from None
    low, high = setting["weight_bounds"]
    # Away from the bounds themselves, where the transformation of the library has no slope.
    inside = np.clip(start, low + 1e-3, high - 1e-3)
    strategy = cma.CMAEvolutionStrategy(
        inside,
        step,
        {
            "popsize": setting["candidates"],
            "bounds": [low, high],
            "CMA_diagonal": True,
            "maxiter": generations,
            # Numbers of its own: those of numpy.random are shared by all threads of a process.
            "randn": np.random.RandomState(setting["pattern_seed"] + 1).randn,
            "seed": np.nan,
            "verbose": -9,
        },
    )
    evaluate = evaluator(setting, setting["candidates"])
    for generation in range(generations):
        candidates = strategy.ask()
        seed = SEARCH_SEED + generation * setting["streams"]
        survived = evaluate(candidates, setting["streams"], setting["search_cap"], seed)
        mistakes = (survived < setting["search_cap"]).sum(axis=1) + 0.5
        # Someone who errs in the first bin of every stream has survived none: count those bins.
        strategy.tell(candidates, np.log(mistakes / np.maximum(survived.sum(axis=1), 1)).tolist())
    return np.clip(np.array(strategy.result.xfavorite), low, high)


# --- what is read off ----------------------------------------------------------------------------


def scores(data: xr.Dataset, classes: int, neuron: str, bounds: str) -> NDArray[np.float64]:
    """Noisy performance by (seed, method), and in a last column that of the best known weights.

    The best of the four are chosen on other streams than they are scored on.
    """
    cell = data.sel(classes=classes, model=neuron, weights_in=bounds)
    rows = by_seed(cell["survived"].mean("run"), "method")
    best = by_seed(cell["chosen"], "method").argmax(axis=1)
    return np.column_stack([rows, rows[np.arange(len(rows)), best]])


# --- the hypotheses ------------------------------------------------------------------------------

TIMES = {2: 1.5, 4: 10.0}
REACHED = 0.8


def _judge_height(results: Results) -> Finding:
    data = results["CEILING"]
    held, words = {}, []
    for classes in counts_of(data):
        rows = scores(data, classes, "GNM", "signed")
        times = ratio_of_means(rows[:, -1], rows[:, 0])
        held[classes] = times.above(TIMES[classes])
        words.append(
            f"{classes} classes: best known weights {mean(rows[:, -1]):,.0f} bins, ALL in the same "
            f"bounds {mean(rows[:, 0]):,.0f}: {times:.1f} times"
        )
    return Finding.of(held, words, "the task has {} classes")


def _judge_rule(results: Results) -> Finding:
    data = results["CEILING"]
    held, words = dict.fromkeys(counts_of(data), True), []
    for classes, neuron, bounds in itertools.product(held, NEURONS, BOUNDS):
        rows = scores(data, classes, neuron, bounds)
        share = ratio_of_means(rows[:, 1], rows[:, -1])
        held[classes] &= share.above(REACHED)
        words.append(f"{classes} classes, {neuron}, {bounds}: {share:.0%}")
    told = "PeakError over best known: " + "; ".join(words)
    return Finding.of(held, (told,), "the task has {} classes")


def _judge_neuron(results: Results) -> Finding:
    data = results["CEILING"]
    held, words = {}, []
    for classes in counts_of(data):
        gnm, mst = (scores(data, classes, name, "signed")[:, -1] for name in ("GNM", "MST"))
        gain = mean(gnm - mst)
        held[classes] = gain.above(0.0)
        words.append(f"{classes} classes: GNM − MST {gain:+,.0f} bins")
    return Finding.of(held, words, "the task has {} classes")


_PROTOCOL = (
    "GNM and LIF (α 0.15, no refractory period), MST (τ 20 and 5); weights in [0, 1] or ±0.4; ALL "
    "λ 1e-4 and PeakError as tuned on other seeds, 60,000 trials; diagonal CMA-ES with 32 "
    "candidates, 30 fresh streams a generation, from the weights of either rule; two and four "
    "classes"
)

HYPOTHESES = (
    Hypothesis(
        "C1",
        "The quick fall with the number of classes is for the most part learning: the best known "
        "weights of the same neuron survive far longer than ALL's",
        "direct search on three other seeds: 9,200 against 2,200 bins at two classes, 4,400 "
        "against 85 at four",
        _PROTOCOL,
        "holds if for the GNM with signed weights the mean of the best known weights over that of "
        f"ALL has an interval above {TIMES[2]:g} at two classes and above {TIMES[4]:g} at four",
        ("CEILING",),
        _judge_height,
    ),
    Hypothesis(
        "C2",
        "PeakError learns what direct search can find",
        "from PeakError's weights the search gained nothing on pattern seeds 200 to 202 (GNM, four "
        "classes)",
        _PROTOCOL,
        "holds if for every neuron, bounds and number of classes the mean of PeakError over that "
        f"of the best known weights has an interval above {REACHED:.0%}; conditional on the number "
        "of classes",
        ("CEILING",),
        _judge_rule,
    ),
    Hypothesis(
        "C3",
        "With the best known weights the GNM is ahead of the MST: the paper's ranking is right "
        "there",
        "tuned PeakError on other seeds, four classes: 4,753 against 1,895 bins",
        _PROTOCOL,
        "holds if the mean paired difference of the best known signed weights, GNM − MST, has an "
        "interval above 0 at two and at four classes",
        ("CEILING",),
        _judge_neuron,
    ),
)

# --- the figure ----------------------------------------------------------------------------------

_LOOKS = {
    "ALL": (RED, "o"),
    "PeakError": (INK, "D"),
    "search from ALL": (BLUE, "^"),
    "search from PeakError": ("#1b998b", "v"),
}


def _draw(results: Results) -> Figure:
    """Scores of learned and of sought weights, by neuron and bounds, one panel per class count."""
    data = results["CEILING"]
    counts = counts_of(data)
    figure, grid = panels(1, len(counts), width=WIDE, height=3.2, sharey=True)
    places = list(itertools.product(NEURONS, BOUNDS))
    for axes, classes, name in zip(grid[0], counts, "ab", strict=False):
        for place, (neuron, bounds) in enumerate(places):
            rows = scores(data, classes, neuron, bounds)
            for k, (method, (colour, mark)) in enumerate(_LOOKS.items()):
                x = place + 0.18 * (k - 1.5)
                axes.plot(np.full(len(rows), x), rows[:, k], ".", color=colour, ms=2, alpha=0.4)
                centre = mean(rows[:, k])
                axes.vlines(x, centre.low, centre.high, color=colour, lw=1.4)
                label = method if place == 0 else None
                axes.plot(x, centre.value, mark, color=colour, ms=4.5, label=label)
        axes.set_yscale("log")
        axes.set_ylim(10, 12_000)
        axes.axhline(Task().silent_score, color="0.5", ls=":", lw=0.8)
        axes.set_xticks(range(len(places)), [f"{n}\n{b}" for n, b in places], fontsize=7)
        letter(axes, f"{name}   {classes} classes")
    grid[0, 0].set_ylabel(BINS)
    legend_above(figure, grid[0, 0], 4)
    return figure


EXPERIMENTS = {"CEILING": ceiling}
PICTURES = {
    "CEILING": Picture(
        _draw,
        ("CEILING",),
        "Noisy performance (logarithmic, cap 10,000) of weights that ALL and PeakError have "
        "learned and of those to which CMA-ES came from each of them, by neuron and weight bounds: "
        "one point per pattern seed, means with 95 % bootstrap intervals. Dotted, a neuron that "
        "never spikes.",
    )
}
