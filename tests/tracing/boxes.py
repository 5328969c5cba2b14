"""Boxes in a row, and where rays meet them, by the slab test in float64."""

from __future__ import annotations

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.scene.description import Camera, Object, Scene
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
