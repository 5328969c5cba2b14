"""How many pixels away from its place a reflected point is seen."""

from __future__ import annotations

import numpy as np

from ldtrefl.compare.metrics.base import metric
from ldtrefl.frame.bounce_hits import FirstHits
from ldtrefl.frame.gbuffer import GBuffer
from ldtrefl.tracing.ray_buffers import distance_across


@metric("pixels", heading="pixels p99", format=".3f", place=70)
def largest_reprojection_error(hits: FirstHits, truth: FirstHits, gbuffer: GBuffer) -> float:
    """99th percentile of :func:`reprojection_errors`, in pixels; NaN if there are none."""
    errors = reprojection_errors(hits, truth, gbuffer)
    return float(np.percentile(errors, 99)) if len(errors) else float("nan")


def reprojection_errors(hits: FirstHits, truth: FirstHits, gbuffer: GBuffer) -> np.ndarray:
    """(n,) how many pixels away from its place each reflected point is seen, of rays that hit something and should.

    A hit in front of the true surface or behind it shows a point beside the true one. That lies sideways to the ray, by
    the error along the ray times sine and cosine of the ray's angle with the surface. The error in pixels is this
    distance over the distance between the rays of neighbouring pixels there, which is the geometric mean of that to the
    pixel on the right and that to the pixel below.

    Where no such distance exists, rays are left out: where the pixel on the right or below sees another mirror or none,
    and in the last row and column. A ray that hits another object than the truth's is measured like any other, by its
    error along the ray. A distance that is NaN counts as an infinite error, and so does any error where neighbouring
    rays meet in one point.
    """
    origin, direction, source = _rays_by_pixel(truth)
    both = (hits.object >= 0) & (truth.object >= 0)
    both[:, -1] = both[-1] = False
    both[:-1, :-1] &= (source[:-1, :-1] == source[:-1, 1:]) & (source[:-1, :-1] == source[1:, :-1])
    y, x = np.nonzero(both)

    scale = gbuffer.scene.device_units_per_world_unit
    pixel_size = np.ones(len(y))
    for dy, dx in ((0, 1), (1, 0)):
        neighbour = origin[y + dy, x + dx], direction[y + dy, x + dx]
        along = truth.distance[y, x].astype(float) * scale
        pixel_size *= np.sqrt(distance_across(origin[y, x], direction[y, x], *neighbour, along))
    errors = np.abs(hits.distance[y, x].astype(float) - truth.distance[y, x]) * scale
    errors *= _sine_times_cosine(direction[y, x], truth.object[y, x], truth.triangle[y, x], gbuffer)
    errors[np.isnan(errors)] = np.inf
    # Where neighbouring rays meet, no error stays none, and any other is infinite.
    return np.divide(errors, pixel_size, out=np.where(errors > 0.0, np.inf, 0.0), where=pixel_size > 0.0)


def _rays_by_pixel(truth: FirstHits) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(h, w, 3) origins and directions of the reflected rays, NaN where there are none, and (h, w) the numbers of the
    mirrors that they leave, -1 where there are none."""
    shape = truth.shape
    origin, direction = (np.full((*shape, 3), np.nan) for _ in range(2))
    source = np.full(shape, -1)
    at = np.unravel_index(truth.rays.pixel.numpy(), shape)
    origin[at], direction[at] = truth.rays.origin.numpy(), truth.rays.direction.numpy()
    source[at] = truth.rays.source.numpy()
    return origin, direction, source


def _sine_times_cosine(
    direction: np.ndarray, objects: np.ndarray, triangles: np.ndarray, gbuffer: GBuffer
) -> np.ndarray:
    """(n,) sine times cosine of the angle between each ray and the normal of the triangle that it hits.

    Args:
        direction: (n, 3) of each ray, in device space.
        objects: (n,) the object that it hits.
        triangles: (n,) the triangle of that object.
    """
    scene, product = gbuffer.scene, np.ones(len(direction))
    for entry in scene.objects:
        here = objects == entry.index
        corners = entry.geometry.mesh.unit_vertices[entry.geometry.mesh.faces[triangles[here]]].astype(float)
        a, b, c = np.moveaxis(corners @ (scene.device_from_world @ entry.world_from_unit)[:3, :3].T, 1, 0)
        normal = np.cross(b - a, c - a)
        length = np.maximum(np.linalg.norm(normal, axis=1), np.finfo(float).tiny)
        cosine = np.clip(np.abs((normal * direction[here]).sum(axis=1)) / length, 0.0, 1.0)
        product[here] = cosine * np.sqrt(1.0 - cosine**2)
    return product
