"""The environment behind what the camera sees: the radiance of pixels in a row that see nothing else, but for lights.

An environment of two colours is filled in for as many pixels at once as a vector has lanes, in C++ (``backdrop.h``).
"""

from __future__ import annotations

import warp as wp

from ldtrefl.device.native_sources import native_body
from ldtrefl.frame.gbuffer import GBufferView, ray_through
from ldtrefl.geometry.vectors import as_single
from ldtrefl.shading.environment import environment_radiance
from ldtrefl.shading.light_shapes import seen_light
from ldtrefl.world.camera import camera_ray
from ldtrefl.world.records import LightingRecord

FILES = ("device/vectors.h", "frame/backdrop.h")

FILL = """
const Backdrop::Row row = {
    (float)width, {middle[0], middle[1], middle[2]}, {right[0], right[1], right[2]}, {up[0], up[1], up[2]},
    {ground[0], ground[1], ground[2]}, {rise[0], rise[1], rise[2]}
};
Backdrop::fill(row, x, count, &radiance_out.data[pixel][0]);
"""


@wp.func_native(native_body({}, FILES, FILL))
def fill_gradient(
    middle: wp.vec3,
    right: wp.vec3,
    width: int,
    up: wp.vec3,
    ground: wp.vec3,
    rise: wp.vec3,
    x: int,
    count: int,
    pixel: int,
    radiance_out: wp.array(dtype=wp.vec3),
):
    """Fill in ``count`` pixels of a row of ``width`` from ``pixel`` on, which is column ``x``. The row's middle looks
    along ``middle``, its right end along ``middle + right``; the radiance is the ground's downwards, and ``rise`` more
    upwards."""
    ...


@wp.func
def fill_backdrop(
    gbuffer: GBufferView, lighting: LightingRecord, begin: int, end: int, radiance_out: wp.array(dtype=wp.vec3)
):
    """Fill in the radiance of the environment for the pixels from ``begin`` to ``end``."""
    camera = gbuffer.camera
    in_rows = lighting.image_size[0] == 0 and gbuffer.place.shape[0] == 0
    i = int(begin)
    while i < end:
        row = i / camera.width
        rest = wp.where(in_rows, wp.min(end, (row + 1) * camera.width), end)
        if in_rows:
            half = wp.float64(0.5)
            middle = as_single(camera_ray(camera, half * wp.float64(camera.width), wp.float64(row) + half))
            right = as_single(camera.right)
            rise, x = lighting.sky - lighting.ground, i - row * camera.width
            fill_gradient(middle, right, camera.width, lighting.up, lighting.ground, rise, x, rest - i, i, radiance_out)
            i = rest
        else:
            while i < rest:
                way = as_single(ray_through(gbuffer, i))
                radiance_out[i] = environment_radiance(lighting, wp.normalize(way))
                i += 1


@wp.func
def fill_lights(
    gbuffer: GBufferView, lighting: LightingRecord, begin: int, end: int, radiance_out: wp.array(dtype=wp.vec3)
):
    """Fill in the lights whose shapes are seen by the pixels from ``begin`` to ``end``."""
    for i in range(begin, end):
        light = seen_light(lighting, gbuffer.camera.eye, wp.normalize(as_single(ray_through(gbuffer, i))), wp.inf)
        if light >= 0:
            radiance_out[i] = lighting.shaped[light].radiance
