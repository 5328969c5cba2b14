"""Layered depth textures: a mesh peeled into six maps with every surface, and the searches for a ray in them.

Imports ``tracing`` and what is below it. Start with ``texture.py``, then ``exact/`` (our search) or ``linear/`` (the
paper's).
"""
