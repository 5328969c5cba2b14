"""Where a star-shaped reflector's silhouette shows what the reflector hides.

A point that goes behind the reflector is mirrored nearer and nearer to the silhouette, until its reflection and the
point itself are seen in one direction there; then it is hidden. A triangle that is partly hidden is mirrored up to the
silhouette. So its hidden corners are put on the silhouette, where they would have gone behind it.
"""

from __future__ import annotations

import warp as wp

from ldtrefl.methods.virtual.radius_map import RadiusMap, radial_point

BISECTIONS = wp.constant(16)
"""The silhouette is found to 2^-16 of the way: a hundredth of a pixel in a large image."""


@wp.func
def silhouette_point(surface: RadiusMap, eye: wp.vec3d, beyond: wp.vec3d) -> wp.vec3d:
    """The point of the surface, on the way to a point ``beyond`` that the eye does not see, where it ceases to see it.
    Positions are from O. The last point that is seen, a hair before the silhouette."""
    seen, unseen = wp.normalize(eye), wp.normalize(beyond)
    for _ in range(BISECTIONS):
        middle = wp.normalize(seen + unseen)
        at = radial_point(surface, middle)
        if wp.dot(middle - at.gradient / at.radius, eye - at.radius * middle) > wp.float64(0.0):
            seen = middle
        else:
            unseen = middle
    return radial_point(surface, seen).radius * seen
