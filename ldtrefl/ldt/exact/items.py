"""The tree of a mesh: over its triangles, or over patches of the maps where many triangles share a texel."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from ldtrefl.ldt.exact.build import Items, build_tree
from ldtrefl.ldt.exact.record_choice import MixedRecords, Quality, choose_records
from ldtrefl.ldt.exact.tree import Tree
from ldtrefl.world.device_mesh import DeviceMesh


def tree_of(geometry: DeviceMesh, resolution: int, quality: Quality, *, trusted: bool = False) -> Tree:
    """The tree of a mesh; ``quality`` chooses between triangles and patches.

    See ``records_choice.py``.
    """
    mixed = choose_records(geometry, resolution, quality, trusted=trusted)
    if mixed is not None:
        return _of_mixed(geometry, mixed)
    items = _items(geometry)
    items.numbers = _listed_bulk(geometry)
    return build_tree(items, len(geometry.faces) - len(geometry.mesh.outliers), _bulk_box(geometry), geometry)


def _items(geometry: DeviceMesh) -> Any:
    items = Items()
    items.vertices, items.faces = geometry.vertices, geometry.faces
    return items


def _bulk_box(geometry: DeviceMesh) -> np.ndarray:
    centre, half = geometry.mesh.unit_frame
    return (geometry.mesh.bulk - centre) / half


def _listed_bulk(geometry: DeviceMesh) -> wp.array:
    """The triangles that are no outliers; an empty list if there are none."""
    outliers = geometry.mesh.outliers
    bulk = (
        np.delete(np.arange(len(geometry.faces), dtype=np.int32), outliers) if len(outliers) else np.zeros(0, np.int32)
    )
    return wp.array(bulk, dtype=wp.int32, device=geometry.vertices.device)


def _of_mixed(geometry: DeviceMesh, mixed: MixedRecords) -> Tree:
    """Patches, and the triangles that none stands for."""
    frame, items = mixed.frame, _items(geometry)
    items.numbers, items.patches = mixed.items, mixed.patches
    items.unit_per_cell = 1.0 / (mixed.cells_per_texel * frame.scale)
    items.unit_offset = wp.vec3(*(-np.array(frame.offset) / frame.scale))
    tree = build_tree(items, mixed.items.shape[0], _bulk_box(geometry), geometry)
    view = tree.view
    view.front, view.horizon = float(mixed.front), mixed.horizon / frame.scale
    view.half_patch = mixed.half_patch / frame.scale
    return tree
