"""Bounding spheres of placed meshes, in device space, about the centres of the meshes' boxes.

A placement scales along the mesh's own axes and then turns. Where it scales alike along all three, the sphere is that
of the mesh, which is measured once. Elsewhere a point's squared distance from the centre is the sum of its squared
coordinates, each times the square of its axis' scale; the largest is looked for among the mesh's vertices.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.world.device_mesh import DeviceMesh

SPHERE_PADDING = 2.0e-6
"""Device units by which bounding spheres are widened: ten roundings of a float32 anywhere in the device's box."""

SPHERE_WIDENING = 1.0 + 1e-5
"""Factor by which bounding spheres are widened: what rays are tested with is rounded to float32."""

ALIKE = 1e-9
"""Scales that differ by less than this share count as the same, and as the largest: their roundings differ by less."""


@launch.kernel
def find_largest(
    first: int,
    # In:
    squares: wp.array(dtype=wp.vec3d),  # of the coordinates of a mesh's vertices
    weights: wp.array(dtype=wp.vec3d),
    # Out:
    largest_out: wp.array(dtype=wp.float64),
):
    """Find the largest weighted sum of a vertex's squares, for the weights of one object."""
    i = first + wp.tid()
    largest = wp.float64(0.0)
    for k in range(squares.shape[0]):
        largest = wp.max(largest, wp.dot(weights[i], squares[k]))
    largest_out[i] = largest


def bounding_radii(meshes: Sequence[DeviceMesh], mesh_of: np.ndarray, device_from_unit: np.ndarray) -> np.ndarray:
    """(n,) float64 radii of n objects' spheres. They are padded for the rounding of what rays are tested with: float32
    in the device's box.

    Args:
        meshes: some meshes.
        mesh_of: (n,) the number of each object's mesh.
        device_from_unit: (n, 4, 4), the objects' places.
    """
    weights = (device_from_unit[:, :3, :3] ** 2).sum(axis=1)
    largest = weights.max(axis=1)
    squares = largest * np.array([mesh.reach**2 for mesh in meshes])[mesh_of]
    stretched = weights.min(axis=1) < (1.0 - ALIKE) * largest
    for number in np.unique(mesh_of[stretched]):
        here = np.flatnonzero(stretched & (mesh_of == number))
        squares[here] = _largest_sums(meshes[number], weights[here])
    return np.sqrt(squares) * SPHERE_WIDENING + SPHERE_PADDING


def _largest_sums(mesh: DeviceMesh, weights: np.ndarray) -> np.ndarray:
    """(n,) for each of (n, 3) weights the largest weighted sum of a vertex's squared coordinates."""
    cpu = launch.resolve_device("cpu")
    squares = mesh.mesh.unit_vertices[mesh.mesh.is_used].astype(float) ** 2
    largest = np.empty(len(weights))
    arrays = [wp.array(values, dtype=wp.vec3d, device=cpu, copy=False) for values in (squares, weights)]
    launch.launch(find_largest, len(weights), [*arrays, wp.array(largest, device=cpu, copy=False)], cpu)
    return largest
