"""Reflected rays followed bounce by bounce, against closed forms; and the sums of several rays of one pixel."""

import dataclasses

import numpy as np
import pytest
import warp as wp

import ldtrefl
from ldtrefl.base import budget
from ldtrefl.device import launch
from ldtrefl.frame.bounces import LATER_BYTES, summed_by_pixel
from ldtrefl.tracing.ray_buffers import RayBuffer, empty_rays
from tests.frame import flat_mirror


@pytest.mark.parametrize("bounces", [1, 2, 3])
def test_rays_between_two_mirrors_bring_the_known_radiance(bounces: int) -> None:
    """The box mirrors, too: when the bounces are used up, it shows the environment alone."""
    given = flat_mirror.scene(box_mirror=0.5)
    # The box hides some of the ground; both are reflectors, so rays leave both.
    scene = flat_mirror.on_device(given)
    gbuffer, shaded = flat_mirror.seen_and_shaded(scene)
    follower = flat_mirror.follower(gbuffer, bounces)
    before = {name: getattr(shaded.rays, name).numpy().copy() for name in RayBuffer.vars}
    followed = follower.follow(shaded.rays, follower.first_regions(shaded.rays))
    expected, pixel = flat_mirror.reflection(given, bounces), shaded.rays.pixel.numpy()
    place = np.argsort(pixel)
    chosen = place[np.searchsorted(pixel[place], expected.pixels)]
    np.testing.assert_array_equal(pixel[chosen], expected.pixels)
    assert (expected.object == flat_mirror.BOX).sum() > 30 and np.isinf(expected.distance).sum() > 100
    np.testing.assert_array_equal(followed.hits.object.numpy()[chosen], expected.object)
    world_t = followed.hits.t.numpy()[chosen] / scene.device_units_per_world_unit
    np.testing.assert_allclose(world_t, expected.distance, rtol=1e-5)
    np.testing.assert_allclose(followed.radiance.numpy()[chosen], expected.radiance, rtol=2e-5)
    for name, values in before.items():
        np.testing.assert_array_equal(getattr(shaded.rays, name).numpy(), values, err_msg="rays stay as they started")


@pytest.mark.parametrize(("least_weight", "bounces"), [(0.6, 1), (0.3, 3)])
def test_a_ray_ends_where_too_little_would_arrive(least_weight: float, bounces: int) -> None:
    """The box keeps a half and the ground all of one colour: after 1, 2, 3, ... mirrors 1/2, 1/2, 1/4, ... is left."""
    given = flat_mirror.scene(place=(0.1, 0.2, 0.8), box_mirror=0.5)
    gbuffer, shaded = flat_mirror.seen_and_shaded(flat_mirror.on_device(given))

    leaves_ground = shaded.rays.source.numpy() == flat_mirror.GROUND

    def radiance(most: int, least: float) -> np.ndarray:
        follower = flat_mirror.follower(gbuffer, most, least_weight=least)
        followed = follower.follow(shaded.rays, follower.first_regions(shaded.rays))
        return followed.radiance.numpy()[leaves_ground]

    by_weight, by_number = radiance(64, least_weight), radiance(bounces, 0.0)
    np.testing.assert_array_equal(by_weight, by_number)
    assert (radiance(bounces + 1, 0.0) != by_number).any()


def test_later_bounces_tell_which_rays_they_are_and_where_they_end() -> None:
    """A ray that the box has sent back to the ground ends there, below where it met the box."""
    given = flat_mirror.scene(box_mirror=0.5)
    gbuffer, shaded = flat_mirror.seen_and_shaded(flat_mirror.on_device(given))
    follower = flat_mirror.follower(gbuffer, 2)
    followed = follower.follow(shaded.rays, follower.first_regions(shaded.rays))
    (later,) = followed.later
    source, first = shaded.rays.source.numpy(), followed.hits.object.numpy()
    np.testing.assert_array_equal(later.numbers, np.flatnonzero(first >= 0))
    np.testing.assert_array_equal(later.ends.pixel.numpy(), shaded.rays.pixel.numpy()[later.numbers])
    np.testing.assert_array_equal(followed.source_onwards.numpy(), first)
    sent_back = (source[later.numbers] == flat_mirror.GROUND) & (first[later.numbers] == flat_mirror.BOX)
    t, t_first = later.ends.t.numpy()[sent_back], followed.hits.t.numpy()[later.numbers][sent_back]
    is_bottom = later.ends.object.numpy()[sent_back] == flat_mirror.GROUND
    assert is_bottom.sum() > 20
    np.testing.assert_allclose(t[is_bottom], t_first[is_bottom], rtol=1e-5)


def test_bounces_are_kept_if_it_is_asked_for() -> None:
    """After each bounce what its rays met is added, mirrored as often as they were; the sum has the usual bits."""
    given = flat_mirror.scene(place=(0.1, 0.2, 0.8), box_mirror=0.5)
    gbuffer, shaded = flat_mirror.seen_and_shaded(flat_mirror.on_device(given))
    usual = flat_mirror.follower(gbuffer, 3)
    keeping = dataclasses.replace(usual, keeps_bounces=True)
    regions = usual.first_regions(shaded.rays)
    followed, kept = usual.follow(shaded.rays, regions), keeping.follow(shaded.rays, regions)
    assert followed.kept == () and len(kept.kept) == 3
    np.testing.assert_array_equal(kept.radiance.numpy(), followed.radiance.numpy())
    np.testing.assert_array_equal(kept.kept[-1].brought.numpy(), followed.radiance.numpy())
    assert kept.kept[0].rays is shaded.rays and np.array_equal(
        kept.kept[0].numbers, np.arange(len(kept.kept[0].numbers))
    )
    for bounce, later in zip(kept.kept[1:], kept.later, strict=True):
        np.testing.assert_array_equal(bounce.numbers, later.numbers)
        np.testing.assert_array_equal(bounce.hits.object.numpy(), later.ends.object.numpy())
    expected = flat_mirror.reflection(given, 3)
    place = np.argsort(shaded.rays.pixel.numpy())
    chosen = place[np.searchsorted(shaded.rays.pixel.numpy()[place], expected.pixels)]
    brought = np.stack([bounce.brought.numpy()[chosen] for bounce in kept.kept])
    is_miss = np.isinf(expected.distance)
    is_box = expected.object == flat_mirror.BOX
    first = np.where(is_miss[:, None], flat_mirror.environment(expected.direction), flat_mirror.BOX_DIRECT)
    np.testing.assert_allclose(brought[0][is_miss | is_box], first[is_miss | is_box], rtol=2e-5)
    again = is_box & (expected.later_object[:, 0] == flat_mirror.GROUND)
    assert again.sum() > 20
    second = np.broadcast_to(0.5 * flat_mirror.GROUND_DIRECT, (again.sum(), 3))
    np.testing.assert_allclose((brought[1] - brought[0])[again], second, rtol=1e-4)


def test_rays_of_bounces_that_need_too_much_memory_are_refused() -> None:
    """Where the rays of all bounces end is kept: the limit is on their sum, and they take nothing of the next frame."""
    gbuffer, shaded = flat_mirror.seen_and_shaded(flat_mirror.on_device(flat_mirror.scene((0.1, 0.2, 0.8), 0.5)))
    follower = flat_mirror.follower(gbuffer, 4)
    regions = follower.first_regions(shaded.rays)
    rays = [len(bounce.numbers) for bounce in follower.follow(shaded.rays, regions).later]
    budget.set_memory_limit(LATER_BYTES * sum(rays))
    with budget.account() as account:
        for _ in range(2):
            assert len(follower.follow(shaded.rays, regions).later) == 3 and account.taken == 0
    budget.set_memory_limit(LATER_BYTES * sum(rays) - 1)
    with pytest.raises(ldtrefl.InputError, match=r"bounce 4 of the reflected rays needs .*reflection\.max_bounces"):
        follower.follow(shaded.rays, regions)


def test_rays_and_searches_are_counted() -> None:
    """One ray a pixel of the ground, which can meet the box alone: searched for if it enters the box's sphere."""
    given = flat_mirror.scene()
    gbuffer, shaded = flat_mirror.seen_and_shaded(flat_mirror.on_device(given))
    follower = flat_mirror.follower(gbuffer)
    follower.follow(shaded.rays, follower.first_regions(shaded.rays))
    expected, counters = flat_mirror.reflection(given), follower.stats.counters
    offset = np.array(given.objects[flat_mirror.BOX].translate) - expected.origin
    along = (offset * expected.direction).sum(axis=1)
    enters = (along > 0) & ((offset**2).sum(axis=1) - along**2 <= 3 * flat_mirror.BOX_HALF**2)
    rays = shaded.rays.pixel.shape[0]
    unclear = rays - len(expected.pixels)
    assert counters["rays"] == rays == counters["searches"] + counters["searches_saved"]
    assert enters.sum() - 3 <= counters["searches"] <= enters.sum() + unclear + 3


def test_the_rays_of_a_pixel_are_summed_in_their_order_by_any_number_of_threads() -> None:
    """Large radiances of both signs: every other order rounds to another sum."""
    rng, device = np.random.default_rng(3), launch.resolve_device(None)
    counts = rng.integers(1, 9, 4000)
    pixels = rng.permutation(10_000)[:4000].astype(np.int32)
    radiance = (10.0 ** rng.uniform(0, 8, (counts.sum(), 3)) * rng.choice([-1, 1], (counts.sum(), 3))).astype(
        np.float32
    )
    rays = empty_rays(len(radiance), device)
    rays.pixel = wp.array(np.repeat(pixels, counts), dtype=wp.int32, device=device)
    expected = np.zeros((4000, 3), np.float32)
    ends = np.cumsum(counts)
    for k in range(8):  # the k-th ray of every pixel that has so many
        has = counts > k
        expected[has] += radiance[(ends - counts)[has] + k]
    sums = []
    for threads in (1, 2):
        ldtrefl.set_threads(threads)
        inputs = [
            wp.array(pixels, dtype=wp.int32, device=device),
            rays,
            wp.array(radiance, dtype=wp.vec3, device=device),
        ]
        sums.append(summed_by_pixel(*inputs).numpy())
    np.testing.assert_array_equal(sums[0], expected)
    np.testing.assert_array_equal(sums[1], expected)


def test_one_ray_a_pixel_is_its_sum() -> None:
    device = launch.resolve_device(None)
    rays, radiance = empty_rays(3, device), wp.array([(1, 2, 3)] * 3, dtype=wp.vec3, device=device)
    rays.pixel = wp.array([5, 0, 9], dtype=wp.int32, device=device)
    assert summed_by_pixel(rays.pixel, rays, radiance) is radiance
