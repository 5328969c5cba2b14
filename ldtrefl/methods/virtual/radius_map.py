"""A star-shaped surface as a cube map: the radius r in every direction u from O, and its gradient.

The surface is ``P(u) = O + r(u) u`` with a unit direction u. The gradient of r is taken on the unit sphere: a vector
at right angles to u. As Roger and Holzschuch (2006) store them, r and its gradient are one vec4 (section 3.3.2), and
the map is a cube map, as they recommend (section 3.3.7).

Values stand at the *nodes* of a grid on each face, those on the borders of a face being its neighbours', too: so what
is interpolated has no seams. Face 2 a looks along +a, face 2 a + 1 along -a; its columns go along axis a + 1, its rows
along axis a + 2, from -1 to 1, axes counted round.
"""

from __future__ import annotations

import numpy as np
import warp as wp


@wp.struct
class RadiusMap:
    """r and its gradient over directions from O."""

    centre: wp.vec3d  # O, device space
    intervals: int  # along a side of a face, which has one node more
    values: wp.array(dtype=wp.vec4)  # (r, gradient) face by face, row by row; r is 0 where there is no surface
    beyond: wp.array(dtype=wp.uint8)  # of each: 1 where the surface is continued beyond its rim (``rim.py``)


@wp.struct
class RadialPoint:
    """What the map has in a direction."""

    radius: wp.float64  # 0 where there is no surface
    gradient: wp.vec3d  # of the radius on the unit sphere, at right angles to the direction
    is_beyond: int  # 1 beyond the surface's rim, where it is continued


def node_directions(intervals: int) -> np.ndarray:
    """(6 * (intervals + 1)^2, 3) float64 unit directions of the nodes, in the map's order."""
    steps = np.linspace(-1.0, 1.0, intervals + 1)
    rows, columns = np.meshgrid(steps, steps, indexing="ij")
    faces = []
    for face in range(6):
        axis = face // 2
        direction = np.empty((*rows.shape, 3))
        direction[..., axis] = 1.0 - 2.0 * (face % 2)
        direction[..., (axis + 1) % 3] = columns
        direction[..., (axis + 2) % 3] = rows
        faces.append(direction.reshape(-1, 3))
    every = np.concatenate(faces)
    return every / np.linalg.norm(every, axis=1, keepdims=True)


@wp.func
def met_radius(at: RadialPoint) -> wp.float64:
    """The radius, where a surface is met; 0 in holes, though it may be continued there."""
    return wp.where(at.is_beyond != 0, wp.float64(0.0), at.radius)


@wp.func
def radial_point(surface: RadiusMap, direction: wp.vec3d) -> RadialPoint:
    """Bilinear radius and gradient in a unit direction; nothing unless all four nodes about it are of the surface."""
    axis = int(0)
    if wp.abs(direction[1]) > wp.abs(direction[axis]):
        axis = 1
    if wp.abs(direction[2]) > wp.abs(direction[axis]):
        axis = 2
    face = 2 * axis
    if direction[axis] < wp.float64(0.0):
        face += 1
    count = surface.intervals
    to_nodes = wp.float64(0.5) * wp.float64(count)
    x = to_nodes * (direction[(axis + 1) % 3] / wp.abs(direction[axis]) + wp.float64(1.0))
    y = to_nodes * (direction[(axis + 2) % 3] / wp.abs(direction[axis]) + wp.float64(1.0))
    column, row = wp.clamp(int(x), 0, count - 1), wp.clamp(int(y), 0, count - 1)
    right, down = x - wp.float64(column), y - wp.float64(row)
    first = (face * (count + 1) + row) * (count + 1) + column
    a, b = surface.values[first], surface.values[first + 1]
    c, d = surface.values[first + count + 1], surface.values[first + count + 2]
    found = RadialPoint()
    if a[0] > 0.0 and b[0] > 0.0 and c[0] > 0.0 and d[0] > 0.0:
        left = wp.float64(1.0) - right
        upper = left * wp.vec4d(a) + right * wp.vec4d(b)
        lower = left * wp.vec4d(c) + right * wp.vec4d(d)
        mean = (wp.float64(1.0) - down) * upper + down * lower
        gradient = wp.vec3d(mean[1], mean[2], mean[3])
        found.radius = mean[0]
        beside = int(surface.beyond[first]) + int(surface.beyond[first + 1])
        beside += int(surface.beyond[first + count + 1]) + int(surface.beyond[first + count + 2])
        found.is_beyond = wp.where(beside > 0, 1, 0)
        found.gradient = gradient - wp.dot(gradient, direction) * direction
    return found
