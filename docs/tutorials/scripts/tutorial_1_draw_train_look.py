"""
Draw, train, look
=================

A neuron hears noise in which two patterns hide, learns after each trial from where its spikes were
wrong, and so learns to count. Here each step is one call, and each result is looked at.
"""

# %%
# The task
# --------
# A task says how patterns and noise are made; patterns are drawn once and stay. Here two classes:
# a presentation of the first is owed one output spike, one of the second two.

import matplotlib.pyplot as plt
import numpy as np

from agents import GNM, ErrorTrace, NeuronAgent, answers, noisy_performance, record, train_many
from agents.plotting import class_colour
from gnm_env import Patterns, Task, draw_trial

task = Task(n_classes=2)
patterns = Patterns.draw(task, seed=4)
print(task)

# %%
# Draw
# ----
# A trial is some noise with the patterns in it. To the eye they are as random as the rest: the
# shade is what the neuron is not shown.

trial = draw_trial(task, patterns, np.random.default_rng(3))


def shade(axes, trial):
    """Marks each presentation by the colour of its class."""
    for onset, class_ in zip(trial.onsets, trial.classes, strict=True):
        axes.axvspan(onset, onset + trial.pattern_bins, color=class_colour(class_), alpha=0.2, lw=0)


_, axes = plt.subplots(figsize=(9, 3), layout="constrained")
bins, channels = np.nonzero(trial.dense())
axes.scatter(bins, channels, s=3, color="black")
shade(axes, trial)
axes.set(xlabel="bin (1 ms)", ylabel="channel", xlim=(0, trial.n_bins))
axes.set_title(f"One trial: {trial.label} output spikes are owed, nobody says where")
plt.show()

# %%
# Before learning
# ---------------
# Weights begin small and random. What the neuron makes of the trial is seen in its potential.

agent = NeuronAgent(
    GNM(alpha=0.2), ErrorTrace(learning_rate=1e-3, modulate=True), n_inputs=task.n_inputs, seed=0
)


def show(agent, title):
    """Potential over the trial, threshold, output spikes."""
    course = record(agent, trial)
    _, axes = plt.subplots(figsize=(9, 2.6), layout="constrained")
    axes.plot(course.V, color="black", lw=1)
    axes.axhline(agent.neuron.theta_r, color="grey", ls="--", lw=1)
    spikes = np.flatnonzero(course.spikes)
    axes.plot(spikes, np.full(spikes.size, 1.05 * course.V.max()), "v", color="tab:red")
    shade(axes, trial)
    axes.set(xlabel="bin (1 ms)", ylabel="potential V", xlim=(0, trial.n_bins), title=title)
    plt.show()


show(agent, "Before learning")

# %%
# Train
# -----
# Sixty thousand trials in compiled code take a fraction of a second, after some seconds of
# compiling at the first start. The history holds the share of wrong trials, block by block.

history = train_many([agent], task, patterns, trials=60_000, seed=1)

_, axes = plt.subplots(figsize=(6, 3), layout="constrained")
curve = history.of(0)
axes.plot(curve.trials, curve.error_rate, color="black")
axes.set(xlabel="trials", ylabel="share of wrong trials", ylim=(0, 1))
plt.show()

# %%
# Look
# ----
# The same trial again. Red marks are output spikes: one in each blue stretch, two in each orange
# one, and silence in between, if all went well.

show(agent, "After learning")

# %%
# Score
# -----
# On an endless stream, how long does it go without a mistake? Beside it stands what silence gets.

bins = noisy_performance(agent, task, patterns, runs=100, seed=1_000_000)
print(f"{bins.mean():,.0f} bins without a mistake; silence gets {task.silent_score:.0f}")
print(answers(agent, task, patterns, trials=1_000, seed=7))
