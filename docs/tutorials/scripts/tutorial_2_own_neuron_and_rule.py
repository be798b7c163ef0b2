"""
A neuron and a rule of your own
===============================

Two classes: a neuron from which each output spike takes one threshold's worth of potential, and a
rule that teaches single moments. They train side by side with the package's own, on one stream.
"""

# %%
# The neuron
# ----------
# A neuron is a dataclass of its parameters and one step: what happens in a bin. The potential
# leaks, the input is added, and a spike takes ϑ away instead of resetting to zero, so that a strong
# input can spike twice in a row.

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, ClassVar, NamedTuple

import matplotlib.pyplot as plt
import numpy as np

from agents import LIF, ErrorTrace, NeuronAgent, noisy_performance, record, train_many
from agents.learning.rule import Rule
from agents.neurons.neuron import Neuron, PSPKernel, Response
from gnm_env import Patterns, Task, draw_trial


class State(NamedTuple):
    V: Any


def step(p, static, state, current):
    D = p.alpha * state.V
    V = state.V + current - D
    spike = V >= p.theta
    taken = p.theta if spike else 0.0
    return State(V - taken), Response(V, D, taken, V, spike, spike)


@dataclass(frozen=True)
class SubtractiveLIF(Neuron):
    """Leaky integrate-and-fire; a spike takes ϑ from the potential."""

    alpha: float = 0.15
    theta: float = 1.0

    name: ClassVar[str] = "subtractive-lif"
    default_initial_weight: ClassVar[float] = 0.1
    state_type: ClassVar[type] = State
    step: ClassVar[Any] = step

    @property
    def threshold(self) -> float:
        return self.theta

    def psp_kernel(self) -> PSPKernel:
        return PSPKernel(1.0 - self.alpha)


# %%
# The rule
# --------
# A rule says at the end of a trial where it wants more (y > 0) and where less (y < 0) of the
# potential. This one looks at each segment of the trial. A spike in noise: less of it there. A
# presentation that lacks spikes: more of it at the highest peak that missed ϑ. One spike
# too many: less at the lowest of its spikes.


def teach(p, trial, y):
    V, last = trial.V, len(trial.V) - 1
    for s in range(len(trial.target)):
        missing = trial.target[s] - trial.counts[s]
        best = -1
        for t in range(trial.edges[s], trial.edges[s + 1]):
            spike = trial.spikes[t] > 0.0
            peak = (t == 0 or V[t - 1] < V[t]) and (t == last or V[t] >= V[t + 1])
            missed = peak and V[t] < trial.threshold
            if s % 2 == 0 and spike:  # segments with even numbers are noise
                y[t] = -1.0
            elif s % 2 == 1 and (
                (missing > 0.0 and missed and (best < 0 or V[t] > V[best]))
                or (missing < 0.0 and spike and (best < 0 or V[t] < V[best]))
            ):
                best = t
        if best >= 0:
            y[best] = 1.0 if missing > 0.0 else -1.0


@dataclass(frozen=True)
class Moments(Rule):
    """Teaches the moments that were nearest to being right."""

    learning_rate: float = 3e-3
    momentum: float = 0.2

    name: ClassVar[str] = "moments"
    feedback: ClassVar[str] = "presentations"
    uses_error: ClassVar[bool] = True  # also trials whose only errors lie in noise
    teach: ClassVar[Any] = teach


# %%
# Train
# -----
# Beside a neuron of the package, on the same sixty thousand trials. Nothing had to be registered: a
# class is known by its name once it is defined.

task = Task(n_classes=2)
patterns = Patterns.draw(task, seed=4)
agents = [
    NeuronAgent(neuron, rule, n_inputs=task.n_inputs, weight_bounds=None)
    for neuron, rule in (
        (LIF(alpha=0.15), ErrorTrace(learning_rate=1e-3, modulate=True)),
        (SubtractiveLIF(alpha=0.15), Moments()),
    )
]
names = [f"{type(a.neuron).__name__}, {type(a.rule).__name__}" for a in agents]
history = train_many(agents, task, patterns, trials=60_000, seed=1)

_, axes = plt.subplots(figsize=(7, 3.4), layout="constrained")
for k, name in enumerate(names):
    axes.plot(history.trials, history.error_rate[:, k], label=name)
axes.set(xlabel="trials", ylabel="share of wrong trials", ylim=(0, 1))
axes.legend(frameon=False)
plt.show()

# %%
# Score
# -----
# All are put on the same hundred endless streams.

bins = noisy_performance(agents, task, patterns, runs=100, seed=1_000_000)
for name, survived in zip(names, bins, strict=True):
    print(f"{name:27s} {survived.mean():6,.0f} bins without a mistake")
print(f"{'silence':27s} {task.silent_score:6,.0f}")

# %%
# Look at what it teaches
# -----------------------
# `teach` is plain Python as well. Handed what an untrained neuron does in a trial, it shows the
# moments at which it would change something: up where a spike is missing, down where one is wrong.

trial = draw_trial(task, patterns, np.random.default_rng(3))
fresh = NeuronAgent(SubtractiveLIF(), Moments(), n_inputs=task.n_inputs, initial_weight=0.45)
course = record(fresh, trial)
spikes = course.spikes.astype(float)
counts = np.add.reduceat(np.append(spikes, 0.0), trial.edges[:-1]) * (np.diff(trial.edges) > 0)
heard = SimpleNamespace(
    V=course.V,
    spikes=spikes,
    threshold=1.0,
    edges=trial.edges,
    target=trial.target,
    counts=counts,
)
y = np.zeros(trial.n_bins)
teach(None, heard, y)

_, (above, below) = plt.subplots(
    2, sharex=True, figsize=(9, 3.8), height_ratios=(2, 1), layout="constrained"
)
above.plot(course.V, color="black", lw=1)
above.axhline(1.0, color="grey", ls="--", lw=1)
above.plot(np.flatnonzero(spikes), np.full(int(spikes.sum()), 1.6), "v", color="tab:red")
below.stem(np.flatnonzero(y), y[y != 0.0], basefmt=" ")
for axes in (above, below):
    for onset, class_ in zip(trial.onsets, trial.classes, strict=True):
        axes.axvspan(onset, onset + task.pattern_bins, color=f"C{class_}", alpha=0.2, lw=0)
above.set(ylabel="potential V", xlim=(0, trial.n_bins))
below.set(xlabel="bin (1 ms)", ylabel="y(t)", ylim=(-1.3, 1.3))
plt.show()
