"""The few triangles that lie far outside a mesh's bulk: a stray vertex, dust, a ground without end.

Float32 resolves a ten-millionth of the unit cube. If a few outliers make a mesh's box a thousand times larger, what
people look at would be resolved a thousand times more coarsely. So the unit cube is put about the *bulk*, which is the
mesh without its outliers. These are few enough to be tested one by one in float64 (``world/outliers.py``).
"""

from __future__ import annotations

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.device.bins import CHUNK, chunk_count, launch_chunks
from ldtrefl.geometry.vectors import high_side, low_side

SAMPLES = 1024
"""Triangles, evenly chosen, whose first corners tell how far the bulk reaches."""

TAIL = 0.05
"""Share of the samples left out at either end along each axis."""

FAR_LARGER = 32.0
"""The mesh's box must be this many times as long as the samples' for the mesh to have outliers. Below it float32
resolves at least four millionths of the bulk all the same."""

FARTHEST = 1e12
"""If the mesh's box is this many times as long, the bulk is too small to be seen beside its outliers: a coordinate is
damaged, and the mesh counts as one without outliers."""

REACH = 2.0
"""How far from the samples' middle the bulk may reach along each axis, in lengths of their box's longest side."""

MOST_OUTLIERS = 64
"""The most outliers that a mesh may have, since they are tested one by one. With more triangles outside it has none."""

NOWHERE = wp.constant(wp.float64(np.inf))
"""The low side of a box about nothing; its high side is the negative."""


@launch.kernel
def measure_inside(
    first: int,
    # In:
    vertices: wp.array(dtype=wp.vec3d),
    faces: wp.array(dtype=wp.vec3i),
    middle: wp.vec3d,
    reach: wp.float64,  # from the middle, along each axis
    # Out, per chunk of triangles:
    outside_out: wp.array(dtype=wp.int32),  # those with a corner farther away
    low_out: wp.array(dtype=wp.vec3d),  # the box about the others
    high_out: wp.array(dtype=wp.vec3d),
):
    """Count the triangles of one chunk that lie outside, and find the box about the others."""
    chunk = first + wp.tid()
    begin = CHUNK * chunk
    outside = int(0)
    low, high = wp.vec3d(NOWHERE), wp.vec3d(-NOWHERE)
    for triangle in range(begin, wp.min(begin + CHUNK, faces.shape[0])):
        corners = faces[triangle]
        a, b, c = vertices[corners[0]], vertices[corners[1]], vertices[corners[2]]
        away = high_side(high_side(wp.abs(a - middle), wp.abs(b - middle)), wp.abs(c - middle))
        if away[0] > reach or away[1] > reach or away[2] > reach:
            outside += 1
        else:
            low = low_side(low_side(low_side(low, a), b), c)
            high = high_side(high_side(high_side(high, a), b), c)
    outside_out[chunk] = outside
    low_out[chunk] = low
    high_out[chunk] = high


def split_outliers(vertices: np.ndarray, faces: np.ndarray, bounds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The few triangles that lie far outside where nearly all others are, and the box about the others.

    Args:
        vertices: (n, 3) float64.
        faces: (m, 3) int32.
        bounds: (2, 3), the box about all.

    Returns:
        (k,) int32, the triangles' numbers in order; (2, 3) float64, ``bounds`` itself if there are none.
    """
    none = np.zeros(0, np.int32), bounds
    sampled = np.sort(vertices[faces[:: max(1, len(faces) // SAMPLES), 0]].T.copy(), axis=1)
    tail = int(TAIL * sampled.shape[1])
    low, high = sampled[:, tail], sampled[:, -1 - tail]
    side, longest = float((high - low).max()), float((bounds[1] - bounds[0]).max())
    if not 0.0 < FAR_LARGER * side < longest < FARTHEST * side:
        return none
    middle, reach = low + (high - low) / 2.0, REACH * side
    outside, box = _inside(vertices, faces, middle, reach)
    if not 0 < outside.sum() <= min(MOST_OUTLIERS, len(faces) - 1):
        return none
    begin = int(CHUNK) * np.flatnonzero(outside)
    near = (begin[:, None] + np.arange(int(CHUNK))).reshape(-1)
    near = near[near < len(faces)]
    is_outside = (np.abs(vertices[faces[near]] - middle) > reach).any(axis=(1, 2))
    box.flags.writeable = False
    return near[is_outside].astype(np.int32), box


def _inside(vertices: np.ndarray, faces: np.ndarray, middle: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
    """What :func:`measure_inside` finds: (chunks,) int32, the triangles outside; (2, 3), the box about the others."""
    cpu, chunks = launch.resolve_device("cpu"), chunk_count(len(faces))
    outside, low, high = np.empty(chunks, np.int32), np.empty((chunks, 3)), np.empty((chunks, 3))
    pairs = ((vertices, wp.vec3d), (faces, wp.vec3i), (outside, wp.int32), (low, wp.vec3d), (high, wp.vec3d))
    places, corners, *outputs = (wp.array(array, dtype=dtype, device=cpu, copy=False) for array, dtype in pairs)
    arguments = [places, corners, wp.vec3d(*middle), wp.float64(reach), *outputs]
    launch_chunks(measure_inside, len(faces), arguments, cpu)
    return outside, np.stack([low.min(axis=0), high.max(axis=0)])
