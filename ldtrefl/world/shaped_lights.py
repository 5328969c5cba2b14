"""Spheres, rectangles and spot lights on a device, in device space; and an environment's rectangles, far away."""

from __future__ import annotations

import math

import numpy as np
import warp as wp

from ldtrefl.scene.description import Light, Scene
from ldtrefl.scene.presets.base import DistantRectangle
from ldtrefl.world.records import RECTANGLE, SPHERE, SPOT, ShapedLightRecord

SHAPED = {"sphere": int(SPHERE), "rectangle": int(RECTANGLE), "spot": int(SPOT)}
"""Kinds of lights that have a shape or a cone, and their numbers in kernels."""

LEAST_FALL = 1.0e-3
"""The least difference of cosines that a spot light falls off over, as glTF has it."""

BRIGHTEST = 1.0e30
"""Intensity of a spot light in device units: what is brighter is white all the same, and this is finite in float32."""

LARGEST = 1.0e30
"""Length in device units of what a light is wide, for the same reason."""

FEWEST, MOST = 4, 64
"""Shadow rays to a rectangle of an environment: with fewer the grain of shadows is seen, with more it is no finer than
steps of 8 bits."""


def has_soft_light(scene: Scene) -> bool:
    """Whether light of a scene needs several rays from each point, or is seen: lights with a shape or a cone, and
    occlusion."""
    surroundings = scene.environment.surroundings
    is_around = surroundings is not None and len(surroundings.rectangles) > 0
    is_own = any(light.kind in SHAPED for light in scene.lights)
    return scene.lighting.occlusion is not None or is_own or is_around


def shaped_light(light: Light, device_from_world: np.ndarray) -> ShapedLightRecord:
    """A light of one of the kinds in ``SHAPED`` in device space, which is the world moved and scaled alike."""
    scale = float(device_from_world[0, 0])
    record = ShapedLightRecord()
    record.kind = SHAPED[light.kind]
    record.position = wp.vec3d(*(device_from_world @ [*np.asarray(light.position), 1.0])[:3])
    record.radius = min(scale * (light.radius or 0.0), LARGEST)
    record.samples, record.visible = light.samples, int(light.visible and light.kind != "spot")
    if light.direction is not None:
        right, up, axis = light.axes
        record.axis = wp.vec3(*axis)
        record.right = wp.vec3(*np.minimum(scale * 0.5 * (light.width or 0.0), LARGEST) * right)
        record.up = wp.vec3(*np.minimum(scale * 0.5 * (light.height or 0.0), LARGEST) * up)
    if light.intensity is not None:
        record.radiance = wp.vec3(*np.minimum(scale * scale * np.asarray(light.intensity), BRIGHTEST))
        record.cone = wp.vec2(*_cone(light.inner_angle, light.outer_angle))
        if record.radius == 0.0:
            record.samples = 1  # all of its rays would be the same
    elif light.radiance is not None:
        record.radiance = wp.vec3(*light.radiance)
    return record


def distant_rectangle(
    light: DistantRectangle, world_from_own: np.ndarray, strength: float, samples: int
) -> ShapedLightRecord:
    """A rectangle of an environment.

    Args:
        light: at a strength of 1, in the environment's own frame.
        world_from_own: (3, 3) the rotation of that frame.
        strength: a factor on its radiance.
        samples: of a pixel, at most. As many shadow rays are sent from each point: a pixel that is sampled once has the
            grain of one that is sampled everywhere.
    """
    record = ShapedLightRecord()
    record.kind, record.distant = SHAPED["rectangle"], 1
    record.samples = min(max(samples, FEWEST), MOST)
    record.position = wp.vec3d(*(world_from_own @ light.middle))
    record.axis = -wp.vec3(*(world_from_own @ light.middle))
    record.right, record.up = wp.vec3(*(world_from_own @ light.right)), wp.vec3(*(world_from_own @ light.up))
    record.radiance = strength * wp.vec3(*light.radiance)
    return record


def _cone(inner: float, outer: float) -> tuple[float, float]:
    """Factor and offset of the cosine with the axis, by which light falls off between two angles in degrees.

    KHR_lights_punctual, "Inner and Outer Cone Angles".
    """
    end = math.cos(math.radians(outer))
    factor = 1.0 / max(math.cos(math.radians(inner)) - end, LEAST_FALL)
    return factor, -end * factor
