"""The ray caster: rays against a BVH over a mesh's triangles. It is the ground truth.

Warp builds the tree (``wp.Bvh``) by the surface area heuristic. How rays go down it, so that none passes between
triangles that share an edge or a vertex, stands in ``bvh_walk.py``.
"""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np
import warp as wp
from numpy.typing import ArrayLike

from ldtrefl.device import launch, warp_abi
from ldtrefl.geometry.vectors import as_double
from ldtrefl.scene.mesh import Mesh
from ldtrefl.tracing.batch import Hits, RayArray, occluded_batch, trace_batch
from ldtrefl.tracing.bvh_walk import (
    BvhView,
    box_triangles,
    query_any,
    query_first,
    unit_facet_normal,
    walk_to_any,
    walk_to_first,
)
from ldtrefl.tracing.hit import Hit, no_hit
from ldtrefl.tracing.outlier_hits import is_outlier_met, merge_outliers
from ldtrefl.tracing.tracer import Query, Tracer, array_of_views
from ldtrefl.world.device_mesh import DeviceMesh
from ldtrefl.world.unit_rays import SPHERE_RADIUS, distance_passed

LEAF_TRIANGLES = 4
"""Triangles in a leaf of the tree, at most. With 1 rays take a seventh longer, and the tree a third longer to build;
with 8 rays take as long."""


def from_nearby(walk: Callable[..., wp.vec4d]) -> Callable[..., wp.vec4d]:
    """``walk`` as a function of a ``Query``: it starts where the ray comes near the object."""

    @wp.func
    def walk_from_nearby(views: wp.array(dtype=BvhView), index: int, query: Query) -> wp.vec4d:
        if not query.t_max > 0.0:
            return wp.vec4d(wp.float64(0.0), wp.float64(0.0), wp.float64(0.0), wp.float64(-1.0))
        passed = distance_passed(query.origin, query.direction, SPHERE_RADIUS)
        start = query.origin + passed * as_double(query.direction)
        found = walk(views, index, start, query.direction, wp.float64(query.t_max) - passed)
        found[0] = passed + found[0]
        return found

    return walk_from_nearby


@launch.once
def bvh_tracer(to_first: Callable[..., wp.vec4d], to_any: Callable[..., wp.vec4d]) -> Tracer:
    """The tracer over trees of Warp's, by functions like ``walk_to_first`` and ``walk_to_any`` of ``bvh_walk.py``."""

    first_met, any_met = from_nearby(to_first), from_nearby(to_any)

    @wp.func
    def closest_hit_in_bulk(views: wp.array(dtype=BvhView), index: int, query: Query) -> Hit:
        """The first triangle that a ray meets, outliers left out."""
        hit = no_hit()
        found = first_met(views, index, query)
        if found[3] >= wp.float64(0.0):
            hit.t = float(found[0])
            hit.triangle = int(found[3])
            hit.u = float(found[1])
            hit.v = float(found[2])
            hit.normal = unit_facet_normal(views[index], hit.triangle)
        return hit

    @wp.func
    def closest_hits_bvh(
        views: wp.array(dtype=BvhView),
        index: int,
        queries: wp.array(dtype=Query),
        count: int,
        hits: wp.array(dtype=Hit),
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
        return any_met(views, index, query)[3] >= wp.float64(0.0)

    @wp.func
    def any_hits_bvh(
        views: wp.array(dtype=BvhView),
        index: int,
        queries: wp.array(dtype=Query),
        count: int,
        hits: wp.array(dtype=Hit),
    ):
        """The tracer's ``any_hits``."""
        for i in range(count):
            hits[i].triangle = wp.where(occluded_bvh(views, index, queries[i], wp.vec3(0.0)), 0, -1)

    return Tracer("bvh", BvhView, closest_hits_bvh, any_hits_bvh, occluded_bvh)


BVH = bvh_tracer(walk_to_first, walk_to_any) if warp_abi.bvh_is_known() else bvh_tracer(query_first, query_any)
"""The ray caster's tracer."""


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
        self._faces = geometry.faces
        if len(geometry.mesh.outliers):
            # An outlier is made a triangle without area, which no ray meets, so that the others keep their numbers.
            rest = geometry.mesh.faces.copy()
            rest[geometry.mesh.outliers] = rest[np.delete(np.arange(len(rest)), geometry.mesh.outliers)[0], :1]
            self._faces = wp.array(rest, dtype=wp.vec3i, device=geometry.faces.device)
        count, device = len(self._faces), self._faces.device
        lows, highs = (wp.empty(count, dtype=wp.vec3, device=device) for _ in range(2))
        launch.launch(box_triangles, count, [geometry.vertices, self._faces, lows, highs], device)
        self._tree = wp.Bvh(lows, highs, leaf_size=LEAF_TRIANGLES)

    def view(self) -> BvhView:
        """The ``BvhView`` for kernels."""
        view = BvhView()
        view.tree, view.vertices, view.faces = self._tree.id, self.geometry.vertices, self._faces
        view.outliers = self.geometry.outliers
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
        return trace_batch(BVH, self._views, self.geometry, origins, directions, t_max)

    def occluded(self, origins: RayArray, directions: RayArray, t_max: RayArray | None = None) -> np.ndarray | wp.array:
        """(...) bool: whether rays meet the mesh at all. Arguments and errors are those of :meth:`trace`."""
        return occluded_batch(BVH, self._views, self.geometry, origins, directions, t_max)

    @functools.cached_property
    def _views(self) -> wp.array:
        """:meth:`view` as kernels read it."""
        return array_of_views([self.view()], BvhView, self.geometry.vertices.device)
