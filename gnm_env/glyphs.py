"""A pixel font, 5 × 7 and two rows below the line, to label frames with nothing but NumPy."""

from __future__ import annotations

import functools

import numpy as np
from numpy.typing import NDArray

HEIGHT = 9
ADVANCE = 6
"""Pixels from one character to the next, before scaling."""

# Rows from top to bottom, two hexadecimal digits each; bit 4 is the left column.
_ROWS = {
    "0": "0E11131519110E", "1": "040C040404040E", "2": "0E11010204081F",
    "3": "1F02040201110E", "4": "02060A121F0202", "5": "1F101E0101110E",
    "6": "0608101E11110E", "7": "1F010204080808", "8": "0E11110E11110E",
    "9": "0E11110F01020C", "a": "00000E010F110F", "b": "1010161911111E",
    "c": "00000E1010110E", "d": "01010D1311110F", "e": "00000E111F100E",
    "f": "0609081C080808", "g": "00000F1111110F010E", "h": "10101619111111",
    "i": "04000C0404040E", "j": "02000602020202020C", "k": "10101214181412",
    "l": "0C04040404040E", "m": "00001A15151111", "n": "00001619111111",
    "o": "00000E1111110E", "p": "00001E1111111E1010", "q": "00000F1111110F0101",
    "r": "00001619101010", "s": "00000E100E011E", "t": "08081C08080906",
    "u": "0000111111130D", "v": "00001111110A04", "w": "0000111115150A",
    "x": "0000110A040A11", "y": "0000111111110F010E", "z": "00001F0204081F",
    "/": "00010204081000", "-": "0000001F000000", "+": "0004041F040400",
    ".": "00000000000C0C", "(": "02040808080402", ")": "08040202020408",
    " ": "00000000000000",
}  # fmt: skip


def width(text: str, scale: int = 1) -> int:
    """Width in pixels of `text`."""
    return max(0, len(text) * ADVANCE - 1) * scale


@functools.lru_cache(maxsize=256)
def mask(text: str, scale: int = 1) -> NDArray[np.bool_]:
    """The pixels of `text` that are ink, bool (HEIGHT·scale, width(text, scale)); read-only.

    Knows digits, small letters and / - + . ( ); anything else is left blank.
    """
    ink = np.zeros((HEIGHT, max(0, len(text) * ADVANCE - 1)), np.bool_)
    for k, character in enumerate(text):
        rows = np.frombuffer(bytes.fromhex(_ROWS.get(character, _ROWS[" "])), np.uint8)
        bits = np.unpackbits(rows[:, None], axis=1)[:, 3:]
        ink[: len(bits), k * ADVANCE : k * ADVANCE + 5] = bits
    ink = ink.repeat(scale, axis=0).repeat(scale, axis=1)
    ink.flags.writeable = False
    return ink
