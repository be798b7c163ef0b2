"""Synthetic speech from eSpeak NG, called through ctypes.

Needs the extra `speech`, which installs espeakng-loader: the compiled library with its data. eSpeak
NG is published by its authors under the GNU GPL, version 3 or later; the package of espeakng-loader
itself carries no licence text. It is optional, nothing of it is part of this project, and what
follows runs without it on recordings or on the spike file that ships with the project.
"""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

SYNCHRONOUS, UTF8 = 2, 1
RATE, PITCH, PITCH_RANGE = 1, 3, 4
"""Numbers of eSpeak's parameters."""
LIST_END, WORD = 0, 1
"""Types of eSpeak's events."""
ACCENTS = (
    "en-us", "en", "en-029", "en-gb-scotland", "en-gb-x-gbclan", "en-gb-x-gbcwmd",
    "en-gb-x-rp", "en-us-nyc",
)  # fmt: skip
"""Accents of English that eSpeak knows."""


class _Id(ctypes.Union):
    _fields_ = [("number", ctypes.c_int), ("name", ctypes.c_char_p), ("string", ctypes.c_char * 8)]


class _Event(ctypes.Structure):
    _fields_ = [
        ("type", ctypes.c_int),
        ("unique_identifier", ctypes.c_uint),
        ("text_position", ctypes.c_int),
        ("length", ctypes.c_int),
        ("audio_position", ctypes.c_int),
        ("sample", ctypes.c_int),
        ("user_data", ctypes.c_void_p),
        ("id", _Id),
    ]


class _Voice(ctypes.Structure):
    _fields_ = [
        ("name", ctypes.c_char_p),
        ("languages", ctypes.c_char_p),
        ("identifier", ctypes.c_char_p),
        ("gender", ctypes.c_ubyte),
        ("age", ctypes.c_ubyte),
        ("variant", ctypes.c_ubyte),
        ("xx1", ctypes.c_ubyte),
        ("score", ctypes.c_int),
        ("spare", ctypes.c_void_p),
    ]


_Callback = ctypes.CFUNCTYPE(
    ctypes.c_int, ctypes.POINTER(ctypes.c_short), ctypes.c_int, ctypes.POINTER(_Event)
)


@dataclass(frozen=True, eq=False)
class Utterance:
    """What was said.

    Attributes:
        sound: float64 (samples,), within −1 … 1.
        rate: samples per second.
        onsets: float64 (words,), where each word begins, in seconds.
    """

    sound: NDArray[np.float64]
    rate: int
    onsets: NDArray[np.float64]


class ESpeak:
    """The synthesiser. One for each process, from `espeak()`; not for several threads at once.

    The same text gives a slightly different sound from call to call.
    """

    def __init__(self) -> None:
        try:
            import espeakng_loader
        except ImportError:
            raise ImportError(
                "speech is synthesised by eSpeak NG, which is not installed: "
                'pip install "gnm-env[speech]"'
            ) from None
        self._library = ctypes.CDLL(espeakng_loader.get_library_path())
        data = str(espeakng_loader.get_data_path()).encode()
        self.rate = int(self._library.espeak_Initialize(SYNCHRONOUS, 0, data, 0))
        if self.rate <= 0:
            raise RuntimeError(f"eSpeak NG could not be started with its data in {data.decode()}")
        self._sound: list[NDArray[np.int16]] = []
        self._words: list[tuple[int, float]] = []
        self._callback = _Callback(self._take)  # must live as long as the library
        self._library.espeak_SetSynthCallback(self._callback)

    def _take(self, sound: Any, n: int, events: Any) -> int:
        """Called by eSpeak with each piece of sound and what begins in it."""
        if sound and n > 0:
            self._sound.append(np.ctypeslib.as_array(sound, (n,)).copy())
        k = 0
        while events and events[k].type != LIST_END:
            if events[k].type == WORD:
                self._words.append((events[k].text_position - 1, events[k].audio_position / 1e3))
            k += 1
        return 0

    def variants(self) -> list[str]:
        """Names of the speakers that can be put on any accent, sorted."""
        query = _Voice(languages=b"variant")
        self._library.espeak_ListVoices.restype = ctypes.POINTER(ctypes.POINTER(_Voice))
        listed = self._library.espeak_ListVoices(ctypes.byref(query))
        names, k = [], 0
        while listed[k]:
            names.append(listed[k].contents.identifier.decode().removeprefix("!v/"))
            k += 1
        return sorted(names)

    def say(
        self, text: str, voice: str, *, rate: int = 175, pitch: int = 50, pitch_range: int = 50
    ) -> Utterance:
        """Say `text` in `voice`, such as "en-us" or "en-us+f2".

        Args:
            text: words between single spaces; a comma after a word makes a pause.
            voice: an accent, or accent + variant.
            rate: words per minute, 80 … 450.
            pitch, pitch_range: 0 … 100.

        Raises ValueError if there is no such voice.
        """
        if self._library.espeak_SetVoiceByName(voice.encode()) != 0:
            raise ValueError(
                f"voice must be one that eSpeak knows, such as en-us+f2, got {voice!r}"
            )
        for number, value in ((RATE, rate), (PITCH, pitch), (PITCH_RANGE, pitch_range)):
            self._library.espeak_SetParameter(number, int(value), 0)
        self._sound, self._words = [], []
        spoken = text.encode()
        failed = self._library.espeak_Synth(spoken, len(spoken) + 1, 0, 1, 0, UTF8, None, None)
        if failed or not self._sound:
            raise RuntimeError(f"eSpeak NG could not say {text!r} in {voice!r}")
        begins = np.cumsum([0] + [len(word) + 1 for word in text.split(" ")[:-1]])
        onset_of = dict(self._words)
        if not set(begins.tolist()) <= set(onset_of):
            raise RuntimeError(f"eSpeak NG did not tell where the words of {text!r} begin")
        sound = np.concatenate(self._sound) / 2.0**15
        return Utterance(sound, self.rate, np.array([onset_of[k] for k in begins.tolist()]))


@cache
def espeak() -> ESpeak:
    """The synthesiser of this process. ImportError says what to install where it is missing."""
    return ESpeak()
