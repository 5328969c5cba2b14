"""The binary tree: every record in one leaf, boxes about what they hold, leaves of one kind that fit in a block."""

import numpy as np
import pytest

import ldtrefl
from ldtrefl.device import launch
from ldtrefl.ldt.exact.binary_tree import binary_tree, cell_count
from ldtrefl.ldt.exact.records import Records
from ldtrefl.ldt.exact.tree import LANES
from ldtrefl.scene import shapes
from ldtrefl.world.device_mesh import DeviceMesh

DEVICE = launch.resolve_device(None)


def built(mesh: ldtrefl.Mesh, by_halves: bool) -> tuple[np.ndarray, np.ndarray]:
    geometry, records = DeviceMesh(mesh, DEVICE), Records()
    records.vertices, records.faces = geometry.vertices, geometry.faces
    box = np.array([mesh.unit_vertices.min(axis=0), mesh.unit_vertices.max(axis=0)])
    nodes, order = binary_tree(records, len(mesh.faces), box, DEVICE, by_halves=by_halves)
    return nodes.numpy(), order.numpy()


@pytest.mark.parametrize("by_halves", [False, True])
@pytest.mark.parametrize("segments", [[3, 4], [60, 20], [300, 40]])
def test_every_record_is_in_one_leaf_and_in_its_boxes(segments: list[int], by_halves: bool) -> None:
    mesh = shapes.make("torus_knot", {"segments": segments})
    nodes, order = built(mesh, by_halves)
    assert sorted(order) == list(range(len(mesh.faces)))
    corners = mesh.unit_vertices[mesh.faces[order]]
    low, high = corners.min(axis=1), corners.max(axis=1)
    first, second = (nodes[side][:, 3].copy().view(np.int32) for side in ("low", "high"))
    held: list[int] = []
    waiting = [(0, np.full(3, -np.inf), np.full(3, np.inf))]
    while waiting:
        number, low_about, high_about = waiting.pop()
        own_low, own_high = nodes["low"][number, :3], nodes["high"][number, :3]
        assert (own_low >= low_about).all() and (own_high <= high_about).all()
        if second[number] < 0:
            own = slice(first[number], first[number] + ~second[number])
            assert 1 <= own.stop - own.start <= int(LANES)
            np.testing.assert_array_equal(own_low, low[own].min(axis=0))
            np.testing.assert_array_equal(own_high, high[own].max(axis=0))
            held += range(own.start, own.stop)
        else:
            waiting += [(part, own_low, own_high) for part in (first[number], second[number])]
    assert sorted(held) == list(range(len(order)))


def test_cells_of_all_grids_are_counted() -> None:
    assert cell_count((1, 1, 1)) == 1
    assert cell_count((4, 2, 1)) == 8 + 2 + 1
    assert cell_count((5, 5, 5)) == 125 + 27 + 8 + 1
