"""The ray caster: rays against a BVH over a mesh's triangles (``wp.Mesh``). It is the ground truth.

Warp walks a BVH built by the surface area heuristic, and tests triangles by the watertight intersection of Woop,
Benthin and Wald (2013).
"""

from __future__ import annotations

import numpy as np
import warp as wp
from numpy.typing import ArrayLike

from ldtrefl.device import launch
from ldtrefl.geometry.vectors import as_single, point_along
from ldtrefl.scene.mesh import Mesh
from ldtrefl.tracing.batch import Hits, RayArray, occluded_batch, trace_batch
from ldtrefl.tracing.hit import Hit, no_hit
from ldtrefl.tracing.outlier_hits import is_outlier_met, merge_outliers
from ldtrefl.tracing.tracer import Query, Tracer, array_of_views
from ldtrefl.world.device_mesh import DeviceMesh
from ldtrefl.world.outliers import Outliers
from ldtrefl.world.unit_rays import SPHERE_RADIUS, distance_passed


@wp.struct
class BvhView:
    """A mesh with its BVH."""

    mesh: wp.uint64  # the ``wp.Mesh`` without the outliers
    outliers: Outliers


@wp.func
def closest_hit_in_bulk(views: wp.array(dtype=BvhView), index: int, query: Query) -> Hit:
    """The first triangle that a ray meets, outliers left out."""
    hit = no_hit()
    if query.t_max > 0.0:
        passed = distance_passed(query.origin, query.direction, SPHERE_RADIUS)
        origin = as_single(point_along(query.origin, query.direction, passed))
        found = wp.mesh_query_ray(views[index].mesh, origin, query.direction, query.t_max - passed)
        if found.result:
            hit.t = passed + found.t
            hit.triangle = found.face
            hit.normal = wp.normalize(found.normal)
            # Warp's u and v weigh the first and second corner, ours the second and third.
            hit.u = found.v
            hit.v = 1.0 - found.u - found.v
    return hit


@wp.func
def closest_hits_bvh(
    views: wp.array(dtype=BvhView), index: int, queries: wp.array(dtype=Query), count: int, hits: wp.array(dtype=Hit)
):
    """The tracer's ``closest_hits``."""
    for i in range(count):
        hits[i] = closest_hit_in_bulk(views, index, queries[i])
    merge_outliers(views[index].outliers, queries, count, hits)


@wp.func
def occluded_bvh(views: wp.array(dtype=BvhView), index: int, query: Query, outwards: wp.vec3) -> bool:
    """The tracer's ``occluded``. It does not need ``outwards``: rays start above the triangle that they leave."""
    if is_outlier_met(views[index].outliers, query):
        return True
    if not query.t_max > 0.0:
        return False
    passed = distance_passed(query.origin, query.direction, SPHERE_RADIUS)
    origin = as_single(point_along(query.origin, query.direction, passed))
    return wp.mesh_query_ray_anyhit(views[index].mesh, origin, query.direction, query.t_max - passed)


@wp.func
def any_hits_bvh(
    views: wp.array(dtype=BvhView), index: int, queries: wp.array(dtype=Query), count: int, hits: wp.array(dtype=Hit)
):
    """The tracer's ``any_hits``."""
    for i in range(count):
        hits[i].triangle = wp.where(occluded_bvh(views, index, queries[i], wp.vec3(0.0)), 0, -1)


BVH = Tracer("bvh", BvhView, closest_hits_bvh, any_hits_bvh, occluded_bvh)


class Raycaster:
    """First hits of rays on a mesh, by BVH. The same ``trace`` as a layered depth texture's."""

    def __init__(self, vertices: ArrayLike, faces: ArrayLike, device: str | None = None) -> None:
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
        if len(geometry.mesh.outliers):
            # An outlier is made a triangle without area, which no ray meets, so that the others keep their numbers.
            rest = geometry.mesh.faces.copy()
            rest[geometry.mesh.outliers] = rest[np.delete(np.arange(len(rest)), geometry.mesh.outliers)[0], :1]
            faces = wp.array(rest, dtype=wp.vec3i, device=faces.device)
        self._mesh = wp.Mesh(geometry.vertices, faces.view(wp.int32).flatten())

    def view(self) -> BvhView:
        """The ``BvhView`` for kernels."""
        view = BvhView()
        view.mesh, view.outliers = self._mesh.id, self.geometry.outliers
        return view

    def trace(self, origins: RayArray, directions: RayArray, t_max: RayArray | None = None) -> Hits:
        """First hits of rays given in object space.

        Args:
            origins: (..., 3) float32 numpy or Warp array.
            directions: (..., 3) float32, any length; ``t`` is in lengths of it.
            t_max: hits count only before this distance: one number for all rays, or (...), one for each; ``None`` for
                no limit.

        Raises:
            InputError: the arrays' shapes do not fit, or they hold no numbers.
        """
        return trace_batch(BVH, self._views(), self.geometry, origins, directions, t_max)

    def occluded(self, origins: RayArray, directions: RayArray, t_max: RayArray | None = None) -> np.ndarray | wp.array:
        """(...) bool: whether rays meet the mesh at all. Arguments and errors are those of :meth:`trace`."""
        return occluded_batch(BVH, self._views(), self.geometry, origins, directions, t_max)

    def _views(self) -> wp.array:
        return array_of_views([self.view()], BvhView, self.geometry.vertices.device)
