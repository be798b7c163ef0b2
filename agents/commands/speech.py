"""Hear a word in speech: neurons that are told only how often it was said.

gnm speech                     train on the phrases that ship with the project, test on new voices
gnm speech --word three        another of the ten digits
gnm speech make --out FILE     synthesise phrases of your own; needs the extra "speech"
gnm speech --phrases FILE      train and test on these
"""

from __future__ import annotations

import argparse
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from agents.commands.terminal import Parser, at_least, share
from agents.experiments import speech
from agents.experiments.progress import counted
from agents.plotting import save
from gnm_env import Trials
from gnm_env.speech.phrases import SIZES, balanced, counting, digits, make_digits, part
from gnm_env.speech.voices import DIGITS

SPLITS = ("train", "test", "near", "stream")
KNOWN = (*speech.LEARNERS, speech.PPO)
"""Learners by their names in the table."""


def options(parser: Parser) -> None:
    add = parser.add_argument
    add("what", choices=("run", "make"), nargs="?", default="run")
    add("--word", choices=DIGITS, default="seven", help="the word to be counted (default seven)")
    add("--phrases", type=Path, metavar="FILE", help="(default those that ship with the project)")
    known = ", ".join(f"'{name}'" for name in KNOWN)
    add(
        "--learner", action="append", metavar="NAME", help=f"of {known}, or all (default the first)"
    )
    add("--restarts", type=at_least(1), default=speech.RESTARTS, metavar="N")
    add("--epochs", type=at_least(1), default=speech.EPOCHS, metavar="N")
    add(
        "--ppo-bins",
        type=at_least(1),
        default=speech.PPO_BINS,
        metavar="N",
        help="bins that PPO hears (default 8,000,000: some minutes)",
    )
    share(parser, "--runs", default=1, help="selections to take the median of")
    for split, size in SIZES.items():
        add(
            f"--{split}",
            type=at_least(1),
            default=size,
            metavar="N",
            help=f"phrases to make ({size:,})",
        )
    share(parser, "--seed")
    share(parser, "--out", help="of the picture; of `make` the FILE (default runs/speech)")


def main(options: argparse.Namespace) -> dict[str, Any]:
    """Make phrases, or train on them and print how well new voices are understood."""
    return _make(options) if options.what == "make" else _run(options)


def _make(options: argparse.Namespace) -> dict[str, Any]:
    path = options.out or Path("runs/speech/digits.npz")
    path.parent.mkdir(parents=True, exist_ok=True)

    phrases = make_digits(
        {split: getattr(options, split) for split in SIZES},
        word=DIGITS.index(options.word), seed=options.seed, progress=counted("speaking", "phrases"),
    )  # fmt: skip
    phrases.save(path)
    print(phrases)
    return {"phrases": str(path), "trials": len(phrases), "bytes": path.stat().st_size}


def _run(options: argparse.Namespace) -> dict[str, Any]:
    phrases = digits() if options.phrases is None else Trials.load(options.phrases)
    if phrases.metadata["word"] != options.word:
        phrases = balanced(counting(phrases, DIGITS.index(options.word)))
    splits = {split: part(phrases, split) for split in SPLITS}
    for split, nearest in phrases.metadata["nearest"].items():
        print(
            f"{split} voices are {np.mean(nearest):.3f} from the nearest training voice on average"
        )
    delayed = {split: one.delayed(speech.DELAYS) for split, one in splits.items()}
    rows, best = speech.control_rows(splits), None
    for name in _learners(options.learner):
        if name == speech.PPO:
            rows.append(speech.ppo_row(delayed, options.ppo_bins, options.seed))
            continue
        learner = speech.LEARNERS[name]
        agents = speech.train(
            learner, delayed["train"],
            restarts=options.restarts, epochs=options.epochs, seed=options.seed,
        )  # fmt: skip
        rows.append(speech.neuron_row(name, agents, delayed))
        if best is None or rows[-1].train > best[0]:
            best = (rows[-1].train, agents[0])
    print(speech.text_table(rows))
    selections = []
    if options.runs > 1:
        selections = speech.selected(
            speech.LEARNERS[speech.FIRST], delayed,
            runs=options.runs, restarts=options.restarts, epochs=options.epochs,
        )  # fmt: skip
        shares = " ".join(f"{share:.1%}" for share in sorted(selections))
        print(f"{speech.FIRST}, {options.runs} selections on test voices: {shares}")
        print(f"median {np.median(selections):.1%}")
    told = {"rows": [asdict(row) for row in rows], "selections": selections}
    if best is None:
        return told
    figure = speech.draw(best[1], splits["test"], speech.shown_phrase(splits["test"]))
    folder = options.out or Path("runs/speech")
    picture = save(figure, folder, f"speech-{options.word}", ("png",))["png"]
    print(f"picture {picture}")
    return {**told, "picture": str(picture)}


def _learners(given: list[str] | None) -> list[str]:
    """The learners asked for. ValueError if there is no such one."""
    wanted = given or [speech.FIRST]
    for name in wanted:
        if name not in (*KNOWN, "all"):
            raise ValueError(f"learner must be one of {'; '.join(KNOWN)}; or all, got {name}")
    return list(KNOWN) if "all" in wanted else wanted
