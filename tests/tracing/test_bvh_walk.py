"""The way down Warp's tree: its boxes, and the same answers, to the bit, by Warp's own query."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
import pytest
import warp as wp
from stress_cases.inputs import rays_about

import ldtrefl
from ldtrefl.device import launch
from ldtrefl.scene import shapes
from ldtrefl.tracing.batch import occluded_batch, trace_batch
from ldtrefl.tracing.bvh import bvh_tracer
from ldtrefl.tracing.bvh_walk import (
    BOX_MARGIN,
    BvhView,
    box_triangles,
    query_any,
    query_first,
    walk_to_any,
    walk_to_first,
)
from ldtrefl.tracing.tracer import Tracer, array_of_views

WAYS = {"walk": (walk_to_first, walk_to_any), "query": (query_first, query_any)}


@functools.cache
def tracer_by(way: str) -> Tracer:
    """The ray caster's tracer by our walk, or by Warp's query. They are called differently, as no kernel of Warp's may
    have another's name."""
    return dataclasses.replace(bvh_tracer(*WAYS[way]), name=way)


PLANES = 300


def many_planes() -> ldtrefl.Mesh:
    """``PLANES`` triangles with corners on a lattice, copies of every second, and every third turned over: rays meet
    several at one t."""
    rng = np.random.default_rng(0)
    vertices = rng.integers(-2, 3, (40, 3)).astype(float)
    faces = rng.integers(0, 40, (PLANES, 3))
    return ldtrefl.Mesh(vertices, np.concatenate([faces, faces[::2], faces[::3, ::-1]]))


MESHES = {
    "knot": lambda: shapes.make("torus_knot", {"segments": [200, 24]}),
    "box": lambda: shapes.make("box"),
    "planes": many_planes,
    "one triangle": lambda: ldtrefl.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0.5]], [[0, 1, 2]]),
}


def rays_at(mesh: ldtrefl.Mesh) -> tuple[np.ndarray, np.ndarray]:
    """Rays from outside, from within the box, along axes, and at vertices."""
    rng = np.random.default_rng(1)
    about = rays_about(mesh, 5000, 2)
    inside = rng.uniform(*mesh.bounds, (5000, 3)).astype(np.float32), rng.normal(size=(5000, 3)).astype(np.float32)
    along = rays_about(mesh, 5000, 3)[0], np.eye(3, dtype=np.float32)[rng.integers(0, 3, 5000)]
    along[1][::2] *= -1.0
    along[0][::3] = np.round(along[0][::3])
    start = rays_about(mesh, 5000, 4)[0]
    aimed = start, (mesh.vertices[rng.integers(0, len(mesh.vertices), 5000)] - start).astype(np.float32)
    origins, directions = (np.concatenate(part) for part in zip(about, inside, along, aimed, strict=True))
    return origins, directions


@pytest.mark.parametrize("name", MESHES)
def test_warps_own_query_gives_the_same_answers(name: str) -> None:
    mesh = MESHES[name]()
    caster = ldtrefl.Raycaster(mesh.vertices, mesh.faces)
    views = array_of_views([caster.view()], BvhView, caster.geometry.vertices.device)
    for t_max in (None, 2.0):
        walk, query = (trace_batch(tracer_by(way), views, caster.geometry, *rays_at(mesh), t_max) for way in WAYS)
        assert (walk.triangle >= 0).mean() > 0.01
        for answer in ("triangle", "t", "barycentrics", "normal"):
            np.testing.assert_array_equal(getattr(walk, answer), getattr(query, answer))
        for way in WAYS:
            met = occluded_batch(tracer_by(way), views, caster.geometry, *rays_at(mesh), t_max)
            np.testing.assert_array_equal(met, walk.triangle >= 0)


def test_of_triangles_at_one_t_the_first_is_met() -> None:
    """Of a triangle and its copies the tree holds now this first, now that."""
    mesh = many_planes()
    hits = ldtrefl.Raycaster(mesh.vertices, mesh.faces).trace(*rays_at(mesh))
    is_copy = (hits.triangle >= PLANES) & (hits.triangle < PLANES + PLANES // 2)
    assert (hits.triangle >= 0).mean() > 0.3 and not is_copy.any()


def test_triangles_without_area_are_not_met() -> None:
    """Points, lines and doubled corners on a box; rays through them meet the box."""
    box = shapes.make("box")
    rng = np.random.default_rng(3)
    a, b = rng.integers(0, len(box.vertices), (2, 100))
    line = np.column_stack([a, b, a])
    middles = (box.vertices[a] + box.vertices[b]) / 2
    flat = np.column_stack([a, b, len(box.vertices) + np.arange(100)])
    mesh = ldtrefl.Mesh(np.vstack([box.vertices, middles]), np.concatenate([line, flat, box.faces]))
    origins = rng.uniform(-3, 3, (2000, 3)).astype(np.float32)
    directions = (np.tile(middles, (20, 1)) - origins).astype(np.float32)
    hits = ldtrefl.Raycaster(mesh.vertices, mesh.faces).trace(origins, directions)
    assert ((hits.triangle >= 200) | (hits.triangle < 0)).all()
    alone = ldtrefl.Raycaster(box.vertices, box.faces).trace(origins, directions)
    np.testing.assert_array_equal(hits.t, alone.t)


def test_boxes_hold_their_triangles_with_a_margin() -> None:
    mesh = shapes.make("torus_knot", {"segments": [64, 8]})
    device, count = launch.resolve_device(None), len(mesh.faces)
    vertices = wp.array(mesh.unit_vertices, dtype=wp.vec3, device=device)
    faces = wp.array(mesh.faces, dtype=wp.vec3i, device=device)
    lows, highs = (wp.empty(count, dtype=wp.vec3, device=device) for _ in range(2))
    launch.launch(box_triangles, count, [vertices, faces, lows, highs], device)
    corners = mesh.unit_vertices[mesh.faces].astype(float)
    rounding = 2.0**-23
    for margin in (corners.min(axis=1) - lows.numpy(), highs.numpy() - corners.max(axis=1)):
        np.testing.assert_allclose(margin, float(BOX_MARGIN), atol=rounding)


def test_the_margin_covers_what_is_rounded_in_a_slab_test() -> None:
    """Of rays that start up to 2.5 from the centre: how far from a side along its axis a ray may seem to cross it."""
    rng, count = np.random.default_rng(5), 1_000_000
    start, side = rng.uniform(-2.5, 2.5, count), rng.uniform(-1, 1, count).astype(np.float32)
    direction = (rng.choice([-1.0, 1.0], count) * 10.0 ** rng.uniform(-12, 0.5, count)).astype(np.float32)
    inverse = np.float32(1.0) / direction
    t = side * inverse - start.astype(np.float32) * inverse
    assert t.dtype == np.float32
    true_t = (side.astype(float) - start) / direction.astype(float)
    # The nearest t so far, which it is compared with, is rounded, too.
    off = np.abs(t - true_t) + np.abs(true_t.astype(np.float32) - true_t)
    off = (off * np.abs(direction)).max()
    assert 0.5 * float(BOX_MARGIN) < off < float(BOX_MARGIN)
