"""Rays and where they end: what a tracer is, batches of rays, and the ray caster over a BVH, the ground truth.

Imports ``world`` and what is below it. Start with ``tracer.py``, the contract.
"""
