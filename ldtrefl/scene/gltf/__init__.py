"""glTF 2.0, read whole: files ending in ``.gltf`` and ``.glb``.

asset.py        what a file holds: meshes, lights and cameras where its nodes place them. Start here
container.py    the JSON, and the bytes that it names
accessors.py    typed arrays in those bytes
primitives.py   triangles and what their vertices have; draco.py and meshopt.py unpack what is compressed
nodes.py        where nodes stand; skins.py poses what joints move
materials.py    materials and textures
lights.py       lights and cameras
extensions.py   which extensions are read
"""
