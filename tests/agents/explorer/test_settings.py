"""A link says all; the page offers what the classes have."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest

from agents import GNM, LIF, MST, AggregateLabel, ErrorTrace, registry
from agents.explorer import controls
from agents.explorer.presets import PRESETS, known, presets
from agents.explorer.settings import Settings, parse
from gnm_env import Task
from gnm_env.colours import as_hex, class_colour


def test_no_link_is_the_defaults() -> None:
    assert parse({}) == Settings(GNM(), AggregateLabel(), Task())


def test_a_link_sets_fields_of_neuron_rule_and_task() -> None:
    link = {
        "neuron": "mst", "n.tau_m": "15", "rule": "et", "r.modulate": "1", "r.trace_decay": "none",
        "t.n_classes": "2", "t.targets": "1,0", "trials": "500", "seed": "3", "pattern_seed": "4",
        "initial_weight": "0.2", "bounds": "-1,2", "mute": "1", "shown": "9",
    }  # fmt: skip
    task = Task(n_classes=2, targets=(1, 0))
    assert parse(link) == Settings(
        MST(tau_m=15.0), ErrorTrace(modulate=True), task, 500, 3, 4, 0.2, (-1.0, 2.0), True, 9
    )


def test_equal_settings_are_one_key() -> None:
    assert hash(parse({"n.alpha": "0.2"})) == hash(parse({"n.alpha": "0.20"}))


@pytest.mark.parametrize(
    ("link", "told"),
    [
        ({"neuron": "mice"}, "there is no neuron 'mice'"),
        ({"n.alpha": "2"}, "alpha must be in 0 … 1"),
        ({"n.alpha": "much"}, "n.alpha must be a number, got 'much'"),
        ({"n.beat": "1"}, "GNM has no field 'beat'"),
        ({"r.modulate": "1"}, "AggregateLabel has no field"),
        ({"rule": "et", "r.modulate": "yes"}, "must be 0 or 1"),
        ({"colour": "red"}, "unknown setting 'colour'"),
        ({"trials": "0"}, "trials must be in 1"),
        ({"bounds": "1"}, "bounds must be two numbers"),
        ({"weight_bounds": "0,1"}, "called bounds"),
    ],
)
def test_what_means_nothing_is_told_in_a_sentence(link: dict[str, str], told: str) -> None:
    with pytest.raises(ValueError, match=told):
        parse(link)


def test_a_muted_agent_learns_nothing() -> None:
    agent = parse({"mute": "1"}).agent()
    assert agent.rule.learning_rate == 0.0
    assert parse({}).agent().rule.learning_rate > 0.0


def test_readout_d_is_unbounded_unless_bounds_are_given() -> None:
    assert parse({"n.readout": "D"}).agent().weight_bounds is None
    assert parse({"n.readout": "D", "bounds": "0,3"}).agent().weight_bounds == (0.0, 3.0)


def test_the_schema_offers_every_class_with_rules_that_suit_it() -> None:
    schema = controls.schema()
    models = {one["name"]: one for one in schema["models"]}
    assert set(models) == {*registry.neurons(), *registry.networks()}
    assert {one["name"] for one in schema["rules"]} == set(registry.rules())
    assert {"all", "et"} <= set(models["gnm"]["rules"])
    assert "bp" not in models["gnm"]["rules"]
    assert models["network"]["rules"] == ["bp"]


def test_a_class_of_ones_own_has_its_sliders() -> None:
    @dataclass(frozen=True)
    class Slower(LIF):
        """A LIF.

        Attributes:
            alpha: α, decay.
            pause: bins of a pause.
            reset: "soft" or "hard".
        """

        pause: int = 0
        reset: str = "soft"
        name: ClassVar[str] = "slower-for-explorer"

    try:
        (found,) = [
            one for one in controls.schema()["models"] if one["name"] == "slower-for-explorer"
        ]
        by_key: dict[str, Any] = {one["key"]: one for one in found["controls"]}
        assert (by_key["n.alpha"]["symbol"], by_key["n.alpha"]["high"]) == ("α", 1.0)
        assert (by_key["n.pause"]["low"], by_key["n.pause"]["high"]) == (0, 25)
        assert by_key["n.reset"]["options"] == ["soft", "hard"]
    finally:
        del registry._REGISTERED["neuron"]["slower-for-explorer"]


@pytest.mark.parametrize("cls", [GNM, LIF, MST, AggregateLabel, ErrorTrace, Task])
def test_every_end_of_every_slider_is_accepted(cls: Any) -> None:
    for control in controls.controls(cls, "x", ()):
        if control["kind"] == "number" and "low" in control:
            name = control["key"].partition(".")[2]
            ends = [control["low"], control["default"], control["high"]]
            assert ends == sorted(ends)
            taken = [controls._accepts(cls, name, end) for end in ends]
            # What goes together, as tau_s < tau_m, is told when it is tried.
            assert any(taken[::2]) and taken[1], (name, ends)


def test_presets_can_be_followed_and_unknown_ones_are_left_out() -> None:
    offered = presets()
    assert len(offered) >= len(PRESETS) - 1  # one needs a rule that may not be there
    assert all(one["notice"] and known(one["link"]) and known(one["versus"]) for one in offered)
    assert not known("rule=nobody")


def test_the_agent_of_a_link_is_the_one_of_the_library() -> None:
    agent = parse({"seed": "5", "initial_weight": "0.3"}).agent()
    drawn = np.random.default_rng((5, 2)).random(100) * 0.3
    assert np.array_equal(agent.weights, drawn)


def test_classes_have_the_colours_of_every_other_picture() -> None:
    colours = controls.schema()["class_colours"]
    assert colours == [as_hex(class_colour(k)) for k in range(len(colours))]
    page = Path(controls.__file__).parent / "page"
    written = "".join(file.read_text().lower() for file in page.glob("*.js"))
    assert not any(f'"{colour}"' in written for colour in colours)
