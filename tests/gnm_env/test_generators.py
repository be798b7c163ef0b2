"""Generators held for compiled code are the very generators that were given."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import numpy as np

from gnm_env.compiled import compiled
from gnm_env.generators import Generators


@compiled
def _draw(held: Any, i: int) -> float:
    return float(held[i].random())


def test_both_forms_of_a_generator_move_on_together() -> None:
    rngs = [np.random.default_rng(seed) for seed in (1, 2)]
    generators = Generators(rngs)
    expected = np.random.default_rng(2).random(3)
    assert [_draw(generators.held, 1), rngs[1].random(), _draw(generators.held, 1)] == list(
        expected
    )
    assert rngs[0].random() == np.random.default_rng(1).random()


def test_one_generator_can_take_the_place_of_another() -> None:
    generators = Generators([np.random.default_rng(1), np.random.default_rng(2)])
    generators.replace(0, np.random.default_rng(3))
    assert _draw(generators.held, 0) == np.random.default_rng(3).random()
    assert _draw(generators.held, 1) == np.random.default_rng(2).random()


def test_copies_go_on_from_where_the_original_is() -> None:
    generators = Generators([np.random.default_rng(1)])
    _draw(generators.held, 0)
    copies = [copy.deepcopy(generators), pickle.loads(pickle.dumps(generators))]
    expected = _draw(generators.held, 0)
    assert [_draw(one.held, 0) for one in copies] == [expected, expected]
