"""How much of a light's radiance reaches a small surface that sees all of it: its form factor, in closed form.

A white diffuse surface scatters the form factor times the light's radiance. What lies below its horizon does not count.
Unit vectors throughout; ``offset`` is the way from the surface to the middle of the light.
"""

from __future__ import annotations

import warp as wp

from ldtrefl.geometry.vectors import as_double


@wp.func
def sphere_form_factor(cosine: float, sine_squared: float) -> float:
    """Of a sphere whose middle is seen at an angle to the normal, and whose edge at another from the middle.

    S. Lagarde, C. de Rousiers, "Moving Frostbite to Physically Based Rendering" (2014), 4.7.2.1.

    Args:
        cosine: of the angle between normal and middle.
        sine_squared: of the angle between middle and edge.
    """
    if cosine * cosine >= sine_squared:  # wholly above the horizon, or below
        return wp.max(cosine, 0.0) * sine_squared
    sine = wp.sqrt(1.0 - cosine * cosine)
    x = wp.sqrt(1.0 / sine_squared - 1.0)
    y = -x * cosine / sine
    height = sine * wp.sqrt(1.0 - y * y)
    return wp.max((cosine * wp.acos(y) - x * height) * sine_squared + wp.atan2(height, x), 0.0) / wp.PI


@wp.func
def of_edge(a: wp.vec3d, b: wp.vec3d, normal: wp.vec3d) -> wp.float64:
    """What an edge from a to b, as seen from 0, adds to 2 pi times the form factor of a polygon."""
    aside = wp.cross(b, a)
    length = wp.length(aside)
    if length == wp.float64(0.0):
        return length
    return wp.atan2(length, wp.dot(a, b)) * wp.dot(aside, normal) / length


@wp.func
def rectangle_form_factor(offset: wp.vec3, right: wp.vec3, up: wp.vec3, normal: wp.vec3) -> float:
    """Of a rectangle that shines along ``right x up``, its half sides; of its back it is 0.

    J. H. Lambert, "Photometria" (1760), as D. R. Baum, H. E. Rushmeier and J. M. Winget have it ("Improving radiosity
    solutions through the use of analytically determined form-factors", 1989): each edge adds the angle that it is seen
    under, times the cosine of its plane. In float64, as edges of a small light cancel almost out.
    """
    middle, to_right, to_top, facing = as_double(offset), as_double(right), as_double(up), as_double(normal)
    zero = wp.float64(0.0)
    if wp.dot(middle, wp.cross(to_right, to_top)) >= zero:
        return 0.0
    total = wp.float64(0.0)
    a = middle - to_right - to_top
    # Where the outline goes below the horizon, and comes up again.
    leaves, enters = wp.vec3d(zero), wp.vec3d(zero)
    for k in range(1, 5):
        b = middle + wp.where(k == 1 or k == 2, to_right, -to_right) + wp.where(k == 2 or k == 3, to_top, -to_top)
        height_a, height_b = wp.dot(a, facing), wp.dot(b, facing)
        begin, end = a, b
        if (height_a < zero) != (height_b < zero):
            crossing = a + (height_a / (height_a - height_b)) * (b - a)
            if height_a < zero:
                enters = crossing
                begin = crossing
            else:
                leaves = crossing
                end = crossing
        if height_a >= zero or height_b >= zero:
            total += of_edge(begin, end, facing)
        a = b
    total += of_edge(leaves, enters, facing)
    return float(wp.max(total, zero)) / wp.TAU
