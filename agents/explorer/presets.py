"""Settings worth a look, each with what to notice. A link that names what is not there is left out.

`versus` is the link of what is kept beside it for comparison.
"""

from __future__ import annotations

from typing import Any, NamedTuple
from urllib.parse import parse_qsl

from agents.explorer.settings import parse


class Preset(NamedTuple):
    """A link, its title, what to notice, and the link of what stands beside it."""

    title: str
    notice: str
    link: str
    versus: str = ""


PRESETS = (
    Preset(
        "One class, learned",
        "After some ten thousand trials V crosses the threshold once in each shaded pattern and "
        "stays below it in the noise, though nobody ever said where the patterns are.",
        "",
    ),
    Preset(
        "The cliff at small α",
        "At α = 0.05 the neuron remembers too long to tell a pattern from noise. Drag α slowly up "
        "to 0.3: the score climbs from that of silence to near the cap (dashed).",
        "n.alpha=0.05",
        "n.alpha=0.3",
    ),
    Preset(
        "Silent for ever",
        "All weights start at 0, so V stays 0; modulated, the rule multiplies the error by V, "
        "and an error times nothing teaches nothing. Unmodulated (dashed) it comes to life.",
        "rule=et&r.modulate=1&initial_weight=0",
        "rule=et&initial_weight=0",
    ),
    Preset(
        "Above threshold for ever",
        "V rises above the threshold at once and decays too slowly to come back. Without an upward "
        "crossing there is no spike; too few, says the label, and the weights go further up.",
        "n.alpha=0.02&initial_weight=1",
    ),
    Preset(
        "MST against GNM",
        "Two classes from the wide start of the paper: the multi-spike tempotron, with its soft "
        "reset and slower synapses, falls behind the simplest neuron (dashed).",
        "neuron=mst&initial_weight=0.2&t.n_classes=2",
        "initial_weight=0.3&t.n_classes=2",
    ),
    Preset(
        "Error trace against aggregate label",
        "On these patterns, as on most, who is told where the error was learns two classes better "
        "than who is told its sign at the end (dashed). Move the pattern seed: not on all.",
        "rule=et&r.modulate=1&t.n_classes=2&pattern_seed=2",
        "t.n_classes=2&pattern_seed=2",
    ),
    Preset(
        "Critical threshold against ALL",
        "Both know only too many or too few. One moves the weights that would add or remove a "
        "single spike, the other all that were active while V was high (dashed).",
        "rule=critical&r.learning_rate=0.01&bounds=none&t.n_classes=2",
        "t.n_classes=2",
    ),
    Preset(
        "The label muted",
        "The same trials, but nobody says anything at their end: the weights stay where they were. "
        "Switch the label on again to see what one bit a trial is worth.",
        "mute=1",
        "",
    ),
)  # fmt: skip


def presets() -> list[dict[str, Any]]:
    """The presets whose neurons and rules are registered, ready for JSON."""
    return [preset._asdict() for preset in PRESETS if known(preset.link) and known(preset.versus)]


def known(link: str) -> bool:
    """Whether a link can be followed here."""
    try:
        parse(dict(parse_qsl(link, keep_blank_values=True)))
    except ValueError:
        return False
    return True
