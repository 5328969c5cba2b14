"""Where nearly all of a mesh is, when a few triangles lie far outside: a stray vertex, dust, a ground without end.

Float32 resolves a ten-millionth of the unit cube. A mesh whose few outermost triangles make its box a thousand times
larger would be resolved to a thousandth of what people look at, so the unit cube is put about the bulk alone. What lies
outside is few enough to be tested in float64 (``strays.py``).
"""

from __future__ import annotations

import numpy as np

SAMPLES = 1024
"""Triangles that are looked at to see how far the bulk reaches."""

TAIL = 0.05
"""Share of the samples left out at either end along each axis."""

FAR_LARGER = 32.0
"""Times that the whole box must be longer than the samples' for strays to be told apart: float32 then still resolves
four millionths of the bulk without."""

FARTHEST = 1e12
"""Times from which the bulk is too small to be seen beside its outliers: a coordinate is damaged."""

REACH = 2.0
"""Of the samples' longest side, how far from their middle the bulk may go on along each axis."""

MOST_STRAYS = 64
"""Triangles outside the bulk up to which they are tested one by one. With more the mesh has no bulk."""


def stray_triangles(vertices: np.ndarray, faces: np.ndarray, bounds: np.ndarray) -> np.ndarray:
    """(k,) int32 numbers, in order, of the few triangles that lie far outside where nearly all others are.

    Args:
        vertices: (n, 3) float64.
        faces: (m, 3) vertex numbers.
        bounds: (2, 3), the box about all.
    """
    none = np.zeros(0, np.int32)
    sampled = np.sort(vertices[faces[:: max(1, len(faces) // SAMPLES), 0]], axis=0)
    tail = int(TAIL * len(sampled))
    low, high = sampled[tail], sampled[-1 - tail]
    side, longest = float((high - low).max()), float((bounds[1] - bounds[0]).max())
    if not 0.0 < FAR_LARGER * side < longest < FARTHEST * side:
        return none
    outside = (np.abs(vertices - (low + (high - low) / 2.0)) > REACH * side).any(axis=1)
    strays = np.flatnonzero(outside[faces].any(axis=1))
    return strays.astype(np.int32) if len(strays) <= MOST_STRAYS else none
