"""What the command line of the explorer refuses before it serves anything."""

from __future__ import annotations

import pytest

from agents.commands import explore
from agents.commands.terminal import parse


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (["--port", "99999"], "--port must be in 0 … 65535, got 99999"),
        (["--link", "bogus"], "unknown setting 'bogus'"),
        (["--link", "neuron=bogus"], "there is no neuron 'bogus'"),
        (["--link", "versus=neuron%3Dlif%26n.eta%3D1"], "LIF has no field .eta."),
        (["--link", "versus=bogus%3D1"], "unknown setting 'bogus'"),
    ],
)
def test_a_link_that_means_nothing_and_a_port_that_is_none(words: list[str], why: str) -> None:
    with pytest.raises(ValueError, match=why):
        explore.main(parse(explore, [*words, "--no-browser"]))
