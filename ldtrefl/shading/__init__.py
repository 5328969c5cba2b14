"""The radiance of a surface: lights, textures, Fresnel and the environment, the same functions for every method.

Imports ``world`` and what is below it. Start with ``surface.py``.
"""
