"""The reaction network simulated by libRoadRunner: as concentrations, and molecule by molecule."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agents.chemistry.export import require_channels, sbml
from agents.chemistry.extra import optional
from agents.chemistry.network import ReactionNetwork
from agents.continuous.simulate import InputSpikes
from gnm_env.checks import whole

POINTS_PER_BIN = 50


@dataclass(frozen=True, eq=False)
class Course:
    """Membrane potential over time, in molecules per input spike.

    Attributes:
        t: float64 (P,), times in bins, POINTS_PER_BIN to a bin unless told otherwise.
        V: float64 (P,), or (runs, P).
        theta_r: readout threshold.
    """

    t: NDArray[np.float64]
    V: NDArray[np.float64]
    theta_r: float

    def S(self) -> NDArray[np.float64]:
        """∫ Θ(V − ϑ_R) V dt from 0 to each t, by the trapezoidal rule; shape as V."""
        rate = np.where(self.theta_r < self.V, self.V, 0.0)
        steps = np.diff(self.t) * (rate[..., 1:] + rate[..., :-1]) / 2.0
        return np.concatenate([np.zeros((*steps.shape[:-1], 1)), np.cumsum(steps, -1)], -1)


class Reactor:
    """A network, compiled once by the engine. Not for several threads at a time.

    The engine is stopped at every input spike and goes on with the molecules added: for the
    stochastic method that is exact (waiting times have no memory), which events in time are not.

    Raises:
        ImportError: if the extra `chemistry` is not installed.
    """

    def __init__(self, network: ReactionNetwork) -> None:
        roadrunner = optional("roadrunner")
        self.network = network
        self._engine = roadrunner.RoadRunner(sbml(network))
        self._engine.timeCourseSelections = ["V"]
        ids = list(self._engine.model.getFloatingSpeciesIds())
        self._species = [ids.index(f"I{i}") for i in range(network.n_inputs)]

    def deterministic(self, spikes: InputSpikes, points_per_bin: int = POINTS_PER_BIN) -> Course:
        """The network of infinitely many molecules: CVODE, relative tolerance 1e-10; V is (P,)."""
        self._engine.setIntegrator("cvode")
        integrator = self._engine.getIntegrator()
        integrator.setValue("relative_tolerance", 1e-10)
        # One tolerance for each species: with a common one the engine fails once inputs are tiny.
        integrator.setValue("absolute_tolerance", [1e-12] * (self.network.n_inputs + 1))
        segments = _segments(self.network, spikes, points_per_bin)
        return Course(_grid(spikes, points_per_bin), self._run(segments, 1), self.network.theta_r)

    def stochastic(
        self,
        spikes: InputSpikes,
        molecules: int,
        runs: int = 1,
        seed: int = 0,
        points_per_bin: int = POINTS_PER_BIN,
    ) -> Course:
        """`runs` realisations by Gillespie's exact method, `molecules` to an input spike.

        V has shape (runs, P). Run k depends on (seed, k) alone. Raises ValueError if molecules or
        runs are < 1.
        """
        molecules, runs = whole("molecules", molecules, low=1), whole("runs", runs, low=1)
        self._engine.setIntegrator("gillespie")
        integrator = self._engine.getIntegrator()
        integrator.setValue("variable_step_size", False)
        segments = _segments(self.network, spikes, points_per_bin)
        t = _grid(spikes, points_per_bin)
        V = np.empty((runs, t.size))
        for k in range(runs):
            integrator.setValue("seed", _engine_seed(seed, k))
            V[k] = self._run(segments, molecules)
        return Course(t, V / molecules, self.network.theta_r)

    def _run(self, segments: list[_Segment], molecules: int) -> NDArray[np.float64]:
        """Molecules of V at every point of the grid, from an empty vessel."""
        model = self._engine.model
        self._engine.reset()
        values = []
        for segment in segments:
            if segment.channels.size:
                species = [self._species[i] for i in segment.channels]
                amounts = model.getFloatingSpeciesAmounts(species)
                model.setFloatingSpeciesAmounts(species, amounts + molecules * segment.counts)
            result = self._engine.simulate(times=segment.times)
            values.append(np.array(result)[segment.reported, 0])
        return np.concatenate(values)


@dataclass(frozen=True, eq=False)
class _Segment:
    """The time from one input spike (or the start) to the next (or the end).

    `channels` get `counts` times the molecules of a spike at its beginning; of `times` those at
    the places `reported` belong to the grid.
    """

    channels: NDArray[np.int64]
    counts: NDArray[np.int64]
    times: NDArray[np.float64]
    reported: NDArray[np.bool_]


def _segments(network: ReactionNetwork, spikes: InputSpikes, points_per_bin: int) -> list[_Segment]:
    require_channels(network, spikes)
    grid = _grid(spikes, points_per_bin)
    edges = np.unique(np.concatenate([[0.0], spikes.times, [spikes.duration]]))
    return [
        _segment(spikes, grid, start, stop, last=stop == spikes.duration)
        for start, stop in itertools.pairwise(edges)
    ]


def _segment(
    spikes: InputSpikes, grid: NDArray[np.float64], start: float, stop: float, last: bool
) -> _Segment:
    # A point of the grid at an edge belongs to the segment that begins there, for V does not jump.
    inside = grid[(grid >= start) & ((grid < stop) | last)]
    times = np.union1d(inside, [start, stop])
    channels, counts = np.unique(spikes.channels[spikes.times == start], return_counts=True)
    return _Segment(channels, counts, times, np.isin(times, inside))


def _grid(spikes: InputSpikes, points_per_bin: int) -> NDArray[np.float64]:
    n = whole("points_per_bin", points_per_bin, low=1)
    return np.arange(int(spikes.duration * n) + 1) / n


def _engine_seed(seed: int, run: int) -> int:
    """A seed of 31 bits, as the engine takes them, from a pair of our own."""
    state = np.random.SeedSequence((whole("seed", seed, low=0), run)).generate_state(1)
    return int(state[0] >> 1)
