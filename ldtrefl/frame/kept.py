"""What stays from frame to frame when objects have moved and the camera has not.

Of what the camera sees: what stands still is drawn once, what moves is drawn over it. Of the reflections: a ray that is
the same as in the last frame, and could not meet a moved object then and cannot now, ends where it ended. So runs of
rays (``rays.py``) are compared, and only those that have changed are followed again.
"""

from __future__ import annotations

from collections.abc import Set
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from ldtrefl.device.launch import kernel, launch
from ldtrefl.frame.gbuffer import GBuffer, draw_gbuffer, resolved
from ldtrefl.frame.zbuffer import Drawing
from ldtrefl.scene.description import Camera
from ldtrefl.tracing.rays import RUN, HitBuffer, RayBuffer, bits_of, rays_of, regions_of_runs
from ldtrefl.world.device_scene import DeviceScene


@dataclass(frozen=True, eq=False)
class _Drawn:
    """The last frame, and what its drawing can be used for again."""

    scene: DeviceScene
    camera: Camera
    still: Drawing | None = None
    """What stands still."""
    moving: frozenset[int] = frozenset()
    """Objects that are not in it."""


class KeptDrawing:
    """G-buffers of frame after frame: while the camera stays, what stands still is drawn once."""

    def __init__(self) -> None:
        self._last: _Drawn | None = None

    def forget(self) -> None:
        """Start anew."""
        self._last = None

    def gbuffer(self, scene: DeviceScene, camera: Camera) -> GBuffer:
        """What ``camera`` sees of a scene that comes from the last one."""
        # What is kept changes at the end and at once: a frame that is stopped on the way leaves no half of it.
        everything = frozenset(range(len(scene.objects)))
        last, moved = self._last, everything
        if last is not None and last.camera == camera:
            # Pixels do not depend on device space: only what was placed anew has moved.
            before = last.scene.objects
            moved = frozenset(now.index for now in scene.objects if now.source is not before[now.index].source)
        if last is None or moved == everything:
            seen = draw_gbuffer(scene, camera)
            self._last = _Drawn(scene, camera)
            return seen
        still, moving = last.still, last.moving
        if still is None or not moved <= moving:
            still, moving = Drawing.empty(scene, camera), moved
            still.add(scene, camera, sorted(everything - moving))
        drawing = still.over()
        drawing.add(scene, camera, sorted(moving))
        seen = resolved(drawing, scene, camera)
        self._last = _Drawn(scene, camera, still, moving)
        return seen


@dataclass(frozen=True, eq=False)
class Followed:
    """Rays of the first bounce that have been followed."""

    rays: Any
    """The ``RayBuffer``, as it started."""
    regions: Any
    """The ``Regions``."""
    hits: Any
    """The ``HitBuffer`` of the first bounce."""
    radiance: wp.array
    """(h * w,) vec3: reflected radiance of every pixel."""

    def copied(self, rays: Any, regions: Any) -> Followed:
        """The same ends for other rays, to be written over: what a frame has handed out stays as it was."""
        hits = HitBuffer()
        for name in ("t", "object", "triangle", "barycentrics", "steps", "searches"):
            setattr(hits, name, wp.clone(getattr(self.hits, name)))
        return Followed(rays, regions, hits, wp.clone(self.radiance))


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
    radiance_out: wp.array(dtype=wp.vec3),  # black where they go
):
    i = first + wp.tid()
    k = numbers[i]
    part_out.pixel[i] = rays.pixel[k]
    part_out.origin[i] = rays.origin[k]
    part_out.direction[i] = rays.direction[k]
    part_out.weight[i] = rays.weight[k]
    part_out.source[i] = rays.source[k]
    radiance_out[rays.pixel[k]] = wp.vec3(0.0)


@kernel
def put_hits(
    first: int,
    # In:
    numbers: wp.array(dtype=wp.int32),
    part: HitBuffer,
    # Out:
    hits_out: HitBuffer,
):
    i = first + wp.tid()
    k = numbers[i]
    hits_out.t[k] = part.t[i]
    hits_out.object[k] = part.object[i]
    hits_out.triangle[k] = part.triangle[i]
    hits_out.barycentrics[k] = part.barycentrics[i]
    hits_out.steps[k] = part.steps[i]
    hits_out.searches[k] = part.searches[i]


def changed_runs(before: Followed, rays: Any, regions: Any, moved: Set[int]) -> np.ndarray | None:
    """(m,) numbers of the runs that must be followed again; None if nothing is known: other pixels see reflectors, or
    the rays were not culled by runs."""
    if regions.bits.shape[1] == 0 or regions.rows.shape[0] or regions.bits.shape != before.regions.bits.shape:
        return None
    if not np.array_equal(rays.pixel.numpy(), before.rays.pixel.numpy()):
        return None
    device, runs = rays.pixel.device, regions.bits.shape[0]
    moved_bits = wp.array(bits_of(moved, 32 * regions.bits.shape[1]), dtype=wp.uint32, device=device)
    flags = wp.empty(runs, dtype=wp.uint8, device=device)
    inputs = [rays, before.rays, regions.bits, before.regions.bits, moved_bits, flags]
    launch(find_changed_runs, runs, inputs, device)
    return np.flatnonzero(flags.numpy())


def rays_of_runs(followed: Followed, runs: np.ndarray) -> tuple[wp.array, Any, Any]:
    """(numbers of the rays of some runs, those rays, their regions); their pixels are made black."""
    device, numbers = followed.rays.pixel.device, rays_of(runs, followed.rays.pixel.shape[0])
    chosen, n = wp.array(numbers.astype(np.int32), dtype=wp.int32, device=device), len(numbers)
    part = RayBuffer()
    part.pixel, part.source = (wp.empty(n, dtype=wp.int32, device=device) for _ in range(2))
    part.origin = wp.empty(n, dtype=wp.vec3d, device=device)
    part.direction, part.weight = (wp.empty(n, dtype=wp.vec3, device=device) for _ in range(2))
    launch(take_rays, n, [chosen, followed.rays, part, followed.radiance], device)
    bits = wp.array(followed.regions.bits.numpy()[runs], dtype=wp.uint32, device=device)
    return chosen, part, regions_of_runs(bits)
