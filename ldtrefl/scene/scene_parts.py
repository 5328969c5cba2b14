"""What a file gives to a scene: objects, lights and cameras, which may be moved as a whole."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np

from ldtrefl.scene.decomposition import placed
from ldtrefl.scene.description import Camera, Light, Object

OBJECT_BYTES = 8 << 10
"""An object of a scene, without its mesh and pictures: what Python and the device keep of it."""


@dataclass(frozen=True, eq=False)
class SceneParts:
    """What a file gives to a scene."""

    objects: tuple[Object, ...]
    lights: tuple[Light, ...]
    cameras: tuple[Camera, ...]
    names: tuple[str, ...]
    """Of the cameras."""

    def moved(self, matrix: np.ndarray) -> SceneParts:
        """The same parts, all moved by a (4, 4) matrix."""
        objects = tuple(_object_moved(entry, matrix) for entry in self.objects)
        lights = tuple(_light_moved(light, matrix) for light in self.lights)
        cameras = tuple(_camera_moved(camera, matrix) for camera in self.cameras)
        return SceneParts(objects, lights, cameras, self.names)


def _object_moved(entry: Object, matrix: np.ndarray) -> Object:
    place: dict[str, Any] = {"up_axis": "z", "matrix": None, "fit": None}
    place |= {"scale": 1.0, "rotate": (0.0, 0.0, 1.0, 0.0), "translate": (0.0, 0.0, 0.0)}
    place |= placed(np.einsum("ij,jk->ik", matrix, entry.world_from_object()))
    return dataclasses.replace(entry, **place)


def _light_moved(light: Light, matrix: np.ndarray) -> Light:
    changes: dict[str, Any] = {}
    for key in ("direction", "up"):
        if (direction := getattr(light, key)) is not None:
            changes[key] = tuple(matrix[:3, :3] @ np.asarray(direction))
    if light.position is not None:
        changes["position"] = tuple((matrix @ [*light.position, 1.0])[:3])
    size = float(np.cbrt(abs(np.linalg.det(matrix[:3, :3]))))
    for key in ("radius", "width", "height"):
        if (length := getattr(light, key)) is not None:
            changes[key] = size * length
    if light.intensity is not None:
        # A scene that is made twice as large is lit the same by a light four times as strong.
        changes["intensity"] = tuple(size * size * channel for channel in light.intensity)
    return dataclasses.replace(light, **changes)


def _camera_moved(camera: Camera, matrix: np.ndarray) -> Camera:
    eye, look_at = (tuple((matrix @ [*point, 1.0])[:3]) for point in (camera.eye, camera.look_at))
    return dataclasses.replace(camera, eye=eye, look_at=look_at, up=tuple(matrix[:3, :3] @ np.asarray(camera.up)))
