"""Where a star-shaped surface mirrors a point: D. Roger, N. Holzschuch, "Accurate Specular Reflections in Real-Time"
(2006), sections 3.3.1 to 3.3.4.

Light takes a path of extremal length (Fermat): at the reflection P of a vertex V, seen from the eye E, the gradient of
``l = EP + PV`` over the surface is 0. A secant method finds that zero. It keeps three samples (A, B, C), interpolates
their gradients linearly, goes to the point D where the interpolated gradient is smallest, and puts D in the place of
the sample with the largest gradient. What it is exact to is known at any time: the triangle of samples.

With the radius r over unit directions u from O, equation (1) reads

    grad l = (e . u) grad r + r (e - (e . u) u),   e = unit(P - E) + unit(P - V),   grad r at right angles to u.

(The paper's ``PV / PV`` in e has the sign of a vector from V to P.) Five things are not the paper's. Without them a
sixth of random points is not found, mostly those near the surface and those seen at grazing incidence:

- e is multiplied by ``EP PV / (EP + PV)``. That moves no zero. It makes gradients close to linear where the vertex is
  near the surface: over a flat mirror looked at straight on they are then the way to the reflection.
- At grazing incidence e itself vanishes, and the gradient with the cube of the distance from its zero: a secant goes a
  quarter of the way. There, that d = unit(P - E) - unit(P - V) has no part along the normal n says where the
  reflection is. So ``(d . n) d_t / 8`` is added to e, d_t being the part of d along the surface. It is 0 at
  reflections, and has the sign of the gradient wherever both E and V see the surface: no zero comes or goes there.
- A and B are the projections of V and E (section 3.3.4), each moved on the arc between them to where it sees both V
  and E, of a sphere of the radius there. On a sphere the reflection lies between these, too, and at grazing incidence
  they are next to it.
- A step is halved while it ends where there is no surface, or where the gradient is much larger than the smallest yet.
- Gradients are taken along the surface, as ``e - (e . n) n``, and not over directions by equation (1). Both vanish at
  the same points. Over directions they are stretched where the surface is seen edge-on from O.

A surface is a struct and a function that gives the ``RadialPoint`` of it in a unit direction, so that the search works
on maps and on spheres. All positions are float64, from O.
"""

from collections.abc import Callable

import warp as wp

from ldtrefl.device import launch
from ldtrefl.methods.virtual.fermat_samples import (
    HALF,
    ONE,
    ZERO,
    Sample,
    Samples,
    largest_gradient,
    residual_angle,
    sample_of,
    smallest_gradient,
    weights_of_zero,
    with_replaced,
)
from ldtrefl.methods.virtual.radius_map import RadialPoint, met_radius

LEAST_SINE = wp.constant(wp.float64(1.0e-12))
"""Squared sine of the angle between differences of gradients below which their equations are ill-conditioned: rounding
of float64 then turns the step."""

NO_SINE = wp.constant(wp.float64(1.0e-20))
"""The same while there is no discarded sample to go back to."""

ROUNDING = wp.constant(wp.float64(1.0e-12))
"""Gradients below this share of the radius are 0 but for rounding."""

LEAST_HALF = wp.constant(wp.float64(1.0e-3))
"""Half the least angle between A and B at the start."""

STRAIGHT = wp.constant(wp.float64(1.0e-9))
"""Sine of the angle between the ways to E and V below which they span no plane, and any plane will do."""

MOST_TRIES = wp.constant(6)
"""How often a step is tried, each time half as long, before it is taken as it is."""

MUCH = wp.constant(wp.float64(4.0))
"""A step is too long if the gradient is so many times the smallest yet. With 1 near ones are halved for nothing."""

EQUILATERAL = wp.constant(wp.float64(0.8660254037844386))
"""Height of an equilateral triangle of side 1."""


@wp.struct
class SearchLimits:
    """When a search ends, and what counts as found."""

    most_iterations: int
    least_area: wp.float64  # of the triangle of samples, over the square of the radius
    least_solid_angle: wp.float64  # of the triangle as seen from the eye, steradian
    most_residual: wp.float64  # radians between the mirrored view and the way to the vertex


@wp.struct
class Reflection:
    """Where a surface mirrors a vertex."""

    point: wp.vec3d  # P, from O
    normal: wp.vec3d  # of the surface at P, unit, away from O
    residual: wp.float64  # radians between the mirrored view and the way to the vertex
    iterations: int  # samples taken after the first three, and returns to discarded ones
    is_found: int  # 1 if the residual is small, and E and V are on the side of the surface that E is on
    is_hidden: int  # 1 if it is small, and both are on the other side: the surface hides V from E
    is_inside: int  # 1 if the eye is inside, or looks in through a hole


@wp.func
def is_settled(samples: Samples, eye: wp.vec3d, vertex: wp.vec3d, limits: SearchLimits) -> bool:
    """Whether a search has ended: the triangle of samples is small, and the best of them mirrors.

    The paper asks for a small area alone. A flat triangle has none, however long it is; and near the silhouette, where
    the surface is seen edge-on, a small part of a pixel is a long way.
    """
    best = smallest_gradient(samples)
    if wp.length(best.gradient) <= ROUNDING * best.radius:
        return True
    a, b, c = samples.a.point, samples.b.point, samples.c.point
    across = wp.cross(b - a, c - a)
    lengths = wp.length(a - eye) * wp.length(b - eye) * wp.length(c - eye)
    if HALF * wp.length(across) > limits.least_area * wp.length_sq(a):
        if HALF * wp.abs(wp.dot(across, a - eye)) > limits.least_solid_angle * lengths:
            return False
    return residual_angle(best.point, best.normal, eye, vertex) <= limits.most_residual


@wp.func
def direction_to(position: wp.vec3d) -> wp.vec3d:
    """The unit direction from O to a position; any for O itself."""
    if wp.length_sq(position) > ZERO:
        return wp.normalize(position)
    return wp.vec3d(ONE, ZERO, ZERO)


@wp.func
def at_right_angles(direction: wp.vec3d) -> wp.vec3d:
    """A unit vector at right angles to a unit direction."""
    axis = wp.vec3d(ONE, ZERO, ZERO)
    if wp.abs(direction[0]) > HALF:
        axis = wp.vec3d(ZERO, ONE, ZERO)
    return wp.normalize(wp.cross(direction, axis))


@wp.func
def seen_up_to(radius: wp.float64, distance: wp.float64) -> wp.float64:
    """How far from its own projection a point at this distance from O sees a sphere, as an angle at O; 0 inside."""
    return wp.acos(wp.min(ONE, radius / distance))


@wp.func
def reflection_of(
    samples: Samples, eye: wp.vec3d, vertex: wp.vec3d, side: wp.float64, limits: SearchLimits
) -> Reflection:
    """What a search has found when it ends. ``side`` is 1 if the eye is outside, -1 inside, 0 if that is not known."""
    best = smallest_gradient(samples)
    found = Reflection()
    found.point = best.point
    found.normal = best.normal
    found.residual = residual_angle(found.point, found.normal, eye, vertex)
    of_eye, of_vertex = wp.dot(found.normal, eye - found.point), wp.dot(found.normal, vertex - found.point)
    if of_eye * of_vertex > ZERO and found.residual <= limits.most_residual:
        found.is_found = wp.where(of_eye * side >= ZERO, 1, 0)
        found.is_hidden = 1 - found.is_found
    found.is_inside = wp.where(side > ZERO, 0, 1)
    return found


@launch.once
def sampler(surface_type: type, radial_point: Callable[..., RadialPoint]) -> Callable[..., Sample]:
    """``sampled(surface, direction, eye, vertex) -> Sample`` of a kind of surface."""

    @wp.func
    def sampled(surface: surface_type, direction: wp.vec3d, eye: wp.vec3d, vertex: wp.vec3d) -> Sample:
        return sample_of(direction, radial_point(surface, direction), eye, vertex)

    return sampled


@launch.once
def starter(surface_type: type, radial_point: Callable[..., RadialPoint]) -> Callable[..., Samples]:
    """``first_samples(surface, eye, vertex) -> Samples`` of a kind of surface."""

    sampled = sampler(surface_type, radial_point)

    @wp.func
    def sampled_near(
        surface: surface_type, point: wp.vec3d, other: wp.vec3d, eye: wp.vec3d, vertex: wp.vec3d
    ) -> Sample:
        """The sample in the direction of a point, or on the way to another one, nearer and nearer, if there is none."""
        sample, at = sampled(surface, wp.normalize(point), eye, vertex), point
        for _ in range(MOST_TRIES):
            if sample.radius == ZERO:
                at = HALF * (at + other)
                sample = sampled(surface, wp.normalize(at), eye, vertex)
        return sample

    @wp.func
    def first_samples(surface: surface_type, eye: wp.vec3d, vertex: wp.vec3d) -> Samples:
        """The triangle at the start (section 3.3.4): between the projections of V and E, and equilateral."""
        to_eye, to_vertex = direction_to(eye), direction_to(vertex)
        of_eye = met_radius(radial_point(surface, to_eye))
        of_vertex = met_radius(radial_point(surface, to_vertex))
        if of_eye == ZERO and of_vertex == ZERO:  # both look in from the open side
            to_eye, to_vertex = -to_eye, -to_vertex
        across = wp.cross(to_eye, to_vertex)
        sine = wp.length(across)
        if sine > STRAIGHT:
            across = across / sine
        else:
            across = at_right_angles(to_eye)
        onwards = wp.cross(across, to_eye)
        # Angles at O along the arc from E's projection to V's.
        first, last = ZERO, wp.atan2(sine, wp.dot(to_eye, to_vertex))
        if of_vertex > ZERO:
            first = wp.max(ZERO, last - seen_up_to(of_vertex, wp.length(vertex)))
        if of_eye > ZERO:
            last = wp.min(last, seen_up_to(of_eye, wp.length(eye)))
        middle = HALF * (first + last)
        half = wp.max(LEAST_HALF, HALF * wp.abs(last - first))
        high = wp.cos(middle + half) * to_eye + wp.sin(middle + half) * onwards
        low = wp.cos(middle - half) * to_eye + wp.sin(middle - half) * onwards
        samples = Samples()
        samples.newest = -1
        samples.a = sampled_near(surface, high, low, eye, vertex)
        samples.b = sampled_near(surface, low, high, eye, vertex)
        between = HALF * (samples.a.point + samples.b.point)
        height = EQUILATERAL * wp.length(samples.a.point - samples.b.point)
        samples.c = sampled_near(surface, between + height * across, between, eye, vertex)
        return samples

    return first_samples


@launch.once
def stepper(surface_type: type, radial_point: Callable[..., RadialPoint]) -> Callable[..., Sample]:
    """``next_sample(surface, samples, weights, eye, vertex, most_tries) -> Sample`` of a kind of surface."""

    sampled = sampler(surface_type, radial_point)

    @wp.func
    def next_sample(
        surface: surface_type, samples: Samples, weights: wp.vec3d, eye: wp.vec3d, vertex: wp.vec3d, most_tries: int
    ) -> Sample:
        """The sample at D, or on the way to it from the best so far, where the gradient is smaller than there."""
        best, c = smallest_gradient(samples), samples.c.point
        point = c + weights[0] * (samples.a.point - c) + weights[1] * (samples.b.point - c)
        largest = MUCH * wp.length(best.gradient)
        sample = Sample()
        is_worse = bool(True)
        while is_worse and sample.tries < most_tries and wp.length_sq(point) > ZERO:
            tries = sample.tries + 1
            sample = sampled(surface, wp.normalize(point), eye, vertex)
            sample.tries = tries
            is_worse = sample.radius == ZERO or wp.length(sample.gradient) > wp.max(largest, ROUNDING * sample.radius)
            point = HALF * (point + best.point)
        return sample

    return next_sample


@launch.once
def fermat_search(surface_type: type, radial_point: Callable[..., RadialPoint]) -> Callable[..., Reflection]:
    """The search on a kind of surface, as a function ``search(surface, eye, vertex, limits) -> Reflection``.

    Args:
        surface_type: a struct.
        radial_point: a function of such a struct and a unit direction from O.
    """

    first_samples, next_sample = starter(surface_type, radial_point), stepper(surface_type, radial_point)

    @wp.func
    def search(surface: surface_type, eye: wp.vec3d, vertex: wp.vec3d, limits: SearchLimits) -> Reflection:
        """Where the surface mirrors ``vertex``, seen from ``eye``."""
        samples = first_samples(surface, eye, vertex)
        iterations = int(0)
        if samples.a.radius == ZERO or samples.b.radius == ZERO or samples.c.radius == ZERO:
            return Reflection()
        goes_on = bool(True)
        while goes_on and iterations < limits.most_iterations:
            weights = weights_of_zero(samples.a.gradient, samples.b.gradient, samples.c.gradient)
            if weights[2] > wp.where(samples.has_discarded != 0, LEAST_SINE, NO_SINE):
                most_tries = wp.min(MOST_TRIES, limits.most_iterations - iterations)
                sample = next_sample(surface, samples, weights, eye, vertex, most_tries)
                iterations += wp.max(sample.tries, 1)
                goes_on = sample.radius > ZERO
                if goes_on:
                    samples = with_replaced(samples, largest_gradient(samples, -1), sample)
                    goes_on = not is_settled(samples, eye, vertex, limits)
            elif samples.has_discarded != 0:
                # Go back in time: not to the newest sample's place, or that would go on for ever.
                iterations += 1
                samples = with_replaced(samples, largest_gradient(samples, samples.newest), samples.discarded)
            else:
                goes_on = False
        side = ZERO
        of_eye = met_radius(radial_point(surface, direction_to(eye)))
        if of_eye > ZERO:
            side = wp.sign(wp.length(eye) - of_eye)
        found = reflection_of(samples, eye, vertex, side, limits)
        found.iterations = iterations
        return found

    return search
