"""The scene on the device: meshes, placed objects, materials, lights and the camera, as kernels read them.

    device_scene.py     all of it
    records.py          the structs that kernels read, and the three spaces
    device_space.py     device space; bounding_spheres.py of the objects in it
    device_object.py    an object as the host sees it; object_records.py fills in what kernels read
    device_mesh.py      a mesh's arrays; outliers.py its triangles that are tested in float64; clusters.py for those who
                        draw it many times
    triangle_numbers.py numbers that lead back to a triangle of any object
    appearance.py       colours and textures
    looks.py            materials of files; hidden_backs.py the sides of them that are not there
    lighting.py         lights and environment; environment_frame.py how that stands in the world
    camera.py           the camera as kernels see it
    unit_rays.py        rays in an object's own space

Imports ``scene`` and what is below it. Start with ``device_scene.py``.
"""
