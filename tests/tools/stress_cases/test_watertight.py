"""Rays of the stress test that must not pass: float64 says of every one of them that it must hit, and where."""

from __future__ import annotations

import numpy as np
import pytest
from stress_cases import edges, watertight
from stress_cases.edge_truth import Surface, what_is_right

import ldtrefl

COUNT = 2000


def aimed_at(mesh: ldtrefl.Mesh) -> watertight.Aimed:
    """The first rays aimed at a mesh: some ``COUNT`` of them."""
    return next(watertight.aimed_rays(mesh, COUNT, np.random.default_rng(1)))


@pytest.mark.parametrize("name", edges.made())
def test_every_ray_must_hit_at_its_target_or_before(name: str) -> None:
    mesh = watertight.placed(edges.made()[name], 1.0, 0.0)
    aimed = aimed_at(mesh)
    right = what_is_right(Surface(mesh), aimed.origins, aimed.directions)
    assert right.must.all(), f"{(~right.must).sum()} may miss"
    behind = right.bound - aimed.t * right.length
    # The bound is the far end of the surface that the ray's surroundings cross.
    assert (behind < watertight.BEHIND).all()
    assert not aimed.passes(ldtrefl.Raycaster(mesh.vertices, mesh.faces).trace(aimed.origins, aimed.directions).t).any()


def test_targets_are_vertices_edges_and_diagonals() -> None:
    """Of a box from -1 to 1, whose vertices and edges have two coordinates or more of 1, and whose diagonals do not."""
    aimed = aimed_at(edges.made()["box"])
    points = aimed.origins + aimed.t[:, None] * aimed.directions
    on_planes = (np.abs(np.abs(points) - 1.0) < 1e-5).sum(axis=1)
    shares = [(on_planes == planes).mean() for planes in (1, 2, 3)]
    assert min(shares) > 0.05 and sum(shares) == 1.0, shares


@pytest.mark.parametrize(("size", "sizes_off"), watertight.PLACES)
def test_what_passes_is_found(size: float, sizes_off: float) -> None:
    """A ball whose triangles are shrunk by a ten-thousandth has cracks along all its edges. Of the rays from outside
    some meet its front on their way to an edge of its back."""
    ball = watertight.placed(edges.made()["icosphere"], size, sizes_off)
    aimed = aimed_at(ball)
    corners = ball.vertices[ball.faces]
    middle = corners.mean(axis=1, keepdims=True)
    shrunk = (middle + (1 - 1e-4) * (corners - middle)).reshape(-1, 3)
    apart = ldtrefl.Mesh(shrunk, np.arange(len(shrunk)).reshape(-1, 3))
    whole, cracked = (
        aimed.passes(ldtrefl.Raycaster(mesh.vertices, mesh.faces).trace(aimed.origins, aimed.directions).t)
        for mesh in (ball, apart)
    )
    assert not whole.any() and 0.6 < cracked.mean() < 1.0
    assert aimed.passes(np.full(len(aimed.t), np.nan)).all()
