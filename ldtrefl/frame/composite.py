"""Direct light and reflected light -> the image."""

from __future__ import annotations

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.frame.history import FrameParts

PIXELS_TOGETHER = 4096
"""Pixels that one thread of a CPU copies."""


@wp.func_native("""
memcpy(&image_out.data[begin], &radiance.data[begin], (end - begin) * sizeof(image_out.data[0]));
""")
def copy_run(radiance: wp.array(dtype=wp.vec3), begin: int, end: int, image_out: wp.array(dtype=wp.vec3)):
    """Copy the pixels from ``begin`` to ``end``, as the C library does."""
    ...


@launch.kernel
def copy_pixels(
    first: int,
    # In:
    block: int,
    radiance: wp.array(dtype=wp.vec3),
    # Out:
    image_out: wp.array(dtype=wp.vec3),
):
    """Copy a block of pixels."""
    begin = block * (first + wp.tid())
    copy_run(radiance, begin, wp.min(begin + block, radiance.shape[0]), image_out)


@launch.kernel
def add_reflection(
    first: int,
    # In:
    pixels: wp.array(dtype=wp.int32),
    mirror: wp.array(dtype=wp.vec3),
    reflected: wp.array(dtype=wp.vec3),
    # In and out:
    image: wp.array(dtype=wp.vec3),
):
    """Add the light that a reflector sends to one pixel."""
    i = first + wp.tid()
    pixel = pixels[i]
    image[pixel] = image[pixel] + wp.cw_mul(mirror[i], reflected[i])


def composed(parts: FrameParts) -> wp.array:
    """(pixels,) vec3 radiance of a frame, or a band of one."""
    gbuffer, shaded = parts.gbuffer, parts.shaded
    device, pixels = gbuffer.scene.device, gbuffer.reflector_pixels
    # By all threads: memory that is new to the process is slow to write.
    image, block = wp.empty_like(shaded.radiance), PIXELS_TOGETHER if device.is_cpu else 1
    launch.launch(copy_pixels, -(-image.shape[0] // block), [block, shaded.radiance, image], device)
    inputs = [pixels, shaded.mirror, parts.reflected.radiance, image]
    launch.launch(add_reflection, pixels.shape[0], inputs, device)
    return image


def reflected_to_camera(parts: FrameParts, radiance: wp.array) -> np.ndarray:
    """(h, w, 3) float32: what reflectors send to the camera of (m,) radiance that reaches them; 0 elsewhere."""
    gbuffer = parts.gbuffer
    device, pixels = gbuffer.scene.device, gbuffer.reflector_pixels
    image = wp.zeros(gbuffer.pixel_count, dtype=wp.vec3, device=device)
    launch.launch(add_reflection, pixels.shape[0], [pixels, parts.shaded.mirror, radiance, image], device)
    picture: np.ndarray = image.numpy().reshape(*gbuffer.shape, 3)
    return picture


def reflection_picture(shape: tuple[int, int], pixels: wp.array, radiance: wp.array) -> np.ndarray:
    """(h, w, 3) float32: the (m,) radiance of each of the (m,) ``pixels``; 0 elsewhere."""
    picture = np.zeros((shape[0] * shape[1], 3), np.float32)
    picture[pixels.numpy()] = radiance.numpy()
    return picture.reshape(*shape, 3)
