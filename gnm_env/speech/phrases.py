"""Phrases of spoken digits as trials: what the neuron hears, and what is known of them.

A trial is a phrase in one voice, in bins of 5 ms, and its label says how often one word was said,
nothing more. Which words were said, when and in which voice stays beside the trials, in columns:

    split   "train", "test", "near" (the control) or "stream" (long phrases of the test voices)
    voice   such as "en-us+f2"
    words   the digits, in their order
    onsets, ends   first bin of each word, and the bin after its last spike
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike, NDArray

from gnm_env.checks import whole
from gnm_env.speech.encoder import encode
from gnm_env.speech.voices import (
    DIGITS,
    all_voices,
    distances,
    portrait,
    split_voices,
)
from gnm_env.trial import Trial
from gnm_env.trials import Trials

BIN = 0.005
"""Width of a bin in seconds."""
TAIL = 60
"""Bins of silence after the last spike: what was said last takes a while to arrive."""
WORD = 7
"""The digit that labels count unless told otherwise."""
SHARE = 0.28
"""Chance of each word of a phrase to be that digit; all others are equally likely."""
WORDS = (3, 6)
"""Least and most words of a phrase."""
STREAM_WORDS = 20
PAUSES = 0.3
"""Share of phrases with a pause in them."""
SHIPPED = Path(__file__).parent / "digits.npz"


@dataclass(frozen=True)
class Phrase:
    """What is to be said, and how."""

    words: tuple[int, ...]
    pause_after: int | None
    """Number of the word after which there is a pause."""
    rate: int
    """Words per minute, as eSpeak counts them."""
    pitch: int

    @property
    def text(self) -> str:
        """As the synthesiser reads it."""
        said = [DIGITS[word] for word in self.words]
        if self.pause_after is not None:
            said[self.pause_after] += ","
        return " ".join(said)


def draw_phrase(rng: Generator, word: int = WORD, n_words: int | None = None) -> Phrase:
    """A random phrase; of 3 … 6 words, or of `n_words` without a pause."""
    n = int(rng.integers(WORDS[0], WORDS[1] + 1)) if n_words is None else n_words
    others = [digit for digit in range(10) if digit != word]
    words = tuple(word if rng.random() < SHARE else int(rng.choice(others)) for _ in range(n))
    pause = int(rng.integers(0, n - 1)) if n_words is None and rng.random() < PAUSES else None
    return Phrase(words, pause, int(rng.integers(145, 211)), int(rng.integers(35, 66)))


def trial_of(sound: ArrayLike, rate: float, label: int) -> Trial:
    """A sound as a trial of which the label is known: 96 channels, bins of 5 ms, a silent tail.

    Spikes of a channel in one bin count as one. Raises ValueError as `encode` does.
    """
    times = encode(sound, rate)
    last = max((float(t[-1]) for t in times if len(t)), default=0.0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of spikes in one bin
        return Trial.from_times(times, int(last / BIN) + 1 + TAIL, bin_width=BIN, label=label)


def word_bins(trial: Trial, onsets: ArrayLike) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """First bin of each word, and the bin after its last spike, from their onsets in seconds."""
    first = (np.asarray(onsets, np.float64) / BIN).astype(np.int64)
    busy = np.flatnonzero(np.diff(trial.offsets))
    last = busy[np.maximum(np.searchsorted(busy, np.append(first[1:], trial.n_bins)) - 1, 0)]
    return first, np.maximum(last + 1, first + 1)


def say(phrase: Phrase, voice: str, word: int = WORD) -> tuple[Trial, list[int], list[int]]:
    """The phrase, synthesised and encoded, and where its words are."""
    from gnm_env.speech.espeak import espeak

    said = espeak().say(phrase.text, voice, rate=phrase.rate, pitch=phrase.pitch)
    trial = trial_of(said.sound, said.rate, phrase.words.count(word))
    first, last = word_bins(trial, said.onsets)
    return trial, first.tolist(), last.tolist()


def make(
    voices: Mapping[str, Sequence[str]],
    sizes: dict[str, int],
    *,
    word: int = WORD,
    seed: int = 0,
    metadata: dict[str, Any] | None = None,
    progress: Callable[[Iterable[int]], Iterable[int]] = iter,
) -> Trials:
    """Phrases for each split, its voices taking turns.

    Args:
        voices: the voices of each split, by its name, for each that has a size.
        sizes: the number of phrases of each. Those of the split "stream" have 20 words.
        word: digit that labels count.
        seed: of the phrases. Synthesis itself is not reproducible from call to call.
        metadata: what else is to be kept with them.
        progress: wraps the numbers of the phrases, to show how far it is.
    """
    word = whole("word", word, low=0, high=9)
    rng = np.random.default_rng(whole("seed", seed, low=0))
    order = {split: rng.permutation(len(names)) for split, names in voices.items()}
    plan = [(split, k) for split, size in sizes.items() for k in range(size)]
    columns: dict[str, list[Any]] = {
        name: [] for name in ("split", "voice", "words", "onsets", "ends")
    }
    trials = []
    for number in progress(range(len(plan))):
        split, k = plan[number]
        voice = voices[split][order[split][k % len(order[split])]]
        phrase = draw_phrase(rng, word, STREAM_WORDS if split == "stream" else None)
        trial, onsets, ends = say(phrase, voice, word)
        trials.append(trial)
        for name, entry in zip(
            columns, (split, voice, list(phrase.words), onsets, ends), strict=True
        ):
            columns[name].append(entry)
    known = {"word": DIGITS[word], "bin_seconds": BIN, **(metadata or {})}
    return Trials(trials, columns=columns, metadata=known)


SIZES = {"train": 5_000, "test": 2_000, "near": 400, "stream": 40}
"""Phrases of each split."""
VOICES, BOUND = 10, 0.16
"""Test voices, and as many of the control; how far a training voice must be from a test voice."""


def make_digits(
    sizes: dict[str, int] | None = None,
    *,
    word: int = WORD,
    bound: float = BOUND,
    seed: int = 0,
    progress: Callable[[Iterable[int]], Iterable[int]] = iter,
) -> Trials:
    """Phrases in all of eSpeak's English voices, split so that test voices are distant.

    Listens to every voice first, which takes a minute; the metadata say how far each test voice,
    and each voice of the control, is from the nearest training voice.

    Args:
        sizes: phrases of each split; None: those of SIZES.
        bound: least distance between training and test voices, see `gnm_env.speech.voices`.
        word, seed, progress: as for `make`.
    """
    names = all_voices()
    portraits = np.array([portrait(names[k]) for k in progress(range(len(names)))])
    apart = distances(portraits)
    distance = apart.copy()
    speaker = np.array([name.partition("+")[2] for name in names])
    distance[speaker[:, None] == speaker] = 0.0  # one speaker in another accent is near as well
    split = split_voices(distance, n_test=VOICES, n_near=VOICES, bound=bound, seed=seed)
    voices = {name: [names[k] for k in part] for name, part in split._asdict().items()}
    nearest = {
        name: np.round(apart[np.ix_(part, split.train)].min(axis=1), 4).tolist()
        for name, part in (("test", split.test), ("near", split.near))
    }
    known = {"bound": bound, "voices": voices, "nearest": nearest}
    spoken = {**voices, "stream": voices["test"]}
    return make(spoken, sizes or SIZES, word=word, seed=seed, metadata=known, progress=progress)


def digits() -> Trials:
    """The phrases that ship with the project: 96 channels; labels count "seven"."""
    return Trials.load(SHIPPED)


def part(phrases: Trials, split: str) -> Trials:
    """The phrases of one split. ValueError if there are none."""
    here = [k for k, name in enumerate(phrases.columns.get("split", ())) if name == split]
    if not here:
        raise ValueError(
            f"split must be one of {sorted(set(phrases.columns.get('split', ())))}, got {split!r}"
        )
    return phrases[np.array(here)]


def counting(phrases: Trials, word: int) -> Trials:
    """The same phrases with labels that count another digit."""
    word = whole("word", word, low=0, high=9)
    labels = [words.count(word) for words in phrases.columns["words"]]
    return _owing(phrases, {**phrases.metadata, "word": DIGITS[word]}, labels=labels)


def _owing(phrases: Trials, metadata: dict[str, Any], **owed: Any) -> Trials:
    """The same spikes and columns, and what `Trials.from_arrays` is told of what is owed."""
    a = phrases.arrays
    return Trials.from_arrays(
        phrases.n_inputs,
        phrases.n_bins,
        phrases.n_spikes,
        a.channels,
        a.bins,
        columns=phrases.columns,
        metadata=metadata,
        **owed,
    )


def located(phrases: Trials) -> Trials:
    """The same phrases, and where in each the counted word is: a presentation that owes one spike.

    For learners that are told more than the label.
    """
    word = DIGITS.index(phrases.metadata["word"])
    columns = (phrases.columns[name] for name in ("words", "onsets", "ends"))
    places = [
        [(onset, end) for said, onset, end in zip(*of_one, strict=True) if said == word]
        for of_one in zip(*columns, strict=True)
    ]
    flat = np.array([place for of_one in places for place in of_one], np.int64).reshape(-1, 2)
    return _owing(
        phrases,
        phrases.metadata,
        presentations=[len(of_one) for of_one in places],
        onsets=flat[:, 0],
        ends=flat[:, 1],
        targets=np.ones(len(flat), np.int64),
    )


def balanced(phrases: Trials, seed: int = 0) -> Trials:
    """The phrases without so many of label 0 that in each split there are no more than of label 1.

    Any one word but that which phrases were made for is rare: most labels would be 0.
    """
    rng = np.random.default_rng(seed)
    labels, splits = phrases.labels, np.array(phrases.columns["split"])
    kept = labels > 0
    for split in sorted(set(splits.tolist())):
        zeros = np.flatnonzero((splits == split) & (labels == 0))
        most = int(np.sum((splits == split) & (labels == 1)))
        kept[rng.permutation(zeros)[:most]] = True
    return phrases[kept]
