"""Ray against sorted maps: ``march_linear``, the search of Zhang, Hsieh and Shen, sections 3.3 and 3.4.

Enter the box, step along the ray at equal distances until a sample lies inside the object, then bisect between the last
two samples; in up to three maps, chosen by the signs of the direction. Where it differs from the paper, because real
meshes are open, nested and seen from within:

- *Inside* is more fragments that lead in than out in front of the sample, which is the paper's test of front and back
  depths and holds for solids in solids and for faces that lie in each other. Where a texel's fragments do not cancel
  (open or inconsistently wound meshes) it is their parity. A ray that starts inside searches for the way out.
- A crossing whose depth is far from the texel's (Fig. 5: the ray came in through the side of a column) is left to the
  other maps, and the search goes on.
- The nearest crossing of the three maps wins, not the first map's.

Limits: what is thinner than a step or lies between texel centres can be missed; silhouettes are blocks of a texel.
"""

from __future__ import annotations

import warp as wp

from ldtrefl.cubemap import texel_from_point
from ldtrefl.fragments import LdtView, texel_number, triangle_of
from ldtrefl.hit import Hit, no_hit
from ldtrefl.shade import barycentrics_at
from ldtrefl.trace import Query, Tracer, any_one_by_one, one_by_one
from ldtrefl.unit_rays import NEAR, distance_passed
from ldtrefl.vectors import as_double, as_single, point_along

BOX_MARGIN = wp.constant(0.01)
"""Texels by which the box is widened, so that surfaces on its sides lie inside it whatever the rounding."""

CONSISTENT = wp.constant(1.0)
"""Texels between the ray and a fragment's depth within which a crossing is believed. Every surface faces one of the
maps at 55 degrees or less, where its depth changes by little more than this from texel to texel. Measured on the test
meshes, 2 gives more wrong hits in hollows and no fewer misses."""

DEEP = wp.constant(2.0)
"""Texels from every fragment beyond which the origin is inside the object for sure, not by a texel's error."""

CLEARANCE = wp.constant(2.5)
"""Texels above its surface at which a ray starts that leaves it: a texel is a block, and in it a ray is inside."""


@wp.struct
class Crossing:
    """A change between outside and inside, as one map sees it."""

    t: float
    residual: float  # texels between the ray and the depth of the fragment, along the map's axis
    fragment: int
    steps: int


@wp.func
def box_span(size: wp.vec3i, origin: wp.vec3, direction: wp.vec3) -> wp.vec2:
    """Slab test: where the ray enters and leaves the box, from 0 on; empty if the first is the larger."""
    t_enter = float(0.0)
    t_exit = float(wp.inf)
    for axis in range(3):
        low, high = -BOX_MARGIN, float(size[axis]) + BOX_MARGIN
        if direction[axis] == 0.0:
            # 0 * inf would be NaN: a ray along the slab is inside it or never.
            if origin[axis] < low or origin[axis] > high:
                t_exit = -1.0
        else:
            t_low, t_high = (low - origin[axis]) / direction[axis], (high - origin[axis]) / direction[axis]
            t_enter = wp.max(t_enter, wp.min(t_low, t_high))
            t_exit = wp.min(t_exit, wp.max(t_low, t_high))
    return wp.vec2(t_enter, t_exit)


@wp.func
def is_inside(view: LdtView, axis: int, rising: bool, p: wp.vec3) -> bool:
    """Whether ``p`` is inside the object, going by the fragments of its texel."""
    at = texel_from_point(axis, p)
    texel = texel_number(view, axis, at[0], at[1])
    first, end = view.start[texel], view.start[texel + 1]
    k = int(first)
    wound = int(0)
    while k < end and view.depth[k] <= at[2]:
        wound += 2 * (view.reference[k] & 1) - 1
        k += 1
    if view.balanced[texel] != wp.uint8(0):
        return wound != 0
    passed = end - k
    if rising:
        passed = k - first
    return passed % 2 == 1


@wp.func
def nearest_fragment(view: LdtView, axis: int, p: wp.vec3, best: Crossing) -> Crossing:
    """``best``, or the fragment of the texel that holds ``p`` that is nearer in depth."""
    at = texel_from_point(axis, p)
    texel = texel_number(view, axis, at[0], at[1])
    for k in range(view.start[texel], view.start[texel + 1]):
        distance = wp.abs(view.depth[k] - at[2])
        if distance < best.residual:
            best.residual = distance
            best.fragment = k
    return best


@wp.func
def no_crossing(t: float) -> Crossing:
    """Nothing found yet."""
    crossing = Crossing()
    crossing.t = t
    crossing.residual = float(wp.inf)
    crossing.fragment = -1
    return crossing


@wp.func
def search_map(
    view: LdtView, axis: int, origin: wp.vec3, direction: wp.vec3, t_enter: float, t_exit: float
) -> Crossing:
    """Algorithm 1 of the paper in the map of one axis: linear search, then bisection."""
    rising = direction[axis] > 0.0
    inside = False
    leaving_counts = True
    if t_enter == 0.0:
        # The ray starts in the box. A texel's error can put an origin on the surface inside the object: the way out
        # is then no crossing. Deep inside (a room seen from within) it is.
        inside = is_inside(view, axis, rising, origin)
        if inside:
            leaving_counts = nearest_fragment(view, axis, origin, no_crossing(0.0)).residual > DEEP
    step = (t_exit - t_enter) / float(view.linear_steps)
    i = int(1)
    while i <= view.linear_steps:
        t_after = t_enter + float(i) * step
        if is_inside(view, axis, rising, origin + t_after * direction) != inside:
            # Bisect between the last sample on the old side and the first on the new.
            before, after = t_after - step, t_after
            for _k in range(view.binary_steps):
                middle = 0.5 * (before + after)
                if is_inside(view, axis, rising, origin + middle * direction) != inside:
                    after = middle
                else:
                    before = middle
            if leaving_counts:
                found = nearest_fragment(view, axis, origin + after * direction, no_crossing(after))
                found = nearest_fragment(view, axis, origin + before * direction, found)
                if found.residual <= CONSISTENT:
                    found.steps = i
                    return found
            inside = not inside
            leaving_counts = True
        i += 1
    nothing = no_crossing(float(wp.inf))
    nothing.steps = view.linear_steps
    return nothing


@wp.func
def march_linear(view: LdtView, origin: wp.vec3, direction: wp.vec3, t_max: float) -> Crossing:
    """The paper's search, in texel space: the nearest crossing that a map confirms, before ``t_max``.

    Its steps share out the ray's way through the box whatever ``t_max``, so what is met does not depend on it.
    """
    best = no_crossing(float(wp.inf))
    steps = int(0)
    span = box_span(view.size, origin, direction)
    if span[0] <= span[1] and span[0] < t_max:
        t_exit = span[1]
        for axis in range(3):
            if direction[axis] != 0.0:
                found = search_map(view, axis, origin, direction, span[0], t_exit)
                steps += found.steps
                if found.fragment >= 0:
                    best = found
                    t_exit = found.t  # the other maps need look no farther
        if best.t >= t_max:
            best = no_crossing(float(wp.inf))
    best.steps = steps
    return best


@wp.func
def closest_hit_linear(views: wp.array(dtype=LdtView), index: int, query: Query) -> Hit:
    """The tracer's closest hit of a ray, by :func:`march_linear`."""
    passed = float(0.0)
    if wp.max(wp.abs(query.origin)) > NEAR:
        passed = distance_passed(query.origin, query.direction, NEAR)
    origin, direction = as_single(point_along(query.origin, query.direction, passed)), query.direction
    t_max = query.t_max - passed
    scale = views[index].texels_per_unit
    hit = no_hit()
    found = march_linear(views[index], scale * origin + views[index].texel_offset, scale * direction, t_max)
    hit.steps = found.steps
    if found.fragment >= 0:
        hit.t = passed + found.t
        hit.triangle = triangle_of(views[index].reference[found.fragment])
        corners = views[index].faces[hit.triangle]
        a, b = views[index].vertices[corners[0]], views[index].vertices[corners[1]]
        c = views[index].vertices[corners[2]]
        uv = barycentrics_at(a, b, c, origin + found.t * direction)
        hit.u = uv[0]
        hit.v = uv[1]
        hit.normal = wp.normalize(wp.cross(b - a, c - a))
    return hit


@wp.func
def occluded_linear(views: wp.array(dtype=LdtView), index: int, query: Query, outwards: wp.vec3) -> bool:
    """The tracer's ``occluded`` by :func:`march_linear`."""
    above = query
    above.origin = query.origin + as_double((CLEARANCE / views[index].texels_per_unit) * outwards)
    return closest_hit_linear(views, index, above).triangle >= 0


@wp.func
def no_stray_linear(
    views: wp.array(dtype=LdtView), index: int, origin: wp.vec3d, direction: wp.vec3, t_max: float
) -> Hit:
    """The tracer's ``stray_hit``: the maps hold all triangles."""
    return no_hit()


@wp.func
def stray_count_linear(views: wp.array(dtype=LdtView), index: int) -> int:
    """The tracer's ``stray_count``."""
    return 0


LINEAR = Tracer(
    "linear",
    LdtView,
    one_by_one(closest_hit_linear, LdtView),
    any_one_by_one(occluded_linear, LdtView),
    occluded_linear,
    no_stray_linear,
    stray_count_linear,
)
