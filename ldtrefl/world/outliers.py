"""The few triangles far outside a mesh's bulk (``scene/outliers.py``), in float64: tested one by one.

A corner a million sizes away is rounded by a tenth of a size in float32, and with it the plane where it passes the
bulk. So these triangles keep the mesh's own float64 corners. Boxes about them in float32, eight at a time, tell which a
ray may meet.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from ldtrefl.scene.mesh import Mesh


@wp.struct
class OutlierTriangle:
    """A triangle in unit space."""

    a: wp.vec3d
    edge_u: wp.vec3d  # from a to b
    edge_v: wp.vec3d  # from a to c
    triangle: int


@wp.struct
class Outliers:
    """All of a mesh."""

    triangles: wp.array(dtype=OutlierTriangle)
    boxes: wp.array(dtype=wp.float32)  # of eight each: per axis their lows, then their highs


BOX_MARGIN = 1.0e-6
"""Of the largest coordinate, by how much boxes, and a ray's start, are widened: some roundings of a float32."""


def outliers_of(mesh: Mesh, device: wp.Device) -> Any:
    """The ``Outliers`` of a mesh, on a device."""
    made = Outliers()
    if len(mesh.outliers) == 0:
        made.triangles = wp.empty(0, dtype=OutlierTriangle, device=device)
        made.boxes = wp.empty(0, dtype=wp.float32, device=device)
        return made
    centre, half = mesh.unit_frame
    corners = (mesh.vertices[mesh.faces[mesh.outliers]] - centre) / half
    a, b, c = np.moveaxis(corners, 1, 0)
    records = []
    for k, triangle in enumerate(mesh.outliers.tolist()):
        record = OutlierTriangle()
        record.a, record.triangle = wp.vec3d(*a[k]), triangle
        record.edge_u, record.edge_v = wp.vec3d(*(b[k] - a[k])), wp.vec3d(*(c[k] - a[k]))
        records.append(record)
    made.triangles = wp.array(records, dtype=OutlierTriangle, device=device)
    boxes = np.zeros((-(-len(corners) // 8), 3, 2, 8), np.float32)
    margin = BOX_MARGIN * np.abs(corners).max(axis=(1, 2))[:, None]
    for side, bound in enumerate((corners.min(axis=1) - margin, corners.max(axis=1) + margin)):
        padded = np.zeros((8 * len(boxes), 3))
        padded[: len(bound)] = bound
        boxes[:, :, side] = padded.reshape(-1, 8, 3).transpose(0, 2, 1)
    made.boxes = wp.array(boxes.reshape(-1), dtype=wp.float32, device=device)
    return made
