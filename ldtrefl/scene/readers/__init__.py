"""Mesh files in many formats, read by trimesh and checked.

    mesh_files.py       load_mesh: a file, or those in an archive -> one mesh
    archives.py         the mesh files in a file
    memory.py           how much memory reading one takes
    polygon_files.py    polygons -> triangles, in OBJ and OFF files, and ply_polygons.py in PLY files; polygons.py cuts
    pieces.py           a file -> pieces of one material each
    joining.py          pieces -> one mesh

Imports ``mesh.py`` and ``normals.py`` of its room and what is below it. Start with ``mesh_files.py``.
"""
