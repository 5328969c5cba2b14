"""The Utah teapot."""

from __future__ import annotations

import numpy as np

from ldtrefl.scene.mesh import Mesh
from ldtrefl.scene.shapes.base import Segments, bytes_without_normals, shape
from ldtrefl.scene.shapes.surfaces import fitted, grid_faces, without_collapsed
from ldtrefl.scene.shapes.teapot_patches import FOURFOLD, POINTS, TWOFOLD

ON_MIRROR = 1e-12
"""Coordinates as small as this are on a mirror plane, up to rounding, where both sides must meet exactly."""


@shape(
    needed_bytes=lambda segments: bytes_without_normals(64 * segments**2),
    smaller=("segments",),
    is_closed=False,
)
def teapot(segments: Segments = 16) -> Mesh:
    """The Utah teapot from its Bezier patches, ``segments`` along a patch's edge. One sheet: lid and body are open."""
    t = np.linspace(0.0, 1.0, segments + 1)
    bernstein = np.stack([(1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3], 1)
    vertices: list[np.ndarray] = []
    faces: list[np.ndarray] = []
    uvs: list[np.ndarray] = []

    def add(patch: tuple[int, ...], mirror: tuple[int, int]) -> None:
        control = POINTS[list(patch)].reshape(4, 4, 3) * np.array([*mirror, 1.0])
        points = np.einsum("ui,vj,ijk->uvk", bernstein, bernstein, control).reshape(-1, 3)
        points[np.abs(points) < ON_MIRROR] = 0.0
        grid = grid_faces(segments, segments)
        flipped = mirror[0] * mirror[1] < 0
        whole = without_collapsed(points, grid[:, ::-1] if flipped else grid)
        faces.append(whole + sum(len(v) for v in vertices))
        vertices.append(points)
        v, u = np.meshgrid(t, t, indexing="ij")
        uvs.append(np.stack([u.reshape(-1), v.reshape(-1)], 1))

    for patch in FOURFOLD:
        for mirror in ((1, 1), (-1, 1), (-1, -1), (1, -1)):
            add(patch, mirror)
    for patch in TWOFOLD:
        for mirror in ((1, 1), (1, -1)):
            add(patch, mirror)
    mesh = Mesh(np.concatenate(vertices), np.concatenate(faces), None, np.concatenate(uvs))
    return fitted(mesh.with_normals(mesh.normals))
