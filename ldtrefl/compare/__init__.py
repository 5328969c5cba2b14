"""How far an image is from the truth: metrics of images and of hits, and pictures of layers.

Imports ``frame``, ``ldt`` and what is below them. Start with ``metrics.py``.
"""
