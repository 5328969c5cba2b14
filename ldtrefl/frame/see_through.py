"""Where the environment is seen straight through surfaces: holes in leaves, glass, backs that are not there.

A ray that a surface lets through goes on along the line of sight. If all that it meets lets it through, and then there
is nothing, what it brings lies behind all objects. Where the bounces are used up before, the last surface counts as the
end.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ldtrefl.frame.gbuffer import GBuffer
from ldtrefl.frame.history import FrameParts
from ldtrefl.frame.sample_points import SamplePoints
from ldtrefl.tracing.ray_buffers import RayBuffer
from ldtrefl.world.camera import CameraView

STRAIGHT = 1e-6
"""Length of the difference of two unit directions below which they are one: float32 rounds them by a tenth of this."""


def places_in(width: int, pixels: np.ndarray) -> np.ndarray:
    """(n, 2) float64: the centres of (n,) pixels of a band that is so wide."""
    row, column = np.divmod(pixels, width)
    return np.stack([column, row], axis=1) + 0.5


def places_of(gbuffer: GBuffer, pixels: np.ndarray) -> np.ndarray:
    """(n, 2) float64: where (n,) pixels, or points, of a G-buffer are looked at, in the pixels of its band."""
    if isinstance(gbuffer, SamplePoints):
        return np.asarray(gbuffer.view.place.numpy())[pixels]
    return places_in(gbuffer.camera.width, pixels)


def goes_straight_on(camera: CameraView, place: np.ndarray, rays: RayBuffer) -> np.ndarray:
    """(n,) bool: rays along the line of sight through the (n, 2) places that they belong to."""
    across = 2.0 * place[:, 0] / camera.width - 1.0
    along = 2.0 * (place[:, 1] + camera.first_row) / camera.height - 1.0
    forward, right, down = (np.array(axis) for axis in (camera.forward, camera.right, camera.down))
    sight = forward + across[:, None] * right + along[:, None] * down
    sight /= np.linalg.norm(sight, axis=1, keepdims=True)
    is_alive = rays.source.numpy() >= 0
    return is_alive & (np.linalg.norm(sight - rays.direction.numpy(), axis=1) < STRAIGHT)


@dataclass(frozen=True, eq=False)
class SeenThrough:
    """The environment that a G-buffer's surfaces let through."""

    share: np.ndarray
    """(h, w) float32: how much of a pixel's light may come from there, 0 to 1."""
    bounces: list[np.ndarray]
    """(h, w) bool of each bounce that was kept: pixels whose ray met the environment there."""

    @classmethod
    def of(cls, parts: FrameParts) -> SeenThrough:
        """What can be told from the bounces that were kept of a frame, or of a band; nothing if none were."""
        gbuffer, followed = parts.gbuffer, parts.reflected.followed
        share, bounces = np.zeros(gbuffer.pixel_count, np.float32), []
        if followed is not None and followed.kept:
            mirror = np.zeros((gbuffer.pixel_count, 3), np.float32)
            mirror[gbuffer.reflector_pixels.numpy()] = parts.shaded.mirror.numpy()
            is_straight = np.ones(followed.rays.pixel.shape[0], bool)
            for bounce in followed.kept:
                straight_before, is_straight = is_straight, np.zeros_like(is_straight)
                place = places_of(gbuffer, bounce.rays.pixel.numpy())
                is_straight[bounce.numbers] = goes_straight_on(gbuffer.view.camera, place, bounce.rays)
                is_straight &= straight_before
                is_behind = is_straight[bounce.numbers] & (bounce.hits.object.numpy() < 0)
                pixels = bounce.rays.pixel.numpy()[is_behind]
                share[pixels] = (mirror[pixels] * bounce.rays.throughput.numpy()[is_behind]).mean(axis=1)
                picture = np.zeros(gbuffer.pixel_count, bool)
                picture[pixels] = True
                bounces.append(picture.reshape(gbuffer.shape))
        return cls(share.reshape(gbuffer.shape), bounces)
