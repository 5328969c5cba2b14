"""Direct light and reflected light -> the image."""

import numpy as np
import warp as wp

import ldtrefl
from ldtrefl.device import launch
from ldtrefl.frame.composite import reflected_to_camera, reflection_picture
from ldtrefl.frame.history import FrameParts
from ldtrefl.frame.reflected_light import ReflectedLight
from ldtrefl.scene.description import Camera, Environment, Material, Object, Scene
from tests.frame import flat_mirror


def test_radiance_stands_at_its_pixels_and_is_0_elsewhere() -> None:
    device = launch.resolve_device(None)
    pixels = wp.array([5, 0, 3], dtype=int, device=device)
    radiance = wp.array([(1, 2, 3), (4, 5, 6), (7, 8, 9)], dtype=wp.vec3, device=device)
    picture = reflection_picture((2, 3), pixels, radiance)
    assert picture.shape == (2, 3, 3) and picture.dtype == np.float32
    assert picture[1, 2].tolist() == [1, 2, 3] and picture[0, 0].tolist() == [4, 5, 6]
    assert picture[1, 0].tolist() == [7, 8, 9] and picture.sum() == 45.0


def test_what_reflectors_send_is_their_reflectance_times_what_reaches_them() -> None:
    gbuffer, shaded = flat_mirror.seen_and_shaded(flat_mirror.on_device(flat_mirror.scene()))
    count, device = gbuffer.reflector_pixels.shape[0], gbuffer.scene.device
    radiance = np.random.default_rng(0).random((count, 3)).astype(np.float32)
    given = wp.array(radiance, dtype=wp.vec3, device=device)
    picture = reflected_to_camera(FrameParts(gbuffer, shaded, ReflectedLight(given), ()), given)
    sent = picture.reshape(-1, 3)[gbuffer.reflector_pixels.numpy()]
    np.testing.assert_allclose(sent, flat_mirror.GROUND_MIRROR * radiance, rtol=1e-6)
    assert (picture[~gbuffer.reflector_mask] == 0.0).all() and picture.shape == (*gbuffer.shape, 3)


def test_the_image_is_direct_light_and_reflectance_times_reflection() -> None:
    camera = Camera(eye=(0, -5, 1), look_at=(0, 0, 0), width=24, height=16)
    sky = Environment(sky=(1, 0.5, 0.25), ground=(0.2, 0.3, 0.4))
    balls = [
        Object(shape="sphere", material=Material(albedo=0.5, emission=0.125, mirror=mirror))
        for mirror in (0.0, (0.5, 0.25, 1.0))
    ]
    dull, shiny = (ldtrefl.render(Scene(camera=camera, environment=sky, objects=(ball,)), "bvh") for ball in balls)
    expected = dull.image + np.where(shiny.reflector_mask[..., None], [0.5, 0.25, 1.0] * shiny.reflection, 0.0)
    np.testing.assert_allclose(shiny.image, expected, rtol=1e-6)
