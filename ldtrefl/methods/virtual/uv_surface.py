"""A reflector as f(u, v) and its derivatives, sampled in textures (Roger and Holzschuch, in French, section 3.1).

Here u is the longitude about a star-shaped reflector's point O, from 0 to 2 pi and round again, and v the angle from
the pole, from 0 to pi. Texture rows are circles of equal v, the first and the last being the poles, and columns
meridians. Points are taken from O, lengths are those of device space.

Past a pole a meridian goes on down the other side: ``f(u, -v) = f(u + pi, v)``. But at a pole itself df/du is 0: no
search finds its way by it there.
"""

from __future__ import annotations

import numpy as np
import warp as wp

from ldtrefl.base import budget
from ldtrefl.geometry.bilinear import Neighbours, bilinear_blend, neighbours_clamped, neighbours_repeating
from ldtrefl.geometry.vectors import as_double
from ldtrefl.methods.virtual.star_shape import StarShape

KEPT_BYTES = 36
"""Bytes of a sample."""

BUILD_BYTES = 450
"""Bytes that its computation takes."""

PI = wp.constant(wp.float64(np.pi))
TURN = wp.constant(wp.float64(2.0 * np.pi))


@wp.struct
class UvSurface:
    """Textures of f, df/du and df/dv."""

    centre: wp.vec3d  # O, device space
    axes: wp.mat33d  # rows: the directions of u = 0 and of u = pi / 2 on the equator, and of the pole v = 0; unit
    columns: int  # intervals from u = 0 round to it again
    rows: int  # intervals from pole to pole
    is_closed: int  # whether there is surface in all directions
    point: wp.array2d(dtype=wp.vec3)  # (rows + 1, columns): f - O; 0 where there is no surface
    du: wp.array2d(dtype=wp.vec3)
    dv: wp.array2d(dtype=wp.vec3)


@wp.struct
class UvPoint:
    """A point of the surface."""

    point: wp.vec3d  # from O
    du: wp.vec3d
    dv: wp.vec3d
    exists: int


def pole_axes(pole: np.ndarray) -> np.ndarray:
    """(3, 3) float64: ``UvSurface.axes`` with the pole in this direction."""
    up = pole / np.linalg.norm(pole)
    aside = np.cross(np.eye(3)[np.abs(up).argmin()], up)
    aside /= np.linalg.norm(aside)
    return np.stack([aside, np.cross(up, aside), up])


def sample_count(rows: int) -> int:
    """Samples of textures that have so many rows of texels, and twice as many columns."""
    return 2 * rows * (rows + 1)


def uv_surface(shape: StarShape, pole: np.ndarray, rows: int, device: wp.Device) -> UvSurface:
    """A star-shaped surface in textures of this many rows, and twice as many columns.

    Args:
        shape: the surface.
        pole: (3,) the direction of the pole, of any length.
        rows: intervals from pole to pole.
        device: where the textures are to be.

    Raises:
        InputError: it needs more memory than is allowed.
    """
    with budget.given_back():
        samples = sample_count(rows)
        budget.take(BUILD_BYTES * samples, f"textures of a mirror, {samples} samples", "resolution")
        return _sampled(shape, pole, rows, device)


def _sampled(shape: StarShape, pole: np.ndarray, rows: int, device: wp.Device) -> UvSurface:
    columns = 2 * rows
    axes = pole_axes(pole)
    u = np.arange(columns) * (2.0 * np.pi / columns)
    v = np.linspace(0.0, np.pi, rows + 1)[:, None]
    ring = np.stack([np.cos(u), np.sin(u)], axis=1) @ axes[:2]
    ring_du = np.stack([-np.sin(u), np.cos(u)], axis=1) @ axes[:2]
    sine, cosine = np.sin(v)[..., None], np.cos(v)[..., None]
    way = sine * ring + cosine * axes[2]
    way_du, way_dv = sine * ring_du, cosine * ring - sine * axes[2]
    radii, gradients = shape.radii(way.reshape(-1, 3))
    radius, gradient = radii.reshape(rows + 1, columns, 1), gradients.reshape(way.shape)
    surface = UvSurface()
    surface.centre, surface.axes = wp.vec3d(*shape.centre), wp.mat33d(*axes.ravel())
    surface.columns, surface.rows, surface.is_closed = columns, rows, int((radii > 0.0).all())
    surface.point = _texture(radius * way, device)
    # f = O + r d in direction d.
    for name, change in (("du", way_du), ("dv", way_dv)):
        along = (gradient * change).sum(axis=-1, keepdims=True)
        setattr(surface, name, _texture(along * way + radius * change, device))
    return surface


def _texture(values: np.ndarray, device: wp.Device) -> wp.array:
    return wp.array(values.astype(np.float32), dtype=wp.vec3, device=device)


@wp.func
def uv_of(surface: UvSurface, away: wp.vec3d) -> wp.vec2d:
    """(u, v) of a direction from O, of any length but 0."""
    local = surface.axes * away
    return wp.vec2d(wp.atan2(local[1], local[0]), wp.atan2(wp.length(wp.vec2d(local[0], local[1])), local[2]))


@wp.func
def blended(texture: wp.array2d(dtype=wp.vec3), x: Neighbours, y: Neighbours) -> wp.vec3d:
    """The bilinear mean of a texture."""
    a, b = texture[y.before, x.before], texture[y.before, x.after]
    c, d = texture[y.after, x.before], texture[y.after, x.after]
    return as_double(bilinear_blend(x, y, a, b, c, d))


@wp.func
def is_surface(surface: UvSurface, row: int, column: int) -> bool:
    """Whether a sample is of the surface."""
    return wp.length_sq(surface.point[row, column]) > 0.0


@wp.func
def uv_point(surface: UvSurface, uv: wp.vec2d) -> UvPoint:
    """The bilinear mean of the textures at any finite (u, v); nothing unless all four samples are of the surface."""
    u = uv[0]
    v = uv[1] - TURN * wp.floor(uv[1] / TURN)
    down = wp.float64(1.0)
    if v > PI:
        u += PI
        v = TURN - v
        down = -down
    u = u - TURN * wp.floor(u / TURN)
    x = neighbours_repeating(float(u / TURN * wp.float64(surface.columns)), surface.columns)
    y = neighbours_clamped(float(v / PI * wp.float64(surface.rows)), surface.rows + 1)
    found = UvPoint()
    if is_surface(surface, y.before, x.before) and is_surface(surface, y.before, x.after):
        if is_surface(surface, y.after, x.before) and is_surface(surface, y.after, x.after):
            found.exists = 1
            found.point = blended(surface.point, x, y)
            found.du = blended(surface.du, x, y)
            found.dv = down * blended(surface.dv, x, y)
    return found
