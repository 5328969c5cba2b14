"""What methods share that move vertices to where a mirror shows them, and draw the triangles between them.

    vertex -> VirtualVertex (``vertex.py``) -> drawn at the reflector's pixels (``raster.py``) -> hits (``image.py``)

Triangles may be taken to pieces on the way (``subdivision.py``). A method says where vertices are shown; its search is
here, too, as several share it: in the image (``bisector_places.py``), on a star-shaped reflector (``fermat_places.py``,
``reflection_point.py``) or in its parameters (``uv_search.py``). Start with ``image.py``.
"""
