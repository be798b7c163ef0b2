"""What a policy is shown of the stream, and how its actions become spikes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, Self, TypeVar

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.vector import VectorEnv

from gnm_env.checks import flag, real, shown
from gnm_env.wrappers import (
    TRACE_SCALE,
    RisingEdge,
    SynapticTrace,
    TraceParams,
    Traces,
    VectorRisingEdge,
    VectorSynapticTrace,
)

_Env = TypeVar("_Env", bound=gym.Env[Any, Any] | VectorEnv[Any, Any, Any])

LEAST_SCALE, MOST_SCALE = 1e-6, 1e6


@dataclass(frozen=True)
class ObservationConfig:
    """Everything that a policy hears, and how it answers. Checks itself when it is made.

    The arguments of `gnm_env.wrappers`, with the same defaults. It is part of a saved agent and of
    the models that `make_rl_agent` makes, and is compared when they are scored: a policy that was
    trained on other observations, if only at another scale, answers with nonsense.

    Attributes:
        decays: α of the synaptic traces, in (0, 1]; empty: the raw bits of the present bin, and
            nothing else.
        scale: standard deviation of a trace under noise.
        previous_action: whether the last action is shown too.
        own_decay: α of the trace of the own actions; None: not shown.
        rising_edge: whether a spike is a change of the action from 0 to 1, instead of a 1.

    Raises:
        ValueError: a field out of range, or one that goes with traces where there are none.
    """

    decays: tuple[float, ...] = ()
    scale: float = TRACE_SCALE
    previous_action: bool = False
    own_decay: float | None = None
    rising_edge: bool = False

    def __post_init__(self) -> None:
        def put(name: str, value: Any) -> None:
            object.__setattr__(self, name, value)

        put("rising_edge", flag("rising_edge", self.rising_edge))
        put("scale", real("scale", self.scale, LEAST_SCALE, MOST_SCALE))
        if isinstance(self.decays, (tuple, list, np.ndarray)) and len(self.decays) == 0:
            put("decays", ())
            put("previous_action", flag("previous_action", self.previous_action))
            self._refuse_what_goes_with_traces()
        else:
            params = self._params()
            for name in ("decays", "previous_action", "own_decay"):
                put(name, getattr(params, name))

    def _refuse_what_goes_with_traces(self) -> None:
        alone = self.scale == TRACE_SCALE and not self.previous_action and self.own_decay is None
        if not alone:
            raise ValueError(
                "scale, previous_action and own_decay go with synaptic traces, and decays is "
                "empty; decays=(1.0,) shows the bits themselves"
            )

    def _params(self) -> TraceParams:
        return TraceParams(self.decays, self.scale, self.previous_action, self.own_decay, None)

    @property
    def raw_bits(self) -> bool:
        """Whether the bits of the present bin are shown as they are, and nothing else."""
        return not self.decays

    @classmethod
    def of(cls, value: Any) -> Self:
        """`value` if it is one, or one made of a dict of the fields, as files keep it.

        Raises ValueError for anything else.
        """
        if isinstance(value, cls):
            return value
        known = {field.name for field in fields(cls)}
        if not isinstance(value, Mapping) or not {"decays"} <= set(value) <= known:
            raise ValueError(
                f"an observation config must be an ObservationConfig, or a dict of its fields "
                f"{', '.join(sorted(known))}, got {shown(value)}"
            )
        return cls(**value)

    def traces(self, n: int, inputs: spaces.Box, rate: float) -> Traces | None:
        """The traces of n streams; None if the raw bits are shown."""
        return None if self.raw_bits else Traces(n, inputs, rate, self._params())

    def wrap(self, env: _Env) -> _Env:
        """`env`, single or vector, as a policy is to hear it and to answer it."""
        vector = isinstance(env, VectorEnv)
        wrapped: Any = env
        if self.rising_edge:
            wrapped = (VectorRisingEdge if vector else RisingEdge)(wrapped)
        if not self.raw_bits:
            wrapped = (VectorSynapticTrace if vector else SynapticTrace)(
                wrapped,
                decays=self.decays,
                scale=self.scale,
                previous_action=self.previous_action,
                own_decay=self.own_decay,
            )
        result: _Env = wrapped
        return result


RAW = ObservationConfig()
"""The bits of the present bin: for policies with a memory of their own."""

TRACES = ObservationConfig(decays=(0.3,), previous_action=True, own_decay=0.1)
"""For policies without one: a trace as slow as the GNM's, and two of the own spikes.

A pattern must be answered a fixed number of times, so the policy has to know that it has answered:
from its last action and a trace ten bins long. The scale is the one at which Adam's steps, whose
size does not depend on that of the inputs, neither stall nor break what is learned.
"""
