"""Pictures of the stream: input, patterns, answers and potential, as frames for `rgb_array`."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gnm_env import glyphs
from gnm_env.colours import FAINT, GREY, INK, MISTAKE, WHITE, Colour, class_colour, tint
from gnm_env.rules import too_few, too_many
from gnm_env.task import Patterns, Task

WINDOW = 200
"""Bins that a frame shows; the newest is on the right."""

MOST_POTENTIAL = 1e9
"""Potentials beyond this, in thresholds, are drawn here."""

Picture = NDArray[np.uint8]

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


@dataclass
class _Presentation:
    """What is owed as one sum: its bins, counted from the last `clear`, and the answer so far."""

    class_: int
    """−1: a trial of which only the label is known."""
    owed: float
    first: int
    end: int
    given: float = 0.0


class Scroll:
    """The last bins of a stream as a picture that scrolls to the left.

    From top to bottom: the input raster with each presentation shaded in the colour of its class;
    the output spikes, in vermillion where they are a mistake; spikes given / owed by each
    presentation; the membrane potential where one is known; and the fixed patterns, at the raster's
    own time scale where they fit.

    Args:
        n_inputs: N, number of input channels.
        task, patterns: the patterns to be shown; None where there are no fixed ones.
    """

    def __init__(self, n_inputs: int, task: Task | None, patterns: Patterns | None) -> None:
        self._n_inputs = n_inputs
        self._rows = _rows_of_channels(n_inputs, RASTER_HEIGHT)
        self._base = self._draw_base(task, patterns)
        self.clear()

    def clear(self) -> None:
        """Forget all bins: the beginning of a new trial."""
        self._n_bins = 0
        self._inputs = np.zeros((WINDOW, self._n_inputs), np.bool_)
        self._tints = np.full((WINDOW, 3), FAINT, np.uint8)  # FAINT: no bin yet
        self._outputs = np.zeros(WINDOW)
        self._wrong = np.zeros(WINDOW, np.bool_)
        self._potentials = np.full(WINDOW, np.nan)
        self._presentations: list[_Presentation] = []

    def present(self, class_: int, owed: float, n_bins: int) -> None:
        """Say that a presentation of `n_bins` bins begins with the bin that is pushed next.

        `class_` counts from 0, `owed` is the output that it is owed. Class −1 stands for a trial
        of which only the label is known: nothing is shaded, and the whole trial is owed the label.
        """
        self._presentations = [p for p in self._presentations if self._column(p.end) > 0]
        first = self._n_bins
        self._presentations.append(_Presentation(class_, owed, first, first + n_bins))

    def push(self, obs_row: NDArray[np.int8], output: float, potential: float = math.nan) -> None:
        """Add one bin and the answer to it.

        `obs_row` holds the bits of the bin (N,), `output` the spikes or the amount given,
        `potential` the membrane potential in units of its threshold (NaN: unknown).
        """
        now = self._present()
        if now is not None:
            now.given += output
        shade = WHITE if now is None or now.class_ < 0 else tint(class_colour(now.class_))
        given, owed = (output, 0) if now is None else (now.given, now.owed)
        wrong = output > 0 and too_many(given, owed)
        new: tuple[Any, ...] = (obs_row, shade, output, wrong, potential)
        histories = (self._inputs, self._tints, self._outputs, self._wrong, self._potentials)
        pairs: Any = zip(histories, new, strict=True)
        for history, value in pairs:
            history[:-1] = history[1:]
            history[-1] = value
        self._n_bins += 1

    def _present(self) -> _Presentation | None:
        """The presentation that the next bin belongs to; None in noise."""
        if self._presentations and self._n_bins < self._presentations[-1].end:
            return self._presentations[-1]
        return None

    def _column(self, bin_: int) -> int:
        """Where a bin stands in the window; negative if it has left it."""
        return WINDOW - self._n_bins + bin_

    def frame(self) -> Picture:
        """The picture, uint8 (height, width, 3); its size is always the same."""
        picture = self._base.copy()
        y = TOP
        self._draw_raster(picture, y)
        y += RASTER_HEIGHT + GAP
        self._draw_spikes(picture, y)
        y += SPIKE_HEIGHT
        self._draw_presentations(picture, TOP - 10, y + 4)
        y += COUNT_HEIGHT + GAP
        self._draw_potential(picture, y)
        return picture

    def _draw_base(self, task: Task | None, patterns: Patterns | None) -> Picture:
        """What stays the same in all frames: labels, frames and patterns."""
        pattern_top = TOP + RASTER_HEIGHT + SPIKE_HEIGHT + COUNT_HEIGHT + POTENTIAL_HEIGHT + 3 * GAP
        height = pattern_top + PATTERN_HEIGHT + 3 * GAP
        picture = np.full((height, LEFT + PLOT_WIDTH + RIGHT, 3), 255, np.uint8)
        y = TOP
        _label(picture, y + 8, "input")
        _label(picture, y + 20, f"{self._n_inputs} ch.")
        y += RASTER_HEIGHT + GAP
        _label(picture, y + 8, "output")
        _label(picture, y + SPIKE_HEIGHT + 3, "given/owed")
        _write(picture, TOP - 21, LEFT, f"last {WINDOW} bins", GREY)
        _write_right(picture, TOP - 21, LEFT + PLOT_WIDTH, "now", GREY)
        _label(picture, pattern_top + GAP + 14, "patterns")
        if task is None or patterns is None:
            _write(picture, pattern_top + GAP + 14, LEFT, "none: a data set of trials", GREY)
        else:
            self._draw_patterns(picture, pattern_top + GAP, patterns, task.owed)
        return picture

    def _draw_patterns(
        self, picture: Picture, top: int, patterns: Patterns, owed: tuple[int, ...]
    ) -> None:
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
            name = f"class {class_} owes {owed[class_]}"
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
        bins[:] = self._tints
        for t, channel in np.argwhere(self._inputs):
            bins[self._rows[channel], t] = INK
        area[:] = bins.repeat(BIN_WIDTH, axis=1)

    def _draw_spikes(self, picture: Picture, top: int) -> None:
        """A bar for each output; its height is the amount, up to one spike."""
        area = picture[top : top + SPIKE_HEIGHT, LEFT : LEFT + PLOT_WIDTH]
        area[:] = self._tints.repeat(BIN_WIDTH, axis=0)
        area[-1] = GREY
        largest = max(1.0, self._outputs.max())
        for t in np.flatnonzero(self._outputs > 0):
            height = math.ceil((SPIKE_HEIGHT - 2) * self._outputs[t] / largest)
            colour = MISTAKE if self._wrong[t] else INK
            area[SPIKE_HEIGHT - 1 - height : -1, t * BIN_WIDTH : (t + 1) * BIN_WIDTH] = colour

    def _draw_presentations(self, picture: Picture, class_top: int, count_top: int) -> None:
        """The class above each presentation, and below it spikes given / owed."""
        for one in self._presentations:
            x = LEFT + max(0, self._column(one.first)) * BIN_WIDTH
            if one.class_ >= 0:
                _write(picture, class_top, x, f"{one.class_}", class_colour(one.class_))
            _write(picture, count_top, x, f"{one.given:.3g}/{one.owed}", self._verdict(one))

    def _verdict(self, one: _Presentation) -> Colour:
        """Ink where what was given is what is owed, grey where it may still become so."""
        if too_many(one.given, one.owed):
            return MISTAKE
        if not too_few(one.given, one.owed):
            return INK
        return GREY if one.end > self._n_bins else MISTAKE

    def _draw_potential(self, picture: Picture, top: int) -> None:
        """The potential as a line, on a scale up to the power of two that holds it."""
        known = np.flatnonzero(np.isfinite(self._potentials))
        if known.size == 0:
            return
        area = picture[top : top + POTENTIAL_HEIGHT, LEFT : LEFT + PLOT_WIDTH]
        values = np.clip(self._potentials[known], -MOST_POTENTIAL, MOST_POTENTIAL)
        high = _power_of_two(max(2.0, values.max()))
        low = -_power_of_two(max(0.5, -values.min())) if values.min() < 0 else 0.0
        area[:] = WHITE

        def row(value: float) -> int:
            return round((POTENTIAL_HEIGHT - 1) * (high - value) / (high - low))

        area[row(0.0)] = FAINT
        area[row(1.0), np.arange(PLOT_WIDTH) // 4 % 2 == 0] = MISTAKE
        _write_right(picture, top + row(1.0) - 3, LEFT - 4, "threshold", MISTAKE)
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
