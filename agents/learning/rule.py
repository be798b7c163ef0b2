"""What every learning rule offers, and what a trial tells it.

A rule acts once, at the end of a trial. For every neuron whose potential is linear in its inputs,
learning is Δw_i = f(Σ_t x_i(t) y(t)) with the presynaptic trace x_i: a rule is a *teaching signal*
y(t). It is one file beside this one, or a class of your own: a frozen dataclass derived from
`Rule`, with a `name`, the `feedback` that it uses, and one of

- `teaching_signal(static, V, E) -> y(t)`: where V(t) and the error trace E(t) of the same bin are
  all that it needs. Written for plain numbers, computed for many neurons side by side; with
  `weight_change(p, static, c, eligibility)`, if Δ_i is to be anything but λ·ε_i;
- `teach(p, trial, y) -> None`: where it needs the whole trial. It is handed the trial of one
  neuron (`agents.learning.teaching.HeardTrial`) and writes y, (T,), which is all 0 before;
- `bin_signal(p, b) -> y(t)`: likewise side by side, where it takes the readout, the output or the
  rule's own numbers as well (`BinOfTrial`);
- `side_by_side(p, c, trial, log, eligibility) -> mask`: where no y(t) says it; it writes ε in many
  lanes at once, from the correction c and the log of the trial (`agents.training.trial`), and
  returns in which there is anything to learn;
- `change(p, trial, eligibility) -> bool`: where no y(t) says it. It writes ε, (N,), itself, and
  returns whether there is anything to learn.

`p` holds the rule's own numbers by name. Rate, momentum and bounds are the same for every rule and
live in `momentum.py`.

A rule may have a memory, some numbers for each neuron that last from trial to trial and are kept in
checkpoints: their names are the fields of its `memory_type`, 0 at first. `weigh(p, told, memory) ->
(correction, memory)` makes of what the rule is told (see CORRECTIONS) what it learns by, 0 being
nothing; it is written like `bin_signal`.

`spike_probability(p, V, threshold) -> P`, written likewise, makes the output a matter of chance
while the rule learns: each bin has an output spike with probability P, independently of the others
(`agents.training.exploration`). For neurons that take no notice of their own output.
"""

from __future__ import annotations

from abc import ABC
from collections.abc import Mapping
from dataclasses import field, fields
from typing import Any, ClassVar, NamedTuple

from agents import registry
from agents.model import Model, PSPKernel
from agents.portable import portable
from agents.simd import like, load, store, where
from gnm_env.checks import real, shown, whole
from gnm_env.compiled import inlined

FEEDBACK: Mapping[str, str] = {
    "sign": "whether the sum of the output spikes was too small or too large",
    "label": "how many output spikes were missing or too many in the whole trial",
    "reward": "the reward of the whole trial, −|label − emitted|",
    "presentations": "where the presentations were, and what each of them was owed",
    "none": "nothing",
}
"""What a rule may know of a trial, by the name of its `feedback`."""

MOST_TRIALS = 10**12
"""That a rule may name."""


class Outcome(NamedTuple):
    """What a whole trial came to."""

    emitted: Any
    """Output in the trial."""
    label: Any
    """Output owed: the aggregate label."""
    has_error: Any
    """Whether the error trace E is anything but zero; of noise only where the rule uses E."""


class RuleParameters(NamedTuple):
    """The numbers of any rule, one per lane; a rule's own numbers stand in the rows below."""

    learning_rate: Any
    momentum: Any
    lowest: Any
    """Lower weight bound …"""
    highest: Any
    """… and upper weight bound; infinite where there is none."""
    slow: Any
    """The presynaptic trace: see `agents.model.PSPKernel`."""
    fast: Any
    scale: Any
    decay: Any
    """Fraction of the learning rate that each trial takes away; 0 for a constant rate."""
    average_first: Any
    """First trial, counted from 1, after which the weights count for their mean …"""
    average_last: Any
    """… and the last one, after which they become it; both 0 for a rule that takes none."""


class BinOfTrial(NamedTuple):
    """What happened in a bin, for `bin_signal`."""

    V: Any
    """Membrane potential."""
    X: Any
    """Readout; for a rule with a `spike_probability`, that probability less `z`."""
    E: Any
    """Error trace, where the rule uses it; else the correction, the same in every bin."""
    z: Any
    """Output, where the rule uses it."""
    threshold: Any
    """Of the readout."""


class NoMemory(NamedTuple):
    """The memory of a rule that has none."""

    unused: Any


@inlined
def sign_of_error(outcome: Outcome) -> Any:
    """+1 where more output was owed, −1 where less, 0 where the sum was right."""
    zero = like(0.0, outcome.emitted)
    return where(
        outcome.emitted < outcome.label, 1.0, where(outcome.emitted > outcome.label, -1.0, zero)
    )


@inlined
def whole_error(outcome: Outcome) -> Any:
    """Output missing in the trial, negative where there was too much."""
    return outcome.label - outcome.emitted


@inlined
def any_error(outcome: Outcome) -> Any:
    """1 where the error trace is anything but zero."""
    return where(outcome.has_error, 1.0, like(0.0, outcome.emitted))


@inlined
def reward_less_one(outcome: Outcome) -> Any:
    """−|label − emitted| − 1: a reward of 0 can teach, too."""
    error = outcome.label - outcome.emitted
    return where(error < 0.0, error, -error) - 1.0


@inlined
def always(outcome: Outcome) -> Any:
    """1: every trial teaches."""
    return like(1.0, outcome.emitted)


CORRECTIONS: Mapping[str, Any] = {
    "sign": sign_of_error,
    "label": whole_error,
    "reward": reward_less_one,
    "presentations": any_error,
    "none": always,
}
"""correction(outcome) -> c by feedback: 0 where a trial teaches nothing, else what it tells."""


@inlined
def in_proportion(p: RuleParameters, static: Any, c: Any, eligibility: Any) -> None:
    """Δ_i = λ ε_i, in place."""
    for i in range(len(eligibility)):
        store(eligibility, i, p.learning_rate * load(eligibility, i, c))


class _OwnNumbers:
    """The default of `Rule.parameters_type`: a NamedTuple of a rule's own numeric fields."""

    def __get__(self, instance: Any, owner: type) -> type:
        numeric = ("float", "int", "bool", float, int, bool)
        common = {"learning_rate", "momentum", "decay_trials", "average_over"}
        own = [f.name for f in fields(owner) if f.type in numeric and f.name not in common]
        made = NamedTuple("Parameters", [(name, Any) for name in own or ["unused"]])  # type: ignore[misc]
        # Where the compile cache finds it again.
        made.__module__, made.__qualname__ = owner.__module__, f"{owner.__qualname__}.Parameters"
        owner.Parameters = owner.parameters_type = made  # type: ignore[attr-defined]
        return made


class Rule(ABC):
    """Base of all learning rules. Each adds its fields as a frozen dataclass."""

    learning_rate: float
    momentum: float
    trace_decay: float | None = None
    decay_trials: int | None = None
    average_over: tuple[int, int] | None = None

    name: ClassVar[str]
    feedback: ClassVar[str]
    """What the rule may know of a trial; a key of FEEDBACK."""
    uses_error: ClassVar[bool] = False
    """Whether its teaching signal takes the error trace E(t), if presentations are known."""
    uses_output: ClassVar[bool] = False
    """Whether a `bin_signal` or `side_by_side` takes the output of each bin."""
    needs_spikes: ClassVar[bool] = False
    """Whether it is for output spikes only, not for amounts."""
    binary: ClassVar[bool] = False
    """Whether it is for labels 0 and 1 only."""
    learns_when_right: ClassVar[bool] = False
    """Whether a trial may teach that has the right output in every segment."""
    parameters_type: ClassVar[Any] = _OwnNumbers()
    memory_type: ClassVar[Any] = NoMemory
    teaching_signal: ClassVar[Any] = None
    bin_signal: ClassVar[Any] = None
    side_by_side: ClassVar[Any] = None
    weigh: ClassVar[Any] = None
    spike_probability: ClassVar[Any] = None
    weight_change: ClassVar[Any] = in_proportion
    teach: ClassVar[Any] = None
    change: ClassVar[Any] = None
    block_change: ClassVar[Any] = None
    """As `agents.training.change.pointwise_change_template`: for models that are no neurons."""
    _compiled: ClassVar[dict[str, Any]]

    def __init_subclass__(cls, **keywords: Any) -> None:
        super().__init_subclass__(**keywords)
        ways = ("teaching_signal", "bin_signal", "side_by_side", "teach", "change", "block_change")
        if getattr(cls, "name", None) is None:
            return
        feedback = getattr(cls, "feedback", None)
        if feedback not in FEEDBACK:
            raise ValueError(
                f"{cls.__name__}.feedback must be one of {', '.join(FEEDBACK)}, got {feedback!r}"
            )
        if not any(getattr(cls, way) for way in ways):
            raise ValueError(
                f"{cls.__name__} must say what it teaches: by teaching_signal(static, V, E), "
                "teach(p, trial, y) or change(p, trial, eligibility); see agents.learning.rule"
            )
        names = ("teaching_signal", "bin_signal", "side_by_side", "weigh", "spike_probability")
        parts = {name: getattr(cls, name) for name in names}
        cls._compiled = {name: part and portable(part) for name, part in parts.items()}
        # Last: a class that is refused is not known by its name.
        registry.register("rule", cls, (*ways, "weight_change", "weigh", "spike_probability"))

    @classmethod
    def compiled_parts(cls) -> dict[str, Any]:
        """Its functions for neurons side by side, compiled; None where it has none."""
        return {**cls._compiled, "weight_change": cls.weight_change}

    def __post_init__(self) -> None:
        for name in ("learning_rate", "momentum"):
            if not hasattr(self, name):
                raise ValueError(
                    f"{type(self).__name__} needs the fields learning_rate and momentum, and has "
                    f"no {name}: write, for one, `{name}: float = 0.01`"
                )
        real("learning_rate", self.learning_rate, low=0.0)
        real("momentum", self.momentum, low=0.0, high=1.0)
        if self.trace_decay is not None:
            real("trace_decay", self.trace_decay, low=0.0, high=1.0)
        if self.decay_trials is not None:
            whole("decay_trials", self.decay_trials, low=1, high=MOST_TRIALS)
        if self.average_over is not None:
            object.__setattr__(self, "average_over", _first_and_last(self.average_over))

    def kernel(self, model: Model) -> PSPKernel:
        """The presynaptic trace: the neuron's own, or the decay per bin that the user gave.

        Raises ValueError where `model` cannot learn by this rule.
        """
        own = model.psp_kernel()
        if self.needs_spikes and model.graded:
            raise ValueError(
                f"{type(self).__name__} is for neurons that spike; a {type(model).__name__} gives "
                "amounts, and learns by AggregateLabel, ErrorTrace or SurrogateGradient"
            )
        if own is None and model.kind == "neuron":
            raise ValueError(
                f"{type(self).__name__} needs the response of a {type(model).__name__} to one unit "
                "spike: give it a method psp_kernel that returns a PSPKernel"
            )
        if own is None:
            raise ValueError(
                f"{type(self).__name__} is for neurons whose potential is linear in their inputs; "
                f"a {type(model).__name__} learns by BackPropagation"
            )
        return own if self.trace_decay is None else PSPKernel(self.trace_decay)

    def parameters(self, model: Model, bounds: tuple[float, float]) -> tuple[float, ...]:
        """The numbers of `RuleParameters`, and below them the rule's own."""
        kernel = self.kernel(model)
        decay = 0.0 if self.decay_trials is None else 1.0 / self.decay_trials
        return (
            self.learning_rate, self.momentum, *bounds,
            kernel.slow, kernel.fast, kernel.scale, decay,
            *(float(trial) for trial in self.average_over or (0, 0)), *self.own_numbers(model),
        )  # fmt: skip

    def own_numbers(self, model: Model) -> tuple[float, ...]:
        """The numbers of `parameters_type`: the fields of these names."""
        return tuple(float(getattr(self, name, 0.0)) for name in self.parameters_type._fields)

    @property
    def averages(self) -> bool:
        """Whether weights are averaged, see `agents.learning.averaging`."""
        return self.average_over is not None

    @property
    def variant(self) -> tuple[str, bool]:
        """What a rule of one class may choose when it is made: `feedback`, `learns_when_right`."""
        return self.feedback, self.learns_when_right

    def check_label(self, label: float) -> None:
        """ValueError if the rule cannot learn from a trial with this label."""
        if self.binary and label > 1.0:
            raise ValueError(
                f"a {type(self).__name__} learns from trials labelled 0 or 1, got label {label:g}: "
                "use a rule such as CriticalThreshold"
            )

    def check_source(self, source: Any) -> None:
        """ValueError if the rule cannot learn from what `source` tells."""
        if self.feedback == "presentations" and source.labels_only:
            raise ValueError(
                f"{type(self).__name__} needs to know where the presentations were, and of these "
                "trials only the labels are known: use a rule such as AggregateLabel or "
                "CriticalThreshold"
            )
        if self.binary and not source.binary:
            raise ValueError(
                f"a {type(self).__name__} learns from trials labelled 0 or 1, and of these some "
                "have, or may have, labels above 1: use a rule such as CriticalThreshold"
            )

    def static(self, n_inputs: int) -> tuple[int, ...]:
        """Settings that are not numbers per lane; neurons side by side must share them."""
        return (0,)


def decay_option() -> Any:
    """The field `decay_trials` of a rule: trials over which the rate falls to 0; None: never."""
    return field(default=None, kw_only=True)


def average_option() -> Any:
    """The field `average_over` of a rule: the trials, first and last, over which weights are
    averaged, see `agents.learning.averaging`; None: they are not."""
    return field(default=None, kw_only=True)


def _first_and_last(trials: Any) -> tuple[int, int]:
    """`average_over`, checked."""
    try:
        first, last = trials
    except (TypeError, ValueError):
        raise ValueError(
            "average_over must be (first, last), the trials over which weights are averaged, "
            f"counted from 1, or None, got {shown(trials)}"
        ) from None
    first = whole("the first trial of average_over", first, low=1, high=MOST_TRIALS)
    return first, whole("the last trial of average_over", last, low=first, high=MOST_TRIALS)
