"""How much memory agents side by side take: stated here, and measured by a benchmark."""

from __future__ import annotations

from agents.training.source import Source
from gnm_env.checks import bytes_there

BYTES_PER_WEIGHT = 56
"""A weight and its last change, in the agent and side by side (32), the agent's room for the input
spikes of a trial (16), copies while they change hands (8)."""

BYTES_PER_AGENT = 16_500
"""Its Python objects and its room for the bins of a trial."""

BYTES_PER_BIN, BYTES_PER_SPIKE = 528, 8
"""Of the longest trial, in every thread: potential and whether it is above threshold for a block of
32 neurons (512) and where its spikes begin (16); and its spikes, in buffers that grow by doubling.
"""

BYTES_AT_LEAST = 4 * 2**20
"""What is left when all of these are small."""


def bytes_needed(n_weights: int, n_agents: int, source: Source, threads: int) -> float:
    """Most bytes that training takes, the agents included: O(N · agents + threads · trial · block).

    For trials that vary in length this goes by the mean length; they are seldom much longer.
    """
    return (
        BYTES_PER_WEIGHT * n_weights
        + BYTES_PER_AGENT * n_agents
        + (BYTES_PER_BIN + BYTES_PER_SPIKE * source.events_per_bin)
        * source.mean_bins
        * min(threads, n_agents)
        + BYTES_AT_LEAST
    )


def require_memory(n_weights: int, n_agents: int, source: Source, threads: int) -> None:
    """ValueError if agents with all that they need exceed the memory that is there."""
    needed, there = bytes_needed(n_weights, n_agents, source, threads), bytes_there()
    if needed > there:
        raise ValueError(
            f"{n_agents:,} agents of {source.n_inputs:,} inputs side by side need "
            f"{needed / 2**30:,.1f} GiB, this machine has {there / 2**30:,.1f}: "
            "take fewer agents at a time, shorter trials or fewer threads"
        )
