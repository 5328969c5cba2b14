"""What methods share that move vertices to where a mirror shows them, and draw the triangles between them.

    vertex -> VirtualVertex (``vertex.py``) -> drawn at the reflector's pixels (``raster.py``) -> hits (``image.py``)

A method finds the virtual vertices; all else is here. Start with ``image.py``.
"""
