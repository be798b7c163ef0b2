"""The compiled loops that drive every neuron and every rule.

The functions here are templates: `kernels(neuron, rule, width)` binds `step` and its types to a
neuron, `correction`, `teaching_signal` and `weight_change` to a rule, and WIDTH to a number of
neurons side by side: 1 for the standard loop, a bin at a time; 1 or more for whole trials of one or
of many neurons. They share every formula, and so end with the same bits.

A *block* holds WIDTH neurons; its arrays have shape (rows, WIDTH): parameters (one row a field),
weights and their previous changes (one row an input), state. Arrays of many blocks have shape
(blocks, rows, WIDTH).

`trial` holds one trial with its learning step, `streams` what drives it for many neurons,
`stepwise` what drives it a bin at a time, `slots` the names to be bound, `binding` binds them.
"""

from agents.kernels.binding import kernels, recorder
from agents.kernels.streams import MOST_SPIKES
from agents.kernels.trial import Block, Heard, Log

__all__ = ["MOST_SPIKES", "Block", "Heard", "Log", "kernels", "recorder"]
