"""Which objects the camera's rays are searched for in, rather than all their triangles be drawn.

To draw costs so much a triangle, whatever is seen of it; to search so much a pixel of the box about the object in the
image. The cheaper of the two is chosen, object by object, from the scene and the camera alone, so that a frame does not
depend on those before it. What is needed to search is made once, and does not count.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ldtrefl.frame.drawn_objects import DrawnObjects
from ldtrefl.frame.instances import MANY
from ldtrefl.scene.description import Camera
from ldtrefl.world.camera import Band, pixels_from_world, whole_image
from ldtrefl.world.device_scene import DeviceScene

FEWEST_TRIANGLES = 20_000
"""Triangles of a mesh from which it may be searched: smaller ones are drawn in a millisecond or two."""

TRIANGLE_NANOSECONDS = 40.0
"""To draw a triangle, its share of the vertices included."""

PIXEL_NANOSECONDS = 105.0
"""To search for a pixel's ray."""

LARGEST_SIZE = 2048.0
"""Pixels that an object's longest side may cover where the object is nearest. Rounding to float32 in its unit space is
then a ten-thousandth of a pixel; 2e-5 was seen."""


FARTHEST = 1e9
"""Pixels, outside of every image."""


@dataclass(frozen=True, eq=False)
class ImageBoxes:
    """The pixels that objects may cover: those in the box about the corners of their own boxes."""

    first_x: np.ndarray
    """(n,) int64; the first is past the last where there are none. So of the others."""
    last_x: np.ndarray
    first_y: np.ndarray
    last_y: np.ndarray
    nearest: np.ndarray
    """(n,) float64, depth of the nearest corner in the world; the boxes hold of objects of which this is above 0."""

    @classmethod
    def of(cls, scene: DeviceScene, objects: DrawnObjects) -> ImageBoxes:
        """In an image without bounds."""
        bounds = np.array([scene.meshes[number].unit_bounds for number in scene.mesh_of[objects.numbers]])
        which = np.indices((2, 2, 2)).reshape(3, 8)
        corners = bounds.reshape(-1, 2, 3)[:, which, np.arange(3)[:, None]]
        projected = np.einsum("nij,njk->nik", objects.projections[:, :, :3], corners) + objects.projections[:, :, 3:]
        nearest = projected[:, 2].min(axis=1)
        with np.errstate(all="ignore"):
            at = np.clip(projected[:, :2] / projected[:, 2:], -FARTHEST, FARTHEST)
        at[nearest <= 0.0] = 0.0
        low, high = (np.floor(at.min(axis=2)) - 1).astype(np.int64), (np.floor(at.max(axis=2)) + 1).astype(np.int64)
        return cls(low[:, 0], high[:, 0], low[:, 1], high[:, 1], nearest)

    def within(self, camera: Camera, band: Band) -> ImageBoxes:
        """The part of them in a band of an image."""
        first_x, last_x = np.maximum(self.first_x, 0), np.minimum(self.last_x, camera.width - 1)
        first_y = np.maximum(self.first_y, band.first_row)
        last_y = np.minimum(self.last_y, band.first_row + band.rows - 1)
        return ImageBoxes(first_x, last_x, first_y, last_y, self.nearest)

    @property
    def columns(self) -> np.ndarray:
        """(n,) pixels across, 0 or less where there are none."""
        return self.last_x - self.first_x + 1

    @property
    def lines(self) -> np.ndarray:
        """(n,) pixels down, 0 or less where there are none."""
        return self.last_y - self.first_y + 1


def objects_to_search(scene: DeviceScene, camera: Camera) -> np.ndarray:
    """(n,) int64 numbers of the objects in which to search for the camera's rays, ascending.

    Never of those that come near the camera's plane or are very large in the image, where rounding would be seen; nor
    of those whose mesh many objects have, which are drawn as instances.
    """
    is_large = scene.triangle_counts >= FEWEST_TRIANGLES
    if not is_large.any() or scene.triangle_numbers.shift > 0:  # in a group it is not told which triangle is seen
        return np.zeros(0, np.int64)
    is_large &= (np.bincount(scene.mesh_of, minlength=len(scene.meshes)) < MANY)[scene.mesh_of]
    objects = DrawnObjects.of(scene, camera, np.flatnonzero(is_large))
    whole = ImageBoxes.of(scene, objects)
    seen = whole.within(camera, whole_image(camera))
    pixels = np.maximum(seen.columns, 0) * np.maximum(seen.lines, 0)
    pays = TRIANGLE_NANOSECONDS * scene.triangle_counts[objects.numbers] > PIXEL_NANOSECONDS * pixels
    pixels_at_1 = 0.5 * camera.height / np.tan(np.radians(camera.fov_y) / 2.0)
    sides = 2.0 * np.linalg.norm(scene.world_from_unit[objects.numbers, :3, :3], axis=1).max(axis=1)
    is_small = sides * pixels_at_1 <= LARGEST_SIZE * whole.nearest
    return objects.numbers[pays & is_small]


def large_objects_in_view(scene: DeviceScene, camera: Camera) -> np.ndarray:
    """(n,) int64 numbers of the objects of many triangles that the image may show, ascending."""
    large = np.flatnonzero(scene.triangle_counts >= FEWEST_TRIANGLES)
    matrix = pixels_from_world(camera) @ np.linalg.inv(scene.device_from_world)
    # How far a point is on the inner side of each plane that bounds the view, by way of the planes' unit normals.
    planes = np.stack(
        [matrix[0], camera.width * matrix[2] - matrix[0], matrix[1], camera.height * matrix[2] - matrix[1]]
    )
    planes /= np.linalg.norm(planes[:, :3], axis=1, keepdims=True)
    inside = scene.spheres[large, :3] @ planes[:, :3].T + planes[:, 3]
    return large[(inside >= -scene.spheres[large, 3:]).all(axis=1)]
