"""Triangles far outside the bulk, against Moeller and Trumbore's test in numpy."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.tracing.hit import Hit
from ldtrefl.tracing.outlier_hits import add_outliers_met, is_outlier_met, merge_outliers
from ldtrefl.tracing.tracer import Query
from ldtrefl.world.outliers import Outliers, outliers_of

COUNT = 11
"""A group of eight boxes, and one that is not full."""

NUMBERS = np.arange(5, 5 + 3 * COUNT, 3)
"""Of the outliers in their mesh."""


@launch.kernel
def merge_each(
    first: int,
    # In:
    outliers: Outliers,
    queries: wp.array(dtype=Query),
    # In and out:
    merged: wp.array(dtype=Hit),
    added: wp.array(dtype=Hit),
    # Out:
    met_out: wp.array(dtype=int),
):
    """Ask about one ray in all three ways: the hits of rays from its own on are those of a block of one."""
    i = first + wp.tid()
    query_room, hit_room = wp.zeros(shape=1, dtype=Query), wp.zeros(shape=1, dtype=Hit)
    query = wp.array(ptr=query_room.ptr, shape=(1,), dtype=Query)
    hit = wp.array(ptr=hit_room.ptr, shape=(1,), dtype=Hit)
    query[0] = queries[i]
    hit[0] = merged[i]
    merge_outliers(outliers, query, 1, hit)
    merged[i] = hit[0]
    hit[0] = added[i]
    add_outliers_met(outliers, query, 1, hit)
    added[i] = hit[0]
    met_out[i] = int(is_outlier_met(outliers, queries[i]))


def far_triangles() -> np.ndarray:
    """(COUNT, 3, 3) corners up to 1e5 from the unit cube, of all sizes."""
    rng = np.random.default_rng(5)
    size = 10.0 ** rng.uniform(0.5, 5, (COUNT, 1, 1))
    return size * (rng.normal(size=(COUNT, 1, 3)) + rng.normal(size=(COUNT, 3, 3)))


def uploaded(corners: np.ndarray) -> Outliers:
    """The triangles as outliers of a mesh whose vertices are in unit space."""
    faces = np.zeros((NUMBERS.max() + 1, 3), int)
    faces[NUMBERS] = np.arange(3 * COUNT).reshape(-1, 3)
    mesh = SimpleNamespace(
        outliers=NUMBERS, vertices=corners.reshape(-1, 3), faces=faces, unit_frame=(np.zeros(3), 1.0)
    )
    return outliers_of(mesh, launch.resolve_device(None))  # type: ignore[arg-type]


def brute_force(corners: np.ndarray, origins: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, ...]:
    """(n, COUNT) t, inf on a miss; (n, COUNT) how far inside by barycentrics; (n, COUNT, 2) weights."""
    a, b, c = np.moveaxis(corners, 1, 0)
    edge_u, edge_v = b - a, c - a
    p = np.cross(directions[:, None], edge_v)
    determinant = (edge_u * p).sum(axis=-1)
    s = origins[:, None] - a
    q = np.cross(s, edge_u)
    u, v = (s * p).sum(axis=-1) / determinant, (directions[:, None] * q).sum(axis=-1) / determinant
    t = (edge_v * q).sum(axis=-1) / determinant
    inside = np.minimum(np.minimum(u, v), 1 - u - v)
    return np.where((inside >= 0) & (t >= 0), t, np.inf), inside, np.stack([u, v], axis=-1)


def asked(origins: np.ndarray, directions: np.ndarray, t_max: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, ...]:
    """(merged, added, met) of rays that have met triangle 2 at ``t`` in the bulk, or nothing if that is inf."""
    device, queries, hits = launch.resolve_device(None), [], []
    for origin, direction, end, bulk in zip(origins, directions, t_max, t, strict=True):
        query, hit = Query(), Hit()
        query.origin, query.direction, query.t_max = wp.vec3d(*origin), wp.vec3(*direction), float(end)
        hit.t, hit.triangle, hit.steps = float(bulk), 2 if np.isfinite(bulk) else -1, 9
        queries.append(query)
        hits.append(hit)
    merged, added = (wp.array(hits, dtype=Hit, device=device) for _ in range(2))
    met = wp.empty(len(hits), dtype=int, device=device)
    given = wp.array(queries, dtype=Query, device=device)
    launch.launch(merge_each, len(hits), [uploaded(far_triangles()), given, merged, added, met], device)
    return merged.numpy(), added.numpy(), met.numpy() != 0


def rays_to(corners: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Rays from the unit cube: half to points of the triangles, half anywhere, some along an axis."""
    rng = np.random.default_rng(6)
    origins = rng.uniform(-1, 1, (count, 3))
    targets = np.einsum("nk,nkj->nj", rng.dirichlet((1, 1, 1), count), corners[rng.integers(0, COUNT, count)])
    directions = np.where(np.arange(count)[:, None] % 2, targets - origins, rng.normal(size=(count, 3)))
    directions[::10] = np.eye(3)[rng.integers(0, 3, len(directions[::10]))]
    directions = (directions / np.linalg.norm(directions, axis=1, keepdims=True)).astype(np.float32)
    return origins, directions.astype(float)


def test_the_nearest_outlier_is_met_as_in_float64() -> None:
    corners = far_triangles()
    origins, directions = rays_to(corners, 600)
    t, inside, weights = brute_force(corners, origins, directions)
    first, rows = t.argmin(axis=1), np.arange(600)
    nearest = t[rows, first]
    is_clear = np.abs(inside).min(axis=1) > 1e-9
    assert np.isfinite(nearest).sum() > 300 and np.isinf(nearest).sum() > 50 and is_clear.mean() > 0.99
    none = np.full(600, np.inf)
    merged, added, met = asked(origins, directions, none, none)
    expected = np.where(np.isfinite(nearest), NUMBERS[first], -1)
    np.testing.assert_array_equal(merged["triangle"][is_clear], expected[is_clear])
    np.testing.assert_array_equal(met[is_clear], np.isfinite(nearest)[is_clear])
    np.testing.assert_array_equal(added["triangle"] >= 0, met)
    hit = is_clear & (expected >= 0)
    np.testing.assert_allclose(merged["t"][hit], nearest[hit], rtol=1e-6)
    found = np.stack([merged["u"], merged["v"]], axis=-1)
    np.testing.assert_allclose(found[hit], weights[rows, first][hit], atol=1e-6)
    facets = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    facets /= np.linalg.norm(facets, axis=1, keepdims=True)
    np.testing.assert_allclose(merged["normal"][hit], facets[first][hit], atol=1e-6)
    assert (merged["steps"] == 9).all(), "what was looked at in the bulk is still counted"


def test_what_is_nearer_in_the_bulk_or_past_the_rays_end_stays() -> None:
    corners = far_triangles()
    origins, directions = rays_to(corners, 300)
    nearest = brute_force(corners, origins, directions)[0].min(axis=1)
    hit = np.isfinite(nearest) & (nearest > 1e-3)
    origins, directions, nearest = origins[hit], directions[hit], nearest[hit]
    none = np.full(len(nearest), np.inf)
    merged, added, met = asked(origins, directions, none, 0.999 * nearest)
    assert (merged["triangle"] == 2).all() and (added["triangle"] == 2).all() and met.all()
    merged, _, _ = asked(origins, directions, none, 1.001 * nearest)
    assert (merged["triangle"] >= NUMBERS[0]).all()
    merged, added, met = asked(origins, directions, 0.999 * nearest, none)
    assert (merged["triangle"] == -1).all() and (added["triangle"] == -1).all() and not met.any()
