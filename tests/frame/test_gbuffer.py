"""The G-buffer: surfaces of what pixels see, which pixels see reflectors, and pictures that are the caller's."""

import numpy as np
from stress_cases.inputs import camera_rays

from ldtrefl.frame.pixel_order import pixels_in_blocks
from ldtrefl.frame.visibility import draw_gbuffer
from ldtrefl.scene.description import Camera, Object, Scene
from tests.frame import flat_mirror


def test_positions_and_normals() -> None:
    camera = Camera(eye=(1.5, -3, 1), look_at=(0, 0, 0), width=120, height=80)
    device_scene = flat_mirror.on_device(Scene(camera=camera, objects=(Object(shape="sphere"),)))
    seen = draw_gbuffer(device_scene, camera)
    position, normal = (x.numpy().reshape(80, 120, 3)[seen.objects >= 0] for x in seen.surfaces)
    assert len(position) > 3000
    np.testing.assert_allclose(np.linalg.norm(position, axis=1), 1.0, atol=2e-3)
    np.testing.assert_allclose(normal, position, atol=5e-3)


def test_through_a_telephoto_lens_pixels_see_points_on_their_own_rays() -> None:
    """Neighbouring pixels' directions differ by less than float32 tells apart."""
    camera = Camera(eye=(0, -5e4, 1.5e4), look_at=(0, 0, 0), width=120, height=80, fov_y=0.001)
    device_scene = flat_mirror.on_device(Scene(camera=camera, objects=(Object(shape="plane", scale=4.0),)))
    seen = draw_gbuffer(device_scene, camera)
    assert (seen.objects == 0).all()
    position = seen.surfaces[0].numpy() @ np.linalg.inv(device_scene.device_from_world)[:3, :3].T
    position += np.linalg.inv(device_scene.device_from_world)[:3, 3]
    eye, ray = camera_rays(camera)
    expected = eye - (eye[:, 2] / ray[:, 2])[:, None] * ray
    pixel = np.linalg.norm(expected[1] - expected[0])
    assert np.linalg.norm(position - expected, axis=1).max() < 1e-2 * pixel


def test_pixels_that_see_a_reflector() -> None:
    given = flat_mirror.scene()
    seen, _ = flat_mirror.seen_and_shaded(flat_mirror.on_device(given))
    assert seen.shape == (given.camera.height, given.camera.width)
    np.testing.assert_array_equal(seen.reflector_mask, seen.objects == flat_mirror.GROUND)
    assert seen.reflector_mask.ravel()[flat_mirror.reflection(given).pixels].all()
    np.testing.assert_array_equal(seen.reflector_pixels.numpy(), pixels_in_blocks(seen.reflector_mask))


def test_pictures_are_copies() -> None:
    seen, _ = flat_mirror.seen_and_shaded(flat_mirror.on_device(flat_mirror.scene()))
    before = seen.view.object.numpy().copy()
    seen.objects[:] = 77
    np.testing.assert_array_equal(seen.view.object.numpy(), before)
