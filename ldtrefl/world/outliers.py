"""The few triangles far outside a mesh's bulk (``scene/outliers.py``) on a device, in float64.

A corner that is a million of the bulk's sizes away is rounded by a tenth of its size in float32. So is then the
triangle's plane where it passes the bulk. So outliers keep the mesh's own float64 corners and are tested one by one.
Boxes about them in float32, tested eight at a time, tell which a ray may meet.
"""

from __future__ import annotations

import numpy as np
import warp as wp

from ldtrefl.scene.mesh import Mesh


@wp.struct
class OutlierTriangle:
    """An outlier, in unit space."""

    a: wp.vec3d
    edge_u: wp.vec3d  # from a to b
    edge_v: wp.vec3d  # from a to c
    triangle: int  # its number in the mesh


@wp.struct
class Outliers:
    """All outliers of a mesh."""

    triangles: wp.array(dtype=OutlierTriangle)
    boxes: wp.array(dtype=wp.float32)  # for each eight triangles 48: per axis eight low sides, then eight high sides


BOX_MARGIN = 1.0e-6
"""How much boxes, and a ray's start, are widened, as a share of the largest coordinate: some roundings of a float32."""


def outliers_of(mesh: Mesh, device: wp.Device) -> Outliers:
    """Upload the outliers of a mesh, most often none."""
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
