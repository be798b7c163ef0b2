"""What the rules are given is checked when they are made, and each refusal is one sentence."""

from __future__ import annotations

import math
from typing import Any

import pytest

import agents
from agents import GNM, LIF, MST, NeuronAgent, learning
from agents.continuous import ContinuousAgent, ContinuousGNM
from agents.learning.rule import FEEDBACK
from tests.agents.learning.table import RULES

BAD: list[tuple[str, dict[str, Any], str]] = [
    ("CriticalThreshold", {"amount": 1}, "amount must be True or False, got 1"),
    ("PeakError", {"first_only": "yes"}, "first_only must be True or False, got 'yes'"),
    (
        "SurrogateGradient",
        {"surrogate": "box"},
        "surrogate must be one of 'superspike', 'triangle'",
    ),
    ("SurrogateGradient", {"k": -1.0}, "k must be >= 0, got -1"),
    ("SurrogateGradient", {"on_count": 2}, "on_count must be True or False, got 2"),
    ("ReSuMe", {"times": "odd"}, "times must be one of 'choose', 'even', got 'odd'"),
    ("ReSuMe", {"a": math.inf}, "a must be finite"),
    ("ReSuMe", {"tau": 0.0}, "tau must be > 0"),
    ("PSD", {"fast": 10.0}, "fast must be smaller than slow = 10, got 10"),
    ("PSD", {"slow": -1.0}, "slow must be > 0"),
    ("SPAN", {"tau": 0.0}, "tau must be > 0"),
    ("Chronotron", {"rule": "F"}, "rule must be one of 'E', 'I', got 'F'"),
    ("Chronotron", {"tau_q": 0.0}, "tau_q must be > 0"),
    ("Chronotron", {"gamma_r": -1.0}, "gamma_r must be >= 0"),
    ("STDP", {"tau_plus": 0.0}, "tau_plus must be > 0"),
    ("STDP", {"a_minus": -0.1}, "a_minus must be >= 0"),
    ("MSTDPET", {"tau_e": 0.0}, "tau_e must be > 0"),
    ("MSTDPET", {"a_plus": math.nan}, "a_plus must be finite"),
    ("PolicyGradient", {"width": 0.0}, "width must be > 0"),
    ("PolicyGradient", {"baseline_rate": 1.5}, "baseline_rate must be in 0 … 1, got 1.5"),
]
NAMES = [name for name in learning.__all__ if name not in ("AggregateLabel", "ErrorTrace")]


@pytest.mark.parametrize(("name", "fields", "message"), BAD)
def test_a_bad_parameter_is_refused(name: str, fields: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        getattr(learning, name)(**fields)


@pytest.mark.parametrize("name", NAMES)
def test_rate_momentum_and_schedule_are_checked_in_every_rule(name: str) -> None:
    rule = getattr(agents, name)
    for field, value in (("learning_rate", -1.0), ("momentum", 1.1), ("decay_trials", 0)):
        with pytest.raises(ValueError, match=field):
            rule(**{field: value})
    assert rule().feedback in FEEDBACK


def test_the_policy_gradient_is_for_neurons_that_do_not_notice_their_spikes() -> None:
    for neuron in (LIF(), MST(), GNM(readout="D")):
        with pytest.raises(ValueError, match="take no notice of them"):
            NeuronAgent(neuron, learning.PolicyGradient(), 4)
    NeuronAgent(GNM(eta=0.3), learning.PolicyGradient(), 4)


@pytest.mark.parametrize("name", [name for name in NAMES if name != "PolicyGradient"])
def test_rules_for_spikes_refuse_amounts(name: str) -> None:
    rule = getattr(learning, name)()
    if rule.needs_spikes:
        with pytest.raises(
            ValueError, match="for neurons that spike; a ContinuousGNM gives amounts"
        ):
            ContinuousAgent(ContinuousGNM(), rule, 4)
    else:
        ContinuousAgent(ContinuousGNM(), rule, 4)


@pytest.mark.parametrize("alpha", [0.0, 1.0])
def test_a_membrane_without_a_time_constant_asks_for_tau_q(alpha: float) -> None:
    with pytest.raises(ValueError, match="give tau_q"):
        NeuronAgent(GNM(alpha=alpha), learning.Chronotron(), 4)
    NeuronAgent(GNM(alpha=alpha), learning.Chronotron(tau_q=5.0), 4)
    NeuronAgent(GNM(alpha=alpha), learning.Chronotron(rule="I"), 4)


def test_feedback_is_what_the_rule_was_made_with() -> None:
    assert learning.CriticalThreshold().feedback == "sign"
    assert learning.CriticalThreshold(amount=True).feedback == "label"
    assert learning.SurrogateGradient().feedback == "presentations"
    assert learning.SurrogateGradient(on_count=True).feedback == "label"
    assert RULES["resume-even"].rule.learns_when_right
    assert not RULES["resume"].rule.learns_when_right
