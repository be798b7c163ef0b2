"""What a policy is shown instead of the bits, and how its actions become spikes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, TypeVar

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.vector import VectorEnv

from gnm_env.checks import real
from gnm_env.wrappers import (
    RisingEdge,
    SynapticTrace,
    TraceParams,
    Traces,
    VectorRisingEdge,
    VectorSynapticTrace,
)

_Env = TypeVar("_Env", bound=gym.Env[Any, Any] | VectorEnv[Any, Any, Any])


@dataclass(frozen=True)
class Senses:
    """Settings of `gnm_env.wrappers`; part of a saved agent, since its policy knows nothing else.

    Attributes:
        decays: α of the synaptic traces; empty: the raw bits of the present bin.
        scale: standard deviation of a trace under noise.
        previous_action: whether the last action is shown too.
        own_decay: α of the trace of the own actions; None: not shown.
        rising_edge: whether a spike is a change of the action from 0 to 1.
    """

    decays: tuple[float, ...] = ()
    scale: float = 1.0
    previous_action: bool = False
    own_decay: float | None = None
    rising_edge: bool = False

    def __post_init__(self) -> None:
        decays = tuple(
            real("decays", float(d), 0.0, 1.0, above=0.0) for d in np.atleast_1d(self.decays)
        )
        object.__setattr__(self, "decays", decays)
        object.__setattr__(self, "scale", real("scale", self.scale, above=0.0))
        if not decays and (self.previous_action or self.own_decay is not None):
            raise ValueError(
                "previous_action and own_decay go with synaptic traces, and decays is empty; "
                "decays=(1.0,) shows the bits themselves"
            )

    def traces(self, n: int, inputs: spaces.Box, rate: float) -> Traces | None:
        """The traces of n streams; None if the raw bits are shown."""
        if not self.decays:
            return None
        params = TraceParams(self.decays, self.scale, self.previous_action, self.own_decay, rate)
        return Traces(n, inputs, rate, params)

    def wrap(self, env: _Env) -> _Env:
        """`env`, single or vector, seen through these senses."""
        vector = isinstance(env, VectorEnv)
        wrapped: Any = env
        if self.rising_edge:
            wrapped = (VectorRisingEdge if vector else RisingEdge)(wrapped)
        if self.decays:
            wrapped = (VectorSynapticTrace if vector else SynapticTrace)(
                wrapped,
                decays=self.decays,
                scale=self.scale,
                previous_action=self.previous_action,
                own_decay=self.own_decay,
            )
        result: _Env = wrapped
        return result


RAW = Senses()
"""The bits of the present bin: for policies with a memory of their own."""

TRACES = Senses(decays=(0.3,), scale=1 / 3, previous_action=True, own_decay=0.1)
"""For policies without one: a trace as slow as the GNM's, and two of the own spikes.

A pattern must be answered a fixed number of times, so the policy has to know that it has answered:
from its last action and a trace ten bins long. The scale is the one at which Adam's steps, whose
size does not depend on that of the inputs, neither stall nor break what is learned.
"""
