"""What shapes are made of: grids, rectangles, surfaces over two parameters, profiles turned about an axis."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ldtrefl.scene.mesh import Mesh

Surface = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Parameters in 0..1, u (columns,) and v (rows, 1) -> (rows, columns, 3) of the grid of them. What depends on one of
them alone is so computed once for each of its values."""

TOGETHER = 1 << 14
"""Triangles that are looked at together, as many as caches hold."""


def points(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """(..., 3) points of coordinates that numpy can broadcast."""
    return np.stack(np.broadcast_arrays(x, y, z), -1)


def frozen(array: np.ndarray) -> np.ndarray:
    """The same array, read-only with all that it is a view of: a mesh takes it without a copy."""
    part: np.ndarray | None = array
    while part is not None:
        part.flags.writeable = False
        part = part.base
    return array


def grid_faces(columns: int, rows: int, *, flipped: bool = False) -> np.ndarray:
    """(2 * columns * rows, 3): faces of a grid of (columns + 1) x (rows + 1) vertices, row by row; counter-clockwise
    seen from u x v, or ``flipped``, from v x u."""
    corner = np.arange(columns, dtype=np.int32) + (columns + 1) * np.arange(rows, dtype=np.int32)[:, None]
    faces = np.empty((2, rows, columns, 3), np.int32)
    for half, steps in zip(faces, ((0, 1, columns + 2), (0, columns + 2, columns + 1)), strict=True):
        for k, step in enumerate(steps):
            np.add(corner, step, out=half[:, :, 2 - k if flipped else k])
    return faces.reshape(-1, 3)


def without_collapsed(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """The faces without those that have two corners in one place, as at the poles of a grid."""
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    same = (a == b).all(1) | (b == c).all(1) | (c == a).all(1)
    return faces[~same]


def parametric(
    position: Surface,
    columns: int,
    rows: int,
    *,
    wrap_u: bool = False,
    wrap_v: bool = False,
    flipped: bool = False,
    normal: Surface | None = None,
) -> Mesh:
    """A surface over (u, v), with (u, v) as its texture coordinates.

    Args:
        position: where a point of the surface is.
        columns: segments along u.
        rows: segments along v.
        wrap_u: the surface closes along u. Both sides of the seam are computed from the same u, so they match.
        wrap_v: the same along v.
        flipped: its outer side is that of v x u, not of u x v.
        normal: the vertex normals; without it they are made from the triangles.
    """
    i, j = np.arange(columns + 1), np.arange(rows + 1)[:, None]
    u = (i % columns if wrap_u else i) / columns
    v = (j % rows if wrap_v else j) / rows
    grid = position(u, v)
    vertices, faces = grid.reshape(-1, 3), grid_faces(columns, rows, flipped=flipped)
    if _has_doubled(grid):
        faces = without_collapsed(vertices, faces)
    uvs = np.stack(np.broadcast_arrays(i / columns, j / rows), -1).reshape(-1, 2)
    normals = None if normal is None else normal(u, v).reshape(-1, 3)
    return Mesh(frozen(vertices), frozen(faces), normals, frozen(uvs.astype(np.float32)))


def _has_doubled(grid: np.ndarray) -> bool:
    """Whether neighbours of a (rows, columns, 3) grid of vertices, diagonal ones of ``grid_faces``, too, are equal."""
    pairs = ((grid[:, 1:], grid[:, :-1]), (grid[1:], grid[:-1]), (grid[1:, 1:], grid[:-1, :-1]))
    return any(bool((a == b).all(axis=-1).any()) for a, b in pairs)


def revolved(profile: np.ndarray, around: int) -> Mesh:
    """A profile of (radius, z) points, (n, 2), turned about z in ``around`` segments."""
    rows = len(profile) - 1

    def position(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        radius, height = np.moveaxis(profile[np.round(v * rows).astype(int)], -1, 0)
        return points(radius * np.cos(2 * np.pi * u), radius * np.sin(2 * np.pi * u), height)

    return parametric(position, around, rows, wrap_u=True)


def rectangle(corners: Sequence[Sequence[float] | np.ndarray], segments: int) -> Mesh:
    """A flat quadrilateral, corners counter-clockwise from the texture's lower left, with its facet normal."""
    a, b, c, d = np.array(corners, float)
    s = np.linspace(0.0, 1.0, segments + 1)
    # Weights of (1 - s, s) form give bit-equal points along a shared edge whichever way it is walked.
    u, v = (x.reshape(-1, 1) for x in np.meshgrid(s, s))
    ur, vr = (x.reshape(-1, 1) for x in np.meshgrid(s[::-1], s[::-1]))
    vertices = vr * (ur * a + u * b) + v * (ur * d + u * c)
    normal = np.cross(b - a, d - a)
    normals = np.tile(normal / np.linalg.norm(normal), (len(vertices), 1))
    return Mesh(vertices, grid_faces(segments, segments), normals, np.hstack([u, v]))


def box_sides(segments: int, *, inwards: bool = False) -> list[Mesh]:
    """The six sides of the box from -1 to 1, textures upright on the four that stand."""
    x, y, z = np.eye(3)
    sides = []
    for out, right, up in ((x, y, z), (-x, -y, z), (y, -x, z), (-y, x, z), (z, x, y), (-z, -x, y)):
        across = -right if inwards else right
        corners = [out + s * across + t * up for s, t in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        sides.append(rectangle(corners, segments))
    return sides


def joined(*meshes: Mesh) -> Mesh:
    """One mesh of all, their vertices and triangles one after the other."""
    offsets = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes[:-1]])
    with_uvs = all(mesh.uvs is not None for mesh in meshes)
    return Mesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([mesh.faces + offset for mesh, offset in zip(meshes, offsets, strict=True)]),
        np.concatenate([mesh.normals for mesh in meshes]),
        np.concatenate([mesh.uvs for mesh in meshes if mesh.uvs is not None]) if with_uvs else None,
    )


def fitted(mesh: Mesh) -> Mesh:
    """The mesh moved and scaled so that its longest side runs from -1 to 1. Normals are kept, and not made."""
    centre, half = mesh.unit_frame
    return Mesh(frozen((mesh.vertices - centre) / half), mesh.faces, mesh.stored_normals, mesh.uvs)


def outwards(mesh: Mesh) -> Mesh:
    """The mesh wound so that its volume is positive."""
    if signed_volume(mesh.vertices, mesh.faces) >= 0:
        return mesh
    return Mesh(mesh.vertices, frozen(np.ascontiguousarray(mesh.faces[:, ::-1])), None, mesh.uvs)


def signed_volume(vertices: np.ndarray, faces: np.ndarray) -> float:
    """The volume of a closed mesh, positive if its triangles are counter-clockwise seen from outside."""
    coordinates, volume = np.ascontiguousarray(vertices.T, float), 0.0
    for first in range(0, len(faces), TOGETHER):
        a, b, c = (coordinates[:, corner] for corner in faces[first : first + TOGETHER].T)
        across = b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]
        volume += float((a[0] * across[0] + a[1] * across[1] + a[2] * across[2]).sum())
    return volume / 6.0
