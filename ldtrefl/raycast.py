"""Ray against BVH (``wp.Mesh``): the ground truth.

Warp walks a SAH-built BVH and tests triangles by Woop, Benthin and Wald's watertight intersection (2013).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from ldtrefl import launch
from ldtrefl.device_scene import DeviceMesh
from ldtrefl.hit import Hit, no_hit
from ldtrefl.mesh import Mesh
from ldtrefl.strays import StrayTriangle, first_stray
from ldtrefl.trace import Hits, Tracer, array_of_views, trace_batch


@wp.struct
class BvhView:
    """A mesh with its BVH."""

    mesh: wp.uint64  # without the strays
    strays: wp.array(dtype=StrayTriangle)


@wp.func
def closest_hit_bvh(
    views: wp.array(dtype=BvhView), index: int, origin: wp.vec3, direction: wp.vec3, t_max: float
) -> Hit:
    """The tracer's ``closest_hit``."""
    hit = no_hit()
    found = wp.mesh_query_ray(views[index].mesh, origin, direction, t_max)
    if found.result:
        hit.t = found.t
        hit.triangle = found.face
        hit.normal = wp.normalize(found.normal)
        # Warp's u and v weigh the first and second corner, ours the second and third.
        hit.u = found.v
        hit.v = 1.0 - found.u - found.v
    return hit


@wp.func
def occluded_bvh(
    views: wp.array(dtype=BvhView), index: int, origin: wp.vec3, direction: wp.vec3, t_max: float, outwards: wp.vec3
) -> bool:
    """The tracer's ``occluded``; a ray that leaves the mesh starts above its own triangle."""
    return wp.mesh_query_ray_anyhit(views[index].mesh, origin, direction, t_max)


@wp.func
def stray_hit_bvh(
    views: wp.array(dtype=BvhView), index: int, origin: wp.vec3d, direction: wp.vec3, t_max: float
) -> Hit:
    """The tracer's ``stray_hit``."""
    return first_stray(views[index].strays, origin, direction, t_max)


@wp.func
def stray_count_bvh(views: wp.array(dtype=BvhView), index: int) -> int:
    """The tracer's ``stray_count``."""
    return views[index].strays.shape[0]


BVH = Tracer("bvh", BvhView, closest_hit_bvh, occluded_bvh, stray_hit_bvh, stray_count_bvh)


class Raycaster:
    """First hits of rays on a mesh, by BVH. The same ``trace`` as a layered depth texture's."""

    def __init__(self, vertices: Any, faces: Any, device: str | None = None) -> None:
        """Build the BVH.

        Args:
            vertices: (n, 3) numbers, object space.
            faces: (m, 3) vertex numbers.
            device: 'cpu' (default) or a CUDA device.

        Raises:
            InputError: an empty mesh, an index out of range, or a vertex that is not finite.
        """
        self._build(DeviceMesh(Mesh(vertices, faces), launch.resolve_device(device)))

    @classmethod
    def of(cls, geometry: DeviceMesh) -> Raycaster:
        """A ray caster for a mesh that is on a device already."""
        made = cls.__new__(cls)
        made._build(geometry)
        return made

    def _build(self, geometry: DeviceMesh) -> None:
        self.geometry = geometry
        faces = geometry.faces
        if len(geometry.mesh.strays):
            # A point is never met; the others keep their numbers.
            rest = geometry.mesh.faces.copy()
            rest[geometry.mesh.strays] = rest[np.delete(np.arange(len(rest)), geometry.mesh.strays)[0], :1]
            faces = wp.array(rest, dtype=wp.vec3i, device=faces.device)
        self._mesh = wp.Mesh(geometry.vertices, faces.view(wp.int32).flatten())

    def view(self) -> Any:
        """The ``BvhView`` for kernels."""
        view = BvhView()
        view.mesh, view.strays = self._mesh.id, self.geometry.strays
        return view

    def trace(self, origins: Any, directions: Any) -> Hits:
        """First hits of n rays given in object space.

        Args:
            origins: (n, 3) float32 numpy or Warp array.
            directions: (n, 3) float32, any length; ``t`` is in lengths of it.

        Raises:
            InputError: the arrays' shapes are not (n, 3) and equal.
        """
        views = array_of_views([self.view()], BvhView, self.geometry.vertices.device)
        return trace_batch(BVH, views, self.geometry, origins, directions)
