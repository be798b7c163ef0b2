"""The observation config: what an agent hears, in one record that checks itself."""

from __future__ import annotations

import inspect
import json
from dataclasses import FrozenInstanceError, asdict
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

import gnm_env  # noqa: F401  (registers the environments)
from agents.rl import HYPERPARAMETERS, RAW, TRACES, ObservationConfig
from gnm_env.wrappers import SynapticTrace, VectorSynapticTrace


def test_wrappers_recipes_and_config_agree_on_what_is_not_said() -> None:
    """Who follows the page with the wrappers alone trains on what the kinds here train on."""
    scales = {
        inspect.signature(wrapper).parameters["scale"].default
        for wrapper in (SynapticTrace, VectorSynapticTrace)
    }
    heard = [chosen.observation for chosen in HYPERPARAMETERS.values()]
    # Those with a memory of their own hear bits, and say their scale: a bit is 1.
    scales |= {config.scale for config in heard if config.decays != (1.0,)}
    assert scales == {ObservationConfig().scale}
    env = gym.make("gnm/PatternTrial-v0")
    by_hand = SynapticTrace(env, previous_action=True, own_decay=0.1)
    assert by_hand.observation_space == TRACES.wrap(env).observation_space


def test_raw_bits_are_those_of_the_environment() -> None:
    env = gym.make("gnm/PatternTrial-v0")
    assert RAW.raw_bits and not TRACES.raw_bits
    assert RAW.wrap(env) is env


@pytest.mark.parametrize(
    "config", [RAW, TRACES, ObservationConfig((0.3, 1.0), 2.0, rising_edge=True)]
)
def test_it_survives_json(config: ObservationConfig) -> None:
    assert ObservationConfig.of(json.loads(json.dumps(asdict(config)))) == config
    assert ObservationConfig.of(config) is config


def test_a_row_of_decays_may_be_an_array_or_one_number() -> None:
    assert ObservationConfig(np.array([0.3])) == ObservationConfig([0.3]) == ObservationConfig(0.3)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"decays": "0.3"}, "decays must be a number or a row of numbers"),
        ({"decays": True}, "decays must be a number"),
        ({"decays": None}, "decays must be a number or a row of numbers"),
        ({"decays": (2.0,)}, "decays must be in 0 … 1"),
        ({"scale": 1e300}, "scale must be in 1e-06 … 1e.06"),
        ({"scale": 0.5}, "decays is empty"),
        ({"previous_action": True}, "decays is empty"),
        ({"own_decay": 0.1}, "decays is empty"),
        ({"decays": (0.3,), "previous_action": "no"}, "previous_action must be True or False"),
        ({"decays": (0.3,), "own_decay": 7}, "own_decay must be in 0 … 1"),
        ({"rising_edge": None}, "rising_edge must be True or False, got None"),
    ],
)
def test_bad_fields_are_refused_by_name(fields: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        ObservationConfig(**fields)


def test_it_cannot_be_changed() -> None:
    with pytest.raises(FrozenInstanceError):
        TRACES.scale = 1.0  # type: ignore[misc]
