"""
A word in speech
================

Somebody speaks a few digits without a pause, and all that is written down is how often "seven"
was among them. Not when, not what else was said, not which sounds make a seven. A neuron that is
told no more than that learns to spike when it hears the word, in voices that it has never heard.
"""

# %%
# What is heard
# -------------
# The phrases ship with the project: synthetic speech (eSpeak NG), encoded in 24 bands as the
# cochlea has them. Each band has two levels, and each crossing of one, up or down, is a spike: 96
# channels, bins of 5 ms. Which words were said, and when, stays beside the trials; the neuron is
# not told.

import matplotlib.pyplot as plt
import numpy as np

from agents.experiments import speech
from gnm_env.speech import digits, part

phrases = digits()
train, test = part(phrases, "train"), part(phrases, "test")
print(train)
print(test)
print("words of the first phrase:", [speech.DIGITS[word] for word in train.columns["words"][0]])

# %%
# Voices that are really new
# --------------------------
# Many synthetic voices are near copies of each other. Voices held out at random have such copies
# among the training voices: these are our control, "near". The test voices are chosen first; every
# training voice near one of them, and every voice of the same speaker, was dropped.

nearest = phrases.metadata["nearest"]
_, axes = plt.subplots(figsize=(6, 2.4), layout="constrained")
for row, split in enumerate(("near", "test")):
    axes.plot(nearest[split], np.full(len(nearest[split]), row), "o", alpha=0.6)
axes.axvline(phrases.metadata["bound"], color="grey", ls="--", lw=1)
axes.set(yticks=(0, 1), yticklabels=("near", "test"), ylim=(-0.6, 1.6), xlim=(0, None))
axes.set(xlabel="distance to the nearest training voice (dashed: the bound)")
plt.show()

# %%
# What the neuron needs
# ---------------------
# A word lasts longer than the neuron's memory of 50 ms. So each channel comes again 50, 100 … 400
# ms later: what began the word and what ends it are then heard together. The rule is
# CriticalThreshold, Gütig's own for the multi-spike tempotron: of all changes that would give one
# spike more, or one fewer, it takes the smallest. Five neurons start from different weights; the
# one that counts most training phrases right is kept.

splits = {name: part(phrases, name) for name in ("train", "test", "near", "stream")}
delayed = {name: one.delayed(speech.DELAYS) for name, one in splits.items()}
learner = speech.LEARNERS["MST, CriticalThreshold"]
agents = speech.train(learner, delayed["train"], restarts=speech.RESTARTS, epochs=speech.EPOCHS)

# %%
# How well it counts
# ------------------
# Beside it: silence, the commonest count for every phrase, and ridge regression on how often each
# channel spiked and how long the phrase was. The streams are phrases of twenty words.

rows = [*speech.control_rows(splits), speech.neuron_row("MST", agents, delayed)]
print(speech.text_table(rows))

# %%
# When it spikes
# --------------
# Nobody told it when the word was said. Its spikes come at one latency, which training phrases
# tell; with that taken off, recall is the share of sevens with a spike of their own, and precision
# the share of spikes that are within a seven. Mirrored, the same spikes are counted from the end
# of the phrase: what as many spikes at unrelated times would get.

print(f"latency {5 * rows[-1].latency} ms, with it {rows[-1].timing}")
speech.draw(agents[0], test, speech.shown_phrase(test))
plt.show()

# %%
# Recordings of your own
# ----------------------
# ``gnm_env.speech.trial_of(*read_wav("phrase.wav"), label=2)`` makes a trial of a recording;
# ``gnm speech make`` synthesises more phrases, for another word as well.
