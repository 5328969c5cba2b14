"""Tracers on rays beside edges and vertices, and through them: as float64 says, to 1e-7 of the mesh's size."""

from __future__ import annotations

import pytest
from stress_cases import edges

from tests.edge_rays import ROD, SMALL, rays_at

TRACERS = ["exact", "bvh"]


@pytest.mark.parametrize("by", TRACERS)
@pytest.mark.parametrize("name", SMALL)
def test_nothing_slips_through_and_nothing_sticks_out(name: str, by: str) -> None:
    trace = dict(edges.tracers(edges.made()[name]))[by]
    for kind, given, right in rays_at(name):
        outcome = edges.judge_edges(right, given, trace(*given))
        assert outcome.passed, f"{kind}: {outcome}"


@pytest.mark.parametrize("by", TRACERS)
def test_slim_triangles_are_met_and_named_like_others(by: str) -> None:
    trace = dict(edges.tracers(edges.made()[ROD]))[by]
    for kind, given, right in rays_at(ROD):
        outcome = edges.judge_edges(right, given, trace(*given))
        assert outcome.passed, f"{kind}: {outcome}"
