"""Cube maps of rooms whose distances are known in closed form, and rays within them."""

from __future__ import annotations

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.methods.cube_maps.faces import CubeLayer, texel_points
from ldtrefl.scene.description import Camera, Environment, Light, Lighting, Material, Object, Scene
from ldtrefl.tracing.ray_buffers import RayBuffer, empty_rays

CENTRE = np.array([0.3, -0.2, 0.1])
"""Of the cube maps, in device space."""

LOW, HIGH = np.array([-1.0, -0.7, -0.5]), np.array([1.2, 0.8, 0.6])
"""Corners of a room that is a box, relative to the centre."""

RADIUS = 0.9
"""Of a room that is a sphere about the centre."""


def texels(resolution: int) -> np.ndarray:
    """(6 * resolution^2, 3): all texels at depth 1 along their face's axis."""
    return np.concatenate([texel_points(face, resolution) for face in range(6)]).astype(float)


def exits_of_box(start: np.ndarray, directions: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """(n,) where rays leave a box that they start in."""
    return np.where(directions > 0, (high - start) / directions, (low - start) / directions).min(axis=1)


def exits_of_sphere(start: np.ndarray, directions: np.ndarray, radius: float) -> np.ndarray:
    """(n,) where rays of unit direction leave a sphere about 0."""
    along = (start * directions).sum(axis=1)
    return np.sqrt(radius**2 - (start**2).sum(axis=1) + along**2) - along


def layer_of(distance: np.ndarray, radiance: np.ndarray, resolution: int) -> CubeLayer:
    """A layer, from (n,) distances of its texels, +inf for the environment, and (n, 3) radiance."""
    device, layer = launch.resolve_device(None), CubeLayer()
    nearness = np.linalg.norm(texels(resolution), axis=1) / distance
    layer.radiance = wp.array(radiance.astype(np.float32), dtype=wp.vec3, device=device)
    layer.nearness = wp.array(nearness.astype(np.float32), dtype=float, device=device)
    return layer


def empty_layer(resolution: int) -> CubeLayer:
    """A layer that shows the environment alone, black."""
    count = 6 * resolution**2
    return layer_of(np.full(count, np.inf), np.zeros((count, 3)), resolution)


def unit(vectors: np.ndarray) -> np.ndarray:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))


def random_rays(count: int) -> tuple[np.ndarray, np.ndarray]:
    """(count, 3) starts on a ball of radius 0.4 about the centre, relative to it, and unit directions outwards."""
    rng = np.random.default_rng(8)
    normals, directions = (unit(rng.normal(size=(count, 3))) for _ in range(2))
    inwards = (normals * directions).sum(axis=1) < 0
    directions[inwards] *= -1
    return 0.4 * normals, directions


def buffer_of(starts: np.ndarray, directions: np.ndarray) -> RayBuffer:
    """Rays of reflector 0."""
    device = launch.resolve_device(None)
    rays = empty_rays(len(starts), device)
    rays.origin = wp.array(CENTRE + starts, dtype=wp.vec3d, device=device)
    rays.direction = wp.array(directions.astype(np.float32), dtype=wp.vec3, device=device)
    rays.source.fill_(0)
    return rays


def looked_up(kernel: wp.Kernel, starts: np.ndarray, directions: np.ndarray, *inputs: object) -> np.ndarray:
    """(n, 3) what rays find that leave reflector 0. ``inputs`` stand between the reflector and the radiance."""
    device = launch.resolve_device(None)
    radiance = wp.zeros(len(starts), dtype=wp.vec3, device=device)
    launch.launch(kernel, len(starts), [buffer_of(starts, directions), 0, *inputs, radiance], device)
    return np.asarray(radiance.numpy())


def lit_room(shape: str, size: tuple[float, float, float], at: tuple[float, float, float]) -> Scene:
    """A mirror ball in a room that one lamp lights from aside: every place of the walls has a light of its own."""
    lamp = Light(kind="point", position=(0.5 * size[0], -0.4 * size[1], 0.3 * size[2]), intensity=(3.0, 4.0, 5.0))
    ball = Object(name="ball", shape="sphere", scale=0.5, translate=at, material=Material(albedo=0.0, mirror=1.0))
    room = Object(name="room", shape=shape, scale=size, smooth=shape == "sphere", material=Material(albedo=0.9))
    camera = Camera(eye=(-0.6 * size[0], -0.6 * size[1], 0.4), look_at=at, width=90, height=60, fov_y=40)
    return Scene(
        camera=camera,
        environment=Environment(sky=(0, 0, 0), ground=(0, 0, 0)),
        lighting=Lighting(ambient=0.0),
        lights=(lamp,),
        objects=(ball, room),
    )
