"""The league: neurons, the network and RL agents on the same patterns, by bins heard.

Two experiments of one form, since neurons are cheap and RL agents are not: each may have pattern
seeds of its own. A cell is one learner that hears its whole budget and is scored on the way.
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents import noisy_performance, train_many
from agents.experiments.design import Axis, Block, Experiment, Setting, Variable
from agents.experiments.methods import LIF_ALL, MODULATED, MST_ALL
from agents.experiments.statistics import counted, mean, median
from agents.experiments.store import read
from agents.experiments.training import (
    class_counts,
    evaluation_seed,
    make_agent,
    pattern_seeds,
    training_seed,
)
from agents.plotting import BINS, OKABE_ITO
from agents.registry import find_model, find_rule
from gnm_env import Patterns, PatternStreamEnv, Task
from gnm_env.rules import MAX_EPISODE_BINS, RUNS
from gnm_env.sampling import append_piece, new_buffers
from gnm_env.task import task_arrays

if TYPE_CHECKING:
    import xarray as xr

# --- the grid ------------------------------------------------------------------------------------

MILESTONES = (100_000, 200_000, 400_000, 800_000, 1_600_000, 4_000_000, 8_000_000, 12_000_000)
"""Bins heard at which a learner is scored; it is scored once more when its budget is spent."""

RL_MILESTONES = (100_000, 400_000, 1_600_000, 4_000_000)
"""Those of RL agents: to score a policy bin by bin takes as long as many updates."""

FINAL = len(MILESTONES)
"""Place of the last score along the axis "milestone"."""

MATCHED = {1: 1_600_000, 2: 4_000_000, 3: 4_000_000, 4: 4_000_000}
"""Bins at which all are compared, by number of classes: PPO's budget."""

PARTS = ("neurons", "rl")
RUN: dict[str, Any] = {"runs": RUNS, "cap": MAX_EPISODE_BINS}
SEEDS = {"quick": (3, 1), "full": (10, 10)}
"""Number of pattern seeds of the neurons, and of the RL agents."""
CLASSES = {"quick": (1,), "full": (1, 2, 3, 4)}
FIRST_SEED = 100
"""None of these pattern seeds was used when the settings of the RL agents were chosen."""

_PARAMETERS: dict[str, Setting] = {"GNM": {"neuron": "gnm"}, "LIF": LIF_ALL, "MST": MST_ALL}
_RULE: dict[str, Setting] = {
    "ALL": {"rule": "all"},
    "ET": {"rule": "et"},
    "ET modulated": MODULATED,
}

NEURON_LEARNERS: dict[str, Setting] = {
    **{
        f"{neuron}, {rule}": {**_PARAMETERS[neuron], **_RULE[rule], "trials": 60_000}
        for neuron in _PARAMETERS
        for rule in _RULE
    },
    "network, BP": {"neuron": "network", "rule": "bp", "trials": 60_000},
    "silent": {"reference": "silent"},
    "random spikes": {"reference": "random"},
    "oracle": {"reference": "oracle"},
}


def _rl(algorithm: str, feedback: str, *bins: int, **more: Any) -> Setting:
    """`bins` is what it hears, for one class, two, …; with more classes it is not trained.

    No more than takes some minutes.
    """
    return {"algorithm": algorithm, "feedback": feedback, "bins": bins, **more}


RL_LEARNERS: dict[str, Setting] = {
    "PPO, cost": _rl("ppo", "cost", 1_600_000, 4_000_000),
    "PPO, dense": _rl("ppo", "dense", 1_600_000, 4_000_000, 4_000_000, 4_000_000),
    "PPO linear, cost": _rl("ppo-linear", "cost", 1_600_000, 4_000_000),
    "A2C, dense": _rl("a2c", "dense", 1_600_000, 4_000_000),
    "RecurrentPPO, dense": _rl("recurrent-ppo", "dense", 800_000, 1_600_000),
    "leaky PPO, dense": _rl("leaky-ppo", "dense", 800_000, 1_600_000),
    "GNM by PPO, dense": _rl("gnm-ppo", "dense", 1_600_000, 1_600_000),
    "spiking PPO, dense": _rl("spiking-ppo", "dense", 1_600_000, 1_600_000),
    "DQN, dense": _rl("dqn", "dense", 400_000, 400_000),
    "PPO, random weights": _rl("ppo", "cost", 0, 0, spike_probability=0.5),
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
    Variable("seconds", "float64", "s", "processor time of training alone", ("milestone",)),
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
        Axis.named("learner", rows, long_name="who learns"),
    )
    common = {**RUN, **({"most": steps} if steps and part == "rl" else {})}
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
        kinds: list[Any] = [find_model(name) for name in ("gnm", "lif", "mst")]
        kinds += [find_rule(name) for name in ("all", "et")]
        kinds += [find_model("network"), find_rule("bp")]
        defaults = {kind.name: asdict(kind()) for kind in kinds}
    else:
        from agents.rl import HYPERPARAMETERS

        defaults = {
            kind: {"observation": asdict(chosen.observation), "n_envs": chosen.n_envs}
            | {name: str(value) for name, value in chosen.settings(chosen.n_envs).items()}
            for kind, chosen in HYPERPARAMETERS.items()
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


# --- training and scoring ------------------------------------------------------------------------


def learn_and_score(block: Block) -> dict[str, NDArray[Any]]:
    """Train the one learner of a block and score it on the way."""
    (setting,) = block.settings
    sheet = ScoreSheet(setting)
    parameters = 0 if _too_hard(setting) else _learner(setting)(setting, sheet)
    return {
        "survived": sheet.survived.reshape(*block.shape, FINAL + 1, -1),
        "heard": sheet.heard.reshape(*block.shape, -1),
        "seconds": sheet.seconds.reshape(*block.shape, -1),
        "parameters": np.full(block.shape, parameters),
    }


class ScoreSheet:
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


def _learner(setting: Setting) -> Callable[[Setting, ScoreSheet], int]:
    """What trains it; each returns the number of trainable parameters."""
    if "reference" in setting:
        return _reference
    return _rl_agent if "algorithm" in setting else _neuron


def _too_hard(setting: Setting) -> bool:
    """Whether a learner is not trained on so many classes; its scores are then missing."""
    return setting["classes"] > len(setting.get("bins", MATCHED))


def _bins_to_hear(setting: Setting) -> int:
    bins: int = setting["bins"][setting["classes"] - 1]
    return min(bins, setting.get("most", bins))


def _neuron(setting: Setting, sheet: ScoreSheet) -> int:
    """A neuron or the network. Bins heard are trials times their mean length."""
    task, patterns = sheet.task, sheet.patterns
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
        start = time.process_time()
        train_many([agent], task, patterns, stop - done, rng, threads=1)
        seconds += time.process_time() - start
        done = stop
        sheet.score(place, agent, round(done * bins), seconds)
    return int(agent.n_parameters) if hasattr(agent, "n_parameters") else len(agent.weights)


def _rl_agent(setting: Setting, sheet: ScoreSheet) -> int:
    """One of Stable-Baselines3's kinds; scored between rollouts."""
    import torch

    from agents.rl import SB3Agent, make_rl_agent, training_env
    from agents.rl.callbacks import Milestones
    from agents.rl.hyperparameters import HYPERPARAMETERS, n_parameters

    torch.set_num_threads(1)
    kind, task = setting["algorithm"], sheet.task
    budget = _bins_to_hear(setting)
    env = training_env(task, sheet.patterns, kind, feedback=setting["feedback"])
    model = make_rl_agent(
        kind,
        env,
        # Environment i hears the stream of this seed + i.
        1_000 * setting["pattern_seed"],
        spike_probability=setting.get("spike_probability", 0.01),
    )
    agent = SB3Agent(model, task, HYPERPARAMETERS[kind].observation)

    def score(milestone: int, heard: int, seconds: float) -> None:
        sheet.score(MILESTONES.index(milestone), agent, heard, seconds)

    if budget:
        clock = Milestones([m for m in RL_MILESTONES if m <= budget], score)
        model.learn(budget, callback=clock)
        if sheet.heard[FINAL] < model.num_timesteps:
            sheet.score(FINAL, agent, model.num_timesteps, clock.seconds)
    else:
        sheet.score(FINAL, agent, 0, 0.0)
    return n_parameters(model)


class RandomSpikes:
    """Spikes in each bin with one probability, whatever it hears; 0 is silence."""

    def __init__(self, probability: float, seed: int = 0) -> None:
        self._probability, self._rng = probability, np.random.default_rng(seed)

    def predict(
        self, observation: Any, state: Any = None, episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[np.int64], None]:  # fmt: skip
        """Independent coins."""
        spikes = self._rng.random(len(observation)) < self._probability
        return spikes.astype(np.int64), None


def _reference(setting: Setting, sheet: ScoreSheet) -> int:
    """What needs no training: the ends of the scale."""
    name = setting["reference"]
    if name == "oracle":
        seeds = range(sheet.seed, sheet.seed + setting["runs"])
        told = [_oracle(sheet.task, sheet.patterns, seed, setting["cap"]) for seed in seeds]
        sheet.enter(FINAL, np.array(told), 0, 0.0)
    else:
        probability = 0.0 if name == "silent" else 0.01
        sheet.score(FINAL, RandomSpikes(probability, setting["pattern_seed"]), 0, 0.0)
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
    """0 in noise; in a presentation the spikes owed, one a bin from its first bin on."""
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


# --- the table and the picture -------------------------------------------------------------------

PICTURED = {1, 2, 3}
"""Numbers of classes that are drawn; with more, all but PPO stay near silence."""

SILENT_SCORE = Task().silent_score
CAP = MAX_EPISODE_BINS


class Style(NamedTuple):
    """How a learner is drawn; told apart in grey by dashes and marks."""

    colour: str
    dashes: str
    mark: str


_NEURONS = {"GNM": ("blue", "o"), "LIF": ("sky", "s"), "MST": ("green", "^")}
_RULES = {"ALL": "-", "ET": ":", "ET modulated": "--"}
_OTHERS = {
    "network, BP": ("black", "-", "D"),
    "PPO, cost": ("vermillion", "-", "o"),
    "PPO, dense": ("vermillion", "--", "o"),
    "PPO linear, cost": ("orange", "-", "s"),
    "A2C, dense": ("orange", "--", "o"),
    "RecurrentPPO, dense": ("purple", "--", "^"),
    "leaky PPO, dense": ("purple", ":", "v"),
    "GNM by PPO, dense": ("blue", "-.", "P"),
    "spiking PPO, dense": ("sky", "-.", "X"),
    "DQN, dense": ("grey", "--", "D"),
}
STYLES = {
    f"{neuron}, {rule}": Style(OKABE_ITO[colour], dashes, mark)
    for neuron, (colour, mark) in _NEURONS.items()
    for rule, dashes in _RULES.items()
} | {name: Style(OKABE_ITO[c], dashes, mark) for name, (c, dashes, mark) in _OTHERS.items()}
"""Learners with a learning curve; the others are rows of the table only."""


def read_league(folder: Path) -> xr.Dataset:
    """One part of the league, as far as it is; where nothing was scored there is NaN."""
    results = read(folder, unfinished=True)
    protocol = results.attrs["settings"]["protocol"]
    milestones = [*protocol["milestones"], -1]
    results = results.assign_coords(milestone=milestones)
    score = results["survived"].where(results["survived"] >= 0).mean("run")
    return results.assign(score=score).assign_attrs(
        budget={int(classes): bins for classes, bins in protocol["budget"].items()}
    )


def rows(results: Sequence[xr.Dataset]) -> list[dict[str, Any]]:
    """The table: one row per number of classes and learner, the best last score first."""
    table = [_row(cell) for part in results for cell in _cells(part)]
    return sorted(table, key=lambda row: (row["classes"], -row["last"]["mean"]))


def _cells(part: xr.Dataset) -> Iterator[xr.Dataset]:
    for classes in part["classes"].to_numpy():
        for learner in part["learner"].to_numpy():
            cell = _finished(part.sel(classes=classes, learner=learner))
            if cell.sizes["pattern_seed"]:
                yield cell


def _finished(part: xr.Dataset) -> xr.Dataset:
    """Without the pattern seeds on which a learner is still to be trained."""
    done = part["score"].sel(milestone=-1).notnull()
    return part.isel(pattern_seed=np.flatnonzero(done.to_numpy()))


def _row(cell: xr.Dataset) -> dict[str, Any]:
    classes = int(cell["classes"])
    last = cell.sel(milestone=-1)
    matched = cell["score"].sel(milestone=cell.attrs["budget"][classes]).to_numpy()
    return {
        "classes": classes,
        "learner": str(cell["learner"].item()),
        "seeds": cell.sizes["pattern_seed"],
        "at_equal_experience": _numbers(matched) if np.isfinite(matched).all() else None,
        "equal_experience": cell.attrs["budget"][classes],
        "last": _numbers(last["score"].to_numpy()),
        "heard": int(last["heard"].max()),
        "seconds": round(float(last["seconds"].mean()), 2),
        "parameters": int(cell["parameters"].max()),
    }


def _numbers(scores: NDArray[Any]) -> dict[str, Any]:
    """Mean with its bootstrap interval over pattern seeds, and median."""
    value, low, high = mean(scores)
    interval = [round(low), round(high)] if np.isfinite(low) else None
    return {"mean": round(value), "ci95": interval, "median": round(median(scores).value)}


HEADINGS = (
    "learner", "seeds", "at equal experience", "median", "whole budget", "median", "bins heard",
    "training", "parameters",
)  # fmt: skip


def cells_of(row: dict[str, Any]) -> tuple[str, ...]:
    """A row as text."""
    equal = row["at_equal_experience"]
    return (
        row["learner"],
        str(row["seeds"]),
        _with_interval(equal) if equal else "",
        f"{equal['median']:,}" if equal else "",
        _with_interval(row["last"]),
        f"{row['last']['median']:,}",
        f"{row['heard'] / 1e6:.1f} M" if row["heard"] else "",
        f"{row['seconds']:,.1f} s" if row["heard"] else "",
        f"{row['parameters']:,}" if row["parameters"] else "",
    )


def _with_interval(numbers: dict[str, Any]) -> str:
    ends = numbers["ci95"]
    return f"{numbers['mean']:,}" + (f" [{ends[0]:,} … {ends[1]:,}]" if ends else "")


def text_table(table: Sequence[dict[str, Any]]) -> str:
    """The table for a terminal; it is Markdown too."""
    parts = []
    for classes in sorted({row["classes"] for row in table}):
        chosen = [row for row in table if row["classes"] == classes]
        lines = [HEADINGS, *map(cells_of, chosen)]
        widths = [max(len(line[k]) for line in lines) for k in range(len(HEADINGS))]
        text = [_line(line, widths) for line in lines]
        rule = "|" + "|".join("-" * (w + 1) + ("-" if k == 0 else ":") for k, w in
                              enumerate(widths)) + "|"  # fmt: skip
        title = (
            f"{counted(classes)}; equal experience: "
            f"{chosen[0]['equal_experience'] / 1e6:g} million bins. Mean noisy performance over "
            "pattern seeds [95 % interval], in bins:"
        )
        parts.append("\n".join([title, "", text[0], rule, *text[1:]]))
    return "\n\n".join(parts) + "\n"


def _line(line: Sequence[str], widths: Sequence[int]) -> str:
    cells = [
        text.ljust(width) if k == 0 else text.rjust(width)
        for k, (text, width) in enumerate(zip(line, widths, strict=True))
    ]
    return "| " + " | ".join(cells) + " |"


def draw(results: Sequence[xr.Dataset], folder: Path) -> list[Path]:
    """league.png and league.pdf in `folder`: learning curves above, last scores below."""
    from matplotlib.figure import Figure

    counts = sorted({int(c) for part in results for c in part["classes"].to_numpy()} & PICTURED)
    names = [name for name in STYLES if any(name in part["learner"] for part in results)]
    low = 0.24 * len(names) + 0.9
    figure = Figure(figsize=(1.2 + 5.0 * len(counts), 4.0 + low), layout="constrained")
    axes = figure.subplots(2, len(counts), height_ratios=(4.0, low), squeeze=False)
    for k, classes in enumerate(counts):
        _curves(axes[0, k], results, classes)
        _scores(axes[1, k], results, classes, names, labelled=k == 0)
    axes[0, 0].set_ylabel(BINS)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside right upper", fontsize=8, frameon=False)
    paths = [folder / "league.png", folder / "league.pdf"]
    for path in paths:
        figure.savefig(path, dpi=150)
    return paths


def _curves(axes: Any, results: Sequence[xr.Dataset], classes: int) -> None:
    for part in results:
        for cell in _cells(part.sel(classes=[classes])):
            name = str(cell["learner"].item())
            if name in STYLES:
                _curve(axes, cell, name)
    axes.axhline(SILENT_SCORE, color="0.4", linewidth=0.8, linestyle=(0, (1, 2)))
    axes.axvline(results[0].attrs["budget"][classes], color="0.7", linewidth=0.8, zorder=0)
    axes.annotate("silent", (0.01, SILENT_SCORE), xycoords=("axes fraction", "data"),
                  fontsize=8, color="0.3", va="bottom")  # fmt: skip
    axes.set(xscale="log", ylim=(0, CAP), xlabel="bins heard in training", title=counted(classes))


def _curve(axes: Any, learner: xr.Dataset, name: str) -> None:
    style = STYLES[name]
    scores = learner["score"].transpose("milestone", "pattern_seed").to_numpy()
    heard = learner["heard"].isel(pattern_seed=0).to_numpy()
    there = np.flatnonzero(heard > 0)
    # The last score may repeat that of a milestone: keep one.
    order = there[np.unique(heard[there], return_index=True)[1]]
    intervals = [mean(scores[place]) for place in order]
    axes.plot(
        heard[order],
        [interval.value for interval in intervals],
        style.dashes,
        color=style.colour,
        marker=style.mark,
        markersize=4,
        linewidth=1.4,
        label=name,
    )


def _scores(
    axes: Any, results: Sequence[xr.Dataset], classes: int, names: list[str], *, labelled: bool
) -> None:
    """Each pattern seed's last score as a point, the mean with its interval above it."""
    for part in results:
        for cell in _cells(part.sel(classes=[classes])):
            name = str(cell["learner"].item())
            if name not in names:
                continue
            style, row = STYLES[name], names.index(name)
            scores = cell["score"].sel(milestone=-1).to_numpy()
            axes.plot(scores, np.full(len(scores), row), style.mark, color=style.colour,
                      markersize=4, alpha=0.45, markeredgewidth=0)  # fmt: skip
            value, low, high = mean(scores)
            if np.isfinite(low):
                axes.plot([low, high], [row, row], color="0.15", linewidth=1.4)
            axes.plot([value], [row], "|", color="0.15", markersize=11, markeredgewidth=1.8)
    axes.axvline(SILENT_SCORE, color="0.4", linewidth=0.8, linestyle=(0, (1, 2)))
    axes.set(xlim=(-150, CAP + 150), xlabel="noisy performance with the whole budget (bins)")
    axes.set_yticks(range(len(names)), names if labelled else [], fontsize=8)
    axes.set_ylim(len(names) - 0.5, -0.5)
