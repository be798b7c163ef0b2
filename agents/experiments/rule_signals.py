"""What each rule teaches: its y(t) on one trial, under the potential that it judges."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from agents import learning
from agents.explorer.teaching import teaching_signal
from agents.neuron_agent import NeuronAgent
from agents.plotting import WIDE, class_colour, panels
from agents.trained import pretrained
from gnm_env.trial import draw_trial

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RULES: dict[str, Any] = {
    "CriticalThreshold (A)": learning.CriticalThreshold(),
    "CriticalThreshold, amount (A′)": learning.CriticalThreshold(amount=True),
    "MPDAL (A)": learning.MPDAL(),
    "ErrorTrace (B)": learning.ErrorTrace(),
    "PeakError (B)": learning.PeakError(),
    "SurrogateGradient (B)": learning.SurrogateGradient(),
    "ReSuMe (C)": learning.ReSuMe(tau=6.0),
    "Chronotron (C)": learning.Chronotron(tau_q=6.0),
}


def draw(seed: int = 285) -> Figure:
    """The picture: V(t) of a neuron that makes mistakes, and below it what each rule says."""
    trained = pretrained("gnm-critical-3")
    assert trained.task is not None and trained.patterns is not None
    trial = draw_trial(trained.task, trained.patterns, np.random.default_rng(seed))
    neuron = trained.agent.neuron
    # With some disorder, so that there is something to teach.
    disorder = np.random.default_rng(seed).normal(0.0, 0.13, trial.n_inputs)
    weights = trained.agent.weights + disorder

    def agent(rule: Any) -> NeuronAgent:
        made = NeuronAgent(neuron, rule, trial.n_inputs, weight_bounds=None)
        made.weights = weights
        return made

    heard = agent(learning.CriticalThreshold()).record(trial)
    figure, axes = panels(
        1 + len(RULES), 1, width=WIDE, height=1.3 + 0.5 * len(RULES), sharex=True,
        gridspec_kw={"height_ratios": [3.2] + [1] * len(RULES)},
    )  # fmt: skip
    top = axes[0, 0]
    top.plot(heard.V, color="0.1", linewidth=0.9)
    top.axhline(neuron.threshold, color="0.5", linestyle="--", linewidth=0.8)
    top.plot(np.flatnonzero(heard.spikes), heard.V[heard.spikes] + 0.12, "v", color="C3", ms=4)
    top.set_ylabel("V(t)")
    for onset, end, class_, owed in zip(
        trial.onsets, trial.ends, trial.classes, trial.targets, strict=True
    ):
        given = int(heard.spikes[onset:end].sum())
        top.text(
            (onset + end) / 2, 1.02, f"owed {owed}, given {given}", ha="center", va="bottom",
            fontsize=7, transform=top.get_xaxis_transform(), color=class_colour(class_),
        )  # fmt: skip
    for axis, (name, rule) in zip(axes[1:, 0], RULES.items(), strict=True):
        y = teaching_signal(agent(rule), trial)
        assert y is not None
        axis.axhline(0.0, color="0.8", linewidth=0.6)
        axis.vlines(np.arange(len(y)), 0.0, y, color="C0", linewidth=1.1)
        axis.set_yticks([])
        axis.set_ylabel(name, rotation=0, ha="right", va="center", fontsize=7)
    for axis in axes[:, 0]:
        for onset, end, class_ in zip(trial.onsets, trial.ends, trial.classes, strict=True):
            axis.axvspan(onset, end, color=class_colour(class_), alpha=0.13, linewidth=0)
        axis.set_xlim(0, trial.n_bins)
    axes[-1, 0].set_xlabel("time (bins)")
    return figure
