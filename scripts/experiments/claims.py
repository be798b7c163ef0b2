"""Every claim of the paper that is judged, in the paper's order."""

from __future__ import annotations

from experiments import continuous, hysteresis, map_claims, method_claims, reactions

CLAIMS = (
    *hysteresis.CLAIMS,
    *continuous.CLAIMS,
    *map_claims.CLAIMS,
    *method_claims.CLAIMS,
    *reactions.CLAIMS,
)
