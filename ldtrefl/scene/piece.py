"""Pieces of a mesh file: runs of triangles with one material, which are joined to one mesh (``joining.py``)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ldtrefl.scene.surface_material import PLAIN, SurfaceMaterial

NEAR_UNIT = 1e-3
"""How far from 1 the length of a stored normal may be, which is then left as it is; others are made unit vectors."""

NARROWEST_SHARE = 1e-6
"""Of the largest scale of a matrix: one along another axis below this counts as none."""


@dataclass(frozen=True, eq=False)
class Piece:
    """A run of triangles with one material, in the coordinates of the file's scene."""

    vertices: np.ndarray
    """(n, 3) float64."""
    faces: np.ndarray
    """(m, 3) int64."""
    normals: np.ndarray | None
    """(n, 3) float64, as stored; 0 where the facet's count; None for smooth ones, which are still to be made."""
    uvs: np.ndarray | None
    """(n, 2) float32 texture coordinates, v = 0 at the bottom; None without any that can be used."""
    material: SurfaceMaterial = PLAIN
    second_uvs: np.ndarray | None = None
    """(n, 2) float32 other texture coordinates."""
    colors: np.ndarray | None = None
    """(n, 4) float32, linear, with alpha."""
    tangents: np.ndarray | None = None
    """(n, 4) float64: the way of u along the surface, and the sign of the bitangent."""
    continues: bool = False
    """Whether it is of one surface with the piece before it: smooth normals do not end at their border."""


def unit_vectors(stored: np.ndarray) -> np.ndarray:
    """(n, 3 or more) float64, the first three of each row as a unit vector.

    What is not finite becomes 0, which means undefined. What is near unit length is left as it is.
    """
    made = np.array(stored, np.float64)
    made[~np.isfinite(made).all(axis=1)] = 0.0
    lengths = np.sqrt(np.einsum("ij,ij->i", made[:, :3], made[:, :3]))
    is_far_from_unit = (np.abs(lengths - 1.0) > NEAR_UNIT) & (lengths > 0.0)
    made[is_far_from_unit, :3] /= lengths[is_far_from_unit, None]
    return made


def axes_left(linear: np.ndarray) -> int:
    """Along how many axes a (3, 3) matrix leaves things a size: 3 for a body, 2 if it flattens them."""
    sizes = np.linalg.svd(linear, compute_uv=False)
    return int((sizes > NARROWEST_SHARE * sizes[0]).sum())


def moved(piece: Piece, matrix: np.ndarray) -> Piece:
    """The piece moved by a (4, 4) matrix: normals by the inverse transpose, and faces turned if it mirrors.

    Of what the matrix flattens the facets' normals count: those of a ball's two halves would cancel at its rim.
    """
    if np.array_equal(matrix, np.eye(4)):
        return piece
    linear = matrix[:3, :3]
    vertices = np.einsum("ni,ki->nk", piece.vertices, linear) + matrix[:3, 3]
    # The determinant times the inverse transpose: it exists when the inverse does not.
    cofactors = np.cross(linear[[1, 2, 0]], linear[[2, 0, 1]])
    mirrors = float((linear[0] * cofactors[0]).sum()) < 0.0
    normals, tangents = piece.normals, piece.tangents
    if normals is not None:
        normals = unit_vectors(np.einsum("ni,ki->nk", normals, -cofactors if mirrors else cofactors))
    if tangents is not None:
        turned = np.einsum("ni,ki->nk", tangents[:, :3], linear)
        tangents = unit_vectors(np.hstack([turned, -tangents[:, 3:] if mirrors else tangents[:, 3:]]))
    if normals is not None and np.isfinite(linear).all() and axes_left(linear) < 3:
        normals, tangents = np.zeros(normals.shape), None
    faces = piece.faces[:, ::-1] if mirrors else piece.faces
    return replace(piece, vertices=vertices, faces=faces, normals=normals, tangents=tangents)
