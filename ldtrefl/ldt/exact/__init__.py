"""The exact search: rays go down a tree over a mesh's triangles, or over patches where triangles are finer than texels.

Start with ``tree.py``. Then ``build.py`` makes a tree, and ``walk.py`` with ``rays.h`` sends rays down it.
"""
