"""A surface in (u, v): against closed forms and finite differences, round and over the poles, holes, memory."""

import numpy as np
import pytest
import warp as wp

import ldtrefl
from ldtrefl.base import budget
from ldtrefl.device import launch
from ldtrefl.methods.virtual.star_shape import StarShape, star_shape
from ldtrefl.methods.virtual.uv_surface import UvSurface, pole_axes, uv_of, uv_point, uv_surface
from ldtrefl.scene.shapes import make

RNG = np.random.default_rng(18)
CPU = wp.get_device("cpu")
POLE = np.array([0.3, -2.0, 0.5])
SEMIAXES = np.array([1.0, 1.4, 0.8])
CENTRE = np.array([5.0, -2.0, 1.0])


class Ellipsoid(StarShape):
    """With its radii in closed form."""

    def radii(self, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        radii = (directions**2 @ SEMIAXES**-2.0) ** -0.5
        gradients = -(radii**3)[:, None] * directions / SEMIAXES**2
        return radii, gradients - (gradients * directions).sum(axis=1, keepdims=True) * directions


def ellipsoid(rows: int = 128) -> UvSurface:
    return uv_surface(Ellipsoid(CENTRE, np.zeros((0, 3)), np.zeros((0, 3), int), None), POLE, rows, CPU)


@launch.kernel
def look_up(
    first: int,
    # In:
    surface: UvSurface,
    uv: wp.array(dtype=wp.vec2d),
    # Out:
    point_out: wp.array(dtype=wp.vec3d),
    du_out: wp.array(dtype=wp.vec3d),
    dv_out: wp.array(dtype=wp.vec3d),
    uv_out: wp.array(dtype=wp.vec2d),
):
    """Look up one (u, v), and that of what is found there."""
    i = first + wp.tid()
    at = uv_point(surface, uv[i])
    point_out[i] = at.point
    du_out[i] = at.du
    dv_out[i] = at.dv
    uv_out[i] = uv_of(surface, at.point)


def looked_up(surface: UvSurface, uv: np.ndarray) -> list[np.ndarray]:
    """Point, df/du, df/dv, and (u, v) of the point."""
    outputs = [wp.zeros(len(uv), dtype=kind, device=CPU) for kind in (wp.vec3d, wp.vec3d, wp.vec3d, wp.vec2d)]
    launch.launch(look_up, len(uv), [surface, wp.array(uv, dtype=wp.vec2d, device=CPU), *outputs], CPU)
    return [output.numpy() for output in outputs]


def exact_point(uv: np.ndarray) -> np.ndarray:
    """(n, 3) float64: f of the ellipsoid, from O."""
    u, v = uv.T[..., None]
    axes = pole_axes(POLE)
    way = np.sin(v) * (np.cos(u) * axes[0] + np.sin(u) * axes[1]) + np.cos(v) * axes[2]
    return way * (way**2 @ SEMIAXES**-2.0)[:, None] ** -0.5


def random_uv(count: int) -> np.ndarray:
    return RNG.uniform([0.0, 0.0], [2.0 * np.pi, np.pi], size=(count, 2))


def test_axes_are_at_right_angles_and_the_last_is_the_pole() -> None:
    axes = pole_axes(POLE)
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(axes[2], POLE / np.linalg.norm(POLE))
    assert np.linalg.det(axes) > 0.0


def test_points_and_derivatives_err_by_the_square_of_the_samples_distance() -> None:
    uv, step = random_uv(20_000), 1e-5
    exact = [
        exact_point(uv),
        *((exact_point(uv + way) - exact_point(uv - way)) / (2.0 * step) for way in step * np.eye(2)),
    ]
    worst = np.array(
        [
            [np.abs(found - true).max() for found, true in zip(looked_up(ellipsoid(rows), uv)[:3], exact, strict=True)]
            for rows in (32, 64)
        ]
    )
    assert (worst[1] < 0.3 * worst[0]).all() and worst[1].max() < 5e-3, worst


def test_parameters_of_a_point() -> None:
    uv = random_uv(2000)
    found = looked_up(ellipsoid(256), uv)[3]
    turns = (found[:, 0] - uv[:, 0]) / (2.0 * np.pi)
    sine = np.sin(uv[:, 1])
    np.testing.assert_allclose((turns - turns.round()) * sine, 0.0, atol=1e-4)
    np.testing.assert_allclose(found[:, 1], uv[:, 1], atol=1e-4)


@pytest.mark.parametrize("turns", [(1, 0), (-3, 0), (0, 1), (1000, -2)])
def test_both_parameters_go_round(turns: tuple[int, int]) -> None:
    uv, way = random_uv(500), 2.0 * np.pi * np.array(turns)
    surface = ellipsoid()
    for found, expected in zip(looked_up(surface, uv + way)[:3], looked_up(surface, uv)[:3], strict=True):
        np.testing.assert_allclose(found, expected, atol=2e-6)


def test_past_a_pole_the_meridian_goes_on_down_the_other_side() -> None:
    uv = np.array([[0.7, -0.2], [3.0, np.pi + 0.3]])
    other = np.array([[0.7 + np.pi, 0.2], [3.0 - np.pi, np.pi - 0.3]])
    point, du, dv, _ = looked_up(ellipsoid(), uv)
    there, du_there, dv_there, _ = looked_up(ellipsoid(), other)
    np.testing.assert_allclose(point, there, atol=1e-6)
    np.testing.assert_allclose(du, du_there, atol=1e-6)
    np.testing.assert_allclose(dv, -dv_there, atol=1e-6)


def test_at_a_pole_one_derivative_is_0() -> None:
    point, du, dv, _ = looked_up(ellipsoid(), np.array([[1.0, 0.0], [2.0, 0.0], [2.0, np.pi]]))
    np.testing.assert_allclose(point[0], point[1], atol=1e-6)
    np.testing.assert_allclose(du, 0.0, atol=1e-6)
    assert (np.linalg.norm(dv, axis=1) > 0.5).all()


def test_an_open_surface_has_no_points_where_it_is_open() -> None:
    bowl = make("bowl", {"closed": False, "depth": 1.0})
    shape = star_shape(bowl.vertices, bowl.faces, bowl.normals, "bowl")
    surface = uv_surface(shape, np.array([0.0, 0.0, 1.0]), 64, CPU)
    assert surface.is_closed == 0 and ellipsoid(8).is_closed == 1
    top, rim = bowl.bounds[1, 2] - shape.centre[2], bowl.bounds[1, 0]
    at_rim, texel = np.arctan2(rim, top), np.pi / 64
    uv = random_uv(5000)
    exists = np.abs(looked_up(surface, uv)[0]).max(axis=1) > 0.0
    assert exists[uv[:, 1] > at_rim + 1.01 * texel].all() and not exists[uv[:, 1] < at_rim - 0.01].any()


def test_memory_that_is_not_allowed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(budget, "memory_limit", lambda: 100_000)
    with pytest.raises(ldtrefl.InputError, match=r"^textures of a mirror, 33024 samples needs .*resolution"):
        ellipsoid()
