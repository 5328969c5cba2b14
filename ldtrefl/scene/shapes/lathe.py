"""A solid of revolution: kettles, vases, lampshades."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from ldtrefl.scene.mesh import Mesh
from ldtrefl.scene.shapes.base import Around, Segments, bytes_without_normals, shape
from ldtrefl.scene.shapes.surfaces import fitted, revolved

FARTHEST = 1e6
"""A control point's coordinates are at most this: the mesh is fitted to the cube anyway."""

ControlPoint = tuple[
    Annotated[float, Field(strict=True, ge=0.0, le=FARTHEST)],
    Annotated[float, Field(strict=True, ge=-FARTHEST, le=FARTHEST)],
]
"""(radius, z)."""

KETTLE = ((0.0, -0.7), (0.75, -0.7), (1.0, -0.25), (0.85, 0.3), (0.4, 0.6), (0.0, 0.65))
"""The body of a kettle: convex, as is its control polygon."""


@shape(
    needed_bytes=lambda profile, segments: bytes_without_normals(2 * segments[0] * segments[1]),
    smaller=("segments",),
    is_closed=True,
)
def lathe(
    profile: Annotated[tuple[ControlPoint, ...], Field(min_length=2, max_length=256)] = KETTLE,
    segments: tuple[Around, Segments] = (128, 64),
) -> Mesh:
    """A curve turned about z, with control points (radius, z) from below upwards; segments around and along it."""
    around, along = segments
    mesh = revolved(spline(np.array(profile, float), along), around)
    return fitted(mesh.with_normals(mesh.normals))


def spline(control: np.ndarray, segments: int) -> np.ndarray:
    """A uniform cubic B-spline in the half-plane of (radius, z).

    Its curvature is continuous, and it is convex where its control polygon is. An end on the axis is crossed at a right
    angle: the polygon goes on as its mirror image there. At any other end the curve begins in the point itself.

    Args:
        control: (n, 2) control points.
        segments: of the curve, evenly over its n - 1 spans.

    Returns:
        (segments + 1, 2) points of the curve.
    """
    first, last = _beyond(control[0], control[1]), _beyond(control[-1], control[-2])
    extended = np.concatenate([[first], control, [last]])
    parameter = np.linspace(0.0, len(control) - 1.0, segments + 1)
    span = np.minimum(parameter.astype(int), len(control) - 2)
    t = parameter - span
    weights = np.stack([(1 - t) ** 3, 3 * t**3 - 6 * t**2 + 4, -3 * t**3 + 3 * t**2 + 3 * t + 1, t**3], 1) / 6.0
    curve = np.einsum("nk,nkd->nd", weights, extended[span[:, None] + np.arange(4)])
    for end in (0, -1):
        if control[end, 0] == 0.0:
            curve[end, 0] = 0.0  # it is, but for rounding, and a pole is one place
    return curve


def _beyond(end: np.ndarray, neighbour: np.ndarray) -> np.ndarray:
    """The control point that goes before the first or after the last."""
    return neighbour * [-1.0, 1.0] if end[0] == 0.0 else 2.0 * end - neighbour
