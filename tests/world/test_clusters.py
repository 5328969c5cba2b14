"""Clusters of a mesh: every triangle once, with its own corners, in boxes that hold it."""

import numpy as np
import pytest

from ldtrefl.device import launch
from ldtrefl.scene import shapes
from ldtrefl.scene.mesh import Mesh
from ldtrefl.world.clusters import CLUSTER, LANES, clustered

SIZE = int(CLUSTER)


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
    triangles, first = view.triangles.numpy(), view.first_group.numpy()
    assert sorted(triangles.tolist()) == list(range(len(mesh.faces)))
    points = view.points.numpy().reshape(-1, 3, LANES).transpose(0, 2, 1).reshape(-1, 3)
    corners = view.corners.numpy().reshape(-1, 3, SIZE).transpose(0, 2, 1)
    assert len(corners) == len(first) - 1 == -(-len(triangles) // SIZE) and len(points) == LANES * first[-1]
    assert (corners < LANES * np.diff(first)[:, None, None]).all()
    found = points[LANES * first[:-1, None, None] + corners].reshape(-1, 3, 3)
    np.testing.assert_array_equal(found[: len(triangles)], mesh.unit_vertices[mesh.faces[triangles]])


@pytest.mark.parametrize("name", meshes())
def test_a_box_is_about_all_that_is_in_it(name: str) -> None:
    mesh = meshes()[name]
    view = clustered(mesh, launch.resolve_device("cpu"))
    triangles, first = view.triangles.numpy(), view.first_node.numpy()
    boxes = view.boxes.numpy().reshape(-1, 2, 3, LANES).transpose(0, 3, 1, 2)
    corners = mesh.unit_vertices[mesh.faces[triangles]]
    count, span = -(-len(triangles) // SIZE), SIZE
    for level in range(len(first) - 1):
        inside = boxes[first[level] : first[level + 1]].reshape(-1, 2, 3)
        assert first[level + 1] - first[level] == -(-count // LANES)
        for k in range(len(inside)):
            part = corners[span * min(k, count - 1) :][:span].reshape(-1, 3)
            np.testing.assert_array_equal(inside[k], [part.min(axis=0), part.max(axis=0)])
        count, span = -(-count // LANES), LANES * span
    assert count == 1 and len(boxes) == first[-1]


def test_clusters_are_of_neighbours() -> None:
    """Whatever the order of the triangles in the file."""
    knot = shapes.make("torus_knot", {"segments": [200, 24]})
    shuffled = Mesh(knot.vertices, np.random.default_rng(1).permutation(knot.faces))
    view = clustered(shuffled, launch.resolve_device("cpu"))
    boxes = view.boxes.numpy().reshape(-1, 2, 3, LANES)[: view.first_node.numpy()[1]]
    sides = (boxes[:, 1] - boxes[:, 0]).max(axis=1)
    assert np.median(sides) < 0.2 and LANES * view.first_group.numpy()[-1] < 1.4 * len(knot.faces)
