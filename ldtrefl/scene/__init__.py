"""What a scene file says: camera, environment, lights and objects, their meshes and materials, and procedural shapes.

    description.py      the dataclasses of a scene; load.py reads them from a file, toml_text.py the TOML in it
    environment.py      what is seen where nothing is; presets/ makes sun and sky, and a studio
    placement.py        where an object stands; layout.py has all of a scene, places.py has one stand in many places,
                        standing.py on what is under it
    mesh_scene.py       a mesh file as a scene; composed.py puts objects on a stage (stages.py, with subject.py and
                        tidy.py) in soft light (studio.py) before a camera (framing.py)
    scene_text.py       a scene as the text of a scene file
    mesh.py             a triangle mesh, checked; mesh_arrays.py goes over its arrays
    shared_geometries.py  one mesh for all objects of the same file or shape
    normals.py          vertex normals, with welding.py, two_sided.py and winding.py; smoothing.py gives them to facets
    outliers.py         the few triangles far outside a mesh's bulk
    convexity.py        whether rays that leave a mesh can come back to it
    solid.py            whether backs of a mesh can be seen, with closed_check.py
    shapes/             procedural meshes, one a file
    readers/            mesh files in many formats

Imports ``base``, ``files``, ``device`` and ``geometry``. Start with ``description.py``.
"""
