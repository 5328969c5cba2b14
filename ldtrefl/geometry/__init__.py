"""Pure functions of geometry for kernels: vectors, triangles, spheres, boxes, bilinear lookups, and two rasterisers.

Imports nothing of the package. Start with ``triangle.py``; ``fixed_raster.py`` draws maps, ``perspective_raster.py``
draws what the camera sees.
"""
