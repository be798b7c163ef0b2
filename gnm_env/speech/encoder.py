"""Sound into spikes: gammatone bands, their log envelopes, and when these cross levels.

    sound ─ 24 gammatone bands ─ power in windows of 10 ms ─ dB below the band's loudest ─ crossings

Each band has two levels and each level two channels, one for the envelope rising through it and one
for it falling: 96 channels, about 150 spikes for a spoken word.
"""

from __future__ import annotations

import functools
import wave
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gnm_env.checks import real

BANDS = 24
LOWEST, HIGHEST = 120.0, 7_000.0
"""Centres of the first and the last band, in Hz."""
RANGE = 30.0
"""The envelope is taken this many dB down from the loudest moment of its band."""
LEVELS = (0.35, 0.7)
"""Levels whose crossings are spikes, as fractions of RANGE above its floor."""
CHANNELS = BANDS * len(LEVELS) * 2
STEP, WINDOW = 0.001, 0.010
"""Step of the envelope, and the window over which power is averaged, in seconds."""


def centres() -> NDArray[np.float64]:
    """Centre frequencies of the bands in Hz, (24,), equally far apart on the ERB scale."""
    low, high = (21.4 * np.log10(1.0 + 0.00437 * f) for f in (LOWEST, HIGHEST))
    return np.asarray((10.0 ** (np.linspace(low, high, BANDS) / 21.4) - 1.0) / 0.00437)


@functools.lru_cache(maxsize=8)
def _filters(rate: float) -> tuple[tuple[NDArray[np.float64], NDArray[np.float64]], ...]:
    from scipy.signal import gammatone

    return tuple(gammatone(f, "iir", fs=rate) for f in centres())


def envelopes(sound: ArrayLike, rate: float) -> NDArray[np.float64]:
    """Log envelopes of the bands, (steps of 1 ms, 24): 1 at the band's loudest, 0 from 30 dB below.

    Args:
        sound: (samples,), one channel of sound.
        rate: samples per second, > 14,100.

    Raises ValueError if the sound is not finite, shorter than a window, or sampled too slowly.
    """
    from scipy.signal import lfilter

    rate = real("rate", rate, above=2.0 * HIGHEST + 100.0)
    samples = np.asarray(sound, np.float64)
    if samples.ndim != 1 or len(samples) < rate * WINDOW or not np.isfinite(samples).all():
        raise ValueError(
            f"sound must be finite samples in a row, at least {rate * WINDOW:.0f} of them, "
            f"got shape {samples.shape}; of stereo sound give one channel"
        )
    n_steps = int(len(samples) / rate / STEP)
    middles = (np.arange(n_steps) + 0.5) * STEP * rate
    first = np.clip(np.round(middles - WINDOW * rate / 2), 0, len(samples)).astype(np.int64)
    last = np.clip(np.round(middles + WINDOW * rate / 2), 0, len(samples)).astype(np.int64)
    power = np.empty((n_steps, BANDS))
    for band, (b, a) in enumerate(_filters(rate)):
        total = np.append(0.0, np.cumsum(np.square(lfilter(b, a, samples))))
        power[:, band] = (total[last] - total[first]) / (last - first)
    loudest = np.maximum(power.max(axis=0), 1e-30)
    below = 10.0 * np.log10(np.maximum(power / loudest, 1e-30))
    return np.clip(1.0 + below / RANGE, 0.0, 1.0)


def encode(sound: ArrayLike, rate: float) -> list[NDArray[np.float64]]:
    """Spike times in seconds of each of the 96 channels.

    Channel 4·b + 2·l + d has the crossings of level l (0 the lower) of band b, upward for d = 0 and
    downward for d = 1. Arguments and errors as for `envelopes`. `gnm_env.Trial.from_times` makes a
    trial of them.
    """
    envelope = envelopes(sound, rate)
    times: list[Any] = []
    for band in range(BANDS):
        for level in LEVELS:
            above = (envelope[:, band] >= level).astype(np.int8)
            change = np.diff(above, prepend=np.int8(0))
            times += [(np.flatnonzero(change == sign) + 0.5) * STEP for sign in (1, -1)]
    return times


def read_wav(path: str | Path) -> tuple[NDArray[np.float64], int]:
    """The sound in a wav file of 8, 16 or 32 bits, its channels averaged, and its sampling rate.

    Raises ValueError if the file is anything else.
    """
    try:
        with wave.open(str(path), "rb") as file:
            width, channels, rate = file.getsampwidth(), file.getnchannels(), file.getframerate()
            raw = file.readframes(file.getnframes())
    except (OSError, EOFError, wave.Error) as error:
        raise ValueError(f"cannot read {path} as a wav file: {error}") from None
    kinds: dict[int, Any] = {1: np.dtype("u1"), 2: np.dtype("<i2"), 4: np.dtype("<i4")}
    if width not in kinds:
        raise ValueError(
            f"a wav file must have 8, 16 or 32 bits a sample, got {8 * width}: convert {path}"
        )
    whole = len(raw) - len(raw) % (width * channels)
    samples = np.frombuffer(raw[:whole], kinds[width]).reshape(-1, channels).astype(np.float64)
    if width == 1:
        samples -= 128.0
    return samples.mean(axis=1) / 2.0 ** (8 * width - 1), rate
