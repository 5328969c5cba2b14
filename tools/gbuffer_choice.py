"""Measures the choice of ``gbuffer.py``: a z-buffer against casting camera rays through a BVH.

Mirror ball and torus knot at several triangle counts, 768 x 512, timed in turn in one process, medians.

python tools/gbuffer_choice.py
"""

from __future__ import annotations

import os
import statistics
import time
from collections.abc import Callable

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.frame.gbuffer import draw_gbuffer
from ldtrefl.scene.description import Camera, Object, Scene
from ldtrefl.tracing.bvh import Raycaster
from ldtrefl.world.camera import camera_axes
from ldtrefl.world.device_scene import DeviceScene

ROUNDS = 9
KNOTS = {"10 k": (200, 25), "96 k": (600, 80), "500 k": (2000, 125), "2 M": (5000, 200)}


def median_seconds(*jobs: Callable[[], object]) -> list[float]:
    """Median time of each job, run in turn."""
    times: list[list[float]] = [[] for _ in jobs]
    for _ in range(ROUNDS + 1):
        for job, spent in zip(jobs, times, strict=True):
            start = time.perf_counter()
            job()
            spent.append(time.perf_counter() - start)
    return [statistics.median(spent[1:]) for spent in times]


def camera_rays(camera: Camera) -> tuple[wp.array, wp.array]:
    """Origins and directions of all pixels."""
    right, down, forward = camera_axes(camera)
    half = np.tan(np.radians(camera.fov_y / 2))
    x, y = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    across = (2 * x / camera.width - 1) * half * camera.width / camera.height
    rays = forward + across[..., None] * right + ((2 * y / camera.height - 1) * half)[..., None] * down
    origins = np.broadcast_to(camera.eye, (x.size, 3)).astype(np.float32)
    return wp.array(origins, dtype=wp.vec3), wp.array(rays.reshape(-1, 3).astype(np.float32), dtype=wp.vec3)


def main() -> None:
    """Print a line per triangle count."""
    device = launch.resolve_device(None)
    camera = Camera(eye=(0, -5, 1.2), look_at=(0, 0, 0), fov_y=35, width=768, height=512)
    print(f"{launch.thread_count()} threads of {os.cpu_count()} cores; ms, median of {ROUNDS}")
    for name, segments in KNOTS.items():
        ball = Object(shape="sphere")
        knot = Object(shape="torus_knot", params={"segments": list(segments)}, scale=0.7, translate=(-1.1, -1.4, 0))
        scene = DeviceScene(Scene(camera=camera, objects=(ball, knot)), device)
        origins, directions = camera_rays(camera)
        casters = [Raycaster.of(entry.geometry) for entry in scene.objects]

        def draw(scene: DeviceScene = scene) -> None:
            draw_gbuffer(scene, camera)

        def build(scene: DeviceScene = scene) -> None:
            for entry in scene.objects:
                Raycaster.of(entry.geometry)

        def cast(casters: list[Raycaster] = casters, rays: tuple = (origins, directions)) -> None:
            for caster in casters:
                caster.trace(*rays)

        drawn, built, cast_time = (1000 * s for s in median_seconds(draw, build, cast))
        print(f"{name:>6} triangles: z-buffer {drawn:6.1f}, BVH build {built:7.1f}, BVH rays {cast_time:6.1f}")


if __name__ == "__main__":
    main()
