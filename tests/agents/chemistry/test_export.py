"""SBML and Antimony: valid, complete, and the same model in the engine."""

from __future__ import annotations

import numpy as np
import pytest

from agents.chemistry import ReactionNetwork, Reactor, antimony, sbml
from agents.continuous import InputSpikes

libsbml = pytest.importorskip("libsbml")
roadrunner = pytest.importorskip("roadrunner")
pytest.importorskip("antimony")

NETWORK = ReactionNetwork(np.array([0.25, 1.0, 0.0]), alpha=0.2)
# Two at once, one of them twice; one at the very beginning; one between the bins.
SPIKES = InputSpikes([0.0, 2.0, 2.0, 2.0, 3.7], [1, 0, 0, 2, 1], 8.0, 3)


def test_libsbml_finds_nothing_to_complain_of() -> None:
    document = libsbml.readSBMLFromString(sbml(NETWORK, SPIKES))
    document.checkConsistency()
    assert document.getNumErrors() == 0


def test_the_model_has_the_reactions_of_the_network() -> None:
    model = libsbml.readSBMLFromString(sbml(NETWORK, SPIKES, molecules=40)).getModel()
    laws = {r.getId(): libsbml.formulaToL3String(r.getKineticLaw().getMath()) for r in
            (model.getReaction(k) for k in range(model.getNumReactions()))}  # fmt: skip
    assert laws["decay"] == "alpha * V"
    assert laws["excite2"] == "w2 * C * I2"
    assert laws["lose2"] == "(1 dimensionless - w2) * C * I2"
    assert len(laws) == 1 + 2 * 3
    assert model.getReaction("excite0").getProduct(0).getSpecies() == "V"
    assert model.getReaction("lose0").getNumProducts() == 0
    values = {name: model.getParameter(name).getValue() for name in ("w0", "alpha", "C")}
    assert values == {"w0": 0.25, "alpha": 0.2, "C": 10.0}
    assert model.getParameter("molecules").getValue() == 40
    assert model.getNumEvents() == 3


def test_without_input_there_are_no_events() -> None:
    assert "<event " not in sbml(NETWORK)


def test_antimony_text_reads_as_chemistry() -> None:
    text = antimony(NETWORK, SPIKES)
    for line in ("decay: V => ; alpha*V;", "excite1: I1 => V; w1*C*I1;", "C = 10;"):
        assert line in text
    assert "at time >= 2 dimensionless, t0=false: I0 = I0 + 2" in text.replace("(", "")


def test_the_exported_model_loaded_fresh_gives_the_trace_of_our_own_simulation() -> None:
    ours = Reactor(NETWORK).deterministic(SPIKES, points_per_bin=10)
    for molecules in (1, 500):
        fresh = roadrunner.RoadRunner(sbml(NETWORK, SPIKES, molecules))
        fresh.integrator.relative_tolerance = 1e-10
        fresh.integrator.absolute_tolerance = [1e-10] * 4
        fresh.timeCourseSelections = ["time", "potential"]
        theirs = np.array(fresh.simulate(0, 8, 81))
        np.testing.assert_allclose(theirs[:, 0], ours.t, atol=1e-12)
        np.testing.assert_allclose(theirs[:, 1], ours.V, atol=1e-7)


def test_spikes_of_other_channels_are_refused() -> None:
    other = InputSpikes([0.0], [0], 5.0, 4)
    with pytest.raises(ValueError, match="as many channels as the network has input species, 3"):
        sbml(NETWORK, other)
