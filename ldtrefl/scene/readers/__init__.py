"""Mesh files in many formats, read by trimesh and checked.

    mesh_files.py       load_mesh: a file, or those in an archive -> one mesh
    archives.py         the mesh files in a file
    memory.py           how much memory reading one takes
    polygon_files.py    polygons -> triangles, in OBJ and OFF files, and ply_polygons.py in PLY files; polygons.py cuts
    pieces.py           a file -> pieces of one material each
    joining.py          pieces -> one mesh

Imports ``mesh.py`` and ``normals.py`` of its room and what is below it. Start with ``mesh_files.py``.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ldtrefl.scene.mesh import Mesh


def load_mesh(path: str | Path) -> Mesh:
    """``load_mesh`` of ``mesh_files.py``. That is imported when the first file is read: trimesh takes a quarter of a
    second, and many scenes have no mesh file."""
    from ldtrefl.scene.readers import mesh_files  # noqa: PLC0415

    return mesh_files.load_mesh(path)
