"""Measures the choices of ``ldtrefl/frame/visibility.py``: a z-buffer against casting camera rays through a BVH, and
against searching for those that a mesh may hide in the tree of ``ldt`` (``ldtrefl/frame/search_choice.py``).

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
from ldtrefl.device.stats import Stats
from ldtrefl.frame.searched_pixels import CameraSearch
from ldtrefl.frame.visibility import draw_gbuffer
from ldtrefl.ldt.exact.build import build_tree
from ldtrefl.ldt.options import BINARY_STEPS, DEFAULT_RESOLUTION, TEXEL
from ldtrefl.ldt.scene_maps import MapOptions, SceneMaps
from ldtrefl.scene.description import Camera, Object, Scene
from ldtrefl.tracing.bvh import Raycaster
from ldtrefl.world.device_scene import DeviceScene

ROUNDS, QUICK_ROUNDS = 9, 2
KNOTS = {"10 k": (200, 25), "96 k": (600, 80), "500 k": (2000, 125), "2 M": (5000, 200)}
"""Segments of the knot, by its number of triangles."""

KNOT = 1
"""Number of the knot in the scene."""


def rays_on_device(camera: Camera) -> tuple[wp.array, wp.array]:
    """(width * height,) origins and directions of the rays through the centres of all pixels, on the device."""
    origins, directions = (rays.astype(np.float32) for rays in camera_rays(camera))
    return wp.array(origins, dtype=wp.vec3), wp.array(directions, dtype=wp.vec3)


def line_of(name: str, camera: Camera, device: wp.Device, rounds: int) -> str:
    """The knot with this number of triangles and the ball: milliseconds to draw them; to build BVHs and cast rays; to
    build the knot's tree, draw the ball and search for the pixels of the knot."""
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

    def tree() -> None:
        build_tree(scene.objects[KNOT].geometry, DEFAULT_RESOLUTION, "exact")

    maps = SceneMaps(MapOptions("exact", "exact", TEXEL, BINARY_STEPS, None))
    camera_search = CameraSearch(np.array([KNOT]), maps.bound(scene, [KNOT], Stats()))

    def search() -> None:
        draw_gbuffer(scene, camera, camera_search)

    jobs = {"draw": draw, "build": build, "cast": cast, "tree": tree, "search": search}
    times = timed_in_turn(jobs, rounds)
    drawn, built, cast_time, tree_time, searched = (times[job]["median"] for job in jobs)
    return (
        f"{name:>6} triangles: z-buffer {drawn:6.1f}, BVH build {built:7.1f}, BVH rays {cast_time:6.1f}, "
        f"tree build {tree_time:7.1f}, search {searched:6.1f}"
    )


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
