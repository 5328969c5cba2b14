"""Mesh files in many formats -> one checked mesh. ``docs/mesh_files.md`` says what is read of each, and why so.

    mesh_files.py       load_mesh: a file, or those in an archive -> one mesh
    archives.py         the mesh files in a file
    byte_order_marks.py texts in UTF-16
    files_beside.py     the files that it names; whether they have changed
    memory.py           how much memory reading one takes
    obj.py, mtl.py      OBJ files, whose text obj_text.py reads, and their materials
    ply.py, off.py, stl.py, threemf.py
                        PLY (its tables: ply_tables.py), OFF, STL and 3MF files
    trimesh_pieces.py   all other kinds, by trimesh
    pictures.py         the pictures that files name
    polygons.py         polygons -> triangles

Every reader gives pieces, which ``scene/joining.py`` joins, and what they do not show of the file, a line each.

Imports ``mesh.py`` and ``normals.py`` of its room and what is below it. Start with ``mesh_files.py``.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ldtrefl.scene.mesh import Mesh


def load_mesh(path: str | Path) -> Mesh:
    """``load_mesh`` of ``mesh_files.py``. That is imported when the first file is read: it takes a tenth of a
    second, and many scenes have no mesh file."""
    from ldtrefl.scene.readers import mesh_files  # noqa: PLC0415

    return mesh_files.load_mesh(path)
