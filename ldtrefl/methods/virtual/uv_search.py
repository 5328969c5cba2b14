"""The point of a reflector at which a vertex is seen: where the path from the eye to it has extremal length.

The search of D. Roger and N. Holzschuch, "Réflexions spéculaires en temps réel sur des surfaces lisses", section 3.3,
in the parameter space of f(u, v): a triangle ABC whose corners come closer to the zero of the path's gradient. Its
interpolated zero (equations 3.1 and 3.2) replaces the corner that is furthest from it.

Points are taken from O, the point inside of the reflector, in device space.
"""

from __future__ import annotations

import warp as wp

from ldtrefl.methods.virtual.uv_surface import TURN, UvPoint, UvSurface, uv_of, uv_point

NARROWEST = wp.constant(wp.float64(1.0e-3))
"""Radians between A and B, at least: with eye and vertex in one direction they would be one, and the triangle none."""

FLATTEST = wp.constant(wp.float64(0.05))
"""The height of the first triangle over its side AB, at least, over the length of AB."""

LOWEST = wp.constant(wp.float64(0.05))
"""And in radians, for A and B that are near each other."""

SMALLEST = wp.constant(wp.float64(1.0e-5))
"""A triangle whose sides are all shorter, in radians, is small: float32 textures have no more to tell."""

FLAT = wp.constant(wp.float64(1.0e-6))
"""The sine between two differences of gradients below which equation 3.2 is rounding alone."""

FURTHEST = wp.constant(wp.float64(20.0))
"""Radians within which a new point must lie: three times round, from where no search returns."""

NOWHERE = wp.constant(wp.vec2d(1.0e30, 0.0))
"""Beyond it."""

LAW = wp.constant(wp.float64(0.1))
"""The law of reflection must hold to this at the point that is found, or the search has not come near one: the part
along the surface of the sum of the unit vectors to the eye and to the vertex, which is 0 at a reflection."""


@wp.struct
class UvReflection:
    """Where a vertex is seen."""

    point: wp.vec3d  # device space
    steps: int  # new points that were computed
    is_seen: int  # 0: the search ended at no reflection, or at one that cannot be seen


@wp.struct
class PathTriangle:
    """A triangle ABC in the parameters' space, and the path's gradients at its corners."""

    a: wp.vec2d
    b: wp.vec2d
    c: wp.vec2d
    gradient_a: wp.vec2d
    gradient_b: wp.vec2d
    gradient_c: wp.vec2d
    is_on: int  # whether all three corners are of the surface
    side: wp.float64  # that the eye is on: 1, outside of what is closed; -1, inside of it; 0, of what is open


@wp.func
def outward_normal(at: UvPoint) -> wp.vec3d:
    """The unit normal away from O; 0 at a pole."""
    return wp.normalize(wp.cross(at.dv, at.du))


@wp.func
def path_gradient(at: UvPoint, eye: wp.vec3d, vertex: wp.vec3d) -> wp.vec2d:
    """(dd/du, dd/dv) of the path's length by way of a point (section 3.3.2)."""
    ways = wp.normalize(eye - at.point) + wp.normalize(vertex - at.point)
    return wp.vec2d(-wp.dot(at.du, ways), -wp.dot(at.dv, ways))


@wp.func
def determinant(a: wp.vec2d, b: wp.vec2d) -> wp.float64:
    """Of the matrix with these columns."""
    return a[0] * b[1] - a[1] * b[0]


@wp.func
def beside(u: wp.float64, reference: wp.float64) -> wp.float64:
    """The same longitude, within half a turn of another."""
    return u - TURN * wp.round((u - reference) / TURN)


@wp.func
def start_direction(surface: UvSurface, away: wp.vec3d) -> wp.vec3d:
    """Where the line from O through a point meets the surface: a unit direction. A bowl is met behind O only."""
    direction = wp.normalize(away)
    if uv_point(surface, uv_of(surface, direction)).exists == 0:
        return -direction
    return direction


@wp.func
def likely_direction(surface: UvSurface, halfway: wp.vec3d, eye: wp.vec3d, vertex: wp.vec3d) -> wp.vec3d:
    """About where a vertex is seen, from the point half way between A and B: as far on as the normal there must turn to
    halve the angle between eye and vertex. On a sphere, where normals are directions, that is a good guess."""
    at = uv_point(surface, uv_of(surface, halfway))
    normal = outward_normal(at)
    halving = wp.normalize(wp.normalize(eye - at.point) + wp.normalize(vertex - at.point))
    return halfway + wp.sign(wp.dot(normal, halving)) * halving - normal


@wp.func
def third_point(surface: UvSurface, a: wp.vec2d, b: wp.vec2d, likely: wp.vec3d) -> wp.vec2d:
    """C of section 3.3.1, in the direction where the vertex is likely to be seen, but moved so that the triangle is not
    too flat in the parameters' space."""
    half = wp.float64(0.5)
    middle, side = half * (a + b), a - b
    length = wp.length(side)
    across = wp.vec2d(-side[1], side[0]) / length
    c = middle
    if wp.length(likely) > SMALLEST:
        c = uv_of(surface, likely)
        c = wp.vec2d(beside(c[0], middle[0]), c[1])
    height = wp.dot(c - middle, across)
    least = wp.max(FLATTEST * length, LOWEST)
    if wp.abs(height) < least:
        c += (wp.where(height < wp.float64(0.0), -least, least) - height) * across
    return c


@wp.func
def first_triangle(surface: UvSurface, eye: wp.vec3d, vertex: wp.vec3d) -> PathTriangle:
    """A and B where the lines from O to the vertex and to the eye meet the surface, and C (section 3.3.1)."""
    to_vertex, to_eye = start_direction(surface, vertex), start_direction(surface, eye)
    made = PathTriangle()
    a, b = uv_of(surface, to_vertex), uv_of(surface, to_eye)
    a = wp.vec2d(beside(a[0], b[0]), a[1])
    if wp.length(a - b) < NARROWEST:
        a = b + wp.vec2d(NARROWEST, wp.float64(0.0))
    made.a = a
    made.b = b
    likely = likely_direction(surface, wp.normalize(to_vertex + to_eye), eye, vertex)
    made.c = third_point(surface, made.a, made.b, likely)
    at_a, at_b, at_c = uv_point(surface, made.a), uv_point(surface, made.b), uv_point(surface, made.c)
    made.is_on = at_a.exists * at_b.exists * at_c.exists
    made.gradient_a = path_gradient(at_a, eye, vertex)
    made.gradient_b = path_gradient(at_b, eye, vertex)
    made.gradient_c = path_gradient(at_c, eye, vertex)
    if surface.is_closed == 1:
        made.side = wp.where(wp.length(eye) > wp.length(at_b.point), wp.float64(1.0), wp.float64(-1.0))
    return made


@wp.func
def zero_of(triangle: PathTriangle) -> wp.vec2d:
    """Where the gradient, interpolated between the corners, is 0: equation 3.2 by Cramer's rule, then 3.1; ``NOWHERE``
    if the gradients do not tell."""
    by_alpha, by_beta = triangle.gradient_b - triangle.gradient_a, triangle.gradient_c - triangle.gradient_a
    divisor = determinant(by_alpha, by_beta)
    if wp.abs(divisor) <= FLAT * wp.length(by_alpha) * wp.length(by_beta):
        return NOWHERE
    alpha = determinant(-triangle.gradient_a, by_beta) / divisor
    beta = determinant(by_alpha, -triangle.gradient_a) / divisor
    return triangle.a + alpha * (triangle.b - triangle.a) + beta * (triangle.c - triangle.a)


@wp.func
def with_furthest_replaced(triangle: PathTriangle, new: wp.vec2d, gradient: wp.vec2d) -> PathTriangle:
    """The triangle with a new point in place of the corner that is furthest from it (section 3.3.2)."""
    far_a, far_b = wp.length(new - triangle.a), wp.length(new - triangle.b)
    far_c = wp.length(new - triangle.c)
    if far_a >= far_b and far_a >= far_c:
        triangle.a = new
        triangle.gradient_a = gradient
    elif far_b >= far_c:
        triangle.b = new
        triangle.gradient_b = gradient
    else:
        triangle.c = new
        triangle.gradient_c = gradient
    return triangle


@wp.func
def longest_side(triangle: PathTriangle) -> wp.float64:
    """In radians of the parameters' space."""
    ab, bc = wp.length(triangle.a - triangle.b), wp.length(triangle.b - triangle.c)
    return wp.max(wp.max(ab, bc), wp.length(triangle.c - triangle.a))


@wp.func
def reflection_at(at: UvPoint, eye: wp.vec3d, vertex: wp.vec3d, outwards: wp.float64) -> int:
    """Whether a point reflects a vertex to the eye, on the outer side (1), the inner (-1), or any side (0)."""
    none = wp.float64(0.0)
    normal = outward_normal(at)
    to_eye, to_vertex = wp.normalize(eye - at.point), wp.normalize(vertex - at.point)
    # Where the segment from eye to vertex pierces the reflector the path is shortest, too, and nothing is reflected.
    side = wp.where(outwards == none, wp.dot(normal, to_eye), outwards)
    is_before = side * wp.dot(normal, to_eye) > none and side * wp.dot(normal, to_vertex) > none
    ways = to_eye + to_vertex
    if is_before and wp.length(ways - wp.dot(ways, normal) * normal) < LAW * wp.length(ways):
        return 1
    return 0


@wp.func
def find_uv_reflection(surface: UvSurface, eye_device: wp.vec3d, vertex_device: wp.vec3d, steps: int) -> UvReflection:
    """Search for the point of a reflector at which a vertex is seen, by at most so many steps (section 3.3)."""
    eye, vertex = eye_device - surface.centre, vertex_device - surface.centre
    triangle = first_triangle(surface, eye, vertex)
    at = uv_point(surface, triangle.c)
    found = UvReflection()
    is_going = triangle.is_on == 1
    while is_going and found.steps < steps:
        new = zero_of(triangle)
        # Where equation 3.2 has no answer the last point stands: the triangle may be small and the search at its end.
        is_going = wp.length(new - triangle.b) < FURTHEST
        if is_going:
            found.steps += 1
            at = uv_point(surface, new)
            triangle = with_furthest_replaced(triangle, new, path_gradient(at, eye, vertex))
            is_going = at.exists == 1 and longest_side(triangle) > SMALLEST
    if triangle.is_on * at.exists == 1:
        found.is_seen = reflection_at(at, eye, vertex, triangle.side)
    found.point = surface.centre + at.point
    return found
