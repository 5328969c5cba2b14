"""Reflection regions: which objects each reflected ray can meet.

The test looks at the rays themselves, of any bounce. Rays come in runs that stand together on the screen
(``tracing/object_sets.py``): the origins of a run lie in a ball, its directions in a cone. An object whose bounding
sphere no ray of such a cone can meet is dropped for all of them at once; one that is left is kept if a ray of the run
does meet the sphere. So nothing is lost, whatever the normals, and the cost follows the pixels, not the reflector's
triangles. The paper's own test is in ``flat_regions.py``.

All in device space.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.device.stats import Stats
from ldtrefl.frame.gbuffer import GBuffer
from ldtrefl.geometry.sphere import meets_sphere
from ldtrefl.geometry.vectors import from_to
from ldtrefl.tracing.object_sets import RUN, ObjectSets, objects_in, run_count, sets_of_runs, word_count
from ldtrefl.tracing.ray_buffers import RayBuffer
from ldtrefl.world.device_scene import DeviceScene
from ldtrefl.world.records import ObjectRecord

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


@launch.kernel
def cull_runs(
    first: int,
    # In:
    rays: RayBuffer,
    objects: wp.array(dtype=ObjectRecord),
    pixel_triangle: wp.array(dtype=wp.int32),
    first_rows: wp.array(dtype=wp.int32),
    # Out: bit k % 32 of word k / 32 is set if a ray of the run meets the sphere of object k
    bits_out: wp.array2d(dtype=wp.uint32),
    # Out, unless it is empty: 1 for the reflectors' triangles in runs that show an object, whoever writes it
    shows_out: wp.array(dtype=wp.uint8),
):
    """Find the objects that the rays of one run can meet."""
    run = first + wp.tid()
    begin, end = RUN * run, wp.min(RUN * run + RUN, rays.source.shape[0])
    bounds = bounds_of_run(rays, begin, end)
    shows_any = bool(False)
    for word in range(bits_out.shape[1]):
        bits = wp.uint32(0)
        for k in range(32 * word, wp.min(32 * word + 32, objects.shape[0])):
            centre, radius = objects[k].centre, objects[k].radius
            if may_meet(bounds, centre, radius):
                i = int(begin)
                while i < end:
                    if (
                        rays.source[i] >= 0
                        and (rays.source[i] != k or rays.may_return[i] != wp.uint8(0))
                        and meets_sphere(rays.origin[i], rays.direction[i], centre, radius)
                    ):
                        bits = bits | (wp.uint32(1) << wp.uint32(k % 32))
                        i = end
                    i += 1
        bits_out[run, word] = bits
        shows_any = shows_any or bits != wp.uint32(0)
    if shows_any and shows_out.shape[0] > 0:
        for i in range(begin, end):
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
    sets = sets_of_runs(wp.empty((0, 0), dtype=wp.uint32, device=scene.device))
    return Regions(sets, objects_that_rays_meet(scene, rays))


def safe_regions(gbuffer: GBuffer, rays: RayBuffer, bounce: int, stats: Stats) -> Regions:
    """Test the rays of a bounce, 0 the first.

    Counts ``triangles_tested``, which are those of all reflectors, and ``triangles_culled``, which are those that the
    camera does not see or in which no object can be seen.
    """
    scene, device = gbuffer.scene, gbuffer.scene.device
    runs, count = run_count(rays.source.shape[0]), len(scene.objects)
    bits = wp.empty((runs, word_count(count)), dtype=wp.uint32, device=device)
    first_rows, total = scene.reflector_rows
    shows = wp.zeros(total if bounce == 0 else 0, dtype=wp.uint8, device=device)
    inputs = [rays, scene.records, gbuffer.view.triangle, first_rows, bits, shows]
    launch.launch(cull_runs, runs, inputs, device)
    if bounce == 0:
        stats.count("triangles_tested", total)
        stats.count("triangles_culled", total - int(np.count_nonzero(shows.numpy())))
    return Regions(sets_of_runs(bits), objects_in(bits.numpy(), count))
