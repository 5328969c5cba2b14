"""Where the first rays end, as pictures: each ray at its pixel, nothing elsewhere."""

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.frame.first_hits import FirstHits
from ldtrefl.tracing.ray_buffers import empty_hits, empty_rays
from tests.frame import flat_mirror


def test_every_ray_stands_at_its_pixel() -> None:
    device = launch.resolve_device(None)
    rays, ends = empty_rays(3, device), empty_hits(3, device)
    rays.pixel = wp.array([5, 0, 4], dtype=wp.int32, device=device)
    ends.t = wp.array([3.0, np.inf, 0.5], dtype=float, device=device)
    ends.object = wp.array([7, -1, 0], dtype=wp.int32, device=device)
    ends.triangle = wp.array([11, -1, 2], dtype=wp.int32, device=device)
    hits = FirstHits((2, 3), rays, ends, device_units_per_world_unit=0.25)
    assert hits.distance.dtype == np.float32 and hits.distance.tolist() == [[np.inf] * 3, [np.inf, 2.0, 12.0]]
    assert hits.object.dtype == np.int32 and hits.object.tolist() == [[-1, -1, -1], [-1, 0, 7]]
    assert hits.triangle.dtype == np.int32 and hits.triangle.tolist() == [[-1, -1, -1], [-1, 2, 11]]
    assert hits.distance is hits.distance, "a picture is made once"


def test_distances_in_a_flat_mirror_are_the_known_ones() -> None:
    given = flat_mirror.scene()
    gbuffer, shaded = flat_mirror.seen_and_shaded(flat_mirror.on_device(given))
    follower = flat_mirror.follower(gbuffer)
    hits = FirstHits.of(gbuffer, follower.follow(shaded.rays, follower.first_regions(shaded.rays)))
    expected = flat_mirror.reflection(given)
    assert hits.distance.shape == (flat_mirror.CAMERA.height, flat_mirror.CAMERA.width)
    np.testing.assert_allclose(hits.distance.ravel()[expected.pixels], expected.distance, rtol=1e-5)
    np.testing.assert_array_equal(hits.object.ravel()[expected.pixels], expected.object)
    assert (hits.object[~gbuffer.reflector_mask] == -1).all() and np.isinf(hits.distance[~gbuffer.reflector_mask]).all()
