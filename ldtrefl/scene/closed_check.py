"""Whether a mesh is closed and wound one way: others have no inside."""

from __future__ import annotations

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.scene.welding import first_of_equals, mixed

AT_ONCE = wp.constant(4096)
"""Triangles whose edges one item adds up."""


@wp.func
def edge(begin: wp.uint64, end: wp.uint64):
    """A hash of an edge that runs from one vertex to another."""
    return mixed(begin << wp.uint64(32), end)


@launch.kernel
def add_up_edges(
    first: int,
    # In:
    faces: wp.array(dtype=wp.vec3i),
    firsts: wp.array(dtype=wp.int32),  # the vertex that stands for each; empty: each for itself
    # Out:
    left_over_out: wp.array(dtype=wp.uint64),
):
    """Add up the hashes of the edges of some triangles: those of the way that each runs, less those of the other."""
    item = first + wp.tid()
    left_over = wp.uint64(0)
    for i in range(AT_ONCE * item, wp.min(AT_ONCE * item + AT_ONCE, faces.shape[0])):
        face = faces[i]
        if firsts.shape[0] > 0:
            face = wp.vec3i(firsts[face[0]], firsts[face[1]], firsts[face[2]])
        a, b, c = wp.uint64(face[0]), wp.uint64(face[1]), wp.uint64(face[2])
        left_over += edge(a, b) - edge(b, a) + edge(b, c) - edge(c, b) + edge(c, a) - edge(a, c)
    left_over_out[item] = left_over


def is_closed(vertices: np.ndarray, faces: wp.array) -> bool:
    """Whether triangles run along every edge as often one way as the other; vertices of one place count as one.

    Then every closed way crosses the surface as often inwards as outwards. Solids in solids, solids that share an edge,
    and triangles without area are all right.

    Edges are not sorted: to each a hash is given, which is added for one way and taken off for the other. What is left
    over is not 0, but for one mesh in 2^64.

    Args:
        vertices: (n, 3) float64.
        faces: (m,) vec3i, on the CPU or a CUDA device.
    """
    if _is_balanced(faces, np.empty(0, np.int32)):
        return True
    firsts = first_of_equals(vertices)
    return firsts is not None and _is_balanced(faces, firsts)


def _is_balanced(faces: wp.array, firsts: np.ndarray) -> bool:
    """Whether nothing is left over, where ``firsts`` says which vertex stands for each; empty: each for itself."""
    count, device = -(-faces.shape[0] // AT_ONCE), faces.device
    left_over = wp.empty(count, dtype=wp.uint64, device=device)
    stands_for = wp.array(firsts, dtype=wp.int32, device=device)
    launch.launch(add_up_edges, count, [faces, stands_for, left_over], device)
    return int(np.sum(left_over.numpy(), dtype=np.uint64)) == 0
