"""The pinhole camera as kernels see it.

Pixel coordinates run right and down from the upper left corner, pixel centres at +0.5. A camera ray's direction has
length 1 along the view axis, so its ``t`` is the depth along that axis.

A large image is made in *bands*, some rows at a time. Pixels of a band are numbered from its own first row on; where
they are in the image is worked out with the numbers of the whole image, so a band has the image's bits.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
import warp as wp

from ldtrefl.geometry.vectors import as_single
from ldtrefl.scene.description import Camera

BLENDED = 0.6
"""How far the footprints of several rays of a pixel reach, over the distance between these. Measured
(``tools/texture_filtering.py``): with 1 textures lose a tenth of their finest detail, with 0.4 they flicker."""


@dataclass(frozen=True)
class Band:
    """Some rows of an image."""

    first_row: int
    rows: int


def whole_image(camera: Camera) -> Band:
    """All rows."""
    return Band(0, camera.height)


@wp.struct
class CameraView:
    """A camera in device space, and the band of its image that is looked at."""

    eye: wp.vec3d
    right: wp.vec3d  # at distance 1, half the image's width long; float32 would round a telephoto lens' pixels away
    down: wp.vec3d  # at distance 1, half the image's height long
    forward: wp.vec3d  # unit
    width: int
    height: int  # of the whole image
    first_row: int  # of the band
    spacing: float  # pixels from a ray to its neighbours, which its footprint reaches to


@wp.func
def camera_ray(camera: CameraView, x: wp.float64, y: wp.float64) -> wp.vec3d:
    """Direction through the point (x, y) of the band, in pixels."""
    one, two = wp.float64(1.0), wp.float64(2.0)
    across = two * x / wp.float64(camera.width) - one
    along = two * (y + wp.float64(camera.first_row)) / wp.float64(camera.height) - one
    return camera.forward + across * camera.right + along * camera.down


@wp.func
def pixel_place(camera: CameraView, pixel: int) -> wp.vec2i:
    """Column and row in the whole image of a pixel of the band."""
    row = pixel / camera.width
    return wp.vec2i(pixel - row * camera.width, row + camera.first_row)


@wp.func
def step_right(camera: CameraView) -> wp.vec3:
    """From a ray of :func:`camera_ray` to the one to its right that its footprint reaches to."""
    return (2.0 * camera.spacing / float(camera.width)) * as_single(camera.right)


@wp.func
def step_down(camera: CameraView) -> wp.vec3:
    """From a ray of :func:`camera_ray` to the one below that its footprint reaches to."""
    return (2.0 * camera.spacing / float(camera.height)) * as_single(camera.down)


@functools.lru_cache(maxsize=1)
def camera_axes(camera: Camera) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Unit ``right``, ``down`` and ``forward`` in the world, float64."""
    # Equal cameras may hold zeros of either sign: to add 0 makes them one.
    forward = np.subtract(camera.look_at, camera.eye).astype(float) + 0.0
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, unit_up(camera))
    right /= np.linalg.norm(right)
    return right, np.cross(forward, right), forward


def unit_up(camera: Camera) -> np.ndarray:
    """(3,) float64 unit vector: where the top of the environment is."""
    up = np.asarray(camera.up, float) + 0.0
    return up / np.linalg.norm(up)


def ray_spacing(samples: int) -> float:
    """Pixels from a ray to its neighbours, for so many rays a pixel. Of many, each reaches less far than to the next:
    they are blended as well, and more would blur twice."""
    return 1.0 if samples == 1 else float(BLENDED / np.sqrt(samples))


def camera_view(camera: Camera, device_from_world: np.ndarray, band: Band, samples: int = 1) -> CameraView:
    """The camera in device space, which is the world moved and scaled alike along all axes; ``samples`` is how many
    rays a pixel has."""
    right, down, forward = camera_axes(camera)
    half_height = np.tan(np.radians(camera.fov_y) / 2.0)
    view = CameraView()
    view.eye = wp.vec3d(*(device_from_world @ [*camera.eye, 1.0])[:3] + 0.0)
    view.right = wp.vec3d(*(right * half_height * camera.width / camera.height))
    view.down = wp.vec3d(*(down * half_height))
    view.forward = wp.vec3d(*forward)
    view.width, view.height, view.first_row = camera.width, camera.height, band.first_row
    view.spacing = ray_spacing(samples)
    return view


def pixels_from_world(camera: Camera) -> np.ndarray:
    """(3, 4) float64 ``P``: a world point ``p`` is seen at ``(P p)_xy / (P p)_z`` pixels, at depth ``(P p)_z``."""
    right, down, forward = camera_axes(camera)
    half_height = np.tan(np.radians(camera.fov_y) / 2.0)
    half_width = half_height * camera.width / camera.height
    rows = np.stack(
        [
            0.5 * camera.width * (right / half_width + forward),
            0.5 * camera.height * (down / half_height + forward),
            forward,
        ]
    )
    return np.hstack([rows, -rows @ np.asarray(camera.eye, float)[:, None]])
