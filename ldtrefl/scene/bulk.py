"""Where nearly all of a mesh is, when a few triangles lie far outside: a lone vertex, dust, a ground without end.

Float32 resolves a ten-millionth of the unit cube. A mesh whose few outermost triangles make its box a thousand times
larger would be resolved to a thousandth of what people look at, so the unit cube is put about the bulk alone. What lies
outside is few enough to be tested in float64 (``outliers.py``).
"""

from __future__ import annotations

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.device.bins import CHUNK, chunk_count, launch_chunks
from ldtrefl.geometry.vectors import high_side, low_side

SAMPLES = 1024
"""Triangles that are looked at to see how far the bulk reaches."""

TAIL = 0.05
"""Share of the samples left out at either end along each axis."""

FAR_LARGER = 32.0
"""Times that the whole box must be longer than the samples' for outliers to be told apart: float32 then still resolves
four millionths of the bulk without."""

FARTHEST = 1e12
"""Times from which the bulk is too small to be seen beside its outliers: a coordinate is damaged."""

REACH = 2.0
"""Of the samples' longest side, how far from their middle the bulk may go on along each axis."""

MOST_OUTLIERS = 64
"""Triangles outside the bulk up to which they are tested one by one. With more the mesh has no bulk."""

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
