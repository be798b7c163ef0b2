"""What all verbs share: options of one meaning, one clear line on bad input, JSON at the end."""

from __future__ import annotations

import argparse
import json
import os
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any, NoReturn

from gymnasium.error import DependencyNotInstalled

from gnm_env.rules import RUNS

RESULTS = Path("results")
REPORT = RESULTS / "report"
EVALUATION_SEED = 1_000_000
"""First seed of the streams that scores are taken on: far from any that one would train on."""

EXTRAS = {
    **dict.fromkeys(("xarray", "zarr", "filelock", "jinja2"), "reproduce"),
    **dict.fromkeys(("torch", "stable_baselines3", "sb3_contrib", "tensorboard"), "rl"),
    **dict.fromkeys(("roadrunner", "libsbml", "antimony"), "chemistry"),
    **dict.fromkeys(("dask", "distributed"), "cluster"),
    "espeakng_loader": "speech",
    "cma": "search",
    "matplotlib": "pictures",
    "tornado": "explore",
    **dict.fromkeys(("PIL", "imageio_ffmpeg"), "video"),
}
"""Which extra of the package brings what may be missing."""


class Stopped(KeyboardInterrupt):
    """Ctrl-C or SIGTERM, once what was done so far is safe; says what was kept, and where.

    `result` is what `--json` prints.
    """

    def __init__(self, kept: str, result: dict[str, Any]) -> None:
        super().__init__(kept)
        self.result = result


class Parser(argparse.ArgumentParser):
    """A parser whose complaint is one line. `words` is the command line that it will parse."""

    def __init__(self, name: str, description: str, words: Sequence[str] = ()) -> None:
        super().__init__(
            prog=name,
            description=description,
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        self.words = list(words)

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"{self.prog}: {message}\n")

    def early(self, option: str) -> Any:
        """The value of an option that decides which others there are; None if it is not given."""
        first = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
        first.add_argument(option, dest="value")
        known, _ = first.parse_known_args(self.words)
        return known.value


# --- options -------------------------------------------------------------------------------------


def at_least(low: int) -> Callable[[str], int]:
    """The type of an option that is a whole number from `low` on."""

    def whole(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"expected a whole number, got {text!r}") from None
        if value < low:
            raise argparse.ArgumentTypeError(f"must be >= {low}, got {value}")
        return value

    return whole


def pattern_seeds(text: str) -> tuple[int, ...]:
    """ "10" means seeds 0 … 9, "3,5,8" these three, "10-19" these ten."""
    from agents.experiments.training import LARGEST_SEED

    try:
        if "," in text:
            seeds: Sequence[int] = [int(part) for part in text.split(",") if part]
        elif "-" in text:
            first, last = text.split("-")
            seeds = range(int(first), int(last) + 1)
        else:
            seeds = range(int(text))
    except ValueError:
        seeds = ()
    if not seeds:
        raise argparse.ArgumentTypeError(
            f"expected a number of seeds (10), a list (3,5,8) or a range (10-19), got {text!r}"
        )
    # By the ends: a tuple of all of them might not fit in memory.
    if not 0 <= min(seeds[0], seeds[-1]) <= max(seeds[0], seeds[-1]) <= LARGEST_SEED:
        raise argparse.ArgumentTypeError(
            f"pattern seeds must be in 0 … {LARGEST_SEED}, got {text!r}"
        )
    return tuple(seeds)


def module(place: str) -> ModuleType:
    """A module, or a file, that defines neurons or rules; importing it makes them known."""
    from agents.registry import load_module

    try:
        found: ModuleType = load_module(place)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None
    return found


SHARED: dict[str, dict[str, Any]] = {
    "--json": {"action": "store_true", "help": "end with one line of JSON"},
    "--seed": {"type": at_least(0), "default": 0, "metavar": "N"},
    "--pattern-seed": {"type": at_least(0), "metavar": "N", "help": "of the patterns (default 0)"},
    "--runs": {"type": at_least(1), "default": RUNS, "metavar": "N"},
    "--out": {"type": Path, "metavar": "FOLDER"},
    "--size": {"choices": ("quick", "paper"), "default": "quick"},
    "--results": {
        "type": Path, "metavar": "FOLDER", "help": f"folder of stores (default {RESULTS}/SIZE)"
    },
    "--seeds": {
        "type": pattern_seeds, "metavar": "SEEDS", "help": "pattern seeds: 10, 3,5,8 or 10-19"
    },
    "--store": {"type": Path, "metavar": "FOLDER", "help": f"(default {RESULTS}/SIZE/NAME)"},
    "--threads": {"type": at_least(1), "metavar": "N", "help": "(default one per core)"},
    "--scheduler": {
        "metavar": "tcp://HOST:PORT",
        "help": "compute on the Dask cluster of this scheduler, whose machines run what it is told:"
        " use it on networks that you trust alone",
    },
    "--repair": {"action": "store_true", "help": "compute damaged blocks again"},
    "--import": {
        "type": module, "action": "append", "dest": "modules", "metavar": "MODULE",
        "help": "module or file.py with a neuron or rule of yours that the agent has",
    },
    "--trust": {
        "action": "store_true",
        "help": "open a model of Stable-Baselines3 that no run of yours wrote: it holds pickled "
        "objects, which may run any program when they are opened",
    },
}  # fmt: skip
"""Options that several verbs have: what argparse wants to know of each."""


def share(parser: Parser, option: str, **changes: Any) -> None:
    """Add an option of `SHARED`, with what is different here."""
    settings = {**SHARED[option], **changes}
    default, text = settings.get("default"), settings.get("help", "")
    if default not in (None, False) and "default" not in text:
        settings["help"] = f"{text} (default {default})".strip()
    parser.add_argument(option, **settings)


def share_run(parser: Parser) -> None:
    """The options of all verbs that compute experiments."""
    for option in ("--size", "--threads", "--scheduler", "--repair"):
        share(parser, option)


def parser(module: ModuleType, name: str, words: Sequence[str] = ()) -> Parser:
    """The parser of a verb, whose complaints begin with `name`."""
    made = Parser(name, module.__doc__ or "", words)
    module.options(made)
    share(made, "--json")
    return made


def parse(module: ModuleType, words: Sequence[object]) -> argparse.Namespace:
    """The options of a verb."""
    given = [str(word) for word in words]
    return parser(module, module.__name__.rpartition(".")[2], given).parse_args(given)


# --- running a verb ------------------------------------------------------------------------------


def run(
    find: Callable[[], ModuleType], words: Sequence[str], name: str, extras: Sequence[str] = ()
) -> NoReturn:
    """Find the module of a verb, parse, run and end the process. `extras`: what the verb needs.

    Bad input, a full disk, a missing package and the like end with exit code 2 and one line; Ctrl-C
    and SIGTERM with 130 and a line on what was kept; results that say what failed with 1.
    """
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):  # a terminal that lacks a letter shows another
            stream.reconfigure(errors="replace")
    os.environ.setdefault("MPLBACKEND", "Agg")  # pictures are files here, not windows
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    with _told(name, words, extras):
        module = find()
        options = parser(module, name, words).parse_args(words)
        with _resumable(module):
            result = module.main(options)
        if options.json:
            print(json.dumps(result))
    sys.exit(1 if result.get("failed") else 0)


@contextmanager
def _resumable(module: ModuleType) -> Iterator[None]:
    """Say of a run that was stopped whether it goes on when it is started again."""
    try:
        yield
    except Stopped:
        raise
    except KeyboardInterrupt:
        resumes = getattr(module, "RESUMES", False)
        kept = "what is finished is kept, run it again to go on" if resumes else "nothing is kept"
        raise Stopped(kept, {"stopped": True}) from None


@contextmanager
def _told(name: str, words: Sequence[str], extras: Sequence[str]) -> Iterator[None]:
    """End the process with one line on whatever a user can do something about."""
    try:
        yield
    except ModuleNotFoundError as error:
        extra = EXTRAS.get((error.name or "").partition(".")[0])
        wanted = ",".join(sorted({extra, *extras})) if extra else ""
        remedy = f': pip install "gnm-env[{wanted}]"' if wanted else ""
        _leave(2, f"{name}: {error.name} is not installed{remedy}")
    except (
        ValueError, OSError, ImportError, MemoryError, OverflowError, DependencyNotInstalled,
    ) as error:  # fmt: skip
        _leave(2, f"{name}: {' '.join(str(error).split()) or type(error).__name__}")
    except KeyboardInterrupt as stop:
        if isinstance(stop, Stopped) and "--json" in words:
            print(json.dumps(stop.result))
        _leave(130, f"{name}: stopped; {stop}")


def _leave(code: int, line: str) -> NoReturn:
    """End at once: threads may still be at a block, whose result nobody waits for any more."""
    sys.stdout.flush()
    print(line, file=sys.stderr, flush=True)
    os._exit(code)
