"""Batches of rays by every tracer: directions of any length, rays that are none, arrays of both kinds, wrong arrays."""

import numpy as np
import pytest
import warp as wp
from stress_cases.inputs import rays_about

import ldtrefl
from ldtrefl.scene import shapes
from tests.tracing.all_tracers import NEAR, all_tracers


def test_direction_length_scales_t() -> None:
    origins, directions = rays_about(shapes.make("torus"), 2000)
    for tracer in all_tracers(shapes.make("torus")):
        unit = tracer.trace(origins, directions)
        for length in (2.0**-66, 2.0**-10, 4.0, 2.0**60):  # which round no direction
            scaled = tracer.trace(origins, directions * np.float32(length))
            np.testing.assert_array_equal(scaled.triangle, unit.triangle)
            np.testing.assert_array_equal(scaled.t, unit.t / np.float32(length))


def test_rays_that_are_none_miss_and_are_counted() -> None:
    odd = np.array([[0, 0, 0], [np.nan, 0, 1], [np.inf, 0, 0], [0, 0, 1]], np.float32)
    origins = np.array([[0, 0, -5]] * 4, np.float32)
    for tracer in all_tracers(shapes.make("box")):
        hits = tracer.trace(origins, odd)
        assert np.isposinf(hits.t[:3]).all() and (hits.triangle[:3] == -1).all()
        assert hits.t[3] == pytest.approx(4.0, abs=NEAR)
        assert hits.invalid == 3
        nowhere = tracer.trace(np.full((1, 3), np.nan, np.float32), odd[3:])
        assert nowhere.triangle[0] == -1 and nowhere.invalid == 1


def test_warp_arrays_in_warp_arrays_out() -> None:
    origins, directions = rays_about(shapes.make("torus"), 100)
    for tracer in all_tracers(shapes.make("torus")):
        expected = tracer.trace(origins, directions)
        hits = tracer.trace(*(wp.array(x, dtype=wp.vec3, device="cpu") for x in (origins, directions)))
        assert isinstance(hits.t, wp.array)
        np.testing.assert_array_equal(hits.t.numpy(), expected.t)


def test_wrong_arrays_are_refused() -> None:
    for tracer in all_tracers(shapes.make("box")):
        with pytest.raises(ldtrefl.InputError, match=r"origins must have shape \(\.\.\., 3\)"):
            tracer.trace(np.zeros((3, 2)), np.zeros((3, 2)))
        with pytest.raises(ldtrefl.InputError, match=r"origins of shape \(2, 3\) for directions of shape \(3, 3\)"):
            tracer.trace(np.zeros((2, 3)), np.zeros((3, 3)))
    with pytest.raises(ldtrefl.InputError, match="unknown search 'linea'; did you mean 'linear'"):
        all_tracers(shapes.make("box"))[1].trace(np.zeros((1, 3)), np.zeros((1, 3)), search="linea")
