"""The reflector's textures: it alone, in a wider view with texels of the size that is asked for."""

import numpy as np
import pytest

from ldtrefl.device import launch
from ldtrefl.methods.virtual.reflector_texture import WIDEST, texture_of, wider
from ldtrefl.scene.description import Camera, Object, Scene
from ldtrefl.world.device_scene import DeviceScene

CAMERA = Camera(eye=(0.0, -5.0, 0.0), look_at=(0.0, 0.0, 0.0), width=96, height=64, fov_y=20.0)


def test_a_wider_view_has_texels_of_the_same_size() -> None:
    view = wider(CAMERA, 2.0, 3.0)
    assert np.tan(np.radians(view.fov_y / 2)) == pytest.approx(2.0 * np.tan(np.radians(10.0)))
    assert (view.width, view.height) == (576, 384)
    assert wider(Camera(eye=(0, -5, 0), look_at=(0, 0, 0), fov_y=120.0), 8.0).fov_y == WIDEST


def test_the_reflector_alone_is_seen() -> None:
    """A wall stands before the ball, and the ball reaches beyond the image."""
    ball = Object(shape="sphere", params={"segments": [256, 128]}, translate=(1.2, 0.0, 0.0))
    scene = DeviceScene(
        Scene(camera=CAMERA, objects=(Object(shape="box", translate=(0, -2, 0)), ball)), launch.resolve_device(None)
    )
    texture = texture_of(scene, 1, wider(CAMERA, 2.0))
    seen = texture.object.numpy().reshape(texture.height, texture.width)
    assert set(np.unique(seen)) == {-1, 1} and not seen[0].any() == 0
    world = np.linalg.inv(scene.device_from_world)
    position = texture.position.numpy() @ world[:3, :3].T + world[:3, 3]
    normal = texture.normal.numpy()[seen.ravel() == 1]
    away = position[seen.ravel() == 1] - [1.2, 0.0, 0.0]
    np.testing.assert_allclose(np.linalg.norm(away, axis=1), 1.0, atol=1e-3)
    assert (np.einsum("ij,ij->i", away, normal) > 0.999).all()
    rows, columns = np.nonzero(seen == 1)
    assert (
        texture.start == round((rows.min() + rows.max()) / 2) * texture.width + int((columns.min() + columns.max()) / 2)
        or seen.ravel()[texture.start] == 1
    )
    hidden = texture_of(scene, 1, Camera(eye=(0, -5, 0), look_at=(0, -9, 0), width=20, height=20))
    assert hidden.start == -1
