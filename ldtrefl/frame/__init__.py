"""What a frame is made of: G-buffer, reflected rays and their bounces, reflection regions, what the next frame uses.

Imports ``tracing``, ``shading`` and what is below them. Start with ``gbuffer.py``, then ``bounces.py``, a ray's life.
"""
