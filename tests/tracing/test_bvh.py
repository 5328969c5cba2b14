"""The ray caster against Embree, and what it says of a hit."""

from collections.abc import Callable

import numpy as np
import pytest
from embreex import rtcore_scene
from embreex.mesh_construction import TriangleMesh
from stress_cases import edges
from stress_cases.inputs import rays_about

import ldtrefl
from ldtrefl.scene import shapes
from tests.conftest import REAL_MESHES

SHAPES = tuple(name for name in shapes.names())


@pytest.mark.parametrize("name", [*SHAPES, *REAL_MESHES])
def test_raycaster_agrees_with_embree(mesh_or_shape: Callable, name: str) -> None:
    mesh = mesh_or_shape(name)
    vertices, count = mesh.unit_vertices, 200_000
    origins, directions = rays_about(ldtrefl.Mesh(vertices, mesh.faces), count)
    embree = rtcore_scene.EmbreeScene(robust=True)
    TriangleMesh(embree, vertices[mesh.faces])
    truth = embree.run(origins, directions, output=1)
    hits = ldtrefl.Raycaster(vertices, mesh.faces).trace(origins, directions)
    hit, true_hit = hits.triangle >= 0, truth["primID"] >= 0
    # A ray through a vertex at grazing angle may pass one tracer's triangle and meet the next surface: that counts as
    # a disagreement too. The unit cube is 2 wide.
    apart = np.zeros(count, bool)
    both = hit & true_hit
    apart[both] = np.abs(hits.t[both] - truth["tfar"][both]) > 2e-4
    wrong = int(((hit != true_hit) | apart).sum())
    assert wrong <= count // 100_000, f"{name}: {wrong} of {count} rays disagree"


def test_barycentrics_and_normal_are_the_hit_triangles() -> None:
    mesh = shapes.make("genus3", {"grid": 32})
    origins, directions = rays_about(mesh, 2000)
    hits = ldtrefl.Raycaster(mesh.vertices, mesh.faces).trace(origins, directions)
    hit = hits.triangle >= 0
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces[hits.triangle[hit]]], 1, 0)
    u, v = hits.barycentrics[hit].T[..., None]
    point = origins[hit] + hits.t[hit, None] * directions[hit]
    np.testing.assert_allclose((1 - u - v) * a + u * b + v * c, point, atol=1e-4)
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    np.testing.assert_allclose(hits.normal[hit], normal, atol=1e-3)


def closed_form_ball() -> ldtrefl.Mesh:
    """A ball of triangles whose vertices are on a lattice of float32, so that rays can be aimed at them exactly."""
    return edges.made()["icosphere on a lattice"]


@pytest.mark.parametrize(("scale", "offset"), [(1.0, 0.0), (1e-3, 0.0), (2.0**13, 2.0**13), (1.0, 2.0**10)])
def test_nothing_leaves_a_closed_mesh(scale: float, offset: float) -> None:
    """Rays from within, aimed at all vertices and at points of all edges, meet something: 100,000 at each place."""
    rng, ball = np.random.default_rng(0), closed_form_ball()
    a, b = ball.vertices[ball.faces[rng.integers(0, len(ball.faces), 100_000)][:, :2].T]
    share = rng.choice([0.0, 0.5, 0.25, 0.1, 0.37], (100_000, 1))
    targets = (1 - share) * a + share * b
    origins = np.rint(rng.uniform(-0.4, 0.4, (100_000, 3)) * 64) / 64
    origins[::4, 1:] = targets[::4, 1:] * 0.5
    placed = (scale * origins + offset).astype(np.float32)
    directions = (scale * targets + offset - placed).astype(np.float32)
    caster = ldtrefl.Raycaster(scale * ball.vertices + offset, ball.faces)
    hits = caster.trace(placed, directions)
    assert (hits.triangle >= 0).all(), f"{(hits.triangle < 0).sum()} leave the ball"
    # The ball is convex: what a ray meets is where it is aimed.
    np.testing.assert_allclose(hits.t, 1.0, rtol=1e-3)
    assert caster.occluded(placed, directions).all()


def test_a_ray_from_far_away_meets_the_corner_that_it_is_aimed_at() -> None:
    """Of its t float32 tells only every fourth whole number apart: what lies before the box is passed in float64."""
    box = shapes.make("box")
    caster = ldtrefl.Raycaster(box.vertices, box.faces)
    for distance in (12_345_677, 33_554_436):
        start, way = np.full((1, 3), -distance, np.float32), np.ones((1, 3), np.float32)
        hits = caster.trace(start, way)
        assert hits.t[0] == np.float32(distance - 1) and caster.occluded(start, way).all()
        assert hits.normal.sum() == -1.0, "the corner behind"


def test_rays_in_the_plane_of_a_triangle_meet_what_stands_across() -> None:
    """Rays in the plane of the top of a box, on it or beside it, meet a side of the box at its rim, or nothing."""
    box = shapes.make("box")
    rng = np.random.default_rng(2)
    origins = np.column_stack([np.full(1000, -3.0), rng.uniform(-0.9, 0.9, 1000), np.ones(1000)]).astype(np.float32)
    directions = np.column_stack([np.ones(1000), rng.uniform(-0.02, 0.02, 1000), np.zeros(1000)]).astype(np.float32)
    hits = ldtrefl.Raycaster(box.vertices, box.faces).trace(origins, directions)
    np.testing.assert_allclose(hits.t, 2.0, atol=1e-6)
    assert (np.abs(hits.normal[:, 0]) > 0.999).all()
    origins[:, 2] = np.nextafter(np.float32(1.0), np.float32(2.0))
    assert (ldtrefl.Raycaster(box.vertices, box.faces).trace(origins, directions).triangle < 0).all()


def test_boxes_within_boxes_are_all_found() -> None:
    """Sixty boxes, each half as large as the one about it: no tree of Warp's is as deep as that."""
    box = shapes.make("box")
    scales = 2.0 ** -np.arange(60.0)
    vertices = (scales[:, None, None] * box.vertices).reshape(-1, 3)
    faces = (np.arange(60)[:, None, None] * len(box.vertices) + box.faces).reshape(-1, 3)
    caster = ldtrefl.Raycaster(vertices, faces)
    start = np.zeros((60, 3), np.float32)
    start[:, 0] = 0.75 * scales
    hits = caster.trace(start, np.tile(np.float32([1.0, 0.0, 0.0]), (60, 1)))
    np.testing.assert_allclose(hits.t, 0.25 * scales, rtol=1e-6)
    np.testing.assert_array_equal(hits.triangle // len(box.faces), np.arange(60))
