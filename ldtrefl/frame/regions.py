"""Reflection regions: which objects each reflected ray can meet.

The test looks at the rays themselves, of any bounce. Rays come in runs that stand together on the screen
(``tracing/object_sets.py``): the origins of a run lie in a ball, its directions in a cone. The scene's top level
(``world/top_level.py``) is gone down for a run: what no ray of such a cone can meet is dropped for all of them at once,
and an object that is left is listed with those rays of the run that meet its bounding sphere (``run_rays.py``). So
nothing is lost, whatever the normals, and the cost follows the pixels and what they show, not the reflector's triangles
nor the number of objects. The paper's own test is in ``flat_regions.py``.

All in device space.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.device.bits import lowest_bit
from ldtrefl.device.stats import Stats
from ldtrefl.frame.gbuffer import GBuffer
from ldtrefl.frame.run_lists import RunLists, listed, set_entry, swap_entries
from ldtrefl.frame.run_rays import ROWS, lay_side_by_side, rays_near
from ldtrefl.geometry.sphere import sphere_entry
from ldtrefl.geometry.vectors import from_to
from ldtrefl.tracing.closest_hits import GROUP
from ldtrefl.tracing.object_sets import RUN, ObjectSets, all_sets, run_count
from ldtrefl.tracing.ray_buffers import RayBuffer
from ldtrefl.world.device_scene import DeviceScene
from ldtrefl.world.top_level import STACK, TopLevel

FEW_OBJECTS = 8
"""Up to this many objects culling costs as much as it saves: 4% more time than without it with two to five objects, 11%
less with fifty."""

COSINE_SLACK = wp.constant(1.0e-5)
"""Cosines are lowered by this, which widens cones: a hundred roundings of a float32 dot product."""


@wp.struct
class RunBounds:
    """A ball about the origins of some rays, and a cone about their directions."""

    middle: wp.vec3d
    reach: float  # radius of the ball
    axis: wp.vec3
    cosine: float  # of the cone's half-angle; -1 if nothing is known


@wp.func
def bounds_of_run(rays: RayBuffer, begin: int, end: int) -> RunBounds:
    """The bounds of the rays from ``begin`` to ``end`` that are alive."""
    middle = wp.vec3d(wp.float64(0.0))
    axis = wp.vec3(0.0)
    alive = int(0)
    for i in range(begin, end):
        if rays.source[i] >= 0:
            middle += rays.origin[i]
            axis += rays.direction[i]
            alive += 1
    bounds = RunBounds()
    bounds.middle = middle / wp.float64(wp.max(alive, 1))
    bounds.axis = wp.normalize(axis)
    bounds.cosine = 1.0
    for i in range(begin, end):
        if rays.source[i] >= 0:
            bounds.reach = wp.max(bounds.reach, wp.length(from_to(bounds.middle, rays.origin[i])))
            bounds.cosine = wp.min(bounds.cosine, wp.dot(rays.direction[i], bounds.axis))
    bounds.cosine = wp.max(bounds.cosine - COSINE_SLACK, -1.0)
    return bounds


@wp.func
def may_meet(bounds: RunBounds, centre: wp.vec3d, radius: float) -> bool:
    """Whether a ray from the ball along a direction of the cone may meet a sphere; False only if none can."""
    # All rays are taken to start at the ball's middle; the sphere is widened for that by the ball's radius.
    towards = from_to(bounds.middle, centre)
    apart = wp.length(towards)
    widened = radius + bounds.reach
    if apart <= widened or bounds.cosine <= 0.0:
        return True
    # The angle between the axis and the sphere's centre is at most the cone's half-angle and the sphere's together.
    sphere_sine = widened / apart
    sphere_cosine = wp.sqrt(1.0 - sphere_sine * sphere_sine)
    sine = wp.sqrt(1.0 - bounds.cosine * bounds.cosine)
    least = bounds.cosine * sphere_cosine - sine * sphere_sine
    return wp.dot(bounds.axis, towards) >= (least - COSINE_SLACK) * apart


@wp.func
def without_own(rays: RayBuffer, begin: int, met: wp.uint64, k: int) -> wp.uint64:
    """The rays from ``begin`` on, a bit each, but for those that leave object ``k`` and cannot come back to it."""
    others = met
    left = met
    while left != wp.uint64(0):
        bit = lowest_bit(left)
        left = left & (left - wp.uint64(1))
        if rays.source[begin + bit] == k and rays.may_return[begin + bit] == wp.uint8(0):
            others = others & ~(wp.uint64(1) << wp.uint64(bit))
    return others


@wp.func
def rays_alive(rays: RayBuffer, begin: int, end: int) -> wp.uint64:
    """The rays from ``begin`` to ``end`` that are alive, a bit each."""
    alive = wp.uint64(0)
    for i in range(begin, end):
        if rays.source[i] >= 0:
            alive = alive | (wp.uint64(1) << wp.uint64(i - begin))
    return alive


@wp.func
def put_in_order(lists: RunLists, begin: int, count: int):
    """Sort a list by where its objects are entered, by Shell's method (1959)."""
    gap = count // 2
    while gap > 0:
        for i in range(gap, count):
            j = int(i)
            while j >= gap and lists.entry[begin + j - gap] > lists.entry[begin + j]:
                swap_entries(lists, begin + j - gap, begin + j)
                j -= gap
        gap = gap // 2


@launch.kernel
def cull_runs(
    first: int,
    # In:
    rays: RayBuffer,
    top: TopLevel,
    pixel_triangle: wp.array(dtype=wp.int32),
    first_rows: wp.array(dtype=wp.int32),
    room: int,
    # In and out:
    lists: RunLists,
    # Out, whoever writes it: 1 for objects that are listed
    shown_out: wp.array(dtype=wp.uint8),
    # Out, unless it is empty: 1 for the reflectors' triangles in runs that show an object, whoever writes it
    shows_out: wp.array(dtype=wp.uint8),
):
    """List the objects that the rays of one run can meet, up to ``room``, and count all of them."""
    run = first + wp.tid()
    begin, end = RUN * run, wp.min(RUN * run + RUN, rays.source.shape[0])
    bounds = bounds_of_run(rays, begin, end)
    row_memory = wp.zeros(shape=ROWS, dtype=wp.float32)
    rows = wp.array(ptr=row_memory.ptr, shape=(ROWS,), dtype=wp.float32)
    lay_side_by_side(rays, begin, end, bounds.middle, rows)
    nodes, masks = wp.zeros(shape=STACK, dtype=wp.int32), wp.zeros(shape=STACK, dtype=wp.uint64)
    nodes[0] = top.root
    masks[0] = rays_alive(rays, begin, end)
    waiting = wp.where(top.root >= 0 and masks[0] != wp.uint64(0), 1, 0)
    found = int(0)
    while waiting > 0:
        waiting -= 1
        asked = masks[waiting]
        node = top.nodes[nodes[waiting]]
        for number in range(node.first, node.first + node.count):
            child = top.nodes[number]
            if may_meet(bounds, child.centre, child.radius):
                met = rays_near(rows, bounds.middle, bounds.reach, child.centre, child.radius, asked)
                if child.count == 0:
                    met = without_own(rays, begin, met, child.first)
                if met != wp.uint64(0) and child.count > 0:
                    nodes[waiting] = number
                    masks[waiting] = met
                    waiting += 1
                elif met != wp.uint64(0):
                    shown_out[child.first] = wp.uint8(1)
                    if found < room:
                        i = begin + lowest_bit(met)
                        entry = sphere_entry(rays.origin[i], rays.direction[i], child.centre, child.radius)
                        set_entry(lists, lists.start[run] + found, child.first, met, entry)
                    found += 1
    lists.count[run] = found
    if found > GROUP and found <= room:
        put_in_order(lists, lists.start[run], found)
    if found > 0 and shows_out.shape[0] > 0:
        for i in range(begin, end):
            if rays.source[i] >= 0:
                shows_out[first_rows[rays.source[i]] + pixel_triangle[rays.pixel[i]]] = wp.uint8(1)


@dataclass(frozen=True, eq=False)
class Regions:
    """What the rays of a bounce can meet."""

    sets: ObjectSets
    """The objects that each ray can meet."""
    shown: set[int]
    """Objects that at least one ray can meet."""


def objects_that_rays_meet(scene: DeviceScene, rays: RayBuffer) -> set[int]:
    """Objects that rays may meet, if each may meet every object, but its own only where it can come back to it."""
    mirrors = {entry.index for entry in scene.reflectors}
    # If all rays leave the only mirror and none can come back, none meets it.
    is_left_alone = len(mirrors) == 1 and not rays.may_return.numpy().any()
    return set(range(len(scene.objects))) - (mirrors if is_left_alone else set()) if mirrors else set()


def all_objects(scene: DeviceScene, rays: RayBuffer) -> Regions:
    """Every ray may meet every object, but its own only where it can come back to it."""
    return Regions(all_sets(scene.device), objects_that_rays_meet(scene, rays))


def safe_regions(gbuffer: GBuffer, rays: RayBuffer, bounce: int, stats: Stats) -> Regions:
    """Test the rays of a bounce, 0 the first.

    Counts ``triangles_tested``, which are those of all reflectors, and ``triangles_culled``, which are those that the
    camera does not see or in which no object can be seen.
    """
    scene, device = gbuffer.scene, gbuffer.scene.device
    first_rows, total = scene.reflector_rows
    shows = wp.zeros(total if bounce == 0 else 0, dtype=wp.uint8, device=device)
    shown = wp.zeros(len(scene.objects), dtype=wp.uint8, device=device)

    def fill(lists: RunLists, room: int) -> None:
        inputs = [rays, scene.top_level, gbuffer.view.triangle, first_rows, room, lists, shown, shows]
        launch.launch(cull_runs, lists.start.shape[0], inputs, device)

    sets = listed(run_count(rays.source.shape[0]), len(scene.objects), device, fill)
    if bounce == 0:
        stats.count("triangles_tested", total)
        stats.count("triangles_culled", total - int(np.count_nonzero(shows.numpy())))
    return Regions(sets, set(np.flatnonzero(shown.numpy()).tolist()))
