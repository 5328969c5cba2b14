"""Where rays end, as pictures: each ray at its pixel, nothing elsewhere."""

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.frame.bounce_hits import BounceHits, FirstHits
from ldtrefl.tracing.ray_buffers import RayEnds, empty_hits, empty_rays
from tests.frame import flat_mirror


def flat_mirror_hits(bounces: int) -> tuple[FirstHits, flat_mirror.Reflection, np.ndarray]:
    """The hits of a flat mirror and a mirror box, the known ones, and the mask of the reflectors."""
    given = flat_mirror.scene(place=(0.1, 0.2, 0.8), box_mirror=0.5)
    gbuffer, shaded = flat_mirror.seen_and_shaded(flat_mirror.on_device(given))
    follower = flat_mirror.follower(gbuffer, bounces)
    hits = FirstHits.of(gbuffer, follower.follow(shaded.rays, follower.first_regions(shaded.rays)))
    return hits, flat_mirror.reflection(given, bounces), gbuffer.reflector_mask


def test_every_ray_stands_at_its_pixel() -> None:
    device = launch.resolve_device(None)
    rays, ends = empty_rays(3, device), empty_hits(3, device)
    rays.pixel = wp.array([5, 0, 4], dtype=wp.int32, device=device)
    ends.t = wp.array([3.0, np.inf, 0.5], dtype=float, device=device)
    ends.object = wp.array([7, -1, 0], dtype=wp.int32, device=device)
    ends.triangle = wp.array([11, -1, 2], dtype=wp.int32, device=device)
    hits = BounceHits((2, 3), RayEnds.of(rays, ends), device_units_per_world_unit=0.25)
    assert hits.distance.dtype == np.float32 and hits.distance.tolist() == [[np.inf] * 3, [np.inf, 2.0, 12.0]]
    assert hits.object.dtype == np.int32 and hits.object.tolist() == [[-1, -1, -1], [-1, 0, 7]]
    assert hits.triangle.dtype == np.int32 and hits.triangle.tolist() == [[-1, -1, -1], [-1, 2, 11]]
    assert hits.followed.tolist() == [[True, False, False], [False, True, True]]
    assert hits.distance is hits.distance, "a picture is made once"


def test_distances_in_a_flat_mirror_are_the_known_ones() -> None:
    hits, expected, mask = flat_mirror_hits(1)
    assert hits.distance.shape == (flat_mirror.CAMERA.height, flat_mirror.CAMERA.width) and hits.later == ()
    np.testing.assert_allclose(hits.distance.ravel()[expected.pixels], expected.distance, rtol=1e-5)
    np.testing.assert_array_equal(hits.object.ravel()[expected.pixels], expected.object)
    assert (hits.object[~mask] == -1).all() and np.isinf(hits.distance[~mask]).all()
    np.testing.assert_array_equal(hits.followed, mask)


def test_later_bounces_end_at_the_known_places() -> None:
    """From the ground to the box, back to the ground, to the box again; most rays go away on the way."""
    hits, expected, mask = flat_mirror_hits(4)
    assert len(hits.later) == 3 and expected.later_followed.sum(axis=0).min() > 10
    for k, bounce in enumerate(hits.later):
        followed = expected.later_followed[:, k]
        np.testing.assert_array_equal(bounce.followed.ravel()[expected.pixels], followed)
        np.testing.assert_allclose(bounce.distance.ravel()[expected.pixels], expected.later_distance[:, k], rtol=1e-5)
        np.testing.assert_array_equal(bounce.object.ravel()[expected.pixels], expected.later_object[:, k])
        assert not bounce.followed[~mask].any() and (bounce.object[~bounce.followed] == -1).all()
        np.testing.assert_array_equal(bounce.triangle >= 0, bounce.object >= 0)


def test_pictures_belong_to_one_owner() -> None:
    hits, _, _ = flat_mirror_hits(2)
    pictures = hits.object, hits.later[0].object
    other = hits.without_pictures()
    for mine, picture in zip((other.object, other.later[0].object), pictures, strict=True):
        np.testing.assert_array_equal(mine, picture)
        assert mine is not picture
