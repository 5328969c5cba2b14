"""Whether a mesh that is closed as a whole shows backs of triangles: then a part of it is wound the other way.

The search past doubtful hits (``answer.h``) takes it that from outside only fronts are seen. Whether that holds is
tried with rays from all around.
"""

from __future__ import annotations

import functools

import numpy as np
import warp as wp

from ldtrefl.ldt.exact.tree import Tree
from ldtrefl.ldt.exact.walk import EXACT, GRAZING
from ldtrefl.tracing.batch import trace_in_unit_space
from ldtrefl.tracing.tracer import array_of_views

RAYS_ALL_AROUND = 4096
"""Rays that are sent."""
FEW_BACKS = 2
"""Of them, those that may meet a back in a closed mesh that is wound one way: one in 100,000 slips through."""
DISTANCE = 4.0
"""From where they are sent, unit space: well outside the cube from -1 to 1, whose corners lie at 1.7."""


def shows_backs(tree: Tree) -> bool:
    """Whether rays from all around meet backs of the surface of a tree, whose ``front`` is known."""
    device = tree.view.vertices.device
    origins, directions = _rays_all_around(str(device))
    views = array_of_views([tree.view], EXACT.view, device)
    hits = trace_in_unit_space(EXACT, views, origins, directions)
    cosine = (hits.normal * directions.numpy()).sum(axis=1)
    return int((tree.view.front * cosine > GRAZING).sum()) > FEW_BACKS


@functools.cache
def _rays_all_around(device: str) -> tuple[wp.array, wp.array]:
    """(n,) vec3 origins on a sphere about the unit cube, and (n,) vec3 unit directions into it."""
    rng = np.random.default_rng(0)
    origins = rng.normal(size=(RAYS_ALL_AROUND, 3))
    origins *= DISTANCE / np.linalg.norm(origins, axis=1, keepdims=True)
    directions = rng.uniform(-1.0, 1.0, (RAYS_ALL_AROUND, 3)) - origins
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return wp.array(origins, dtype=wp.vec3, device=device), wp.array(directions, dtype=wp.vec3, device=device)
