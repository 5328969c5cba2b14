"""What stands in the rows of a block: the corners of triangles, the planes of patches, and whose they are."""

import numpy as np

import ldtrefl
from ldtrefl.ldt.exact.tree import LANES, NODE, PATCH_AXIS_ROW, PATCH_TRIANGLE_ROW, TRIANGLE_NUMBER_ROW, Tree
from ldtrefl.scene import shapes

from .differences import DENSE_KNOT


def lanes_of(tree: Tree, is_patch: bool, height: int) -> np.ndarray:
    """(height, records) float32: what stands in the used lanes of all blocks of a kind."""
    nodes = tree.view.nodes.numpy().reshape(-1, int(NODE))
    codes = ~nodes[:, 6 * int(LANES) :].view(np.int32)
    codes = codes[(codes >= 0) & (nodes[:, : int(LANES)] < 1e29)]
    rows = tree.view.rows.numpy().reshape(-1, int(LANES))
    blocks = [rows[row : row + height] for row in codes[(codes & 1) == is_patch] >> 1]
    lanes = np.concatenate(blocks, axis=1)
    return lanes[:, ~np.isnan(lanes[0])]


def test_every_triangle_stands_in_one_lane() -> None:
    mesh = shapes.make("torus_knot", {"segments": [100, 16]})
    lanes = lanes_of(ldtrefl.peel(mesh.vertices, mesh.faces).tree, False, 10)
    numbers = np.ascontiguousarray(lanes[int(TRIANGLE_NUMBER_ROW)]).view(np.int32)
    assert sorted(numbers) == list(range(len(mesh.faces)))
    np.testing.assert_array_equal(lanes[:9].T.reshape(-1, 3, 3), mesh.unit_vertices[mesh.faces[numbers]])


def test_patches_are_planes_near_their_triangles() -> None:
    mesh = shapes.make("torus_knot", DENSE_KNOT)
    tree = ldtrefl.peel(mesh.vertices, mesh.faces).tree
    lanes = lanes_of(tree, True, 8)
    numbers = np.ascontiguousarray(lanes[int(PATCH_TRIANGLE_ROW)]).view(np.int32)
    normal, distance, axis = lanes[:3].T, lanes[3], lanes[int(PATCH_AXIS_ROW)].astype(int)
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1.0, rtol=1e-5)
    a, b, c = np.moveaxis(mesh.unit_vertices[mesh.faces[numbers]].astype(float), 1, 0)
    facet = np.cross(b - a, c - a)
    cosine = (facet * normal).sum(axis=1) / np.linalg.norm(facet, axis=1)
    assert cosine.min() > 0.99
    assert np.abs((a * normal).sum(axis=1) - distance).max() < tree.view.half_patch
    middle = (a + b + c) / 3.0
    off = np.stack([middle[np.arange(len(axis)), (axis + k) % 3] - lanes[3 + k] for k in (1, 2)])
    assert np.abs(off).max() < 2.0 * tree.view.half_patch
