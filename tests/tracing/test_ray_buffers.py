"""Rays and their ends as arrays: which hit is kept, copies, and buffers joined to one."""

import numpy as np
import warp as wp
from numpy.lib.recfunctions import structured_to_unstructured

from ldtrefl.device import launch
from ldtrefl.tracing.hit import Hit
from ldtrefl.tracing.ray_buffers import (
    HitBuffer,
    RayBuffer,
    cloned,
    copy_ray,
    distance_across,
    empty_hits,
    empty_rays,
    joined,
    keep_nearer,
    set_miss,
)


@launch.kernel
def keep_nearest(
    first: int,
    # In:
    objects: wp.array2d(dtype=int),
    distances: wp.array2d(dtype=float),
    # Out:
    hits_out: HitBuffer,
):
    """Offer one ray its hits one after another."""
    i = first + wp.tid()
    set_miss(hits_out, i)
    for k in range(objects.shape[1]):
        hit = Hit()
        hit.triangle = 10 * objects[i, k]
        keep_nearer(hits_out, i, objects[i, k], distances[i, k], hit)


@launch.kernel
def turn_round(
    first: int,
    # In:
    rays: RayBuffer,
    # Out:
    rays_out: RayBuffer,
):
    """Copy one ray to its place from the end."""
    i = first + wp.tid()
    copy_ray(rays, i, rays_out, rays.pixel.shape[0] - 1 - i)


def test_the_nearest_hit_is_kept_and_of_two_in_one_place_the_first_object() -> None:
    device = launch.resolve_device(None)
    objects = np.array([[0, 1, 2], [2, 1, 0], [2, 0, 1], [1, 2, 0]])
    distances = np.array([[3.0, 1.0, 2.0], [1.0, 1.0, 1.0], [1.0, 2.0, 1.0], [np.inf, np.inf, np.inf]])
    hits = empty_hits(4, device)
    given = [wp.array(objects, dtype=int, device=device), wp.array(distances, dtype=float, device=device)]
    launch.launch(keep_nearest, 4, [*given, hits], device)
    assert hits.object.numpy().tolist() == [1, 0, 1, -1]
    assert hits.triangle.numpy().tolist() == [10, 0, 10, -1]
    assert hits.t.numpy().tolist() == [1.0, 1.0, 1.0, np.inf]


def some_rays(count: int, seed: int) -> RayBuffer:
    """Rays of random numbers."""
    rng, rays = np.random.default_rng(seed), empty_rays(count, launch.resolve_device(None), carries_footprints=True)
    for name in RayBuffer.vars:
        array = getattr(rays, name)
        array.assign(rng.integers(0, 100, array.numpy().shape).astype(array.numpy().dtype))
    return rays


def values(buffer: RayBuffer) -> dict[str, list]:
    arrays = {name: getattr(buffer, name).numpy() for name in RayBuffer.vars}
    arrays["footprint"] = structured_to_unstructured(arrays["footprint"])
    return {name: array.tolist() for name, array in arrays.items()}


def test_every_field_of_a_ray_is_copied_and_joined() -> None:
    rays, others = some_rays(5, 0), some_rays(3, 1)
    turned = empty_rays(5, launch.resolve_device(None), carries_footprints=True)
    launch.launch(turn_round, 5, [rays, turned], launch.resolve_device(None))
    assert values(turned) == {name: array[::-1] for name, array in values(rays).items()}
    both = joined(RayBuffer, [rays, others])
    assert values(both) == {name: array + values(others)[name] for name, array in values(rays).items()}


def test_a_clone_has_memory_of_its_own() -> None:
    rays = some_rays(4, 2)
    before, copy = values(rays), cloned(RayBuffer, rays)
    rays.pixel.fill_(-1)
    assert values(copy) == before and values(rays) != before


def test_a_clone_of_some_arrays_shares_the_others() -> None:
    rays = some_rays(4, 2)
    copy = cloned(RayBuffer, rays, ("source",))
    for name in RayBuffer.vars:
        assert (getattr(copy, name).ptr == getattr(rays, name).ptr) == (name != "source"), name
    assert values(copy) == values(rays)


def test_distance_across_is_that_of_the_rays_at_t() -> None:
    origin, direction = np.zeros((2, 3)), np.array([[0.0, 0.0, 1.0]] * 2)
    other = np.array([[0.0, 0.1, 5.0], [0.0, 0.0, 0.0]])
    aside = np.array([[0.0, 0.0, 1.0], [0.0, 0.01, 1.0]])
    np.testing.assert_allclose(distance_across(origin, direction, other, aside, np.array([7.0, 7.0])), [0.1, 0.07])
