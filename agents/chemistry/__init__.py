"""A trained continuous neuron as a chemical reaction network.

Export and simulation need the extra `chemistry` (libRoadRunner, libSBML, Antimony); it is imported
only when it is used.
"""

from agents.chemistry.export import antimony, sbml
from agents.chemistry.network import ReactionNetwork
from agents.chemistry.reactor import Course, Reactor

__all__ = ["Course", "ReactionNetwork", "Reactor", "antimony", "sbml"]
