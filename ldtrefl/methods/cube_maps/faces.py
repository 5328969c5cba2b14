"""Where things lie in a cube map, and how it is read.

Texels are numbered face by face, 0..5 = +x, -x, +y, -y, +z, -z, each row by row from the top as its camera sees it.
That camera looks along the face's axis; up is +z, or +y for the two faces of z. Beyond the border of a face its own
border goes on: neighbours on the next face are not looked at.

Beside radiance a layer may hold *nearness*, 1 / depth along its face's axis, 0 for the environment. It stands for the
distance of what the texel shows: across a plane it is linear, so that bilinear reading is exact there.
"""

from __future__ import annotations

import numpy as np
import warp as wp

from ldtrefl.geometry.bilinear import Neighbours, bilinear_blend, neighbours_clamped
from ldtrefl.scene.description import Camera

LEAST_DEPTH = wp.constant(0.5)
"""The least component that a direction is taken to have along the axis of its face. A unit vector has 0.577 or more;
the direction to what the eye touches is 0."""

STEEPEST = wp.constant(24.0)
"""Tangent of the largest angle between a surface's normal and the way to the centre, 88 degrees, at which neighbouring
texels are taken for one surface. Where they differ by more, one object ends and what is behind it begins."""


@wp.struct
class CubeLayer:
    """What a cube map shows."""

    radiance: wp.array(dtype=wp.vec3)
    nearness: wp.array(dtype=float)  # 1 / depth in device units along the face's axis; empty if nothing reads it


@wp.struct
class CubePlace:
    """A place on a cube map."""

    face: int
    columns: Neighbours
    rows: Neighbours
    depth: float  # of the unit direction along the face's axis


@wp.func
def cube_face(direction: wp.vec3) -> int:
    """The face 0..5 = +x, -x, +y, -y, +z, -z that a direction points to."""
    axis = int(0)
    if wp.abs(direction[1]) > wp.abs(direction[axis]):
        axis = 1
    if wp.abs(direction[2]) > wp.abs(direction[axis]):
        axis = 2
    if direction[axis] < 0.0:
        return 2 * axis + 1
    return 2 * axis


@wp.func
def place_in(direction: wp.vec3, resolution: int) -> CubePlace:
    """The place on a cube map that a unit direction points to."""
    at = CubePlace()
    at.face = cube_face(direction)
    # The face's camera: forward along its axis, up +z, or +y for the faces of z.
    forward = wp.vec3(0.0)
    forward[at.face / 2] = wp.where(at.face % 2 == 0, 1.0, -1.0)
    up = wp.where(at.face >= 4, wp.vec3(0.0, 1.0, 0.0), wp.vec3(0.0, 0.0, 1.0))
    right = wp.cross(forward, up)
    at.depth = wp.max(wp.dot(direction, forward), LEAST_DEPTH)
    x = 0.5 * float(resolution) * (wp.dot(direction, right) / at.depth + 1.0) - 0.5
    y = 0.5 * float(resolution) * (1.0 - wp.dot(direction, up) / at.depth) - 0.5
    at.columns = neighbours_clamped(x, resolution)
    at.rows = neighbours_clamped(y, resolution)
    return at


@wp.func
def look_up(cube: wp.array(dtype=wp.vec3), resolution: int, direction: wp.vec3) -> wp.vec3:
    """Bilinear radiance of a cube map in a unit direction."""
    at = place_in(direction, resolution)
    upper = (at.face * resolution + at.rows.before) * resolution
    lower = (at.face * resolution + at.rows.after) * resolution
    return bilinear_blend(
        at.columns,
        at.rows,
        cube[upper + at.columns.before],
        cube[upper + at.columns.after],
        cube[lower + at.columns.before],
        cube[lower + at.columns.after],
    )


@wp.func
def look_near(nearness: wp.array(dtype=float), resolution: int, direction: wp.vec3) -> float:
    """1 / distance of what a cube map shows in a unit direction; 0 for the environment.

    Bilinear within a surface; where the four texels show several, that of the nearest texel's centre.
    """
    at = place_in(direction, resolution)
    upper = (at.face * resolution + at.rows.before) * resolution
    lower = (at.face * resolution + at.rows.after) * resolution
    a, b = nearness[upper + at.columns.before], nearness[upper + at.columns.after]
    c, d = nearness[lower + at.columns.before], nearness[lower + at.columns.after]
    least, most = wp.min(wp.min(a, b), wp.min(c, d)), wp.max(wp.max(a, b), wp.max(c, d))
    if most - least <= jump_allowed(resolution) * least:
        upper_mean = (1.0 - at.columns.weight) * a + at.columns.weight * b
        lower_mean = (1.0 - at.columns.weight) * c + at.columns.weight * d
        return at.depth * ((1.0 - at.rows.weight) * upper_mean + at.rows.weight * lower_mean)
    left, right = wp.where(at.rows.weight < 0.5, a, c), wp.where(at.rows.weight < 0.5, b, d)
    return at.depth * wp.where(at.columns.weight < 0.5, left, right)


@wp.func
def of_surface(near: float, reference: float, resolution: int) -> float:
    """1 if a texel of this nearness shows the same surface as one of the other, else 0."""
    return wp.where(wp.abs(near - reference) <= jump_allowed(resolution) * wp.min(near, reference), 1.0, 0.0)


@wp.func
def look_up_surface(layer: CubeLayer, resolution: int, direction: wp.vec3) -> wp.vec3:
    """Radiance of the surface that the nearest texel's centre shows: bilinear, but for texels that show another."""
    at = place_in(direction, resolution)
    upper = (at.face * resolution + at.rows.before) * resolution
    lower = (at.face * resolution + at.rows.after) * resolution
    column = wp.where(at.columns.weight < 0.5, at.columns.before, at.columns.after)
    reference = layer.nearness[wp.where(at.rows.weight < 0.5, upper, lower) + column]
    total = float(0.0)
    radiance = wp.vec3(0.0)
    for k in range(4):
        row = wp.where(k < 2, upper, lower)
        weight = wp.where(k < 2, 1.0 - at.rows.weight, at.rows.weight)
        texel = row + wp.where(k % 2 == 0, at.columns.before, at.columns.after)
        weight *= wp.where(k % 2 == 0, 1.0 - at.columns.weight, at.columns.weight)
        weight *= of_surface(layer.nearness[texel], reference, resolution)
        radiance += weight * layer.radiance[texel]
        total += weight
    return radiance / total


@wp.func
def jump_allowed(resolution: int) -> float:
    """The share by which the nearness of one surface may differ from texel to texel."""
    return STEEPEST * 2.0 / float(resolution)


def face_axes(face: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(3,) float64 ``forward``, ``right`` and ``up`` of a face's camera."""
    forward, up = np.zeros(3), np.array((0.0, 1.0, 0.0) if face >= 4 else (0.0, 0.0, 1.0))
    forward[face // 2] = 1.0 if face % 2 == 0 else -1.0
    return forward, np.cross(forward, up), up


def face_camera(face: int, eye: np.ndarray, size: float, resolution: int) -> Camera:
    """The camera of a face in the world, which looks at a point ``size`` from ``eye``, (3,)."""
    forward, _, up = face_axes(face)
    look_at = eye + size * forward
    return Camera(
        eye=tuple(eye.tolist()),
        look_at=tuple(look_at.tolist()),
        up=tuple(up.tolist()),
        fov_y=90.0,
        width=resolution,
        height=resolution,
    )


def texel_points(face: int, resolution: int, first_row: int = 0, rows: int | None = None) -> np.ndarray:
    """(rows * resolution, 3) float32: the centres of texels at depth 1 along their face's axis, row by row."""
    forward, right, up = face_axes(face)
    end = resolution if rows is None else first_row + rows
    x = (2.0 * np.arange(resolution) + 1.0) / resolution - 1.0
    y = 1.0 - (2.0 * np.arange(first_row, end) + 1.0) / resolution
    points = forward + x[None, :, None] * right + y[:, None, None] * up
    return points.reshape(-1, 3).astype(np.float32)
