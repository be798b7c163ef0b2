"""See an agent at work: in a window while it answers, or as a GIF or MP4."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from agents.policy import answer_of, as_agent
from gnm_env import Patterns, Task
from gnm_env.checks import MAX_BINS, choice, real, require_memory, whole
from gnm_env.files import atomic_write, path_of
from gnm_env.task import task_arrays

STREAM, TRIALS = "stream", "trials"
_IDS = {STREAM: "gnm/PatternStream-v0", TRIALS: "gnm/PatternTrial-v0"}
MOST_COLOURS = 64
"""Of a GIF: the pictures have few, and fewer make the file small."""

FRAME_BYTES = 2.0**20
"""About as many bytes as a frame has that an environment draws."""

Frame = NDArray[np.uint8]


def play(
    agent: Any,
    task: Task,
    patterns: Patterns,
    path: str | os.PathLike[str] | None = None,
    *,
    hears: str = STREAM,
    bins: int = 600,
    seed: int = 0,
    fps: float = 25.0,
    every: int = 2,
    scale: float = 1.0,
) -> dict[str, Any]:
    """Let an agent answer, learning off, and show it with its potential.

    Args:
        agent: an agent of this package, whose potential is shown, or anything with
            Stable-Baselines3's `predict` that hears the bits.
        task, patterns: what it hears.
        path: a file that ends in .gif or .mp4; None: a window, where a bin lasts 1/50 s.
        hears: "stream", the endless one, which begins anew after a mistake; or "trials".
        bins: number of bins to be answered.
        seed: of the stream.
        fps: frames per second of a file.
        every: bins from one frame of a file to the next.
        scale: width and height of a file's frames, as a fraction of what the environment draws.

    Returns:
        "bins" answered, "mistakes" (trials answered wrongly, with hears="trials"), and the "path".

    Raises:
        ValueError: if an argument is out of range, or if `agent` gives amounts on the stream.
        ImportError: if a package is missing; it says which extra brings it.
    """
    choice("hears", hears, (STREAM, TRIALS))
    bins, every = whole("bins", bins, low=1, high=MAX_BINS), whole("every", every, low=1)
    fps, scale = real("fps", fps, 0.01, 1000.0), real("scale", scale, above=0.0, high=1.0)
    task_arrays(task, patterns)  # refuses what does not belong together
    if not hasattr(agent, "potential"):
        as_agent(agent)  # refuses what cannot answer
    write = None if path is None else _writer(path_of(path, "write"))
    if write is _write_gif:  # which holds all its frames
        require_memory(
            f"a GIF of {bins // every:,} frames", FRAME_BYTES * scale**2 * (bins // every),
            "lower bins or scale, raise every, or write an .mp4",
        )  # fmt: skip
    graded = bool(getattr(agent, "graded", getattr(getattr(agent, "model", None), "graded", False)))
    if graded and hears == STREAM:
        raise ValueError(f"{type(agent).__name__} gives amounts, not spikes: use hears={TRIALS!r}")
    how: dict[str, Any] = {"output": "graded"} if graded else {}
    env = gym.make(
        _IDS[hears], task=task, patterns=patterns, disable_env_checker=True,
        render_mode="human" if write is None else "rgb_array", **how,
    )  # fmt: skip
    shown = None if path is None else os.fspath(path)
    told: dict[str, Any] = {"bins": bins, "mistakes": 0, "path": shown}
    frames = _frames(agent, env, bins, seed, every, told)
    try:
        if write is None:
            for _ in frames:
                pass
        else:
            write((_scaled(frame, scale) for frame in frames), Path(told["path"]), fps)
    finally:
        env.close()
    return told


def _frames(
    agent: Any, env: gym.Env[Any, Any], bins: int, seed: int, every: int, told: dict[str, Any]
) -> Iterator[Any]:
    """Answer `bins` bins; after every so many, what `render` gives. `told` counts mistakes."""
    answer = _answering(agent, env.unwrapped)
    obs, _ = env.reset(seed=seed)
    begins = True
    for t in range(bins):
        obs, _, terminated, truncated, info = env.step(answer(obs, begins))
        if (t + 1) % every == 0:
            yield env.render()
        begins = terminated or truncated
        if begins:
            wrong = abs(info.get("label", 0.0) - info.get("emitted", 0.0))
            beyond = getattr(agent, "wrong_beyond", 0.0)
            told["mistakes"] += int("mistake" in info or wrong > beyond)
            obs, _ = env.reset()


def _answering(agent: Any, env: Any) -> Callable[[NDArray[np.int8], bool], Any]:
    """answer(obs, begins): the action; an agent of this package also shows its potential."""
    if hasattr(agent, "potential"):

        def act(obs: NDArray[np.int8], begins: bool) -> Any:
            if begins:
                agent.begin_trial()
            action = agent.act(obs)
            env.potential = agent.potential / agent.model.threshold
            return np.array([action]) if isinstance(action, float) else action

        return act
    state: Any = None

    def predict(obs: NDArray[np.int8], begins: bool) -> Any:
        nonlocal state
        given = agent.predict(
            obs, state=state, episode_start=np.array([begins]), deterministic=True
        )
        action, state = answer_of(given)
        return action if np.size(action) > 1 else np.asarray(action).reshape(-1)[0]

    return predict


# --- files ---------------------------------------------------------------------------------------


def _writer(path: Path) -> Callable[[Iterator[Frame], Path, float], None]:
    """What writes frames to a file of this name; ValueError if nothing does."""
    writers = {".gif": _write_gif, ".mp4": _write_mp4}
    if path.suffix.lower() not in writers:
        raise ValueError(f"path must end in .gif or .mp4, got {path}")
    return writers[path.suffix.lower()]


def _scaled(frame: Frame, scale: float) -> Frame:
    """A smaller frame; sides are even, as MP4 wants them."""
    from PIL import Image

    height, width = (2 * max(1, math.floor(side * scale / 2)) for side in frame.shape[:2])
    if (height, width) == frame.shape[:2]:
        return frame
    picture = Image.fromarray(frame).resize((width, height), Image.Resampling.LANCZOS)
    return np.asarray(picture)


def _write_gif(frames: Iterator[Frame], path: Path, fps: float) -> None:
    """Frames that are alike in most places: the file holds what changes, in one palette."""
    image = _needed("PIL.Image")
    pictures = [image.fromarray(frame) for frame in frames]
    if not pictures:
        raise ValueError("there is no frame to write: let every be at most bins")
    palette = pictures[-1].quantize(MOST_COLOURS)
    none = image.Dither.NONE
    reduced = [picture.quantize(palette=palette, dither=none) for picture in pictures]
    with atomic_write(path) as file:
        reduced[0].save(
            file, format="GIF", save_all=True, append_images=reduced[1:], loop=0,
            duration=round(1000.0 / fps), optimize=True,
        )  # fmt: skip


def _write_mp4(frames: Iterator[Frame], path: Path, fps: float) -> None:
    ffmpeg = _needed("imageio_ffmpeg")
    writer = None
    for frame in frames:
        if writer is None:
            size = (frame.shape[1], frame.shape[0])
            writer = ffmpeg.write_frames(os.fspath(path), size, fps=fps, macro_block_size=2)
            writer.send(None)
        writer.send(np.ascontiguousarray(frame))
    if writer is None:
        raise ValueError("there is no frame to write: let every be at most bins")
    writer.close()


def _needed(module: str) -> Any:
    """A module of the extra "video"; ImportError says how to get it."""
    import importlib

    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise ImportError(
            f'GIF and MP4 need {error.name}, which is not installed: pip install "gnm-env[video]"',
            name=error.name,
        ) from None
