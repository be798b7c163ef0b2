"""Pictures of the stream: input, patterns, answers and potential, as frames for `rgb_array`."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gnm_env import glyphs
from gnm_env.task import Patterns, Task

WINDOW = 200
"""Bins that a frame shows; the newest is on the right."""

Picture = NDArray[np.uint8]
Colour = tuple[int, int, int]

# Layout in pixels.
BIN_WIDTH = 3
LEFT, RIGHT, TOP, GAP = 86, 10, 24, 10
RASTER_HEIGHT = 200
SPIKE_HEIGHT = 22
COUNT_HEIGHT = 14
POTENTIAL_HEIGHT = 80
PATTERN_HEIGHT = 100
LEAST_PATTERN_WIDTH = 36
PLOT_WIDTH = WINDOW * BIN_WIDTH

INK: Colour = (30, 30, 30)
GREY: Colour = (120, 120, 120)
FAINT: Colour = (225, 225, 225)
WRONG: Colour = (213, 94, 0)
# After Okabe & Ito: apart for colour-blind eyes too. Vermillion is kept for mistakes.
CLASS_COLOURS: tuple[Colour, ...] = (
    (0, 114, 178), (230, 159, 0), (0, 158, 115), (204, 121, 167), (86, 180, 233), (170, 160, 20),
)  # fmt: skip


def class_colour(class_: int) -> Colour:
    """The colour of a class; colours come round again after the sixth."""
    return CLASS_COLOURS[class_ % len(CLASS_COLOURS)]


def tint(colour: Colour, strength: float = 0.25) -> Colour:
    """`colour` thinned with white: a background on which ink stays legible."""
    red, green, blue = (round(255 + strength * (value - 255)) for value in colour)
    return red, green, blue


@dataclass
class _Occurrence:
    """One occurrence of a pattern: its first bin, counted from the last `clear`, and the answer."""

    first: int
    class_: int
    given: float = 0.0


class Scroll:
    """The last bins of a stream as a picture that scrolls to the left.

    From top to bottom: the input raster with each occurrence shaded in the colour of its class; the
    output spikes, in vermillion where they are a mistake; spikes given / owed by each occurrence;
    the membrane potential where one is known; and the fixed patterns, at the raster's own time
    scale where they fit.
    """

    def __init__(self, task: Task, patterns: Patterns) -> None:
        self._task = task
        self._rows = _rows_of_channels(task.n_inputs, RASTER_HEIGHT)
        self._base = self._draw_base(patterns)
        self.clear()

    def clear(self) -> None:
        """Forget all bins: the beginning of a new trial."""
        self._n_bins = 0
        self._inputs = np.zeros((WINDOW, self._task.n_inputs), np.bool_)
        self._classes = np.full(WINDOW, -2)  # -1: noise, -2: no bin yet
        self._outputs = np.zeros(WINDOW)
        self._wrong = np.zeros(WINDOW, np.bool_)
        self._potentials = np.full(WINDOW, np.nan)
        self._occurrences: list[_Occurrence] = []

    def push(
        self, obs_row: NDArray[np.int8], class_: int, output: float, potential: float = math.nan
    ) -> None:
        """Add one bin and the answer to it.

        `obs_row` holds the bits of the bin (N,), `class_` the class of the occurrence that it
        belongs to (−1: noise), `output` the spikes or the amount given, `potential` the membrane
        potential in units of its threshold (NaN: unknown).
        """
        new = (obs_row, class_, output, self._is_wrong(class_, output), potential)
        histories = (self._inputs, self._classes, self._outputs, self._wrong, self._potentials)
        for history, value in zip(histories, new, strict=True):
            history[:-1] = history[1:]
            history[-1] = value
        self._n_bins += 1

    def _is_wrong(self, class_: int, output: float) -> bool:
        """Whether the output is one that is not owed; adds it to its occurrence."""
        if class_ < 0:
            return output > 0
        if not self._occurrences or self._ends(self._occurrences[-1]) <= self._n_bins:
            self._occurrences = [o for o in self._occurrences if self._column(self._ends(o)) > 0]
            self._occurrences.append(_Occurrence(self._n_bins, class_))
        occurrence = self._occurrences[-1]
        occurrence.given += output
        return output > 0 and occurrence.given > self._task.owed[class_]

    def _ends(self, occurrence: _Occurrence) -> int:
        return occurrence.first + self._task.pattern_bins

    def _column(self, bin_: int) -> int:
        """Where a bin stands in the window; negative if it has left it."""
        return WINDOW - self._n_bins + bin_

    def frame(self) -> Picture:
        """The picture, uint8 (height, width, 3); its size depends on the task only."""
        picture = self._base.copy()
        y = TOP
        self._draw_raster(picture, y)
        y += RASTER_HEIGHT + GAP
        self._draw_spikes(picture, y)
        y += SPIKE_HEIGHT
        self._draw_occurrences(picture, TOP - 10, y + 4)
        y += COUNT_HEIGHT + GAP
        self._draw_potential(picture, y)
        return picture

    def _draw_base(self, patterns: Patterns) -> Picture:
        """What stays the same in all frames: labels, frames and patterns."""
        pattern_top = TOP + RASTER_HEIGHT + SPIKE_HEIGHT + COUNT_HEIGHT + POTENTIAL_HEIGHT + 3 * GAP
        height = pattern_top + PATTERN_HEIGHT + 3 * GAP
        picture = np.full((height, LEFT + PLOT_WIDTH + RIGHT, 3), 255, np.uint8)
        y = TOP
        _label(picture, y + 8, "input")
        _label(picture, y + 20, f"{self._task.n_inputs} ch.")
        y += RASTER_HEIGHT + GAP
        _label(picture, y + 8, "output")
        _label(picture, y + SPIKE_HEIGHT + 3, "given/owed")
        _write(picture, TOP - 21, LEFT, f"last {WINDOW} bins", GREY)
        _write_right(picture, TOP - 21, LEFT + PLOT_WIDTH, "now", GREY)
        _label(picture, pattern_top + GAP + 14, "patterns")
        self._draw_patterns(picture, pattern_top + GAP, patterns)
        return picture

    def _draw_patterns(self, picture: Picture, top: int, patterns: Patterns) -> None:
        n_classes, bins, n_inputs = patterns.shape
        room = PLOT_WIDTH + GAP
        shown = min(n_classes, room // (LEAST_PATTERN_WIDTH + GAP))
        width = min(bins * BIN_WIDTH, room // shown - GAP)
        rows = _rows_of_channels(n_inputs, PATTERN_HEIGHT)
        columns = np.arange(bins) * width // bins
        spike_width = max(1, width // bins)
        events = np.argwhere(patterns.dense()[:shown])
        x = LEFT
        for class_ in range(shown):
            box = picture[top + 12 : top + 12 + PATTERN_HEIGHT, x : x + width]
            box[:] = tint(class_colour(class_))
            for _, m, channel in events[events[:, 0] == class_]:
                box[rows[channel], columns[m] : columns[m] + spike_width] = INK
            name = f"class {class_} owes {self._task.owed[class_]}"
            if glyphs.width(name) > width:
                name = f"{class_}"
            _write(picture, top, x, name, INK)
            x += width + GAP
        if shown < n_classes:
            _label(picture, top + 26, f"and {n_classes - shown} more")

    def _draw_raster(self, picture: Picture, top: int) -> None:
        area = picture[top : top + RASTER_HEIGHT, LEFT : LEFT + PLOT_WIDTH]
        # One pixel a bin first, stretched at the end.
        bins = np.empty((RASTER_HEIGHT, WINDOW, 3), np.uint8)
        bins[:] = self._background()
        for t, channel in np.argwhere(self._inputs):
            bins[self._rows[channel], t] = INK
        area[:] = bins.repeat(BIN_WIDTH, axis=1)

    def _background(self) -> Picture:
        """Colour of each bin: the tint of its class, white in noise, grey where no bin is yet."""
        palette = np.array(
            [FAINT, (255, 255, 255), *(tint(class_colour(c)) for c in range(self._task.n_classes))],
            np.uint8,
        )
        return palette[self._classes + 2]

    def _draw_spikes(self, picture: Picture, top: int) -> None:
        """A bar for each output; its height is the amount, up to one spike."""
        area = picture[top : top + SPIKE_HEIGHT, LEFT : LEFT + PLOT_WIDTH]
        area[:] = self._background().repeat(BIN_WIDTH, axis=0)
        area[-1] = GREY
        largest = max(1.0, self._outputs.max())
        for t in np.flatnonzero(self._outputs > 0):
            height = math.ceil((SPIKE_HEIGHT - 2) * self._outputs[t] / largest)
            colour = WRONG if self._wrong[t] else INK
            area[SPIKE_HEIGHT - 1 - height : -1, t * BIN_WIDTH : (t + 1) * BIN_WIDTH] = colour

    def _draw_occurrences(self, picture: Picture, class_top: int, count_top: int) -> None:
        """The class above each occurrence, and below it spikes given / owed."""
        for occurrence in self._occurrences:
            x = LEFT + max(0, self._column(occurrence.first)) * BIN_WIDTH
            class_, given, owed = (
                occurrence.class_,
                occurrence.given,
                self._task.owed[occurrence.class_],
            )
            _write(picture, class_top, x, f"{class_}", class_colour(class_))
            under_way = self._ends(occurrence) > self._n_bins
            colour = INK if given == owed else GREY if under_way and given < owed else WRONG
            _write(picture, count_top, x, f"{given:.3g}/{owed}", colour)

    def _draw_potential(self, picture: Picture, top: int) -> None:
        """The potential as a line, on a scale up to the power of two that holds it."""
        known = np.flatnonzero(np.isfinite(self._potentials))
        if known.size == 0:
            return
        area = picture[top : top + POTENTIAL_HEIGHT, LEFT : LEFT + PLOT_WIDTH]
        values = self._potentials[known]
        high = _power_of_two(max(2.0, values.max()))
        low = -_power_of_two(max(0.5, -values.min())) if values.min() < 0 else 0.0
        area[:] = (255, 255, 255)

        def row(value: float) -> int:
            return round((POTENTIAL_HEIGHT - 1) * (high - value) / (high - low))

        area[row(0.0)] = FAINT
        area[row(1.0), np.arange(PLOT_WIDTH) // 4 % 2 == 0] = WRONG
        _write_right(picture, top + row(1.0) - 3, LEFT - 4, "threshold", WRONG)
        if row(low) - row(1.0) > 12:
            _write_right(picture, top + POTENTIAL_HEIGHT - 8, LEFT - 4, f"{low:g}", GREY)
        _write_right(picture, top, LEFT - 4, f"{high:g}", GREY)
        _write_right(picture, top, LEFT - 30, "potential", INK)
        before = row(values[0])
        for t, value in zip(known, values, strict=True):
            now = row(value)
            if t > 0 and np.isnan(self._potentials[t - 1]):
                before = now
            area[min(before, now) : max(before, now) + 1, t * BIN_WIDTH] = INK
            area[now, t * BIN_WIDTH : (t + 1) * BIN_WIDTH] = INK
            before = now


def _rows_of_channels(n_inputs: int, height: int) -> list[slice]:
    """Pixel rows of each channel: several for each if they are few, shared if they are many."""
    edges = np.arange(n_inputs + 1) * height // n_inputs
    # A pixel stays free between channels where there is room.
    gap = 1 if height // n_inputs >= 3 else 0
    return [
        slice(int(first), max(int(first) + 1, int(last) - gap))
        for first, last in itertools.pairwise(edges)
    ]


def _power_of_two(value: float) -> float:
    return float(2.0 ** math.ceil(math.log2(value)))


def _write(picture: Picture, y: int, x: int, text: str, colour: Colour) -> None:
    """Write `text` with its upper left corner at (y, x), cut off at the right edge."""
    ink = glyphs.mask(text)
    area = picture[y : y + ink.shape[0], x : x + ink.shape[1]]
    area[ink[:, : area.shape[1]]] = colour


def _write_right(picture: Picture, y: int, x: int, text: str, colour: Colour) -> None:
    _write(picture, y, max(0, x - glyphs.width(text)), text, colour)


def _label(picture: Picture, y: int, text: str) -> None:
    _write_right(picture, y, LEFT - 8, text, INK)
