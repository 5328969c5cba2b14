"""A lattice of thin wires."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from ldtrefl.scene.mesh import Mesh
from ldtrefl.scene.shapes.base import Around, bytes_without_normals, shape
from ldtrefl.scene.shapes.surfaces import joined, revolved


@shape(
    needed_bytes=lambda count, radius, segments: bytes_without_normals(12 * count * segments),
    smaller=("count", "segments"),
    is_closed=True,
)
def wires(
    count: Annotated[int, Field(strict=True, ge=1, le=256)] = 8,
    radius: Annotated[float, Field(strict=True, gt=0.0, le=0.5)] = 0.01,
    segments: Around = 12,
) -> Mesh:
    """A lattice of thin closed cylinders: ``count`` along x and as many along y, one layer above the other."""
    wire = revolved(np.array([[0.0, -1.0], [radius, -1.0], [radius, 1.0], [0.0, 1.0]]), segments)
    places = np.linspace(radius - 1.0, 1.0 - radius, count) if count > 1 else np.zeros(1)
    along_x, along_y = wire.vertices[:, [2, 0, 1]], wire.vertices[:, [1, 2, 0]]
    pieces = [Mesh(along_x + np.array([0.0, place, radius]), wire.faces) for place in places]
    pieces += [Mesh(along_y + np.array([place, 0.0, -radius]), wire.faces) for place in places]
    return joined(*pieces)
