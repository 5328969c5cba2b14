"""Ray against BVH (``wp.Mesh``): the ground truth.

Warp walks a SAH-built BVH and tests triangles by Woop, Benthin and Wald's watertight intersection (2013).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.geometry.vectors import as_single, point_along
from ldtrefl.scene.mesh import Mesh
from ldtrefl.tracing.hit import Hit, no_hit
from ldtrefl.tracing.outlier_hits import first_outlier_hit
from ldtrefl.tracing.trace import (
    Hits,
    Query,
    Tracer,
    any_one_by_one,
    array_of_views,
    occluded_batch,
    one_by_one,
    trace_batch,
)
from ldtrefl.world.device_mesh import DeviceMesh
from ldtrefl.world.outliers import Outliers
from ldtrefl.world.unit_rays import SPHERE, distance_passed


@wp.struct
class BvhView:
    """A mesh with its BVH."""

    mesh: wp.uint64  # without the outliers
    outliers: Outliers


@wp.func
def closest_hit_bvh(views: wp.array(dtype=BvhView), index: int, query: Query) -> Hit:
    """The tracer's closest hit of a ray."""
    hit = no_hit()
    if query.t_max > 0.0:
        passed = distance_passed(query.origin, query.direction, SPHERE)
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
def occluded_bvh(views: wp.array(dtype=BvhView), index: int, query: Query, outwards: wp.vec3) -> bool:
    """The tracer's ``occluded``; a ray that leaves the mesh starts above its own triangle."""
    if not query.t_max > 0.0:
        return False
    passed = distance_passed(query.origin, query.direction, SPHERE)
    origin = as_single(point_along(query.origin, query.direction, passed))
    return wp.mesh_query_ray_anyhit(views[index].mesh, origin, query.direction, query.t_max - passed)


@wp.func
def outlier_hit_bvh(
    views: wp.array(dtype=BvhView), index: int, origin: wp.vec3d, direction: wp.vec3, t_max: float
) -> Hit:
    """The tracer's ``outlier_hit``."""
    return first_outlier_hit(views[index].outliers, origin, direction, t_max)


@wp.func
def outlier_count_bvh(views: wp.array(dtype=BvhView), index: int) -> int:
    """The tracer's ``outlier_count``."""
    return views[index].outliers.triangles.shape[0]


BVH = Tracer(
    "bvh",
    BvhView,
    one_by_one(closest_hit_bvh, BvhView),
    any_one_by_one(occluded_bvh, BvhView),
    occluded_bvh,
    outlier_hit_bvh,
    outlier_count_bvh,
)


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
        if len(geometry.mesh.outliers):
            # A point is never met; the others keep their numbers.
            rest = geometry.mesh.faces.copy()
            rest[geometry.mesh.outliers] = rest[np.delete(np.arange(len(rest)), geometry.mesh.outliers)[0], :1]
            faces = wp.array(rest, dtype=wp.vec3i, device=faces.device)
        self._mesh = wp.Mesh(geometry.vertices, faces.view(wp.int32).flatten())

    def view(self) -> Any:
        """The ``BvhView`` for kernels."""
        view = BvhView()
        view.mesh, view.outliers = self._mesh.id, self.geometry.outliers
        return view

    def trace(self, origins: Any, directions: Any, t_max: Any = None) -> Hits:
        """First hits of rays given in object space.

        Args:
            origins: (..., 3) float32 numpy or Warp array.
            directions: (..., 3) float32, any length; ``t`` is in lengths of it.
            t_max: hits before this count; a number, or (...), one a ray; ``None``: all.

        Raises:
            InputError: the arrays' shapes do not fit, or they hold no numbers.
        """
        return trace_batch(BVH, self._views(), self.geometry, origins, directions, t_max)

    def occluded(self, origins: Any, directions: Any, t_max: Any = None) -> Any:
        """(...) bool: whether rays meet the mesh at all; arguments and errors as :meth:`trace` has them."""
        return occluded_batch(BVH, self._views(), self.geometry, origins, directions, t_max)

    def _views(self) -> wp.array:
        return array_of_views([self.view()], BvhView, self.geometry.vertices.device)
