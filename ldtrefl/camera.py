"""The pinhole camera as kernels see it.

Pixel coordinates run right and down from the upper left corner, pixel centres at +0.5. A camera ray's direction has
length 1 along the view axis, so its ``t`` is the depth along that axis.
"""

from __future__ import annotations

import functools

import numpy as np
import warp as wp

from ldtrefl.scene import Camera


@wp.struct
class CameraView:
    """A camera in device space."""

    eye: wp.vec3d
    right: wp.vec3  # at distance 1, half the image's width long
    down: wp.vec3  # at distance 1, half the image's height long
    forward: wp.vec3  # unit
    width: int
    height: int


@wp.func
def camera_ray(camera: CameraView, x: float, y: float) -> wp.vec3:
    """Direction through the point (x, y) of the image, in pixels."""
    across = 2.0 * x / float(camera.width) - 1.0
    along = 2.0 * y / float(camera.height) - 1.0
    return camera.forward + across * camera.right + along * camera.down


@functools.lru_cache(maxsize=1)
def camera_axes(camera: Camera) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Unit ``right``, ``down`` and ``forward`` in the world, float64."""
    forward = np.subtract(camera.look_at, camera.eye).astype(float)
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, np.asarray(camera.up, float) / np.linalg.norm(camera.up))
    right /= np.linalg.norm(right)
    return right, np.cross(forward, right), forward


def camera_view(camera: Camera, device_from_world: np.ndarray) -> CameraView:
    """The camera in device space, which is the world moved and scaled alike along all axes."""
    right, down, forward = camera_axes(camera)
    half_height = np.tan(np.radians(camera.fov_y) / 2.0)
    view = CameraView()
    view.eye = wp.vec3d(*(device_from_world @ [*camera.eye, 1.0])[:3])
    view.right = wp.vec3(*(right * half_height * camera.width / camera.height))
    view.down = wp.vec3(*(down * half_height))
    view.forward = wp.vec3(*forward)
    view.width, view.height = camera.width, camera.height
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
