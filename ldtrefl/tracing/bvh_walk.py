"""Rays down the tree of a ``wp.Bvh`` over a mesh's triangles, watertight: of rays aimed at an edge or a vertex of a
closed mesh none passes.

A triangle is tested in float64 (``triangle_test.h``), so that triangles share their edges exactly. The boxes of the
tree are wider than their triangles by what is rounded where a ray is tested against them, so that no box is missed
whose triangle is met.

The walk (``bvh_walk.h``) reads the nodes of Warp's tree: Warp's own query does not visit the nearest child first, and
takes two to three times as long. It stands in for the walk where this version of Warp is not known, and gives the same
answers to the bit.
"""

from __future__ import annotations

import warp as wp

from ldtrefl.device import launch, warp_abi
from ldtrefl.device.native_sources import native_body
from ldtrefl.geometry.triangle import facet_normal
from ldtrefl.geometry.vectors import as_double, as_single
from ldtrefl.world.outliers import Outliers

BOX_MARGIN = wp.constant(1.2e-6)
"""Unit space: by how much boxes are widened. A ray that can meet the object starts at most 2.5 from the centre along
each axis, so that sides of boxes are at most 3.5 from its start. In roundings of a float32, 2^-24, what is rounded in a
slab test then comes to: the start, and its product by 1 / direction, 2.5 each; 1 / direction, where a side is crossed,
and the nearest t so far, 3.5 each; the side, and its product, 1 each. That is 17.5 of them, or 1.05e-6."""

NEGLIGIBLE = wp.constant(1.0e-18)
"""Component of a direction below which the ray is taken to run along the planes of that axis."""

QUERY_SLACK = wp.constant(1.0e-5)
"""Relative: by how much farther than the nearest triangle so far Warp's own query looks, which leaves out boxes that
are entered just there."""

CONSTANTS: dict[str, float | int] = {"NEGLIGIBLE": float(NEGLIGIBLE)}
"""What the C++ reads, by the names that it has there."""

FILES = ("device/vectors.h", "tracing/triangle_test.h", "tracing/bvh_walk.h")
"""The C++, after ``warp_abi.READ_BVH``, each file after those that its class is derived from."""


@wp.struct
class BvhView:
    """What kernels read of a mesh and its tree."""

    tree: wp.uint64  # the ``wp.Bvh``
    vertices: wp.array(dtype=wp.vec3)
    faces: wp.array(dtype=wp.vec3i)  # outliers without area, so that they are not met
    outliers: Outliers


@launch.kernel
def box_triangles(
    first: int,
    # In:
    vertices: wp.array(dtype=wp.vec3),
    faces: wp.array(dtype=wp.vec3i),
    # Out:
    lows_out: wp.array(dtype=wp.vec3),
    highs_out: wp.array(dtype=wp.vec3),
):
    """A thread finds the box about one triangle, widened."""
    i = first + wp.tid()
    a, b, c = vertices[faces[i][0]], vertices[faces[i][1]], vertices[faces[i][2]]
    margin = wp.vec3(BOX_MARGIN)
    lows_out[i] = wp.min(wp.min(a, b), c) - margin
    highs_out[i] = wp.max(wp.max(a, b), c) + margin


WALK = """
    auto& view = views.data[index];
    const BvhWalk::Mesh mesh = {WarpBvh::of(view.tree), &view.vertices.data[0][0], &view.faces.data[0][0]};
    const BvhWalk::Nearest found = BvhWalk::walk(mesh, &start[0], &direction[0], end, ANY_HIT != 0);
    return wp::vec_t<4, wp::float64>(found.met.t, found.met.u, found.met.v, (double)found.triangle);
"""
"""C++: a ray down the tree."""


@wp.func_native(warp_abi.READ_BVH + native_body(CONSTANTS | {"ANY_HIT": 0}, FILES, WALK))
def walk_to_first(
    views: wp.array(dtype=BvhView), index: int, start: wp.vec3d, direction: wp.vec3, end: wp.float64
) -> wp.vec4d:
    """The first triangle that a ray meets at 0 <= t < ``end``: t, the weights of its second and third corner, and its
    number, -1 if there is none."""
    ...


@wp.func_native(warp_abi.READ_BVH + native_body(CONSTANTS | {"ANY_HIT": 1}, FILES, WALK))
def walk_to_any(
    views: wp.array(dtype=BvhView), index: int, start: wp.vec3d, direction: wp.vec3, end: wp.float64
) -> wp.vec4d:
    """:func:`walk_to_first` for any triangle that the ray meets."""
    ...


ASK = """
    auto& view = views.data[index];
    const TriangleTest::Line line = TriangleTest::line_of(&start[0], &direction[0]);
    const float* vertices = &view.vertices.data[0][0];
    TriangleTest::Meeting met;
    if (!TriangleTest::meet_numbered(line, vertices, &view.faces.data[0][0], triangle, met)) met = {-1.0, 0.0, 0.0};
    return wp::vec_t<4, wp::float64>(met.t, met.u, met.v, (double)triangle);
"""


@wp.func_native(native_body({}, FILES[:2], ASK))
def meet_triangle(
    views: wp.array(dtype=BvhView), index: int, triangle: int, start: wp.vec3d, direction: wp.vec3
) -> wp.vec4d:
    """Where a ray's line meets a triangle, as :func:`walk_to_first` tells it; t is below 0 if it does not."""
    ...


@wp.func
def crossing(direction: wp.vec3) -> wp.vec3:
    """A direction none of whose components is 0, or nearly."""
    for k in range(3):
        if wp.abs(direction[k]) < NEGLIGIBLE:
            direction[k] = wp.where(direction[k] < 0.0, -NEGLIGIBLE, NEGLIGIBLE)
    return direction


@wp.func
def query_first(
    views: wp.array(dtype=BvhView), index: int, start: wp.vec3d, direction: wp.vec3, end: wp.float64
) -> wp.vec4d:
    """:func:`walk_to_first` by Warp's own query."""
    nearest = wp.vec4d(end, wp.float64(0.0), wp.float64(0.0), wp.float64(-1.0))
    query = wp.bvh_query_ray(views[index].tree, as_single(start), crossing(direction))
    triangle = int(0)
    while wp.bvh_query_next(query, triangle, (1.0 + QUERY_SLACK) * float(nearest[0]) + QUERY_SLACK):
        met = meet_triangle(views, index, triangle, start, direction)
        is_first = met[0] < nearest[0] or (met[0] == nearest[0] and met[3] < nearest[3])
        if met[0] >= wp.float64(0.0) and is_first:
            nearest = met
    return nearest


@wp.func
def query_any(
    views: wp.array(dtype=BvhView), index: int, start: wp.vec3d, direction: wp.vec3, end: wp.float64
) -> wp.vec4d:
    """:func:`walk_to_any` by Warp's own query."""
    query = wp.bvh_query_ray(views[index].tree, as_single(start), crossing(direction))
    triangle = int(0)
    while wp.bvh_query_next(query, triangle, (1.0 + QUERY_SLACK) * float(end) + QUERY_SLACK):
        met = meet_triangle(views, index, triangle, start, direction)
        if met[0] >= wp.float64(0.0) and met[0] < end:
            return met
    return wp.vec4d(end, wp.float64(0.0), wp.float64(0.0), wp.float64(-1.0))


@wp.func
def unit_facet_normal(view: BvhView, triangle: int) -> wp.vec3:
    """A triangle's unit normal by its winding."""
    corners = view.faces[triangle]
    a, b, c = view.vertices[corners[0]], view.vertices[corners[1]], view.vertices[corners[2]]
    return as_single(facet_normal(as_double(a), as_double(b), as_double(c)))
