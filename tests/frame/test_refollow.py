"""Rays followed again after a move, against all of them followed anew: the same bits, and no more rays than needed."""

import dataclasses

import numpy as np
import pytest

from ldtrefl.frame.bounces import FollowedRays
from ldtrefl.frame.refollow import changed_runs, follow_changed
from ldtrefl.scene.description import Camera, Material, Object
from ldtrefl.tracing.object_sets import rays_of
from ldtrefl.tracing.ray_buffers import HitBuffer
from ldtrefl.world.device_scene import DeviceScene
from tests.frame import flat_mirror

DOWN = Camera(eye=(0.3, -3.0, 2.0), look_at=(0.0, -0.6, 0.0), width=128, height=96, fov_y=45.0)
"""Sees the ground and none of the box's places, so that all frames have the same rays."""

PLACES = ((0.1, 1.2, 2.0), (0.4, 1.2, 2.1))


def followed_anew(scene: DeviceScene, bounces: int = 1) -> FollowedRays:
    gbuffer, shaded = flat_mirror.seen_and_shaded(scene)
    assert set(gbuffer.objects.ravel().tolist()) <= {-1, flat_mirror.GROUND}
    follower = flat_mirror.follower(gbuffer, bounces, culls=True)
    return follower.follow(shaded.rays, follower.first_regions(shaded.rays))


def values(followed: FollowedRays) -> dict[str, np.ndarray]:
    """What is known of the rays, as copies."""
    hits = {name: getattr(followed.hits, name).numpy().copy() for name in HitBuffer.vars}
    rest = {"radiance": followed.radiance, "source_onwards": followed.source_onwards}
    return {**hits, **{name: array.numpy().copy() for name, array in rest.items()}}


def meets_box(followed: FollowedRays, scene: DeviceScene) -> np.ndarray:
    """(n,) whether rays meet the bounding sphere of the box, in float64."""
    box = scene.objects[flat_mirror.BOX]
    offset = box.centre - followed.rays.origin.numpy()
    along = (offset * followed.rays.direction.numpy()).sum(axis=1)
    return (along > 0) & ((offset**2).sum(axis=1) - along**2 <= box.radius**2)


def test_only_runs_that_can_meet_what_moved_are_followed_again() -> None:
    given = flat_mirror.scene(PLACES[0], camera=DOWN)
    scene = flat_mirror.on_device(given)
    before = followed_anew(scene)
    as_before = values(before)
    moved_scene = flat_mirror.on_device(given.with_object("box", translate=PLACES[1]), scene)
    truth = followed_anew(moved_scene)
    gbuffer, shaded = flat_mirror.seen_and_shaded(moved_scene)
    follower = flat_mirror.follower(gbuffer, culls=True)
    regions = follower.first_regions(shaded.rays)
    runs = changed_runs(before, shaded.rays, regions, {flat_mirror.BOX}, 3)
    assert runs is not None
    count = shaded.rays.pixel.shape[0]
    meets = meets_box(before, scene) | meets_box(truth, moved_scene)
    again = np.zeros(count, bool)
    again[rays_of(runs, count)] = True
    assert again[meets].all() and 0.1 < again.mean() < 0.6
    assert len(runs) == len(np.unique(np.flatnonzero(meets) // 64)), "a run that meets neither place is followed again"

    found = follow_changed(follower, before, shaded.rays, regions, runs)
    for name, expected in values(truth).items():
        np.testing.assert_array_equal(values(found)[name], expected, err_msg=name)
        np.testing.assert_array_equal(values(before)[name], as_before[name], err_msg=f"{name} of the last frame")
    assert (values(truth)["object"] != as_before["object"]).sum() > 50
    assert follower.stats.counters["rays"] == again.sum()
    assert follower.stats.counters["rays_kept"] == count - again.sum()


def test_rays_that_were_mirrored_again_are_followed_again() -> None:
    """A mirror box stands still, and in it the ground sees a glowing ball that moves below and behind it."""
    glowing = Material(emission=(9.0,) * 3)
    ball = Object(name="ball", shape="sphere", scale=1.5, translate=(0.1, 6.0, -4.2), material=glowing)
    given = flat_mirror.scene(PLACES[0], box_mirror=0.5, camera=DOWN)
    given = dataclasses.replace(given, objects=(*given.objects, ball))
    scene = flat_mirror.on_device(given)
    before = followed_anew(scene, 3)
    moved_scene = flat_mirror.on_device(given.with_object("ball", translate=(0.5, 6.0, -4.2)), scene)
    truth = followed_anew(moved_scene, 3)
    gbuffer, shaded = flat_mirror.seen_and_shaded(moved_scene)
    follower = flat_mirror.follower(gbuffer, 3, culls=True)
    regions = follower.first_regions(shaded.rays)
    runs = changed_runs(before, shaded.rays, regions, {2}, 3)
    assert runs is not None
    found = follow_changed(follower, before, shaded.rays, regions, runs)
    assert (values(truth)["radiance"] != values(before)["radiance"]).any(axis=1).sum() > 30
    for name, expected in values(truth).items():
        np.testing.assert_array_equal(values(found)[name], expected, err_msg=name)
    for mine, right in zip(found.later, truth.later, strict=True):
        np.testing.assert_array_equal(mine.numbers, right.numbers)
        for name in ("pixel", "t", "object", "triangle"):
            np.testing.assert_array_equal(getattr(mine.ends, name).numpy(), getattr(right.ends, name).numpy())
    mirrored_again = before.source_onwards.numpy() >= 0
    again = np.zeros(len(mirrored_again), bool)
    again[rays_of(runs, len(again))] = True
    assert again[mirrored_again].all() and again.mean() < 0.7


def test_nothing_that_moved_is_met_or_nothing_is_known() -> None:
    scene = flat_mirror.on_device(flat_mirror.scene(PLACES[0], camera=DOWN))
    before = followed_anew(scene)
    gbuffer, shaded = flat_mirror.seen_and_shaded(scene)
    follower = flat_mirror.follower(gbuffer, culls=True)
    regions = follower.first_regions(shaded.rays)
    none = changed_runs(before, shaded.rays, regions, set(), 3)
    assert none is not None and len(none) == 0
    found = follow_changed(follower, before, shaded.rays, regions, none)
    for name, expected in values(before).items():
        np.testing.assert_array_equal(values(found)[name], expected, err_msg=name)
    # Without culling no run tells what it can meet.
    everything = flat_mirror.follower(gbuffer).first_regions(shaded.rays)
    assert changed_runs(before, shaded.rays, everything, set(), 3) is None


@pytest.mark.parametrize("field", ["origin", "direction", "source"])
def test_a_ray_that_is_another_has_its_run_followed_again(field: str) -> None:
    scene = flat_mirror.on_device(flat_mirror.scene(PLACES[0], camera=DOWN))
    before = followed_anew(scene)
    gbuffer, shaded = flat_mirror.seen_and_shaded(scene)
    regions = flat_mirror.follower(gbuffer, culls=True).first_regions(shaded.rays)
    values = getattr(shaded.rays, field).numpy()
    values[200] = values[200] + 1
    runs = changed_runs(before, shaded.rays, regions, set(), 3)
    assert runs is not None and runs.tolist() == [200 // 64]


def test_other_pixels_that_see_the_mirror_are_not_compared() -> None:
    scene = flat_mirror.on_device(flat_mirror.scene(PLACES[0], camera=DOWN))
    before = followed_anew(scene)
    gbuffer, shaded = flat_mirror.seen_and_shaded(scene)
    regions = flat_mirror.follower(gbuffer, culls=True).first_regions(shaded.rays)
    shaded.rays.pixel.numpy()[0] += 1
    assert changed_runs(before, shaded.rays, regions, set(), 3) is None
