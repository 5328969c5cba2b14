"""The texel at which a reflector shows a vertex: where its normal is nearest to the bisector.

P. Estalella et al. 2006, sections 4 and 5.1. From a texel on, the best of its neighbours is gone to, those beside it
first (the crosshair), until none is better. On a convex and closed reflector there is one best texel.
"""

from __future__ import annotations

import warp as wp

from ldtrefl.geometry.vectors import as_double
from ldtrefl.methods.virtual.reflector_texture import ReflectorTexture

NOWHERE = wp.constant(wp.float64(-3.0))
"""Of texels that do not see the reflector: worse than any other."""


@wp.func
def agreement(texture: ReflectorTexture, texel: int, eye: wp.vec3d, vertex: wp.vec3d) -> wp.float64:
    """How well a texel's normal agrees with the bisector of the ways to the eye and to a vertex: 0 at its reflection
    point, and else less. It grows as the paper's dot product N . B does, of which rounding leaves nothing near 1."""
    if texture.object[texel] < 0:
        return NOWHERE
    point, one = texture.position[texel], wp.float64(1.0)
    bisector = wp.normalize(wp.normalize(eye - point) + wp.normalize(vertex - point))
    normal = as_double(texture.normal[texel])
    cosine = wp.dot(bisector, normal)
    if cosine <= wp.float64(0.0):
        return cosine - one
    return -wp.length_sq(wp.cross(bisector, normal))


@wp.struct
class FoundTexel:
    """Where a search has ended."""

    texel: int
    steps: int  # neighbourhoods that were looked at


@wp.func
def beside(texture: ReflectorTexture, texel: int, number: int) -> int:
    """Neighbour ``number`` of a texel, from 0 to 7, those of the crosshair first; -1 beyond the border."""
    x, y = texel % texture.width, texel / texture.width
    across, down = int(0), int(0)
    if number < 4:
        across = wp.where(number == 0, 1, wp.where(number == 1, -1, 0))
        down = wp.where(number == 2, 1, wp.where(number == 3, -1, 0))
    else:
        across = wp.where(number % 2 == 0, 1, -1)
        down = wp.where(number < 6, 1, -1)
    x += across
    y += down
    if x < 0 or y < 0 or x >= texture.width or y >= texture.height:
        return -1
    return y * texture.width + x


@wp.func
def search_texel(texture: ReflectorTexture, start: int, eye: wp.vec3d, vertex: wp.vec3d) -> FoundTexel:
    """Search for the texel that agrees best from ``start`` on, which must see the reflector."""
    found = FoundTexel()
    found.texel = start
    best = agreement(texture, start, eye, vertex)
    most, centre = 4 * (texture.width + texture.height), int(-1)
    while found.texel != centre and found.steps < most:
        found.steps += 1
        centre = found.texel
        for half in range(2):
            if found.texel == centre:
                for number in range(4 * half, 4 * half + 4):
                    other = beside(texture, centre, number)
                    if other >= 0:
                        value = agreement(texture, other, eye, vertex)
                        if value > best:
                            best = value
                            found.texel = other
    return found
