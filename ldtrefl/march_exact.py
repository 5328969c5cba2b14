"""Ray against occupancy grid (``grid.py``): ``march_exact``, a walk through the occupied cells, nearest first.

Empty cells are leapt over; of an occupied one the boxes about its blocks are tested eight at a time, and then the
records of the blocks whose boxes the ray meets, eight at a time too. The nearest record met in a cell is the answer.
A ray is sent on that grazes the back of a closed object's patch. All of that is in ``march_exact.h``.
"""

from __future__ import annotations

from pathlib import Path

import warp as wp

from ldtrefl.grid import LANES, LARGE, PATCH_ROWS, SIDES, TRIANGLE, TRIANGLE_ROWS, GridView
from ldtrefl.hit import Hit, no_hit
from ldtrefl.shade import barycentrics_at, brought_inside
from ldtrefl.strays import first_stray
from ldtrefl.trace import Tracer

CELL_SLACK = 1.0e-4
"""Cells by which cells overlap along the ray: some twenty roundings of a coordinate in a grid of 64."""

EDGE_SLACK = 1.0e-5
"""Barycentric units by which records are widened, so that no ray slips between two triangles that share an edge."""

GRAZING = 0.35
"""n . direction below which a hit on the back of a closed object's patch is doubted, see ``march_exact.h``."""

MOST_DOUBTS = 64
"""Doubted hits of a ray after which the next is taken as it is. Three in a row were never seen."""

T_ROUNDING = 2.4e-7
"""Two roundings of a float32."""

NEGLIGIBLE = 1.0e-18
"""Component of a unit direction below which the ray runs along the planes: it would cross a cell in 1e18 cells."""

FAR = 1.0e30
"""The t of planes that are never reached."""

EDGE_ON = 2.0e-7
"""|n . direction| up to which a record is seen edge on, to float32's rounding, and is not met: nothing is known of
where."""

OWN_PATCHES = wp.constant(2.0)
"""Sides of a patch from its start within which a ray may pass through patches of its own surface: a bent surface has
left the plane of a patch by then."""

OWN_STEP = wp.constant(1.0 / 16.0)
"""Sides of a patch by which a search goes on behind such a patch."""


@wp.struct
class GridHit:
    """The record that a ray meets first."""

    t: float
    triangle: int  # -1 on a miss
    steps: int  # cells looked at and blocks tested
    kind: int
    u: float  # a triangle's barycentrics
    v: float
    normal: wp.vec3  # unit


def _search_cells() -> str:
    """The C++ of ``march_exact.h`` after the constants that it names."""
    lengths = {"CELL_SLACK": CELL_SLACK, "EDGE_SLACK": EDGE_SLACK, "EDGE_ON": EDGE_ON, "NEGLIGIBLE": NEGLIGIBLE}
    lengths |= {"GRAZING": GRAZING, "FAR": FAR, "T_ROUNDING": T_ROUNDING}
    numbers = {"MOST_DOUBTS": MOST_DOUBTS, "LANES": LANES, "SIDES": SIDES, "TRIANGLE": TRIANGLE}
    numbers |= {"PATCH_ROWS": PATCH_ROWS, "TRIANGLE_ROWS": TRIANGLE_ROWS}
    lines = [f"constexpr float {name} = {value!r}f;" for name, value in lengths.items()]
    lines += [f"constexpr int {name} = {int(value)};" for name, value in numbers.items()]
    return "\n".join([*lines, Path(__file__).with_suffix(".h").read_text()])


@wp.func_native(_search_cells())
def search_cells(
    views: wp.array(dtype=GridView), index: int, origin: wp.vec3, direction: wp.vec3, t_max: float
) -> wp.mat33:
    """:func:`march_exact` in C++: the bits of a ``GridHit``, in the order of its fields."""
    ...


@wp.func
def march_exact(
    views: wp.array(dtype=GridView), index: int, origin: wp.vec3, direction: wp.vec3, t_max: float
) -> GridHit:
    """What a ray meets first: walk the occupied cells, nearest first, and over the horizon where patches stick out past
    it.

    Object ``index``, cell space, ``direction`` of unit length. Places are stepped as integers and every plane's t is
    computed from its place, so nothing adds up and nothing stalls.
    """
    bits = search_cells(views, index, origin, direction, t_max)
    found = GridHit()
    found.t = bits[0, 0]
    found.triangle = wp.cast(bits[0, 1], wp.int32)
    found.steps = wp.cast(bits[0, 2], wp.int32)
    found.kind = wp.cast(bits[1, 0], wp.int32)
    found.u = bits[1, 1]
    found.v = bits[1, 2]
    found.normal = wp.vec3(bits[2, 0], bits[2, 1], bits[2, 2])
    return found


@wp.func
def record_coordinates(views: wp.array(dtype=GridView), index: int, found: GridHit, point: wp.vec3) -> wp.vec2:
    """Barycentrics of a hit in its triangle; -1 if that is one of many under a patch."""
    if found.kind == TRIANGLE:
        return brought_inside(found.u, found.v)
    if found.kind < LARGE:
        return wp.vec2(-1.0, -1.0)
    corners = views[index].faces[found.triangle]
    return barycentrics_at(
        views[index].vertices[corners[0]], views[index].vertices[corners[1]], views[index].vertices[corners[2]], point
    )


@wp.func
def closest_hit_exact(
    views: wp.array(dtype=GridView), index: int, origin: wp.vec3, direction: wp.vec3, t_max: float
) -> Hit:
    """The tracer's ``closest_hit`` by :func:`march_exact`."""
    scale = views[index].cells_per_unit
    hit = no_hit()
    found = march_exact(views, index, scale * origin + views[index].cell_offset, direction, scale * t_max)
    hit.steps = found.steps
    if found.triangle >= 0:
        hit.t = found.t / scale
        hit.triangle = found.triangle
        hit.normal = found.normal
        uv = record_coordinates(views, index, found, origin + hit.t * direction)
        hit.u = uv[0]
        hit.v = uv[1]
    return hit


@wp.func
def is_own_surface(hit: Hit, direction: wp.vec3, outwards: wp.vec3) -> bool:
    """Whether a ray that has just left a surface passes through what it meets to the same side as it left."""
    return wp.dot(hit.normal, direction) * wp.dot(hit.normal, outwards) > 0.0


@wp.func
def occluded_exact(
    views: wp.array(dtype=GridView), index: int, origin: wp.vec3, direction: wp.vec3, t_max: float, outwards: wp.vec3
) -> bool:
    """The tracer's ``occluded`` by :func:`march_exact`.

    A ray may start under the patches that stand for its own surface. It then passes through them from within, close to
    its start: those are not met.
    """
    side = 2.0 * views[index].half_patch / views[index].cells_per_unit
    own = wp.where(outwards == wp.vec3(0.0), 0.0, OWN_PATCHES * side)
    passed = float(0.0)
    while passed <= own:
        hit = closest_hit_exact(views, index, origin + passed * direction, direction, t_max - passed)
        if hit.triangle < 0:
            return False
        if passed + hit.t >= own or not is_own_surface(hit, direction, outwards):
            return True
        passed += hit.t + OWN_STEP * side
    return closest_hit_exact(views, index, origin + passed * direction, direction, t_max - passed).triangle >= 0


@wp.func
def stray_hit_exact(
    views: wp.array(dtype=GridView), index: int, origin: wp.vec3d, direction: wp.vec3, t_max: float
) -> Hit:
    """The tracer's ``stray_hit``."""
    return first_stray(views[index].strays, origin, direction, t_max)


@wp.func
def stray_count_exact(views: wp.array(dtype=GridView), index: int) -> int:
    """The tracer's ``stray_count``."""
    return views[index].strays.shape[0]


EXACT = Tracer("exact", GridView, closest_hit_exact, occluded_exact, stray_hit_exact, stray_count_exact)
