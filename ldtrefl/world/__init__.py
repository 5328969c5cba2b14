"""The scene on the device: meshes, placed objects, materials, lights and the camera, as kernels read them.

Imports ``scene`` and what is below it. Start with ``device_scene.py``.
"""
