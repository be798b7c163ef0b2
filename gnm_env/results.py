"""Results on the suite's levels: one small file per training, written from any loop.

A `Recorder` counts what an agent hears while it learns, and takes its scores: bins survived on the
streams that belong to the level and the pattern seed. `read_results` reads a folder of its files
and refuses, in one sentence, what is not a result of this version of the suite.
"""

from __future__ import annotations

import itertools
import json
import os
import re
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any, cast

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv, VectorWrapper
from numpy.typing import NDArray

from gnm_env.checks import real, shown, whole, whole_array
from gnm_env.files import atomic_write
from gnm_env.levels import VERSION, Level, suite
from gnm_env.trial_task.env import PatternTrialEnv
from gnm_env.trial_task.vector import PatternTrialVectorEnv
from gnm_env.wrappers import SeededEpisodes

__all__ = ["Recorder", "Result", "Score", "read_result", "read_results"]

FORMAT = "gnm suite result"
FORMAT_VERSION = 1
MAX_FILE = 16 * 2**20
"""Bytes of the largest file that is read."""
MAX_NAME = 60
MAX_SCORES = 1_000


@dataclass(frozen=True)
class Score:
    """How long an agent survived after so much training; checks itself.

    Attributes:
        heard: bins heard in training before.
        seconds: of training before, without the scoring.
        survived: bins survived on each stream of the level, run by run.
    """

    heard: int
    seconds: float
    survived: tuple[int, ...]

    def __post_init__(self) -> None:
        runs, cap = suite().runs, suite().cap
        object.__setattr__(self, "heard", whole("heard", self.heard, low=0))
        object.__setattr__(self, "seconds", real("seconds", self.seconds, low=0.0))
        survived = tuple(whole_array("survived", self.survived, 0, cap).tolist())
        if len(survived) != runs:
            raise ValueError(f"survived must have one number for each of {runs} streams, got "
                             f"{len(survived)}")  # fmt: skip
        object.__setattr__(self, "survived", survived)

    @property
    def mean(self) -> float:
        """Noisy performance, in bins."""
        return float(np.mean(self.survived))


@dataclass(frozen=True)
class Result:
    """The scores of one training on one level and one pattern seed; checks itself.

    Attributes:
        level: name of the level.
        pattern_seed: of its patterns.
        learner: what the agent is called in tables, at most 60 characters.
        scores: by bins heard, ascending; the last one counts.
        parameters: number of the agent's trainable parameters; None: not told.
        command: what makes the same file again, for the reader.
    """

    level: str
    pattern_seed: int
    learner: str
    scores: tuple[Score, ...]
    parameters: int | None = None
    command: str = ""

    def __post_init__(self) -> None:
        suite()[self.level]  # refuses what there is not
        whole("pattern seed", self.pattern_seed, low=0)
        _checked_text("learner", self.learner, least=1, most=MAX_NAME)
        _checked_text("command", self.command, least=0, most=1_000)
        if self.parameters is not None:
            whole("parameters", self.parameters, low=0)
        scores = tuple(self.scores)
        if not 1 <= len(scores) <= MAX_SCORES or not all(isinstance(s, Score) for s in scores):
            raise ValueError(f"scores must be 1 … {MAX_SCORES} of Score, got {shown(self.scores)}")
        heard = [score.heard for score in scores]
        if heard != sorted(set(heard)):
            raise ValueError(f"scores must be by bins heard, ascending, got {shown(heard)}")
        object.__setattr__(self, "scores", scores)

    @property
    def last(self) -> Score:
        """The score after the whole training."""
        return self.scores[-1]

    @property
    def file_name(self) -> str:
        """Of its file: level and pattern seed, after the learner in letters that any disk takes."""
        learner = re.sub(r"[^a-z0-9]+", "-", self.learner.lower()).strip("-") or "agent"
        return f"{learner}-{self.level}-{self.pattern_seed}.json"

    def write(self, folder: str | os.PathLike[str]) -> Path:
        """Write its file into `folder`, made if need be; whole or not at all. Returns the path."""
        place = Path(folder)
        try:
            place.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ValueError(
                f"cannot make the folder {place}: {error.strerror}; choose another"
            ) from None
        contents = {
            "format": FORMAT,
            "format_version": FORMAT_VERSION,
            "level_version": VERSION,
            **_protocol(suite()[self.level], self.pattern_seed),
            **asdict(self),
        }
        with atomic_write(place / self.file_name) as file:
            file.write((json.dumps(contents) + "\n").encode())
        return place / self.file_name


def _checked_text(name: str, value: Any, least: int, most: int) -> None:
    if not isinstance(value, str) or not least <= len(value) <= most or not value.isprintable():
        raise ValueError(
            f"{name} must be a line of {least} … {most} characters, got {shown(value)}"
        )


def _protocol(level: Level, pattern_seed: int) -> dict[str, Any]:
    """What a score depends on beside the agent; a file of anything else is refused."""
    task = {name: list(v) if isinstance(v, tuple) else v for name, v in asdict(level.task).items()}
    return {
        "task": task,
        "evaluation_seed": level.evaluation_seed(pattern_seed),
        "runs": suite().runs,
        "cap": suite().cap,
    }


def read_result(path: str | os.PathLike[str]) -> Result:
    """The result in a file.

    Raises ValueError, in one sentence, if it is missing, damaged, or a result of another version of
    the format, of another level, or of a level whose task or streams were others.
    """
    place = Path(path)
    try:
        size = place.stat().st_size
        if size > MAX_FILE:
            raise ValueError(f"it has {size:,} bytes, a result at most {MAX_FILE:,}")
        contents = json.loads(place.read_bytes())
    except OSError as error:
        raise ValueError(f"cannot read the result {place}: {error.strerror}") from None
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{place} is not a readable result: {error}; record it again") from None
    if not isinstance(contents, dict) or contents.get("format") != FORMAT:
        raise ValueError(f"{place} is not a result: give files that gnm_env.results.Recorder wrote")
    for name, version in (("format_version", FORMAT_VERSION), ("level_version", VERSION)):
        if contents.get(name) != version:
            raise ValueError(
                f"{place} is a result of {name.replace('_', ' ')} {shown(contents.get(name))}, "
                f"and this gnm-env reads {version}: record it again with this one"
            )
    try:
        return _result(contents)
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        reason = f"{error.args[0]!r} is missing" if isinstance(error, KeyError) else str(error)
        raise ValueError(f"{place} is not a result of this suite: {reason}") from None


def _result(contents: Mapping[str, Any]) -> Result:
    own = {field.name for field in fields(Result)}
    protocol_names = {"task", "evaluation_seed", "runs", "cap"}
    known = own | protocol_names | {"format", "format_version", "level_version"}
    unknown = sorted(set(contents) - known)
    if unknown:
        raise ValueError(f"{shown(unknown[0])} does not belong there")
    scores = tuple(Score(**score) for score in contents["scores"])
    result = Result(**{**{name: contents[name] for name in own}, "scores": scores})
    expected = _protocol(suite()[result.level], result.pattern_seed)
    for name, value in expected.items():
        if contents[name] != value:
            raise ValueError(
                f"its {name.replace('_', ' ')} is another than that of level {result.level}, "
                f"{shown(contents[name])}"
            )
    return result


def read_results(folder: str | os.PathLike[str]) -> list[Result]:
    """All results in a folder, by learner, level and pattern seed.

    Raises ValueError as `read_result` does, if there is none, or if two are of the same training.
    """
    place = Path(folder)
    if not place.is_dir():
        raise ValueError(
            f"there is no folder {place}; give one that gnm_env.results.Recorder wrote into"
        )
    results = [read_result(path) for path in sorted(place.glob("*.json"))]
    if not results:
        raise ValueError(f"there is no result in {place}; gnm_env.results.Recorder writes them")
    results.sort(key=_place)
    for one, other in itertools.pairwise(results):
        if _place(one) == _place(other):
            raise ValueError(
                f"{place} holds two results of {one.learner!r} on level {one.level}, pattern seed "
                f"{one.pattern_seed}: keep one of them"
            )
    return results


def _place(result: Result) -> tuple[str, int, int]:
    return result.learner, list(suite()).index(result.level), result.pattern_seed


# --- recording ------------------------------------------------------------------------------------


class Recorder:
    """Writes the result of one training, whatever trains.

        recorder = Recorder("results/mine", "1class", pattern_seed=100, learner="mine")
        env = recorder.watch(level.trial_env(pattern_seed=100))   # counts the bins heard
        …                                                         # any loop
        recorder.enter(survived)                                  # writes the file

    `survived` comes from `agents.suite.score`, from `agents.noisy_performance` with this
    recorder's `seed`, or from the episodes of `streams()`, which enters them itself.

    Args:
        folder: where the file goes; made if need be.
        level: name or id of a level, or the level.
        pattern_seed: of its patterns.
        learner: what the agent is called in tables.
        parameters: number of its trainable parameters.
        command: what makes the same file again.

    Attributes:
        level, pattern_seed: what is learned.
        seed: of the first stream of a score.

    Raises:
        ValueError: if an argument is not what it should be.
    """

    def __init__(
        self,
        folder: str | os.PathLike[str],
        level: str | Level,
        pattern_seed: int,
        learner: str,
        *,
        parameters: int | None = None,
        command: str = "",
    ) -> None:
        self._folder = folder
        self.level = suite()[level.name if isinstance(level, Level) else level]
        self.pattern_seed = whole("pattern seed", pattern_seed, low=0)
        self.seed = self.level.evaluation_seed(self.pattern_seed)
        self._watched: list[_WatchedEnv | _WatchedEnvs] = []
        self._learner, self._parameters, self._command = learner, parameters, command
        self._scores: list[Score] = []
        self._result((Score(0, 0.0, (0,) * suite().runs),))  # refuses bad arguments now, not later
        self._since: float | None = None
        self._seconds = 0.0

    @property
    def heard(self) -> int:
        """Bins heard so far in the environments that are watched."""
        return sum(env.heard for env in self._watched)

    def watch(self, env: Any) -> Any:
        """`env`, single or vector, as it is, its bins counted; training time counts from here on.

        Raises ValueError if it is not `level.trial_env(pattern_seed)`, or `trial_envs`, wrapped or
        not.
        """
        bare = env.unwrapped
        task, patterns = getattr(bare, "task", None), getattr(bare, "patterns", None)
        trial = isinstance(bare, (PatternTrialEnv, PatternTrialVectorEnv))
        if (
            not trial
            or task != self.level.task
            or patterns != self.level.patterns(self.pattern_seed)
        ):
            raise ValueError(
                f"the environment must be {self.level.trial_id} with pattern_seed = "
                f"{self.pattern_seed}, got another; "
                f"make it with suite()[{self.level.name!r}].trial_env({self.pattern_seed})"
            )
        watched = _WatchedEnvs(env) if isinstance(env, VectorEnv) else _WatchedEnv(env)
        self._watched.append(watched)
        self.begin()
        return watched

    def begin(self) -> None:
        """Training begins, or goes on after a score: its time counts from here."""
        if self._since is None:
            self._since = time.perf_counter()

    def pause(self) -> None:
        """Training stops for a while, say to be scored."""
        if self._since is not None:
            self._seconds += time.perf_counter() - self._since
            self._since = None

    def enter(
        self, survived: Sequence[int] | NDArray[np.int64], *, heard: int | None = None
    ) -> Path:
        """Enter a score and write the file, with all earlier scores. Returns its path.

        Args:
            survived: bins survived on the streams of `seed`, `seed` + 1, …, one number for each.
            heard: bins heard so far, where another counted them than `watch`.

        Raises:
            ValueError: for other numbers, or if the file cannot be written.
        """
        self.pause()
        heard = self.heard if heard is None else whole("heard", heard, low=0)
        score = Score(heard, round(self._seconds, 3), survived)  # type: ignore[arg-type]
        kept = [earlier for earlier in self._scores if earlier.heard < score.heard]
        result = self._result((*kept, score))
        path = result.write(self._folder)
        self._scores = list(result.scores)
        if self._watched:
            self.begin()
        return path

    def streams(self) -> gym.Env[Any, Any]:
        """The streams of a score, one an episode; after the last of them it is entered.

        The k-th `reset` begins stream k, whatever seed it is called with: any loop over
        `suite().runs` episodes is a score, and none but learning-free agents belong here.
        """
        self.pause()
        bare = self.level.stream_env(self.pattern_seed)
        return _Scored(SeededEpisodes(bare, self.seed), self)

    def _result(self, scores: tuple[Score, ...]) -> Result:
        return Result(
            self.level.name,
            self.pattern_seed,
            self._learner,
            scores,
            self._parameters,
            self._command,
        )


class _WatchedEnv(gym.Wrapper[Any, Any, Any, Any]):
    """Counts the bins of one environment: trial by trial, since a step is soon done."""

    def __init__(self, env: gym.Env[Any, Any]) -> None:
        super().__init__(env)
        self.step = env.step  # type: ignore[method-assign]  # no call more than without it
        self._bare = cast(Any, env.unwrapped)
        self._earlier = -self._bare.n_answered

    @property
    def heard(self) -> int:
        """Bins answered so far."""
        return int(self._earlier + self._bare.n_answered)

    def reset(self, **arguments: Any) -> tuple[Any, dict[str, Any]]:
        answered = self._bare.n_answered
        told = self.env.reset(**arguments)
        self._earlier += answered
        return told


class _WatchedEnvs(VectorWrapper[Any, Any, Any, Any, Any]):
    """Counts the bins of environments side by side; a step that only resets one is no bin."""

    def __init__(self, env: VectorEnv[Any, Any, Any]) -> None:
        super().__init__(env)
        self._step = env.step
        self._bare: Any = env.unwrapped
        self._skips = env.metadata.get("autoreset_mode") == AutoresetMode.NEXT_STEP
        self._steps = self._ended = self._last_ended = 0

    @property
    def heard(self) -> int:
        """Bins answered so far, by all together."""
        return self._steps * self.num_envs - (self._ended - self._last_ended)

    def reset(self, **arguments: Any) -> tuple[Any, dict[str, Any]]:
        self._ended, self._last_ended = self._ended - self._last_ended, 0
        return self.env.reset(**arguments)

    def step(self, actions: Any) -> Any:
        told = self._step(actions)
        self._steps += 1
        if self._skips:
            # The environments know it; a look at the arrays would take a tenth of a step.
            self._last_ended = self._bare.n_done
            self._ended += self._last_ended
        return told


class _Scored(gym.Wrapper[Any, Any, Any, Any]):
    """Enters the bins survived in as many episodes as a score has streams."""

    def __init__(self, env: gym.Env[Any, Any], recorder: Recorder) -> None:
        super().__init__(env)
        self._recorder = recorder
        self._survived: list[int] = []
        self._bins = 0
        self._ended = True

    def reset(self, **arguments: Any) -> tuple[Any, dict[str, Any]]:
        if not self._ended:
            raise ValueError(
                f"stream {len(self._survived)} has not come to its end: go on until it is "
                "terminated or truncated, else the score would leave it out"
            )
        self._bins, self._ended = 0, False
        return self.env.reset(**arguments)

    def step(self, action: Any) -> Any:
        told = self.env.step(action)
        self._bins += not told[2]
        if told[2] or told[3]:
            self._ended = True
            self._survived.append(self._bins)
            if len(self._survived) == suite().runs:
                self._recorder.enter(self._survived)
        return told
