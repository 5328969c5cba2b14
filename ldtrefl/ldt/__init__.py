"""Layered depth textures: a mesh peeled into six maps with every surface, and the searches for a ray in them.

Imports ``tracing`` and what is below it. Start with ``texture.py``; ``fragments.py``, ``texel_sort.py`` and ``maps.py``
show how maps are made. Then read ``exact/`` (our search) or ``linear/`` (the paper's).
"""
