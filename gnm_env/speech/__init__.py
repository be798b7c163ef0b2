"""Speech as trials: phrases of spoken digits, and how sound becomes spikes.

`digits()` are phrases that ship with the project; `trial_of(*read_wav(path), label)` makes a trial
of a recording of yours. New phrases are synthesised by eSpeak NG, which the extra `speech`
installs.
"""

from gnm_env.speech.encoder import CHANNELS, centres, encode, envelopes, read_wav
from gnm_env.speech.phrases import (
    BIN,
    counting,
    digits,
    located,
    make,
    make_digits,
    part,
    trial_of,
)
from gnm_env.speech.voices import DIGITS

__all__ = [
    "BIN",
    "CHANNELS",
    "DIGITS",
    "centres",
    "counting",
    "digits",
    "encode",
    "envelopes",
    "located",
    "make",
    "make_digits",
    "part",
    "read_wav",
    "trial_of",
]
