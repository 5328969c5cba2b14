"""Following again only the rays that may end elsewhere than in the last frame.

A ray that is the same as in the last frame, and could not meet a moved object then and cannot now, ends where it ended.
If it was mirrored there, it may have met anything after that, and is followed again. So runs of rays
(``tracing/object_sets.py``) are compared, and only the rays of those that have changed are followed.
"""

from __future__ import annotations

from collections.abc import Set

import numpy as np
import warp as wp

from ldtrefl.device.launch import kernel, launch
from ldtrefl.frame.bounces import FollowedRays, LaterBounce, RayFollower
from ldtrefl.frame.history import Reusable
from ldtrefl.frame.regions import Regions
from ldtrefl.frame.taken_rays import taken
from ldtrefl.geometry.footprint import is_same_footprint
from ldtrefl.tracing.object_sets import RUN, ObjectSets, object_listed, rays_of, sets_for_runs
from ldtrefl.tracing.ray_buffers import HitBuffer, RayBuffer, cloned, copy_hit


@kernel
def find_changed_runs(
    first: int,
    # In:
    rays: RayBuffer,
    before: RayBuffer,
    sets: ObjectSets,
    sets_before: ObjectSets,
    moved: wp.array(dtype=wp.uint8),  # 1 for the objects that have
    source_onwards: wp.array(dtype=wp.int32),  # of the rays before, after their first bounce
    # Out:
    changed_out: wp.array(dtype=wp.uint8),
):
    """Find out whether one run has changed."""
    run = first + wp.tid()
    changed = bool(False)
    for entry in range(sets.count[run]):
        changed = changed or moved[object_listed(sets, run, entry)] != wp.uint8(0)
    for entry in range(sets_before.count[run]):
        changed = changed or moved[object_listed(sets_before, run, entry)] != wp.uint8(0)
    i = int(RUN * run)
    while i < wp.min(RUN * run + RUN, rays.source.shape[0]) and not changed:
        same = rays.source[i] == before.source[i] and rays.origin[i] == before.origin[i]
        changed = not (same and rays.direction[i] == before.direction[i]) or source_onwards[i] >= 0
        if rays.footprint.shape[0] > 0:
            changed = changed or not is_same_footprint(rays.footprint[i], before.footprint[i])
        i += 1
    changed_out[run] = wp.where(changed, wp.uint8(1), wp.uint8(0))


@kernel
def put_back(
    first: int,
    # In:
    numbers: wp.array(dtype=wp.int32),
    part: HitBuffer,
    part_radiance: wp.array(dtype=wp.vec3),
    part_source_onwards: wp.array(dtype=wp.int32),
    # Out:
    hits_out: HitBuffer,
    radiance_out: wp.array(dtype=wp.vec3),
    source_onwards_out: wp.array(dtype=wp.int32),
):
    """Write where one ray that was followed again ends, what it brings, and whether it goes on there."""
    i = first + wp.tid()
    copy_hit(part, i, hits_out, numbers[i])
    radiance_out[numbers[i]] = part_radiance[i]
    source_onwards_out[numbers[i]] = part_source_onwards[i]


def changed_runs(
    before: FollowedRays, rays: RayBuffer, regions: Regions, moved: Set[int], objects: int
) -> np.ndarray | None:
    """(m,) numbers of the runs that must be followed again; None if nothing is known: other pixels see reflectors, or
    the rays were not culled by runs."""
    sets = regions.sets
    runs = sets.start.shape[0]
    if runs == 0 or runs != before.sets.start.shape[0]:
        return None
    if not np.array_equal(rays.pixel.numpy(), before.rays.pixel.numpy()):
        return None
    device, has_moved = rays.pixel.device, np.zeros(objects, np.uint8)
    has_moved[sorted(moved)] = 1
    flags = wp.empty(runs, dtype=wp.uint8, device=device)
    inputs = [rays, before.rays, sets, before.sets, wp.array(has_moved, dtype=wp.uint8, device=device)]
    inputs += [before.source_onwards, flags]
    launch(find_changed_runs, runs, inputs, device)
    return np.flatnonzero(flags.numpy())


def followed_with_history(
    follower: RayFollower, rays: RayBuffer, regions: Regions, reusable: Reusable | None
) -> FollowedRays:
    """Where rays end, taken from the last frame but for rays that may end elsewhere; all are followed if none of it
    can be used, as with shadows and occlusion, which what has moved may cast anywhere."""
    before, scene = None if reusable is None else reusable.reflected.followed, follower.gbuffer.scene
    if reusable is None or before is None or scene.scene.lighting.is_traced:
        return follower.follow(rays, regions)
    with follower.stats.stage("cull", scene.device):
        runs = changed_runs(before, rays, regions, reusable.moved, len(scene.objects))
    return follower.follow(rays, regions) if runs is None else follow_changed(follower, before, rays, regions, runs)


def follow_changed(
    follower: RayFollower, before: FollowedRays, rays: RayBuffer, regions: Regions, runs: np.ndarray
) -> FollowedRays:
    """Rays of which all but those in ``runs`` bring what they brought ``before``, which stays as it was."""
    device = rays.pixel.device
    numbers = rays_of(runs, rays.pixel.shape[0])
    count = len(numbers)
    hits, radiance, source_onwards = (
        cloned(HitBuffer, before.hits),
        wp.clone(before.radiance),
        wp.clone(before.source_onwards),
    )
    later: tuple[LaterBounce, ...] = ()  # what was mirrored again is followed again
    if count:
        part, chosen = taken(rays, numbers), wp.array(numbers.astype(np.int32), dtype=wp.int32, device=device)
        again = follower.follow(part, Regions(sets_for_runs(regions.sets, runs), regions.shown))
        inputs = [chosen, again.hits, again.radiance, again.source_onwards, hits, radiance, source_onwards]
        launch(put_back, count, inputs, device)
        later = tuple(LaterBounce(numbers[bounce.numbers], bounce.ends) for bounce in again.later)
    follower.stats.count("rays_kept", rays.pixel.shape[0] - count)
    return FollowedRays(rays, regions.sets, hits, radiance, source_onwards, later)
