"""What every neuron offers: parameters that check themselves, and one step.

A neuron is one file beside this one, or a class of your own. It holds

- a frozen dataclass, derived from `Neuron`, with the parameters that a user sets, a `name`, a
  `threshold` and a `psp_kernel`;
- `State`, a NamedTuple of what passes from bin to bin; all zeros at the beginning of a trial;
- `step(p, static, state, current) -> (state, Response)`: one bin, for one neuron or for many side
  by side. `current` is I(t), the weighted input of the bin; `p` holds the parameters by name.

The dataclass names the type of its state in `state_type` and its step in `step`. It is written for
plain numbers; what it may use is listed in `agents.simd`.
"""

from __future__ import annotations

from dataclasses import fields
from typing import Any, ClassVar, NamedTuple

import numpy as np

from agents.model import Arrays, Model, PSPKernel, Response, threshold_name
from agents.portable import portable
from agents.simd import fitted, like, load
from gnm_env.compiled import inlined, specialise

__all__ = ["Neuron", "PSPKernel", "Response"]

step: Any = None  # bound by `_advance`
answer: Any = None  # likewise


@inlined
def input_current(weights: Any, channels: Any, first: int, last: int, zero: Any) -> Any:
    """I(t) = Σ_i w_i s_i(t), summed from 0 over the ascending channels[first:last]."""
    current = zero
    for e in range(first, last):
        # Unsigned: signed indices count from the end as well, and numba pays for looking.
        current = current + load(weights, channels[np.uint64(e)], zero)
    return current


def advance_template(
    p: Any,
    static: Any,
    arrays: Arrays,
    state: Any,
    channels: Any,
    first: int,
    last: int,
    row: int,
) -> Any:
    """One bin of any neuron: its input current, and its step."""
    zero = like(0.0, state[0])
    current = input_current(arrays.weights, channels, first, last, zero)
    after, response = step(p, static, state, current)
    return fitted(after, state), answer(response, zero)


@inlined
def spiking_answer(response: Any, zero: Any) -> Any:
    """A `Response` whose constants are numbers and conditions like any other."""
    silent = zero > zero
    return fitted(response, Response(zero, zero, zero, zero, silent, silent))


@inlined
def graded_answer(response: Any, zero: Any) -> Any:
    """The response of a neuron that gives amounts, as it is."""
    return response


class _NumericFields:
    """The default of `parameters_type`: a NamedTuple of the numeric fields of the dataclass."""

    def __get__(self, instance: Any, owner: type) -> type:
        numbers = [f.name for f in fields(owner) if f.type in ("float", "int", float, int)]
        made = NamedTuple("Parameters", [(name, Any) for name in numbers])  # type: ignore[misc]
        # Where the compile cache finds it again.
        made.__module__, made.__qualname__ = owner.__module__, f"{owner.__qualname__}.Parameters"
        owner.Parameters = owner.parameters_type = made  # type: ignore[attr-defined]
        return made


class Neuron(Model):
    """Base of all neurons: models with one weight per input channel, linear in their inputs."""

    parameters_type: ClassVar[Any] = _NumericFields()
    step: ClassVar[Any]
    """step(p, static, state, current) -> (state, Response); see the module."""
    _compiled: ClassVar[tuple[str, Any]]

    def __init_subclass__(cls, **keywords: Any) -> None:
        # Before the class is entered: one that is refused is not known by its name.
        own_step = portable(cls.step) if {"name", "step"} <= vars(cls).keys() else None
        super().__init_subclass__(**keywords)
        if own_step is not None:
            cls._compiled = (cls.name, own_step)

    def parameters(self) -> tuple[float, ...]:
        """The fields of the dataclass, in order; a neuron that needs other numbers overrides it."""
        return tuple(float(getattr(self, name)) for name in self.parameters_type._fields)

    @property
    def threshold(self) -> float:
        """The parameter theta_r or theta; a neuron with another name for it overrides this."""
        return float(getattr(self, threshold_name(self.parameters_type)))

    def compiled_step(self) -> tuple[str, Any]:
        """The step, compiled, and a name that tells it from every other."""
        if not hasattr(self, "_compiled"):
            raise ValueError(
                f"the class {type(self).__name__} needs step, and beside it a name: "
                "step(p, static, state, current) -> (state, Response)"
            )
        return self._compiled

    def recording_step(self) -> tuple[str, Any]:
        """As `compiled_step`: the step that computes every variable."""
        return self.compiled_step()

    def advance(self) -> tuple[str, Any]:
        return _advance(self.compiled_step(), self.graded)

    def recording(self) -> tuple[str, Any]:
        return _advance(self.recording_step(), self.graded)


_ADVANCES: dict[Any, Any] = {}
"""The bound template of each compiled step, so that it is compiled once."""


def _advance(labelled: tuple[str, Any], graded: bool) -> tuple[str, Any]:
    label, compiled_step = labelled
    if compiled_step not in _ADVANCES:
        _ADVANCES[compiled_step] = specialise(
            advance_template,
            label,
            inline=True,
            step=compiled_step,
            answer=graded_answer if graded else spiking_answer,
        )
    return label, _ADVANCES[compiled_step]
