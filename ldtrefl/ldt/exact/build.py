"""The tree of a mesh, on all cores.

mesh -> which records (record_choice.py) -> binary tree (binary_tree.py) -> wide tree (wide_tree.py)
     -> whether the mesh shows backs (backs_check.py)
"""

from __future__ import annotations

import numpy as np
import warp as wp

from ldtrefl.base.budget import memory_limit
from ldtrefl.base.errors import InputError
from ldtrefl.ldt.exact.backs_check import shows_backs
from ldtrefl.ldt.exact.binary_tree import (
    binary_tree,
    measure_cells,
    number_cells,
    sort_by_cell,
    split_cells,
    split_groups,
)
from ldtrefl.ldt.exact.patches import PATCH_MARGIN
from ldtrefl.ldt.exact.record_choice import PatchRecords, choose_records
from ldtrefl.ldt.exact.records import Records
from ldtrefl.ldt.exact.tree import Tree
from ldtrefl.ldt.exact.wide_tree import gather_nodes, wide_tree, write_nodes
from ldtrefl.ldt.options import Quality
from ldtrefl.world.device_mesh import DeviceMesh

BYTES_PER_RECORD = 80
"""What a record takes in the tree and while that is built, at most."""
MOST_RECORDS = 100_000_000
"""Records of a tree: twice the number of a block's first row fits in an int32."""

HORIZON = 1.0 / 3.0
"""Texels past a doubtful hit from which a search goes on."""


KERNELS = (write_nodes, split_groups, measure_cells, number_cells, split_cells, gather_nodes, sort_by_cell)
"""Those of a tree over triangles."""


def build_tree(geometry: DeviceMesh, resolution: int, quality: Quality, *, trusted: bool = False) -> Tree:
    """The tree of a mesh: over its triangles, or over patches where many triangles share a texel.

    Args:
        resolution: texels along the mesh's longest side.
        quality: chooses between triangles and patches, see ``record_choice.py``.
        trusted: texels are smaller than what can be seen, so that patches need no check.

    Raises:
        InputError: the tree needs more memory than is allowed.
    """
    chosen = choose_records(geometry, resolution, quality, trusted=trusted)
    tree = _tree_of_triangles(geometry) if chosen is None else _tree_with_patches(geometry, chosen)
    if tree.view.front != 0.0 and shows_backs(tree):
        tree.view.front = 0.0
    return tree


def _tree_of_triangles(geometry: DeviceMesh) -> Tree:
    """The tree over all triangles but the outliers."""
    records = _records_of(geometry)
    records.numbers = _listed_bulk(geometry)
    return _tree_over(records, len(geometry.faces) - len(geometry.mesh.outliers), geometry)


def _tree_with_patches(geometry: DeviceMesh, chosen: PatchRecords) -> Tree:
    """The tree over patches, and over the triangles that none stands for."""
    frame, records = chosen.frame, _records_of(geometry)
    records.numbers, records.patches = chosen.numbers, chosen.patches
    records.unit_per_cell = 1.0 / (chosen.cells_per_texel * frame.scale)
    records.unit_offset = wp.vec3(*(-np.array(frame.offset) / frame.scale))
    tree = _tree_over(records, chosen.numbers.shape[0], geometry)
    view = tree.view
    view.front = float(chosen.front)
    view.half_patch = (0.5 + float(PATCH_MARGIN)) / frame.scale
    view.horizon = HORIZON / frame.scale
    return tree


def _tree_over(records: Records, count: int, geometry: DeviceMesh) -> Tree:
    """The tree over ``count`` records of a mesh."""
    if count > min(MOST_RECORDS, memory_limit() // BYTES_PER_RECORD):
        raise InputError(
            f"the mesh has {len(geometry.faces)} triangles, too many to search (--memory allows {memory_limit()} bytes)"
        )
    box, device = _bulk_box(geometry), geometry.vertices.device
    nodes, order = binary_tree(records, count, box, device, by_halves=False)
    view = wide_tree(records, nodes, order)
    if view is None:
        # Boxes lie in boxes, hundreds deep. Splitting in halves cannot go so deep.
        nodes, order = binary_tree(records, count, box, device, by_halves=True)
        view = wide_tree(records, nodes, order)
        assert view is not None
    return Tree.of(view, count, geometry)


def _records_of(geometry: DeviceMesh) -> Records:
    records = Records()
    records.vertices, records.faces = geometry.vertices, geometry.faces
    return records


def _bulk_box(geometry: DeviceMesh) -> np.ndarray:
    """(2, 3), about all but the outliers, unit space."""
    centre, half = geometry.mesh.unit_frame
    return (geometry.mesh.bulk - centre) / half


def _listed_bulk(geometry: DeviceMesh) -> wp.array:
    """(n,) int32, the triangles that are no outliers; empty if there are no outliers."""
    outliers = geometry.mesh.outliers
    bulk = np.zeros(0, np.int32)
    if len(outliers):
        bulk = np.delete(np.arange(len(geometry.faces), dtype=np.int32), outliers)
    return wp.array(bulk, dtype=wp.int32, device=geometry.vertices.device)
