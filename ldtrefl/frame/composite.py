"""Direct light and reflected light -> the image."""

from __future__ import annotations

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.frame.history import FrameParts


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


def composed(parts: FrameParts) -> np.ndarray:
    """(h, w, 3) float32 radiance of a frame, or a band of one."""
    gbuffer, shaded = parts.gbuffer, parts.shaded
    image, pixels = wp.clone(shaded.radiance), gbuffer.reflector_pixels
    inputs = [pixels, shaded.mirror, parts.reflected.radiance, image]
    launch.launch(add_reflection, pixels.shape[0], inputs, gbuffer.scene.device)
    picture: np.ndarray = image.numpy().reshape(*gbuffer.shape, 3)
    return picture


def reflection_picture(shape: tuple[int, int], pixels: wp.array, radiance: wp.array) -> np.ndarray:
    """(h, w, 3) float32: the (m,) radiance of each of the (m,) ``pixels``; 0 elsewhere."""
    picture = np.zeros((shape[0] * shape[1], 3), np.float32)
    picture[pixels.numpy()] = radiance.numpy()
    return picture.reshape(*shape, 3)
