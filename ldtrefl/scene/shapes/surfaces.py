"""What shapes are made of: grids, rectangles, surfaces over two parameters, profiles turned about an axis."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ldtrefl.scene.mesh import Mesh

Surface = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Parameters u and v in 0..1, each (n,) -> (n, 3)."""


def grid_faces(columns: int, rows: int) -> np.ndarray:
    """(2 * columns * rows, 3): faces of a grid of (columns + 1) x (rows + 1) vertices, row by row; counter-clockwise
    seen from u x v."""
    u, v = np.meshgrid(np.arange(columns), np.arange(rows))
    corner = (v * (columns + 1) + u).reshape(-1)
    right, up = corner + 1, corner + columns + 1
    return np.concatenate([np.stack([corner, right, up + 1], 1), np.stack([corner, up + 1, up], 1)])


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
    normal: Surface | None = None,
) -> Mesh:
    """A surface over (u, v), with (u, v) as its texture coordinates.

    Args:
        position: where a point of the surface is.
        columns: segments along u.
        rows: segments along v.
        wrap_u: the surface closes along u. Both sides of the seam are computed from the same u, so they match.
        wrap_v: the same along v.
        normal: the vertex normals; without it they are made from the triangles.
    """
    i, j = np.meshgrid(np.arange(columns + 1), np.arange(rows + 1))
    u = (i % columns if wrap_u else i).reshape(-1) / columns
    v = (j % rows if wrap_v else j).reshape(-1) / rows
    vertices = position(u, v)
    uvs = np.stack([i.reshape(-1) / columns, j.reshape(-1) / rows], 1)
    faces = without_collapsed(vertices, grid_faces(columns, rows))
    return Mesh(vertices, faces, None if normal is None else normal(u, v), uvs)


def revolved(profile: np.ndarray, around: int) -> Mesh:
    """A profile of (radius, z) points, (n, 2), turned about z in ``around`` segments."""
    rows = len(profile) - 1

    def position(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        radius, height = profile[np.round(v * rows).astype(int)].T
        return np.stack([radius * np.cos(2 * np.pi * u), radius * np.sin(2 * np.pi * u), height], 1)

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
    return Mesh((mesh.vertices - centre) / half, mesh.faces, mesh.stored_normals, mesh.uvs)


def outwards(mesh: Mesh) -> Mesh:
    """The mesh wound so that its volume is positive."""
    if signed_volume(mesh.vertices, mesh.faces) >= 0:
        return mesh
    return Mesh(mesh.vertices, mesh.faces[:, ::-1], None, mesh.uvs)


def signed_volume(vertices: np.ndarray, faces: np.ndarray) -> float:
    """The volume of a closed mesh, positive if its triangles are counter-clockwise seen from outside."""
    a, b, c = (vertices[faces[:, i]].astype(float) for i in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0
