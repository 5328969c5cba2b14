"""Rays against a tree (``tree.py``): the tracer of the exact search.

The search is C++: ``rays.h`` shows its files in order, ``answer.h`` is the last. Here stand the constants that it reads
and the calls into it.
"""

from __future__ import annotations

import warp as wp

from ldtrefl.device.native_sources import native_body
from ldtrefl.geometry.triangle import barycentrics_at
from ldtrefl.geometry.vectors import as_single, point_along
from ldtrefl.ldt.exact.tree import NODE, PATCH_AXIS_ROW, PATCH_TRIANGLE_ROW, STACK, TRIANGLE_NUMBER_ROW, TreeView
from ldtrefl.tracing.hit import Hit
from ldtrefl.tracing.outlier_hits import add_outliers_met, is_outlier_met, merge_outliers
from ldtrefl.tracing.tracer import RAY_BLOCK, Query, Tracer
from ldtrefl.world.unit_rays import NEAR

BOX_SLACK = 1.0e-6
"""Relative rounding of where a ray enters the box about all records, with some to spare: four operations."""

NEGLIGIBLE = 1.0e-18
"""Component of a direction below which the ray is taken to run along the planes of that axis."""

EDGE_ON = 2.0e-7
"""|n . direction| up to which a patch is seen edge on, to float32's rounding."""

DEPTH_SLACK = 1.0e-6
"""Unit space: rounding of how far along a ray a corner lies, with some to spare."""

BESIDE = 2.4e-7
"""A part of a triangle's sides: up to so far beside the triangle a ray that passes it by float32's rounding meets its
plane. Where it does so farther away, it meets an edge."""

PACKET_SPREAD = 0.25
"""Unit space: how far the starts, and the directions, of the rays of a packet may lie apart along an axis."""

GRAZING = 0.35
"""n . direction below which a hit on the back of a closed object's patch is doubtful."""

MOST_DOUBTFUL = 64
"""Doubtful hits of a ray after which the next hit is taken as it is. Three in a row were never seen."""

T_ROUNDING = 2.4e-7
"""Two roundings of a float32, relative."""

FAR = 1.0e30
"""The end of a probe: it looks for whatever lies there."""

FETCHED_AHEAD = 4
"""Rays by which the memory of a ray's record is asked for ahead of its answer."""

LARGE_PATCH = wp.constant(-2.0)
"""In place of a barycentric, on a patch whose triangle is larger: the barycentrics are still to be found."""

OWN_PATCHES = wp.constant(2.0)
"""Sides of a patch from its start within which a ray may pass through patches of its own surface: a bent surface has
left the plane of a patch by then."""

OWN_STEP = 1.0 / 8.0
"""Halves of a patch's side by which a search goes on behind a patch of the ray's own surface."""

OWN_RISE = 0.02
"""Halves of a patch's side by which a ray may start beneath a patch and pass through it: it has left the surface that
the patch stands for, which is bent. Of rays that start on a knot of 500,000 triangles 2.5% end at their own patches so,
0.14% at 0.05; but of rays that do start inside, as close to the surface, as many are lost: 0.03% and 0.08%."""


CONSTANTS: dict[str, float | int] = {
    "BESIDE": BESIDE,
    "BOX_SLACK": BOX_SLACK,
    "DEPTH_SLACK": DEPTH_SLACK,
    "EDGE_ON": EDGE_ON,
    "FAR": FAR,
    "FETCHED_AHEAD": FETCHED_AHEAD,
    "GRAZING": GRAZING,
    "LARGE_PATCH": float(LARGE_PATCH),
    "MOST_DOUBTFUL": MOST_DOUBTFUL,
    "NEAR": float(NEAR),
    "NEGLIGIBLE": NEGLIGIBLE,
    "OWN_RISE": OWN_RISE,
    "OWN_STEP": OWN_STEP,
    "PACKET_SPREAD": PACKET_SPREAD,
    "PATCH_AXIS_ROW": PATCH_AXIS_ROW,
    "PATCH_TRIANGLE_ROW": PATCH_TRIANGLE_ROW,
    "RAY_BLOCK": RAY_BLOCK,
    "TRIANGLE_NUMBER_ROW": TRIANGLE_NUMBER_ROW,
    "TREE_NODE": NODE,
    "TREE_STACK": STACK,
    "T_ROUNDING": T_ROUNDING,
}
"""What the C++ reads, by the names that it has there."""

FILES = (
    "device/vectors.h",
    "tracing/ray_query.h",
    "ldt/exact/rays.h",
    "ldt/exact/boxes.h",
    "ldt/exact/triangles.h",
    "ldt/exact/patches.h",
    "ldt/exact/single_rays.h",
    "ldt/exact/packets.h",
    "ldt/exact/rays_in_turn.h",
    "ldt/exact/packets_in_turn.h",
    "ldt/exact/walk.h",
    "ldt/exact/answer.h",
)
"""The C++ of the search, each file after those that its class is derived from."""


TREE = """
    auto& view = views.data[index];
    const TreeWalk::Tree tree = {view.nodes.data, view.rows.data, &view.low[0], &view.high[0], view.half_patch};
    static_assert(sizeof(queries.data[0]) == sizeof(TreeWalk::Query), "a Query as tracer.py has it");
    const TreeWalk::Query* asked = (const TreeWalk::Query*)queries.data;
    TreeWalk::Rays rays[TreeWalk::EIGHTS];
"""
"""C++: the arguments of a native function as the search has them."""

SEARCH = """
    TreeWalk::search(tree, rays, asked, count, view.in_turn != 0, false);
    for (int i = 0; i < count; ++i) {
        const TreeWalk::Rays& own = rays[i / TreeWalk::LANES];
        const int lane = i % TreeWalk::LANES;
        const int later = i + FETCHED_AHEAD;
        if (later < count) TreeAnswer::fetch_record(tree, rays[later / TreeWalk::LANES], later % TreeWalk::LANES);
        auto& hit = hits.data[i];
        hit.steps = own.steps[lane];
        hit.triangle = -1;
        hit.t = INFINITY;
        if (own.record[lane] < 0) continue;
        TreeAnswer::Answer answer = TreeAnswer::answer_of(tree, own, lane);
        if (view.front != 0.0f && TreeAnswer::is_doubtful(tree, answer, asked[i].direction, view.front))
            hit.steps += TreeAnswer::search_beyond(tree, asked[i], view.front, view.horizon, answer);
        hit.triangle = answer.triangle;
        if (answer.triangle < 0) continue;
        hit.t = answer.t;
        hit.u = answer.u;
        hit.v = answer.v;
        for (int k = 0; k < 3; ++k) hit.normal[k] = answer.normal[k];
    }
"""
"""C++: the nearest hits of rays, after :data:`TREE`."""

SEARCH_FOR_ANY = """
    TreeWalk::search(tree, rays, asked, count, view.in_turn != 0, true);
    for (int i = 0; i < count; ++i) {
        const TreeWalk::Rays& own = rays[i / TreeWalk::LANES];
        hits.data[i].triangle = own.record[i % TreeWalk::LANES] >= 0 ? 0 : -1;
        hits.data[i].steps = own.steps[i % TreeWalk::LANES];
    }
"""
"""C++: whether rays hit anything, after :data:`TREE`."""


@wp.func_native(native_body(CONSTANTS, FILES, TREE + SEARCH))
def search_tree(
    views: wp.array(dtype=TreeView),
    index: int,
    queries: wp.array(dtype=Query),
    count: int,
    hits: wp.array(dtype=Hit),
):
    """Find the nearest hits of ``count`` rays; of misses t and the triangle are set."""
    ...


@wp.func_native(native_body(CONSTANTS, FILES, TREE + SEARCH_FOR_ANY))
def search_tree_for_any(
    views: wp.array(dtype=TreeView),
    index: int,
    queries: wp.array(dtype=Query),
    count: int,
    hits: wp.array(dtype=Hit),
):
    """Find whether ``count`` rays hit anything: the triangle is 0 if they do, else -1."""
    ...


@wp.func
def coordinates_under_patch(view: TreeView, triangle: int, query: Query, t: float) -> wp.vec2:
    """Barycentrics of a hit on a patch, in the triangle that the patch is part of."""
    point = as_single(point_along(query.origin, query.direction, t))
    corners = view.faces[triangle]
    return barycentrics_at(view.vertices[corners[0]], view.vertices[corners[1]], view.vertices[corners[2]], point)


@wp.func
def closest_hits_exact(
    views: wp.array(dtype=TreeView), index: int, queries: wp.array(dtype=Query), count: int, hits: wp.array(dtype=Hit)
):
    """The tracer's ``closest_hits``. For patches smaller than their triangle, barycentrics are computed afterwards."""
    search_tree(views, index, queries, count, hits)
    if views[index].half_patch > 0.0:
        for i in range(count):
            if hits[i].triangle >= 0 and hits[i].u == LARGE_PATCH:
                uv = coordinates_under_patch(views[index], hits[i].triangle, queries[i], hits[i].t)
                hits[i].u = uv[0]
                hits[i].v = uv[1]
    merge_outliers(views[index].outliers, queries, count, hits)


@wp.func
def any_hits_in_bulk(
    views: wp.array(dtype=TreeView), index: int, queries: wp.array(dtype=Query), count: int, hits: wp.array(dtype=Hit)
):
    """Whether rays meet the bulk. Where the first hit on a patch may be doubtful, nearest hits are searched for."""
    if views[index].half_patch > 0.0 and views[index].front != 0.0:
        search_tree(views, index, queries, count, hits)
    else:
        search_tree_for_any(views, index, queries, count, hits)


@wp.func
def any_hits_exact(
    views: wp.array(dtype=TreeView), index: int, queries: wp.array(dtype=Query), count: int, hits: wp.array(dtype=Hit)
):
    """The tracer's ``any_hits``."""
    any_hits_in_bulk(views, index, queries, count, hits)
    add_outliers_met(views[index].outliers, queries, count, hits)


@wp.func
def is_own_surface(hit: Hit, direction: wp.vec3, outwards: wp.vec3) -> bool:
    """Whether a ray that leaves a surface passes through what it meets to the side that it leaves by, ``outwards``."""
    return wp.dot(hit.normal, direction) * wp.dot(hit.normal, outwards) > 0.0


@wp.func
def occluded_exact(views: wp.array(dtype=TreeView), index: int, query: Query, outwards: wp.vec3) -> bool:
    """The tracer's ``occluded``.

    A ray may start beneath the patches that stand for its own surface. It then passes through them from within, close
    to its start: such hits do not count.
    """
    if is_outlier_met(views[index].outliers, query):
        return True
    query_room, hit_room = wp.zeros(shape=1, dtype=Query), wp.zeros(shape=1, dtype=Hit)
    queries = wp.array(ptr=query_room.ptr, shape=(1,), dtype=Query)
    hits = wp.array(ptr=hit_room.ptr, shape=(1,), dtype=Hit)
    queries[0] = query
    side = 2.0 * views[index].half_patch
    if side == 0.0 or outwards == wp.vec3(0.0):
        any_hits_in_bulk(views, index, queries, 1, hits)
        return hits[0].triangle >= 0
    passed = float(0.0)
    while passed <= OWN_PATCHES * side:
        queries[0].origin = point_along(query.origin, query.direction, passed)
        queries[0].t_max = query.t_max - passed
        search_tree(views, index, queries, 1, hits)
        if hits[0].triangle < 0:
            return False
        if passed + hits[0].t >= OWN_PATCHES * side or not is_own_surface(hits[0], query.direction, outwards):
            return True
        passed += hits[0].t + OWN_STEP * views[index].half_patch
    queries[0].origin = point_along(query.origin, query.direction, passed)
    queries[0].t_max = query.t_max - passed
    any_hits_in_bulk(views, index, queries, 1, hits)
    return hits[0].triangle >= 0


EXACT = Tracer("exact", TreeView, closest_hits_exact, any_hits_exact, occluded_exact)
