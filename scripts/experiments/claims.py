"""Every claim of the paper that is judged, in the paper's order."""

from __future__ import annotations

from experiments import hysteresis, map_claims, method_claims

CLAIMS = (*hysteresis.CLAIMS, *map_claims.CLAIMS, *method_claims.CLAIMS)
