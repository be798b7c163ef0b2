"""A second opinion on every learning rule: slow, plain, from the formulas, sharing no code.

Each rule is one function of a trial, a neuron and its weights. It gives a `Lesson`: whether the
trial teaches at all, the teaching signal y(t) where the rule has one, and Δw before momentum and
bounds. What the formulas leave open is settled here, and the package must agree.

Bins and order
    1. Within a bin the input comes first, then the output spike. So an input spike of the same bin
       counts as before an output or target spike: x_i(t) holds it with the kernel's value at lag 0.
    2. o is the number of output spikes, d the label. Segments alternate noise, presentation,
       noise, …; a spike belongs to the segment that holds its bin, wherever its peak lies.
    3. y adds up where two lessons fall on one bin.

When nothing is taught
    4. If y(t) = 0 in every bin there is no learning step: weights and velocity stay, as when ALL is
       right. If y is not zero there is a step, even if every eligibility should be 0: then Δ is the
       momentum alone. Rules without y: STDP takes a step whenever there is an output spike, MSTDPET
       whenever r is not 0.

Peaks
    5. A peak is X(t−1) < X(t) >= X(t+1), asked bin by bin, on the readout X. Of a plateau only the
       first bin can be one, and is one even if the potential rises again behind the plateau. The
       first bin need not rise, the last need not fall; neighbours are those in the trial, also
       across the edge of a segment. A bin 0 with X = 0 and no rise after it is a peak.
    6. A missed peak is a peak with X < ϑ. While a GNM or LIF stays above ϑ it has none; if there is
       none anywhere, "too few" teaches nothing (minima, which could split an excursion, are left
       out). For the LIF, V before the reset is compared with V before the reset: the bin after a
       spike is rarely a peak.
    7. A spike's peak is the highest X from the spike's bin on while X >= ϑ and no new spike comes,
       the first if several are equal. For the LIF it is the spike's own bin. The variant
       `at="crossing"` takes the spike's own bin and its height there instead.
    8. Of equal heights the earliest bin wins, among missed peaks as among spikes.
    9. Fewer missed peaks than spikes are missing: all there are.
   10. Readout D: D(t) is made of V(t−1), so heights and bins are those of D, and y sits one bin
       earlier, where V is. A lesson for bin 0 of D is void. The factor (1−η)α is left to λ.

The rules
   11. CriticalThreshold, GNM and LIF: o < d: y = +1 at the highest missed peak; o > d: y = −1 at
       the lowest spike's peak; resets and R as they fell. `amount`: |d − o| of them. Exact as ∇ϑ*
       only for the GNM at η = 0, and there with excursions that neither split nor merge.
   12. CriticalThreshold, MST: y = ±1/C(t*) at the event's bin of ϑ*, as in `critical.py`: of all
       changes of the train on the way from ϑ, the first that brings the count to o + 1 or more (to
       o − 1 or less). t* is the bin in which ρ(t*) = ϑ*. On random trials it has always been the
       first spike that is there just below ϑ* and not just above; were it another (a split or merge
       that moves later spikes), x_i/C would hold at the bin of ρ(t*) = ϑ*. `amount`: the search
       goes on to d, and the lessons of every ϑ*_k on the way add up; a change by two counts twice.
       No θ > 0 with one more spike: nothing is taught.
   13. MPDAL: o < d as in 11 for every neuron, MST included (no 1/C); o > d: y = −1 in the bin of
       the last output spike.
   14. Tempotron, d in {0, 1}: right if (o > 0) = (d > 0). d = 1 and silent: y = +1 in the first bin
       of the largest X. d = 0 and o > 0: inputs after the first spike's bin t_s are shunted; y = −1
       at the highest bin of U (the potential without resets) from t_s up to the bin before the next
       input, the first if equal. Until then nothing is shunted that x_i could hold, so the
       presynaptic traces are the ordinary ones. For GNM and LIF the bin is t_s itself.
   15. PeakError: every noise spike: −1 at its peak. A presentation with too few spikes: +1 at as
       many of its highest missed peaks as are missing; with too many: −1 at as many of the lowest
       of its spikes' peaks. `first_only`: the trial ends at its first mistake: a noise spike, in
       its bin; one spike too many in a presentation, in its bin (−1 at the lowest peak of the
       spikes so far); too few, in the presentation's last bin (+1 at all that are missing).
   16. SurrogateGradient: y = E(t)·ψ(X(t)); E is ET's: target − count over a presentation, over
       noise −1 in bins with X >= ϑ. On the count: y = (d − o)·ψ(X(t)) in every bin.
   17. Target times: `events.chosen_targets`, `events.even_targets`. Noise has none. With chosen
       times a spike that may stay is wanted in its own bin (not at its peak), so that a trial
       answered rightly teaches nothing.
   18. ReSuMe's a is added to every input's eligibility, silent ones included.
   19. PSD and ReSuMe bring their own traces: biexponential 10 and 2.5 bins; e^(−1/τ_R) per bin with
       the neuron's own decay by default (GNM 1 − (1−η)α, LIF 1 − α, MST e^(−1/τ_m)).
   20. SPAN sees inputs after a spike as well as before: y convolves targets and outputs with the
       kernel's autocorrelation, and the presynaptic trace is the input spike alone (decay 0).
   21. Chronotron E: alignment as in `events.align` (of equal costs removing before adding before
       moving, from the last spike backward); a moved spike teaches in the bin of the output. τ_q is
       the neuron's time constant by default, −1/ln(decay), so with α = 0 or 1 it has to be given; a
       spike on its target says nothing. Chronotron I: the synaptic current I_i = w_i Σ κ includes
       the weight (else the sign would push inhibitory inputs the wrong way), so Δw_i = λ|w_i| Σ κ;
       a weight of 0 stays 0. κ decays by e^(−1/τ_s) for the MST, and is the presynaptic trace for
       GNM and LIF, whose synapses are instantaneous.
   22. STDP: immediate pairs. Potentiation: an output with the channel's last input spike at or
       before it, unless an earlier output lies in that input's bin or after it. Depression: an
       input spike with the last output in an earlier bin, unless another input spike of the channel
       lies between. So an input between two outputs, the later one's bin included, counts both
       ways. Changes add up over the trial and act at its end, times λ (1: the published amounts).
   23. MSTDPET: r = −|d − o| at the end of the trial, no baseline; both traces are updated before
       e_i is formed, so a pair in one bin counts both ways. r = 0 teaches nothing.
   24. PolicyGradient: one uniform u per bin from the agent's own generator, in the order of bins;
       an output spike where u < P(t). There is no reset, and no crossing is needed: neighbouring
       bins may both spike. r = −|d − o|. The baseline r̄ is the first trial's reward before it is
       the running mean r̄ ← r̄ + ρ(r − r̄), moved after the lesson; the first trial teaches
       nothing, nor does r = r̄. Neurons without reset only: the GNM (η > 0: R follows V all the
       same), with readout V. Learning off, the neuron answers by its threshold.

Sources beyond the papers: public repositories avivdotan/Tempotrons.jl (MultiSpikeTempotron.jl:
∇ϑ*; BinaryTempotron.jl: the maximum up to the next input; Chronotron.jl: order of the alignment,
γ_r = τ_q; ReSuMe.jl), fangwei123456/spikingjelly (activation_based/functional/learning.py: MSTDPET,
traces first), kaizouman/tensorsandbox (snn/STDP_masquelier_2008.ipynb: the four constants of STDP,
and only the first spike before and after), SZU-ADDG/SMDP (README: MPDAL's subthreshold maxima and
redundant spikes). Not confirmed in print: PSD's constants, SPAN's kernel (its autocorrelation is
worked out here and checked by summing), Chronotron's I_i, MPDAL's choice of the *last* spike.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tests.agents.learning.oracles import events
from tests.agents.learning.oracles.critical import critical_thresholds
from tests.agents.learning.oracles.neurons import (
    GNM,
    MST,
    Bools,
    Floats,
    Response,
    Spec,
    biexponential,
    exponential,
    hear,
    kernel,
    traces,
)


class Trial(NamedTuple):
    """What a trial holds and what it is owed."""

    raster: Bools
    """Input spikes, (T, N)."""
    edges: list[int]
    """2K + 2 bins: segment s is edges[s] … edges[s+1] − 1; 0 first, T last."""
    target: list[int]
    """Spikes owed by each of the 2K + 1 segments: noise, presentation, …, noise."""

    @property
    def label(self) -> int:
        """Aggregate label d."""
        return sum(self.target)

    @property
    def n_bins(self) -> int:
        return len(self.raster)


class Lesson(NamedTuple):
    """What a rule makes of a trial."""

    teaches: bool
    """Whether there is a learning step at all."""
    y: Floats | None
    """Teaching signal (T,), where the rule is one."""
    change: Floats
    """Δw (N,), before momentum and bounds."""


def act(
    lesson: Lesson,
    weights: ArrayLike,
    velocity: ArrayLike,
    momentum: float = 0.2,
    bounds: tuple[float, float] | None = None,
) -> tuple[Floats, Floats]:
    """Weights and velocity after the lesson: Δ = Δw + μ·velocity, w = clip(w + Δ)."""
    w, v = np.array(weights, np.float64), np.array(velocity, np.float64)
    if not lesson.teaches:
        return w, v
    v = lesson.change + momentum * v
    low, high = bounds or (-math.inf, math.inf)
    return np.clip(w + v, low, high), v


def counts(trial: Trial, response: Response) -> list[int]:
    """Output spikes in each segment."""
    return [
        int(response.spikes[start:stop].sum())
        for start, stop in zip(trial.edges, trial.edges[1:], strict=False)
    ]


def teach(
    trial: Trial, y: Floats, learning_rate: float, response: ArrayLike, extra: float = 0.0
) -> Lesson:
    """Δw_i = λ(Σ_t x_i(t) y(t) + extra), the traces being made of `response`."""
    x = traces(trial.raster, response)
    eligibility = [sum(x[t, i] * y[t] for t in range(len(y))) for i in range(x.shape[1])]
    teaches = bool(np.any(y != 0.0)) or extra != 0.0
    return Lesson(teaches, y, learning_rate * (np.array(eligibility) + extra))


def signal(trial: Trial, neuron: Spec, marks: Iterable[tuple[int, float]]) -> Floats:
    """y(t) from bins of the readout and values; with readout D a bin earlier, where V is."""
    y = np.zeros(trial.n_bins)
    for bin_, value in marks:
        if bin_ >= neuron.lag:
            y[bin_ - neuron.lag] += value
    return y


def critical_threshold(
    trial: Trial,
    neuron: Spec,
    weights: ArrayLike,
    learning_rate: float = 0.01,
    amount: bool = False,
    at: str = "peak",
) -> Lesson:
    """∇ϑ* of the nearest missing or extra spike; class A, with `amount` A′."""
    response = hear(neuron, trial.raster, weights)
    output, d = len(response.times), trial.label
    n = abs(d - output) if amount else min(1, abs(d - output))
    sign = 1.0 if output < d else -1.0
    if isinstance(neuron, MST):
        toward = output + (n if output < d else -n)
        found = critical_thresholds(neuron, response.U, output, toward)
        marks = [(one.bin_, sign / one.C) for one in found]
    elif output < d:
        missed = events.missed_peaks(response, neuron.threshold)
        marks = [(peak.bin_, sign) for peak in events.highest(missed, n)]
    else:
        spikes = events.spike_peaks(response, neuron.threshold, at)
        marks = [(peak.bin_, sign) for peak in events.lowest(spikes, n)]
    y = signal(trial, neuron, marks)
    return teach(trial, y, learning_rate, kernel(neuron, trial.n_bins))


def mpdal(trial: Trial, neuron: Spec, weights: ArrayLike, learning_rate: float = 0.01) -> Lesson:
    """The highest missed peak up, or the last output spike down; class A."""
    response = hear(neuron, trial.raster, weights)
    marks: list[tuple[int, float]] = []
    if len(response.times) < trial.label:
        missed = events.missed_peaks(response, neuron.threshold)
        marks = [(peak.bin_, 1.0) for peak in events.highest(missed, 1)]
    elif len(response.times) > trial.label:
        marks = [(response.times[-1], -1.0)]
    y = signal(trial, neuron, marks)
    return teach(trial, y, learning_rate, kernel(neuron, trial.n_bins))


def tempotron(
    trial: Trial, neuron: Spec, weights: ArrayLike, learning_rate: float = 0.01
) -> Lesson:
    """The largest potential up or down, labels 0 and 1; class A."""
    if trial.label > 1:
        raise ValueError(f"a tempotron's label is 0 or 1, got {trial.label}")
    response = hear(neuron, trial.raster, weights)
    marks: list[tuple[int, float]] = []
    if trial.label == 1 and not response.times:
        marks = [(int(np.argmax(response.X)), 1.0)]
    elif trial.label == 0 and response.times:
        marks = [(_shunted_maximum(trial, neuron, response), -1.0)]
    y = signal(trial, neuron, marks)
    return teach(trial, y, learning_rate, kernel(neuron, trial.n_bins))


def _shunted_maximum(trial: Trial, neuron: Spec, response: Response) -> int:
    first = response.times[0]
    if not isinstance(neuron, MST):
        return first
    stop = first + 1
    while stop < trial.n_bins and not trial.raster[stop].any():
        stop += 1
    return first + int(np.argmax(response.U[first:stop]))


def peak_error(
    trial: Trial,
    neuron: Spec,
    weights: ArrayLike,
    learning_rate: float = 0.003,
    first_only: bool = False,
    at: str = "peak",
) -> Lesson:
    """A perceptron on misplaced peaks; class B."""
    response = hear(neuron, trial.raster, weights)
    spikes = events.spike_peaks(response, neuron.threshold, at)
    missed = events.missed_peaks(response, neuron.threshold)
    marks: list[tuple[int, float]] = []
    for s, owed in enumerate(trial.target):
        start, stop = trial.edges[s], trial.edges[s + 1]
        here = events.within(spikes, start, stop)
        if first_only:
            here = here[: owed + 1]  # the next would come after the first mistake
        wrong = len(here) - owed
        if wrong > 0:
            marks += [(peak.bin_, -1.0) for peak in events.lowest(here, wrong)]
        else:
            peaks = events.highest(events.within(missed, start, stop), -wrong)
            marks += [(peak.bin_, 1.0) for peak in peaks]
        if first_only and wrong:
            break
    y = signal(trial, neuron, marks)
    return teach(trial, y, learning_rate, kernel(neuron, trial.n_bins))


def error_trace(trial: Trial, response: Response) -> Floats:
    """E(t): what a presentation lacks, in all its bins; −1 in noise at or above the threshold."""
    E = np.where(response.above, -1.0, 0.0)
    given = counts(trial, response)
    for s in range(1, len(trial.target), 2):
        E[trial.edges[s] : trial.edges[s + 1]] = trial.target[s] - given[s]
    return E


def superspike(X: Floats, threshold: float, k: float = 5.0) -> Floats:
    """ψ = 1 / (1 + k|X − ϑ|)²."""
    return np.array([1.0 / (1.0 + k * abs(x - threshold)) ** 2 for x in X])


def triangle(X: Floats, threshold: float, height: float = 0.3) -> Floats:
    """ψ = (0.3/ϑ)·max(0, 1 − |X − ϑ|/ϑ)."""
    return np.array(
        [height / threshold * max(0.0, 1.0 - abs(x - threshold) / threshold) for x in X]
    )


def surrogate_gradient(
    trial: Trial,
    neuron: Spec,
    weights: ArrayLike,
    learning_rate: float = 0.01,
    surrogate: str = "superspike",
    k: float = 5.0,
    on_count: bool = False,
) -> Lesson:
    """Errors times the surrogate derivative of the spike; class B, on the count A′."""
    response = hear(neuron, trial.raster, weights)
    if on_count:
        E = np.full(trial.n_bins, float(trial.label - len(response.times)))
    else:
        E = error_trace(trial, response)
    if surrogate == "superspike":
        psi = superspike(response.X, neuron.threshold, k)
    else:
        psi = triangle(response.X, neuron.threshold)
    y = signal(trial, neuron, enumerate(E * psi))
    return teach(trial, y, learning_rate, kernel(neuron, trial.n_bins))


def target_times(trial: Trial, neuron: Spec, response: Response, times: str) -> list[int]:
    """Target spike times from the label: "choose" or "even"."""
    if times == "even":
        return events.even_targets(trial.edges, trial.target)
    return events.chosen_targets(response, neuron.threshold, trial.edges, trial.target)


def resume(
    trial: Trial,
    neuron: Spec,
    weights: ArrayLike,
    learning_rate: float = 0.003,
    times: str = "choose",
    a: float = 0.0,
    tau: float | None = None,
) -> Lesson:
    """ReSuMe: targets up, outputs down, an exponential trace; class C."""
    response = hear(neuron, trial.raster, weights)
    targets = target_times(trial, neuron, response, times)
    y = _difference(trial, neuron, targets, response.times)
    decay = neuron.decay if tau is None else math.exp(-1.0 / tau)
    extra = a * (len(targets) - len(response.times))
    return teach(trial, y, learning_rate, exponential(decay, trial.n_bins), extra)


def psd(
    trial: Trial,
    neuron: Spec,
    weights: ArrayLike,
    learning_rate: float = 0.003,
    times: str = "choose",
    slow: float = 10.0,
    fast: float = 2.5,
) -> Lesson:
    """PSD: targets up, outputs down, the postsynaptic current as trace; class C."""
    response = hear(neuron, trial.raster, weights)
    targets = target_times(trial, neuron, response, times)
    y = _difference(trial, neuron, targets, response.times)
    return teach(trial, y, learning_rate, biexponential(slow, fast, trial.n_bins))


def _difference(
    trial: Trial, neuron: Spec, targets: Sequence[int], outputs: Sequence[int]
) -> Floats:
    marks = [(t, 1.0) for t in targets] + [(t, -1.0) for t in outputs]
    return signal(trial, neuron, marks)


def span(
    trial: Trial,
    neuron: Spec,
    weights: ArrayLike,
    learning_rate: float = 1e-4,
    times: str = "choose",
    tau: float = 5.0,
) -> Lesson:
    """SPAN: spike trains convolved with α(t) = (e/τ) t e^(−t/τ); class C.

    ∫ α(s) α(s + Δ) ds = (e/2)² (|Δ| + τ) e^(−|Δ|/τ), from which Δw is worked out pair by pair; y
    says the same, for a trace that is the input spike alone.
    """

    def overlap(lag: int) -> float:
        return (math.e / 2.0) ** 2 * (abs(lag) + tau) * math.exp(-abs(lag) / tau)

    response = hear(neuron, trial.raster, weights)
    targets = target_times(trial, neuron, response, times)
    error = _difference(trial, neuron, targets, response.times)
    wrong = [(int(t), float(error[t])) for t in np.flatnonzero(error)]
    y = np.array([sum(e * overlap(t - u) for u, e in wrong) for t in range(trial.n_bins)])
    change = np.zeros(trial.raster.shape[1])
    for t, i in zip(*np.nonzero(trial.raster), strict=True):
        change[i] += sum(e * overlap(t - u) for u, e in wrong)
    return Lesson(len(wrong) > 0, y, learning_rate * change)


def chronotron(
    trial: Trial,
    neuron: Spec,
    weights: ArrayLike,
    learning_rate: float = 0.003,
    times: str = "choose",
    rule: str = "E",
    tau_q: float | None = None,
    gamma_r: float | None = None,
) -> Lesson:
    """Chronotron, E- or I-learning; class C."""
    response = hear(neuron, trial.raster, weights)
    targets = target_times(trial, neuron, response, times)
    if rule == "I":
        return _chronotron_i(trial, neuron, weights, learning_rate, targets, response.times)
    tau = -1.0 / math.log(neuron.decay) if tau_q is None else tau_q
    gamma = tau if gamma_r is None else gamma_r
    aligned = events.align(response.times, targets, tau)
    marks = [(t, 1.0) for t in aligned.added] + [(t, -1.0) for t in aligned.removed]
    marks += [(o, gamma / tau**2 * (o - d)) for o, d in aligned.moved]
    y = signal(trial, neuron, marks)
    return teach(trial, y, learning_rate, kernel(neuron, trial.n_bins))


def _chronotron_i(
    trial: Trial,
    neuron: Spec,
    weights: ArrayLike,
    learning_rate: float,
    targets: Sequence[int],
    outputs: Sequence[int],
) -> Lesson:
    y = _difference(trial, neuron, targets, outputs)
    decay = math.exp(-1.0 / neuron.tau_s) if isinstance(neuron, MST) else neuron.decay
    lesson = teach(trial, y, learning_rate, exponential(decay, trial.n_bins))
    return lesson._replace(change=np.abs(np.asarray(weights, np.float64)) * lesson.change)


def stdp(
    trial: Trial,
    neuron: Spec,
    weights: ArrayLike,
    learning_rate: float = 1.0,
    a_plus: float = 0.03125,
    a_minus: float = 0.85 * 0.03125,
    tau_plus: float = 16.8,
    tau_minus: float = 33.7,
) -> Lesson:
    """STDP of immediate pairs; class U. Bounds (0, 1) are the agent's."""
    outputs = hear(neuron, trial.raster, weights).times
    change = np.zeros(trial.raster.shape[1])
    for i in range(trial.raster.shape[1]):
        inputs = [int(t) for t in np.flatnonzero(trial.raster[:, i])]
        for o in outputs:
            before = [t for t in inputs if t <= o]
            if before and not any(before[-1] <= other < o for other in outputs):
                change[i] += a_plus * math.exp(-(o - before[-1]) / tau_plus)
        for t in inputs:
            before = [o for o in outputs if o < t]
            if before and not any(before[-1] < other < t for other in inputs):
                change[i] -= a_minus * math.exp(-(t - before[-1]) / tau_minus)
    return Lesson(len(outputs) > 0, None, learning_rate * change)


def mstdpet(
    trial: Trial,
    neuron: Spec,
    weights: ArrayLike,
    learning_rate: float = 0.01,
    tau: float = 20.0,
    tau_e: float = 25.0,
    a_plus: float = 1.0,
    a_minus: float = 1.0,
) -> Lesson:
    """Reward-modulated STDP with an eligibility trace, rewarded at the end; class A′."""
    outputs = hear(neuron, trial.raster, weights).times
    reward = -float(abs(trial.label - len(outputs)))
    last = trial.n_bins - 1
    change = np.zeros(trial.raster.shape[1])
    for i in range(trial.raster.shape[1]):
        total = 0.0
        for s in (int(t) for t in np.flatnonzero(trial.raster[:, i])):
            for o in outputs:
                pair = math.exp(-abs(o - s) / tau)
                if s <= o:
                    total += a_plus * pair * math.exp(-(last - o) / tau_e) / tau_e
                if o <= s:
                    total -= a_minus * pair * math.exp(-(last - s) / tau_e) / tau_e
        change[i] = total
    return Lesson(reward != 0.0, None, learning_rate * reward * change)


class Policy(NamedTuple):
    """What the stochastic neuron did and learned."""

    lesson: Lesson
    spikes: Bools
    probability: Floats
    baseline: float
    """r̄ after the trial."""


def policy_gradient(
    trial: Trial,
    neuron: GNM,
    weights: ArrayLike,
    uniform: Callable[[], float],
    learning_rate: float = 0.01,
    width: float = 0.1,
    baseline: float | None = None,
    baseline_rate: float = 0.05,
) -> Policy:
    """REINFORCE with escape noise; `uniform` draws a number, `baseline` is r̄ or None at first.

    A spike comes as soon as the hazard −Σ ln(1 − P) since the last one has reached one unit
    exponential number, −ln u: in each bin with probability P, whatever was before.

    ln P(z) = Σ_t z ln P + (1−z) ln(1−P), and its derivative with respect to w_i is
    Σ_t x_i(t)(z − P)/ΔV where V is linear in the weights: exact at η = 0.
    """
    V = hear(neuron, trial.raster, weights).V
    P = np.array([_logistic((v - neuron.threshold) / width) for v in V])
    z = np.zeros(len(P), np.bool_)
    left = -math.log(uniform())
    for t, v in enumerate(V):
        left -= float(np.logaddexp(0.0, (v - neuron.threshold) / width))
        if left <= 0.0:
            z[t] = True
            left = -math.log(uniform())
    reward = -float(abs(trial.label - int(z.sum())))
    mean = reward if baseline is None else baseline
    y = (reward - mean) * (z - P) / width
    lesson = teach(trial, y, learning_rate, kernel(neuron, trial.n_bins))
    return Policy(lesson, z, P, mean + baseline_rate * (reward - mean))


def _logistic(x: float) -> float:
    """1 / (1 + e^(−x)), without overflow."""
    return 1.0 / (1.0 + math.exp(-x)) if x >= 0.0 else math.exp(x) / (1.0 + math.exp(x))
