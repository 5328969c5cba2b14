"""The brightest radiance that there is."""

from __future__ import annotations

import warp as wp

LARGEST_RADIANCE = wp.constant(1.0e30)
"""Brighter radiance is cut to this: its sums and products stay finite, and no pixel becomes infinity times 0."""

SMALLEST_SQUARE = wp.constant(1.0e-36)
"""The least squared distance that an intensity is divided by: in the surface itself that would be 0."""


@wp.func
def at_most_largest(radiance: wp.vec3) -> wp.vec3:
    """Radiance, cut to ``LARGEST_RADIANCE``."""
    return wp.min(radiance, wp.vec3(LARGEST_RADIANCE))
