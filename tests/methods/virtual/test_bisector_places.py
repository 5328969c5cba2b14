"""Vertices by the search in image space against the reflection points of a ball."""

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.device.stats import Stats
from ldtrefl.methods.virtual.bisector_places import BisectorPlaces
from ldtrefl.methods.virtual.reflector_texture import texture_of, wider
from ldtrefl.methods.virtual.vertex import HIDDEN, VirtualVertex
from ldtrefl.scene.description import Camera, Object, Scene
from ldtrefl.world.camera import camera_view, whole_image
from ldtrefl.world.device_scene import DeviceScene
from tests.methods.virtual.reflection_on_ball import is_hidden, reflection_points, unit

CAMERA = Camera(eye=(0.3, -5.0, 0.5), look_at=(0.0, 0.0, 0.0), width=240, height=160, fov_y=28.0)


def test_a_ball_shows_points_within_a_texel_and_hides_others() -> None:
    ball = Object(shape="sphere", params={"segments": [1024, 512]})
    scene = DeviceScene(Scene(camera=CAMERA, objects=(ball,)), launch.resolve_device(None))
    matrix, device = scene.device_from_world, scene.device
    view = camera_view(CAMERA, matrix, whole_image(CAMERA))
    wide, stats = wider(CAMERA, 1.0), Stats()
    places = BisectorPlaces(view, texture_of(scene, 0, wide), stats)
    rng = np.random.default_rng(4)
    points = unit(rng.normal(size=(10_000, 3))) * rng.uniform(1.05, 5.0, (10_000, 1))
    vertices = wp.empty(len(points), dtype=VirtualVertex, device=device)
    places(wp.array(points @ matrix[:3, :3].T + matrix[:3, 3], dtype=wp.vec3d, device=device), vertices)
    found, back = vertices.numpy(), np.linalg.inv(matrix)
    eye, hidden = np.array(CAMERA.eye), is_hidden(np.array(CAMERA.eye), points)
    true = reflection_points(eye, points)
    # Texels near the border are seen from the side, and points that all but touch the ball may lie behind one's plane.
    inside = (true @ eye > 1.5) & ~hidden & (((points - true) * true).sum(axis=1) > 0.05)
    at = found["point"] @ back[:3, :3].T + back[:3, 3]
    texel = 2 * np.tan(np.radians(CAMERA.fov_y / 2)) / CAMERA.height * np.linalg.norm(eye - true, axis=1)
    across = unit(true - eye)
    off = at - true
    off -= (off * across).sum(axis=1, keepdims=True) * across
    assert (np.linalg.norm(off, axis=1)[inside] < 1.5 * texel[inside]).mean() > 0.999
    assert (found["is_seen"][inside] == 1).mean() > 0.999 and (found["is_seen"][hidden] == HIDDEN).mean() > 0.99
    assert stats.counters["vertices"] == len(points) and stats.counters["steps"] > len(points)
    placed = found["position"] @ back[:3, :3].T + back[:3, 3]
    length = np.linalg.norm(at - eye, axis=1) + np.linalg.norm(points - at, axis=1)
    np.testing.assert_allclose(np.linalg.norm(placed - eye, axis=1)[inside], length[inside], rtol=1e-6)


def test_hidden_vertices_stand_before_the_reflector_and_meet_the_others_at_the_border() -> None:
    """Equation 1: what lies behind the tangent plane is mirrored to before it; in the plane it stays."""
    ball = Object(shape="sphere", params={"segments": [1024, 512]})
    scene = DeviceScene(Scene(camera=CAMERA, objects=(ball,)), launch.resolve_device(None))
    matrix, device = scene.device_from_world, scene.device
    places = BisectorPlaces(
        camera_view(CAMERA, matrix, whole_image(CAMERA)), texture_of(scene, 0, wider(CAMERA, 1.2, 4.0)), Stats()
    )
    heights = np.linspace(0.9, 1.5, 41)
    points = np.column_stack([np.zeros(41), np.full(41, 1.5), heights])
    vertices = wp.empty(41, dtype=VirtualVertex, device=device)
    places(wp.array(points @ matrix[:3, :3].T + matrix[:3, 3], dtype=wp.vec3d, device=device), vertices)
    placed = vertices.numpy()["position"] @ np.linalg.inv(matrix)[:3, :3].T + np.linalg.inv(matrix)[:3, 3]
    assert set(vertices.numpy()["is_seen"]) == {1, int(HIDDEN)}
    # Texels at the border are seen from the side; turned about the normal in place of mirrored they would jump by 4.
    assert np.linalg.norm(np.diff(placed, axis=0), axis=1).max() < 0.6
