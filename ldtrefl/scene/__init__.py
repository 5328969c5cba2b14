"""What a scene file says: camera, environment, lights and objects, their meshes and materials, and procedural shapes.

Imports ``base``, ``files``, ``device`` and ``geometry``. Start with ``description.py``; ``readers/`` reads mesh files.
"""
