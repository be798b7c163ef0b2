"""The agent that a neuron, or a network, and a learning rule make together."""

from __future__ import annotations

from typing import Any


def default_rule(neuron: Any) -> str:
    """The rule that a neuron learns by unless told otherwise."""
    return "bp" if neuron.name == "network" else "all"


def new_agent(
    neuron: Any,
    rule: Any,
    n_inputs: int,
    seed: int = 0,
    initial_weight: float | None = None,
    **bounds: Any,
) -> Any:
    """The untrained agent that a neuron and a rule make; `bounds` may give weight_bounds.

    Raises ValueError if they do not go together.
    """
    from agents import NeuronAgent

    layered = neuron.name == "network"
    if layered != (rule.name == "bp"):
        raise ValueError(
            f"the neuron {neuron.name} does not go with the rule {rule.name}: backpropagation "
            "needs the network's hidden layer, and only it can train that layer"
        )
    if layered:
        from agents.network import NetworkAgent

        if bounds.get("weight_bounds") is not None:
            raise ValueError("the network has no weight bounds: leave them out")
        return NetworkAgent(neuron, rule, n_inputs, seed, initial_weight)
    agent_class: Any = NeuronAgent
    if neuron.graded:
        from agents.continuous import ContinuousAgent as agent_class
    return agent_class(neuron, rule, n_inputs, seed, initial_weight, **bounds)
