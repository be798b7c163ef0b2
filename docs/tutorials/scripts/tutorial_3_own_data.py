"""
Your own data
=============

Spike times, and for each trial a number that says how much happened in it: that is all that a
neuron needs to find out what happened, and when. Here the recording is made up, so that the answer
is known.
"""

# %%
# A recording
# -----------
# Thirty cells fire at 4 Hz. Now and then a stimulus comes, and twelve of them fire in a fixed
# order, within ten milliseconds and not quite on time. Of each trial of 400 ms it is only written
# down how many stimuli there were.

import gymnasium as gym
import matplotlib.pyplot as plt
import numpy as np

import gnm_env  # noqa: F401  (registers the environments)
from agents import GNM, AggregateLabel, NeuronAgent, answers, record, train, train_many
from gnm_env import Trial, Trials

CELLS, SECONDS = 30, 0.4
rng = np.random.default_rng(7)
order = rng.permutation(CELLS)[:12]
delays = np.sort(rng.uniform(0.0, 0.01, 12))


def one_trial(stimuli):
    """Spike times in seconds, one array a cell."""
    times = [rng.uniform(0, SECONDS, rng.poisson(4 * SECONDS)) for _ in range(CELLS)]
    for start in np.arange(stimuli) * 0.1 + rng.uniform(0.01, 0.05):
        for cell, delay in zip(order, delays, strict=True):
            times[cell] = np.append(times[cell], start + delay + rng.normal(0, 0.001))
    return [np.unique(np.round(np.clip(t, 0, SECONDS - 1e-3), 3)) for t in times]


counts = rng.integers(0, 4, 600)
recorded = [one_trial(k) for k in counts]

# %%
# Trials
# ------
# ``Trial.from_times`` puts spike times into bins; ``label`` says what is owed when it is not known
# where. ``Trials`` holds many of them, can be split, saved and loaded. For files of Neo, NWB, HDF5
# and others see :py:mod:`gnm_env.recordings`: each of its functions gives Trials as well.

trials = Trials(
    Trial.from_times(times, n_bins=400, bin_width=0.001, label=int(k))
    for times, k in zip(recorded, counts, strict=True)
)
heard, held_out = trials.split(0.75, seed=1)
print(heard)
print(held_out)

busiest = held_out[int(np.argmax(held_out.labels))]
bins, channels = np.nonzero(busiest.dense())
_, axes = plt.subplots(figsize=(9, 2.6), layout="constrained")
axes.scatter(bins, channels, s=6, color="black")
axes.set(xlabel="bin (1 ms)", ylabel="cell", title=f"label {busiest.label}", xlim=(0, 400))
plt.show()

# %%
# Train
# -----
# A data set goes where task and patterns would. Its trials come again and again, each time in
# another order. ALL hears no more than whether the count was too low or too high.

rule = AggregateLabel(learning_rate=2e-4, fraction=0.4)
agent = NeuronAgent(GNM(alpha=0.2), rule, n_inputs=CELLS, seed=0)
history = train_many([agent], heard, trials=40_000, seed=1)

_, axes = plt.subplots(figsize=(6, 3), layout="constrained")
axes.plot(history.trials, history.error_rate[:, 0], color="black")
axes.set(xlabel="trials heard", ylabel="share of wrong counts", ylim=(0, 1))
plt.show()

# %%
# Test
# ----
# On trials that it has never heard:

result = answers(agent, held_out)
right = 1 - result.wrong[0] / result.trials
print(f"right count in {right:.0%} of {result.trials} new trials; ", end="")
print(f"mean error {result.absolute[0] / result.trials:.2f} stimuli")

# %%
# Nobody told it where the stimuli were. Its spikes do:

course = record(agent, busiest)
_, axes = plt.subplots(figsize=(9, 2.6), layout="constrained")
axes.plot(course.V, color="black", lw=1)
axes.axhline(agent.neuron.theta_r, color="grey", ls="--", lw=1)
spikes = np.flatnonzero(course.spikes)
axes.plot(spikes, np.full(spikes.size, 1.05 * course.V.max()), "v", color="tab:red")
axes.set(xlabel="bin (1 ms)", ylabel="potential V", xlim=(0, 400))
plt.show()

# %%
# And which cells matter, it has found as well: those that take part have the large weights.

_, axes = plt.subplots(figsize=(9, 2.2), layout="constrained")
takes_part = np.isin(np.arange(CELLS), order)
axes.bar(np.arange(CELLS), agent.weights, color=np.where(takes_part, "tab:red", "lightgrey"))
axes.set(xlabel="cell (red: takes part)", ylabel="weight")
plt.show()

# %%
# In Gymnasium
# ------------
# The same data make an environment, for any agent that you have.

env = gym.make("gnm/PatternTrial-v0", trials=heard)
train(agent, env, trials=50, seed=2)

trials.save("recording.npz")
assert len(Trials.load("recording.npz")) == len(trials)
