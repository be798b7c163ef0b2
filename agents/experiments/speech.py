"""A word in speech: neurons that are told how often a word was said, and nothing more.

The phrases come from `gnm_env.speech`. Here are the learners, what they are compared with, how they
are scored on voices that they have never heard, and when they spike: before, after or at the word.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import agents.learning  # noqa: F401  (registers the rules)
from agents import registry
from agents.evaluation import answers
from agents.network import BackPropagation, Network, NetworkAgent
from agents.neuron_agent import NeuronAgent
from agents.neurons.gnm import GNM
from agents.neurons.mst import MST
from agents.recording import record
from agents.training.many import train_many
from gnm_env import Trials
from gnm_env.speech.phrases import BIN, DIGITS, located

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DELAYS = range(0, 81, 10)
"""Bins by which the copies of each channel come later: 0, 50 … 400 ms."""
LATENCIES = range(0, 81, 10)
"""Bins by which a neuron may spike later than what it answers; training phrases tell which."""
RESTARTS = 5
"""Trainings of which the one with the most phrases counted exactly in training is kept."""
EPOCHS = 20
PENALTIES = (1.0, 10.0, 100.0, 1_000.0, 10_000.0)
"""What ridge regression tries."""


class Score(NamedTuple):
    """How well phrases were counted."""

    exact: float
    """Share of the phrases whose count was exactly right."""
    mean_error: float
    """Mean |label − count|."""


def score(counts: NDArray[np.int64], labels: NDArray[np.int64]) -> Score:
    """The score of counts (n,) against labels (n,)."""
    error = np.abs(counts - labels)
    return Score(float(np.mean(error == 0)), float(np.mean(error)))


# --- controls ------------------------------------------------------------------------------------


def silent(train: Trials, test: Trials) -> NDArray[np.int64]:
    """No spike in any phrase."""
    return np.zeros(len(test), np.int64)


def constant(train: Trials, test: Trials) -> NDArray[np.int64]:
    """The commonest label of training for every phrase."""
    return np.full(len(test), np.bincount(train.labels).argmax())


def channel_counts(phrases: Trials) -> NDArray[np.float64]:
    """How often each channel spikes in each phrase, and its duration in bins, (n, N + 1)."""
    a, n = phrases.arrays, len(phrases)
    trial = np.repeat(np.arange(n), phrases.n_spikes)
    counts = np.bincount(trial * a.n_inputs + a.channels, minlength=n * a.n_inputs)
    return np.column_stack([counts.reshape(n, -1), phrases.n_bins]).astype(np.float64)


def ridge(train: Trials, test: Trials) -> NDArray[np.int64]:
    """Ridge regression on channel counts and duration, rounded to whole numbers from 0 on.

    A fifth of the training voices chooses the penalty.
    """
    own, held_out = train.split(0.8, seed=0, by="voice")
    rights = [score(_ridge(own, held_out, penalty), held_out.labels).exact for penalty in PENALTIES]
    return _ridge(train, test, PENALTIES[int(np.argmax(rights))])


def _ridge(train: Trials, test: Trials, penalty: float) -> NDArray[np.int64]:
    x, y = channel_counts(train), train.labels.astype(np.float64)
    mean, scale = x.mean(axis=0), np.maximum(x.std(axis=0), 1e-9)
    z = (x - mean) / scale
    weights = np.linalg.solve(z.T @ z + penalty * np.eye(z.shape[1]), z.T @ (y - y.mean()))
    guess = (channel_counts(test) - mean) / scale @ weights + y.mean()
    return np.maximum(np.round(guess), 0.0).astype(np.int64)


CONTROLS = {"silent": silent, "constant": constant, "ridge": ridge}


# --- learners ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Learner:
    """A neuron, its rule, and how it begins.

    Attributes:
        neuron: MST(…) or another.
        rule: name of the rule, as the registry knows it.
        settings: of the rule, but for `decay_trials`, which falls with the length of the training.
        bounds: weight bounds; None: free and signed.
        initial_weight: largest initial weight.
    """

    neuron: Any
    rule: str
    settings: Mapping[str, Any]
    bounds: tuple[float, float] | None = None
    initial_weight: float = 1e-4

    def agent(self, n_inputs: int, seed: int, trials: int) -> NeuronAgent:
        """A new agent, to be trained on so many trials."""
        rule = registry.rules()[self.rule](**self.settings, decay_trials=trials)
        return NeuronAgent(self.neuron, rule, n_inputs, seed, self.initial_weight, self.bounds)


@dataclass(frozen=True)
class NetworkLearner:
    """A network with a hidden layer: told where each word was, since BP has to know.

    Attributes:
        network: its size and parameters.
        learning_rate: of both layers, falling to 0.
        initial_weight: largest initial weight.
    """

    network: Network
    learning_rate: float
    initial_weight: float

    def agent(self, n_inputs: int, seed: int, trials: int) -> NetworkAgent:
        """A new agent, to be trained on so many trials."""
        rate = self.learning_rate
        rule = BackPropagation(
            learning_rate_hidden=rate, learning_rate_output=rate, decay_trials=trials
        )
        return NetworkAgent(self.network, rule, n_inputs, seed, self.initial_weight)


SLOW_MST = MST(tau_m=10.0, tau_s=2.5)
"""τ_m 50 ms, τ_s 12.5 ms."""
TUNED_GNM = GNM(alpha=0.1)
LEARNERS: dict[str, Learner | NetworkLearner] = {
    f"{name}, {title}": Learner(neuron, rule, settings)
    for name, neuron in (("MST", SLOW_MST), ("GNM", TUNED_GNM))
    for title, rule, settings in (
        ("CriticalThreshold", "critical", {"learning_rate": 1e-4, "momentum": 0.9}),
        ("MPDAL", "mpdal", {"learning_rate": 3e-4, "momentum": 0.5}),
        ("ALL", "all", {"learning_rate": 1e-5, "momentum": 0.9, "fraction": 0.2}),
    )
} | {"network, BP, told where": NetworkLearner(Network(alpha=0.1), 1e-2, 0.1)}
"""By the name in the table; settings were chosen on a sixth of the training speakers, held out."""
FIRST = next(iter(LEARNERS))
"""The one that the example trains unless told otherwise."""


def train(
    learner: Learner | NetworkLearner,
    phrases: Trials,
    *,
    restarts: int,
    epochs: int,
    seed: int = 0,
) -> list[NeuronAgent | NetworkAgent]:
    """`restarts` agents trained side by side, the best in training first.

    All hear the same phrases in the same order; `seed` is of that order, and the initial weights
    are those of seed, seed + 1, …
    """
    trials = epochs * len(phrases)
    agents = [learner.agent(phrases.n_inputs, seed + k, trials) for k in range(restarts)]
    told = located(phrases) if isinstance(learner, NetworkLearner) else phrases
    train_many(agents, told, trials=trials, seed=seed)
    order = np.argsort(answers(agents, phrases).wrong, kind="stable")
    return [agents[k] for k in order]


def selected(
    learner: Learner | NetworkLearner,
    splits: Mapping[str, Trials],
    *,
    runs: int,
    restarts: int,
    epochs: int,
) -> list[float]:
    """Share of test phrases counted exactly by each of `runs` selections of the best in training.

    `splits` as for `neuron_row`. Their median is what one who trains like this may expect.
    """
    best = (
        train(learner, splits["train"], restarts=restarts, epochs=epochs, seed=1_000 * run)[0]
        for run in range(runs)
    )
    return [exact(agent, splits["test"]).exact for agent in best]


def exact(agent: Any, phrases: Trials) -> Score:
    """The score of an agent."""
    result = answers(agent, phrases)
    return Score(
        1.0 - float(result.wrong[0]) / result.trials, float(result.absolute[0]) / result.trials
    )


# --- when it spikes ------------------------------------------------------------------------------


class Timing(NamedTuple):
    """Where the spikes are, against where the word is."""

    recall: float
    """Share of the words of that kind that got a spike of their own."""
    precision: float
    """Share of the spikes that a word of that kind got."""


def timing(
    spikes: Sequence[NDArray[np.int64]],
    phrases: Trials,
    latency: int = 0,
    *,
    mirrored: bool = False,
) -> Timing:
    """Match spikes with words, each at most once: a word takes the first free spike within it.

    Args:
        spikes: the bins of the output spikes of each phrase.
        phrases: with the columns `words`, `onsets` and `ends`.
        latency: bins that are taken off each spike before.
        mirrored: count the spikes from the end of what was said, as a control: what as many spikes
            at unrelated times get.
    """
    word = DIGITS.index(phrases.metadata["word"])
    columns = (phrases.columns[name] for name in ("words", "onsets", "ends"))
    hits = n_words = 0
    for bins, words, onsets, ends in zip(spikes, *columns, strict=True):
        answered = bins - latency
        free = sorted(ends[-1] - 1 - answered if mirrored else answered)
        for said, onset, end in zip(words, onsets, ends, strict=True):
            if said != word:
                continue
            n_words += 1
            mine = next((t for t in free if onset <= t < end), None)
            if mine is not None:
                hits += 1
                free.remove(mine)
    n_spikes = sum(map(len, spikes))
    return Timing(hits / max(n_words, 1), hits / max(n_spikes, 1))


def latency_of(spikes: Sequence[NDArray[np.int64]], phrases: Trials) -> int:
    """The latency, in bins, at which most words of these phrases, training ones, get a spike."""
    recalls = [timing(spikes, phrases, latency).recall for latency in LATENCIES]
    return LATENCIES[int(np.argmax(recalls))]


def spike_bins(agent: NeuronAgent | NetworkAgent, phrases: Trials) -> list[NDArray[np.int64]]:
    """The bins of the output spikes of each phrase."""
    return [np.flatnonzero(record(agent, trial).spikes) for trial in phrases]


# --- all of it -----------------------------------------------------------------------------------


@dataclass(frozen=True)
class Row:
    """One line of the table: scores by split, and for a neuron when it spikes on test voices."""

    name: str
    train: float
    """Share of the training phrases counted exactly."""
    scores: Mapping[str, Score]
    latency: int = 0
    """Bins by which its spikes come later than the word, as training phrases tell."""
    timing: Timing | None = None
    mirrored: Timing | None = None
    restarts: Sequence[float] = ()
    """Share counted exactly on test voices by each training, the kept one first."""


def control_rows(splits: Mapping[str, Trials]) -> list[Row]:
    """Silence, the commonest label, and ridge regression."""
    return [
        Row(
            name,
            score(guess(splits["train"], splits["train"]), splits["train"].labels).exact,
            {
                split: score(guess(splits["train"], phrases), phrases.labels)
                for split, phrases in splits.items()
                if split != "train"
            },
        )
        for name, guess in CONTROLS.items()
    ]


def neuron_row(
    name: str, agents: Sequence[NeuronAgent | NetworkAgent], splits: Mapping[str, Trials]
) -> Row:
    """The line of a learner, from its trained agents, the best in training first.

    `splits` are delayed as the agents want them.
    """
    best, test = agents[0], splits["test"]
    heard = splits["train"][: len(test)]
    latency = latency_of(spike_bins(best, heard), heard)
    spikes = spike_bins(best, test)
    return Row(
        name,
        exact(best, splits["train"]).exact,
        {split: exact(best, part) for split, part in splits.items() if split != "train"},
        latency,
        timing(spikes, test, latency),
        timing(spikes, test, latency, mirrored=True),
        [exact(agent, test).exact for agent in agents],
    )


PPO = "PPO, told the label"
PPO_SETTINGS: dict[str, Any] = {"ent_coef": 0.0, "learning_rate": 1e-3, "gae_lambda": 0.98}
"""Beside those of `agents.rl`: the best of five on training voices that were held out."""
PPO_BINS = 8_000_000
"""Bins that PPO hears: some three times each training phrase."""


def ppo_row(splits: Mapping[str, Trials], bins: int = PPO_BINS, seed: int = 0) -> Row:
    """The line of a PPO agent that is told the label and nothing else.

    Trained once: it takes minutes. `splits` are delayed, as for a neuron, and of each it hears
    traces too. Needs the extra `rl`.
    """
    from agents.rl import SB3Agent, make_rl_agent, training_env

    train = splits["train"]
    env = training_env(train, kind="ppo")
    agent = SB3Agent(make_rl_agent("ppo", env, seed, **PPO_SETTINGS).learn(bins), train)
    env.close()
    scores = {split: exact(agent, phrases) for split, phrases in splits.items() if split != "train"}
    return Row(PPO, exact(agent, train).exact, scores)


def text_table(rows: Sequence[Row]) -> str:
    """The table to print: exact share in training; exact share and mean |error| by split."""
    splits = list(rows[0].scores)
    head = f"{'':26}{'training':>9}" + "".join(f"{split:>16}" for split in splits)
    lines = [head + "   recall precision (mirrored)"]
    for row in rows:
        line = f"{row.name:26}{row.train:9.1%}"
        line += "".join(f"{s.exact:9.1%} {s.mean_error:6.2f}" for s in row.scores.values())
        if row.timing is not None and row.mirrored is not None:
            line += f"   {row.timing.recall:6.1%} {row.timing.precision:9.1%}"
            line += f" ({row.mirrored.recall:.1%}, {row.mirrored.precision:.1%})"
        lines.append(line)
    return "\n".join(lines)


# --- pictures ------------------------------------------------------------------------------------


def shown_phrase(phrases: Trials) -> int:
    """Number of a phrase for a picture: the first with two of the word and others between them."""
    word = DIGITS.index(phrases.metadata["word"])
    for k, words in enumerate(phrases.columns["words"]):
        places = [place for place, said in enumerate(words) if said == word]
        if len(places) == 2 and places[1] - places[0] > 1 and len(words) >= 5:
            return k
    return int(np.argmax(phrases.labels))


def draw(agent: NeuronAgent | NetworkAgent, phrases: Trials, number: int) -> Figure:
    """One phrase: what is heard, the potential and the spikes, and where the words are.

    Args:
        agent: a trained neuron.
        phrases: as they were made, without delays.
        number: of the phrase.
    """
    from agents.plotting import GREY, OUTPUT, RED, panels, styled

    one = phrases[[number]]
    trial, course = one[0], record(agent, one.delayed(DELAYS)[0])
    word = DIGITS.index(phrases.metadata["word"])
    columns = [phrases.columns[name][number] for name in ("words", "onsets", "ends")]
    t = (np.arange(trial.n_bins) + 0.5) * BIN
    with styled():
        figure, grid = panels(2, 1, width=7.1, height=4.2, sharex=True, height_ratios=(1.4, 1))
        raster, potential = grid[:, 0]
        bins = np.repeat(np.arange(trial.n_bins), np.diff(trial.offsets))
        raster.plot(t[bins], trial.channels / 4, "|", color="0.2", ms=3, mew=0.7)
        raster.set(ylabel="band (4 channels each)", ylim=(-0.5, trial.n_inputs / 4))
        potential.plot(t, course.V, color="black", lw=0.9)
        threshold = agent.model.threshold
        potential.axhline(threshold, color=GREY, lw=0.8, ls="--")
        top = 1.15 * max(float(course.V.max()), threshold)
        spikes = t[course.spikes]
        potential.plot(spikes, np.full(len(spikes), top), "v", color=OUTPUT, ms=6)
        potential.set(ylabel="potential, spikes (▾)", xlabel="time (s)", xlim=(0, t[-1]))
        for said, onset, end in zip(*columns, strict=True):
            is_word = said == word
            for axes in (raster, potential):
                axes.axvspan(
                    onset * BIN, end * BIN, color=RED if is_word else GREY,
                    alpha=0.18 if is_word else 0.07, lw=0,
                )  # fmt: skip
                axes.axvline(onset * BIN, color="white", lw=1.5, zorder=0)
            raster.annotate(
                DIGITS[said], ((onset + end) / 2 * BIN, 1.02), xycoords=("data", "axes fraction"),
                ha="center", color=RED if is_word else "0.3",
                fontweight="bold" if is_word else "normal",
            )  # fmt: skip
    return figure
