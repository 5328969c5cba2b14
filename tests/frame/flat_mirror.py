"""A mirror on the ground and a box over it: where every reflected ray goes is known in closed form, bounce by bounce.

World space, float64. Rays do not meet the object that they leave.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ldtrefl.device import launch
from ldtrefl.device.stats import Stats
from ldtrefl.frame.bounces import BounceLimits, RayFollower
from ldtrefl.frame.camera_shading import Shaded, shade_gbuffer
from ldtrefl.frame.gbuffer import GBuffer
from ldtrefl.frame.regions import Regions, all_objects, safe_regions
from ldtrefl.frame.skip_options import SkipOptions
from ldtrefl.frame.visibility import draw_gbuffer
from ldtrefl.scene.description import Camera, Environment, Lighting, Material, Object, Scene
from ldtrefl.tracing.nothing import no_shadows
from ldtrefl.tracing.ray_buffers import RayBuffer
from ldtrefl.tracing.scene_bvh import SceneBvh
from ldtrefl.tracing.tracer import BoundTracer
from ldtrefl.world.camera import camera_axes
from ldtrefl.world.device_scene import DeviceScene, Uploads

CAMERA = Camera(eye=(0.3, -4.0, 3.0), look_at=(0.0, 0.0, 0.0), width=75, height=52, fov_y=50.0)
GROUND, BOX = 0, 1
"""Numbers of the objects."""

GROUND_HALF, BOX_HALF = 2.0, 0.5
"""Halves of their sides."""

SKY, BELOW = np.array([0.8, 0.6, 0.4]), np.array([0.1, 0.2, 0.3])
"""The environment straight up and straight down."""

GROUND_MIRROR = np.array([0.5, 0.25, 1.0])
GROUND_DIRECT, BOX_DIRECT = np.full(3, 0.2 * 0.5), np.array([1.0, 2.0, 3.0])
"""Albedo times ambient light; emission."""

SHIFT = 0.01
"""Pixels about a pixel's centre within which its rays must take the same way, or it is too near an edge to be told."""


def scene(place: tuple[float, float, float] = (0.1, 0.5, 1.2), box_mirror: float = 0.0, **changes: object) -> Scene:
    """The mirror, and a box in a place, which glows and may be a mirror, too."""
    ground = Material(albedo=0.2, mirror=tuple(GROUND_MIRROR.tolist()))
    box = Material(albedo=0.0, emission=tuple(BOX_DIRECT.tolist()), mirror=box_mirror)
    given: dict[str, object] = {
        "camera": CAMERA,
        "environment": Environment(sky=tuple(SKY.tolist()), ground=tuple(BELOW.tolist())),
        "lighting": Lighting(ambient=(0.5, 0.5, 0.5)),
        "objects": (
            Object(name="ground", shape="plane", scale=GROUND_HALF, material=ground),
            Object(name="box", shape="box", scale=BOX_HALF, translate=place, material=box, smooth=False),
        ),
    }
    return Scene(**{**given, **changes})


def on_device(given: Scene, before: DeviceScene | None = None, *, needs_footprints: bool = False) -> DeviceScene:
    uploads = Uploads(needs_footprints=needs_footprints)
    return DeviceScene(given, launch.resolve_device(None), before, uploads=uploads)


def seen_and_shaded(device_scene: DeviceScene) -> tuple[GBuffer, Shaded]:
    """What the scene's camera sees, and the rays that leave the mirrors there."""
    gbuffer = draw_gbuffer(device_scene, device_scene.scene.camera)
    return gbuffer, shade_gbuffer(gbuffer, no_shadows(device_scene.device), starts_rays=True)


class RayCasting:
    """What guides rays by ray casting: every ray may meet every object, or those that culling leaves it."""

    def __init__(self, device_scene: DeviceScene, *, culls: bool = False) -> None:
        self.scene, self.culls, self.tracer = device_scene, culls, SceneBvh()

    def regions(self, gbuffer: GBuffer, rays: RayBuffer, bounce: int, stats: Stats) -> Regions:
        return safe_regions(gbuffer, rays, bounce, stats) if self.culls else all_objects(self.scene, rays)

    def traced(self, objects: set[int], stats: Stats) -> BoundTracer:
        return self.tracer.bound(self.scene, objects, stats)


def follower(gbuffer: GBuffer, bounces: int = 1, *, least_weight: float = 0.0, culls: bool = False) -> RayFollower:
    """A follower of rays by ray casting, with counters of its own."""
    limits = BounceLimits(bounces, least_weight)
    return RayFollower(gbuffer, RayCasting(gbuffer.scene, culls=culls), limits, SkipOptions(), Stats())


def in_world(device_scene: DeviceScene, points: np.ndarray) -> np.ndarray:
    """(n, 3) points of device space in the world."""
    matrix = np.linalg.inv(device_scene.device_from_world)
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def camera_directions(camera: Camera, shift: tuple[float, float] = (0.0, 0.0)) -> np.ndarray:
    """(h * w, 3) unit directions through all pixels, each looked through ``shift`` pixels off its centre."""
    right, down, forward = camera_axes(camera)
    y, x = np.mgrid[: camera.height, : camera.width]
    half = np.tan(np.radians(camera.fov_y) / 2)
    across = (2 * (x.ravel() + 0.5 + shift[0]) / camera.width - 1) * half * camera.width / camera.height
    along = (2 * (y.ravel() + 0.5 + shift[1]) / camera.height - 1) * half
    ways = forward + across[:, None] * right + along[:, None] * down
    return ways / np.linalg.norm(ways, axis=1, keepdims=True)


def environment(directions: np.ndarray) -> np.ndarray:
    """(n, 3) radiance in unit directions; up is +z."""
    blend = 0.5 + 0.5 * directions[:, 2:]
    return blend * SKY + (1 - blend) * BELOW


def closest_hits(
    origins: np.ndarray, directions: np.ndarray, source: np.ndarray, place: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(t, inf on a miss; object, -1 on a miss; axis of the normal) of (n, 3) rays that leave the objects ``source``."""
    with np.errstate(divide="ignore", invalid="ignore"):
        t_ground = -origins[:, 2] / directions[:, 2]
        at = origins + t_ground[:, None] * directions
        is_ground = (source != GROUND) & (t_ground > 0) & (np.abs(at[:, :2]).max(axis=1) <= GROUND_HALF)
        sides = (np.stack([place - BOX_HALF, place + BOX_HALF])[:, None] - origins) / directions
    enter, leave = sides.min(axis=0), sides.max(axis=0)
    t_box = enter.max(axis=1)
    is_box = (source != BOX) & (t_box > 0) & (t_box <= leave.min(axis=1))
    t = np.stack([np.where(is_ground, t_ground, np.inf), np.where(is_box, t_box, np.inf)])
    nearest = t.argmin(axis=0)
    t = t.min(axis=0)
    axis = np.where(nearest == BOX, enter.argmax(axis=1), 2)
    return t, np.where(np.isfinite(t), nearest, -1), axis


@dataclass(frozen=True)
class Reflection:
    """What the pixels that see the ground reflect, (n, ...) in the order of their numbers."""

    pixels: np.ndarray
    origin: np.ndarray
    direction: np.ndarray
    distance: np.ndarray
    """To the first hit; inf on a miss."""
    object: np.ndarray
    radiance: np.ndarray
    later_followed: np.ndarray
    """(n, k) bool: whether the ray was followed to the second bounce, the third, ..."""
    later_distance: np.ndarray
    """(n, k)"""
    later_object: np.ndarray
    """(n, k)"""


def _way(given: Scene, bounces: int, shift: tuple[float, float]) -> tuple[Reflection, np.ndarray]:
    """The reflection in rays ``shift`` pixels off the centres, by all pixels; and (h * w, k) what the rays met."""
    camera, place = given.camera, np.array(given.objects[BOX].translate, float)
    mirror = np.stack([GROUND_MIRROR, np.broadcast_to(given.objects[BOX].material.mirror, 3)])
    direct = np.stack([GROUND_DIRECT, BOX_DIRECT])
    direction = camera_directions(camera, shift)
    origin = np.broadcast_to(np.array(camera.eye, float), direction.shape)
    t, source, axis = closest_hits(origin, direction, np.full(len(direction), -1), place)
    origin = origin + np.where(np.isfinite(t), t, 0.0)[:, None] * direction
    direction = np.where(np.arange(3) == axis[:, None], -direction, direction)
    first, met = (origin, direction), [source, axis]
    throughput, radiance = np.ones_like(direction), np.zeros_like(direction)
    ends = []
    for bounce in range(bounces):
        alive = source >= 0
        t, hit, axis = closest_hits(origin, direction, source, place)
        ends.append((alive, np.where(alive, t, np.inf), np.where(alive, hit, -1)))
        is_hit, is_miss = alive & (hit >= 0), alive & (hit < 0)
        onwards = np.where(np.arange(3) == axis[:, None], -direction, direction)
        light = direct[hit]
        if bounce + 1 == bounces:
            light = light + mirror[hit] * environment(onwards)
        radiance += np.where(is_hit[:, None], throughput * light, 0.0)
        radiance += np.where(is_miss[:, None], throughput * environment(direction), 0.0)
        throughput = throughput * mirror[hit]
        origin = origin + np.where(is_hit, t, 0.0)[:, None] * direction
        direction, source = onwards, np.where(is_hit & (mirror[hit].max(axis=1) > 0), hit, -1)
        met += [np.where(alive, hit, -2), np.where(alive, axis, -2)]
    pixels, nothing = np.arange(len(direction)), np.empty((len(direction), 0))
    later = [np.stack(values, axis=1) for values in zip(*ends[1:], strict=True)] or [nothing] * 3
    return Reflection(pixels, *first, ends[0][1], ends[0][2], radiance, *later), np.stack(met, axis=1)


def reflection(given: Scene, bounces: int = 1) -> Reflection:
    """What the pixels that see the ground reflect; those whose rays pass an edge by rounding are left out."""
    whole, met = _way(given, bounces, (0.0, 0.0))
    shifts = [(x, y) for x in (-SHIFT, SHIFT) for y in (-SHIFT, SHIFT)]
    is_clear = np.all([(_way(given, bounces, shift)[1] == met).all(axis=1) for shift in shifts], axis=0)
    chosen = is_clear & (met[:, 0] == GROUND)
    return Reflection(*(values[chosen] for values in vars(whole).values()))
