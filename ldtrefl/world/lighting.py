"""Lights and environment on a device, in device space."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from ldtrefl.scene.description import Light, Scene
from ldtrefl.scene.presets.base import DistantLight
from ldtrefl.world.blue_noise import blue_noise
from ldtrefl.world.environment_frame import world_from_environment
from ldtrefl.world.records import LightingRecord, LightRecord, ShapedLightRecord
from ldtrefl.world.shaped_lights import SHAPED, distant_rectangle, has_soft_light, shaped_light

FARTHEST = 1e30
"""Distance in device units up to which what dims ambient light may stand: beyond all that there is."""

BRIGHTEST = 1e30
"""Intensity of a point light in device units: what is brighter is white all the same, and this is finite in float32."""


def lighting_of(
    scene: Scene, device_from_world: np.ndarray, decoded: wp.array, device: wp.Device, before: LightingRecord | None
) -> LightingRecord:
    """The environment of a scene, and what its lights share. What depends on the camera's ``up``, the lights among it,
    is left out: :func:`stand_up` sets it before every frame.

    Args:
        scene: what has them.
        device_from_world: (4, 4).
        decoded: (256,) float32, the linear value of every byte.
        device: where they are read.
        before: another record with the same environment picture, which is then used again; or None.
    """
    record = LightingRecord()
    noise = blue_noise() if has_soft_light(scene) else np.empty((0, 0), np.float32)
    record.noise = wp.array(noise, dtype=float, device=device, copy=False)
    record.ambient = wp.vec3(*scene.ambient)
    record.sky, record.ground = wp.vec3(*scene.environment.sky), wp.vec3(*scene.environment.ground)
    if before is not None:
        for name in ("image_size", "image", "image_bytes"):
            setattr(record, name, getattr(before, name))
    else:
        image = None if scene.environment_image is None else scene.environment_image.pixels
        record.image_size = wp.vec2i(0, 0) if image is None else wp.vec2i(*image.shape[:2])
        for name, kind, dtype in (("image", np.float32, wp.vec3), ("image_bytes", np.uint8, wp.vec3ub)):
            own = image if image is not None and image.dtype == kind else np.empty((0, 0, 3), kind)
            setattr(record, name, wp.array(own, dtype=dtype, device=device, copy=False))
    record.decoded = decoded
    record.shadows = int(scene.lighting.shadows)
    if (occlusion := scene.lighting.occlusion) is not None:
        record.occlusion_distance = min(occlusion.distance * float(device_from_world[0, 0]), FARTHEST)
        record.occlusion_samples = occlusion.samples
    record.turn, record.strength = scene.environment.rotation / 360.0 % 1.0, scene.environment.strength
    return record


def stand_up(
    record: LightingRecord, scene: Scene, up: np.ndarray, device_from_world: np.ndarray, samples: int, device: wp.Device
) -> None:
    """Turn the environment and the lights that it brings along to a camera's ``up``, a (3,) unit vector; ``samples``
    are those of a pixel, at most."""
    if record.lights is not None and tuple(record.up) == tuple(wp.vec3(*up)):
        return
    record.up = wp.vec3(*up)
    lights = [_light(light, device_from_world) for light in scene.lights if light.kind not in SHAPED]
    shaped = [shaped_light(light, device_from_world) for light in scene.lights if light.kind in SHAPED]
    surroundings, strength = scene.environment.surroundings, scene.environment.strength
    if surroundings is not None:
        to_world = world_from_environment(up, scene.environment.rotation)
        lights += [_distant(light, to_world, strength) for light in surroundings.lights]
        shaped += [distant_rectangle(light, to_world, strength, samples) for light in surroundings.rectangles]
        if surroundings.disc is not None:
            record.sun = wp.vec3(*(to_world @ surroundings.disc.towards))
            record.sun_size = (2.0 * np.sin(surroundings.disc.radius / 2.0)) ** 2
            record.sun_radiance = strength * wp.vec3(*surroundings.disc.radiance)
    record.lights, record.shaped = _on(device, lights, LightRecord), _on(device, shaped, ShapedLightRecord)


def _on(device: wp.Device, records: list[Any], kind: type) -> wp.array:
    """Records as an array of a device; Warp makes none of an empty list."""
    return wp.array(records, dtype=kind, device=device) if records else wp.empty(0, dtype=kind, device=device)


def _distant(light: DistantLight, world_from_own: np.ndarray, strength: float) -> LightRecord:
    """A light of the environment."""
    record = LightRecord()
    record.towards = wp.vec3(*(world_from_own @ light.towards))
    record.radiance = strength * wp.vec3(*light.radiance)
    return record


def _light(light: Light, device_from_world: np.ndarray) -> LightRecord:
    """A light in device space."""
    record = LightRecord()
    record.is_point = int(light.kind == "point")
    if light.position is not None and light.intensity is not None:
        record.position = wp.vec3d(*(device_from_world @ [*light.position, 1.0])[:3])
        device_units_per_world_unit = float(device_from_world[0, 0])
        intensity = np.asarray(light.intensity) * device_units_per_world_unit**2
        record.radiance = wp.vec3(*np.minimum(intensity, BRIGHTEST))
    elif light.direction is not None and light.radiance is not None:
        towards = -np.asarray(light.direction, float)
        record.towards = wp.vec3(*(towards / np.linalg.norm(towards)))
        record.radiance = wp.vec3(*light.radiance)
    return record
