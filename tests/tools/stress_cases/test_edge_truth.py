"""What the stress test takes for right beside edges and vertices: brute force and integers must agree with it, and
wrong answers must be found.
"""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
import pytest
from stress_cases import edges
from stress_cases.edge_truth import ALLOWANCE, Right, Surface, examine, what_is_right
from stress_cases.truth import brute_force

import ldtrefl
from tests.edge_rays import ROD, SMALL, rays_at


def float64_hits(mesh: ldtrefl.Mesh, rays: edges.Rays) -> ldtrefl.Hits:
    """Brute force's answers in float64, not rounded to float32."""
    origins, directions = (x.astype(float) for x in rays)
    t, triangle = brute_force(mesh, origins, directions)
    hit = np.isfinite(t)
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces[triangle]], 1, 0)
    facet = np.cross(b - a, c - a)
    point = origins + np.where(hit, t, 0.0)[:, None] * directions
    squared = (facet * facet).sum(axis=1)
    u = (np.cross(point - a, c - a) * facet).sum(axis=1) / squared
    v = (np.cross(b - a, point - a) * facet).sum(axis=1) / squared
    return ldtrefl.Hits(
        t, facet / np.sqrt(squared)[:, None], triangle, np.where(hit[:, None], np.column_stack([u, v]), 0.0), 0
    )


@pytest.mark.parametrize("name", [*SMALL, ROD])
def test_what_float64_answers_is_right_at_any_allowance(name: str) -> None:
    """Brute force over all triangles agrees with the tree of boxes and the patches. With vertices rounded as tracers
    round them its answers stay within the allowance. Rays through vertices and edges are left out: there brute force
    itself lets rays slip through."""
    mesh = edges.made()[name]
    centre, half = mesh.unit_frame
    rounded = ldtrefl.Mesh(mesh.unit_vertices.astype(float) * half + centre, mesh.faces)
    for kind, given, right in rays_at(name):
        if kind == "through":
            continue
        some = tuple(x[:300] for x in given)
        for hits, allowance in ((float64_hits(mesh, some), 1e-12), (float64_hits(rounded, some), ALLOWANCE)):
            found = examine(what_is_right(right.surface, *some, allowance), hits)
            assert not found.wrong.any() and not found.misnamed.any(), f"{kind} at {allowance:g}: {found}"


def integer_hits(mesh: ldtrefl.Mesh, rays: edges.Rays) -> ldtrefl.Hits:
    """Brute force by signed volumes in integers, which are exact. A ray through an edge or a vertex meets every
    triangle that has it."""
    scaled = [2.0**14 * x.astype(float) for x in (mesh.vertices, *rays)]
    vertices, origins, directions = (x.astype(np.int64) for x in scaled)
    assert all((exact == x).all() for exact, x in zip((vertices, origins, directions), scaled, strict=True))
    corners = vertices[mesh.faces][None] - origins[:, None, None]
    sides = [np.cross(corners[:, :, i], corners[:, :, (i + 1) % 3]) for i in range(3)]
    volumes = np.stack([(side * directions[:, None]).sum(axis=2) for side in sides])
    facets = np.cross(corners[:, :, 1] - corners[:, :, 0], corners[:, :, 2] - corners[:, :, 0])
    slope = (facets * directions[:, None]).sum(axis=2)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (facets * corners[:, :, 0]).sum(axis=2) / slope
        met = ((volumes >= 0).all(axis=0) | (volumes <= 0).all(axis=0)) & (slope != 0) & (t >= 0.0)
        weights = volumes / slope
    t = np.where(met, t, np.inf)
    ray, triangle = np.arange(len(t)), t.argmin(axis=1)
    hit = np.isfinite(t[ray, triangle])
    # The volume over an edge is the weight of the corner opposite.
    barycentrics = np.where(hit[:, None], weights[[2, 0]][:, ray, triangle].T, 0.0)
    normal = facets[ray, triangle] / np.linalg.norm(facets[ray, triangle], axis=1, keepdims=True)
    return ldtrefl.Hits(t[ray, triangle], normal, np.where(hit, triangle, -1), barycentrics, 0)


@pytest.mark.parametrize("name", ["box", "icosphere on a lattice", "knot on a lattice"])
def test_what_integers_answer_exactly_at_vertices_and_edges_is_right(name: str) -> None:
    mesh = edges.made()[name]
    _, given, right = next(found for found in rays_at(name) if found[0] == "through")
    some = tuple(x[:300] for x in given)
    hits = integer_hits(mesh, some)
    assert np.isfinite(hits.t).mean() > 0.5
    for allowance in (1e-12, ALLOWANCE):
        found = examine(what_is_right(right.surface, *some, allowance), hits)
        assert not found.wrong.any() and not found.misnamed.any(), f"at {allowance:g}: {found}"


@pytest.mark.parametrize("name", ["box", "icosphere on a lattice", "knot"])
def test_what_must_hit_hits_however_it_is_moved(name: str) -> None:
    """Rays are moved aside within the allowance and traced by brute force. Where a ray must hit, all of them hit; where
    it must miss, none; and where it may do either, mostly some do and some do not."""
    mesh, rng = edges.made()[name], np.random.default_rng(0)
    both, free = 0, 0
    for kind, given, right in rays_at(name):
        chosen = np.concatenate([np.flatnonzero(right.may & ~right.must)[:20], np.arange(60)])
        share = []
        for ray in chosen:
            aside = np.cross(right.directions[ray], rng.normal(size=(40, 3)))
            aside *= ALLOWANCE * rng.uniform(0.0, 0.999, (40, 1)) / np.linalg.norm(aside, axis=1, keepdims=True)
            origins = given[0][ray].astype(float) + right.surface.size * aside
            t, _ = brute_force(mesh, origins, np.broadcast_to(given[1][ray].astype(float), (40, 3)))
            share.append(np.isfinite(t).mean())
        hit, must, may = np.array(share), right.must[chosen], right.may[chosen]
        assert (hit[must] == 1.0).all() and (hit[~may] == 0.0).all(), kind
        # What leaves the surface is free to meet it again, which no ray moved aside by less than to its start does.
        is_free = may & ~must & (kind != "leaving")
        free, both = free + int(is_free.sum()), both + int(((hit > 0.0) & (hit < 1.0))[is_free].sum())
    assert free > 20 and both > 0.6 * free, f"{both} of {free}"


@functools.cache
def a_knot() -> tuple[ldtrefl.Mesh, edges.Rays, Right, ldtrefl.Hits]:
    """A mesh, rays beside its edges, what is right, and the answers of float64, which are right."""
    mesh = edges.made()["knot"]
    surface = Surface(mesh)
    given = edges.grazing(surface, 2000, np.random.default_rng(1))
    return mesh, given, what_is_right(surface, *given), float64_hits(mesh, given)


def test_a_hit_that_is_missing_moved_or_too_many_is_found() -> None:
    _, _, right, hits = a_knot()
    assert not examine(right, hits).wrong.any()
    hit, miss = np.flatnonzero(right.must)[7], np.flatnonzero(~right.may)[7]
    far = (hits.triangle[hit] + len(right.surface.faces) // 2) % len(right.surface.faces)
    for ray, t, triangle, fault in (
        (hit, np.inf, -1, "slips"),
        (hit, (1 + 1e-5) * hits.t[hit], hits.triangle[hit], "elsewhere"),
        (hit, hits.t[hit], far, "sticks_out"),
        (miss, 1.0, 0, "sticks_out"),
        (hit, np.nan, hits.triangle[hit], "elsewhere"),
        (miss, 1.0, -1, "elsewhere"),
    ):
        changed = dataclasses.replace(hits, t=hits.t.copy(), triangle=hits.triangle.copy())
        changed.t[ray], changed.triangle[ray] = t, triangle
        assert np.flatnonzero(getattr(examine(right, changed), fault)).tolist() == [ray], fault


def test_barycentrics_and_normals_of_another_place_are_found() -> None:
    _, _, right, hits = a_knot()
    assert not examine(right, hits).misnamed.any()
    ray = np.flatnonzero(right.must)[7]
    for name, value in (("barycentrics", hits.barycentrics[ray] + 1e-3), ("normal", -hits.normal[ray])):
        array = getattr(hits, name).copy()
        array[ray] = value
        assert np.flatnonzero(examine(right, dataclasses.replace(hits, **{name: array})).misnamed).tolist() == [ray]


@pytest.mark.parametrize(("scale", "fault"), [(1 + 1e-5, "sticks_out"), (1 - 1e-5, "slips")])
def test_triangles_that_are_widened_or_shrunk_are_found(scale: float, fault: str) -> None:
    """Each triangle is grown about its middle, as a slack in barycentrics does, or shrunk, so that there are cracks."""
    mesh, given, right, _ = a_knot()
    corners = mesh.vertices[mesh.faces]
    middle = corners.mean(axis=1, keepdims=True)
    apart = ldtrefl.Mesh(
        (middle + scale * (corners - middle)).reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3)
    )
    assert getattr(examine(right, float64_hits(apart, given)), fault).any()


def test_borders_are_free_and_seams_are_none() -> None:
    """At the border of an open mesh nothing must be met; vertices that are doubled for a texture count as one."""
    plane = ldtrefl.Mesh(
        [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, -1, 0], [1, 1, 0], [-1, 1, 0]], [[0, 1, 2], [3, 4, 5]]
    )
    surface = Surface(plane)
    assert not surface.is_closed and all(Surface(mesh).is_closed for mesh in edges.made().values())
    points = np.array([[0.5, 0.5, 0], [1, 0.3, 0], [1 - 1e-5, 0.3, 0], [1 + 1e-5, 0.3, 0], [0.2, 0.7, 0]], np.float32)
    right = what_is_right(surface, points + np.float32([0, 0, 1]), np.float32([[0, 0, -1]] * 5))
    assert right.must.tolist() == [True, False, True, False, True]
    assert right.may.tolist() == [True, True, True, False, True]
