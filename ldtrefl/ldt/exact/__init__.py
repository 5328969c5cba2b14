"""The exact search: a tree over triangles, or over patches of the maps. Start with ``tree.py``, then ``walk.py``."""
