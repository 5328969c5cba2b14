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

LANES = 8
"""Boxes in a node, and points in a group, which are looked at together."""


@wp.struct
class Clusters:
    """The clusters of a mesh, as native code reads them (``instance_boxes.h``, ``cluster_triangles.h``)."""

    triangles: wp.array(dtype=wp.int32)  # numbers in the mesh, cluster by cluster
    corners: wp.array(
        dtype=wp.uint8
    )  # of each cluster the triangles' first, second and third, as places among its points
    points: wp.array(dtype=wp.float32)  # vertices in groups of eight: their x, their y, their z
    first_group: wp.array(dtype=wp.int32)  # (clusters + 1,) of each cluster
    boxes: wp.array(dtype=wp.float32)  # of each node eight: low x, y, z, then high x, y, z; nodes of level 1 first
    first_node: wp.array(dtype=wp.int32)  # (levels + 1,) of level 1, of level 2, ...; the last level has one node


def clustered(mesh: Mesh, device: wp.Device) -> Clusters:
    """Sort a mesh's triangles into clusters. The mesh has no outliers: boxes are about float32 coordinates."""
    points, faces = mesh.unit_vertices, mesh.faces
    order = _halved_again_and_again(points[faces].mean(axis=1))
    numbers, corners, first_point = _vertices_of_clusters(faces[order])
    boxes, first_node = _boxes(points[numbers], first_point)
    grouped, first_group = _in_groups(points[numbers], first_point)
    view = Clusters()
    view.triangles = wp.array(order, dtype=wp.int32, device=device)
    view.corners = wp.array(corners.reshape(-1), dtype=wp.uint8, device=device)
    view.points = wp.array(grouped.reshape(-1), dtype=wp.float32, device=device)
    view.first_group = wp.array(first_group, dtype=wp.int32, device=device)
    view.boxes = wp.array(boxes.reshape(-1), dtype=wp.float32, device=device)
    view.first_node = wp.array(first_node, dtype=wp.int32, device=device)
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
        their numbers, cluster by cluster; (clusters, 3, CLUSTER) uint8, the triangles' corners as places among them,
        the last cluster filled up with its last triangle; (clusters + 1,) int32, where each cluster's vertices begin.
    """
    size = int(CLUSTER)
    filled = np.concatenate([faces, np.repeat(faces[-1:], -len(faces) % size, axis=0)]).reshape(-1, 3 * size)
    by_number = np.argsort(filled, axis=1, kind="stable")
    numbers = np.take_along_axis(filled, by_number, axis=1)
    is_first = np.diff(numbers, axis=1, prepend=-1) != 0
    places = np.cumsum(is_first, axis=1) - 1
    corners = np.empty(filled.shape, np.uint8)
    np.put_along_axis(corners, by_number, places.astype(np.uint8), axis=1)
    first = np.concatenate([[0], np.cumsum(places[:, -1] + 1)]).astype(np.int32)
    return numbers[is_first], np.ascontiguousarray(corners.reshape(-1, size, 3).transpose(0, 2, 1)), first


def _in_groups(points: np.ndarray, first_point: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(groups, 3, 8) the points of each cluster in groups of eight, and (clusters + 1,) int32 where each one's begin.
    The last group of a cluster is filled up with its last point."""
    counts = np.diff(first_point)
    groups = -(-counts // LANES)
    first_group = np.concatenate([[0], np.cumsum(groups)])
    of_cluster = np.repeat(np.arange(len(counts)), LANES * groups)
    place = np.arange(len(of_cluster)) - LANES * first_group[of_cluster]
    taken = points[first_point[of_cluster] + np.minimum(place, counts[of_cluster] - 1)]
    return taken.reshape(-1, LANES, 3).transpose(0, 2, 1), first_group.astype(np.int32)


def _boxes(points: np.ndarray, first_point: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(nodes, 2, 3, 8) the low and high corners of the boxes in each node, and (levels + 1,) int32 where each level's
    nodes begin. The last node of a level is filled up with copies of its last box."""
    low, high = (side.reduceat(points, first_point[:-1]) for side in (np.minimum, np.maximum))
    levels: list[np.ndarray] = []
    while not levels or len(levels[-1]) > 1:
        nodes = -(-len(low) // LANES)
        inside = np.minimum(np.arange(LANES * nodes), len(low) - 1)
        boxes = np.stack([low[inside], high[inside]], axis=1).reshape(nodes, LANES, 2, 3)
        levels.append(boxes.transpose(0, 2, 3, 1))
        low, high = boxes[:, :, 0].min(axis=1), boxes[:, :, 1].max(axis=1)
    return np.concatenate(levels), np.cumsum([0, *map(len, levels)]).astype(np.int32)
