"""How far a frame is from the true one: metrics of images and of hits, errors by bounce, their report, and pictures of
layers.

Imports ``ldt``, ``frame`` and what is below them. Start with ``metrics/base.py``, what a metric is; a new
one is a file in ``metrics/``.
"""
