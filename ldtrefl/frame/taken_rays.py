"""Some rays of a buffer, in a buffer of their own: those that go on, or that are followed again."""

from __future__ import annotations

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.tracing.ray_buffers import RayBuffer, copy_ray, empty_rays


@launch.kernel
def take_rays(
    first: int,
    # In:
    numbers: wp.array(dtype=wp.int32),
    rays: RayBuffer,
    # Out:
    part_out: RayBuffer,
):
    """Copy one of the rays."""
    i = first + wp.tid()
    copy_ray(rays, numbers[i], part_out, i)


def taken(rays: RayBuffer, numbers: np.ndarray) -> RayBuffer:
    """The rays of these (m,) numbers, in their order."""
    device, count = rays.pixel.device, len(numbers)
    chosen = wp.array(numbers.astype(np.int32), dtype=wp.int32, device=device)
    part = empty_rays(count, device, carries_footprints=rays.footprint.shape[0] > 0)
    launch.launch(take_rays, count, [chosen, rays, part], device)
    return part
