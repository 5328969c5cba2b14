"""The few triangles far outside a mesh's bulk (``bulk.py``), in float64: tested one by one before the bulk is.

A corner a million sizes away is rounded by a tenth of a size in float32, and with it the plane where it passes the
bulk. So these triangles keep the mesh's own float64 corners.
"""

from __future__ import annotations

import numpy as np
import warp as wp

from ldtrefl.hit import Hit, no_hit
from ldtrefl.mesh import Mesh
from ldtrefl.vectors import as_double, as_single


@wp.struct
class StrayTriangle:
    """A triangle in unit space."""

    a: wp.vec3d
    edge_u: wp.vec3d  # from a to b
    edge_v: wp.vec3d  # from a to c
    triangle: int


@wp.func
def first_stray(strays: wp.array(dtype=StrayTriangle), origin: wp.vec3d, direction: wp.vec3, t_max: float) -> Hit:
    """Test every triangle (Moeller and Trumbore 1997), from ``origin`` in unit space along a unit ``direction``."""
    hit = no_hit()
    nearest = wp.float64(t_max)
    zero, one = wp.float64(0.0), wp.float64(1.0)
    way = as_double(direction)
    for k in range(strays.shape[0]):
        edge_u, edge_v = strays[k].edge_u, strays[k].edge_v
        p = wp.cross(way, edge_v)
        determinant = wp.dot(edge_u, p)
        if determinant != zero:
            s = origin - strays[k].a
            u = wp.dot(s, p) / determinant
            q = wp.cross(s, edge_u)
            v = wp.dot(way, q) / determinant
            t = wp.dot(edge_v, q) / determinant
            if u >= zero and v >= zero and u + v <= one and t >= zero and t < nearest:
                nearest = t
                hit.t = float(t)
                hit.triangle = strays[k].triangle
                hit.u = float(u)
                hit.v = float(v)
                hit.normal = as_single(wp.normalize(wp.cross(edge_u, edge_v)))
    return hit


def stray_array(mesh: Mesh, device: wp.Device) -> wp.array:
    """(k,) ``StrayTriangle`` of a mesh, on a device."""
    if len(mesh.strays) == 0:
        return wp.empty(0, dtype=StrayTriangle, device=device)
    centre, half = mesh.unit_frame
    a, b, c = np.moveaxis((mesh.vertices[mesh.faces[mesh.strays]] - centre) / half, 1, 0)
    made = []
    for k, triangle in enumerate(mesh.strays.tolist()):
        record = StrayTriangle()
        record.a, record.triangle = wp.vec3d(*a[k]), triangle
        record.edge_u, record.edge_v = wp.vec3d(*(b[k] - a[k])), wp.vec3d(*(c[k] - a[k]))
        made.append(record)
    return wp.array(made, dtype=StrayTriangle, device=device)
