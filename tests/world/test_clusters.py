"""Clusters of a mesh: every triangle once, with its own corners, in boxes that hold it."""

import numpy as np
import pytest

from ldtrefl.device import launch
from ldtrefl.scene import shapes
from ldtrefl.scene.mesh import Mesh
from ldtrefl.world.clusters import CHILDREN, CLUSTER, clustered

SIZE, CHILD = int(CLUSTER), int(CHILDREN)


def meshes() -> dict[str, Mesh]:
    rng = np.random.default_rng(0)
    soup = Mesh(rng.normal(size=(30 * SIZE, 3)), np.arange(30 * SIZE).reshape(-1, 3))
    return {
        "one triangle": Mesh(np.eye(3), [[0, 1, 2]]),
        "a box": shapes.make("box"),
        "a full cluster": Mesh(np.eye(3), [[0, 1, 2]] * SIZE),
        "soup": soup,
        "a knot": shapes.make("torus_knot", {"segments": [60, 12]}),
    }


@pytest.mark.parametrize("name", meshes())
def test_every_triangle_is_in_one_cluster_with_its_corners(name: str) -> None:
    mesh = meshes()[name]
    view = clustered(mesh, launch.resolve_device("cpu"))
    triangles, corners, points, first = (
        getattr(view, field).numpy() for field in ("triangles", "corners", "points", "first_point")
    )
    assert sorted(triangles.tolist()) == list(range(len(mesh.faces)))
    cluster = np.arange(len(triangles)) // SIZE
    found = points[first[cluster][:, None] + corners]
    np.testing.assert_array_equal(found, mesh.unit_vertices[mesh.faces[triangles]])
    assert (first[cluster][:, None] + corners < first[cluster + 1][:, None]).all()
    assert len(points) == first[-1]


@pytest.mark.parametrize("name", meshes())
def test_a_box_is_about_all_that_is_in_it(name: str) -> None:
    mesh = meshes()[name]
    view = clustered(mesh, launch.resolve_device("cpu"))
    triangles, low, high, first = (getattr(view, field).numpy() for field in ("triangles", "low", "high", "first_box"))
    corners = mesh.unit_vertices[mesh.faces[triangles]]
    span = SIZE
    for level in range(len(first) - 1):
        count = -(-len(triangles) // span)
        assert first[level + 1] - first[level] == count
        for k in range(count):
            inside = corners[span * k : span * (k + 1)].reshape(-1, 3)
            np.testing.assert_array_equal(low[first[level] + k], inside.min(axis=0))
            np.testing.assert_array_equal(high[first[level] + k], inside.max(axis=0))
        span *= CHILD
    assert first[-1] - first[-2] == 1 and len(low) == first[-1]


def test_clusters_are_of_neighbours() -> None:
    """Whatever the order of the triangles in the file."""
    knot = shapes.make("torus_knot", {"segments": [200, 24]})
    shuffled = Mesh(knot.vertices, np.random.default_rng(1).permutation(knot.faces))
    view = clustered(shuffled, launch.resolve_device("cpu"))
    count = view.first_box.numpy()[1]
    sides = (view.high.numpy() - view.low.numpy())[:count].max(axis=1)
    assert np.median(sides) < 0.2 and view.points.shape[0] < 1.1 * len(knot.faces)
