"""A tube about a torus knot."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from ldtrefl.scene.mesh import Mesh
from ldtrefl.scene.shapes.base import Around, Fraction, bytes_without_normals, shape
from ldtrefl.scene.shapes.surfaces import fitted, outwards, parametric, points

STEP = 1e-4
"""Of the curve's parameter, for its tangent by central differences: small enough for a curve that turns 64 times."""

FINE = 8
"""Segments to a turn from which they run the curve's way for certain."""


@shape(
    needed_bytes=lambda p, q, tube, segments: bytes_without_normals(2 * segments[0] * segments[1]),
    smaller=("segments",),
    is_closed=True,
)
def torus_knot(
    p: Annotated[int, Field(strict=True, ge=1, le=64)] = 2,
    q: Annotated[int, Field(strict=True, ge=1, le=64)] = 3,
    tube: Fraction = 0.28,
    segments: tuple[Around, Around] = (600, 80),
) -> Mesh:
    """A tube about the (p, q) knot r = 2 + cos(q t), z = sin(q t); ``tube`` is a fraction of the ring's radius 1.6."""

    def curve(t: np.ndarray) -> np.ndarray:
        r = 2.0 + np.cos(q * t)
        return points(r * np.cos(p * t), r * np.sin(p * t), -np.sin(q * t))

    def position(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        t = 2 * np.pi * u
        ahead, behind = curve(t + STEP), curve(t - STEP)
        tangent = ahead - behind
        tangent /= np.linalg.norm(tangent, axis=-1, keepdims=True)
        # A frame from the curve's position is periodic, which a Frenet frame's sign is not.
        outwards = ahead + behind
        binormal = np.cross(tangent, outwards)
        binormal /= np.linalg.norm(binormal, axis=-1, keepdims=True)
        across = np.cross(binormal, tangent)
        angle = 2 * np.pi * v[..., None]
        return curve(t) + 1.6 * tube * (np.cos(angle) * across + np.sin(angle) * binormal)

    # Along the curve and about it, against the clock seen from ahead: u x v points into the tube.
    tube_of_knot = fitted(parametric(position, *segments, wrap_u=True, wrap_v=True, flipped=True))
    # So few segments to a turn may run round the ring the other way.
    return outwards(tube_of_knot) if segments[0] < FINE * max(p, q) else tube_of_knot
