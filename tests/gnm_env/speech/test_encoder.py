"""Sound becomes spikes where bands become louder or softer, whatever the volume and the file."""

from __future__ import annotations

import wave
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gnm_env.speech import CHANNELS, centres, encode, envelopes, read_wav, trial_of
from gnm_env.speech.phrases import TAIL

RATE = 16_000


def burst(frequency: float, start: float = 0.2, end: float = 0.5) -> Any:
    """A tone from `start` to `end` in 0.7 s of silence."""
    t = np.arange(int(0.7 * RATE)) / RATE
    return np.sin(2 * np.pi * frequency * t) * ((t >= start) & (t < end))


def test_centres_ascend_from_120_hz_to_7_khz() -> None:
    assert centres()[0] == pytest.approx(120) and centres()[-1] == pytest.approx(7_000)
    assert (np.diff(centres()) > 0).all() and len(centres()) == 24


@pytest.mark.parametrize("band", [2, 11, 20])
def test_a_tone_rises_through_both_levels_of_its_band_as_it_begins_and_falls_as_it_ends(
    band: int,
) -> None:
    times = encode(burst(centres()[band]), RATE)
    assert len(times) == CHANNELS == 96
    for level in (0, 1):
        up, down = times[4 * band + 2 * level], times[4 * band + 2 * level + 1]
        assert len(up) == len(down) == 1
        assert 0.19 < up[0] < 0.23
        assert 0.49 < down[0] < 0.55
    lower, upper = times[4 * band][0], times[4 * band + 2][0]
    assert lower <= upper


def test_a_band_hears_its_own_tone_best() -> None:
    """Two tones in turn: the envelope of a band is 1 in its own and below 1 in the other's."""
    low, high = burst(centres()[5], 0.05, 0.3), burst(centres()[18], 0.4, 0.65)
    envelope = envelopes(low + high, RATE)
    assert envelope[:350, 5].max() == 1.0 and envelope[420:, 5].max() < 0.5
    assert envelope[420:, 18].max() == 1.0 and envelope[:350, 18].max() < 0.5


def test_volume_changes_no_spike() -> None:
    sound = np.random.default_rng(0).normal(size=RATE) * np.hanning(RATE)
    for quiet, loud in zip(encode(sound, RATE), encode(1_000 * sound, RATE), strict=True):
        assert quiet.tolist() == pytest.approx(loud.tolist())


def test_each_level_is_crossed_up_and_down_in_turn() -> None:
    sound = np.random.default_rng(1).normal(size=RATE) * np.hanning(RATE)
    times = encode(sound, RATE)
    for up, down in zip(times[::2], times[1::2], strict=True):
        assert len(up) - len(down) in (0, 1)
        both = np.empty(len(up) + len(down))
        both[::2], both[1::2] = up, down
        assert (np.diff(both) > 0).all()


def test_silence_is_silent() -> None:
    assert sum(map(len, encode(np.zeros(RATE), RATE))) == 0


@pytest.mark.parametrize(
    ("sound", "rate", "why"),
    [
        (np.zeros(1_000), 8_000, "rate must be > 14100"),
        (np.zeros((1_000, 2)), RATE, "of stereo sound give one channel"),
        (np.full(1_000, np.nan), RATE, "sound must be finite"),
        (np.zeros(10), RATE, "at least 160 of them"),
    ],
)
def test_what_is_no_sound_is_refused(sound: Any, rate: int, why: str) -> None:
    with pytest.raises(ValueError, match=why):
        encode(sound, rate)


@pytest.mark.parametrize(("width", "kind"), [(1, "u1"), (2, "<i2"), (4, "<i4")])
def test_a_wav_file_is_heard_as_it_was_written(tmp_path: Path, width: int, kind: str) -> None:
    sound = 0.5 * burst(440.0)
    full = 2.0 ** (8 * width - 1)
    samples = np.round(sound * (full - 1) + (128 if width == 1 else 0)).astype(kind)
    with wave.open(str(tmp_path / "tone.wav"), "wb") as file:
        file.setnchannels(2)
        file.setsampwidth(width)
        file.setframerate(RATE)
        file.writeframes(np.repeat(samples, 2).tobytes())
    heard, rate = read_wav(tmp_path / "tone.wav")
    assert rate == RATE
    assert np.abs(heard - sound).max() < 2 / full + 1e-9
    trial = trial_of(heard, rate, label=3)
    assert trial.label == 3 and trial.label_only and trial.n_inputs == 96
    assert len(trial.channels) > 0 and (np.diff(trial.offsets)[-TAIL:] == 0).all()


def test_what_is_no_wav_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "text.wav").write_text("no sound")
    for name in ("text.wav", "missing.wav"):
        with pytest.raises(ValueError, match=r"cannot read .* as a wav file"):
            read_wav(tmp_path / name)
