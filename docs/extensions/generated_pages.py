"""Pages that are written from the code: one per environment, one per public module.

The manual of an environment is its docstring; the page is that docstring with pictures.
"""

from __future__ import annotations

import importlib
import inspect
from collections import defaultdict
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.envs.registration import EnvSpec
from markdown_docstrings import is_plain_data
from public_names import ROOTS, Public, public_modules, public_names, unique
from sphinx.application import Sphinx

from gnm_env.levels import LEVELS

NAMESPACE = "gnm"
INHERITED_FROM_OTHERS = (
    "object, tuple, dict, Exception, Env, Wrapper, VectorEnv, VectorWrapper, ABC, Module"
)


def specs() -> list[EnvSpec]:
    """The environments that `import gnm_env` registers, without those of the suite's levels.

    Levels are the same environments with keywords; one page lists them.
    """
    importlib.import_module("gnm_env")
    levels = {id for level in LEVELS for id in (level.trial_id, level.stream_id)}
    own = (spec for spec in gym.registry.values() if spec.namespace == NAMESPACE)
    return [spec for spec in own if spec.id not in levels]


def page_name(spec: EnvSpec) -> str:
    return spec.id.replace("/", "-")


def class_of(entry_point: Any) -> type:
    if isinstance(entry_point, str):
        module, _, name = entry_point.partition(":")
        return getattr(importlib.import_module(module), name)
    return entry_point


def base_manual(cls: type) -> str:
    """The docstring of the nearest base of ours: what all vector environments have in common."""
    bases = [b for b in cls.__mro__[1:] if b.__module__.startswith("gnm_env") and b.__doc__]
    return inspect.cleandoc(bases[0].__doc__ or "") if bases else ""


def environment_page(spec: EnvSpec) -> str:
    """Gymnasium's form, from the docstrings of the two classes."""
    single = class_of(spec.entry_point)
    name = page_name(spec)
    text = [f"# {spec.id}", "", f"![A rendered frame]({name}.png)", ""]
    text += [f"`gym.make({spec.id!r})`", "", inspect.cleandoc(single.__doc__ or "")]
    if spec.vector_entry_point:
        vector = class_of(spec.vector_entry_point)
        own = inspect.cleandoc(vector.__doc__ or "")
        shared = base_manual(vector)
        manual = own if not shared or shared in own else f"{own}\n\n{shared}"
        text += ["", "## Vector version", "", f"`gym.make_vec({spec.id!r}, num_envs=1024, "]
        text[-1] += 'vectorization_mode="vector_entry_point")`'
        text += ["", manual.replace("\n## ", "\n### ")]
    return "\n".join(text) + "\n"


def trained_agent(task: Any, patterns: Any) -> Any:
    """A neuron that knows the patterns, for the pictures."""
    from agents import GNM, ErrorTrace, NeuronAgent, train_many

    rule = ErrorTrace(learning_rate=1e-3, modulate=True)
    agent = NeuronAgent(GNM(alpha=0.2), rule, n_inputs=task.n_inputs)
    train_many([agent], task, patterns, trials=20_000, seed=1)
    return agent


def picture(spec: EnvSpec, path: Path) -> None:
    """A frame of the last bins of an episode, answered by a trained neuron."""
    import matplotlib.image

    from gnm_env import Patterns, Task

    task = Task(n_classes=2)
    patterns = Patterns.draw(task, seed=4)
    agent = trained_agent(task, patterns)
    env = gym.make(spec.id, task=task, patterns=patterns, render_mode="rgb_array")
    observation, _ = env.reset(seed=3)
    state = None
    for _ in range(400):
        action, state = agent.predict(observation, state)
        observation, _, terminated, truncated, _ = env.step(int(action))
        if terminated or truncated:
            break
    matplotlib.image.imsave(path, np.asarray(env.render()))
    env.close()


def reference_page(module: Any, owned: list[Public]) -> str:
    """Summary of all that the module offers, then each object that is at home here."""
    title = module.__name__
    lines = [title, "=" * len(title), "", f".. py:module:: {title}", ""]
    lines += [".. markdown::", ""]
    lines += [f"   {line}" for line in inspect.cleandoc(module.__doc__ or "").splitlines()]
    lines += ["", f".. summary:: {title}", ""]
    for public in owned:
        lines += directive(public)
    return "\n".join(lines) + "\n"


def directive(public: Public) -> list[str]:
    value = public.value
    if is_plain_data(value):
        return [f".. autodata:: {public.path}", "   :no-value:", ""]
    if inspect.isclass(value):
        kind = "exception" if issubclass(value, BaseException) else "class"
        return [
            f".. auto{kind}:: {public.path}",
            "   :members:",
            f"   :inherited-members: {INHERITED_FROM_OTHERS}",
            f"   :exclude-members: {', '.join(sorted(said_elsewhere(value)))}",
            "",
        ]
    return [f".. autofunction:: {public.path}", ""]


def said_elsewhere(cls: type) -> set[str]:
    """Members that only the docstring of another library describes, on pages of its own."""
    found = {"parameters_type", "state_type"}
    for name in dir(cls):
        documented = [b for b in cls.__mro__ if name in vars(b) and has_docstring(vars(b)[name])]
        if documented and documented[0].__module__.split(".")[0] not in ROOTS:
            found.add(name)
    return found


def has_docstring(member: Any) -> bool:
    described = isinstance(member, property | classmethod | staticmethod) or callable(member)
    return described and bool(getattr(member, "__doc__", None))


def shorten_manual(obj: Any, lines: list[str]) -> list[str]:
    """In the reference an environment says where its manual is, instead of saying it again."""
    for spec in specs():
        for entry in (spec.entry_point, spec.vector_entry_point):
            if entry and class_of(entry) is obj:
                summary = lines[: lines.index("")] if "" in lines else lines
                link = f"Manual: {{doc}}`{spec.id} </environments/{page_name(spec)}>`."
                return [*summary, "", link]
    return lines


def write(path: Path, text: str) -> None:
    """Only where it changed, so that a second build reads only what is new."""
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.parent.mkdir(exist_ok=True)
        path.write_text(text, encoding="utf-8")


def generate(app: Sphinx) -> None:
    source = Path(app.srcdir)
    for spec in specs():
        page = source / "environments" / f"{page_name(spec)}.md"
        write(page, environment_page(spec))
        if not page.with_suffix(".png").exists():
            picture(spec, page.with_suffix(".png"))
    names = public_names()
    owned: dict[str, list[Public]] = defaultdict(list)
    for public in unique(names):
        owned[public.home].append(public)
    kept = {"index"}
    for module in public_modules():
        write(
            source / "reference" / f"{module.__name__}.rst",
            reference_page(module, owned[module.__name__]),
        )
        kept.add(module.__name__)
    for old in (source / "reference").glob("*.rst"):
        if old.stem not in kept:
            old.unlink()
    app.shorten_manual = shorten_manual  # type: ignore[attr-defined]


def setup(app: Sphinx) -> dict[str, Any]:
    # Before Sphinx looks for pages.
    app.connect("builder-inited", generate, priority=50)
    return {"parallel_read_safe": True, "version": "1"}
