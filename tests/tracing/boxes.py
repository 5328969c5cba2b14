"""Boxes in a row, and where rays meet them, by the slab test in float64."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.scene.description import Camera, Object, Scene
from ldtrefl.tracing.object_sets import RUN, ObjectSets, run_count
from ldtrefl.tracing.ray_buffers import RayBuffer, empty_rays
from ldtrefl.world.device_scene import DeviceScene

HALF = 0.3
"""Half of a box's side."""


def scene_of(places: np.ndarray) -> DeviceScene:
    """Boxes at (n, 3) places, on a device."""
    camera = Camera(eye=(0, -9, 0), look_at=(0, 0, 0), width=4, height=4)
    boxes = tuple(Object(shape="box", scale=HALF, translate=tuple(place)) for place in places.tolist())
    return DeviceScene(Scene(camera=camera, objects=boxes), launch.resolve_device(None))


def rays_of(scene: DeviceScene, origins: np.ndarray, directions: np.ndarray, source: np.ndarray) -> RayBuffer:
    """Rays of the world, (n, 3), that leave the objects ``source``, (n,)."""
    rays, matrix = empty_rays(len(origins), scene.device), scene.device_from_world
    starts = origins @ matrix[:3, :3].T + matrix[:3, 3]
    rays.origin = wp.array(starts, dtype=wp.vec3d, device=scene.device)
    rays.direction = wp.array(directions.astype(np.float32), dtype=wp.vec3, device=scene.device)
    rays.source = wp.array(source.astype(np.int32), dtype=wp.int32, device=scene.device)
    rays.may_return.zero_()
    return rays


def distances(origins: np.ndarray, directions: np.ndarray, places: np.ndarray) -> np.ndarray:
    """(rays, boxes) distance at which each ray enters each box from outside; inf where it does not."""
    sides = (places + np.array([-HALF, HALF])[:, None, None, None] - origins[:, None]) / directions[:, None]
    enter, leave = sides.min(axis=0).max(axis=-1), sides.max(axis=0).min(axis=-1)
    return np.where((enter > 0) & (enter < leave), enter, np.inf)


def sets_of_rays(objects: Sequence[Collection[int]], device: wp.Device) -> ObjectSets:
    """Lists in which each ray can meet these objects."""
    lists: list[dict[int, int]] = [{} for _ in range(run_count(len(objects)))]
    for i, mine in enumerate(objects):
        for k in mine:
            lists[i // int(RUN)][k] = lists[i // int(RUN)].get(k, 0) | 1 << i % int(RUN)
    counts = np.array([len(one) for one in lists])
    sets = ObjectSets()
    for name, values in (("start", np.cumsum(counts) - counts), ("count", counts)):
        setattr(sets, name, wp.array(values, dtype=wp.int32, device=device))
    numbers, bits = [k for one in lists for k in one], [bits for one in lists for bits in one.values()]
    sets.object = wp.array(np.array(numbers, np.int32), dtype=wp.int32, device=device)
    sets.rays = wp.array(np.array(bits, np.uint64), dtype=wp.uint64, device=device)
    return sets
