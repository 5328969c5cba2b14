"""The tree as it lies in memory, and packed for a file."""

import numpy as np
import pytest

import ldtrefl
from ldtrefl.device import launch
from ldtrefl.ldt.exact.tree import ALIGNMENT, LANES, NODE, Tree, aligned_empty
from ldtrefl.scene import shapes

from .differences import rays_from_outside


def test_an_unpacked_tree_answers_alike() -> None:
    mesh = shapes.make("torus_knot")
    maps = ldtrefl.peel(mesh.vertices, mesh.faces)
    rays = rays_from_outside(2000, 1)
    expected = maps.trace(*rays)
    arrays, values = maps.tree.packed()
    again = Tree.unpacked(arrays, values, maps.geometry)
    assert again.records == maps.tree.records == len(mesh.faces) and again.nbytes == maps.tree.nbytes
    maps._tree = again
    found = maps.trace(*rays)
    np.testing.assert_array_equal(found.t, expected.t)
    np.testing.assert_array_equal(found.triangle, expected.triangle)


def test_nodes_hold_the_boxes_of_their_children() -> None:
    mesh = shapes.make("torus_knot")
    view = ldtrefl.peel(mesh.vertices, mesh.faces).tree.view
    lanes = int(LANES)
    nodes = view.nodes.numpy().reshape(-1, int(NODE))
    sides, children = nodes[:, : 6 * lanes].reshape(-1, 3, 2, lanes), nodes[:, 6 * lanes :].view(np.int32)
    is_empty = sides[:, 0, 0] > sides[:, 0, 1]
    assert ((children > 0) & ~is_empty).any()
    for number in range(len(nodes)):
        for lane in np.flatnonzero((children[number] > 0) & ~is_empty[number]):
            child = sides[children[number, lane]]
            assert (child[:, 0].min(axis=1) >= sides[number, :, 0, lane] - 1e-6).all()
            assert (
                child[:, 1, ~is_empty[children[number, lane]]].max(axis=1) <= sides[number, :, 1, lane] + 1e-6
            ).all()


@pytest.mark.parametrize("count", [1, 15, 16, 1000])
def test_nodes_begin_with_a_cache_line(count: int) -> None:
    made = aligned_empty(count, launch.resolve_device(None))
    assert made.shape == (count,) and made.ptr % ALIGNMENT == 0
