"""Figures 2 and 8: neurons in continuous time, and as chemical reaction networks."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from agents.chemistry.mistakes import Mistakes
from agents.chemistry.reactor import POINTS_PER_BIN, Course
from agents.continuous.outputs import course, pattern_spikes
from experiments.continuous import untrained
from experiments.reactions import pooled, traced_trial
from experiments.verdict import Results
from figures_continuous import draw_classes, draw_mistakes, draw_volumes
from gnm_env import Patterns, Task


def classes(results: Results) -> Figure:
    """V and S of one neuron under each of its patterns."""
    data, task, patterns = _shown(results["F2"])
    alpha = data.attrs["settings"]["common"]["alpha"]
    neuron = untrained(alpha, int(data["pattern_seed"]))
    neuron.weights = data["weights"].to_numpy()
    courses = [course(neuron, pattern_spikes(patterns, c)) for c in range(task.n_classes)]
    return draw_classes(courses, task.owed, neuron.neuron.theta_r)


def volumes(results: Results) -> Figure:
    """V of one network with few and with many molecules, over the same input."""
    data, task, patterns = _shown(results["F8"])
    trial = traced_trial(task, patterns, int(data["evaluation_seed"]))
    stochastic = {int(m): _course(data["V"].sel(traced=m)) for m in data["traced"]}
    return draw_volumes(trial, _course(data["V_deterministic"]), stochastic)


def mistakes(results: Results) -> Figure:
    """Wrong outputs per trial against the number of molecules, over all seeds."""
    data = results["F8"]
    stochastic = pooled(data["wrong"], "heard", "molecules").T
    alone = (data[name].transpose("classes", "pattern_seed", "heard").to_numpy().ravel()
             for name in ("wrong_deterministic", "wrong_neuron"))  # fmt: skip
    return draw_mistakes(Mistakes(data["molecules"].to_numpy(), stochastic, *alone))


def _shown(results: xr.Dataset) -> tuple[xr.Dataset, Task, Patterns]:
    """The first pattern seed that is stored, whatever its neuron does, its task and patterns."""
    data = results.isel(classes=0, pattern_seed=0)
    task = Task(n_classes=int(data["classes"]))
    return data, task, Patterns.draw(task, int(data["pattern_seed"]))


def _course(V: xr.DataArray) -> Course:
    values = V.to_numpy()
    return Course(np.arange(len(values)) / POINTS_PER_BIN, values, theta_r=1.0)
