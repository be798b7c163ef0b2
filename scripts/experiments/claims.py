"""Every claim of the paper that is judged, in the paper's order."""

from __future__ import annotations

from experiments import constant_input, continuous, map_claims, method_claims, reactions

CLAIMS = (
    *constant_input.CLAIMS,
    *continuous.CLAIMS,
    *map_claims.CLAIMS,
    *method_claims.CLAIMS,
    *reactions.CLAIMS,
)
