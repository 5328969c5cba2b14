"""``occluded``: whether a ray meets anything before a distance, answered as ``trace`` would be."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import pytest
from stress_cases import edges
from stress_cases.edge_truth import Surface
from stress_cases.inputs import rays_about
from stress_cases.truth import brute_force

import ldtrefl
from ldtrefl.scene import shapes

MESHES = {
    "box": ("box", {}),
    "knot": ("torus_knot", {"segments": [96, 16]}),
    "dense knot": ("torus_knot", {"segments": [2000, 125]}),  # patches stand for its triangles
}
TRACERS = ("exact", "balanced", "bvh")


@functools.cache
def mesh_of(name: str) -> ldtrefl.Mesh:
    """A closed mesh."""
    shape, params = MESHES[name]
    return edges.welded(shapes.make(shape, params))


@functools.cache
def tracer_of(by: str, name: str) -> Any:
    """A tracer of this mesh, with the methods ``trace`` and ``occluded``."""
    mesh = mesh_of(name)
    if by == "bvh":
        return ldtrefl.Raycaster(mesh.vertices, mesh.faces)
    return ldtrefl.peel(mesh.vertices, mesh.faces, quality=by)


@functools.cache
def rays_at(name: str) -> tuple[np.ndarray, np.ndarray]:
    """Random rays from outside, rays from anywhere in the box, rays from within, grazing ones, and along axes."""
    mesh, rng = mesh_of(name), np.random.default_rng(3)
    surface = Surface(mesh)
    kinds = [rays_about(mesh, 5000, 1)]
    kinds.append((rng.uniform(*mesh.bounds, (5000, 3)), rng.normal(size=(5000, 3))))
    kinds += [make(surface, 3000, rng) for make in (edges.from_within, edges.grazing, edges.along_axes)]
    origins, directions = (np.concatenate(parts).astype(np.float32) for parts in zip(*kinds, strict=True))
    return origins, directions


@pytest.mark.parametrize("by", TRACERS)
@pytest.mark.parametrize("name", MESHES)
def test_it_is_what_trace_meets_before_t_max(name: str, by: str) -> None:
    """Without a limit, with one limit for all rays, and with limits just before and just behind what each ray meets."""
    tracer, (origins, directions) = tracer_of(by, name), rays_at(name)
    t = tracer.trace(origins, directions).t
    assert 0.2 < np.isfinite(t).mean() < 1.0
    np.testing.assert_array_equal(tracer.occluded(origins, directions), np.isfinite(t))
    for t_max in (0.05, 0.7, 2.5, np.inf):
        is_clear = np.abs(t - t_max) > 1e-5 * t_max if np.isfinite(t_max) else np.ones(len(t), bool)
        answer = tracer.occluded(origins, directions, t_max=t_max)
        np.testing.assert_array_equal(answer[is_clear], (t < t_max)[is_clear])
    # A ray cannot be stopped short of what it meets at its very start.
    hit = np.isfinite(t) & (t > 1e-3)
    rays = origins[hit], directions[hit]
    assert not tracer.occluded(*rays, t_max=t[hit] * np.float32(0.999)).any()
    assert tracer.occluded(*rays, t_max=t[hit] * np.float32(1.001)).all()


@pytest.mark.parametrize("by", ["exact", "bvh"])
def test_float64_says_the_same(by: str) -> None:
    """Random rays, of which none comes within rounding of an edge."""
    mesh = mesh_of("knot")
    origins, directions = rays_about(mesh, 3000, 5)
    true_t, _ = brute_force(mesh, origins, directions)
    for t_max in (2.2, np.inf):
        np.testing.assert_array_equal(tracer_of(by, "knot").occluded(origins, directions, t_max=t_max), true_t < t_max)


@pytest.mark.parametrize("by", TRACERS)
def test_shapes_and_limits_of_any_shape(by: str) -> None:
    tracer, (origins, directions) = tracer_of(by, "knot"), rays_at("knot")
    origins, directions = origins[:210].reshape(5, 6, 7, 3), directions[:210].reshape(5, 6, 7, 3)
    t = tracer.trace(origins.reshape(-1, 3), directions.reshape(-1, 3)).t.reshape(5, 6, 7)
    answer = tracer.occluded(origins, directions)
    assert isinstance(answer, np.ndarray) and answer.dtype == bool and answer.shape == (5, 6, 7)
    np.testing.assert_array_equal(answer, np.isfinite(t))
    middle = float(np.median(t[np.isfinite(t)]))
    for shape in ((), (1,), (7,), (6, 1), (5, 1, 7), (5, 6, 7)):
        t_max = middle * np.random.default_rng(0).uniform(0.2, 3.0, shape)
        np.testing.assert_array_equal(tracer.occluded(origins, directions, t_max=t_max), t < t_max)
    assert tracer.occluded(origins, directions, t_max=t_max.tolist()).shape == (5, 6, 7)
    one = tracer.occluded(origins[0, 0, 0], directions[0, 0, 0])
    assert np.shape(one) == () and bool(one) == bool(answer[0, 0, 0])
    assert tracer.occluded(np.zeros((0, 3)), np.zeros((0, 3))).shape == (0,)
    assert tracer.occluded(np.zeros((2, 0, 3)), np.ones((2, 0, 3)), t_max=1.0).shape == (2, 0)


@pytest.mark.parametrize("by", TRACERS)
def test_limits_that_leave_nothing(by: str) -> None:
    """Nothing is met before 0, before NaN, and before minus infinity."""
    tracer, (origins, directions) = tracer_of(by, "box"), rays_at("box")
    for t_max in (0.0, -1.0, np.nan, -np.inf):
        assert not tracer.occluded(origins, directions, t_max=t_max).any()


@pytest.mark.parametrize("by", TRACERS)
@pytest.mark.parametrize("length", [1e-20, 1e-3, 7.0, 1e18])
def test_t_max_is_in_lengths_of_the_direction(by: str, length: float) -> None:
    tracer, (origins, directions) = tracer_of(by, "knot"), rays_about(mesh_of("knot"), 5000, 1)
    hits = tracer.trace(origins, directions)
    t_max = np.where(np.isfinite(hits.t), 1.5 * hits.t + 1e-3, 1.0)
    expected = tracer.occluded(origins, directions, t_max=t_max)
    assert expected.any() and not expected.all()
    scaled = tracer.occluded(origins, directions * np.float32(length), t_max=t_max / length)
    np.testing.assert_array_equal(scaled, expected)


@pytest.mark.parametrize("by", TRACERS)
def test_rays_that_are_none_are_not_occluded(by: str) -> None:
    """Rays that are zero, NaN or infinite; the others are answered as without them, and no warning is given."""
    tracer = tracer_of(by, "box")
    odd = np.array([[0, 0, 0], [np.nan, 0, 1], [np.inf, 0, 0], [0, 0, 1]], np.float32)
    assert tracer.occluded(np.float32([[0, 0, -5]] * 4), odd).tolist() == [False, False, False, True]
    starts = np.float32([[np.nan, 0, -5], [0, -np.inf, -5], [0.3, 0.2, -5], [0.3, 0.2, 5]])
    assert tracer.occluded(starts, np.float32([[0, 0, 1]] * 4)).tolist() == [False, False, True, False]


@pytest.mark.parametrize("by", TRACERS)
@pytest.mark.parametrize(
    ("origins", "directions", "t_max"),
    [
        (np.zeros((5, 2)), np.ones((5, 3)), None),
        (np.zeros((5, 3)), np.ones((5, 4)), None),
        (np.zeros((5, 3)), np.ones((4, 3)), None),
        (np.zeros(()), np.ones(()), None),
        ("rays", np.ones((5, 3)), None),
        (np.zeros((5, 3)), np.ones((5, 3)), np.ones(4)),
        (np.zeros((5, 3)), np.ones((5, 3)), np.ones((5, 5))),
        (np.zeros((5, 3)), np.ones((5, 3)), "far"),
    ],
)
def test_what_does_not_fit_is_refused_in_one_line(by: str, origins: Any, directions: Any, t_max: Any) -> None:
    with pytest.raises(ldtrefl.InputError) as refused:
        tracer_of(by, "box").occluded(origins, directions, t_max=t_max)
    assert "\n" not in str(refused.value)
    assert any(word in str(refused.value) for word in ("origins", "directions", "t_max"))


@pytest.mark.parametrize("by", TRACERS)
def test_what_was_given_stays_as_it_was(by: str) -> None:
    origins, directions = (x[:100].astype(float) for x in rays_at("box"))
    t_max = np.full(100, 2.0)
    given = [x.copy() for x in (origins, directions, t_max)]
    first = tracer_of(by, "box").occluded(origins, directions, t_max=t_max)
    for before, after in zip(given, (origins, directions, t_max), strict=True):
        np.testing.assert_array_equal(before, after)
    kept = first.copy()
    tracer_of(by, "box").occluded(origins + 10.0, directions)
    np.testing.assert_array_equal(first, kept)
