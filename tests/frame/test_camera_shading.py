"""What the camera sees but for reflections, and the rays that leave the mirrors, against closed forms."""

import numpy as np

from ldtrefl.frame.camera_shading import shade_gbuffer
from ldtrefl.tracing.nothing import no_shadows
from tests.frame import flat_mirror


def test_rays_leave_a_flat_mirror_as_the_mirror_law_says() -> None:
    given = flat_mirror.scene()
    scene = flat_mirror.on_device(given)
    gbuffer, shaded = flat_mirror.seen_and_shaded(scene)
    expected, rays = flat_mirror.reflection(given), shaded.rays
    pixel = rays.pixel.numpy()
    np.testing.assert_array_equal(pixel, gbuffer.reflector_pixels.numpy())
    chosen = np.flatnonzero(np.isin(pixel, expected.pixels))
    chosen = chosen[np.argsort(pixel[chosen])]
    np.testing.assert_array_equal(pixel[chosen], expected.pixels)
    assert len(chosen) > 200
    np.testing.assert_allclose(flat_mirror.in_world(scene, rays.origin.numpy())[chosen], expected.origin, atol=1e-5)
    np.testing.assert_allclose(rays.direction.numpy()[chosen], expected.direction, atol=1e-5)
    assert (rays.throughput.numpy() == 1.0).all() and (rays.source.numpy() == flat_mirror.GROUND).all()
    np.testing.assert_array_equal(rays.source_triangle.numpy(), gbuffer.triangles.ravel()[pixel])


def test_direct_radiance_environment_and_reflectance() -> None:
    scene = flat_mirror.on_device(flat_mirror.scene())
    gbuffer, shaded = flat_mirror.seen_and_shaded(scene)
    radiance, objects = shaded.radiance.numpy(), gbuffer.objects.ravel()
    assert {-1, flat_mirror.GROUND, flat_mirror.BOX} == set(objects.tolist())
    sky = flat_mirror.environment(flat_mirror.camera_directions(flat_mirror.CAMERA))
    np.testing.assert_allclose(radiance[objects < 0], sky[objects < 0], rtol=1e-5)
    for number, light in ((flat_mirror.GROUND, flat_mirror.GROUND_DIRECT), (flat_mirror.BOX, flat_mirror.BOX_DIRECT)):
        np.testing.assert_allclose(radiance[objects == number], np.tile(light, ((objects == number).sum(), 1)), 1e-6)
    assert (shaded.mirror.numpy() == flat_mirror.GROUND_MIRROR.astype(np.float32)).all()


def test_without_rays_the_radiance_is_the_same() -> None:
    scene = flat_mirror.on_device(flat_mirror.scene())
    gbuffer, shaded = flat_mirror.seen_and_shaded(scene)
    alone = shade_gbuffer(gbuffer, no_shadows(scene.device), starts_rays=False)
    assert alone.rays.pixel.shape[0] == 0
    np.testing.assert_array_equal(alone.radiance.numpy(), shaded.radiance.numpy())
    np.testing.assert_array_equal(alone.mirror.numpy(), shaded.mirror.numpy())
