"""Where virtual triangles are drawn, and which are nearer, against closed forms."""

import numpy as np
import pytest
import warp as wp

from ldtrefl.device import launch
from ldtrefl.methods.virtual.raster import DrawnPoints, as_corner, draw_back_faces, in_pixels
from ldtrefl.scene.description import Camera, Object, Scene
from ldtrefl.world.camera import Band, camera_ray, camera_view
from ldtrefl.world.device_scene import DeviceScene

CAMERA = Camera(eye=(1.0, -4.0, 2.0), look_at=(0.3, 0.1, 0.2), up=(0.1, 0.2, 1.0), fov_y=50.0, width=60, height=40)


def test_a_point_on_a_pixels_ray_is_in_that_pixel() -> None:
    view = camera_view(CAMERA, np.eye(4), Band(8, 16))
    for x, y, depth in ((0.5, 0.5, 2.0), (30.25, 7.75, 11.0), (-5.0, 30.0, 0.3), (3.0, 4.0, -2.0)):
        point = wp.vec3d(*(np.array(view.eye) + depth * np.array(camera_ray(view, wp.float64(x), wp.float64(y)))))
        found = in_pixels(view, point)
        np.testing.assert_allclose(found, [x * depth, y * depth, depth], rtol=1e-12, atol=1e-12)
        if depth > 0.0:
            np.testing.assert_allclose(as_corner(found), [x, y, 1.0 / depth], rtol=1e-12)


def points_at(places: np.ndarray, camera: Camera) -> DrawnPoints:
    """A point in each of these pixels."""
    device, points = launch.resolve_device(None), DrawnPoints()
    pixel = places[:, 1].astype(int) * camera.width + places[:, 0].astype(int)
    first = np.searchsorted(np.sort(pixel), np.arange(camera.width * camera.height + 1)).astype(np.int32)
    points.first = wp.array(first, dtype=wp.int32, device=device)
    points.place = wp.array(places[np.argsort(pixel)], dtype=wp.vec2d, device=device)
    points.width, points.rows = camera.width, camera.height
    return points


@pytest.mark.parametrize(("seen", "expected"), [(2.0, 6.0), (7.0, 0.0)])
def test_the_back_of_a_ball_is_behind_it(seen: float, expected: float) -> None:
    """Along the middle ray a ball of radius 2 at distance 4 begins at 2 and ends at 6; nothing is behind 7."""
    camera = Camera(eye=(0.0, -4.0, 0.0), look_at=(0.0, 0.0, 0.0), width=11, height=11, fov_y=20.0)
    ball = Object(shape="sphere", scale=2.0, params={"segments": [256, 128]})
    scene = DeviceScene(Scene(camera=camera, objects=(ball,)), launch.resolve_device(None))
    scale = scene.device_units_per_world_unit
    view = camera_view(camera, scene.device_from_world, Band(0, 11))
    points, device = points_at(np.array([[5.3, 5.4]]), camera), scene.device
    keys = wp.zeros(1, dtype=wp.int64, device=device)
    nearest = wp.array([seen * scale], dtype=float, device=device)
    count = -(-int(scene.triangle_counts[0]) // 1024)
    launch.launch(draw_back_faces, count, [view, points, nearest, scene.records, 0, keys], device)
    value = (keys.numpy() >> 32).astype(np.int32).view(np.float32)[0]
    found = 1.0 / (scale * value) if value > 0.0 else 0.0
    assert found == pytest.approx(expected, rel=2e-3)
