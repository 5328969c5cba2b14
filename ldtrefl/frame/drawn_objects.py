"""Which objects a camera may see, and how they are projected: found for all objects at once.

An object is left out if its bounding sphere lies behind the camera, beside the view, or between pixel centres. All in
float64.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import warp as wp

from ldtrefl.device.struct_arrays import host_structs
from ldtrefl.frame.projection import DrawnObject
from ldtrefl.scene.description import Camera
from ldtrefl.world.camera import camera_axes, pixels_from_world
from ldtrefl.world.device_scene import DeviceScene

CENTRE_SLACK = 1e-3
"""Pixels by which a sphere's bounds are widened before it is said to lie between pixel centres: far more than what
triangles' boxes are widened by, and than rounding."""


@dataclass(frozen=True, eq=False)
class DrawnObjects:
    """Objects that are drawn."""

    numbers: np.ndarray
    """(n,) int64 in the scene."""
    depths: np.ndarray
    """(n,) of their spheres' centres, device units."""
    projections: np.ndarray
    """(n, 3, 4) float64: (x depth, y depth, depth) in pixels of the whole image, from unit space."""

    @classmethod
    def of(cls, scene: DeviceScene, camera: Camera, numbers: np.ndarray) -> DrawnObjects:
        """Those objects of these numbers that ``camera`` may see."""
        may_be_seen, depths = _may_be_seen(scene, camera, scene.spheres[numbers])
        kept = numbers[may_be_seen]
        return cls(kept, depths[may_be_seen], pixels_from_world(camera) @ scene.world_from_unit[kept])

    @classmethod
    def joined(cls, parts: Sequence[DrawnObjects]) -> DrawnObjects:
        """All of several."""
        if len(parts) == 1:
            return parts[0]
        fields = ("numbers", "depths", "projections")
        return cls(*(np.concatenate([getattr(part, name) for part in parts]) for name in fields))

    def some(self, part: slice | np.ndarray) -> DrawnObjects:
        """Part of them."""
        return DrawnObjects(self.numbers[part], self.depths[part], self.projections[part])

    def on_device(self, first_corners: np.ndarray, device: wp.Device) -> wp.array:
        """(n,) ``DrawnObject``, given the place of each one's first corner, -1 if its corners are not kept."""
        made, rows = host_structs(len(self.numbers), DrawnObject)
        rows["object"], rows["first_corner"] = self.numbers, first_corners
        for axis, name in enumerate(("row_x", "row_y", "row_z")):
            rows[name] = self.projections[:, axis]
        return made.to(device)


def _may_be_seen(scene: DeviceScene, camera: Camera, spheres: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Whether (n, 4) spheres of device space may cover a pixel's centre, (n,) bool; and the depths of their centres."""
    eye = (scene.device_from_world @ [*camera.eye, 1.0])[:3]
    # Not by a matrix product: the threads of BLAS go on spinning for a frame's length and take the cores of ours.
    placed, radius = np.einsum("ij,kj->ik", np.array(camera_axes(camera)), spheres[:, :3] - eye), spheres[:, 3]
    aside, depth = placed[:2], placed[2]
    half_height = np.tan(np.radians(camera.fov_y) / 2.0)
    half = np.array([[half_height * camera.width / camera.height], [half_height]])
    pixels = np.array([[camera.width], [camera.height]])
    seen = depth > -radius
    seen &= (np.abs(aside) - half * depth <= radius * np.sqrt(1.0 + half**2)).all(axis=0)
    with np.errstate(all="ignore"):  # what is not wholly in front of the camera has no bounds
        middle = aside / depth
        reach = radius * np.sqrt(1.0 + middle**2) / (depth - radius)
        low, high = (0.5 * pixels * (1.0 + bound / half) for bound in (middle - reach, middle + reach))
        between = np.floor(high + CENTRE_SLACK - 0.5) < np.ceil(low - CENTRE_SLACK - 0.5)
    seen &= ~(between.any(axis=0) & (depth > radius))
    return seen, depth
