"""A reflector as the eye sees it, alone and in a wider view: the position and the normal of each texel.

P. Estalella, I. Martin, G. Drettakis, D. Tost, "A GPU-driven algorithm for accurate interactive reflections on curved
objects" (2006), sections 4 and 5.2: textures TP and TN, in a frustum wider than the image's, so that reflection points
beyond its border are found, too.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import warp as wp

from ldtrefl.frame.drawn_objects import DrawnObjects
from ldtrefl.frame.visibility import resolved
from ldtrefl.frame.zbuffer import CornerRoom, Drawing
from ldtrefl.scene.description import Camera
from ldtrefl.world.camera import CameraView, whole_image
from ldtrefl.world.device_scene import DeviceScene

WIDEST = 150.0
"""Degrees from top to bottom of a wider view, at most."""


@wp.struct
class ReflectorTexture:
    """What the eye sees of a reflector."""

    position: wp.array(dtype=wp.vec3d)  # device space; set where it is seen
    normal: wp.array(dtype=wp.vec3)  # unit, facing the eye
    object: wp.array(dtype=wp.int32)  # -1 where it is not seen
    width: int
    height: int
    camera: CameraView  # that sees it
    start: int  # a texel that sees it, in the middle of the box about all of these; -1 if there is none


def wider(camera: Camera, factor: float, fineness: float = 1.0) -> Camera:
    """A camera whose image reaches ``factor`` times as far each way, with so many texels along a pixel."""
    half = factor * np.tan(np.radians(camera.fov_y) / 2)
    fov = min(np.degrees(2 * np.arctan(half)), max(WIDEST, camera.fov_y))
    reach = np.tan(np.radians(fov) / 2) / np.tan(np.radians(camera.fov_y) / 2)
    width, height = (max(1, round(fineness * reach * side)) for side in (camera.width, camera.height))
    return dataclasses.replace(camera, fov_y=float(fov), width=width, height=height)


def texture_of(scene: DeviceScene, number: int, camera: Camera) -> ReflectorTexture:
    """Draw a reflector alone."""
    others = np.delete(np.arange(len(scene.objects)), number)
    drawing = Drawing(camera, whole_image(camera), CornerRoom.of(scene, others))
    drawing.draw(scene, DrawnObjects.of(scene, camera, np.array([number])))
    gbuffer = resolved(drawing, scene)
    texture = ReflectorTexture()
    texture.position, texture.normal = gbuffer.surfaces
    texture.object = gbuffer.view.object
    texture.width, texture.height = camera.width, camera.height
    texture.camera = gbuffer.view.camera
    texture.start = _middle(gbuffer.objects >= 0)
    return texture


def _middle(is_seen: np.ndarray) -> int:
    """The number of the set pixel of an (h, w) mask that is nearest to the middle of the box about all of them; -1 if
    there is none."""
    rows, columns = np.nonzero(is_seen)
    if not len(rows):
        return -1
    middle = (rows.min() + rows.max()) / 2, (columns.min() + columns.max()) / 2
    nearest = int(((rows - middle[0]) ** 2 + (columns - middle[1]) ** 2).argmin())
    return int(rows[nearest]) * is_seen.shape[1] + int(columns[nearest])
