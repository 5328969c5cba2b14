"""The top level of a scene: a tree of spheres over its objects, so that a ray looks at few of many.

Objects are halved by their places, again and again, across the longest side of what is left; each eight that are left
make a node, and eight nodes a node of the next level, up to one root. A scene of up to eight objects is a list. When
objects have moved the spheres are made again, and the order is kept: whatever it is, each object is in the spheres
above it.

Spheres are in device space, their centres in float64: a small object is bounded as closely beside one a million times
larger as alone.
"""

from __future__ import annotations

import numpy as np
import warp as wp

from ldtrefl.device.struct_arrays import host_structs

GROUP = 8
"""Children of a node, at most."""

STACK = wp.constant(96)
"""Nodes that a search has yet to come back to, at most: seven a level of eleven levels, and the root's eight."""


@wp.struct
class TopNode:
    """A node, or an object, in a sphere about all that belongs to it."""

    centre: wp.vec3d
    radius: float
    first: int  # the first of its children, which follow one another; of an object, its number
    count: int  # of its children; 0 for an object


@wp.struct
class TopLevel:
    """The tree over all objects."""

    nodes: wp.array(dtype=TopNode)
    root: int  # the last node; -1 if there are no objects


def top_level(centres: np.ndarray, radii: np.ndarray, order: np.ndarray, device: wp.Device) -> TopLevel:
    """The tree over objects in spheres.

    Args:
        centres: (n, 3) float64.
        radii: (n,) float32.
        order: (n,) numbers of the objects, as :func:`order_of` gives them.
        device: where kernels read it.
    """
    made = TopLevel()
    count = len(radii)
    if count == 0:
        made.nodes, made.root = wp.empty(0, dtype=TopNode, device=device), -1
        return made
    levels = [(centres[order], radii[order], order, np.zeros(count, np.int64))]
    first = 0
    while len(levels) == 1 or len(levels[-1][1]) > 1:
        below = levels[-1]
        levels.append(_grouped(below[0], below[1], first))
        first += len(below[1])
    joined = [np.concatenate(arrays) for arrays in zip(*levels, strict=True)]
    array, nodes = host_structs(len(joined[1]), TopNode)
    for name, values in zip(("centre", "radius", "first", "count"), joined, strict=True):
        nodes[name][...] = values
    made.nodes, made.root = array.to(device), len(nodes) - 1
    return made


def _grouped(
    centres: np.ndarray, radii: np.ndarray, first: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Centres, radii, first children and their counts of the level above nodes, of which ``first`` is the first."""
    begins = np.arange(0, len(radii), GROUP)
    wide = radii.astype(np.float64)
    low = np.minimum.reduceat(centres - wide[:, None], begins)
    high = np.maximum.reduceat(centres + wide[:, None], begins)
    middle = low + (high - low) / 2.0
    group = np.arange(len(radii)) // GROUP
    reach = np.maximum.reduceat(np.linalg.norm(centres - middle[group], axis=1) + wide, begins)
    # Rounded up, and by more than float64's roundings on the way.
    radius = np.nextafter((reach * (1.0 + 1e-12)).astype(np.float32), np.float32(np.inf))
    return middle, radius, first + begins, np.minimum(len(radii) - begins, GROUP)


def order_of(centres: np.ndarray) -> np.ndarray:
    """(n,) the numbers of objects at (n, 3) places in an order in which each eight, 64, ... stand together."""
    order = np.arange(len(centres))
    begins = np.zeros(min(len(order), 1), np.int64)
    lengths = np.full(len(begins), len(order))
    while lengths.max(initial=0) > GROUP:
        part, placed = np.repeat(np.arange(len(begins)), lengths), centres[order]
        sides = np.maximum.reduceat(placed, begins) - np.minimum.reduceat(placed, begins)
        along = placed[np.arange(len(order)), sides.argmax(axis=1)[part]]
        order = order[np.lexsort((along, part))]
        first = _first_halves(lengths)
        lengths = np.stack([first, lengths - first], axis=1).ravel()
        lengths = lengths[lengths > 0]
        begins = np.cumsum(lengths) - lengths
    return order


def _first_halves(lengths: np.ndarray) -> np.ndarray:
    """About half of each number, in whole groups of the largest size that leaves two; all of what is one group."""
    group = GROUP ** np.floor(np.log(np.maximum(lengths - 1, 1)) / np.log(GROUP) + 1e-9).astype(np.int64)
    group = np.maximum(group, GROUP)
    half = np.maximum((lengths // 2 + group // 2) // group, 1) * group
    return np.minimum(half, lengths)
