"""The kernels of a first frame: where none are compiled yet, they are while the scene is made ready
(``device/build_ahead.py``). A list names those first that take longest to compile."""

from __future__ import annotations

import warp as wp

from ldtrefl.device import build_ahead, launch
from ldtrefl.frame.antialiasing import blend_pixels, filter_pixels, place_samples, put_pixels, weigh_samples
from ldtrefl.frame.bounces import shade_hits_kernel
from ldtrefl.frame.camera_shading import shade_pixels_kernel, shade_reflectors_kernel
from ldtrefl.frame.composite import add_reflection, copy_pixels
from ldtrefl.frame.contrast import mark_contrast, mix_in_objects
from ldtrefl.frame.large_triangles import draw_large_triangles
from ldtrefl.frame.projection import project_vertices
from ldtrefl.frame.ray_counts import count_rays
from ldtrefl.frame.regions import cull_runs
from ldtrefl.frame.sample_points import find_mirrors, start_camera_rays
from ldtrefl.frame.skip_options import SkipOptions
from ldtrefl.frame.visibility import resolve_pixels
from ldtrefl.frame.zbuffer import draw_triangles
from ldtrefl.tracing.closest_hits import closest_hits_kernel
from ldtrefl.tracing.nothing import NOTHING
from ldtrefl.tracing.tracer import Tracer, block_of
from ldtrefl.world.device_scene import DeviceScene

OF_EVERY_SCENE = (draw_large_triangles, draw_triangles, resolve_pixels, project_vertices, add_reflection, copy_pixels)
"""What draws the G-buffer and composes the image."""

OF_SAMPLES = (
    cull_runs,
    mark_contrast,
    weigh_samples,
    filter_pixels,
    start_camera_rays,
    find_mirrors,
    mix_in_objects,
    place_samples,
    put_pixels,
    blend_pixels,
)
"""What samples pixels more than once."""


def foresee_a_frame(device: str | None) -> None:
    """Say that a frame of some scene will be rendered on a device, by default the CPU, before the scene is read."""
    if device in (None, "cpu"):
        build_ahead.foresee(OF_EVERY_SCENE, launch.thread_count())


def kernels_of_rays(scene: DeviceScene, tracer: Tracer, skip: SkipOptions) -> list[wp.Kernel]:
    """What follows the rays of a scene by a tracer, and shades what they and the camera see."""
    shadow = tracer if scene.scene.lighting.is_traced else NOTHING
    return [
        closest_hits_kernel(tracer, block_of(scene.device), skip.bounds),
        shade_hits_kernel(shadow, scene.features),
        shade_pixels_kernel(shadow, scene.features),
        shade_reflectors_kernel(shadow, True, scene.features),
        count_rays,
    ]
