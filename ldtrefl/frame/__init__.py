"""What a frame is made of: the G-buffer, reflected rays and their bounces, reflection regions, what is used again.

Imports ``tracing``, ``shading`` and what is below them. Start with ``gbuffer.py``, then ``bounces.py``, a ray's life.
"""
