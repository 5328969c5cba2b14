"""Numbers that lead back to a triangle of any object, in 31 bits.

All objects' triangles are numbered one after another. Where they are too many for that, a number stands for a *group*
of 2, 4, 8, ... triangles that follow each other in one object: a hundred thousand objects of a hundred thousand
triangles each are numbered by groups of 8.
"""

from __future__ import annotations

import numpy as np
import warp as wp

MOST_NUMBERS = (1 << 31) - 1
"""The most numbers."""


@wp.struct
class TriangleNumbers:
    """The numbers of a scene's triangles."""

    first: wp.array(dtype=wp.int32)  # of each object's first group
    shift: int  # a group has 1 << shift triangles


@wp.func
def number_of(numbers: TriangleNumbers, index: int, triangle: int) -> int:
    """The number of an object's triangle."""
    return numbers.first[index] + (triangle >> numbers.shift)


@wp.func
def object_of(numbers: TriangleNumbers, number: int) -> int:
    """The object that holds the triangle of this number, by bisection."""
    low = int(0)
    high = numbers.first.shape[0]
    while high - low > 1:
        middle = (low + high) / 2
        if numbers.first[middle] <= number:
            low = middle
        else:
            high = middle
    return low


@wp.func
def has_number(numbers: TriangleNumbers, index: int, number: int) -> bool:
    """Whether a number belongs to object ``index``, -1 for none."""
    if index < 0 or number < numbers.first[index]:
        return False
    return index + 1 == numbers.first.shape[0] or number < numbers.first[index + 1]


@wp.func
def first_triangle_of(numbers: TriangleNumbers, index: int, number: int) -> int:
    """The first triangle of an object that has this number."""
    return (number - numbers.first[index]) << numbers.shift


def numbered(counts: np.ndarray, device: wp.Device) -> TriangleNumbers:
    """Number the triangles of objects that have so many each, (objects,) int64."""
    shift = 0
    while int((-(-counts >> shift)).sum()) > MOST_NUMBERS:
        shift += 1
    groups = -(-counts >> shift)
    made = TriangleNumbers()
    made.first = wp.array((np.cumsum(groups) - groups).astype(np.int32), dtype=wp.int32, device=device)
    made.shift = shift
    return made
