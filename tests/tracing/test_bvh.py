"""The ray caster against Embree, and what it says of a hit."""

from collections.abc import Callable

import numpy as np
import pytest
from embreex import rtcore_scene
from embreex.mesh_construction import TriangleMesh
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
