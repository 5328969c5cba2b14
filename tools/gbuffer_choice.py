"""Measures the choice of ``ldtrefl/frame/gbuffer.py``: a z-buffer against casting camera rays through a BVH.

A mirror ball and a torus knot of several numbers of triangles, 768 x 512 pixels; timed in turn in one process, medians.

    python tools/gbuffer_choice.py            # half a minute; prints a line for each number of triangles
    python tools/gbuffer_choice.py --quick    # a few seconds: the smallest knot alone, few rounds
"""

from __future__ import annotations

import argparse
import os

import numpy as np
import warp as wp
from stress_cases.inputs import camera_rays
from timing import timed_in_turn

from ldtrefl.device import launch
from ldtrefl.frame.visibility import draw_gbuffer
from ldtrefl.scene.description import Camera, Object, Scene
from ldtrefl.tracing.bvh import Raycaster
from ldtrefl.world.device_scene import DeviceScene

ROUNDS, QUICK_ROUNDS = 9, 2
KNOTS = {"10 k": (200, 25), "96 k": (600, 80), "500 k": (2000, 125), "2 M": (5000, 200)}
"""Segments of the knot, by its number of triangles."""


def rays_on_device(camera: Camera) -> tuple[wp.array, wp.array]:
    """(width * height,) origins and directions of the rays through the centres of all pixels, on the device."""
    origins, directions = (rays.astype(np.float32) for rays in camera_rays(camera))
    return wp.array(origins, dtype=wp.vec3), wp.array(directions, dtype=wp.vec3)


def line_of(name: str, camera: Camera, device: wp.Device, rounds: int) -> str:
    """The knot with this number of triangles and the ball: milliseconds to draw them, to build trees, to cast rays."""
    ball = Object(shape="sphere")
    knot = Object(shape="torus_knot", params={"segments": list(KNOTS[name])}, scale=0.7, translate=(-1.1, -1.4, 0))
    scene = DeviceScene(Scene(camera=camera, objects=(ball, knot)), device)
    origins, directions = rays_on_device(camera)
    casters = [Raycaster.of(entry.geometry) for entry in scene.objects]

    def draw() -> None:
        draw_gbuffer(scene, camera)

    def build() -> None:
        for entry in scene.objects:
            Raycaster.of(entry.geometry)

    def cast() -> None:
        for caster in casters:
            caster.trace(origins, directions)

    times = timed_in_turn({"draw": draw, "build": build, "cast": cast}, rounds)
    drawn, built, cast_time = (times[job]["median"] for job in ("draw", "build", "cast"))
    return f"{name:>6} triangles: z-buffer {drawn:6.1f}, BVH build {built:7.1f}, BVH rays {cast_time:6.1f}"


def main() -> None:
    """Print a line for each number of triangles."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="the smallest knot alone, few rounds")
    quick = parser.parse_args().quick
    rounds = QUICK_ROUNDS if quick else ROUNDS
    device = launch.resolve_device(None)
    camera = Camera(eye=(0, -5, 1.2), look_at=(0, 0, 0), fov_y=35, width=768, height=512)
    print(f"{launch.thread_count()} threads of {os.cpu_count()} cores; ms, median of {rounds}")
    for name in list(KNOTS)[: 1 if quick else None]:
        print(line_of(name, camera, device, rounds))


if __name__ == "__main__":
    main()
