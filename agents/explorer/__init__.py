"""The explorer: a page in the browser where a neuron learns anew whenever a slider moves.

`gnm explore` serves it to this machine alone. The page draws; everything else is computed here, by
the same compiled code that trains, scores and records everywhere in this package:

- `controls`: the sliders, from the fields of the registered neurons, rules and of the task;
- `settings`: all that a link says, and the agent, task and patterns that follow from it;
- `results`: training, score, one trial and its teaching signal, ready for JSON;
- `game`: a person answers an endless stream, under the rules that a neuron is scored by;
- `server`: the addresses of the page. It needs tornado: pip install "gnm-env[explore]".
"""
