"""Pure functions of geometry for kernels: vectors, triangles, spheres, and the two rasterisers.

Imports nothing of the package. Start with ``triangle.py``.
"""
