"""What every tracer must answer: along axes, from within a room, and on open sheets."""

import numpy as np
import pytest
from stress_cases.inputs import rays_about

from ldtrefl.scene import shapes
from tests.tracing.all_tracers import NEAR, all_tracers


def test_axis_parallel_rays_with_either_zero() -> None:
    mesh = shapes.make("box")
    for tracer in all_tracers(mesh):
        for zero in (0.0, -0.0):
            for axis in range(3):
                for sign in (1.0, -1.0):
                    direction = np.full(3, zero, np.float32)
                    direction[axis] = sign
                    origin = np.full(3, 0.3, np.float32)
                    origin[axis] = -4 * sign
                    hits = tracer.trace(origin[None], direction[None])
                    assert hits.t[0] == pytest.approx(3.0, abs=NEAR)


def test_from_within_a_room_every_ray_hits_a_wall() -> None:
    rng = np.random.default_rng(0)
    origins = rng.uniform(-0.9, 0.9, (5000, 3)).astype(np.float32)
    directions = rng.normal(size=(5000, 3)).astype(np.float32)
    linear, exact, bvh = (tracer.trace(origins, directions) for tracer in all_tracers(shapes.make("room")))
    assert (bvh.triangle >= 0).all() and (exact.triangle >= 0).all()
    np.testing.assert_allclose(exact.t, bvh.t, rtol=1e-4)
    assert (linear.triangle >= 0).mean() > 0.999
    np.testing.assert_allclose(np.median(np.abs(linear.t - bvh.t)), 0.0, atol=0.01)


def test_open_sheets_are_hit_from_both_sides_and_hollows_stay_hollow() -> None:
    mesh = shapes.make("bowl", {"closed": False})
    origins, directions = rays_about(mesh, 20_000, seed=3)
    linear, exact, bvh = (tracer.trace(origins, directions).triangle >= 0 for tracer in all_tracers(mesh))
    assert (linear != bvh).sum() <= 0.02 * bvh.sum()
    assert (exact != bvh).sum() == 0
