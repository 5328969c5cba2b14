"""A mesh's triangles in clusters of neighbours, and boxes about them in a tree.

Whoever draws many objects of one mesh goes down the tree of each: what the camera cannot see of an object is left out
box by box. Triangles are halved along the longest side of the box about their centres, those halves again, and so on:
each 16 that are left together are a cluster. Each 8 clusters in a row have a common box, each 8 of those, and so on up
to the whole mesh. All in unit space.
"""

from __future__ import annotations

import numpy as np
import warp as wp

from ldtrefl.scene.mesh import Mesh

CLUSTER = wp.constant(16)
"""Triangles in a cluster; the last one may have less. With 8 more boxes are looked at, with 32 more triangles."""

CHILDREN = wp.constant(8)
"""Boxes within one of the next level."""


@wp.struct
class Clusters:
    """The clusters of a mesh."""

    triangles: wp.array(dtype=wp.int32)  # numbers in the mesh, cluster by cluster
    corners: wp.array(dtype=wp.vec3ub)  # of each of them, as places among its cluster's points
    points: wp.array(dtype=wp.vec3)  # the vertices of all clusters
    first_point: wp.array(dtype=wp.int32)  # (clusters + 1,) of each cluster
    low: wp.array(dtype=wp.vec3)  # of each box: first those of the clusters, then those of each next level
    high: wp.array(dtype=wp.vec3)
    first_box: wp.array(dtype=wp.int32)  # (levels + 1,) of each level; the last level has one box


def clustered(mesh: Mesh, device: wp.Device) -> Clusters:
    """Sort a mesh's triangles into clusters. The mesh has no outliers: boxes are about float32 coordinates."""
    points, faces = mesh.unit_vertices, mesh.faces
    order = _halved_again_and_again(points[faces].mean(axis=1))
    numbers, corners, first_point = _vertices_of_clusters(faces[order])
    low, high, first_box = _boxes(points[numbers], first_point)
    view = Clusters()
    view.triangles = wp.array(order, dtype=wp.int32, device=device)
    view.corners = wp.array(corners, dtype=wp.vec3ub, device=device)
    view.points = wp.array(points[numbers], dtype=wp.vec3, device=device)
    view.first_point = wp.array(first_point, dtype=wp.int32, device=device)
    view.low, view.high = (wp.array(side, dtype=wp.vec3, device=device) for side in (low, high))
    view.first_box = wp.array(first_box, dtype=wp.int32, device=device)
    return view


def _halved_again_and_again(centres: np.ndarray) -> np.ndarray:
    """(n,) int32: triangles of (n, 3) centres, cluster by cluster."""
    count, size = len(centres), int(CLUSTER)
    halvings = (-(-count // size) - 1).bit_length()
    # What is missing of 2^halvings clusters is filled up, and stays at the end.
    filled = np.full((size << halvings, 3), np.inf, np.float32)
    filled[:count] = centres
    order = np.arange(len(filled), dtype=np.int32)
    for span in (size << k for k in range(halvings, 0, -1)):
        runs = order[: -(-count // span) * span].reshape(-1, span)
        places = filled[runs]
        reach = np.where(np.isfinite(places), places, -np.inf).max(axis=1) - places.min(axis=1)
        along = np.take_along_axis(places, reach.argmax(axis=1)[:, None, None], axis=2)[..., 0]
        runs[:] = np.take_along_axis(runs, np.argpartition(along, span // 2, axis=1), axis=1)
    return order[order < count]


def _vertices_of_clusters(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The vertices of each cluster of (m, 3) faces in a row, each once.

    Returns:
        their numbers, cluster by cluster; (m, 3) uint8, the corners as places among them; (clusters + 1,) int32, where
        each cluster's begin.
    """
    size, count = int(CLUSTER), len(faces)
    filled = np.concatenate([faces, np.repeat(faces[-1:], -count % size, axis=0)]).reshape(-1, 3 * size)
    by_number = np.argsort(filled, axis=1, kind="stable")
    numbers = np.take_along_axis(filled, by_number, axis=1)
    is_first = np.diff(numbers, axis=1, prepend=-1) != 0
    places = np.cumsum(is_first, axis=1) - 1
    corners = np.empty(filled.shape, np.uint8)
    np.put_along_axis(corners, by_number, places.astype(np.uint8), axis=1)
    first = np.concatenate([[0], np.cumsum(places[:, -1] + 1)]).astype(np.int32)
    return numbers[is_first], corners.reshape(-1, 3)[:count], first


def _boxes(points: np.ndarray, first_point: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(boxes, 3) low and high corners of the boxes of all levels, and (levels + 1,) int32 where each level begins."""
    lows = [np.minimum.reduceat(points, first_point[:-1])]
    highs = [np.maximum.reduceat(points, first_point[:-1])]
    while len(lows[-1]) > 1:
        begin = np.arange(0, len(lows[-1]), int(CHILDREN))
        lows.append(np.minimum.reduceat(lows[-1], begin))
        highs.append(np.maximum.reduceat(highs[-1], begin))
    first = np.cumsum([0, *map(len, lows)]).astype(np.int32)
    return np.concatenate(lows), np.concatenate(highs), first
