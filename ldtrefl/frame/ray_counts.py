"""What the rays of a bounce cost, counted where they are: only four numbers come to the host."""

from __future__ import annotations

from dataclasses import dataclass

import warp as wp

from ldtrefl.device import launch
from ldtrefl.device.atomics import add_to
from ldtrefl.tracing.ray_buffers import HitBuffer, RayBuffer

IN_A_ROW = 4096
"""Rays that one thread of a CPU counts."""

IN_A_ROW_ON_CUDA = 64
"""The same of CUDA."""


@dataclass(frozen=True)
class RayCounts:
    """Sums over the rays of a bounce."""

    alive: int
    """Rays that are on their way."""
    returning: int
    """Of those, the ones that may meet the object that they leave."""
    searches: int
    steps: int


@launch.kernel
def count_rays(
    first: int,
    # In:
    block: int,
    source: wp.array(dtype=wp.int32),
    may_return: wp.array(dtype=wp.uint8),
    searches: wp.array(dtype=wp.int32),
    steps: wp.array(dtype=wp.int32),
    # In and out:
    sums: wp.array(dtype=wp.int64),
):
    """Count a block of rays, and add it to the sums of all."""
    begin = block * (first + wp.tid())
    alive, returning, searched, stepped = int(0), int(0), wp.int64(0), wp.int64(0)
    for i in range(begin, wp.min(begin + block, source.shape[0])):
        if source[i] >= 0:
            alive += 1
            returning += int(may_return[i])
        searched += wp.int64(searches[i])
        stepped += wp.int64(steps[i])
    add_to(sums, 0, wp.int64(alive))
    add_to(sums, 1, wp.int64(returning))
    add_to(sums, 2, searched)
    add_to(sums, 3, stepped)


def counts_of(rays: RayBuffer, hits: HitBuffer) -> RayCounts:
    """The sums over rays, and over where they end."""
    device, count = rays.source.device, rays.source.shape[0]
    block = IN_A_ROW if device.is_cpu else IN_A_ROW_ON_CUDA
    sums = wp.zeros(4, dtype=wp.int64, device=device)
    inputs = [block, rays.source, rays.may_return, hits.searches, hits.steps, sums]
    launch.launch(count_rays, -(-count // block), inputs, device)
    return RayCounts(*sums.numpy().tolist())
