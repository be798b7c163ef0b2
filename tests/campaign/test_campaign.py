"""The campaign at a small size; `python tests/campaign/run.py --size full` runs all of it."""

from __future__ import annotations

from collections import Counter

import pytest

from tests.campaign import configurations, flips, kills, run, stores

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("default")]


def test_no_bad_input_crashes_hangs_or_ends_in_somebody_elses_traceback() -> None:
    results = run.bad_inputs(run.EVERY["small"], jobs=1, timeout=300)
    counts = Counter(outcome for _, outcome, _ in results)
    wrong = run.findings(results)
    assert not any(counts[name] for name in ("crash", "hang", "foreign")), wrong
    assert counts["nonsense"] <= 0.01 * len(results), wrong


def test_random_configurations_give_the_same_in_every_loop_within_all_bounds() -> None:
    counts = configurations.campaign(run.CONFIGURATIONS["small"], seed=0, pairs=1)
    assert counts == {"tried": run.CONFIGURATIONS["small"], "wrong": 0}


def test_vector_environments_give_what_single_ones_give_within_all_bounds() -> None:
    counts = configurations.campaign(run.ENVIRONMENTS["small"], seed=0, part="environments")
    assert counts == {"tried": run.ENVIRONMENTS["small"], "wrong": 0}


def test_a_kill_while_saving_loses_nothing_and_leaves_nothing() -> None:
    counts = kills.campaign(run.KILLS["small"], seed=0)
    assert counts == {"tried": run.KILLS["small"], "wrong": 0}


def test_a_changed_byte_is_refused_or_without_effect() -> None:
    counts = flips.campaign(*run.FLIPS["small"], seed=0)
    assert counts["tried"] == sum(run.FLIPS["small"])
    assert counts["wrong"] == 0


def test_a_store_survives_killed_sweeps_and_a_changed_byte() -> None:
    counts = stores.campaign(kills=2, flips=8, seed=0)
    assert counts["tried"] == 10
    assert counts["wrong"] == 0
