"""Rays taken from a buffer, by number."""

import numpy as np

from ldtrefl.device import launch
from ldtrefl.frame.taken_rays import taken
from ldtrefl.tracing.ray_buffers import RayBuffer, empty_rays


def test_every_field_of_the_rays_is_taken_in_the_order_of_the_numbers() -> None:
    rng, rays = np.random.default_rng(0), empty_rays(500, launch.resolve_device(None), carries_footprints=True)
    numbers = rng.permutation(500)[:90]
    for name in RayBuffer.vars:
        array = getattr(rays, name)
        array.assign(rng.integers(0, 100, array.numpy().shape).astype(array.numpy().dtype))
    part = taken(rays, numbers)
    for name in RayBuffer.vars:
        np.testing.assert_array_equal(getattr(part, name).numpy(), getattr(rays, name).numpy()[numbers], err_msg=name)


def test_no_rays_are_taken() -> None:
    assert taken(empty_rays(3, launch.resolve_device(None)), np.arange(0)).pixel.shape == (0,)
