"""Tracers on rays beside edges and vertices, and through them: as float64 says, to 1e-7 of the mesh's size."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from stress_cases import edges, watertight

import ldtrefl
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


@functools.cache
def aimed_at(name: str, size: float, sizes_off: float) -> tuple[ldtrefl.Mesh, list[watertight.Aimed]]:
    """A mesh of ``edges.made`` at a place, and rays aimed at its vertices, edges and diagonals."""
    mesh = watertight.placed(edges.made()[name], size, sizes_off)
    return mesh, list(watertight.aimed_rays(mesh, 30_000, np.random.default_rng(0)))


@pytest.mark.parametrize("by", TRACERS)
@pytest.mark.parametrize(("size", "sizes_off"), watertight.PLACES)
def test_no_ray_passes_that_is_aimed_at_a_vertex_or_an_edge(size: float, sizes_off: float, by: str) -> None:
    for name in ("box", "knot on a lattice", ROD):
        mesh, batches = aimed_at(name, size, sizes_off)
        trace = dict(edges.tracers(mesh))[by]
        assert sum(len(aimed.t) for aimed in batches) == 30_000
        for aimed in batches:
            passed = aimed.passes(trace(aimed.origins, aimed.directions).t)
            assert not passed.any(), f"{passed.sum()} of {len(passed)} pass {name}"
