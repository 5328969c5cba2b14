"""Samples of a surface in the search for a reflection: the gradient at each, and where it is interpolated to be 0.

``fermat_search.py`` says how they are used, and in what their gradient differs from the paper's. Positions are float64,
from O.
"""

from __future__ import annotations

import warp as wp

from ldtrefl.methods.virtual.radius_map import RadialPoint

GRAZING = wp.constant(wp.float64(0.125))
"""Weight of what is added to e for grazing incidence. With 0.02 some are not found; at 0.5 wide angles take longer."""

HALF = wp.constant(wp.float64(0.5))
ONE = wp.constant(wp.float64(1.0))
ZERO = wp.constant(wp.float64(0.0))


@wp.struct
class Sample:
    """A point of the surface, and the gradient of the path's length there."""

    point: wp.vec3d
    gradient: wp.vec3d  # of the path's length, made more linear
    normal: wp.vec3d  # away from O, unit
    radius: wp.float64  # 0 if there is no surface
    tries: int  # samples that were taken for this one


@wp.struct
class Samples:
    """The triangle of samples of a search."""

    a: Sample
    b: Sample
    c: Sample
    discarded: Sample  # most recently
    has_discarded: int
    newest: int  # which was added last, 0 to 2; -1 at the start


@wp.func
def path_gradient(point: wp.vec3d, normal: wp.vec3d, eye: wp.vec3d, vertex: wp.vec3d) -> wp.vec3d:
    """The gradient of the path's length ``EP + PV`` along a surface with this unit normal."""
    e = wp.normalize(point - eye) + wp.normalize(point - vertex)
    return e - wp.dot(e, normal) * normal


@wp.func
def grazing_gradient(point: wp.vec3d, normal: wp.vec3d, eye: wp.vec3d, vertex: wp.vec3d) -> wp.vec3d:
    """What is added to it: ``(d . n) d_t / 8``."""
    d = wp.normalize(point - eye) - wp.normalize(point - vertex)
    along = wp.dot(d, normal)
    return GRAZING * along * (d - along * normal)


@wp.func
def sample_of(direction: wp.vec3d, at: RadialPoint, eye: wp.vec3d, vertex: wp.vec3d) -> Sample:
    """The sample in a unit direction, where the surface is ``at``."""
    sample = Sample()
    if at.radius > ZERO:
        sample.radius = at.radius
        sample.point = at.radius * direction
        sample.normal = wp.normalize(direction - at.gradient / at.radius)
        to_eye, to_vertex = wp.length(eye - sample.point), wp.length(vertex - sample.point)
        factor = to_eye * to_vertex / (to_eye + to_vertex)
        gradient = path_gradient(sample.point, sample.normal, eye, vertex)
        sample.gradient = factor * (gradient + grazing_gradient(sample.point, sample.normal, eye, vertex))
    return sample


@wp.func
def weights_of_zero(a: wp.vec3d, b: wp.vec3d, c: wp.vec3d) -> wp.vec3d:
    """Weights (alpha, beta) of A and B where the gradient interpolated between a, b and c is smallest, by least squares
    (section 3.3.3), and the determinant of their equations over the product of its diagonal."""
    a_c, b_c = a - c, b - c
    aa, ab, bb = wp.dot(a_c, a_c), wp.dot(a_c, b_c), wp.dot(b_c, b_c)
    ac, bc = wp.dot(a_c, c), wp.dot(b_c, c)
    determinant = aa * bb - ab * ab
    if not determinant > ZERO:
        return wp.vec3d(ZERO, ZERO, ZERO)
    return wp.vec3d((ab * bc - bb * ac) / determinant, (ab * ac - aa * bc) / determinant, determinant / (aa * bb))


@wp.func
def with_replaced(samples: Samples, which: int, new: Sample) -> Samples:
    """The triangle with one sample replaced, which is then the discarded one."""
    changed = samples
    if which == 0:
        changed.discarded = samples.a
        changed.a = new
    elif which == 1:
        changed.discarded = samples.b
        changed.b = new
    else:
        changed.discarded = samples.c
        changed.c = new
    changed.has_discarded = 1
    changed.newest = which
    return changed


@wp.func
def largest_gradient(samples: Samples, other_than: int) -> int:
    """Which sample has the largest gradient: 0 for A, 1 for B, 2 for C. ``other_than`` is passed over; -1 for none."""
    which, largest = int(0), wp.float64(-1.0)
    if other_than != 0:
        largest = wp.length(samples.a.gradient)
    if other_than != 1 and wp.length(samples.b.gradient) > largest:
        which = int(1)
        largest = wp.length(samples.b.gradient)
    if other_than != 2 and wp.length(samples.c.gradient) > largest:
        which = int(2)
    return which


@wp.func
def smallest_gradient(samples: Samples) -> Sample:
    """The sample with the smallest gradient."""
    best = samples.a
    if wp.length(samples.b.gradient) < wp.length(best.gradient):
        best = samples.b
    if wp.length(samples.c.gradient) < wp.length(best.gradient):
        best = samples.c
    return best


@wp.func
def residual_angle(point: wp.vec3d, normal: wp.vec3d, eye: wp.vec3d, vertex: wp.vec3d) -> wp.float64:
    """Radians between the view of a point, mirrored at its unit normal, and the way from it to the vertex."""
    view = wp.normalize(point - eye)
    mirrored = view - wp.float64(2.0) * wp.dot(view, normal) * normal
    half_chord = HALF * wp.length(mirrored - wp.normalize(vertex - point))
    return wp.float64(2.0) * wp.asin(wp.min(half_chord, ONE))
