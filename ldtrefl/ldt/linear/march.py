"""Ray against sorted maps: ``march_linear``, the search of Zhang, Hsieh and Shen, sections 3.3 and 3.4.

The ray enters the box and steps along it at equal distances until a sample lies inside the object. Then the step
between the last two samples is bisected. That is done in up to three maps, chosen by the signs of the direction. Where
it differs from the paper, because real meshes are open, nested and seen from within:

- *Inside* is more fragments that lead in than out in front of the sample, which is the paper's test of front and back
  depths and holds for solids in solids and for faces that lie in each other. Where a texel's fragments do not cancel
  (open or inconsistently wound meshes) it is their parity. A ray that starts inside searches for the way out.
- A crossing whose depth is far from the texel's (Fig. 5: the ray came in through the side of a column) is left to the
  other maps, and the search goes on.
- The nearest crossing of the three maps wins, not the first map's: once a map has found one, the others search up to
  there, with as many samples, or with one a texel, on the shorter way.

Samples ``i = 1 .. n`` lie at ``t_enter + i * (t_exit - t_enter) / n``. ``n`` is ``linear_steps``, or with ``"texel"``
one for each texel that the ray passes: the texels of that way along x, y and z together, rounded up, and at least as
many as lie along the longest side.

Most samples are never looked at: the C++ (``march.h``) goes from one that can matter to the next, by the fragments of
a texel and by the cells that the maps agree about (``occupancy.py``). The answer has the same bits as if all were, and
time follows what is near the ray, not the number of samples. ``steps`` counts the samples that were looked at.

Limits: what is thinner than a step or lies between texel centres can be missed. Silhouettes are as coarse as texels.
"""

from __future__ import annotations

import warp as wp

from ldtrefl.device.native_sources import native_body
from ldtrefl.geometry.box import box_span
from ldtrefl.geometry.triangle import barycentrics_at
from ldtrefl.geometry.vectors import as_double, as_single, point_along
from ldtrefl.ldt.linear.occupancy import LEVEL_SHIFT
from ldtrefl.ldt.maps import ONE_A_TEXEL, MapsView, triangle_of
from ldtrefl.tracing.hit import Hit, no_hit
from ldtrefl.tracing.tracer import Query, Tracer
from ldtrefl.world.unit_rays import NEAR, distance_passed

BOX_MARGIN = wp.constant(0.01)
"""Texels by which the box is widened, so that surfaces on its sides lie inside it whatever the rounding."""

CONSISTENT = 1.0
"""Texels between the ray and a fragment's depth within which a crossing is believed. Every surface faces one of the
maps at 55 degrees or less, where its depth changes by little more than this from texel to texel. Measured on the test
meshes, 2 gives more wrong hits in hollows and no fewer misses."""

DEEP = 2.0
"""Texels from every fragment beyond which the origin is inside the object for sure, not by a texel's error."""

CLEARANCE = wp.constant(2.5)
"""Texels above its surface at which a ray starts that leaves it: a texel is a block, and in it a ray is inside."""

SLACK = 2.0e-6
"""By how much less far a stretch without change is taken to reach, relative to the coordinates of the ray and its box:
32 roundings of a float32. A sample's place is off by four of them, and the number of a sample by as many."""

SLOWEST = 1.0e-12
"""Texels per sample along an axis, at least: of a slower ray the number of samples to the next texel would overflow."""

NEVER = 1.0e9
"""In place of the number of a sample: more than any ray has."""

ROUNDED_UP = 1.000001
"""A hit whose t times this lies before a limit lies before it whatever the rounding of a ray's last sample."""

FEW = 8
"""Fragments up to which looking at one after another is faster than halving their number."""


@wp.struct
class Crossing:
    """A change between outside and inside, as one map sees it."""

    t: float
    fragment: int  # -1 for none
    steps: int  # samples looked at


@wp.func
def widened_span(size: wp.vec3i, origin: wp.vec3, direction: wp.vec3) -> wp.vec2:
    """Where a ray enters and leaves the box of texels, a little widened (``geometry/box.py``)."""
    high = wp.vec3(float(size[0]) + BOX_MARGIN, float(size[1]) + BOX_MARGIN, float(size[2]) + BOX_MARGIN)
    return box_span(wp.vec3(-BOX_MARGIN, -BOX_MARGIN, -BOX_MARGIN), high, origin, direction)


CONSTANTS: dict[str, float | int] = {
    "CONSISTENT": CONSISTENT,
    "DEEP": DEEP,
    "FEW": FEW,
    "LEVEL_SHIFT": LEVEL_SHIFT,
    "NEVER": NEVER,
    "ONE_A_TEXEL": ONE_A_TEXEL,
    "ROUNDED_UP": ROUNDED_UP,
    "SLACK": SLACK,
    "SLOWEST": SLOWEST,
}
"""What the C++ reads, by the names that it has there."""
FILES = ("ldt/linear/sorted_maps.h", "ldt/linear/samples.h", "ldt/linear/march.h")
"""The C++ of the search, each file after those that its class is derived from."""

SEARCH = """
const auto& view = views.data[index];
LinearSearch::Maps maps = {view.start.data, view.depth.data, view.inside.data};
LinearSearch::Ray ray;
int octant = 0;
for (int axis = 0; axis < 3; ++axis) {
    maps.size[axis] = view.size[axis];
    maps.first_texel[axis] = view.first_texel[axis];
    maps.first_column[axis] = view.first_column[axis];
    ray.origin[axis] = origin[axis];
    ray.direction[axis] = direction[axis];
    octant += direction[axis] > 0.0f ? 0 : 1 << axis;
}
ray.t_enter = t_enter;
maps.cells = (const LinearSearch::Word*)view.cells.data + (size_t)octant * view.words_per_octant;
maps.cell_shift = view.cell_shift;
maps.column_shift = view.column_shift;
maps.levels = view.levels;
int steps = 0;
const LinearSearch::Crossing found =
    LinearSearch::search(maps, ray, t_exit, t_max, any_hit, view.linear_steps, view.binary_steps, steps);
union Bits { int number; float bits; };
const Bits fragment = {found.fragment}, looks = {steps};
return {found.t, fragment.bits, looks.bits};
"""
"""C++: the call into ``march.h``."""


@wp.func_native(native_body(CONSTANTS, FILES, SEARCH))
def search_maps(
    views: wp.array(dtype=MapsView),
    index: int,
    origin: wp.vec3,
    direction: wp.vec3,
    t_enter: float,
    t_exit: float,
    t_max: float,
    any_hit: bool,
) -> wp.vec3:
    """:func:`march_linear` in the box, in C++: the bits of a ``Crossing``, in the order of its fields."""
    ...


@wp.func
def march_linear(
    views: wp.array(dtype=MapsView), index: int, origin: wp.vec3, direction: wp.vec3, t_max: float, any_hit: bool
) -> Crossing:
    """The paper's search, in texel space: the nearest crossing before ``t_max`` that a map confirms.

    With ``any_hit`` it may be any crossing before ``t_max``. The samples share out the ray's way through the box
    whatever ``t_max`` is, so what is met does not depend on it.
    """
    crossing = Crossing()
    crossing.t = float(wp.inf)
    crossing.fragment = -1
    span = widened_span(views[index].size, origin, direction)
    if span[0] <= span[1] and span[0] < t_max:
        found = search_maps(views, index, origin, direction, span[0], span[1], t_max, any_hit)
        crossing.steps = wp.cast(found[2], wp.int32)
        if found[0] < t_max:
            crossing.t = found[0]
            crossing.fragment = wp.cast(found[1], wp.int32)
    return crossing


@wp.func
def distance_to_near(query: Query) -> float:
    """How far a ray goes before it is near the object: from there on float32 is precise enough."""
    if wp.max(wp.abs(query.origin)) > NEAR:
        return float(distance_passed(query.origin, query.direction, NEAR))
    return 0.0


@wp.func
def closest_hit_linear(views: wp.array(dtype=MapsView), index: int, query: Query) -> Hit:
    """The tracer's closest hit of a ray, by :func:`march_linear`."""
    passed = distance_to_near(query)
    origin, direction = as_single(point_along(query.origin, query.direction, passed)), query.direction
    t_max = query.t_max - passed
    scale = views[index].texels_per_unit
    hit = no_hit()
    found = march_linear(views, index, scale * origin + views[index].texel_offset, scale * direction, t_max, False)
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
def leaving_linear(views: wp.array(dtype=MapsView), index: int, query: Query, outwards: wp.vec3) -> Query:
    """The tracer's ``leaving``."""
    above = query
    above.origin = query.origin + as_double((CLEARANCE / views[index].texels_per_unit) * outwards)
    return above


@wp.func
def occluded_linear(views: wp.array(dtype=MapsView), index: int, query: Query, outwards: wp.vec3) -> bool:
    """The tracer's ``occluded`` by :func:`march_linear`."""
    scale = views[index].texels_per_unit
    above = leaving_linear(views, index, query, outwards)
    passed = distance_to_near(above)
    origin = scale * as_single(point_along(above.origin, above.direction, passed)) + views[index].texel_offset
    return march_linear(views, index, origin, scale * above.direction, above.t_max - passed, True).fragment >= 0


@wp.func
def closest_hits_linear(
    views: wp.array(dtype=MapsView), index: int, queries: wp.array(dtype=Query), count: int, hits: wp.array(dtype=Hit)
):
    """The tracer's ``closest_hits``: the maps hold all triangles, outliers too."""
    for i in range(count):
        hits[i] = closest_hit_linear(views, index, queries[i])


@wp.func
def any_hits_linear(
    views: wp.array(dtype=MapsView), index: int, queries: wp.array(dtype=Query), count: int, hits: wp.array(dtype=Hit)
):
    """The tracer's ``any_hits``."""
    for i in range(count):
        hits[i].triangle = wp.where(occluded_linear(views, index, queries[i], wp.vec3(0.0)), 0, -1)


LINEAR = Tracer("linear", MapsView, closest_hits_linear, any_hits_linear, occluded_linear, leaving_linear)
