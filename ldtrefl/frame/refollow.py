"""Following again only the rays that may end elsewhere than in the last frame.

A ray that is the same as in the last frame, and could not meet a moved object then and cannot now, ends where it ended.
So runs of rays (``tracing/object_sets.py``) are compared, and only the rays of those that have changed are followed.
"""

from __future__ import annotations

from collections.abc import Set

import numpy as np
import warp as wp

from ldtrefl.device.launch import kernel, launch
from ldtrefl.frame.bounces import FollowedRays, RayFollower
from ldtrefl.frame.regions import Regions
from ldtrefl.tracing.object_sets import RUN, bits_of, rays_of, sets_of_runs
from ldtrefl.tracing.ray_buffers import HitBuffer, RayBuffer, cloned, copy_hit, copy_ray, empty_hits, empty_rays


@kernel
def find_changed_runs(
    first: int,
    # In:
    rays: RayBuffer,
    before: RayBuffer,
    bits: wp.array2d(dtype=wp.uint32),
    bits_before: wp.array2d(dtype=wp.uint32),
    moved: wp.array(dtype=wp.uint32),
    # Out:
    changed_out: wp.array(dtype=wp.uint8),
):
    """Find out whether one run has changed."""
    run = first + wp.tid()
    changed = bool(False)
    for word in range(moved.shape[0]):
        seen = bits[run, word] | bits_before[run, word]
        changed = changed or (seen & moved[word]) != wp.uint32(0)
    i = int(RUN * run)
    while i < wp.min(RUN * run + RUN, rays.source.shape[0]) and not changed:
        same = rays.source[i] == before.source[i] and rays.origin[i] == before.origin[i]
        changed = not (same and rays.direction[i] == before.direction[i])
        i += 1
    changed_out[run] = wp.where(changed, wp.uint8(1), wp.uint8(0))


@kernel
def take_rays(
    first: int,
    # In:
    numbers: wp.array(dtype=wp.int32),
    rays: RayBuffer,
    # Out:
    part_out: RayBuffer,
):
    """Copy one ray to be followed again."""
    i = first + wp.tid()
    copy_ray(rays, numbers[i], part_out, i)


@kernel
def put_back(
    first: int,
    # In:
    numbers: wp.array(dtype=wp.int32),
    part: HitBuffer,
    part_radiance: wp.array(dtype=wp.vec3),
    # Out:
    hits_out: HitBuffer,
    radiance_out: wp.array(dtype=wp.vec3),
):
    """Write where one ray that was followed again ends, and what it brings."""
    i = first + wp.tid()
    copy_hit(part, i, hits_out, numbers[i])
    radiance_out[numbers[i]] = part_radiance[i]


def changed_runs(before: FollowedRays, rays: RayBuffer, regions: Regions, moved: Set[int]) -> np.ndarray | None:
    """(m,) numbers of the runs that must be followed again; None if nothing is known: other pixels see reflectors, or
    the rays were not culled by runs."""
    sets = regions.sets
    if sets.bits.shape[1] == 0 or sets.rows.shape[0] or sets.bits.shape != before.sets.bits.shape:
        return None
    if not np.array_equal(rays.pixel.numpy(), before.rays.pixel.numpy()):
        return None
    device, runs = rays.pixel.device, sets.bits.shape[0]
    moved_bits = wp.array(bits_of(moved, 32 * sets.bits.shape[1]), dtype=wp.uint32, device=device)
    flags = wp.empty(runs, dtype=wp.uint8, device=device)
    inputs = [rays, before.rays, sets.bits, before.sets.bits, moved_bits, flags]
    launch(find_changed_runs, runs, inputs, device)
    return np.flatnonzero(flags.numpy())


def follow_changed(
    follower: RayFollower, before: FollowedRays, rays: RayBuffer, regions: Regions, runs: np.ndarray
) -> FollowedRays:
    """Rays of one bounce of which all but those in ``runs`` end as they did ``before``, which stays as it was."""
    device = rays.pixel.device
    followed = FollowedRays(rays, regions.sets, cloned(HitBuffer, before.hits), wp.clone(before.radiance))
    numbers = rays_of(runs, rays.pixel.shape[0])
    count = len(numbers)
    if count:
        chosen = wp.array(numbers.astype(np.int32), dtype=wp.int32, device=device)
        part, hits = empty_rays(count, device), empty_hits(count, device)
        radiance = wp.zeros(count, dtype=wp.vec3, device=device)
        launch(take_rays, count, [chosen, rays, part], device)
        bits = wp.array(regions.sets.bits.numpy()[runs], dtype=wp.uint32, device=device)
        follower.bounce(part, Regions(sets_of_runs(bits), regions.shown), hits, radiance, is_last=True)
        launch(put_back, count, [chosen, hits, radiance, followed.hits, followed.radiance], device)
    follower.stats.count("rays_kept", rays.pixel.shape[0] - count)
    return followed
