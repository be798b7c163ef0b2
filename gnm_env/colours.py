"""Colours of classes and of mistakes, defined here for every picture of the project.

After Okabe & Ito: apart for colour-blind eyes too. Vermillion is kept for mistakes. Classes count
from 0.
"""

from __future__ import annotations

Colour = tuple[int, int, int]
"""Red, green and blue, 0 … 255 each."""

WHITE: Colour = (255, 255, 255)
INK: Colour = (30, 30, 30)
GREY: Colour = (120, 120, 120)
FAINT: Colour = (225, 225, 225)
MISTAKE: Colour = (213, 94, 0)

CLASS_COLOURS: tuple[Colour, ...] = (
    (0, 114, 178), (230, 159, 0), (0, 158, 115), (204, 121, 167), (86, 180, 233), (170, 160, 20),
)  # fmt: skip


def class_colour(class_: int) -> Colour:
    """The colour of a class, from 0; colours come round again after the sixth."""
    return CLASS_COLOURS[class_ % len(CLASS_COLOURS)]


def tint(colour: Colour, strength: float = 0.25) -> Colour:
    """`colour` thinned with white: a background on which ink stays legible."""
    red, green, blue = (round(255 + strength * (value - 255)) for value in colour)
    return red, green, blue


def as_hex(colour: Colour) -> str:
    """`colour` as Matplotlib and web pages write it, '#0072b2' say."""
    return "#{:02x}{:02x}{:02x}".format(*colour)
