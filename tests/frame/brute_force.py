"""Which triangle each pixel sees, in float64: every triangle against every pixel's centre in its box."""

from dataclasses import dataclass

import numpy as np

from ldtrefl.frame.gbuffer import GBuffer
from ldtrefl.scene.description import Camera
from ldtrefl.world.camera import pixels_from_world
from ldtrefl.world.device_scene import DeviceScene

EDGE = 1e-4
"""Pixels from an edge within which either of two triangles is right."""

SAME_DEPTH = 1e-6
"""Relative difference of depths that rounding to float32 may turn round."""


@dataclass
class BruteForce:
    """The nearest triangle of every pixel, of a scene that lies before the camera."""

    object: np.ndarray
    triangle: np.ndarray
    nearness: np.ndarray
    corners: list[np.ndarray]
    """Per object (m, 3, 3): of its triangles' corners x and y in pixels, and 1 / depth."""

    @classmethod
    def of(cls, scene: DeviceScene, camera: Camera) -> "BruteForce":
        shape = camera.height, camera.width
        found = cls(np.full(shape, -1), np.full(shape, -1), np.zeros(shape), [])
        for number, entry in enumerate(scene.objects):
            matrix = pixels_from_world(camera) @ entry.world_from_unit
            centre, half = entry.geometry.mesh.unit_frame
            points = (entry.geometry.mesh.vertices - centre) / half
            if not len(entry.geometry.mesh.outliers):
                points = entry.geometry.mesh.unit_vertices.astype(float)
            x, y, depth = matrix[:, :3] @ points.T + matrix[:, 3:]
            assert (depth > 0).all()
            found.corners.append(np.stack([x / depth, y / depth, 1.0 / depth], 1)[entry.geometry.mesh.faces])
            found._add(number)
        return found

    def _add(self, number: int) -> None:
        corners = self.corners[number]
        height, width = self.object.shape
        low = np.maximum(np.ceil(corners[:, :, :2].min(axis=1) - 0.5).astype(int), 0)
        high = np.minimum(np.floor(corners[:, :, :2].max(axis=1) - 0.5).astype(int), [width - 1, height - 1])
        for k in np.flatnonzero((low <= high).all(axis=1)):
            (x, y), (last_x, last_y) = low[k], high[k]
            nearness = nearness_at(corners[k], *np.meshgrid(np.arange(x, last_x + 1), np.arange(y, last_y + 1)))
            window = np.s_[y : last_y + 1, x : last_x + 1]
            is_nearer = nearness > self.nearness[window]
            self.nearness[window][is_nearer] = nearness[is_nearer]
            self.object[window][is_nearer], self.triangle[window][is_nearer] = number, k

    def wrong(self, seen: GBuffer) -> np.ndarray:
        """(n, 2) rows and columns of pixels that see something else, though no edge is near, and no other depth as
        deep."""
        differ = np.argwhere((seen.objects != self.object) | (seen.triangles != self.triangle))
        return np.array([place for place in differ if not self._may_differ(seen, *place)]).reshape(-1, 2)

    def _may_differ(self, seen: GBuffer, row: int, column: int) -> bool:
        here = self.object[row, column], self.triangle[row, column]
        there = seen.objects[row, column], seen.triangles[row, column]
        for number, triangle in (here, there):
            if number >= 0 and edge_distance(self.corners[number][triangle], column, row) < EDGE:
                return True
        if here[0] < 0 or there[0] < 0:
            return False
        other = nearness_at(self.corners[there[0]][there[1]], np.array([[column]]), np.array([[row]]))[0, 0]
        return bool(abs(other - self.nearness[row, column]) < SAME_DEPTH * self.nearness[row, column])


def nearness_at(corners: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """1 / depth of a triangle at pixels' centres, 0 outside it."""
    at = []
    for k in range(3):
        (px, py, _), (qx, qy, _) = corners[(k + 1) % 3], corners[(k + 2) % 3]
        at.append((qx - px) * (y + 0.5 - py) - (qy - py) * (x + 0.5 - px))
    weights = np.array(at)
    area = weights.sum(axis=0)
    inside = ((weights >= 0).all(axis=0) | (weights <= 0).all(axis=0)) & (area != 0)
    return np.where(inside, np.tensordot(corners[:, 2], weights, 1) / np.where(area == 0, 1, area), 0.0)


def edge_distance(corners: np.ndarray, column: int, row: int) -> float:
    """Pixels from a pixel's centre to the nearest edge of a triangle."""
    point, distances = np.array([column + 0.5, row + 0.5]), []
    for k in range(3):
        begin, way = corners[k, :2], corners[(k + 1) % 3, :2] - corners[k, :2]
        part = np.clip((point - begin) @ way / max(way @ way, 1e-300), 0.0, 1.0)
        distances.append(np.linalg.norm(point - begin - part * way))
    return float(min(distances))
