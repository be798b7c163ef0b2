"""Agents on the levels of `gnm_env.suite()`: their scores, and their place in the league."""

from agents.suite.league import LeagueRow, league_rows
from agents.suite.placing import Placing, place
from agents.suite.scoring import score

__all__ = ["LeagueRow", "Placing", "league_rows", "place", "score"]
