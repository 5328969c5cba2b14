"""A round bowl, open upwards."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from ldtrefl.scene.mesh import Mesh
from ldtrefl.scene.shapes.base import Around, Flag, Segments, bytes_without_normals, shape
from ldtrefl.scene.shapes.surfaces import fitted, revolved


@shape(
    needed_bytes=lambda closed, depth, thickness, segments: bytes_without_normals(
        2 * segments[0] * _rows(closed, segments[1])
    ),
    smaller=("segments",),
    is_closed=True,
)
def bowl(
    closed: Flag = True,
    depth: Annotated[float, Field(strict=True, gt=0.05, le=1.0)] = 0.7,
    thickness: Annotated[float, Field(strict=True, gt=0.0, lt=0.5)] = 0.06,
    segments: tuple[Around, Segments] = (128, 48),
) -> Mesh:
    """A round bowl, open upwards: part of a sphere. ``closed`` gives it a wall of ``thickness``; else one sheet."""
    angle = np.arccos(1.0 - depth)
    around, down = segments
    theta = np.linspace(0.0, angle, down + 1)
    inner = np.stack([np.sin(theta), -np.cos(theta)], 1)
    profile = inner[::-1]
    if closed:
        # From the outside's bottom up, half a circle over the rim, and down the inside.
        out, up = inner[-1], np.array([np.cos(angle), np.sin(angle)])
        turn = np.linspace(0.0, np.pi, 9)[1:-1, None]
        rim = out * (1.0 + thickness / 2) + thickness / 2 * (np.cos(turn) * out + np.sin(turn) * up)
        profile = np.concatenate([inner * (1.0 + thickness), rim, profile])
    mesh = revolved(profile, around)
    return fitted(mesh.with_normals(mesh.normals))


def _rows(closed: bool, segments: int) -> int:
    """Of a bowl's profile: both sides and the rim, or one side."""
    return 2 * segments + 9 if closed else segments
