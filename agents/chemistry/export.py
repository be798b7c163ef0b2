"""The reaction network as SBML and as Antimony text, for chemists' own tools.

Time counts bins and carries no unit, amounts count molecules (the unit "item"). Input spikes are
events: at time t_j they add `molecules` to I_i. The parameter `molecules` can be set anew in the
tool; `potential` is V in molecules per spike, the unit in which the threshold `theta` is given.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from agents.chemistry.extra import optional
from agents.chemistry.network import ReactionNetwork
from agents.continuous.simulate import InputSpikes
from gnm_env.checks import whole

MODEL = "gnm"
MOLECULES = 100

_NOTES = """<body xmlns="http://www.w3.org/1999/xhtml">
<p>A generalised neuron (Fil and Chu, "Minimal spiking neuron for solving multi-label classification
tasks") as a reaction network. Time counts bins. An input spike of channel i adds `molecules` of
species I_i at once; `potential` is V in molecules per spike, `theta` the readout threshold.</p>
<p>libRoadRunner solves it deterministically if every species has an absolute tolerance of its own
(integrator.absolute_tolerance = [1e-9, 1e-9, ...]): with a common one CVODE gives up once inputs
have decayed to almost nothing. Its stochastic solver does not place events in time exactly; stop at
each spike, add the molecules, and go on.</p></body>"""


def sbml(
    network: ReactionNetwork, spikes: InputSpikes | None = None, molecules: int = MOLECULES
) -> str:
    """The network as SBML Level 3 Version 2, valid by libSBML's own check.

    Args:
        network: the network.
        spikes: input spikes, as events; None: the network alone.
        molecules: of I_i that one input spike adds; >= 1.

    Raises:
        ValueError: if `spikes` have other channels than the network, or `molecules` < 1.
        ImportError: if libSBML is not installed.
    """
    libsbml = optional("libsbml")
    document = libsbml.SBMLDocument(3, 2)
    model = document.createModel()
    model.setId(MODEL)
    model.setName("Generalised neuron, eta = 0")
    model.setNotes(_NOTES)
    for unit in ("Substance", "Extent"):
        getattr(model, f"set{unit}Units")("item")
    for unit in ("Time", "Volume"):
        getattr(model, f"set{unit}Units")("dimensionless")
    _add_vessel(model)
    _add_neuron(libsbml, model, network, whole("molecules", molecules, low=1))
    for i, weight in enumerate(network.weights):
        _add_input(libsbml, model, i, float(weight))
    if spikes is not None:
        _add_events(libsbml, model, network, spikes)
    _require_valid(libsbml, document)
    return str(libsbml.writeSBMLToString(document))


def antimony(
    network: ReactionNetwork, spikes: InputSpikes | None = None, molecules: int = MOLECULES
) -> str:
    """The same model as Antimony text; arguments and errors as for `sbml`."""
    library = optional("antimony")
    library.clearPreviousLoads()
    if library.loadSBMLString(sbml(network, spikes, molecules)) < 0:
        raise RuntimeError(f"Antimony cannot read the model: {library.getLastError()}")
    return str(library.getAntimonyString(MODEL))


def _add_vessel(model: Any) -> None:
    vessel = model.createCompartment()
    vessel.setId("vessel")
    vessel.setConstant(True)
    vessel.setSpatialDimensions(3)
    vessel.setSize(1.0)
    vessel.setUnits("dimensionless")


def _add_neuron(libsbml: Any, model: Any, network: ReactionNetwork, molecules: int) -> None:
    _add_species(model, "V", "membrane potential, in molecules")
    _add_parameter(model, "alpha", "decay of the membrane potential, per bin", network.alpha)
    _add_parameter(model, "C", "reaction of input molecules, per bin", network.conversion)
    _add_parameter(model, "theta", "readout threshold, molecules per spike", network.theta_r)
    _add_parameter(model, "molecules", "molecules per input spike", float(molecules), "item")
    _add_parameter(model, "potential", "membrane potential, molecules per spike", None)
    rule = model.createAssignmentRule()
    rule.setVariable("potential")
    rule.setMath(libsbml.parseL3Formula("V / molecules"))
    _add_reaction(libsbml, model, "decay", "V", None, "alpha * V")


def _add_input(libsbml: Any, model: Any, i: int, weight: float) -> None:
    _add_species(model, f"I{i}", f"input channel {i}")
    _add_parameter(model, f"w{i}", f"weight of channel {i}", weight)
    _add_reaction(libsbml, model, f"excite{i}", f"I{i}", "V", f"w{i} * C * I{i}")
    lost = f"(1 dimensionless - w{i}) * C * I{i}"
    _add_reaction(libsbml, model, f"lose{i}", f"I{i}", None, lost)


def _add_species(model: Any, id_: str, name: str) -> None:
    species = model.createSpecies()
    species.setId(id_)
    species.setName(name)
    species.setCompartment("vessel")
    species.setInitialAmount(0.0)
    species.setSubstanceUnits("item")
    species.setHasOnlySubstanceUnits(True)
    species.setBoundaryCondition(False)
    species.setConstant(False)


def _add_parameter(
    model: Any, id_: str, name: str, value: float | None, units: str = "dimensionless"
) -> None:
    """A constant; without a value, a quantity that a rule determines."""
    parameter = model.createParameter()
    parameter.setId(id_)
    parameter.setName(name)
    parameter.setUnits(units)
    parameter.setConstant(value is not None)
    if value is not None:
        parameter.setValue(value)


def _add_reaction(
    libsbml: Any, model: Any, id_: str, reactant: str, product: str | None, rate: str
) -> None:
    reaction = model.createReaction()
    reaction.setId(id_)
    reaction.setReversible(False)
    references = [(reaction.createReactant(), reactant)]
    if product is not None:
        references.append((reaction.createProduct(), product))
    for reference, species in references:
        reference.setSpecies(species)
        reference.setStoichiometry(1.0)
        reference.setConstant(True)
    reaction.createKineticLaw().setMath(libsbml.parseL3Formula(rate))


def _add_events(libsbml: Any, model: Any, network: ReactionNetwork, spikes: InputSpikes) -> None:
    """One event for all input spikes of one moment; at time 0 it fires at once."""
    require_channels(network, spikes)
    for k, time in enumerate(np.unique(spikes.times)):
        event = model.createEvent()
        event.setId(f"spike{k}")
        event.setUseValuesFromTriggerTime(True)
        trigger = event.createTrigger()
        trigger.setInitialValue(False)
        trigger.setPersistent(True)
        trigger.setMath(libsbml.parseL3Formula(f"time >= {float(time)!r} dimensionless"))
        channels, counts = np.unique(spikes.channels[spikes.times == time], return_counts=True)
        for i, count in zip(channels, counts, strict=True):
            added = "molecules" if count == 1 else f"{count} dimensionless * molecules"
            assignment = event.createEventAssignment()
            assignment.setVariable(f"I{i}")
            assignment.setMath(libsbml.parseL3Formula(f"I{i} + {added}"))


def require_channels(network: ReactionNetwork, spikes: InputSpikes) -> None:
    """ValueError if `spikes` are not those of the network's input channels."""
    if spikes.n_inputs != network.n_inputs:
        raise ValueError(
            "spikes must have as many channels as the network has input species, "
            f"{network.n_inputs}, got {spikes.n_inputs}"
        )


def _require_valid(libsbml: Any, document: Any) -> None:
    document.checkConsistency()
    if document.getNumErrors():
        raise RuntimeError(
            f"libSBML finds fault with the model: {document.getError(0).getMessage()}"
        )
